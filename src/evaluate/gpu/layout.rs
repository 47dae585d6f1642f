//! A batch as the words of buffers. Offsets are those of `shaders/input.wgsl`.

use super::shader::{LANES, Precision, WORKGROUP};
use crate::evaluate::{Group, Problem, Signals};
use crate::motor::{Parameters, StepMap, StepMaps, step_maps, walk};
use rayon::prelude::*;

/// Words of a job.
pub(super) const JOB: usize = 9;
/// Samples of a segment, whose errors are summed before they go to the total.
const SEGMENT: usize = 64;
/// Loop iterations of an invocation in one dispatch: llvmpipe cuts them off at 65,535 without a word, and a real
/// device's watchdog wants short dispatches too.
const ITERATIONS: usize = 60_000;
/// What a segment adds to them: one of the outer loop, and the last looks of the two inner ones.
const OVERHEAD: usize = 3;

/// Numbers in the precision of the device, as bytes are uploaded.
pub(super) struct Numbers {
    precision: Precision,
    pub bytes: Vec<u8>,
}

impl Numbers {
    fn new(precision: Precision) -> Self {
        Self { precision, bytes: Vec::new() }
    }

    fn push(&mut self, values: &[f64]) {
        match self.precision {
            #[expect(clippy::cast_possible_truncation, reason = "deviations are stored in f32")]
            Precision::F32 => values.iter().for_each(|&v| self.bytes.extend_from_slice(&(v as f32).to_ne_bytes())),
            Precision::F64 => values.iter().for_each(|v| self.bytes.extend_from_slice(&v.to_ne_bytes())),
        }
    }

    fn count(&self, width: usize) -> usize {
        self.bytes.len() / (width * self.precision.bytes())
    }
}

/// Where the results of one (group, recording) are: blocks of four candidates from `first` on.
pub(super) struct Unit {
    pub place: Place,
    pub first: usize,
}

/// A group of the batch and a recording of its problem.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub group: usize,
    pub recording: usize,
}

/// A batch, packed.
pub(super) struct Packed {
    pub jobs: Vec<u32>,
    /// Segments at which rounds begin and end; behind the jobs once all are there.
    bounds: Vec<u32>,
    weighted: bool,
    pub job_count: u32,
    pub rounds: u32,
    pub segments: Vec<[u32; 4]>,
    pub inputs: Numbers,
    pub samples: Numbers,
    pub weights: Numbers,
    pub maps: Numbers,
    pub blocks: usize,
    pub units: Vec<Unit>,
}

