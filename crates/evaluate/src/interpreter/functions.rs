//! Elementary functions from arithmetic alone, so that loops over lanes become vector instructions.
//!
//! Coefficients and reductions are those of the fdlibm of Sun Microsystems (1993), for `exp` a Taylor polynomial of degree 12. Errors
//! are at most 2e-16 of the value (`tanh` 4e-16), for sine and cosine 2e-16 up to arguments of 10⁵. The tests compare with libm.

/// 1.5·2⁵²: adding it rounds to an integer, which then is in the low bits.
const MAGIC: f64 = 6_755_399_441_055_744.0;

#[inline(always)]
fn multiply_add<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
fn polynomial<const FMA: bool, const N: usize>(x: f64, highest: f64, others: [f64; N]) -> f64 {
    let mut sum = highest;
    for coefficient in others {
        sum = multiply_add::<FMA>(sum, x, coefficient);
    }
    sum
}

const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Returns s and q with `exp(x) = s (1 + q)`, s a power of two.
#[inline(always)]
fn exp_parts<const FMA: bool>(x: f64) -> (f64, f64) {
    // Comparisons instead of min and max, so that NaN remains NaN.
    let x = if x < -708.0 { -708.0 } else { x };
    let x = if x > 709.0 { 709.0 } else { x };
    let shifted = multiply_add::<FMA>(x, std::f64::consts::LOG2_E, MAGIC);
    let k = shifted - MAGIC;
    let r = multiply_add::<FMA>(k, -LN2_HIGH, x);
    let r = multiply_add::<FMA>(k, -LN2_LOW, r);
    let inverse_factorials = [
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
    ];
    let p = polynomial::<FMA, 10>(r, 1.0 / 479_001_600.0, inverse_factorials);
    let q = multiply_add::<FMA>(p * r, r, r);
    (f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52)), q)
}

/// Returns the exponential; 0 below −708 and 8e307 above 709 in place of smaller and larger values.
#[inline(always)]
pub(super) fn exp<const FMA: bool>(x: f64) -> f64 {
    let (scale, q) = exp_parts::<FMA>(x);
    let value = multiply_add::<FMA>(scale, q, scale);
    if x < -708.0 { 0.0 } else { value }
}

/// Returns the hyperbolic tangent.
#[inline(always)]
pub(super) fn tanh<const FMA: bool>(x: f64) -> f64 {
    let (scale, q) = exp_parts::<FMA>(-2.0 * x.abs());
    let minus_one = multiply_add::<FMA>(scale, q, scale - 1.0);
    (-minus_one / (minus_one + 2.0)).copysign(x)
}

/// Returns the sine, or the cosine if `COSINE`.
#[inline(always)]
pub(super) fn sine<const FMA: bool, const COSINE: bool>(x: f64) -> f64 {
    let shifted = multiply_add::<FMA>(x, std::f64::consts::FRAC_2_PI, MAGIC);
    let k = shifted - MAGIC;
    let r = multiply_add::<FMA>(k, -1.570_796_326_734_125_6, x);
    let r = multiply_add::<FMA>(k, -6.077_100_506_303_966e-11, r);
    let r = multiply_add::<FMA>(k, -2.022_266_248_795_950_6e-21, r);
    let z = r * r;
    let s = polynomial::<FMA, 5>(
        z,
        1.589_690_995_211_55e-10,
        [
            -2.505_076_025_340_686_3e-8,
            2.755_731_370_707_006_8e-6,
            -1.984_126_982_985_795e-4,
            8.333_333_333_322_49e-3,
            -1.666_666_666_666_663_2e-1,
        ],
    );
    let s = multiply_add::<FMA>(s * z, r, r);
    let c = polynomial::<FMA, 5>(
        z,
        -1.135_964_755_778_819_5e-11,
        [
            2.087_572_321_298_175e-9,
            -2.755_731_435_139_066_3e-7,
            2.480_158_728_947_673e-5,
            -1.388_888_888_887_411e-3,
            4.166_666_666_666_66e-2,
        ],
    );
    let c = multiply_add::<FMA>(c * z, z, multiply_add::<FMA>(z, -0.5, 1.0));
    let quadrant = shifted.to_bits().wrapping_add(u64::from(COSINE));
    let swap = 0_u64.wrapping_sub(quadrant & 1);
    f64::from_bits(((s.to_bits() & !swap) | (c.to_bits() & swap)) ^ ((quadrant & 2) << 62))
}

