//! JSON documents of a sweep: results, sessions and progress.

use super::capability::Capability;
use super::line::{Excess, Spread, excesses, spreads};
use super::words::cell_of;
use crate::document::joined;
use crate::spelling::command_line;
use motorfit_record::warning::Warning;
use motorfit_study::sweep::{
    Cell, Factors, Limits, NamedRun, Quantiles, Shard, SweepBlock, SweepStatus, SweepSummary, Tally, TrustCounts,
};
use serde_json::{Map, Value, json as value};

/// Returns the JSON document of the results of a sweep.
#[must_use]
pub fn sweep_document(summary: &SweepSummary, limits: &Limits) -> Value {
    let motors = spreads(summary, limits);
    let motors = motors.iter().map(|s| (s.parameter.name.clone(), spread(s, !limits.is_empty())));
    let bounds = |symbol: &str| (symbol.to_owned(), value!(limits.of(symbol)));
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "name": summary.name,
        "runs": summary.runs,
        "missing": summary.missing,
        "failed": summary.failed,
        "failures": summary.failures.named,
        "trust": trust(&summary.trust),
        "taken_over": summary.taken_over,
        "device": {"kind": summary.device[0], "precision": summary.device[1]},
        "varied": summary.varied,
        "stride": summary.stride,
        "blocks": summary.blocks.iter().map(block).collect::<Value>(),
        "motors": {
            "count": summary.motors,
            "identified": summary.results.len(),
            "parameters": motors.collect::<Map<String, Value>>(),
        },
        "limits": limits.symbols().map(bounds).collect::<Map<String, Value>>(),
        "outside": excesses(summary, limits).iter().map(outside).collect::<Value>(),
    })
}

/// Returns the JSON document of one session of a shard.
#[must_use]
pub fn tally_document(shard: Shard, tally: &Tally) -> Value {
    let warning = |w: &Warning| value!({"code": w.code, "message": w.message.spelled(command_line)});
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "shard": shard,
        "runs": tally.total, "before": tally.before, "finished": tally.finished, "failed": tally.failed,
        "lost": tally.lost,
        "trust": tally.trust,
        "failures": tally.failures.named,
        "warnings": tally.warnings.iter().map(warning).collect::<Value>(),
        "device": tally.device,
        "stop": if tally.interrupted { "interrupted" } else { "done" },
        "seconds": tally.seconds,
    })
}

/// Returns the JSON document of the progress of a sweep.
#[must_use]
pub fn status_document(status: &SweepStatus) -> Value {
    joined(value!({"motorfit": env!("CARGO_PKG_VERSION")}), value!(status))
}

fn block(block: &SweepBlock) -> Value {
    let factors = block.cells.first().map(|cell| cell.factors);
    value!({
        "criterion": factors.map(|f| f.criterion.name()),
        "scale": factors.map(|f| f.scale.name()),
        "cells": block.cells.iter().map(cell).collect::<Value>(),
        "worst": block.worst.iter().map(|run| worst(block, run)).collect::<Value>(),
    })
}

/// Returns the levels of the factors of a cell or run. Extensions and the model are included if the study names any.
fn levels(f: &Factors, cell: Option<&Cell>) -> Value {
    let first = value!({"method": f.method.name(), "polish": f.polish.name()});
    let named = |key: &str, name: Option<&String>| name.map_or(Value::Null, |name| value!({key: name}));
    let with = named("with", cell.and_then(|cell| cell.with.as_ref()));
    let model = named("model", cell.and_then(|cell| cell.model.as_ref()));
    joined(joined(joined(first, with), model), value!({"population": f.population, "generations": f.generations}))
}

fn cell(cell: &Cell) -> Value {
    let parameters = cell.parameters.iter().map(|(name, values)| (name.clone(), value!(Quantiles::of(values))));
    let others = value!({
        "noise": cell.noise,
        "runs": cell.runs,
        "failed": cell.failed,
        "trust": trust(&cell.trust),
        "cost": Quantiles::of(&cell.costs),
        "parameters": parameters.collect::<Map<String, Value>>(),
        "seconds": cell.seconds,
    });
    joined(levels(&cell.factors, Some(cell)), others)
}

/// Returns the numbers of results by level of trust; null if no result has a level.
fn trust(counts: &TrustCounts) -> Value {
    if counts.levels.is_known() { value!(counts) } else { Value::Null }
}

fn worst(block: &SweepBlock, run: &NamedRun) -> Value {
    let f = &run.job.factors;
    let cell = cell_of(block, f);
    let first = value!({"id": run.job.id, "motor": run.motor});
    let others = value!({"noise": cell.map_or("", |cell| &cell.noise), "seed": f.seed, "cost": run.outcome.cost});
    joined(joined(first, levels(f, cell)), others)
}

/// Returns the quantiles of a parameter over the motors, with the numbers outside if there are limits.
fn spread(spread: &Spread, is_limited: bool) -> Value {
    let mut entry = joined(value!({"unit": spread.parameter.unit}), value!(Quantiles::of(&spread.values)));
    entry["std_error"] = spread.std_error.into();
    if is_limited {
        entry["outside"] = spread.limits.map(|_| spread.outside).into();
        entry["not_sure"] = spread.limits.and(spread.unsure).into();
        entry["not_tested"] = spread.limits.map(|_| spread.untested).into();
        entry["capability"] = spread.limits.map(|ends| capability(&spread.values, ends)).into();
    }
    entry
}

fn capability(values: &[f64], limits: [f64; 2]) -> Value {
    let of = Capability::of(values, limits);
    value!({
        "mean": of.mean, "standard_deviation": of.deviation,
        "cp": of.cp, "cp_ci95": of.cp_ci95, "cpk": of.cpk, "cpk_ci95": of.cpk_ci95,
    })
}

fn outside(excess: &Excess<'_>) -> Value {
    value!({
        "id": excess.run.job.id,
        "motor": excess.run.motor,
        "parameter": excess.estimate.name,
        "value": excess.value,
        "unit": excess.parameter.unit,
        "ci95": excess.estimate.ci95,
        "limit": excess.limit,
        "above": excess.is_above,
    })
}
