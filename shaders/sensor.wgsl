// Sensors whose output is a moving average of N samples, N real: the last floor(N), and the fraction N - floor(N) of the one
// before them. Each block has running sums and a ring buffer of past states; its length is a power of two that holds the
// longest window and one more sample, or all simulated samples if these are fewer. Before the first sample the state is the
// initial one. Same operations in Rust: crates/motor/src/sensor.rs.
// Constants for the windows of current and speed: floor(N), weight N - floor(N) of the oldest sample, 1/N.

struct MovingAverage {
    // Offset of the ring buffer, and its length minus one.
    first: i32,
    mask: i32,
    // True if this invocation has a block of candidates and does not repeat the last block.
    is_owner: bool,
    initial: Pair,
    whole_i: Lanes, part_i: Lanes, share_i: Lanes,
    whole_w: Lanes, part_w: Lanes, share_w: Lanes,
}

fn load_average(head: u32, constants: u32, own: u32, is_owner: bool) -> MovingAverage {
    var average = MovingAverage();
    if CHANNELS == 0 {
        return average;
    }
    let at = constants + AVERAGES;
    average.mask = i32(jobs[head + 14u]);
    average.first = i32(jobs[head + 13u]) + i32(own) * (average.mask + 1) * CHANNELS;
    average.is_owner = is_owner;
    average.initial = inputs[jobs[head + 8u]].xy;
    average.whole_i = maps[at];
    average.part_i = maps[at + 1u];
    average.share_i = maps[at + 2u];
    average.whole_w = maps[at + 3u];
    average.part_w = maps[at + 4u];
    average.share_w = maps[at + 5u];
    return average;
}

// Returns the running sums before the first sample.
fn sums_before(average: MovingAverage) -> Lanes2 {
    return Lanes2(average.whole_i * average.initial.x, average.whole_w * average.initial.y);
}

// Returns the value that leaves a window at sample n.
fn oldest(average: MovingAverage, channel: i32, whole: Lanes, initial: Scalar, n: i32) -> Lanes {
    let back = Counts(n) - Counts(whole);
    let kept = past(Counts(average.first + channel) + (back & Counts(average.mask)) * CHANNELS);
    return select(Lanes(initial), kept, back >= Counts());
}

fn keep(average: MovingAverage, channel: i32, n: i32, value: Lanes) {
    if average.is_owner {
        states[average.first + channel + (n & average.mask) * CHANNELS] = value;
    }
}

// The sensor outputs, and the running sums.
struct Shown {
    seen: Lanes2,
    sum: Lanes2,
}

fn show(average: MovingAverage, x: Lanes2, before: Lanes2, n: i32) -> Shown {
    var seen = x;
    var sum = before;
    if AVERAGE_I {
        let leaves = oldest(average, 0, average.whole_i, average.initial.x, n);
        keep(average, 0, n, x.i);
        sum.i += x.i - leaves;
        seen.i = (sum.i + average.part_i * leaves) * average.share_i;
    }
    if AVERAGE_W {
        let leaves = oldest(average, CHANNELS - 1, average.whole_w, average.initial.y, n);
        keep(average, CHANNELS - 1, n, x.w);
        sum.w += x.w - leaves;
        seen.w = (sum.w + average.part_w * leaves) * average.share_w;
    }
    return Shown(seen, sum);
}
