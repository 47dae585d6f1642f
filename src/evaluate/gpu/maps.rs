//! Step maps of all candidates of a batch, computed in f64 on all threads and stored in the layout that the shaders read.

use super::constants::{Constants, constants};
use super::features::ShaderFeatures;
use super::layout::Unit;
use super::reference::ReferenceStep;
use super::variant::{LANES, Precision, Variant};
use crate::evaluate::{Group, Signals};
use crate::motor::{Extended, Reactions, StepMaps, inverse, product, step_maps, times};
use crate::numeric::single;
use rayon::prelude::*;

/// Largest limit, in every precision.
const LIMIT_MAX: f64 = 1e37;
/// Number of maps that one task computes.
const TASK: usize = 64;

/// Mapped memory that the device reads, and that is write-only here.
type Bytes<'a> = wgpu::WriteOnly<'a, [u8]>;

/// Writes the maps of `units` one after the other. Each block of candidates has FIELDS entries of LANES numbers for each
/// distinct step and, for motors with extensions, for each slot of constants.
pub(super) fn write_maps(groups: &[Group<'_>], units: &[Unit], variant: Variant, bytes: Bytes<'_>) {
    const fn task_bytes(fields: usize, number: usize) -> usize {
        TASK * LANES * fields * number
    }
    match (variant.fields(), variant.precision.bytes()) {
        (14, _) => write::<{ task_bytes(14, 4) }>(groups, units, variant, bytes),
        (12, 4) => write::<{ task_bytes(12, 4) }>(groups, units, variant, bytes),
        (12, _) => write::<{ task_bytes(12, 8) }>(groups, units, variant, bytes),
        (_, 4) => write::<{ task_bytes(10, 4) }>(groups, units, variant, bytes),
        (_, _) => write::<{ task_bytes(10, 8) }>(groups, units, variant, bytes),
    }
}

/// Writes the maps in parallel tasks of `BYTES` bytes each.
fn write<const BYTES: usize>(groups: &[Group<'_>], units: &[Unit], variant: Variant, bytes: Bytes<'_>) {
    let (tasks, rest) = bytes.into_chunks::<BYTES>();
    let tasks: Vec<wgpu::WriteOnly<'_, [u8; BYTES]>> = tasks.into_iter().collect();
    let last = tasks.len() * TASK;
    let task = |(n, bytes): (usize, wgpu::WriteOnly<'_, [u8; BYTES]>)| {
        write_from(groups, units, variant, n * TASK, bytes.into());
    };
    if tasks.len() < 2 {
        tasks.into_iter().enumerate().for_each(task);
    } else {
        tasks.into_par_iter().enumerate().for_each(task);
    }
    write_from(groups, units, variant, last, rest);
}

/// Writes maps until `bytes` is full, beginning with number `map`, counted over all units.
fn write_from(groups: &[Group<'_>], units: &[Unit], variant: Variant, mut map: usize, mut bytes: Bytes<'_>) {
    let Some(mut unit) = units.partition_point(|unit| unit.map_first <= map).checked_sub(1) else { return };
    let mut made: Option<([usize; 2], [Constants; LANES])> = None;
    while !bytes.is_empty() {
        let Unit { map_first, blocks, reference, group, .. } = &units[unit];
        let each = reference.len() + variant.slots();
        if map == map_first + blocks * each {
            unit += 1;
            continue;
        }
        let (number, at) = ((map - map_first) / each, (map - map_first) % each);
        let block = Block { group: &groups[*group], unit: &units[unit], number };
        let mut put = |values: &[f64; LANES]| put(&mut bytes, variant.precision, values);
        match (variant.features, at.checked_sub(reference.len())) {
            (None, _) => block.put_linear(at, variant.precision, &mut put),
            (Some(_), None) => block.put_extended(at, &mut put),
            (Some(features), Some(slot)) => {
                // The slots of a block are adjacent, so that its constants are computed once.
                let known = made.filter(|(of, _)| *of == [unit, number]);
                let (_, lanes) = known.unwrap_or_else(|| ([unit, number], block.constants(features)));
                made = Some(([unit, number], lanes));
                (0..variant.fields()).for_each(|n| put(&lanes.map(|constants| constants[slot][n])));
            }
        }
        map += 1;
    }
}

/// Writes the limits of the candidates of `units`, LANES numbers for each block: totals of one recording above which the costs are
/// above the cutoffs; −1 without a cutoff.
///
/// In f32 the limits are higher by a fiftieth, because leaders are evaluated again in f64: candidates whose costs in f32 are near
/// their cutoffs remain comparable.
pub(super) fn write_limits(groups: &[Group<'_>], units: &[Unit], precision: Precision, mut bytes: Bytes<'_>) {
    let slack = if precision.bytes() == 8 { 1e-12 } else { 0.02 };
    for unit in units {
        let group = &groups[unit.group];
        let problem = group.problem;
        let scaling = problem.scaling(&problem.signals()[unit.recording]);
        // Near the largest and smallest numbers of the precision comparisons are not reliable.
        let is_reliable = scaling.factor.iter().all(|factor| *factor == 0.0 || (1e-30..1e30).contains(factor));
        let idle = scaling.total([0.0; 2]);
        let limit = |cutoff: Option<&f64>| {
            let Some(cutoff) = cutoff else { return -1.0 };
            let limit = problem.total_above(*cutoff) * (1.0 + slack) - idle;
            if is_reliable && limit < LIMIT_MAX { limit.max(0.0) } else { -1.0 }
        };
        let cutoffs = group.candidates.cutoffs();
        for number in 0..unit.blocks {
            let block = std::array::from_fn(|lane| limit(cutoffs.get(number * LANES + lane).or(cutoffs.last())));
            put(&mut bytes, precision, &block);
        }
    }
}

/// LANES candidates of one (group, recording) side by side; missing ones repeat the last.
struct Block<'a> {
    group: &'a Group<'a>,
    unit: &'a Unit,
    number: usize,
}

impl Block<'_> {
    /// Returns the value of `of` for each candidate and the index of the recording.
    fn each<T>(&self, of: impl Fn(&[f64], usize) -> T) -> [T; LANES] {
        std::array::from_fn(|lane| {
            let row = (self.number * LANES + lane).min(self.group.candidates.count() - 1);
            of(self.group.candidates.row(row), self.unit.recording)
        })
    }

    /// Returns the motors of the candidates.
    fn motors(&self) -> [Extended; LANES] {
        self.each(|values, n| self.group.problem.motor(values, n))
    }

    fn signals(&self) -> &Signals {
        &self.group.problem.signals()[self.unit.recording]
    }

    /// Returns the constants of the candidates.
    fn constants(&self, features: ShaderFeatures) -> [Constants; LANES] {
        self.motors().map(|motor| constants(features, self.group.problem, self.signals(), &motor, &self.unit.time))
    }

    /// Writes the map of linear motors.
    fn put_linear(&self, step: usize, precision: Precision, put: &mut dyn FnMut(&[f64; LANES])) {
        let problem = self.group.problem;
        let motors = self.each(|values, n| problem.parameters(values, n).to_array());
        let motors = std::array::from_fn(|p| motors.map(|motor| motor[p]));
        let maps = step_maps(&motors, self.signals().step_s[step], problem.method());
        put_map(put, precision, &maps, &self.unit.reference[step]);
    }

    /// Writes the map of motors with extensions: D, gains, and the contributions of the reactions to the other state.
    fn put_extended(&self, step: usize, put: &mut dyn FnMut(&[f64; LANES])) {
        let (problem, motors) = (self.group.problem, Extended::side_by_side(&self.motors()));
        let maps = step_maps(&motors.motor, self.signals().step_s[step], problem.method());
        maps.d.iter().for_each(&mut *put);
        [&maps.taps[0], &maps.taps[1], &maps.torque].into_iter().flatten().for_each(&mut *put);
        Reactions::new(&motors, &maps, problem.features()).adds.iter().for_each(put);
    }
}

/// Writes one entry in a precision.
fn put(bytes: &mut Bytes<'_>, precision: Precision, values: &[f64; LANES]) {
    match precision {
        Precision::F32 | Precision::F32Plain => push(bytes, bytemuck::cast_slice(&values.map(single))),
        Precision::F64 => push(bytes, bytemuck::cast_slice(values)),
    }
}

fn push(bytes: &mut Bytes<'_>, values: &[u8]) {
    if let Some(mut own) = bytes.split_off(..values.len()) {
        own.copy_from_slice(values);
    }
}

/// Writes a step map: D and gains or, for deviations, D, the matrix of the force, and the equilibrium of the deviation per unit
/// of each input, `−D⁻¹ (Γ − M Γ_r)`.
fn put_map(
    put: &mut dyn FnMut(&[f64; LANES]),
    precision: Precision,
    maps: &StepMaps<LANES>,
    reference: &ReferenceStep,
) {
    let gains = [&maps.taps[0], &maps.taps[1], &maps.torque];
    maps.d.iter().for_each(&mut *put);
    if !precision.is_deviation() {
        gains.iter().flat_map(|gain| gain.iter()).for_each(put);
        return;
    }
    let mut p = maps.d;
    let mut rests = gains.map(|gain| *gain);
    for n in 0..LANES {
        let d = maps.d.map(|entry| entry[n]);
        if let Some((undone, map)) = reference {
            let m = product(d, *undone);
            for entry in 0..4 {
                p[entry][n] = m[entry] - if entry % 3 == 0 { 1.0 } else { 0.0 };
            }
            for (rest, of) in rests.iter_mut().zip([map.taps[0], map.taps[1], map.torque]) {
                let turned = times(m, of);
                rest[0][n] -= turned[0];
                rest[1][n] -= turned[1];
            }
        }
        let back = inverse(d);
        for rest in &mut rests {
            let turned = times(back, rest.map(|axis| axis[n]));
            rest[0][n] = -turned[0];
            rest[1][n] = -turned[1];
        }
    }
    p.iter().for_each(&mut *put);
    rests.iter().flatten().for_each(put);
}
