//! Floating-point types of shaders: their literals and the constants of the elementary functions.

use motorfit_core::named::named;
use std::fmt::Write as _;

named! {
    /// Floating-point type of a shader of a model.
    pub enum ShaderPrecision {
        /// Single precision.
        F32 = "f32",
        /// Double precision, which a device must offer.
        F64 = "f64",
    }
}

impl ShaderPrecision {
    /// Returns the size of a number \[bytes\].
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns a value beyond all others.
    pub(super) fn huge(self) -> f64 {
        match self {
            Self::F32 => 3e38,
            Self::F64 => 1e308,
        }
    }

    /// Returns the bound of values; the square of a smaller one is finite.
    pub(crate) fn bound(self) -> f64 {
        match self {
            Self::F32 => 1e18,
            Self::F64 => 1e150,
        }
    }

    /// Returns a constant as an expression; `None` if it is not a number.
    pub(super) fn literal(self, value: f64) -> Option<String> {
        let huge = self.huge();
        let value = if self == Self::F32 && value.abs() < f64::from(f32::MIN_POSITIVE) { 0.0 } else { value };
        (!value.is_nan()).then(|| format!("Scalar({:?})", value.clamp(-huge, huge)))
    }

    /// Returns the definitions of the type and of its constants.
    pub(super) fn prelude(self) -> String {
        // Parts of ln 2 and π/2: products of the high parts with a small integer are exact.
        let (ln2, half_pi, exp) = match self {
            Self::F32 => (
                ["0.693359375", "-2.12194440e-4"],
                ["1.5703125", "4.837512969970703e-4", "7.549789948768648e-8"],
                ["-87.0", "88.0"],
            ),
            Self::F64 => (
                ["6.931471803691238e-1", "1.9082149292705877e-10"],
                ["1.5707963267341256", "6.077100506303966e-11", "2.0222662487959506e-21"],
                ["-708.0", "709.0"],
            ),
        };
        let [huge, bound] = [self.huge(), self.bound()].map(|value| format!("{value:?}"));
        let constants = [
            ("HUGE", huge.as_str()),
            ("BOUND", &bound),
            ("EXP_MIN", exp[0]),
            ("EXP_MAX", exp[1]),
            ("LOG2_E", "1.4426950408889634"),
            ("LN2_HIGH", ln2[0]),
            ("LN2_LOW", ln2[1]),
            ("FRAC_2_PI", "0.6366197723675814"),
            ("FRAC_PI_2_HIGH", half_pi[0]),
            ("FRAC_PI_2_MIDDLE", half_pi[1]),
            ("FRAC_PI_2_LOW", half_pi[2]),
            ("FRAC_PI_4", "0.7853981633974483"),
        ];
        let define = |(name, value): (&str, &str)| format!("const {name} = Scalar({value});\n");
        format!("alias Scalar = {};\n{}", self.name(), constants.map(define).concat())
    }

    /// Returns the function that divides a positive number into a mantissa from 1 to 2 and an exponent.
    pub(super) fn normalized(self) -> String {
        let highest = if self == Self::F32 { 6 } else { 9 };
        let mut lines = String::new();
        for name in ["lowered", "raised"] {
            for power in (0..=highest).rev() {
                let by = 1_i32 << power;
                let _ = writeln!(lines, "    parts = {name}(parts, Scalar({:?}), Scalar({by}.0));", 2_f64.powi(by));
            }
        }
        format!(
            "fn normalized(x: Scalar) -> vec2<Scalar> {{\n    var parts = vec2<Scalar>(x, Scalar(0.0));\n{lines}    return parts;\n}}\n"
        )
    }
}
