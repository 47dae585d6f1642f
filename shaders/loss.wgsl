// What an error adds to a sum.

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
