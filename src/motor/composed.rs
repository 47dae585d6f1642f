//! Step maps of many steps at once. On an irregular clock all steps are multiples of one unit: a step of `64 a + b` units is
//! composed of one of `64 a` and one of `b`, so that few series are summed.

use super::discretize::{Method, StepMap, StepMaps, seeded, split, step_maps};
use super::dual::Number;
use super::linear::Parameters;
use crate::numeric::{count, whole};

/// Units of the coarse part of a step.
const COARSE: usize = 64;
/// Fewer steps are not worth a table.
const STEPS_MIN: usize = 32;

impl StepMap {
    /// Returns the maps of steps with their derivatives, as [`StepMap::with_sensitivities`] does for one. All steps are whole
    /// multiples of `unit_s`, up to rounding.
    #[must_use]
    pub fn all_with_sensitivities(
        parameters: &Parameters,
        steps_s: &[f64],
        unit_s: f64,
        method: impl Into<Method>,
    ) -> Vec<(Self, [Self; 5])> {
        all_step_maps(&seeded(parameters), steps_s, unit_s, method.into()).iter().map(split).collect()
    }
}

/// Returns the maps of one motor for steps that are whole multiples of `unit_s`, up to rounding.
pub(super) fn all_step_maps<T: Number>(
    motor: &[[T; 1]; 5],
    steps_s: &[f64],
    unit_s: f64,
    method: Method,
) -> Vec<StepMaps<1, T>> {
    if steps_s.len() < STEPS_MIN || !method.discretization.is_exact() {
        return steps_s.iter().map(|&h| step_maps(motor, h, method)).collect();
    }
    let parts: Vec<[usize; 2]> =
        steps_s.iter().map(|h| whole((h / unit_s).round())).map(|n| [n / COARSE, n % COARSE]).collect();
    let [coarse, fine] = [0, 1].map(|place| {
        let mut known: Vec<usize> = parts.iter().map(|parts| parts[place]).collect();
        known.sort_unstable();
        known.dedup();
        let unit_s = if place == 0 { count(COARSE) * unit_s } else { unit_s };
        let maps: Vec<StepMaps<1, T>> = known.iter().map(|n| step_maps(motor, count(*n) * unit_s, method)).collect();
        (known, maps)
    });
    let one = |&[many, few]: &[usize; 2]| {
        let [first, second] =
            [(&coarse, many), (&fine, few)].map(|((known, maps), n)| &maps[known.partition_point(|k| *k < n)]);
        let share = || count(many * COARSE) / count(many * COARSE + few);
        match (many, few) {
            (0, _) => *second,
            (_, 0) => *first,
            _ => composed(first, second, method.uses_next_input().then(share)),
        }
    };
    parts.iter().map(one).collect()
}

/// Returns the map of one step after another: `D = D₁ + D₂ + D₂ D₁`, and the gains of the first are carried through the second. An
/// input that goes on in a straight line is cut where the first ends, after the part `share` of both; it is `None` for one
/// that is held.
#[inline(always)]
fn composed<T: Number>(first: &StepMaps<1, T>, second: &StepMaps<1, T>, share: Option<f64>) -> StepMaps<1, T> {
    let (one, two) = (&first.d, &second.d);
    let carried = |axis: usize, [a, b]: [T; 2]| {
        let own = if axis == 0 { a } else { b };
        own + (two[2 * axis][0] * a + two[2 * axis + 1][0] * b)
    };
    let mut made = *second;
    for axis in 0..2 {
        let torque = first.torque.map(|[gain]| gain);
        made.torque[axis][0] = second.torque[axis][0] + carried(axis, torque);
        let [start, end] = first.taps.map(|taps| taps.map(|[gain]| gain));
        match share {
            None => made.taps[0][axis][0] = second.taps[0][axis][0] + carried(axis, start),
            Some(share) => {
                let at_start = [start[0] + end[0] * (1.0 - share), start[1] + end[1] * (1.0 - share)];
                let [from_start, from_end] = [second.taps[0][axis][0], second.taps[1][axis][0]];
                made.taps[0][axis][0] = carried(axis, at_start) + from_start * (1.0 - share);
                made.taps[1][axis][0] = carried(axis, end.map(|gain| gain * share)) + (from_start * share + from_end);
            }
        }
    }
    for n in 0..4 {
        let (row, column) = (2 * (n / 2), n % 2);
        made.d[n][0] = one[n][0] + (two[n][0] + (two[row][0] * one[column][0] + two[row + 1][0] * one[column + 2][0]));
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::{Discretization, Input};

    #[test]
    fn a_table_has_the_maps_of_single_steps() {
        let unit = 1e-6;
        let steps: Vec<f64> = (1..200).map(|n| f64::from(n * 13) * unit).collect();
        let stiff = Parameters { l: 0.01 * Parameters::M2.l, ..Parameters::M2 };
        for motor in [Parameters::M2, stiff] {
            for discretization in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4] {
                for input in [Input::Voltage, Input::Current] {
                    let method = Method { discretization, input };
                    let all = StepMap::all_with_sensitivities(&motor, &steps, unit, method);
                    for (step, (map, slopes)) in steps.iter().zip(&all) {
                        let (direct, of_direct) = StepMap::with_sensitivities(&motor, *step, method);
                        let pairs = std::iter::once((map, &direct)).chain(slopes.iter().zip(&of_direct));
                        for (ours, direct) in pairs {
                            let flat = |m: &StepMap| [m.d.to_vec(), m.taps.concat(), m.torque.to_vec()];
                            for (ours, direct) in flat(ours).iter().zip(&flat(direct)) {
                                let size = crate::numeric::peak(direct);
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
