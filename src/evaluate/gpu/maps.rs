//! Step maps of all candidates of a batch, made in f64 on all threads, as the shaders read them.

use super::extras::{Constants, Extras};
use super::layout::Unit;
use super::reference::ReferenceStep;
use super::shader::{LANES, Precision, Variant};
use crate::evaluate::Group;
use crate::motor::{Extended, StepMaps, inverse, product, step_maps, times};
use crate::numeric::single;
use rayon::prelude::*;

/// Maps that one task makes.
const TASK: usize = 64;

/// Memory that the device reads; what it holds cannot be read here.
type Bytes<'a> = wgpu::WriteOnly<'a, [u8]>;

/// Writes the maps of `units` one after the other: per block FIELDS entries of LANES numbers for each distinct step, and
/// for motors with extensions as many for each slot of constants.
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

/// `BYTES`: those of a task.
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

/// Writes maps, counted over all units, from `map` on until `bytes` is full.
fn write_from(groups: &[Group<'_>], units: &[Unit], variant: Variant, mut map: usize, mut bytes: Bytes<'_>) {
    let Some(mut unit) = units.partition_point(|unit| unit.map_first <= map).checked_sub(1) else { return };
    let mut made: Option<([usize; 2], [Constants; LANES])> = None;
    while !bytes.is_empty() {
        let Unit { map_first, blocks, reference, place, .. } = &units[unit];
        let each = reference.len() + variant.slots().len();
        if map == map_first + blocks * each {
            unit += 1;
            continue;
        }
        let (block, at) = ((map - map_first) / each, (map - map_first) % each);
        let group = &groups[place.group];
        let mut put = |values: &[f64; LANES]| match variant.precision {
            Precision::F32 | Precision::F32Plain => push(&mut bytes, bytemuck::cast_slice(&values.map(single))),
            Precision::F64 => push(&mut bytes, bytemuck::cast_slice(values)),
        };
        match (variant.extras, at.checked_sub(reference.len())) {
            (None, _) => put_linear(&mut put, group, &units[unit], variant.precision, [block, at]),
            (Some(_), None) => put_extended(&mut put, group, place.recording, [block, at]),
            (Some(extras), Some(slot)) => {
                // The slots of a block follow each other.
                let known = made.filter(|(of, _)| *of == [unit, block]);
                let (_, lanes) =
                    known.unwrap_or_else(|| ([unit, block], constants_of(group, &units[unit], extras, block)));
                made = Some(([unit, block], lanes));
                (0..variant.fields()).for_each(|n| put(&lanes.map(|constants| constants[slot][n])));
            }
        }
        map += 1;
    }
}

/// The constants of a block of candidates.
fn constants_of(group: &Group<'_>, unit: &Unit, extras: Extras, block: usize) -> [Constants; LANES] {
    let (problem, recording) = (group.problem, unit.place.recording);
    std::array::from_fn(|lane| {
        let values = row_of(group, block, lane);
        let motor = Extended::new(&problem.parameters(values, recording), &problem.extensions(values, recording));
        extras.constants(problem, &problem.signals()[recording], &motor, &unit.time)
    })
}

/// Puts the map of a linear motor.
fn put_linear(
    put: &mut dyn FnMut(&[f64; LANES]),
    group: &Group<'_>,
    unit: &Unit,
    precision: Precision,
    [block, step]: [usize; 2],
) {
    let signals = &group.problem.signals()[unit.place.recording];
    let parameters = parameters_of(group, unit.place.recording, block);
    let maps = step_maps(&parameters, signals.step_s[step], group.problem.method());
    put_map(put, precision, &maps, &unit.reference[step]);
}

/// Puts the map of a motor with extensions: D, gains, and the reactions that end current and speed at zero, per unit of
/// them.
fn put_extended(put: &mut dyn FnMut(&[f64; LANES]), group: &Group<'_>, recording: usize, [block, step]: [usize; 2]) {
    let signals = &group.problem.signals()[recording];
    let method = group.problem.extent().method(group.problem.method());
    let maps = step_maps(&parameters_of(group, recording, block), signals.step_s[step], method);
    maps.d.iter().for_each(&mut *put);
    [&maps.taps[0], &maps.taps[1], &maps.torque].into_iter().flatten().for_each(&mut *put);
    put(&std::array::from_fn(|lane| 1.0 / (maps.taps[0][0][lane] + maps.taps[1][0][lane])));
    put(&maps.torque[1].map(|gain| -1.0 / gain));
}

fn push(bytes: &mut Bytes<'_>, values: &[u8]) {
    if let Some(mut own) = bytes.split_off(..values.len()) {
        own.copy_from_slice(values);
    }
}

/// Parameters of a block of candidates side by side; the last is repeated where there are fewer.
fn parameters_of(group: &Group<'_>, recording: usize, block: usize) -> [[f64; LANES]; 5] {
    let lanes: [[f64; 5]; LANES] =
        std::array::from_fn(|lane| group.problem.parameters(row_of(group, block, lane), recording).to_array());
    std::array::from_fn(|p| lanes.map(|values| values[p]))
}

/// A candidate of a block.
fn row_of<'a>(group: &Group<'a>, block: usize, lane: usize) -> &'a [f64] {
    group.candidates.row((block * LANES + lane).min(group.candidates.count() - 1))
}

/// A step map as the shader reads it: D and gains, or in deviations D, the matrix of the force and where the deviation
/// comes to rest under each input, `−D⁻¹ (Γ − M Γ_r)`.
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
