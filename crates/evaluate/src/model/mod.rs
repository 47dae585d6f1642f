//! Evaluation of users' models: candidates on recordings, and trajectories with their derivatives.

#[cfg(test)]
mod affine_tests;
#[cfg(test)]
mod coupled_reaction_tests;
#[cfg(test)]
mod delay_tests;
#[cfg(test)]
mod differences;
mod evaluator;
mod method;
mod normal;
mod prepared;
mod problem;
mod programs;
#[cfg(test)]
mod reaction_tests;
mod recording;
#[cfg(test)]
mod sampled_tests;
mod searched;
#[cfg(test)]
mod sensor_tests;
mod space;
mod stiffness;
#[cfg(test)]
mod tests;
mod trajectory;
mod trial;
mod walk;

pub use method::{ModelMethod, StepChange, Stiffness};
#[doc(hidden)]
pub use normal::OutputSums;
#[doc(hidden)]
pub use problem::LANES;
pub use problem::{ModelProblem, ModelSettings};
pub use recording::{ModelRecording, signal_requests};
pub use space::{ModelAxis, ModelSpace};
pub use trajectory::Trajectory;
#[doc(hidden)]
pub use trajectory::{Point, Unknown};
