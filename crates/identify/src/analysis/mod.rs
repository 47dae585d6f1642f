//! Analysis of a finished fit: residual tests, the noise floor, intersample behaviour, characteristics, homogeneity,
//! validation.

mod characteristics;
mod characteristics_document;
mod feedback;
mod feedforward;
mod fit_metrics;
mod fitted;
mod friction;
mod homogeneity;
mod input_noise;
mod intersample;
mod noise_floor;
mod output_residuals;
mod outputs;
mod recording;
mod residual_correlation;
mod residual_input_test;
mod residuals;
mod speed_guess;
mod transfer_function;
mod validation;

pub use characteristics::{Characteristic, Characteristics, Covariance, Named, characteristics};
pub(crate) use characteristics_document::characteristics_document;
pub use feedback::{CONTROLLERS, Controller, FeedbackGains, FeedbackWeights, position_feedback, velocity_feedback};
pub use feedforward::{Regression, regression, regressions};
pub(crate) use fit_metrics::{FitMetrics, fit_percent, is_poor, poor_fit};
pub use fitted::FittedMotor;
pub(crate) use homogeneity::{Compared, Words, differing, homogeneity};
pub(crate) use input_noise::input_noise;
pub use intersample::{Intersample, detect_intersample, suspicions};
pub(crate) use intersample::{coarse_rate, intersample_of_current, intersample_of_voltage, is_lively};
pub use noise_floor::{NoiseFloor, noise_floor};
pub(crate) use output_residuals::{EXPLAINED_MIN, OutputResiduals, ResidualInputs};
pub use output_residuals::{ResidualTest, ResidualTests};
pub use outputs::Output;
pub(crate) use outputs::by_output;
pub(crate) use recording::unused_columns;
pub use recording::{record_warnings, warnings_of_records};
pub use residual_correlation::ResidualCorrelation;
pub use residual_input_test::{Regressors, ResidualInputTest, Residuals, residual_input_test};
pub(crate) use residuals::document as residuals_document;
pub(crate) use residuals::residual_tests;
pub(crate) use speed_guess::{guess_by_load, guess_by_speed, lag_by_speed, load_varies};
pub use transfer_function::TransferFunctions;
pub(crate) use validation::validate;
pub use validation::{HeldOut, Validation, split};
