//! The evaluators of users' models.

use super::problem::DeviceProblem;
#[cfg(feature = "gpu")]
use super::problem::OnGpu;
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
    fn open_gpu(&self, selector: &Selector, precision: Option<Precision>) -> Result<Option<OnGpu<Self>>> {
        let mut gpu = Gpu::unchecked(selector, precision)?;
        let (is_served, facts) = (gpu.serves_model(self)?, gpu.facts().clone());
        Ok(if is_served { Some((Box::new(gpu), facts)) } else { None })
    }
}
