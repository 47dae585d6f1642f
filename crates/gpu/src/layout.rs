//! The layout of a batch in buffers, as `shaders/input.wgsl` reads it.

use super::constants::{kept_bytes, ring};
use super::reference::{Reference, ReferenceStep};
use super::variant::{BLOCK, LANES, Precision, UNIFORM_BYTES, Variant, WORKGROUP};
use motorfit_core::numeric::single;
use motorfit_evaluate::{Group, Problem, Run, Signals};
use motorfit_motor::needs_times;
use std::sync::Arc;

/// Largest number of loop iterations of an invocation in one dispatch. llvmpipe stops loops silently after 65,535 iterations,
/// and the watchdogs of hardware drivers limit the time of a dispatch.
const ITERATIONS: usize = 60_000;
/// Number of loop iterations that llvmpipe counts in addition for each segment and each block of samples. A segment of one
/// sample was measured as 8 iterations in all.
const OVERHEAD: usize = 5;

/// Largest size of the step maps, and of the samples, in one submission \[bytes\]. Larger batches are divided.
pub(crate) const BUDGET: usize = 32 << 20;
/// Largest number of workgroups in one dimension.
const DISPATCH_MAX: u32 = 65_535;
/// Distance of the uniforms of successive rounds \[bytes\]: the alignment that every device accepts.
pub(crate) const ROUND_BYTES: usize = 256;

/// Word of a job of motors with extensions that has the offset of the past sensor values.
const RING: usize = 13;

/// Conversion of numbers to the bytes of buffers.
impl Precision {
    fn push(self, bytes: &mut Vec<u8>, values: &[f64]) {
        if self.bytes() == 8 {
            values.iter().for_each(|v| bytes.extend_from_slice(&v.to_ne_bytes()));
        } else {
            values.iter().for_each(|&v| bytes.extend_from_slice(&single(v).to_ne_bytes()));
        }
    }

    fn count(self, bytes: &[u8], width: usize) -> usize {
        bytes.len() / (width * self.bytes())
    }
}

/// The blocks of candidates of one (group, recording).
pub(crate) struct Unit {
    /// Index of the group in the batch.
    pub group: usize,
    /// Index of the recording in the group's problem.
    pub recording: usize,
    /// Index of the first block, counted over all units.
    pub first: usize,
    /// Number of blocks.
    pub blocks: usize,
    /// Index of the first map, counted over all units. A block has a map for each distinct step and each slot of constants.
    pub map_first: usize,
    /// Step maps of the reference for each distinct step.
    pub reference: Vec<ReferenceStep>,
    /// Times of the samples \[s\]; empty unless inputs are delayed.
    pub time: Arc<[f64]>,
}

/// A group for which a layout was made.
pub(crate) struct Key {
    pub problem: Arc<Problem>,
    pub reference: Option<Vec<f64>>,
    pub count: usize,
}

/// All data of a batch except the step maps of the candidates. They are reused as long as problems, references and numbers of
/// candidates stay the same.
pub(crate) struct BatchLayout {
    pub key: Vec<Key>,
    pub variant: Variant,
    pub jobs: Vec<u32>,
    /// Segments at which rounds begin and end. They are appended to the jobs at the end.
    bounds: Vec<u32>,
    pub job_count: u32,
    pub rounds: u32,
    pub segments: Vec<[u32; 4]>,
    pub inputs: Vec<u8>,
    pub samples: Vec<u8>,
    pub weights: Vec<u8>,
    pub blocks: usize,
    /// Number of candidate-steps.
    pub steps: u64,
    /// Number of step maps and slots of constants of all units.
    pub maps: usize,
    /// Number of entries of the states between rounds, including the past sensor values after them.
    pub states: usize,
    pub units: Vec<Unit>,
}

