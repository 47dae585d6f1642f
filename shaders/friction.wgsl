// Coulomb friction and brush drop: set-valued reactions. Each takes the value that makes its state zero at the end of the step,
// clipped to its limits, so that it can stop the motor, or the current, but not reverse it; where a state passes zero within a step,
// the reaction changes its sign there. Same operations in Rust, with the formulas: crates/motor/src/friction.rs.

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

fn is_passage(before: Lanes, x: Lanes, limit: Lanes) -> Choice {
    let along = select(x, -x, before < Lanes(0.0));
    let pulled = abs(before) - limit;
    return (before != Lanes(0.0)) & (along < select(limit, pulled, pulled < limit));
}

// Returns a state after a uniform motion from `before` to `x`, at most `limit` of which the reaction takes.
fn passed(before: Lanes, x: Lanes, limit: Lanes) -> Lanes {
    let is_back = before < Lanes(0.0);
    let own = is_passage(before, x, limit);
    let size = abs(before);
    let pull = size - select(x, -x, is_back);
    let duration = select(Lanes(1.0), pull + limit, own);
    let beyond = (Lanes(1.0) - size / duration) * (pull - limit);
    return select(x - clip(x, limit), select(-beyond, beyond, is_back), own);
}

// Returns what a reaction subtracts from its state, `before` at the start of the step and `x` at its end without the reaction;
// `added` of the motion begins at the fraction `bend_at` of the step.
fn taken(before: Lanes, x: Lanes, limit: Lanes, added: Lanes, bend_at: Lanes) -> Lanes {
    let clipped = clip(x, limit);
    let own = is_passage(before, x, limit);
    var after = select(x - clipped, passed(before, x, limit), own);
    if DELAYED {
        let first = (x - added - before) * bend_at;
        let middle = passed(before, before + first, limit * bend_at);
        let end = passed(middle, middle + (x - before - first), limit * (Lanes(1.0) - bend_at));
        let bends = added != Lanes(0.0);
        after = select(after, end, bends);
        return select(clipped, x - after, own | bends);
    }
    return select(clipped, x - after, own);
}

fn friction_step(before: Lanes2, x: Lanes2, added: Lanes2, bend_at: Lanes, reactions: Reactions) -> Lanes2 {
    var next = x;
    if BRUSHES {
        let part = taken(before.i, next.i, reactions.limits.i, added.i, bend_at);
        next = Lanes2(next.i - part, reactions.adds.i * part + next.w);
    }
    let part = taken(before.w, next.w, reactions.limits.w, added.w, bend_at);
    return Lanes2(reactions.adds.w * part + next.i, next.w - part);
}
