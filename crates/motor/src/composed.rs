//! One-step maps for many step lengths at once.
//!
//! On an irregular clock all step lengths are multiples of one unit. The map of `32 a + b` units is composed of that of
//! `32 a` and that of `b` units, so that few series are summed.

use super::discretize::{Method, StepMaps, step_maps};
use super::dual::Number;
use motorfit_core::numeric::{count, whole};

/// Number of units of which the coarse part of a step is a multiple.
const COARSE: usize = 32;
/// Smallest number of distinct step lengths for which splitting saves time.
const STEPS_MIN: usize = 32;

/// The distinct steps of an irregular clock, each split into a coarse part (a multiple of `COARSE` units) and a fine part
/// of fewer units. Distinct parts are few even if distinct steps are many.
#[derive(Debug, Clone)]
pub struct SplitSteps {
    unit_s: f64,
    /// Distinct coarse parts as multiples of `COARSE` units, and distinct fine parts as multiples of one unit.
    pub multiples: [Vec<usize>; 2],
    /// For each step the indices of its coarse and of its fine part in `multiples`.
    pub part_indices: Vec<[usize; 2]>,
    /// For each step the fraction of its length that the coarse part takes.
    pub coarse_fraction: Vec<f64>,
}

impl SplitSteps {
    /// Splits steps \[s\] that are multiples of `unit_s` \[s\] up to rounding; `None` if there are too few to save time.
    pub fn new(steps_s: &[f64], unit_s: f64) -> Option<Self> {
        if steps_s.len() < STEPS_MIN {
            return None;
        }
        let units = steps_s.iter().map(|h| whole((h / unit_s).round()));
        let parts: Vec<[usize; 2]> = units.map(|n| [n / COARSE, n % COARSE]).collect();
        let multiples = [0, 1].map(|part| {
            let mut distinct: Vec<usize> = parts.iter().map(|parts| parts[part]).collect();
            distinct.sort_unstable();
            distinct.dedup();
            distinct
        });
        let index = |part: usize, n: usize| multiples[part].partition_point(|known| *known < n);
        let part_indices = parts.iter().map(|&[coarse, fine]| [index(0, coarse), index(1, fine)]).collect();
        let share = |&[coarse, fine]: &[usize; 2]| count(COARSE * coarse) / count(COARSE * coarse + fine);
        let coarse_fraction = parts.iter().map(share).collect();
        Some(Self { unit_s, multiples, part_indices, coarse_fraction })
    }

    /// Returns the length \[s\] of which the coarse parts (0) or the fine parts (1) are multiples.
    pub(crate) fn base_s(&self, part: usize) -> f64 {
        if part == 0 { count(COARSE) * self.unit_s } else { self.unit_s }
    }

    /// Returns the maps of the distinct coarse parts and those of the distinct fine parts.
    #[inline(always)]
    pub fn tables<T: Number>(&self, motor: &[[T; 1]; 5], method: Method) -> [Vec<StepMaps<1, T>>; 2] {
        let [coarse, fine] = &self.multiples;
        let mut tables: [Vec<StepMaps<1, T>>; 2] = [Vec::with_capacity(coarse.len()), Vec::with_capacity(fine.len())];
        for (part, table) in tables.iter_mut().enumerate() {
            let base_s = self.base_s(part);
            let base = step_maps(motor, base_s, method);
            let mut last = None;
            // A loop, because iterator adapters would not be compiled for the target features of the caller.
            for &n in &self.multiples[part] {
                let maps = match (last, table.last()) {
                    (Some(before), Some(maps)) if n == before + 1 && n > 1 => {
                        let share = if method.uses_next_input() { Some(count(before) / count(n)) } else { None };
                        maps.then(&base, share)
                    }
                    _ => step_maps(motor, count(n) * base_s, method),
                };
                last = Some(n);
                table.push(maps);
            }
        }
        tables
    }

