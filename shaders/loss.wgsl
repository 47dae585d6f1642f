// Errors, and their contributions to the sums.

// Returns the error of the sensor outputs. The components x and y of a sample are measured current and speed, or the residuals
// of the reference in an evaluation of deviations.
fn residual(sample: Sample, x: Lanes2) -> Lanes2 {
    return Lanes2(sample.x - x.i, sample.y - x.w);
}

// Adds the weighted square or magnitude of an error to a sum.
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

// Returns true if no cost of a block is needed any more: the sums so far, times the factors z and w of the initial state, are above
// the limits.
fn is_above(total: Lanes2, initial: vec4<Scalar>, limit: Lanes) -> bool {
    let score = initial.z * total.i + initial.w * total.w;
    return all(limit >= Lanes()) && all(score > limit);
}

fn weight_of(at: u32) -> Pair {
    if WEIGHTED {
        return weights[at];
    }
    return Pair();
}
