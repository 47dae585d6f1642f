//! The JSON document of the results of a sweep.

use super::line::{Excess, Spread, excesses, spreads};
use super::words::noise;
use crate::motor::Parameter;
use crate::study::sweep::{Cell, Limits, NamedRun, Quantiles, SweepBlock, SweepSummary};
use serde_json::{Map, Value, json as value};

/// The JSON document of the results of a sweep.
pub struct SweepDocument;

impl SweepDocument {
    /// Everything that was found.
    #[must_use]
    pub fn of(summary: &SweepSummary, limits: &Limits) -> Value {
        let failure = |run: &crate::study::sweep::FailedRun| value!({"id": run.id, "runs": run.runs, "motor": run.motor, "message": run.message});
        let motors = spreads(summary, limits);
        let motors = motors.iter().map(|s| (s.parameter.symbol().to_owned(), spread(s, !limits.is_empty())));
        let bounds = |p: Parameter| Some((p.symbol().to_owned(), value!(limits.of(p)?)));
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"),
            "name": summary.name,
            "runs": summary.runs,
            "missing": summary.missing,
            "failed": summary.failed,
            "failures": summary.failures.named.iter().map(failure).collect::<Value>(),
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
            "limits": Parameter::ALL.into_iter().filter_map(bounds).collect::<Map<String, Value>>(),
            "outside": excesses(summary, limits).iter().map(outside).collect::<Value>(),
        })
    }
}

fn quantiles(values: &[f64]) -> Map<String, Value> {
    let q = Quantiles::of(values);
    let named = [
        ("min", q.min),
        ("q05", q.q05),
        ("q25", q.q25),
        ("median", q.median),
        ("q75", q.q75),
        ("q95", q.q95),
        ("max", q.max),
    ];
    named.into_iter().map(|(name, value)| (name.to_owned(), Value::from(value))).collect()
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

fn cell(cell: &Cell) -> Value {
    let f = &cell.factors;
    let parameters = Parameter::ALL.map(|p| (p.symbol().to_owned(), quantiles(&cell.parameters[p as usize]).into()));
    value!({
        "method": f.method.name(),
        "polish": f.polish.name(),
        "population": f.population,
        "generations": f.generations,
        "noise": cell.noise,
        "runs": cell.runs,
        "failed": cell.failed,
        "cost": quantiles(&cell.costs),
        "parameters": parameters.into_iter().collect::<Map<String, Value>>(),
        "seconds": cell.seconds,
    })
}

fn worst(block: &SweepBlock, run: &NamedRun) -> Value {
    let f = &run.job.factors;
    value!({
        "id": run.job.id,
        "motor": run.motor,
        "method": f.method.name(),
        "polish": f.polish.name(),
        "population": f.population,
        "generations": f.generations,
        "noise": noise(block, f.noise),
        "seed": f.seed,
        "cost": run.outcome.cost,
    })
}

/// A parameter over the motors; without limits nothing is said of them.
fn spread(spread: &Spread, is_limited: bool) -> Value {
    let mut entry = Map::from_iter([("unit".to_owned(), spread.parameter.unit().into())]);
    entry.extend(quantiles(&spread.values));
    entry.insert("std_error".to_owned(), spread.std_error.into());
    if is_limited {
        entry.insert("outside".to_owned(), spread.limits.map(|_| spread.outside).into());
        entry.insert("not_sure".to_owned(), spread.limits.and(spread.unsure).into());
    }
    entry.into()
}

fn outside(excess: &Excess<'_>) -> Value {
    value!({
        "id": excess.run.job.id,
        "motor": excess.run.motor,
        "parameter": excess.parameter.symbol(),
        "value": excess.run.value(excess.parameter),
        "unit": excess.parameter.unit(),
        "ci95": excess.run.interval(excess.parameter),
        "limit": excess.limit,
        "above": excess.is_above,
    })
}
