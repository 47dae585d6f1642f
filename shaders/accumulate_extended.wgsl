// Simulation of motors with extensions over the samples of one round. Errors are summed per BLOCK of samples before they are
// added to the total, which bounds the rounding error by the block length.

// The data carried from one sample to the next.
struct Run {
    x: Lanes2,
    part: Lanes2,
    sum: Lanes2,
    given: Given,
    // Index of the sample, counted from the first simulated one.
    n: i32,
}

// The coefficients of a block of candidates for one step length.
struct Map {
    step: Step,
    drive: Drive,
    delay: Delay,
    average: MovingAverage,
}

// Adds the errors of one sample to the sums, then advances the state by one step.
fn follow(run: Run, map: Map, g: Lanes2, sample: Sample, weight: Pair) -> Run {
    let shown = show(map.average, run.x, run.sum, run.n);
    let e = residual(sample, shown.seen);
    let part = Lanes2(lose(e.i, weight.x, run.part.i), lose(e.w, weight.y, run.part.w));
    var acts = Acting(g, Lanes2());
    var given = run.given;
    if DELAYED {
        let last = arrived(map.delay, map.drive, run.n);
        acts = delayed(map.delay, g, run.given, last, run.n);
        given = Given(run.given.three, last);
    }
    return Run(advance(run.x, map.step, acts, map.delay.bend_at), part, shown.sum, given, run.n + 1);
}

// Runs one invocation, until no cost of its candidates is needed any more. The next round compares the same sums before its first
// sample and ends as well. `place` is its index in the subgroup if samples are broadcast in it.
fn work(job: u32, lane: u32, place: u32) {
    if job >= round.jobs {
        return;
    }
    let head = job * JOB;
    let blocks = jobs[head + 1u];
    if round.index >= jobs[head + 7u] || is_idle(lane, blocks) {
        return;
    }
    let own = min(lane, blocks - 1u);
    let block = jobs[head] + own;
    let map_first = (jobs[head + 2u] + own * jobs[head + 3u]) * FIELDS;
    let constants = map_first + jobs[head + 9u] * FIELDS;
    let sample_first = jobs[head + 4u];
    let weight_shift = jobs[head + 5u] - sample_first;
    let bounds = jobs[head + 6u] + round.index;

    let drive = load_drive(constants);
    let load = maps[constants + AT_TL];
    let average = load_average(head, constants, own, lane < blocks);
    var map = Map(load_step(map_first, constants), drive, load_delay(head, constants, drive), average);
    var map_at = map_first;
    let initial = inputs[jobs[head + 8u]];
    let limit = maps[round.limits + block];
    var run = Run();
    var total: Lanes2;
    if round.index == 0u {
        run.x = Lanes2(Lanes(initial.x), Lanes(initial.y));
        run.sum = sums_before(average);
    } else {
        run.x = Lanes2(states[STATES * block], states[STATES * block + 1u]);
        run.sum = Lanes2(states[STATES * block + 2u], states[STATES * block + 3u]);
        run.n = i32(segments[jobs[bounds]].x);
        total = Lanes2(sums[2u * block], sums[2u * block + 1u]);
    }
    run.given = given_before(map.delay, drive, run.n);
    let begin = jobs[bounds];
    var is_done = false;
    for (var s = begin; s < jobs[bounds + 1u] && !is_done; s++) {
        let segment = segments[s];
        let at = map_first + segment.z * FIELDS;
        if at != map_at {
            map_at = at;
            map.step = load_step(map_at, constants);
        }
        let g = gain(map_at, drive, load, inputs[segment.w]);
        let start = sample_first + segment.x;
        let end = sample_first + segment.y;
        for (var n = start; n < end; n += BLOCK) {
            if s == begin || (n > start && (n - start) % CHECKED_SAMPLES == 0u) || s % CHECKED_SEGMENTS == 0u {
                is_done = may_end(is_above(total, initial, limit));
            }
            if is_done {
                break;
            }
            run.part = Lanes2();
            run = walk(run, map, g, n, min(n + BLOCK, end), weight_shift, place);
            total = Lanes2(total.i + run.part.i, total.w + run.part.w);
        }
    }
    if lane < blocks {
        states[STATES * block] = run.x.i;
        states[STATES * block + 1u] = run.x.w;
        states[STATES * block + 2u] = run.sum.i;
        states[STATES * block + 3u] = run.sum.w;
        sums[2u * block] = total.i;
        sums[2u * block + 1u] = total.w;
    }
}