/// Returns the natural logarithm: −∞ at 0, NaN below.
#[inline(always)]
pub(super) fn log<const FMA: bool>(x: f64) -> f64 {
    let bits = x.to_bits();
    // The exponent such that the mantissa is in [√½, √2).
    let exponent = bits.wrapping_sub(0x3fe6_a09e_667f_3bcd).cast_signed() >> 52;
    let mantissa = f64::from_bits(bits.wrapping_sub((exponent << 52).cast_unsigned()));
    let k = f64::from_bits(exponent.cast_unsigned().wrapping_add(MAGIC.to_bits())) - MAGIC;
    let f = mantissa - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let r = polynomial::<FMA, 6>(
        z,
        1.479_819_860_511_658_6e-1,
        [
            1.531_383_769_920_937_3e-1,
            1.818_357_216_161_805e-1,
            2.222_219_843_214_978_4e-1,
            2.857_142_874_366_239e-1,
            3.999_999_999_940_942e-1,
            6.666_666_666_666_735e-1,
        ],
    );
    let r = r * z;
    let half_square = 0.5 * f * f;
    let value = k * LN2_HIGH - ((half_square - (s * (half_square + r) + k * LN2_LOW)) - f);
    let of_others = if x == 0.0 {
        f64::NEG_INFINITY
    } else if x > 0.0 {
        x
    } else {
        f64::NAN
    };
    if x > 0.0 && x < f64::INFINITY { value } else { of_others }
}

/// Returns `x` to the power `y`, for `x` ≥ 0.
#[inline(always)]
pub(super) fn power<const FMA: bool>(x: f64, y: f64) -> f64 {
    let of_zero = if y > 0.0 {
        0.0
    } else if y < 0.0 {
        f64::INFINITY
    } else {
        1.0
    };
    let value = exp::<FMA>(y * log::<FMA>(x));
    if x == 0.0 { of_zero } else { value }
}

/// Returns the arc tangent.
#[inline(always)]
pub(super) fn atan<const FMA: bool>(x: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
    let size = x.abs();
    // atan x = π/2 − atan 1/x above tan 3π/8, π/4 + atan (x−1)/(x+1) above tan π/8.
    let is_large = size > 2.414_213_562_373_095;
    let is_middle = size > 0.414_213_562_373_095_03;
    let middle = (size - 1.0) / (size + 1.0);
    let inner = if is_middle { middle } else { size };
    let reduced = if is_large { -1.0 / size } else { inner };
    let base = if is_middle { FRAC_PI_4 } else { 0.0 };
    let base = if is_large { FRAC_PI_2 } else { base };
    let z = reduced * reduced;
    // Moshier's rational approximation (Cephes, 1989).
    let numerator = polynomial::<FMA, 4>(
        z,
        -8.750_608_600_031_904e-1,
        [-1.615_753_718_733_365e1, -7.500_855_792_314_705e1, -1.228_866_684_490_136_1e2, -6.485_021_904_942_025e1],
    );
    let denominator = polynomial::<FMA, 5>(
        z,
        1.0,
        [
            2.485_846_490_142_306_2e1,
            1.650_270_098_316_988_5e2,
            4.328_810_604_912_902_7e2,
            4.853_903_996_359_137e2,
            1.945_506_571_482_614e2,
        ],
    );
    let value = multiply_add::<FMA>(reduced * z, numerator / denominator, reduced) + base;
    value.copysign(x)
}

