// Buffers of the shader. The prelude before this file defines Scalar, Pair (vec2), Lanes (candidates side by side), Sample,
// WORKGROUP, FIELDS, BLOCK, JOB, ABSOLUTE, WEIGHTED, the binding numbers, and the buffer of samples.

struct Round {
    // Index of the round of segments that this dispatch simulates.
    index: u32,
    jobs: u32,
    // Index in the maps of the limits, one entry for each block of candidates.
    limits: u32,
}

@group(0) @binding(ROUND_BINDING) var<uniform> round: Round;
// JOB words for each job (one workgroup), then the bounds of rounds as indices of segments.
@group(0) @binding(JOBS_BINDING) var<storage, read> jobs: array<u32>;
// Segments with constant step and inputs: first sample, one past the last, index of the step, index of the inputs.
@group(0) @binding(SEGMENTS_BINDING) var<storage, read> segments: array<vec4<u32>>;
// For each segment: voltage at the start and at the end of a step, load torque, unused. The segments of a recording follow its
// initial state with the factors of its sums of errors and, if inputs are delayed, the voltage before the first sample and all
// commanded voltages.
@group(0) @binding(INPUTS_BINDING) var<storage, read> inputs: array<vec4<Scalar>>;
@group(0) @binding(WEIGHTS_BINDING) var<storage, read> weights: array<Pair>;
// FIELDS entries for each block of candidates and distinct step; for motors with extensions also for each slot of constants.
// After them the limits of the candidates: totals above which their costs are not needed, negative without a cutoff.
@group(0) @binding(MAPS_BINDING) var<storage, read> maps: array<Lanes>;
// State of each block between rounds: current, speed, and with extensions the running sums of its sensors; after the states of
// all blocks the ring buffers of past sensor values.
@group(0) @binding(STATES_BINDING) var<storage, read_write> states: array<Lanes>;
// Weighted sums of errors of each block: current, speed.
@group(0) @binding(SUMS_BINDING) var<storage, read_write> sums: array<Lanes>;

// Current and speed of a block of candidates.
struct Lanes2 {
    i: Lanes,
    w: Lanes,
}
