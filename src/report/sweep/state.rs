//! The JSON documents of the state of a sweep.

use crate::report::spelling::command_line;
use crate::study::sweep::{FailedRun, Shard, ShardStatus, SweepStatus, Tally};
use crate::warning::Warning;
use serde_json::{Value, json as value};

/// The JSON document of what a run of a shard did.
pub struct TallyDocument;

impl TallyDocument {
    /// What a run of a shard did.
    #[must_use]
    pub fn of(shard: Shard, tally: &Tally) -> Value {
        let failed = |f: &FailedRun| value!({"id": f.id, "runs": f.runs, "motor": f.motor, "message": f.message});
        let warning = |w: &Warning| value!({"code": w.code, "message": w.message.spelled(command_line)});
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"),
            "shard": {"index": shard.index, "count": shard.count},
            "runs": tally.total, "before": tally.before, "finished": tally.finished, "failed": tally.failed,
            "lost": tally.lost,
            "failures": tally.failures.named.iter().map(failed).collect::<Value>(),
            "warnings": tally.warnings.iter().map(warning).collect::<Value>(),
            "device": tally.device.as_ref().map(|(name, precision)| value!({"name": name, "precision": precision})),
            "stop": if tally.interrupted { "interrupted" } else { "done" },
            "seconds": tally.seconds,
        })
    }
}

/// The JSON document of how far a sweep is.
pub struct StatusDocument;

impl StatusDocument {
    /// How far a sweep is.
    #[must_use]
    pub fn of(status: &SweepStatus) -> Value {
        let shard = |s: &ShardStatus| {
            let Shard { index, count } = s.shard;
            value!({"index": index, "count": count, "done": s.done, "failed": s.failed, "running": s.running})
        };
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"), "name": status.name, "runs": status.runs, "done": status.done,
            "failed": status.failed, "missing": status.runs - status.done, "merged": status.merged,
            "shards": status.shards.iter().map(shard).collect::<Value>(),
        })
    }
}