    /// Returns the map of a complete step, given by its index, from the tables of its parts.
    #[inline(always)]
    pub(super) fn whole<T: Number>(
        &self,
        tables: &[Vec<StepMaps<1, T>>; 2],
        step: usize,
        method: Method,
    ) -> StepMaps<1, T> {
        let [coarse, fine] = self.part_indices[step];
        let share = if method.uses_next_input() { Some(self.coarse_fraction[step]) } else { None };
        tables[0][coarse].then(&tables[1][fine], share)
    }
}

impl<const N: usize, T: Number> StepMaps<N, T> {
    /// Returns the map of a step followed by another: `D = D₁ + D₂ + D₂ D₁`; the gains of the first are propagated through
    /// the second. For a first-order hold over both, `share` is the fraction of the total length at which the first ends;
    /// it is `None` for a zero-order hold.
    #[inline(always)]
    #[doc(hidden)]
    pub fn then(&self, second: &Self, share: Option<f64>) -> Self {
        let mut made = *second;
        for lane in 0..N {
            let one = [self.d[0][lane], self.d[1][lane], self.d[2][lane], self.d[3][lane]];
            let two = [second.d[0][lane], second.d[1][lane], second.d[2][lane], second.d[3][lane]];
            let torque = [self.torque[0][lane], self.torque[1][lane]];
            let start = [self.taps[0][0][lane], self.taps[0][1][lane]];
            let end = [self.taps[1][0][lane], self.taps[1][1][lane]];
            for axis in 0..2 {
                made.torque[axis][lane] = second.torque[axis][lane] + propagated(&two, axis, torque);
                match share {
                    None => made.taps[0][axis][lane] = second.taps[0][axis][lane] + propagated(&two, axis, start),
                    Some(share) => {
                        let at_start = [start[0] + end[0] * (1.0 - share), start[1] + end[1] * (1.0 - share)];
                        let at_end = [end[0] * share, end[1] * share];
                        let [from_start, from_end] = [second.taps[0][axis][lane], second.taps[1][axis][lane]];
                        made.taps[0][axis][lane] = propagated(&two, axis, at_start) + from_start * (1.0 - share);
                        made.taps[1][axis][lane] = propagated(&two, axis, at_end) + (from_start * share + from_end);
                    }
                }
            }
            for n in 0..4 {
                let (row, column) = (2 * (n / 2), n % 2);
                made.d[n][lane] = one[n] + (two[n] + (two[row] * one[column] + two[row + 1] * one[column + 2]));
            }
        }
        made
    }
}

/// Returns one entry of `Φ x`, with `d = Φ − I`.
#[inline(always)]
fn propagated<T: Number>(d: &[T; 4], axis: usize, x: [T; 2]) -> T {
    x[axis] + (d[2 * axis] * x[0] + d[2 * axis + 1] * x[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretize::split;
    use crate::{Discretization, Input, Parameters, StepMap, seeded};

    #[test]
    fn a_table_has_the_maps_of_single_steps() {
        let unit = 1e-6;
        let steps: Vec<f64> = (1..200).map(|n| f64::from(n * 13) * unit).collect();
        let stiff = Parameters { l: 0.01 * Parameters::M2.l, ..Parameters::M2 };
        for motor in [Parameters::M2, stiff] {
            for discretization in [Discretization::Zoh, Discretization::Foh] {
                for input in [Input::Voltage, Input::Current] {
                    let method = Method { discretization, input };
                    let parts = SplitSteps::new(&steps, unit).unwrap();
                    let tables = parts.tables(&seeded(&motor), method);
                    for (n, step) in steps.iter().enumerate() {
                        let (map, slopes) = &split(&parts.whole(&tables, n, method));
                        let (direct, of_direct) = StepMap::with_sensitivities(&motor, *step, method);
                        let pairs = std::iter::once((map, &direct)).chain(slopes.iter().zip(&of_direct));
                        for (ours, direct) in pairs {
                            let flat = |m: &StepMap| [m.d.to_vec(), m.taps.concat(), m.torque.to_vec()];
                            for (ours, direct) in flat(ours).iter().zip(&flat(direct)) {
                                let size = motorfit_core::numeric::peak(direct);
                                assert!(
                                    ours.iter().zip(direct).all(|(a, b)| (a - b).abs() <= 1e-12 * size),
                                    "{method:?} {step}: {ours:?} {direct:?}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}
