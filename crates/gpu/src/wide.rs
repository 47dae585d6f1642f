//! Step maps of linear motors on an even clock, many candidates side by side with the fastest instructions of this machine.

use super::reference::ReferenceStep;
use super::variant::LANES;
use motorfit_evaluate::{Level, at_level};
use motorfit_motor::{Method, StepMaps, step_maps};

/// Blocks whose maps are computed side by side, and their candidates.
pub(crate) const WIDE: usize = 8;
pub(crate) const CANDIDATES: usize = WIDE * LANES;
/// Largest number of fields of a map.
pub(crate) const FIELDS_MAX: usize = 14;

/// Parameters of the motors, shape `[parameters][candidates]`.
pub(crate) type Motors = [[f64; CANDIDATES]; 5];
/// Maps as the shaders read them, shape `[blocks][fields][LANES]`.
pub(crate) type Entries = [f64; WIDE * FIELDS_MAX * LANES];

/// The step of all candidates.
pub(crate) struct WideStep<'a> {
    pub step_s: f64,
    pub method: Method,
    /// The reference, for maps of deviations.
    pub reference: Option<&'a ReferenceStep>,
    pub fields: usize,
}

/// Returns the maps of candidates side by side.
pub(crate) fn wide_maps(motors: &Motors, step: &WideStep<'_>) -> Entries {
    match Level::best() {
        Level::Avx512 => avx512(motors, step),
        Level::Avx2 => avx2(motors, step),
        Level::Portable => portable(motors, step),
    }
}

at_level! {
    fn avx512(motors: &Motors, step: &WideStep<'_>) -> Entries = avx512 { entries(motors, step) } else avx2
}

at_level! {
    fn avx2(motors: &Motors, step: &WideStep<'_>) -> Entries = avx2 { entries(motors, step) } else portable
}

fn portable(motors: &Motors, step: &WideStep<'_>) -> Entries {
    entries(motors, step)
}

#[inline(always)]
fn entries(motors: &Motors, step: &WideStep<'_>) -> Entries {
    let maps = step_maps(motors, step.step_s, step.method);
    let rows = fields(&maps, step.reference);
    let mut entries = [0.0; WIDE * FIELDS_MAX * LANES];
    for (block, entry) in entries.chunks_exact_mut(step.fields * LANES).take(WIDE).enumerate() {
        for (row, values) in rows.iter().zip(entry.chunks_exact_mut(LANES)) {
            values.copy_from_slice(&row[block * LANES..(block + 1) * LANES]);
        }
    }
    entries
}

/// Returns the fields of step maps: D and gains or, for deviations, D, the matrix of the force, and the equilibrium of the deviation per
/// unit of each input, `−D⁻¹ (Γ − M Γ_r)`.
#[inline(always)]
pub(crate) fn fields<const N: usize>(maps: &StepMaps<N>, reference: Option<&ReferenceStep>) -> [[f64; N]; FIELDS_MAX] {
    let mut rows = [[0.0; N]; FIELDS_MAX];
    rows[..4].copy_from_slice(&maps.d);
    let mut gains = [maps.taps[0], maps.taps[1], maps.torque];
    let mut first = 4;
    if let Some(reference) = reference {
        let force = deviation(&maps.d, &mut gains, reference);
        rows[4..8].copy_from_slice(&force);
        first = 8;
    }
    for (gain, rows) in gains.iter().zip(rows[first..].chunks_exact_mut(2)) {
        rows.copy_from_slice(gain);
    }
    rows
}

/// Returns the matrix of the force on deviations, and replaces the gains by their equilibrium.
#[inline(always)]
fn deviation<const N: usize>(
    d: &[[f64; N]; 4],
    gains: &mut [[[f64; N]; 2]; 3],
    reference: &ReferenceStep,
) -> [[f64; N]; 4] {
    let mut force = *d;
    if let Some((undone, map)) = reference {
        let mut m = [[0.0; N]; 4];
        for n in 0..N {
            m[0][n] = d[0][n] * undone[0] + d[1][n] * undone[2];
            m[1][n] = d[0][n] * undone[1] + d[1][n] * undone[3];
            m[2][n] = d[2][n] * undone[0] + d[3][n] * undone[2];
            m[3][n] = d[2][n] * undone[1] + d[3][n] * undone[3];
        }
        for (gain, of) in gains.iter_mut().zip([map.taps[0], map.taps[1], map.torque]) {
            for n in 0..N {
                gain[0][n] -= m[0][n] * of[0] + m[1][n] * of[1];
                gain[1][n] -= m[2][n] * of[0] + m[3][n] * of[1];
            }
        }
        let [a, b, c, d] = m;
        force = [a.map(|entry| entry - 1.0), b, c, d.map(|entry| entry - 1.0)];
    }
    let mut back = [[0.0; N]; 4];
    for n in 0..N {
        let determinant = d[0][n] * d[3][n] - d[1][n] * d[2][n];
        back[0][n] = d[3][n] / determinant;
        back[1][n] = -d[1][n] / determinant;
        back[2][n] = -d[2][n] / determinant;
        back[3][n] = d[0][n] / determinant;
    }
    for gain in gains {
        for n in 0..N {
            let turned =
                [back[0][n] * gain[0][n] + back[1][n] * gain[1][n], back[2][n] * gain[0][n] + back[3][n] * gain[1][n]];
            gain[0][n] = -turned[0];
            gain[1][n] = -turned[1];
        }
    }
    force
}
