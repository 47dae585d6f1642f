// Each of eight invocations reads one of eight samples and broadcasts it to the others. This is for software adapters, which
// read a sample once for every invocation and spend more time on reading than on arithmetic.

fn walk(begin: Run, map: Map, g: Lanes2, first: u32, end: u32, weight_shift: u32, place: u32) -> Run {
    var run = begin;
    var n = first;
    for (; n + 8u <= end; n += 8u) {
        let s = samples[n + place % 8u];
        let w = weight_of(n + place % 8u + weight_shift);
        run = follow(run, map, g, subgroupBroadcast(s, 0u), subgroupBroadcast(w, 0u));
        run = follow(run, map, g, subgroupBroadcast(s, 1u), subgroupBroadcast(w, 1u));
        run = follow(run, map, g, subgroupBroadcast(s, 2u), subgroupBroadcast(w, 2u));
        run = follow(run, map, g, subgroupBroadcast(s, 3u), subgroupBroadcast(w, 3u));
        run = follow(run, map, g, subgroupBroadcast(s, 4u), subgroupBroadcast(w, 4u));
        run = follow(run, map, g, subgroupBroadcast(s, 5u), subgroupBroadcast(w, 5u));
        run = follow(run, map, g, subgroupBroadcast(s, 6u), subgroupBroadcast(w, 6u));
        run = follow(run, map, g, subgroupBroadcast(s, 7u), subgroupBroadcast(w, 7u));
    }
    for (; n < end; n++) {
        run = follow(run, map, g, samples[n], weight_of(n + weight_shift));
    }
    return run;
}

// Returns true if an invocation has no candidates and none of its group of eight invocations has any.
fn is_idle(lane: u32, blocks: u32) -> bool {
    return lane / 8u * 8u >= blocks;
}

// Returns true if an invocation may end: the others of its group need the samples that it reads.
fn may_end(own: bool) -> bool {
    return subgroupAll(own);
}

@compute @workgroup_size(WORKGROUP)
fn evaluate(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
    @builtin(subgroup_invocation_id) place: u32,
) {
    work(workgroup.y * workgroups.x + workgroup.x, lane, place);
}
