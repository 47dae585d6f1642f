//! The table of functions that an expression may call.

use motorfit_core::named::named;

named! {
    /// A function of the model language.
    pub enum Function: usize {
        /// Sine of an angle.
        Sin = "sin" => 1,
        /// Cosine of an angle.
        Cos = "cos" => 1,
        /// Tangent of an angle.
        Tan = "tan" => 1,
        /// Exponential function.
        Exp = "exp" => 1,
        /// Natural logarithm.
        Log = "log" => 1,
        /// Square root.
        Sqrt = "sqrt" => 1,
        /// Absolute value.
        Abs = "abs" => 1,
        /// −1, 0 or 1 with the sign of the argument.
        Sign = "sign" => 1,
        /// Hyperbolic tangent.
        Tanh = "tanh" => 1,
        /// Arc tangent, in (−π/2, π/2).
        Atan = "atan" => 1,
        /// `atan2(y, x)`: the angle of the point (x, y), in (−π, π].
        Atan2 = "atan2" => 2,
        /// The smaller of two values.
        Min = "min" => 2,
        /// The larger of two values.
        Max = "max" => 2,
        /// `clamp(x, low, high)`: `min(max(x, low), high)`.
        Clamp = "clamp" => 3,
        /// `pow(x, y)`: the same as `x^y`.
        Pow = "pow" => 2,
        /// `select(condition, a, b)`: `a` if the condition holds, else `b`; both are computed.
        Select = "select" => 3,
        /// `deadzone(x, width)`: `x` less the part of it within ±width.
        Deadzone = "deadzone" => 2,
        /// `stick(state, limit)`: set-valued friction. Over each step it is the constant reaction within ±limit that brings the state to zero, or the limit that opposes it.
        Stick = "stick" => 2,
        /// `hold(x, period)`: a sampled law. It is computed at the multiples of a constant period from the start of the recording, and held between them.
        Hold = "hold" => 2,
    }
}

impl Function {
    /// Returns the number of arguments.
    #[must_use]
    pub const fn arguments(self) -> usize {
        self.row()
    }
}
