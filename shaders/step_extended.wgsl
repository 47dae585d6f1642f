// One step of a motor with friction and brushes: the free step of the linear motor, then the drop of the brushes, a
// voltage against the current, then friction, a torque against the movement. Both are held over the step, within their
// limits as large as ends it at zero.
// Map fields: D (4), gains of the voltage at the start (2) and the end (2) of the step, of the torque (2), and the
// reactions that end current and speed at zero, per unit of them (2).

struct Step {
    d00: Lanes, d01: Lanes, d10: Lanes, d11: Lanes,
    // What one unit of each reaction adds.
    drop: Lanes2,
    friction: Lanes2,
    needed: Lanes2,
    limit: Lanes2,
}

fn load_step(at: u32, constants: u32) -> Step {
    return Step(
        maps[at], maps[at + 1u], maps[at + 2u], maps[at + 3u],
        Lanes2(-(maps[at + 4u] + maps[at + 6u]), -(maps[at + 5u] + maps[at + 7u])),
        Lanes2(maps[at + 8u], maps[at + 9u]),
        Lanes2(maps[at + 10u], maps[at + 11u]),
        Lanes2(maps[constants], maps[constants + 1u]),
    );
}

// Of a reaction what is within its limit. By choices, because the least of two numbers takes twice the operations on
// devices that promise what it is of no number.
fn within(reaction: Lanes, limit: Lanes) -> Lanes {
    let low = select(-limit, reaction, reaction > -limit);
    return select(limit, low, low < limit);
}

fn react(x: Lanes2, adds: Lanes2, needed: Lanes, limit: Lanes) -> Lanes2 {
    let reaction = within(needed, limit);
    return Lanes2(x.i + adds.i * reaction, x.w + adds.w * reaction);
}

fn advance(x: Lanes2, step: Step, g: Lanes2) -> Lanes2 {
    var next = Lanes2(
        x.i + (step.d00 * x.i + (step.d01 * x.w + g.i)),
        x.w + (step.d10 * x.i + (step.d11 * x.w + g.w)),
    );
    if BRUSHES {
        next = react(next, step.drop, step.needed.i * next.i, step.limit.i);
    }
    return react(next, step.friction, step.needed.w * next.w, step.limit.w);
}
