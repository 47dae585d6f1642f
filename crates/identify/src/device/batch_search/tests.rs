//! Devices that fail, and leaders of searches in reduced precision.

use super::*;
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_evaluate::{Model, Scalar, SearchProblem as _, Simd};
use motorfit_model::BuiltIn;
use motorfit_motor::Space;
use motorfit_record::{Record, Samples};

/// A device that fails after some batches.
struct Broken(usize);

impl Evaluator for Broken {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        if self.0 == 0 {
            return Err(motorfit_core::Error::new(motorfit_core::ErrorKind::Device, "lost", "Run again."));
        }
        self.0 -= 1;
        Simd::default().evaluate(batch, costs)
    }

    fn finish(&mut self, batch: &Batch<'_>, pending: Pending, costs: &mut [f64]) -> Result<()> {
        assert_eq!(pending.take::<usize>(), Some(7), "only what it began itself");
        self.evaluate(batch, costs)
    }

    fn begin(&mut self, _: &Batch<'_>) -> Result<Pending> {
        Ok(Pending::of(7_usize))
    }
}

fn ramp() -> Arc<Problem> {
    let ramp: Vec<f64> = (0..50).map(f64::from).collect();
    let samples = Samples {
        time_s: ramp.iter().map(|n| 0.001 * n).collect(),
        voltage: ramp.clone(),
        torque: None,
        current: Some(ramp.clone()),
        speed: Some(ramp),
        ..Samples::default()
    };
    let record = Record::new(samples).unwrap();
    Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default()).unwrap())
}

const VALUES: [f64; 5] = [0.5, 0.01, 0.05, 1e-4, 1e-4];

#[test]
fn a_lost_device_is_opened_again() {
    let (problem, populations) = (ramp(), [Candidates::new(&VALUES, 5)]);
    // The device can be opened twice and evaluates two batches each time.
    for (on_loss, serves) in [(OnLoss::Reopen, 6), (OnLoss::ReopenOrCpu, 20), (OnLoss::Fail, 2)] {
        let mut left = 2;
        let reopen: crate::device::select::Reopen<Problem> = Box::new(move || {
            if left == 0 {
                return Err(motorfit_core::Error::new(motorfit_core::ErrorKind::Device, "gone", "Run again."));
            }
            left -= 1;
            Ok(Box::new(Broken(2)))
        });
        let opened = SelectedDevice { kind: "gpu", reopen: Some(reopen), ..SelectedDevice::given(Box::new(Broken(2))) };
        let mut searches = BatchSearchEvaluator::on(opened, vec![problem.clone()]).on_loss(on_loss);
        let mut costs = [0.0];
        searches.begin(&populations).unwrap();
        let mut served = 0;
        while served < 20 {
            // Two batches are in flight whenever the device fails.
            if searches.begin(&populations).is_err() || searches.finish(&populations, &mut costs).is_err() {
                break;
            }
            assert!((costs[0] / Scalar::cost(&problem, &VALUES) - 1.0).abs() < 1e-12);
            served += 1;
        }
        assert_eq!(served, serves, "{on_loss:?}");
        let codes: Vec<&str> = searches.warnings().iter().map(|w| w.code).collect();
        let expected: &[&str] = match on_loss {
            OnLoss::Reopen => &["gpu_reopened", "gpu_reopened"],
            OnLoss::ReopenOrCpu => &["gpu_reopened", "gpu_reopened", "gpu_failed"],
            _ => &[],
        };
        assert_eq!(codes, expected);
        assert_eq!(searches.device().kind, if on_loss == OnLoss::ReopenOrCpu { "cpu" } else { "gpu" });
    }
}

#[test]
fn auto_continues_on_the_cpu_and_a_requested_device_does_not() {
    let (problem, values) = (ramp(), VALUES);
    let populations = [Candidates::new(&values, 5)];
    let mut costs = [0.0];
    for auto in [true, false] {
        let on_loss = if auto { OnLoss::Cpu } else { OnLoss::Fail };
        let opened = SelectedDevice { kind: "gpu", on_loss, ..SelectedDevice::given(Box::new(Broken(0))) };
        let mut searches = BatchSearchEvaluator::on(opened, vec![problem.clone()]);
        // Two batches are in flight when the device fails.
        searches.begin(&populations).unwrap();
        searches.begin(&populations).unwrap();
        let done = searches.finish(&populations, &mut costs);
        assert_eq!(done.is_ok(), auto);
        if auto {
            searches.finish(&populations, &mut costs).unwrap();
            assert_eq!((searches.device().kind, searches.device().precision), ("cpu", "f64"));
            assert_eq!(searches.warnings().len(), 1);
            assert_eq!(searches.warnings()[0].code, "gpu_failed");
            assert!((costs[0] / Scalar::cost(&problem, &values) - 1.0).abs() < 1e-12);
            assert_eq!(searches.cost_difference(0, &values), None);
        }
    }
}

/// An evaluator of models in reduced precision: costs that are a little too low, but for the second candidate.
struct Rough;

impl Evaluator<ModelProblem> for Rough {
    fn evaluate(&mut self, batch: &Batch<'_, ModelProblem>, costs: &mut [f64]) -> Result<()> {
        Simd::default().evaluate(batch, costs)?;
        costs.iter_mut().enumerate().for_each(|(n, cost)| *cost *= if n == 1 { 1.01 } else { 0.99 });
        Ok(())
    }

    fn is_exact(&self) -> bool {
        false
    }
}

#[test]
fn leaders_on_a_model_are_evaluated_again() {
    let model = BuiltIn::DcMotor.model().unwrap();
    let time_s: Vec<f64> = (0..50).map(|n| 0.001 * f64::from(n)).collect();
    let inputs = vec![time_s.clone(), vec![0.0; 50]];
    let recording = ModelRecording::to_simulate(&model, time_s, inputs).unwrap();
    let space = ModelSpace::new(&model, 1);
    let problem = Arc::new(ModelProblem::new(&model, space, vec![recording], ModelSettings::default()).unwrap());
    let candidates: Vec<f64> = (0..6).flat_map(|n| VALUES.map(|value| value * (1.0 + 0.1 * f64::from(n)))).collect();
    let mut searches = BatchSearchEvaluator::new(Box::new(Rough), vec![problem.clone()]);
    let (populations, mut costs) = ([Candidates::new(&candidates, 5)], [0.0; 6]);
    searches.begin(&populations).unwrap();
    searches.finish(&populations, &mut costs).unwrap();
    let exact: Vec<f64> = candidates.chunks(5).map(|row| problem.cost_of(row)).collect();
    let lowest = |costs: &[f64]| costs.iter().copied().fold(f64::INFINITY, f64::min).to_bits();
    assert_eq!(lowest(&costs), lowest(&exact));
    // The others are not.
    let again = costs.iter().zip(&exact).filter(|(own, exact)| own.to_bits() == exact.to_bits()).count();
    assert!((LEADERS..6).contains(&again), "{again}");
    assert_eq!((searches.device().precision, searches.local_search().is_none()), ("f32", true));
}
