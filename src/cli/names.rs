//! Names that flags take.

use clap::ValueEnum;

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum When {
    Auto,
    Always,
    Never,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum ProgressKind {
    Auto,
    Json,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum Preset {
    /// Tables 2 and 3, 100 agents × 100 generations; euclidean with scale peak, and with scale none as printed
    Paper,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum MethodName {
    /// Steiglitz–McBride, or a search where it cannot serve
    Auto,
    /// Steiglitz–McBride
    Sm,
    /// Grey Wolf Optimizer
    Gwo,
    /// Jaya
    Jaya,
    /// Genetic algorithm
    Ga,
    /// Random search
    Random,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum PolishName {
    /// Levenberg–Marquardt: maximum likelihood, with standard errors
    Lm,
    /// No refinement
    None,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum CriterionName {
    Euclidean,
    Ise,
    Iae,
    Itse,
    Itae,
    Mse,
    Nrmse,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum ScaleName {
    None,
    Peak,
    Std,
    Noise,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum DiscretizationName {
    Zoh,
    Foh,
    Rk4,
    Euler,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum InitialName {
    Auto,
    Zero,
    Measured,
    Free,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum Precision {
    Auto,
    F32,
    F64,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum GapsName {
    /// Bad data
    Error,
    /// A long step, over which the voltage is held
    Keep,
    /// Each stretch between gaps is a recording of its own
    Split,
}
