// Simulation of the linear motor over the samples of one round. Errors are summed per BLOCK of samples before they are added to
// the total, which bounds the rounding error by the block length.

// The state and the sums of errors of a block of samples.
struct Run {
    x: Lanes2,
    part: Lanes2,
}

// Adds the errors of one sample to the sums, then advances the state by one step.
fn follow(run: Run, map: Map, g: Lanes2, sample: Sample, weight: Pair) -> Run {
    let e = residual(sample, observe(run.x, g));
    let part = Lanes2(lose(e.i, weight.x, run.part.i), lose(e.w, weight.y, run.part.w));
    return Run(advance(run.x, map, g, sample), part);
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
    let sample_first = jobs[head + 4u];
    let weight_shift = jobs[head + 5u] - sample_first;
    let bounds = jobs[head + 6u] + round.index;

    let initial = inputs[jobs[head + 8u]];
    let limit = maps[round.limits + block];
    var x: Lanes2;
    var total: Lanes2;
    if round.index == 0u {
        x = Lanes2(Lanes(initial.x), Lanes(initial.y));
    } else {
        x = Lanes2(states[2u * block], states[2u * block + 1u]);
        total = Lanes2(sums[2u * block], sums[2u * block + 1u]);
    }
    var g: Lanes2;
    var map_at = map_first;
    var map = load_map(map_at);
    let begin = jobs[bounds];
    var is_done = false;
    for (var s = begin; s < jobs[bounds + 1u] && !is_done; s++) {
        let segment = segments[s];
        let at = map_first + segment.z * FIELDS;
        if at != map_at {
            map_at = at;
            map = load_map(map_at);
        }
        let before = g;
        g = gain(map_at, inputs[s]);
        x = enter(x, before, g);
        let start = sample_first + segment.x;
        let end = sample_first + segment.y;
        for (var n = start; n < end; n += BLOCK) {
            if s == begin || (n > start && (n - start) % CHECKED_SAMPLES == 0u) || s % CHECKED_SEGMENTS == 0u {
                is_done = may_end(is_above(total, initial, limit));
            }
            if is_done {
                break;
            }
            let run = walk(Run(x, Lanes2()), map, g, n, min(n + BLOCK, end), weight_shift, place);
            x = run.x;
            total = Lanes2(total.i + run.part.i, total.w + run.part.w);
        }
    }
    x = observe(x, g);
    if lane < blocks {
        states[2u * block] = x.i;
        states[2u * block + 1u] = x.w;
        sums[2u * block] = total.i;
        sums[2u * block + 1u] = total.w;
    }
}
