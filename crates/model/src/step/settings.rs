//! Settings of the steps of a model.

use motorfit_core::named::named;

named! {
    /// Integration method of a model.
    pub enum IntegrationMethod (default Exponential) {
        /// Matrix exponentials: exact for affine models, of order 4 with nonlinear terms (ETDRK4).
        Exponential = "exponential",
        /// Classical Runge–Kutta method of order 4 with equal substeps.
        RungeKutta = "rk4",
    }
}

/// Settings of the steps of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSettings {
    /// Integration method.
    pub method: IntegrationMethod,
    /// Number of substeps of the Runge–Kutta method.
    pub substeps: usize,
    /// Length of the step \[s\]; `None` if it differs between samples and is an input, after all others.
    pub step_s: Option<f64>,
    /// True if inputs are linear between samples, false if they are constant.
    pub is_first_order_hold: bool,
}