impl BatchLayout {
    /// Creates the layout of groups that use the same shader.
    pub(crate) fn new(groups: &[Group<'_>], variant: Variant) -> Self {
        let precision = variant.precision;
        let key = |group: &Group<'_>| Key {
            problem: group.problem.clone(),
            reference: group.reference.map(<[f64]>::to_vec),
            count: group.candidates.count(),
        };
        let mut layout = Self {
            key: groups.iter().map(key).collect(),
            variant,
            jobs: Vec::new(),
            bounds: Vec::new(),
            job_count: 0,
            rounds: 0,
            segments: Vec::new(),
            inputs: Vec::new(),
            samples: Vec::new(),
            weights: Vec::new(),
            blocks: 0,
            steps: 0,
            maps: 0,
            states: 0,
            units: Vec::new(),
        };
        for (index, group) in groups.iter().enumerate() {
            // Without a given reference, it is the geometric mean of the bounds.
            let middle = || group.problem.space().free().iter().map(|axis| (axis.min * axis.max).sqrt()).collect();
            let values: Vec<f64> = group.reference.map_or_else(middle, <[f64]>::to_vec);
            for (recording, signals) in group.problem.signals().iter().enumerate() {
                let reference = if precision.is_deviation() {
                    Reference::new(group.problem, signals, &group.problem.parameters(&values, recording))
                } else {
                    Reference::none(signals)
                };
                layout.add([index, recording], group, reference);
            }
        }
        let words = variant.job();
        layout.job_count = word(layout.jobs.len() / words);
        let (table, kept) = (word(layout.jobs.len()), word(layout.blocks * variant.states()));
        for job in layout.jobs.chunks_exact_mut(words) {
            job[6] += table;
            if variant.features.is_some() {
                job[RING] += kept;
            }
        }
        layout.states += layout.blocks * variant.states();
        layout.jobs.append(&mut layout.bounds);
        if layout.weights.is_empty() {
            precision.push(&mut layout.weights, &[0.0; 2]);
        }
        layout.variant.uniform &= layout.samples.len() <= UNIFORM_BYTES;
        layout
    }

    /// Returns the index in the maps of the first limit of candidates.
    pub(crate) fn limits_first(&self) -> u32 {
        word(self.maps * self.variant.fields())
    }

    /// Returns the uniforms of all rounds: the index of the round, the number of jobs and the index of the first limit.
    pub(crate) fn round_bytes(&self) -> Vec<u8> {
        let round = |index: u32| {
            let mut bytes = [0; ROUND_BYTES];
            bytes[..4].copy_from_slice(&index.to_ne_bytes());
            bytes[4..8].copy_from_slice(&self.job_count.to_ne_bytes());
            bytes[8..12].copy_from_slice(&self.limits_first().to_ne_bytes());
            bytes
        };
        (0..self.rounds).flat_map(round).collect()
    }

    /// Returns the numbers of workgroups of a dispatch in two dimensions.
    pub(crate) fn workgroups(&self) -> [u32; 2] {
        let x = self.job_count.min(DISPATCH_MAX);
        [x, self.job_count.div_ceil(x.max(1))]
    }

    /// Returns the size of the step maps and constants \[bytes\]; the limits follow them.
    pub(crate) fn maps_bytes(&self) -> usize {
        self.maps * self.variant.fields() * self.block_bytes()
    }

    /// Returns the size of the limits \[bytes\].
    pub(crate) fn limits_bytes(&self) -> usize {
        self.blocks * self.block_bytes()
    }

    /// Returns the size of the states between rounds \[bytes\].
    pub(crate) fn states_bytes(&self) -> usize {
        self.states * self.block_bytes()
    }

    /// Returns the size of the sums \[bytes\].
    pub(crate) fn sums_bytes(&self) -> usize {
        self.blocks * 2 * self.block_bytes()
    }

    /// Returns the size of a number of each candidate of a block \[bytes\].
    fn block_bytes(&self) -> usize {
        LANES * self.variant.precision.bytes()
    }

