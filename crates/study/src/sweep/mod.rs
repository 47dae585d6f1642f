//! Sweeps: the runs of a study, or the recordings of a production line, in batches that can be interrupted at any time
//! and resumed.
//!
//! A study is planned into a folder with an immutable manifest. Each shard of its runs appends finished runs to a
//! results file of its own, and a merge sorts them. The bytes of the merged results depend only on the manifest, the
//! device kind, the precision and the instruction-set class.

mod dataset;
mod entries;
mod estimates;
mod fits;
mod head;
mod keys;
mod levels;
mod limits;
mod line;
mod lines;
mod machine;
mod manifest;
mod merge;
mod parameter;
mod pattern;
mod plan;
mod planned;
mod remote_shard;
mod results;
mod run;
mod runs;
#[cfg(test)]
mod sample;
mod search;
mod shard;
mod store;
mod streaming;
mod study;
mod summary;
mod toml;
mod trust;
mod units;

pub use estimates::{OutputFits, RunEstimate, RunEstimates};
pub use limits::Limits;
pub use line::{Failure, HeldOutFit, Line, Outcome};
pub use machine::ModelFile;
pub use manifest::{File, Manifest, Motor, PinnedDevice};
pub use merge::{Merged, ShardStatus, SweepStatus};
pub use parameter::SweepParameter;
pub use planned::Sweep;
pub use run::{FailedRun, Failures, Observe, SweepProgress, Tally};
pub use runs::Job;
pub use shard::Shard;
pub use study::Factors;
pub use summary::{Cell, NamedRun, Quantiles, SweepBlock, SweepSummary};
pub use trust::{LevelCounts, RunTrust, TrustCounts};

use motorfit_core::limit::{Limit, limit, limit_of};

/// Limits of studies.
pub(super) const LIMITS: [Limit; 4] = [
    limit("bytes of a study", plan::BYTES_MAX, "refused"),
    limit("runs of a study", manifest::RUNS_MAX, "refused"),
    limit("shards of a sweep", shard::SHARDS_MAX, "refused"),
    limit_of("folders that a file pattern visits", pattern::FOLDERS_MAX, "refused"),
];
