//! Machines that methods are compared on, with their recordings.

use motorfit_core::Result;
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::experiment::{Excitation, simulated};
use motorfit_evaluate::model::{ModelProblem, ModelRecording};
use motorfit_identify::model::ModelSpec;
use motorfit_model::Model;
use motorfit_motor::{Discretization, Parameters};
use motorfit_record::Record;

/// Recordings of the machine that methods are compared on.
#[derive(Debug, Clone)]
pub struct ComparisonSubject {
    /// Recordings of the machine.
    pub records: Vec<Record>,
    /// The machine.
    pub machine: ComparedMachine,
}

/// Machine that methods are compared on.
#[derive(Debug, Clone)]
pub enum ComparedMachine {
    /// The linear DC motor.
    Motor {
        /// True parameters of a simulated motor; `None` for a measured one.
        truth: Option<Parameters>,
    },
    /// A user's model.
    Model(Box<ComparedModel>),
}

/// A user's model with the signals of its recordings.
#[derive(Debug, Clone)]
pub struct ComparedModel {
    /// The model.
    pub model: Model,
    /// Signals of the recordings.
    pub recordings: Vec<ModelRecording>,
    /// Bounds, fixed and per-recording parameters, the integration, and the settings of the refined estimate. The criterion, the
    /// budget and the device of the searches are those of the comparison.
    pub spec: ModelSpec,
}

impl ComparedModel {
    /// Returns the problem of the searches that minimize a criterion.
    ///
    /// # Errors
    /// Returns the errors of [`ModelSpec::problem`].
    pub fn problem(&self, criterion: Criterion) -> Result<ModelProblem> {
        let spec = ModelSpec { criterion, ..self.spec.clone() };
        spec.problem(&self.model, self.recordings.clone())
    }
}

impl ComparisonSubject {
    /// Makes a subject of recordings of a DC motor, with its true parameters if it is simulated.
    #[must_use]
    pub fn of_motor(records: Vec<Record>, truth: Option<Parameters>) -> Self {
        Self { records, machine: ComparedMachine::Motor { truth } }
    }

    /// Makes a subject of recordings of a model, which were read with its signals.
    ///
    /// # Errors
    /// Returns `Data` if a recording lacks an input without a default, or all outputs.
    pub fn of_model(model: Model, records: Vec<Record>, spec: ModelSpec) -> Result<Self> {
        let recordings = records.iter().map(|record| ModelRecording::new(&model, record)).collect::<Result<_>>()?;
        Ok(Self { records, machine: ComparedMachine::Model(Box::new(ComparedModel { model, recordings, spec })) })
    }

    /// Returns the paper's experiment: motor M2 at rest, 10.5 V from 1 s on, 3 s sampled at 1 ms, without noise.
    ///
    /// # Errors
    /// Propagates the errors of the simulation; the arguments given here cause none.
    pub fn m2() -> Result<Self> {
        let step = Excitation::step(10.5, 1.0, 3.0, 0.001)?;
        let record = simulated(&Parameters::M2, &step, Discretization::Zoh)?;
        Ok(Self::of_motor(vec![record], Some(Parameters::M2)))
    }

    /// Returns the true parameters of a simulated DC motor; `None` for a measured machine.
    #[must_use]
    pub fn truth(&self) -> Option<Parameters> {
        if let ComparedMachine::Motor { truth } = self.machine { truth } else { None }
    }

    /// Returns the model; `None` for the DC motor.
    #[must_use]
    pub fn model(&self) -> Option<&ComparedModel> {
        if let ComparedMachine::Model(of) = &self.machine { Some(of) } else { None }
    }
}
