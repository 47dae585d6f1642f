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
fn composed<T: Number>(first: &StepMaps<1, T>, second: &StepMaps<1, T>, share: Option<f64>) -> StepMaps<1, T> {
    let (one, two) = (first.d.map(|[entry]| entry), second.d.map(|[entry]| entry));
    let carried = |[a, b]: [T; 2]| [a + (two[0] * a + two[1] * b), b + (two[2] * a + two[3] * b)];
    let added = |[a, b]: [T; 2], [c, d]: [T; 2]| [a + c, b + d];
    let scaled = |[a, b]: [T; 2], by: f64| [a * by, b * by];
    let columns = |of: &StepMaps<1, T>| [of.taps[0], of.taps[1], of.torque].map(|axes| axes.map(|[gain]| gain));
    let ([start, end, torque], [start_two, end_two, torque_two]) = (columns(first), columns(second));
    let (from_start, from_end) = match share {
        None => (added(carried(start), start_two), end),
        Some(share) => (
            added(carried(added(start, scaled(end, 1.0 - share))), scaled(start_two, 1.0 - share)),
            added(carried(scaled(end, share)), added(scaled(start_two, share), end_two)),
        ),
    };
    let torque = added(carried(torque), torque_two);
    let d = std::array::from_fn(|n| {
        let (row, column) = (2 * (n / 2), n % 2);
        [one[n] + (two[n] + (two[row] * one[column] + two[row + 1] * one[column + 2]))]
    });
    StepMaps { d, taps: [from_start, from_end].map(|axes| axes.map(|gain| [gain])), torque: torque.map(|gain| [gain]) }
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
