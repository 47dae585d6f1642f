//! Step maps of all candidates of a batch, made in f64 on all threads, as the shaders read them.

use super::layout::Unit;
use super::reference::ReferenceStep;
use super::shader::{LANES, Precision};
use crate::evaluate::Group;
use crate::motor::{StepMaps, inverse, product, step_maps, times};
use rayon::prelude::*;

/// Maps that one task makes.
const TASK: usize = 64;

/// Memory that the device reads; what it holds cannot be read here.
type Bytes<'a> = wgpu::WriteOnly<'a, [u8]>;

/// Writes the maps of `units` one after the other: per block and distinct step FIELDS entries of LANES numbers.
pub(super) fn write_maps(groups: &[Group<'_>], units: &[Unit], precision: Precision, bytes: Bytes<'_>) {
    match precision {
        Precision::F32 => write::<{ task_bytes(Precision::F32) }>(groups, units, precision, bytes),
        Precision::F32Plain => write::<{ task_bytes(Precision::F32Plain) }>(groups, units, precision, bytes),
        Precision::F64 => write::<{ task_bytes(Precision::F64) }>(groups, units, precision, bytes),
    }
}

const fn task_bytes(precision: Precision) -> usize {
    TASK * LANES * precision.fields() * precision.bytes()
}

/// `BYTES`: those of a task.
fn write<const BYTES: usize>(groups: &[Group<'_>], units: &[Unit], precision: Precision, bytes: Bytes<'_>) {
    let (tasks, rest) = bytes.into_chunks::<BYTES>();
    let tasks: Vec<wgpu::WriteOnly<'_, [u8; BYTES]>> = tasks.into_iter().collect();
    let last = tasks.len() * TASK;
    let task = |(n, bytes): (usize, wgpu::WriteOnly<'_, [u8; BYTES]>)| {
        write_from(groups, units, precision, n * TASK, bytes.into());
    };
    if tasks.len() < 2 {
        tasks.into_iter().enumerate().for_each(task);
    } else {
        tasks.into_par_iter().enumerate().for_each(task);
    }
    write_from(groups, units, precision, last, rest);
}

/// Writes maps, counted over all units, from `map` on until `bytes` is full.
fn write_from(groups: &[Group<'_>], units: &[Unit], precision: Precision, mut map: usize, mut bytes: Bytes<'_>) {
    let Some(mut unit) = units.partition_point(|unit| unit.map_first <= map).checked_sub(1) else { return };
    while !bytes.is_empty() {
        let Unit { map_first, blocks, reference, .. } = &units[unit];
        let steps = reference.len();
        if map == map_first + blocks * steps {
            unit += 1;
            continue;
        }
        let (block, step) = ((map - map_first) / steps, (map - map_first) % steps);
        write_map(groups, &units[unit], precision, [block, step], &mut bytes);
        map += 1;
    }
}

/// Writes a map to the front of `bytes`, which then begins behind it.
fn write_map(
    groups: &[Group<'_>],
    unit: &Unit,
    precision: Precision,
    [block, step]: [usize; 2],
    bytes: &mut Bytes<'_>,
) {
    let group = &groups[unit.place.group];
    let signals = &group.problem.signals()[unit.place.recording];
    let parameters = parameters_of(group, unit.place.recording, block);
    let mut put = |values: &[f64; LANES]| match precision {
        #[expect(clippy::cast_possible_truncation, reason = "they are stored in f32")]
        Precision::F32 | Precision::F32Plain => push(bytes, bytemuck::cast_slice(&values.map(|v| v as f32))),
        Precision::F64 => push(bytes, bytemuck::cast_slice(values)),
    };
    let maps = step_maps(&parameters, signals.step_s[step], group.problem.model().discretization);
    put_map(&mut put, precision, &maps, &unit.reference[step]);
}

fn push(bytes: &mut Bytes<'_>, values: &[u8]) {
    if let Some(mut own) = bytes.split_off(..values.len()) {
        own.copy_from_slice(values);
    }
}

/// Parameters of a block of candidates side by side; the last is repeated where there are fewer.
fn parameters_of(group: &Group<'_>, recording: usize, block: usize) -> [[f64; LANES]; 5] {
    let lanes: [[f64; 5]; LANES] = std::array::from_fn(|lane| {
        let row = (block * LANES + lane).min(group.candidates.count() - 1);
        group.problem.parameters(group.candidates.row(row), recording).to_array()
    });
    std::array::from_fn(|p| lanes.map(|values| values[p]))
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
