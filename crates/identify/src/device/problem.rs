//! Problems that devices evaluate: the evaluators of each machine, and its local search.

use super::evaluator_spec::Expected;
#[cfg(feature = "gpu")]
use super::settings::DeviceSettings;
#[cfg(feature = "gpu")]
use motorfit_core::Result;
use motorfit_evaluate::{Evaluator, SearchProblem, Simd};
#[cfg(feature = "gpu")]
use motorfit_gpu::{AdapterFacts, Precision, Selector};
use motorfit_optimize::LocalSearch;
use std::sync::Arc;

/// One problem for each run, or one for all.
pub struct Problems<P>(pub Vec<Arc<P>>);

impl<P> Problems<P> {
    /// Returns the problem of a run.
    pub fn of(&self, run: usize) -> &Arc<P> {
        &self.0[if self.0.len() == 1 { 0 } else { run }]
    }
}

/// An evaluator on an adapter.
#[cfg(feature = "gpu")]
pub type OnGpu<P> = (Box<dyn Evaluator<P>>, AdapterFacts);

/// Message for a problem that shaders cannot evaluate.
#[cfg(feature = "gpu")]
pub const NO_SHADER: &str = "no shader can be made, or checked, for this model and clock (sensors with an average, a filter or a delay, delays on an irregular clock, \
                             candidates that all diverge); the CPU evaluates instead";

/// A problem that devices evaluate.
#[doc(hidden)]
pub trait DeviceProblem: SearchProblem + Sized {
    /// Multiple of candidates at which a large population is divided: as many as the kernel computes side by side.
    const BLOCK: usize;

    /// Returns the kernel of the CPU.
    fn kernel(simd: Simd) -> Box<dyn Evaluator<Self>>;

    /// Returns the evaluator with tables of poles; `None` if the machine has none.
    fn tables() -> Option<Box<dyn Evaluator<Self>>> {
        None
    }

    /// Returns the number of steps of the kernel that take as long as a candidate with tables; `None` if these do not serve the problem.
    fn steps_of_tables(&self) -> Option<usize> {
        None
    }

    /// Returns true if tables are predicted to be faster than the kernel.
    fn prefers_tables(&self, _expected: Expected) -> bool {
        false
    }

    /// Returns the local search of the problems; `None` if the machine has none.
    fn local_search(_problems: &Problems<Self>) -> Option<&dyn LocalSearch> {
        None
    }

    /// Opens an adapter and returns its evaluator with its facts; `None` if no shader can be made for the problem.
    ///
    /// # Errors
    /// Returns a device error if the adapter is not available, or computes wrongly.
    #[cfg(feature = "gpu")]
    fn open_gpu(&self, selector: &Selector, precision: Option<Precision>) -> Result<Option<OnGpu<Self>>>;

    /// Returns the size of batches on an adapter of a kind, relative to those of the CPU.
    #[cfg(feature = "gpu")]
    fn batch_factor(_adapter: &str) -> usize {
        1
    }

    /// Returns the index of an adapter that is predicted to be faster than the CPU for the settings on so many problems; `None` if there is
    /// none.
    #[cfg(feature = "gpu")]
    fn faster_adapter(&self, _settings: &DeviceSettings, _problems: usize) -> Option<usize> {
        None
    }
}
