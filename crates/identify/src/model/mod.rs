//! Identification with a user's model: search, refinement, residual tests, trust.

mod combinations;
mod derived;
mod estimates;
mod fine_steps;
mod given_starts;
mod homogeneity;
mod islands;
mod lacking;
mod likelihood;
mod pipeline;
mod recordings;
mod result;
mod sampled_law;
mod selection;
mod serialize;
mod spec;
mod step_accuracy;
mod terms;
mod tests_of_residuals;
mod trust;

pub use likelihood::model_likelihood_profiles;
pub use pipeline::{ModelProgress, hold_out_model, identify_model};
pub use result::{ModelFit, ModelIdentification, OwnModel};
pub use serialize::integration;
pub use spec::ModelSpec;
pub use terms::ModelTerms;
#[doc(hidden)]
pub use tests_of_residuals::fit_percent;
