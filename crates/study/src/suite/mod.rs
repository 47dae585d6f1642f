//! Suites: searches on problems with known optima, at equal budgets of evaluations.
//!
//! A run reaches a target when its cost is within a relative gap of the known optimum, where 1 is the gap of a random candidate. The
//! measures are those of black-box optimization: expected running times and success rates (N. Hansen et al., Optimization Methods and
//! Software 36(1), 2021), data profiles (J. Moré, S. Wild, SIAM J. Optim. 20(1), 2009), performance profiles (E. Dolan, J. Moré,
//! Math. Program. 91, 2002), and ranks over problems (J. Demšar, J. Mach. Learn. Res. 7, 2006).

mod definition;
mod entrant;
mod gap;
mod measures;
mod profiles;
mod ranks;
mod run;

pub use definition::{Suite, SuiteProblem};
pub use entrant::Entrant;
pub use gap::{GAP, GAP_MIN};
pub use measures::SuiteMeasure;
pub use ranks::SuiteRanks;
pub use run::{SuiteBlock, SuiteResult, SuiteRun, SuiteSpec, run_suite};
