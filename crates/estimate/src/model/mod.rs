//! Estimation of users' models: output-error Levenberg–Marquardt from many starts, standard errors, unidentifiable combinations.

mod around;
mod covariance;
mod damped_step;
mod descent;
mod ends;
mod fit;
mod multistart;
mod refine;
mod search;

pub use covariance::ModelUncertainty;
#[doc(hidden)]
pub use multistart::rounds_max;
pub use multistart::{ModelEnd, ModelOptima, ModelStarts, Populations, model_ends, model_optima};
pub use refine::{ModelRefined, ModelWeights, refine_model, refine_model_near};
#[doc(hidden)]
pub use search::ARRIVALS;
