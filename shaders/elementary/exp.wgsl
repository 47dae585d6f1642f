// Exponential and hyperbolic tangent. Same operations in Rust: crates/evaluate/src/interpreter/functions.rs.

// s and q with exp(x) = s (1 + q), s a power of two.
fn exp_parts(x: Scalar) -> vec2<Scalar> {
    let limited = clamp(x, EXP_MIN, EXP_MAX);
    let k = round(limited * LOG2_E);
    let r = fma(k, -LN2_LOW, fma(k, -LN2_HIGH, limited));
    var p = Scalar(1.0 / 479001600.0);
    p = fma(p, r, Scalar(1.0 / 39916800.0));
    p = fma(p, r, Scalar(1.0 / 3628800.0));
    p = fma(p, r, Scalar(1.0 / 362880.0));
    p = fma(p, r, Scalar(1.0 / 40320.0));
    p = fma(p, r, Scalar(1.0 / 5040.0));
    p = fma(p, r, Scalar(1.0 / 720.0));
    p = fma(p, r, Scalar(1.0 / 120.0));
    p = fma(p, r, Scalar(1.0 / 24.0));
    p = fma(p, r, Scalar(1.0 / 6.0));
    p = fma(p, r, Scalar(0.5));
    return vec2<Scalar>(ldexp(Scalar(1.0), i32(k)), fma(p * r, r, r));
}

fn exponential(x: Scalar) -> Scalar {
    let parts = exp_parts(x);
    return select(fma(parts.x, parts.y, parts.x), Scalar(0.0), x < EXP_MIN);
}

fn hyperbolic_tangent(x: Scalar) -> Scalar {
    let parts = exp_parts(Scalar(-2.0) * abs(x));
    let minus_one = fma(parts.x, parts.y, parts.x - Scalar(1.0));
    let value = -minus_one / (minus_one + Scalar(2.0));
    return select(value, -value, x < Scalar(0.0));
}
