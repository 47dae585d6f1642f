// Coulomb friction and brush drop: reactions that are constant over a step and as large as it takes to end it at zero,
// clipped to their limits: they can stop the motor, or the current, but not reverse it. Twin: src/motor/friction.rs.

struct Reactions {
    // The most that a reaction takes off its own state.
    limits: Lanes2,
    // The change of the other state for each unit that it takes off its own.
    adds: Lanes2,
}

fn load_reactions(at: u32, constants: u32) -> Reactions {
    let brushes = maps[constants + AT_vb] * abs(maps[at + 4u] + maps[at + 6u]);
    let friction = maps[constants + AT_Tc] * abs(maps[at + 9u]);
    return Reactions(Lanes2(brushes, friction), Lanes2(maps[at + 10u], maps[at + 11u]));
}

// By choices, because the least of two numbers takes twice the operations on devices that promise what it is of NaN.
fn clip(value: Lanes, limit: Lanes) -> Lanes {
    let low = select(-limit, value, value > -limit);
    return select(limit, low, low < limit);
}

fn friction_step(x: Lanes2, reactions: Reactions) -> Lanes2 {
    var next = x;
    if BRUSHES {
        let taken = clip(next.i, reactions.limits.i);
        next = Lanes2(next.i - taken, reactions.adds.i * taken + next.w);
    }
    let taken = clip(next.w, reactions.limits.w);
    return Lanes2(reactions.adds.w * taken + next.i, next.w - taken);
}
