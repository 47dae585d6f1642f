// Coulomb friction and brush drop: set-valued reactions that are constant over a step. Each takes the value that makes its
// state zero at the end of the step, clipped to its limits, so that it can stop the motor, or the current, but not reverse it.
// Same operations in Rust: src/motor/friction.rs.

struct Reactions {
    // Largest magnitude that a reaction subtracts from its own state.
    limits: Lanes2,
    // Change of the other state per unit subtracted from the own state.
    adds: Lanes2,
}

fn load_reactions(at: u32, constants: u32) -> Reactions {
    let brushes = maps[constants + AT_vb] * abs(maps[at + 4u] + maps[at + 6u]);
    let friction = maps[constants + AT_Tc] * abs(maps[at + 9u]);
    return Reactions(Lanes2(brushes, friction), Lanes2(maps[at + 10u], maps[at + 11u]));
}

// Clips by `select`, because `min` and `max` take twice the operations on devices that define them for NaN.
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
