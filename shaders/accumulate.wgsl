// The loop over the samples of one round. Sums are kept per segment (at most 64 samples) and then added, so that
// their rounding does not grow with the recording.

fn lose(e: Lanes, sum: Lanes) -> Lanes {
    if ABSOLUTE {
        return add(sum, magnitude(e));
    }
    return multiply_add(e, e, sum);
}

fn lose_weighted(e: Lanes, weight: Scalar, sum: Lanes) -> Lanes {
    if ABSOLUTE {
        return scale_add(magnitude(e), weight, sum);
    }
    return multiply_add(scale(e, weight), e, sum);
}

fn accumulate(e: Lanes2, at: u32, sum: Lanes2) -> Lanes2 {
    if WEIGHTED {
        let weight = weights[at];
        return Lanes2(lose_weighted(e.i, weight.x, sum.i), lose_weighted(e.w, weight.y, sum.w));
    }
    return Lanes2(lose(e.i, sum.i), lose(e.w, sum.w));
}

// The state and the sums of a segment.
struct Run {
    x: Lanes2,
    part: Lanes2,
}

// One sample: its errors into the sums, then one step of the state.
fn follow(run: Run, map: Map, g: Lanes2, sample_at: u32, weight_at: u32) -> Run {
    let sample = samples[sample_at];
    let sums = accumulate(residual(sample, observe(run.x, g)), weight_at, run.part);
    return Run(advance(run.x, map, g, sample), sums);
}

@compute @workgroup_size(WORKGROUP)
fn evaluate(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let job = workgroup.y * workgroups.x + workgroup.x;
    if job >= round.jobs {
        return;
    }
    let head = job * JOB;
    if round.index >= jobs[head + 7u] || lane >= jobs[head + 1u] {
        return;
    }
    let block = jobs[head] + lane;
    let map_first = (jobs[head + 2u] + lane * jobs[head + 3u]) * FIELDS;
    let sample_first = jobs[head + 4u];
    let weight_first = jobs[head + 5u];
    let bounds = jobs[head + 6u] + round.index;

    var x: Lanes2;
    var total: Lanes2;
    if round.index == 0u {
        let initial = inputs[jobs[head + 8u]];
        x = Lanes2(splat(initial.x), splat(initial.y));
    } else {
        x = Lanes2(states[2u * block], states[2u * block + 1u]);
        total = Lanes2(sums[2u * block], sums[2u * block + 1u]);
    }
    var g: Lanes2;
    var map_at = map_first;
    var map = load_map(map_at);
    for (var s = jobs[bounds]; s < jobs[bounds + 1u]; s++) {
        let segment = segments[s];
        let at = map_first + segment.z * FIELDS;
        if at != map_at {
            map_at = at;
            map = load_map(map_at);
        }
        let before = g;
        g = gain(map_at, inputs[s]);
        x = enter(x, before, g);
        var run = Run(x, Lanes2());
        for (var n = segment.x; n < segment.y; n++) {
            run = follow(run, map, g, sample_first + n, weight_first + n);
        }
        x = run.x;
        total = Lanes2(add(total.i, run.part.i), add(total.w, run.part.w));
    }
    x = observe(x, g);
    states[2u * block] = x.i;
    states[2u * block + 1u] = x.w;
    sums[2u * block] = total.i;
    sums[2u * block + 1u] = total.w;
}
