// What a workgroup works on. The prelude before this file gives Scalar, Pair (vec2), Lanes (candidates side by side),
// Sample, WORKGROUP, FIELDS, BLOCK, JOB, ABSOLUTE, WEIGHTED, the numbers of the bindings, and where the samples lie.

struct Round {
    // Which part of every recording this dispatch runs.
    index: u32,
    jobs: u32,
}

@group(0) @binding(ROUND_BINDING) var<uniform> round: Round;
// JOB words a job (one workgroup), then the bounds of rounds as indices of segments.
@group(0) @binding(JOBS_BINDING) var<storage, read> jobs: array<u32>;
// Runs of constant step and inputs: first sample, one past the last, step, place of the inputs.
@group(0) @binding(SEGMENTS_BINDING) var<storage, read> segments: array<vec4<u32>>;
// Per segment: voltage at the start and at the end of a step, load torque, unused. Before those of a recording its
// initial state; then, where inputs are delayed, all commanded voltages, first that before the first sample.
@group(0) @binding(INPUTS_BINDING) var<storage, read> inputs: array<vec4<Scalar>>;
@group(0) @binding(WEIGHTS_BINDING) var<storage, read> weights: array<Pair>;
// FIELDS entries a block of candidates and distinct step; then, for motors with extensions, its constants.
@group(0) @binding(MAPS_BINDING) var<storage, read> maps: array<Lanes>;
// The state of a block between rounds: current, speed; with extensions the running sums of its sensors too, and behind
// those of all blocks what sensors keep.
@group(0) @binding(STATES_BINDING) var<storage, read_write> states: array<Lanes>;
// The weighted sums of errors of a block: current, speed.
@group(0) @binding(SUMS_BINDING) var<storage, read_write> sums: array<Lanes>;

// Current and speed of a block of candidates.
struct Lanes2 {
    i: Lanes,
    w: Lanes,
}
