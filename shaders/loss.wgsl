// Errors and what they add to a sum.

// The error of what the sensors show: x and y of a sample are measured current and speed, or what the reference leaves
// of them.
fn residual(sample: Sample, x: Lanes2) -> Lanes2 {
    return Lanes2(sample.x - x.i, sample.y - x.w);
}

fn lose(e: Lanes, weight: Scalar, sum: Lanes) -> Lanes {
    var part = e * e;
    if ABSOLUTE {
        part = abs(e);
    }
    if WEIGHTED {
        part *= weight;
    }
    return sum + part;
}

fn weight_of(at: u32) -> Pair {
    if WEIGHTED {
        return weights[at];
    }
    return Pair();
}
