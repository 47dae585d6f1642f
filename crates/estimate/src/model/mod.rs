//! Estimation of users' models: output-error Levenberg–Marquardt from many starts.

mod around;
mod ends;
mod fitted;
mod multistart;
mod refine;
mod search;

pub use ends::best_model_start;
#[doc(hidden)]
pub use multistart::rounds_max;
pub use multistart::{ModelEnd, ModelOptima, ModelStarts, Populations, model_ends, model_optima};
pub use refine::{open_flat, refine_model, signal_sigma};
#[doc(hidden)]
pub use search::ARRIVALS;