/// Returns the angle of the point (x, y).
#[inline(always)]
pub(super) fn atan2<const FMA: bool>(y: f64, x: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, PI};
    let angle = atan::<FMA>(y / x);
    let beyond = if x < 0.0 { PI.copysign(y) } else { 0.0 };
    let of_axis = if y == 0.0 { if x.is_sign_negative() { PI.copysign(y) } else { y } } else { FRAC_PI_2.copysign(y) };
    if x == 0.0 || y == 0.0 { if y == 0.0 { of_axis } else { FRAC_PI_2.copysign(y) } } else { angle + beyond }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(points: impl Iterator<Item = f64>, own: fn(f64) -> f64, reference: fn(f64) -> f64) -> f64 {
        let error = |x: f64| {
            let (own, reference) = (own(x), reference(x));
            (own - reference).abs() / reference.abs().max(1e-300)
        };
        points.map(error).fold(0.0, f64::max)
    }

    #[test]
    fn functions_equal_those_of_libm() {
        let range = |from: f64, to: f64| (0..20_001).map(move |n| from + (to - from) * f64::from(n) / 20_000.0);
        let cases: [(&str, f64, f64); 10] = [
            ("exp", worst(range(-700.0, 700.0), exp::<true>, libm::exp), 4e-16),
            ("exp, separate", worst(range(-700.0, 700.0), exp::<false>, libm::exp), 1e-15),
            ("tanh", worst(range(-20.0, 20.0), tanh::<true>, libm::tanh), 1e-15),
            ("small tanh", worst(range(1e-9, 1e-3), tanh::<false>, libm::tanh), 1e-15),
            ("sin", worst(range(0.1, 3.0), sine::<true, false>, libm::sin), 5e-16),
            ("cos", worst(range(-1.5, 1.5), sine::<true, true>, libm::cos), 5e-16),
            ("log", worst(range(1e-3, 1e4), log::<true>, libm::log), 5e-16),
            ("atan", worst(range(-30.0, 30.0), atan::<true>, libm::atan), 5e-16),
            ("root", worst(range(0.0, 100.0), |x| power::<true>(x, 0.7), |x| libm::pow(x, 0.7)), 2e-15),
            ("power", worst(range(0.0, 100.0), |x| power::<false>(x, 3.3), |x| libm::pow(x, 3.3)), 4e-15),
        ];
        for (name, error, most) in cases {
            assert!(error <= most, "{name}: {error:e}");
        }
        let far = (0..1000).map(|n| 100.0 * f64::from(n) + 0.37);
        for x in far {
            assert!((sine::<true, false>(x) - libm::sin(x)).abs() < 3e-16, "{x}");
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "limits are exact")]
    fn limits_of_functions() {
        assert_eq!([exp::<true>(-1e4), exp::<true>(f64::NEG_INFINITY), exp::<true>(0.0)], [0.0, 0.0, 1.0]);
        assert!(exp::<true>(1e4) > 1e307 && exp::<true>(f64::NAN).is_nan());
        assert_eq!(log::<true>(0.0), f64::NEG_INFINITY);
        assert!(log::<true>(-1.0).is_nan() && log::<true>(f64::NAN).is_nan() && sine::<true, false>(f64::NAN).is_nan());
        assert_eq!([power::<true>(0.0, 0.0), power::<true>(0.0, 2.5), power::<true>(1.0, 7.0)], [1.0, 0.0, 1.0]);
        assert_eq!([tanh::<true>(40.0), tanh::<true>(-40.0), tanh::<true>(0.0)], [1.0, -1.0, 0.0]);
        for (y, x) in
            [(1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (-1.0, 2.0), (0.0, 1.0), (0.0, -1.0), (2.0, 0.0), (-2.0, 0.0)]
        {
            assert!((atan2::<true>(y, x) - libm::atan2(y, x)).abs() < 1e-15, "{y} {x}");
        }
    }
}
