// One step without deviations: x+ = x + (D x + g). The states are current and speed.
// Map fields: D (4), gains of the voltage at the start (2) and the end (2) of the step and of the torque (2).

struct Map {
    d00: Lanes, d01: Lanes, d10: Lanes, d11: Lanes,
}

fn load_map(at: u32) -> Map {
    return Map(maps[at], maps[at + 1u], maps[at + 2u], maps[at + 3u]);
}

fn gain(at: u32, input: vec4<Scalar>) -> Lanes2 {
    return Lanes2(
        maps[at + 4u] * input.x + maps[at + 6u] * input.y + maps[at + 8u] * input.z,
        maps[at + 5u] * input.x + maps[at + 7u] * input.y + maps[at + 9u] * input.z,
    );
}

// Returns the sensor outputs, which are the state here.
fn observe(x: Lanes2, g: Lanes2) -> Lanes2 {
    return x;
}

// Returns the state after a change of the inputs, which does not change it here.
fn enter(x: Lanes2, before: Lanes2, g: Lanes2) -> Lanes2 {
    return x;
}

fn advance(x: Lanes2, map: Map, g: Lanes2, sample: Sample) -> Lanes2 {
    return Lanes2(
        x.i + (map.d00 * x.i + (map.d01 * x.w + g.i)),
        x.w + (map.d10 * x.i + (map.d11 * x.w + g.w)),
    );
}
