//! Step maps of all candidates of a batch, computed in f64 on all threads and stored in the layout that the shaders read.

use super::constants::{Constants, constants};
use super::features::ShaderFeatures;
use super::layout::Unit;
use super::variant::{LANES, Precision, Variant};
use super::wide::{CANDIDATES, FIELDS_MAX, WIDE, WideStep, fields, wide_maps};
use motorfit_core::numeric::single;
use motorfit_evaluate::{Group, Signals};
use motorfit_motor::{Extended, Reactions, step_maps};
use rayon::prelude::*;
use std::ops::Range;

/// Largest limit, in every precision.
const LIMIT_MAX: f64 = 1e37;
/// Number of maps, or of blocks of limits, that one task computes.
const TASK: usize = 64;
/// Mapped memory that the device reads, and that is write-only here.
type Bytes<'a> = wgpu_types::WriteOnly<'a, [u8]>;

/// Writes the maps of `units` one after the other. Each block of candidates has FIELDS entries of LANES numbers for each
/// distinct step and, for motors with extensions, for each slot of constants.
pub(crate) fn write_maps(groups: &[Group<'_>], units: &[Unit], variant: Variant, bytes: Bytes<'_>) {
    const fn task_bytes(fields: usize, number: usize) -> usize {
        TASK * LANES * fields * number
    }
    let write = |first: usize, bytes: Bytes<'_>| write_from(groups, units, variant, (first, bytes));
    match (variant.fields(), variant.precision.bytes()) {
        (14, _) => in_tasks::<{ task_bytes(14, 4) }>(bytes, write),
        (12, 4) => in_tasks::<{ task_bytes(12, 4) }>(bytes, write),
        (12, _) => in_tasks::<{ task_bytes(12, 8) }>(bytes, write),
        (_, 4) => in_tasks::<{ task_bytes(10, 4) }>(bytes, write),
        (_, _) => in_tasks::<{ task_bytes(10, 8) }>(bytes, write),
    }
}

/// Writes in parallel tasks of `BYTES` bytes each, that are [`TASK`] maps or limits; `write` takes the number of the first.
fn in_tasks<const BYTES: usize>(bytes: Bytes<'_>, write: impl Fn(usize, Bytes<'_>) + Sync) {
    let (tasks, rest) = bytes.into_chunks::<BYTES>();
    let tasks: Vec<wgpu_types::WriteOnly<'_, [u8; BYTES]>> = tasks.into_iter().collect();
    let last = tasks.len() * TASK;
    let task = |(n, bytes): (usize, wgpu_types::WriteOnly<'_, [u8; BYTES]>)| write(n * TASK, bytes.into());
    if tasks.len() < 2 {
        tasks.into_iter().enumerate().for_each(task);
    } else {
        tasks.into_par_iter().enumerate().for_each(task);
    }
    write(last, rest);
}

/// Writes maps until `bytes` is full, beginning with number `map`, counted over all units.
fn write_from(groups: &[Group<'_>], units: &[Unit], variant: Variant, (mut map, mut bytes): (usize, Bytes<'_>)) {
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
        match (variant.features, at.checked_sub(reference.len())) {
            (None, _) if each == 1 => {
                let size = LANES * variant.fields() * variant.precision.bytes();
                let together = WIDE.min(bytes.len() / size).min(blocks - number);
                block.put_wide(together, variant.precision, &mut bytes);
                map += together - 1;
            }
            (None, _) => block.put_linear(at, variant.precision, &mut bytes),
            (Some(_), None) => block.put_extended(at, variant.precision, &mut bytes),
            (Some(features), Some(slot)) => {
                // The slots of a block are adjacent, so that its constants are computed once.
                let known = made.filter(|(of, _)| *of == [unit, number]);
                let (_, lanes) = known.unwrap_or_else(|| ([unit, number], block.constants(features)));
                made = Some(([unit, number], lanes));
                let mut entry = Entry::default();
                (0..variant.fields()).for_each(|n| entry.push(&lanes.map(|constants| constants[slot][n])));
                entry.write(variant.precision, &mut bytes);
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
pub(crate) fn write_limits(groups: &[Group<'_>], units: &[Unit], precision: Precision, bytes: Bytes<'_>) {
    let write = |first: usize, mut bytes: Bytes<'_>| {
        let Some(mut unit) = units.partition_point(|unit| unit.first <= first).checked_sub(1) else { return };
        let mut number = first - units[unit].first;
        while !bytes.is_empty() {
            if number == units[unit].blocks {
                (unit, number) = (unit + 1, 0);
                continue;
            }
            let end = units[unit].blocks.min(number + bytes.len() / (LANES * precision.bytes()));
            put_limits((groups, &units[unit]), number..end, precision, &mut bytes);
            number = end;
        }
    };
    match precision.bytes() {
        4 => in_tasks::<{ TASK * LANES * 4 }>(bytes, write),
        _ => in_tasks::<{ TASK * LANES * 8 }>(bytes, write),
    }
}

/// Writes the limits of some blocks of a unit.
fn put_limits(
    (groups, unit): (&[Group<'_>], &Unit),
    blocks: Range<usize>,
    precision: Precision,
    bytes: &mut Bytes<'_>,
) {
    let slack = if precision.bytes() == 8 { 1e-12 } else { 0.02 };
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
    for number in blocks {
        let mut entry = Entry::default();
        entry.push(&std::array::from_fn(|lane| limit(cutoffs.get(number * LANES + lane).or(cutoffs.last()))));
        entry.write(precision, bytes);
    }
}

/// One entry of the maps before it is written: FIELDS times LANES numbers at most.
#[derive(Default)]
struct Entry {
    values: [f64; Self::MAX],
    len: usize,
}

impl Entry {
    const MAX: usize = FIELDS_MAX * LANES;

    fn push(&mut self, values: &[f64; LANES]) {
        self.values[self.len..self.len + LANES].copy_from_slice(values);
        self.len += LANES;
    }

    /// Writes the entry at the beginning of the bytes, and takes its place from them.
    fn write(&self, precision: Precision, bytes: &mut Bytes<'_>) {
        put::<{ Self::MAX }>(bytes, precision, &self.values[..self.len]);
    }
}

/// Writes at most `MAX` numbers in a precision at the beginning of the bytes, and takes their place from them.
fn put<const MAX: usize>(bytes: &mut Bytes<'_>, precision: Precision, values: &[f64]) {
    let Some(mut own) = bytes.split_off(..values.len() * precision.bytes()) else { return };
    if precision.bytes() == 8 {
        own.copy_from_slice(bytemuck::cast_slice(values));
        return;
    }
    let mut singles = [0.0; MAX];
    singles.iter_mut().zip(values).for_each(|(to, value)| *to = single(*value));
    own.copy_from_slice(bytemuck::cast_slice(&singles[..values.len()]));
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
        std::array::from_fn(|lane| of(self.group.candidates.row(self.row(lane)), self.unit.recording))
    }

    /// Returns the row of the candidate of a lane, counted from the first of the block; missing ones repeat the last.
    fn row(&self, lane: usize) -> usize {
        (self.number * LANES + lane).min(self.group.candidates.count() - 1)
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
    fn put_linear(&self, step: usize, precision: Precision, bytes: &mut Bytes<'_>) {
        let problem = self.group.problem;
        let row = |lane| self.group.candidates.row(self.row(lane));
        let motors = problem.side_by_side::<LANES>(std::array::from_fn(row), self.unit.recording);
        let maps = step_maps(&motors, self.signals().step_s[step], problem.method());
        let mut entry = Entry::default();
        let fields = fields(&maps, precision.is_deviation().then_some(&self.unit.reference[step]));
        fields[..precision.fields()].iter().for_each(|values| entry.push(values));
        entry.write(precision, bytes);
    }

    /// Writes the maps of this block and of the next ones, `together` in all, of linear motors on an even clock.
    fn put_wide(&self, together: usize, precision: Precision, bytes: &mut Bytes<'_>) {
        let problem = self.group.problem;
        let row = |lane| self.group.candidates.row(self.row(lane));
        let motors = problem.side_by_side::<CANDIDATES>(std::array::from_fn(row), self.unit.recording);
        let (step_s, method) = (self.signals().step_s[0], problem.method());
        let reference = precision.is_deviation().then_some(&self.unit.reference[0]);
        let entries = wide_maps(&motors, &WideStep { step_s, method, reference, fields: precision.fields() });
        put::<{ WIDE * Entry::MAX }>(bytes, precision, &entries[..together * precision.fields() * LANES]);
    }

    /// Writes the map of motors with extensions: D, gains, and the contributions of the reactions to the other state.
    fn put_extended(&self, step: usize, precision: Precision, bytes: &mut Bytes<'_>) {
        let (problem, motors) = (self.group.problem, Extended::side_by_side(&self.motors()));
        let maps = step_maps(&motors.motor, self.signals().step_s[step], problem.method());
        let mut entry = Entry::default();
        maps.d.iter().for_each(|values| entry.push(values));
        [&maps.taps[0], &maps.taps[1], &maps.torque].into_iter().flatten().for_each(|values| entry.push(values));
        Reactions::new(&motors, &maps, problem.features()).adds.iter().for_each(|values| entry.push(values));
        entry.write(precision, bytes);
    }
}
