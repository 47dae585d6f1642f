// The voltage as it comes late: at each step the three last samples that have arrived, each with its gain. Until the
// first movement has waited for its latency, the voltage is the one before it. Each candidate has three steps of its own
// that follow no rule; what they add was computed beforehand.
// Constants: whole samples of the dead time, the step of the first movement, the gains of three samples for the current
// (3) and the speed (3); then three times a step that follows no rule and what it adds (2).

struct Delay {
    // Where the voltages lie, and their number.
    told: i32,
    count: i32,
    // What has come last at step n is told at n + shift.
    shift: Counts,
    // The voltage before the first movement, and the step up to which it lasts.
    movement: i32,
    before: Lanes,
    moves: Counts,
    one: Lanes2, two: Lanes2, three: Lanes2,
    at0: Counts, at1: Counts, at2: Counts,
    special0: Lanes2, special1: Lanes2, special2: Lanes2,
}

// What the drive gave of the two samples that came last.
struct Given {
    two: Lanes,
    three: Lanes,
}

fn load_delay(head: u32, constants: u32, drive: Drive) -> Delay {
    var delay = Delay();
    if !DELAYED {
        return delay;
    }
    let taps = constants + TAPS;
    let special = constants + SPECIAL;
    delay.told = i32(jobs[head + 8u]) + 1;
    delay.movement = i32(jobs[head + 10u]);
    delay.count = i32(jobs[head + 11u]);
    delay.shift = Counts(i32(jobs[head + 12u]) + 2) - Counts(maps[taps]);
    delay.before = terminal(drive, told(Counts(delay.told + delay.movement)));
    delay.moves = Counts(maps[taps + 1u]);
    delay.one = Lanes2(maps[taps + 2u], maps[taps + 5u]);
    delay.two = Lanes2(maps[taps + 3u], maps[taps + 6u]);
    delay.three = Lanes2(maps[taps + 4u], maps[taps + 7u]);
    delay.at0 = Counts(maps[special]);
    delay.at1 = Counts(maps[special + 3u]);
    delay.at2 = Counts(maps[special + 6u]);
    delay.special0 = Lanes2(maps[special + 1u], maps[special + 2u]);
    delay.special1 = Lanes2(maps[special + 4u], maps[special + 5u]);
    delay.special2 = Lanes2(maps[special + 7u], maps[special + 8u]);
    return delay;
}

// What comes at step n.
fn comes(delay: Delay, drive: Drive, n: i32) -> Lanes {
    let at = clamp(Counts(n) + delay.shift, Counts(), Counts(delay.count));
    return terminal(drive, told(Counts(delay.told) + at));
}

// Those that came before step n.
fn given_before(delay: Delay, drive: Drive, n: i32) -> Given {
    if DELAYED {
        return Given(comes(delay, drive, n - 2), comes(delay, drive, n - 1));
    }
    return Given();
}

fn special(g: Lanes2, own: Lanes2, is_own: Choice) -> Lanes2 {
    return Lanes2(select(g.i, own.i, is_own), select(g.w, own.w, is_own));
}

// What acts on the motor at step n: g of the torque, and the voltages given, of which `last` has just come.
fn late(delay: Delay, g: Lanes2, given: Given, last: Lanes, n: i32) -> Lanes2 {
    let waits = Counts(n) < delay.moves;
    let at = Counts(n) + delay.shift;
    let held = Counts(delay.movement);
    let one = select(given.two, delay.before, waits & (at - 2 > held));
    let two = select(given.three, delay.before, waits & (at - 1 > held));
    let three = select(last, delay.before, waits & (at > held));
    var voltage = Lanes2(
        delay.one.i * one + (delay.two.i * two + delay.three.i * three),
        delay.one.w * one + (delay.two.w * two + delay.three.w * three),
    );
    voltage = special(voltage, delay.special0, Counts(n) == delay.at0);
    voltage = special(voltage, delay.special1, Counts(n) == delay.at1);
    voltage = special(voltage, delay.special2, Counts(n) == delay.at2);
    return Lanes2(voltage.i + g.i, voltage.w + g.w);
}
