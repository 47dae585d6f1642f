//! Evaluation of users' models: candidates on recordings, and trajectories with their derivatives.

mod method;
mod problem;
mod recording;
mod space;
#[cfg(test)]
mod tests;
mod trajectory;
mod trial;

pub use method::{ModelMethod, Stiffness};
pub use problem::{ModelProblem, ModelSettings};
pub use recording::{ModelRecording, signal_requests};
pub use space::{ModelAxis, ModelSpace};
pub use trajectory::Trajectory;
pub(crate) use trajectory::Unknown;
