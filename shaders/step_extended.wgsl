// One step of a motor with extensions: the step of the linear motor, then the reactions of brushes and friction.
// Map fields: D (4), gains of the voltage at the start (2) and the end (2) of the step and of the torque (2), contributions of
// the reactions to the other state (2).

struct Step {
    d00: Lanes, d01: Lanes, d10: Lanes, d11: Lanes,
    reactions: Reactions,
}

fn load_step(at: u32, constants: u32) -> Step {
    return Step(maps[at], maps[at + 1u], maps[at + 2u], maps[at + 3u], load_reactions(at, constants));
}

// Returns the contribution of the inputs of a segment at each step; of the torque only, if the voltage is delayed.
fn gain(at: u32, drive: Drive, load: Lanes, input: vec4<Scalar>) -> Lanes2 {
    let torque = load + input.z;
    let g = Lanes2(maps[at + 8u] * torque, maps[at + 9u] * torque);
    if DELAYED {
        return g;
    }
    let start = output(drive, Lanes(input.x));
    let end = output(drive, Lanes(input.y));
    return Lanes2(
        maps[at + 6u] * end + (maps[at + 4u] * start + g.i),
        maps[at + 7u] * end + (maps[at + 5u] * start + g.w),
    );
}

fn advance(x: Lanes2, step: Step, acts: Acting, bend_at: Lanes) -> Lanes2 {
    let g = acts.gain;
    let next = Lanes2(
        x.i + (step.d00 * x.i + (step.d01 * x.w + g.i)),
        x.w + (step.d10 * x.i + (step.d11 * x.w + g.w)),
    );
    return friction_step(x, next, acts.added, bend_at, step.reactions);
}
