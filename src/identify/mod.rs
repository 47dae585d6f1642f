//! The main job: recordings in, R, L, K, B, J out, with their standard errors.
//!
//! A method finds a first optimum: Steiglitz–McBride, or a population search that minimizes the criterion over the
//! space, every generation evaluated at once. The polish refines it to the maximum-likelihood estimate. Both are held
//! against a search of the whole box. `pipeline.rs` reads from the first stage to the last.

mod automatic;
mod batch_costs;
mod bic;
mod checks;
mod current_driven;
mod estimates;
mod extension_bounds;
mod fit;
mod hull;
mod identifiability;
mod lacking;
mod late_voltage;
mod method;
mod missing_channel;
mod model_selection;
mod models;
mod normalized;
mod null_space;
mod open_groups;
mod pipeline;
mod prepare;
mod profile;
mod refine;
mod repeated;
mod result;
mod search;
mod serialize;
mod shared_reference;
mod spec;
mod start;
mod trust;
mod trust_level;
mod unidentified;
mod verify;
mod warnings;

pub use batch_costs::BatchCosts;
pub use current_driven::needs_voltage;
pub(crate) use estimates::some_or_nulls;
pub use estimates::{Estimates, ParameterEstimate};
pub use fit::{Diagnosed, PreparedSearch, SearchRun, fit_on, has_all_channels, with_cost_on};
pub use identifiability::{Identifiability, Inspection};
pub use method::{Method, Polish};
pub use models::{Alternative, SelectionStep};
pub use pipeline::{identify, identify_with};
pub use result::{Identification, LeftOut, SearchOutcome, hold_out, validate};
pub(crate) use serialize::bounds;
pub use spec::IdentifySpec;
pub use trust_level::{REASONS, Trust, TrustLevel, TrustReason};
pub use verify::{Status, Verification, verify_at};