/// Packs groups whose criteria need the same shader. `references` holds one motor per group and recording.
pub(super) fn pack(groups: &[Group<'_>], precision: Precision, weighted: bool) -> Packed {
    let numbers = || Numbers::new(precision);
    let mut packed = Packed {
        jobs: Vec::new(),
        bounds: Vec::new(),
        weighted,
        job_count: 0,
        rounds: 0,
        segments: Vec::new(),
        inputs: numbers(),
        samples: numbers(),
        weights: numbers(),
        maps: numbers(),
        blocks: 0,
        units: Vec::new(),
    };
    for (index, group) in groups.iter().enumerate() {
        let values = reference_values(group);
        for (recording, signals) in group.problem.signals().iter().enumerate() {
            let reference = Reference::new(group.problem, signals, &group.problem.parameters(&values, recording));
            packed.add(Place { group: index, recording }, group, &reference);
        }
    }
    packed.job_count = u32::try_from(packed.jobs.len() / JOB).unwrap_or(u32::MAX);
    let table = u32::try_from(packed.jobs.len()).unwrap_or(u32::MAX);
    packed.jobs.chunks_exact_mut(JOB).for_each(|job| job[6] += table);
    let bounds = std::mem::take(&mut packed.bounds);
    packed.jobs.extend(bounds);
    if packed.weights.bytes.is_empty() {
        packed.weights.push(&[0.0; 2]);
    }
    packed
}

/// What deviations are taken from: a motor's trajectory, and per step how a candidate's maps become forces.
///
/// With the reference's maps D_r and gains Γ_r, its increment δ = D_r x_r + Γ_r u and M = D D_r⁻¹, a candidate's own
/// increment at the reference's state is `D x_r + Γ u = M δ + (Γ − M Γ_r) u`. The force on the deviation is that less δ:
/// `(M − I) δ + (Γ − M Γ_r) u`. Unlike `(D − D_r) x_r + (Γ − Γ_r) u` its terms do not cancel in the steady state.
struct Reference {
    trajectory: Vec<[f64; 2]>,
    /// What the matrix of the force is multiplied by at each sample: δ.
    drive: Vec<[f64; 2]>,
    /// D_r⁻¹ and the gains of each step. None for a reference that stays where it starts, because the motor diverges or
    /// D_r has no inverse: the force is then `D x_r + Γ u` itself, and `drive` is x_r.
    steps: Vec<Option<([f64; 4], StepMap)>>,
}

impl Reference {
    fn new(problem: &Problem, signals: &Signals, motor: &Parameters) -> Self {
        let method = problem.model().discretization;
        let mut trajectory = Vec::with_capacity(signals.len());
        walk(motor, &signals.drive(), signals.initial, method, |x| trajectory.push(x));
        let steps: Vec<_> = signals.step_s.iter().map(|&h| inverted(StepMap::new(motor, h, method))).collect();
        // f32 holds up to 3e38; squares of errors must fit too.
        if steps.iter().all(Option::is_some) && trajectory.iter().flatten().all(|x| x.abs() < 1e15) {
            let mut drive: Vec<[f64; 2]> =
                trajectory.windows(2).map(|x| [x[1][0] - x[0][0], x[1][1] - x[0][1]]).collect();
            drive.push([0.0; 2]);
            return Self { trajectory, drive, steps };
        }
        let still = vec![signals.initial; signals.len()];
        Self { trajectory: still.clone(), drive: still, steps: vec![None; signals.step_s.len()] }
    }
}

fn inverted(map: StepMap) -> Option<([f64; 4], StepMap)> {
    let [a, b, c, d] = map.d;
    let determinant = a * d - b * c;
    let inverse = [d, -b, -c, a].map(|v| v / determinant);
    inverse.iter().all(|v| v.is_finite()).then_some((inverse, map))
}

/// The group's own reference, or the geometric middle of its box.
fn reference_values(group: &Group<'_>) -> Vec<f64> {
    match group.reference {
        Some(values) => values.to_vec(),
        None => group.problem.space().free().iter().map(|axis| (axis.min * axis.max).sqrt()).collect(),
    }
}

fn word(n: usize) -> u32 {
    // Buffers are limited to 4 GiB long before a count reaches this.
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl Packed {
    fn add(&mut self, place: Place, group: &Group<'_>, reference: &Reference) {
        let signals = &group.problem.signals()[place.recording];
        let blocks = group.candidates.count().div_ceil(LANES);
        if blocks == 0 {
            return;
        }
        let precision = self.maps.precision;
        let sample_first = self.samples.count(precision.sample());
        let weight_first = self.weights.count(2);
        self.add_samples(signals, reference);
        let initial = self.inputs.count(4);
        let rounds_first = self.bounds.len();
        let rounds = self.add_segments(signals);
        let map_first = self.maps.count(LANES * precision.fields());
        let steps = signals.step_s.len();
        self.add_maps(group, place.recording, reference);
        for first in (0..blocks).step_by(WORKGROUP) {
            let count = WORKGROUP.min(blocks - first);
            self.jobs.extend([
                word(self.blocks + first),
                word(count),
                word(map_first + first * steps),
                word(steps),
                word(sample_first),
                word(weight_first),
                word(rounds_first),
                word(rounds),
                word(initial),
            ]);
        }
        self.units.push(Unit { place, first: self.blocks });
        self.blocks += blocks;
        self.rounds = self.rounds.max(word(rounds));
    }

    /// Samples from the first active one on: measured, or what the reference leaves and what drives deviations.
    fn add_samples(&mut self, signals: &Signals, reference: &Reference) {
        let active = signals.first_active;
        for n in active..signals.len() {
            let (y, x, drive) = (&signals.measured[n], &reference.trajectory[n], &reference.drive[n]);
            match self.samples.precision {
                Precision::F64 => self.samples.push(y),
                Precision::F32 => self.samples.push(&[y[0] - x[0], y[1] - x[1], drive[0], drive[1]]),
            }
        }
        if self.weighted {
            for n in active..signals.len() {
                self.weights.push(&signals.weight.get(n).copied().unwrap_or([1.0; 2]));
            }
        }
    }

    /// The initial state, then spans cut into segments; the bounds of rounds. Returns the number of rounds.
    fn add_segments(&mut self, signals: &Signals) -> usize {
        let initial = if self.inputs.precision == Precision::F32 { [0.0; 2] } else { signals.initial };
        self.segments.push([0; 4]);
        self.inputs.push(&[initial[0], initial[1], 0.0, 0.0]);
        self.bounds.push(word(self.segments.len()));
        let (mut rounds, mut iterations) = (0, 0);
        for span in &signals.spans {
            for start in (span.start..span.end).step_by(SEGMENT) {
                let end = span.end.min(start + SEGMENT);
                if iterations + end - start + OVERHEAD > ITERATIONS {
                    self.bounds.push(word(self.segments.len()));
                    (rounds, iterations) = (rounds + 1, 0);
                }
                iterations += end - start + OVERHEAD;
                let from = signals.first_active;
                self.segments.push([word(start - from), word(end - from), u32::from(span.step), 0]);
                self.inputs.push(&[span.voltage[0], span.voltage[1], span.torque, 0.0]);
            }
        }
        self.bounds.push(word(self.segments.len()));
        rounds + 1
    }

    /// Step maps of every block and distinct step, made in f64 on all threads.
    fn add_maps(&mut self, group: &Group<'_>, recording: usize, reference: &Reference) {
        let signals = &group.problem.signals()[recording];
        let precision = self.maps.precision;
        let method = group.problem.model().discretization;
        let block_bytes = precision.fields() * LANES * precision.bytes();
        let blocks = group.candidates.count().div_ceil(LANES);
        let from = self.maps.bytes.len();
        self.maps.bytes.resize(from + blocks * signals.step_s.len() * block_bytes, 0);
        let block_maps = |(block, bytes): (usize, &mut [u8])| {
            let parameters = parameters_of(group, recording, block);
            let mut numbers = Numbers::new(precision);
            numbers.bytes.reserve_exact(bytes.len());
            for (reference, &h) in reference.steps.iter().zip(&signals.step_s) {
                push_map(&mut numbers, &step_maps(&parameters, h, method), reference.as_ref());
            }
            bytes.copy_from_slice(&numbers.bytes);
        };
        self.maps.bytes[from..]
            .par_chunks_mut(signals.step_s.len() * block_bytes)
            .enumerate()
            .with_min_len(64)
            .for_each(block_maps);
    }
}

/// Parameters of four candidates side by side; the last is repeated where there are fewer.
fn parameters_of(group: &Group<'_>, recording: usize, block: usize) -> [[f64; LANES]; 5] {
    let lanes: [[f64; 5]; LANES] = std::array::from_fn(|lane| {
        let row = (block * LANES + lane).min(group.candidates.count() - 1);
        group.problem.parameters(group.candidates.row(row), recording).to_array()
    });
    std::array::from_fn(|p| lanes.map(|values| values[p]))
}

/// A step map as the shader reads it: in f64 D and gains, in f32 D, the matrix of the force and where the deviation
/// comes to rest under each input, `−D⁻¹ (Γ − M Γ_r)`.
fn push_map(numbers: &mut Numbers, maps: &StepMaps<LANES>, reference: Option<&([f64; 4], StepMap)>) {
    let gains = [&maps.taps[0], &maps.taps[1], &maps.torque];
    maps.d.iter().for_each(|d| numbers.push(d));
    if numbers.precision == Precision::F64 {
        gains.iter().for_each(|gain| gain.iter().for_each(|axis| numbers.push(axis)));
        return;
    }
    let mut p = maps.d;
    let mut rests = gains.map(|gain| *gain);
    for n in 0..LANES {
        let d = maps.d.map(|entry| entry[n]);
        if let Some((inverse, map)) = reference {
            let m = product(d, *inverse);
            for entry in 0..4 {
                p[entry][n] = m[entry] - if entry % 3 == 0 { 1.0 } else { 0.0 };
            }
            for (rest, of) in rests.iter_mut().zip([map.taps[0], map.taps[1], map.torque]) {
                rest[0][n] -= m[0] * of[0] + m[1] * of[1];
                rest[1][n] -= m[2] * of[0] + m[3] * of[1];
            }
        }
        let determinant = d[0] * d[3] - d[1] * d[2];
        for rest in &mut rests {
            let [i, w] = rest.map(|axis| axis[n]);
            rest[0][n] = -(d[3] * i - d[1] * w) / determinant;
            rest[1][n] = -(d[0] * w - d[2] * i) / determinant;
        }
    }
    p.iter().for_each(|entry| numbers.push(entry));
    rests.iter().for_each(|rest| rest.iter().for_each(|axis| numbers.push(axis)));
}

fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]]
}
