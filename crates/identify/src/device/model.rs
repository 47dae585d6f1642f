//! The evaluators of users' models.

use super::problem::DeviceProblem;
#[cfg(feature = "gpu")]
use motorfit_core::Result;
use motorfit_evaluate::model::{LANES, ModelProblem};
use motorfit_evaluate::{Evaluator, Simd};
#[cfg(feature = "gpu")]
use motorfit_gpu::{Gpu, Precision, Selector};

impl DeviceProblem for ModelProblem {
    const BLOCK: usize = LANES;

    fn kernel(simd: Simd) -> Box<dyn Evaluator<Self>> {
        Box::new(simd)
    }

    #[cfg(feature = "gpu")]
    fn open_gpu(&self, selector: &Selector, precision: Option<Precision>) -> Result<Option<Gpu>> {
        let mut gpu = Gpu::unchecked(selector, precision)?;
        Ok(gpu.serves_model(self)?.then_some(gpu))
    }

    #[cfg(feature = "gpu")]
    fn on_gpu(gpu: Gpu) -> Box<dyn Evaluator<Self>> {
        Box::new(gpu)
    }
}
