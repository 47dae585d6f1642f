//! Python bindings: the library's types as classes, its errors as exceptions, its signals and costs as numpy arrays.
//!
//! This crate only converts arguments and results. Computations release the interpreter's lock (GIL) and end at Ctrl-C.

mod answers;
mod arrays;
mod compare;
mod comparison;
mod errors;
mod evaluator;
mod exclusive_lock;
mod export;
mod figure;
mod found;
mod frame;
mod identification;
mod identify;
mod identify_own;
mod model;
mod model_methods;
mod optimizer;
mod pool;
mod progress;
mod reading;
mod record;
mod simulate;
mod source;
mod spec;
mod sweep;
mod throughput_profile;

use pyo3::prelude::*;

/// Compiled part of the package motorfit.
#[pymodule]
mod _motorfit {
    #[pymodule_export]
    use super::compare::compare;
    #[pymodule_export]
    use super::comparison::{Comparison, ComparisonBlock};
    #[pymodule_export]
    use super::evaluator::Evaluator;
    #[pymodule_export]
    use super::figure::Svg;
    #[pymodule_export]
    use super::identification::Identification;
    #[pymodule_export]
    use super::identify::identify;
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::optimizer::Optimizer;
    #[pymodule_export]
    use super::progress::Progress;
    #[pymodule_export]
    use super::reading::read;
    #[pymodule_export]
    use super::record::Record;
    #[pymodule_export]
    use super::simulate::{devices, refine, simulate, steiglitz_mcbride};
    #[pymodule_export]
    use super::sweep::{Sweep, SweepProgress};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
