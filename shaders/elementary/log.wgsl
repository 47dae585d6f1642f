// Natural logarithm and powers. Same polynomial in Rust: crates/evaluate/src/interpreter/functions.rs.

// Multiplies a mantissa by 2^-by if it is at least 2^by, and counts the exponent.
fn lowered(x: vec2<Scalar>, factor: Scalar, by: Scalar) -> vec2<Scalar> {
    return select(x, vec2<Scalar>(x.x / factor, x.y + by), x.x >= factor);
}

// Multiplies a mantissa by 2^by if the product is below 2, and counts the exponent.
fn raised(x: vec2<Scalar>, factor: Scalar, by: Scalar) -> vec2<Scalar> {
    return select(x, vec2<Scalar>(x.x * factor, x.y - by), x.x * factor < Scalar(2.0));
}

fn logarithm(x: Scalar) -> Scalar {
    let parts = normalized(x);
    let is_high = parts.x > Scalar(1.4142135623730951);
    let mantissa = select(parts.x, Scalar(0.5) * parts.x, is_high);
    let k = select(parts.y, parts.y + Scalar(1.0), is_high);
    let f = mantissa - Scalar(1.0);
    let s = f / (Scalar(2.0) + f);
    let z = s * s;
    var r = Scalar(1.4798198605116586e-1);
    r = fma(r, z, Scalar(1.5313837699209373e-1));
    r = fma(r, z, Scalar(1.818357216161805e-1));
    r = fma(r, z, Scalar(2.2222198432149784e-1));
    r = fma(r, z, Scalar(2.857142874366239e-1));
    r = fma(r, z, Scalar(3.999999999940942e-1));
    r = fma(r, z, Scalar(6.666666666666735e-1));
    r *= z;
    let half_square = Scalar(0.5) * f * f;
    let value = fma(k, LN2_HIGH, f - (half_square - fma(s, half_square + r, k * LN2_LOW)));
    // Not a number below zero: a value beyond all limits.
    return select(-HUGE, value, x > Scalar(0.0));
}

// The power of a base of at least zero.
fn power(x: Scalar, y: Scalar) -> Scalar {
    let of_zero = select(select(Scalar(1.0), HUGE, y < Scalar(0.0)), Scalar(0.0), y > Scalar(0.0));
    return select(exponential(y * logarithm(x)), of_zero, x == Scalar(0.0));
}
