// One step of the deviation from a reference trajectory. Under constant inputs the deviation tends to an equilibrium r. The
// state is s, the deviation minus r: s+ = s + (D s + P z), where z (z and w of the sample) is the increment of the reference,
// and P z is the difference between the increments of candidate and reference from the reference's state
// (crates/gpu/src/reference.rs). Near the reference all terms are small, and so are their rounding errors; in the steady
// state s and z are 0.
// Map fields: D (4), P (4), equilibrium per unit of voltage at the start (2) and the end (2) of a step, and of torque (2).

struct Map {
    d00: Lanes, d01: Lanes, d10: Lanes, d11: Lanes,
    p00: Lanes, p01: Lanes, p10: Lanes, p11: Lanes,
}

fn load_map(at: u32) -> Map {
    return Map(
        maps[at], maps[at + 1u], maps[at + 2u], maps[at + 3u],
        maps[at + 4u], maps[at + 5u], maps[at + 6u], maps[at + 7u],
    );
}

// Returns the equilibrium r for the inputs of a segment.
fn gain(at: u32, input: vec4<Scalar>) -> Lanes2 {
    return Lanes2(
        maps[at + 8u] * input.x + maps[at + 10u] * input.y + maps[at + 12u] * input.z,
        maps[at + 9u] * input.x + maps[at + 11u] * input.y + maps[at + 13u] * input.z,
    );
}

// Returns the deviation.
fn observe(s: Lanes2, r: Lanes2) -> Lanes2 {
    return Lanes2(s.i + r.i, s.w + r.w);
}

// Returns s after a change of the inputs, which changes r and not the deviation.
fn enter(s: Lanes2, before: Lanes2, r: Lanes2) -> Lanes2 {
    return Lanes2(s.i + (before.i - r.i), s.w + (before.w - r.w));
}

fn advance(s: Lanes2, map: Map, r: Lanes2, sample: Sample) -> Lanes2 {
    let force_i = map.p00 * sample.z + map.p01 * sample.w;
    let force_w = map.p10 * sample.z + map.p11 * sample.w;
    return Lanes2(
        s.i + (map.d00 * s.i + (map.d01 * s.w + force_i)),
        s.w + (map.d10 * s.i + (map.d11 * s.w + force_w)),
    );
}
