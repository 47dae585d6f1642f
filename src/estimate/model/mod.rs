//! Estimation of users' models: output-error Levenberg–Marquardt from many starts, standard errors, unidentifiable combinations.

mod covariance;
mod damped_step;
mod descent;
mod fit;
mod multistart;
mod refine;

pub use covariance::ModelUncertainty;
pub(crate) use multistart::ARRIVALS;
pub use multistart::{ModelOptima, ModelStarts, Populations, model_optima};
pub use refine::{ModelRefined, ModelWeights, refine_model, refine_model_near};