    /// Returns true if groups differ from those of the layout in the values of their candidates only.
    #[cfg(feature = "gpu")]
    pub(crate) fn serves(&self, groups: &[Group<'_>], variant: Variant) -> bool {
        let same = |key: &Key, group: &Group<'_>| {
            Arc::ptr_eq(&key.problem, group.problem)
                && key.count == group.candidates.count()
                && (!variant.precision.is_deviation() || key.reference.as_deref() == group.reference)
        };
        Variant { uniform: self.variant.uniform, ..variant } == self.variant
            && self.key.len() == groups.len()
            && self.key.iter().zip(groups).all(|(key, group)| same(key, group))
    }
}

fn word(n: usize) -> u32 {
    // Buffers are limited to 4 GiB, so that no count reaches this limit.
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl BatchLayout {
    /// Adds a recording of a group, given by the indices of group and recording.
    fn add(&mut self, [index, recording]: [usize; 2], group: &Group<'_>, reference: Reference) {
        let (problem, variant, precision) = (group.problem, self.variant, self.variant.precision);
        let signals = &problem.signals()[recording];
        let blocks = group.candidates.count().div_ceil(LANES);
        if blocks == 0 {
            return;
        }
        let first_active = problem.first_active(signals);
        let sample_first = precision.count(&self.samples, precision.sample());
        let weight_first = precision.count(&self.weights, 2);
        self.add_samples(signals, first_active, &reference);
        let initial = precision.count(&self.inputs, 4);
        let rounds_first = self.bounds.len();
        let delayed = variant.is_delayed();
        self.add_initial(problem, signals, delayed);
        let rounds = if delayed {
            self.add_segments(first_active, &torques(signals, first_active))
        } else {
            self.add_segments(first_active, problem.runs(signals))
        };
        let map_first = self.maps;
        let steps = signals.step_s.len();
        let each = steps + variant.slots();
        let kept = variant.features.map(|features| [self.states, ring(problem, signals), features.channels()]);
        self.states += kept.map_or(0, |[_, ring, channels]| blocks * ring * channels);
        for first in (0..blocks).step_by(WORKGROUP) {
            let count = WORKGROUP.min(blocks - first);
            self.jobs.extend([
                word(self.blocks + first),
                word(count),
                word(map_first + first * each),
                word(each),
                word(sample_first),
                word(weight_first),
                word(rounds_first),
                word(rounds),
                word(initial),
            ]);
            // Motors with extensions have six more words; `kept` is the offset of past sensor values, their number per sensor,
            // and the number of sensors.
            if let Some([ring_first, ring, channels]) = kept {
                let known = signals.history.first_movement;
                let ring_at = ring_first + first * ring * channels;
                self.jobs.extend([steps, known, signals.len(), first_active, ring_at, ring - 1].map(word));
            }
        }
        let is_timed = delayed && needs_times(problem.settings(signals));
        let time = if is_timed { signals.times() } else { Arc::default() };
        let (first, reference) = (self.blocks, reference.steps);
        self.units.push(Unit { group: index, recording, first, blocks, map_first, reference, time });
        self.maps += blocks * each;
        self.steps += (blocks * LANES * (signals.len() - first_active)) as u64;
        self.blocks += blocks;
        self.rounds = self.rounds.max(word(rounds));
    }

    /// Adds the samples from the first active one on: the measured values, or for deviations the residuals of the reference and
    /// its increments. Adds their weights too.
    fn add_samples(&mut self, signals: &Signals, active: usize, reference: &Reference) {
        let precision = self.variant.precision;
        for n in active..signals.len() {
            let y = signals.measured[n];
            match precision {
                Precision::F32 => {
                    let (x, drive) = (reference.trajectory[n], reference.drive[n]);
                    precision.push(&mut self.samples, &[y[0] - x[0], y[1] - x[1], drive[0], drive[1]]);
                }
                Precision::F32Plain => precision.push(&mut self.samples, &[y[0], y[1], 0.0, 0.0]),
                Precision::F64 => precision.push(&mut self.samples, &y),
            }
        }
        if self.variant.weighted {
            for n in active..signals.len() {
                precision.push(&mut self.weights, &signals.weight.get(n).copied().unwrap_or([1.0; 2]));
            }
        }
    }

    /// Adds the initial state with the factors of the sums of errors and, if inputs are delayed, the voltage before the first sample
    /// and all voltages.
    fn add_initial(&mut self, problem: &Problem, signals: &Signals, delayed: bool) {
        let precision = self.variant.precision;
        let initial = if precision.is_deviation() { [0.0; 2] } else { signals.initial };
        self.segments.push([0; 4]);
        let factor = problem.scaling(signals).factor;
        precision.push(&mut self.inputs, &[initial[0], initial[1], factor[0], factor[1]]);
        if delayed {
            let commanded = [&[signals.history.voltage], &signals.voltage[..]];
            commanded.into_iter().flatten().for_each(|v| precision.push(&mut self.inputs, &[*v, 0.0, 0.0, 0.0]));
        }
    }

    /// Divides runs into segments and rounds of bounded length and adds them. Samples are counted from `from`. Returns the
    /// number of rounds.
    fn add_segments(&mut self, from: usize, runs: &[Run]) -> usize {
        self.bounds.push(word(self.segments.len()));
        let (mut rounds, mut iterations) = (0, 0);
        for run in runs {
            let mut begin = run.start;
            iterations += OVERHEAD;
            for start in (run.start..run.end).step_by(BLOCK) {
                let count = BLOCK.min(run.end - start) + OVERHEAD;
                if iterations + count > ITERATIONS {
                    if start > begin {
                        self.add_segment(from, [begin, start], run);
                    }
                    self.bounds.push(word(self.segments.len()));
                    (rounds, iterations, begin) = (rounds + 1, OVERHEAD, start);
                }
                iterations += count;
            }
            self.add_segment(from, [begin, run.end], run);
        }
        self.bounds.push(word(self.segments.len()));
        rounds + 1
    }

    fn add_segment(&mut self, from: usize, [start, end]: [usize; 2], run: &Run) {
        let precision = self.variant.precision;
        let at = word(precision.count(&self.inputs, 4));
        self.segments.push([word(start - from), word(end - from), u32::from(run.step), at]);
        precision.push(&mut self.inputs, &[run.voltage[0], run.voltage[1], run.torque, 0.0]);
    }
}

/// Returns the runs of constant torque from sample `from` on, of a recording with uniform steps.
fn torques(signals: &Signals, from: usize) -> Vec<Run> {
    let torque = |n: usize| signals.torque.get(n).copied().unwrap_or(0.0);
    let run = |n| Run { start: n, end: n + 1, step: 0, voltage: [0.0; 2], torque: torque(n) };
    Run::joined((from..signals.len()).map(run))
}

/// Returns the bytes of a candidate (the larger of its step maps and the past values of its sensors) and of the samples.
pub(crate) fn bytes(problem: &Problem, variant: Variant) -> (usize, usize) {
    let (signals, number) = (problem.signals(), variant.precision.bytes());
    let maps: usize = signals.iter().map(|s| s.step_s.len() + variant.slots()).sum();
    let kept = variant.features.map_or(0, |features| kept_bytes(problem, features, number));
    // Delayed inputs are stored for each sample, as four numbers.
    let delayed = |s: &Signals| if variant.is_delayed() { 4 * s.len() } else { 0 };
    let samples = |s: &Signals| (s.len() - problem.first_active(s)) * variant.precision.sample() + delayed(s);
    let samples: usize = signals.iter().map(|s| samples(s) * number).sum();
    // A limit for each recording follows the maps.
    (((maps * variant.fields() + signals.len()) * number).max(kept), samples)
}
