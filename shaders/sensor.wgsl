// What the sensors would have shown against what they did: x and y of a sample are measured current and speed, or
// what of them the reference leaves.

fn residual(sample: Sample, x: Lanes2) -> Lanes2 {
    return Lanes2(sample.x - x.i, sample.y - x.w);
}
