//! Problems of the searches of a comparison on the device that evaluates them, for any machine.

use super::parameter::ComparedParameter;
use super::reference::Reference;
use motorfit_core::setting::Text;
use motorfit_identify::device::DeviceUsed;
use motorfit_optimize::Evaluate;
use motorfit_record::warning::Warning;
use std::ops::ControlFlow;

/// Observer that may end a computation.
pub(super) type Look<'a> = dyn FnMut() -> ControlFlow<()> + 'a;

/// The search problems of the settings of a comparison, and their evaluator.
pub(super) trait Engine {
    /// Returns the parameters of the machine.
    fn parameters(&self) -> Vec<ComparedParameter>;

    /// Returns the box of the search, `(min, max)` for each value of a candidate.
    fn bounds(&self) -> Vec<(f64, f64)>;

    /// Sets the runs that are evaluated next, each by the index of its setting.
    fn set_runs(&mut self, settings: &[usize]);

    /// Returns the evaluator of the populations of these runs.
    fn evaluator(&mut self) -> &mut dyn Evaluate;

    /// Returns the number of candidates between two calls of the observer.
    fn slice(&self) -> usize;

    /// Returns the cost of a candidate in the criterion of a setting, computed on the CPU in f64; +∞ for one that diverges.
    fn cost(&self, setting: usize, candidate: &[f64]) -> f64;

    /// Returns the refined estimate, or the reason why there is none.
    fn reference(&self, look: &mut Look<'_>) -> std::result::Result<Reference, Text>;

    /// Returns the cost of the refined estimate in the criterion of a setting; `None` if it does not compare with those of the
    /// searches.
    fn reference_cost(&self, setting: usize, reference: &Reference) -> Option<f64>;

    /// Returns the work of the refined estimate \[samples\].
    fn reference_work(&self) -> usize;

    /// Returns the kind (`cpu` or `gpu`), the name and the precision of the device.
    fn device(&self) -> DeviceUsed;

    /// Returns the warnings about the device.
    fn warnings(&self) -> Vec<Warning>;

    /// Returns the initial state `[i, ω]` of a DC motor in each recording \[A, rad/s\]; empty for a model.
    fn initial(&self) -> Vec<[f64; 2]>;
}
