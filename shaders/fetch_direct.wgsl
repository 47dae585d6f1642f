// Every invocation reads every sample. This is fastest on hardware that reads a common address once for all invocations.

fn walk(begin: Run, map: Map, g: Lanes2, first: u32, end: u32, weight_shift: u32, place: u32) -> Run {
    var run = begin;
    for (var n = first; n < end; n++) {
        run = follow(run, map, g, samples[n], weight_of(n + weight_shift));
    }
    return run;
}

// Returns true if an invocation has no candidates.
fn is_idle(lane: u32, blocks: u32) -> bool {
    return lane >= blocks;
}

// Returns true if an invocation may end.
fn may_end(own: bool) -> bool {
    return own;
}

@compute @workgroup_size(WORKGROUP)
fn evaluate(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    work(workgroup.y * workgroups.x + workgroup.x, lane, 0u);
}
