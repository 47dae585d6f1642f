//! The order of the recordings of a joint fit in evaluations with cutoffs. A candidate leaves once its total so far is above its
//! cutoff, so recordings on which errors are large come first. Costs do not depend on the order.

use super::evaluator::Evaluator;
use super::problem::Problem;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::{count, spread};
use std::sync::Arc;

/// Number of candidates that are evaluated on each recording alone: a few blocks.
const PROBES: usize = 48;

/// Returns the indices of the recordings, ordered by the total per sample that a tenth of the candidates spread over the box stay
/// below, the highest first. The lowest total is less telling: it is mostly noise where one candidate happens to be close.
/// Parameters of single recordings are those of the first.
pub(super) fn hardest_first(problem: &Problem, evaluator: &mut dyn Evaluator) -> Vec<usize> {
    let probes = probes(problem);
    let mut total = |recording: usize| {
        let alone = Arc::new(problem.only(recording));
        let candidates = Candidates::new(&probes, problem.space().free().len());
        let mut costs = vec![0.0; candidates.count()];
        // If the evaluation fails, the recording comes first.
        if evaluator.costs(&alone, candidates, &mut costs).is_err() {
            return f64::INFINITY;
        }
        costs.sort_by(f64::total_cmp);
        let low = costs.get(PROBES / 10).copied().unwrap_or(f64::INFINITY);
        alone.total_above(low) / count(alone.active().max(1))
    };
    let keys: Vec<f64> = (0..problem.signals().len()).map(&mut total).collect();
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by(|a, b| keys[*b].total_cmp(&keys[*a]));
    order
}

/// Returns candidates spread over the box.
fn probes(problem: &Problem) -> Vec<f64> {
    let bounds = problem.space().bounds();
    let point =
        |n| spread(n, bounds.len()).zip(&bounds).map(|(at, (min, max))| min + (max - min) * at).collect::<Vec<_>>();
    (0..PROBES).flat_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criterion::Criterion;
    use crate::{Model, Scalar};
    use motorfit_motor::{Discretization, Parameters, SimulationInput, Space, simulate};
    use motorfit_record::{Record, Samples};

    #[test]
    fn a_recording_that_tells_candidates_apart_comes_first() {
        let record = |volts: &dyn Fn(u32) -> f64| -> Record {
            let voltage: Vec<f64> = (0..1001).map(volts).collect();
            let input =
                SimulationInput { step_s: &[0.001], step_index: &[], voltage: &voltage, voltage_end: &[], torque: &[] };
            let [current, speed] = simulate(&Parameters::M2, &input, [0.0; 2], Discretization::Zoh);
            let time_s = (0..1001).map(|n| f64::from(n) * 0.001).collect();
            Record::new(Samples {
                time_s,
                voltage,
                torque: None,
                current: Some(current),
                speed: Some(speed),
                ..Samples::default()
            })
            .unwrap()
        };
        let step = record(&|_| 10.0);
        // A voltage that changes sign at every other sample barely moves the motor: every candidate fits it alike.
        let buzz = record(&|n| if n % 4 < 2 { 10.0 } else { -10.0 });
        for (records, expected) in [([step.clone(), buzz.clone()], [0, 1]), ([buzz, step], [1, 0])] {
            let problem = Problem::new(&records, Model::default(), Space::table2(), Criterion::default()).unwrap();
            // The oracle will do, so that these tests do not compile the kernels.
            assert_eq!(hardest_first(&problem, &mut Scalar), expected);
        }
    }
}
