// Sine, and cosine with one more quarter of a turn. Same operations in Rust: crates/evaluate/src/interpreter/functions.rs.

fn sine(x: Scalar, quarters: i32) -> Scalar {
    let k = round(x * FRAC_2_PI);
    let r = fma(k, -FRAC_PI_2_LOW, fma(k, -FRAC_PI_2_MIDDLE, fma(k, -FRAC_PI_2_HIGH, x)));
    let z = r * r;
    var s = Scalar(1.58969099521155e-10);
    s = fma(s, z, Scalar(-2.5050760253406863e-8));
    s = fma(s, z, Scalar(2.7557313707070068e-6));
    s = fma(s, z, Scalar(-1.984126982985795e-4));
    s = fma(s, z, Scalar(8.33333333332249e-3));
    s = fma(s, z, Scalar(-1.6666666666666632e-1));
    s = fma(s * z, r, r);
    var c = Scalar(-1.1359647557788195e-11);
    c = fma(c, z, Scalar(2.087572321298175e-9));
    c = fma(c, z, Scalar(-2.7557314351390663e-7));
    c = fma(c, z, Scalar(2.480158728947673e-5));
    c = fma(c, z, Scalar(-1.388888888887411e-3));
    c = fma(c, z, Scalar(4.166666666666666e-2));
    c = fma(c * z, z, fma(z, Scalar(-0.5), Scalar(1.0)));
    let quadrant = i32(k) + quarters;
    let value = select(s, c, (quadrant & 1) != 0);
    return select(value, -value, (quadrant & 2) != 0);
}

fn tangent(x: Scalar) -> Scalar {
    return sine(x, 0) / sine(x, 1);
}
