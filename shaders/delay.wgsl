// A delayed voltage for uniform steps: at each step a weighted sum of the last three samples that have arrived. Until the step
// of the first movement the voltage is the one before it. For each candidate the contributions of three special steps, which
// the weighted sum does not represent, are computed beforehand. Same operations in Rust: crates/motor/src/delay_taps.rs.
// Constants: integer part of the dead time in samples, step of the first movement, gains of three samples for the current (3)
// and the speed (3), fraction of a step at which the voltage changes; then for each of three special steps its index and its
// contributions (2).

struct Delay {
    // Offset of the commanded voltages, and their number.
    first: i32,
    count: i32,
    // The last sample that has arrived at step n is n + shift.
    shift: Counts,
    // Sample of the first movement, voltage before it, and the step until which that voltage acts.
    movement: i32,
    before: Lanes,
    moves: Counts,
    one: Lanes2, two: Lanes2, three: Lanes2,
    bend_at: Lanes,
    at0: Counts, at1: Counts, at2: Counts,
    special0: Lanes2, special1: Lanes2, special2: Lanes2,
}

// The voltages at the motor of the last two samples that arrived.
struct Given {
    two: Lanes,
    three: Lanes,
}

// The contribution of the inputs to both states over a step, and the part of it that is due to the change within the step.
struct Acting {
    gain: Lanes2,
    added: Lanes2,
}

fn load_delay(head: u32, constants: u32, drive: Drive) -> Delay {
    var delay = Delay();
    if !DELAYED {
        return delay;
    }
    let taps = constants + TAPS;
    let special = constants + SPECIAL;
    delay.first = i32(jobs[head + 8u]) + 1;
    delay.movement = i32(jobs[head + 10u]);
    delay.count = i32(jobs[head + 11u]);
    delay.shift = Counts(i32(jobs[head + 12u]) + 2) - Counts(maps[taps]);
    delay.before = output(drive, commanded(Counts(delay.first + delay.movement)));
    delay.moves = Counts(maps[taps + 1u]);
    delay.one = Lanes2(maps[taps + 2u], maps[taps + 5u]);
    delay.two = Lanes2(maps[taps + 3u], maps[taps + 6u]);
    delay.three = Lanes2(maps[taps + 4u], maps[taps + 7u]);
    delay.bend_at = maps[taps + 8u];
    delay.at0 = Counts(maps[special]);
    delay.at1 = Counts(maps[special + 3u]);
    delay.at2 = Counts(maps[special + 6u]);
    delay.special0 = Lanes2(maps[special + 1u], maps[special + 2u]);
    delay.special1 = Lanes2(maps[special + 4u], maps[special + 5u]);
    delay.special2 = Lanes2(maps[special + 7u], maps[special + 8u]);
    return delay;
}

// Returns the motor voltage of the sample that arrives at step n.
fn arrived(delay: Delay, drive: Drive, n: i32) -> Lanes {
    let at = clamp(Counts(n) + delay.shift, Counts(), Counts(delay.count));
    return output(drive, commanded(Counts(delay.first) + at));
}

// Returns the motor voltages of the two samples that arrived before step n.
fn given_before(delay: Delay, drive: Drive, n: i32) -> Given {
    if DELAYED {
        return Given(arrived(delay, drive, n - 2), arrived(delay, drive, n - 1));
    }
    return Given();
}

fn choose(other: Lanes2, own: Lanes2, is_own: Choice) -> Lanes2 {
    return Lanes2(select(other.i, own.i, is_own), select(other.w, own.w, is_own));
}

// Returns the contribution of the inputs to both states at step n: g of the torque, the voltages `given`, and `last`, which has
// just arrived; with the change of the voltage within the step.
fn delayed(delay: Delay, g: Lanes2, given: Given, last: Lanes, n: i32) -> Acting {
    let waits = Counts(n) < delay.moves;
    let at = Counts(n) + delay.shift;
    let movement = Counts(delay.movement);
    let one = select(given.two, delay.before, waits & (at - 2 > movement));
    let two = select(given.three, delay.before, waits & (at - 1 > movement));
    let three = select(last, delay.before, waits & (at > movement));
    let taps = Lanes2(
        delay.one.i * one + (delay.two.i * two + (delay.three.i * three + g.i)),
        delay.one.w * one + (delay.two.w * two + (delay.three.w * three + g.w)),
    );
    let is1 = Counts(n) == delay.at1;
    let is2 = Counts(n) == delay.at2;
    let special = choose(choose(delay.special0, delay.special1, is1), delay.special2, is2);
    let own = Lanes2(special.i + g.i, special.w + g.w);
    let is_special = (Counts(n) == delay.at0) | is1 | is2;
    let jump = select(two - one, Lanes(0.0), is_special);
    return Acting(choose(taps, own, is_special), Lanes2(delay.two.i * jump, delay.two.w * jump));
}
