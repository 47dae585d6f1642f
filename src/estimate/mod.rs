//! Estimation in f64 on the CPU: Steiglitz–McBride, the maximum-likelihood refinement, how sure it is.

mod descent;
mod initial;
mod normal;
mod output_error;
mod projection;
mod recover;
mod reference;
mod refine;
mod sensitivity;
mod steiglitz_mcbride;
mod triangle;
mod uncertainty;

pub use initial::initial_states;
pub use reference::{Reference, ReferenceKind, global_reference, squares};
pub use refine::{RefineOptions, Refined, fit_problem, refine, refine_on, refine_roughly};
pub use steiglitz_mcbride::{
    Estimate, SmFailure, SmOptions, steiglitz_mcbride, try_steiglitz_mcbride, try_steiglitz_mcbride_on,
};
pub(crate) use uncertainty::INDEPENDENT_MIN;
pub use uncertainty::{Uncertainty, Whiteness, describe};
