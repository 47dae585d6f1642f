// Arc tangents. Same operations in Rust: crates/evaluate/src/interpreter/functions.rs.

fn arc_tangent(x: Scalar) -> Scalar {
    let size = abs(x);
    let is_large = size > Scalar(2.414213562373095);
    let is_middle = size > Scalar(0.41421356237309503);
    let middle = (size - Scalar(1.0)) / (size + Scalar(1.0));
    let reduced = select(select(size, middle, is_middle), Scalar(-1.0) / size, is_large);
    let base = select(select(Scalar(0.0), FRAC_PI_4, is_middle), Scalar(2.0) * FRAC_PI_4, is_large);
    let z = reduced * reduced;
    var n = Scalar(-8.750608600031904e-1);
    n = fma(n, z, Scalar(-1.615753718733365e1));
    n = fma(n, z, Scalar(-7.500855792314705e1));
    n = fma(n, z, Scalar(-1.2288666844901361e2));
    n = fma(n, z, Scalar(-6.485021904942025e1));
    var d = z + Scalar(2.4858464901423062e1);
    d = fma(d, z, Scalar(1.6502700983169885e2));
    d = fma(d, z, Scalar(4.3288106049129027e2));
    d = fma(d, z, Scalar(4.853903996359137e2));
    d = fma(d, z, Scalar(1.945506571482614e2));
    let value = fma(reduced * z, n / d, reduced) + base;
    return select(value, -value, x < Scalar(0.0));
}

// The angle of the point (x, y).
fn angle(y: Scalar, x: Scalar) -> Scalar {
    let half = select(Scalar(2.0) * FRAC_PI_4, Scalar(-2.0) * FRAC_PI_4, y < Scalar(0.0));
    let beyond = select(Scalar(0.0), Scalar(2.0) * half, x < Scalar(0.0));
    let on_axis = select(half, Scalar(0.0), y == Scalar(0.0));
    let divisor = select(x, Scalar(1.0), x == Scalar(0.0));
    return select(arc_tangent(y / divisor) + beyond, on_axis, x == Scalar(0.0));
}
