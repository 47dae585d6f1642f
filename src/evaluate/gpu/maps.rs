//! Step maps of all candidates of a batch, made in f64 on all threads, as the shaders read them.

use super::layout::Unit;
use super::reference::ReferenceStep;
use super::shader::{LANES, Precision};
use crate::evaluate::Group;
use crate::motor::{StepMaps, step_maps};
use rayon::prelude::*;

/// Blocks that one task makes.
const BLOCKS: usize = 64;

/// Writes the maps of `units` one after the other: per block and distinct step FIELDS entries of LANES numbers.
pub(super) fn write_maps(groups: &[Group<'_>], units: &[Unit], precision: Precision, bytes: &mut Vec<u8>) {
    let entry = precision.fields() * LANES * precision.bytes();
    let size = |unit: &Unit| unit.blocks * unit.reference.len() * entry;
    bytes.resize(units.iter().map(size).sum(), 0);
    let mut rest = bytes.as_mut_slice();
    let mut parts = Vec::with_capacity(units.len());
    for unit in units {
        let (own, others) = rest.split_at_mut(size(unit));
        parts.push((unit, own));
        rest = others;
    }
    let each = |(unit, bytes): (&Unit, &mut [u8])| {
        let group = &groups[unit.place.group];
        let block_bytes = unit.reference.len() * entry;
        let blocks = |(task, bytes): (usize, &mut [u8])| {
            for (n, bytes) in bytes.chunks_exact_mut(block_bytes).enumerate() {
                write_block(group, unit, precision, task * BLOCKS + n, bytes);
            }
        };
        if unit.blocks <= BLOCKS {
            blocks((0, bytes));
        } else {
            bytes.par_chunks_mut(BLOCKS * block_bytes).enumerate().for_each(blocks);
        }
    };
    if parts.len() == 1 {
        parts.into_iter().for_each(each);
    } else {
        parts.into_par_iter().for_each(each);
    }
}

fn write_block(group: &Group<'_>, unit: &Unit, precision: Precision, block: usize, bytes: &mut [u8]) {
    let signals = &group.problem.signals()[unit.place.recording];
    let method = group.problem.model().discretization;
    let parameters = parameters_of(group, unit.place.recording, block);
    let mut cells = bytes.chunks_exact_mut(precision.bytes());
    let mut put = |values: &[f64; LANES]| {
        for (value, cell) in values.iter().zip(&mut cells) {
            #[expect(clippy::cast_possible_truncation, reason = "deviations are stored in f32")]
            match precision {
                Precision::F32 => cell.copy_from_slice(&(*value as f32).to_ne_bytes()),
                Precision::F64 => cell.copy_from_slice(&value.to_ne_bytes()),
            }
        }
    };
    for (reference, &h) in unit.reference.iter().zip(&signals.step_s) {
        put_map(&mut put, precision, &step_maps(&parameters, h, method), reference);
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

/// A step map as the shader reads it: in f64 D and gains, in f32 D, the matrix of the force and where the deviation
/// comes to rest under each input, `−D⁻¹ (Γ − M Γ_r)`.
fn put_map(
    put: &mut dyn FnMut(&[f64; LANES]),
    precision: Precision,
    maps: &StepMaps<LANES>,
    reference: &ReferenceStep,
) {
    let gains = [&maps.taps[0], &maps.taps[1], &maps.torque];
    maps.d.iter().for_each(&mut *put);
    if precision == Precision::F64 {
        gains.iter().flat_map(|gain| gain.iter()).for_each(put);
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
    p.iter().for_each(&mut *put);
    rests.iter().flatten().for_each(put);
}

fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]]
}
