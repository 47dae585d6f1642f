//! The JSON document of the results of a sweep.

use super::line::{Excess, Spread, excesses, spreads};
use super::words::cell_of;
use crate::motor::Parameter;
use crate::study::sweep::{Cell, Factors, Limits, Named, NamedRun, Quantiles, SweepBlock, SweepSummary};
use serde_json::{Map, Value, json as value};

/// The JSON document of the results of a sweep.
pub struct SweepDocument;

impl SweepDocument {
    /// Everything that was found.
    #[must_use]
    pub fn of(summary: &SweepSummary, limits: &Limits) -> Value {
        let failure = |run: &crate::study::sweep::FailedRun| value!({"id": run.id, "runs": run.runs, "motor": run.motor, "message": run.message});
        let motors = spreads(summary, limits);
        let motors = motors.iter().map(|s| (name_of(&s.named), spread(s, !limits.is_empty())));
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
            "limits": Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS).filter_map(bounds).collect::<Map<String, Value>>(),
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

fn name_of((parameter, scope): &Named) -> String {
    scope.name(*parameter)
}

/// Levels of the factors that cells and runs have. Extensions are named where the study names them.
fn levels(f: &Factors, with: Option<&String>) -> Map<String, Value> {
    let mut levels = Map::new();
    levels.insert("method".to_owned(), f.method.name().into());
    levels.insert("polish".to_owned(), f.polish.name().into());
    levels.extend(with.map(|name| ("with".to_owned(), name.as_str().into())));
    levels.insert("population".to_owned(), f.population.into());
    levels.insert("generations".to_owned(), f.generations.into());
    levels
}

/// A map with others behind it.
fn joined(mut first: Map<String, Value>, others: Value) -> Value {
    if let Value::Object(others) = others {
        first.extend(others);
    }
    first.into()
}

fn cell(cell: &Cell) -> Value {
    let parameters = cell.parameters.iter().map(|(named, values)| (name_of(named), quantiles(values).into()));
    let others = value!({
        "noise": cell.noise,
        "runs": cell.runs,
        "failed": cell.failed,
        "cost": quantiles(&cell.costs),
        "parameters": parameters.collect::<Map<String, Value>>(),
        "seconds": cell.seconds,
    });
    joined(levels(&cell.factors, cell.with.as_ref()), others)
}

fn worst(block: &SweepBlock, run: &NamedRun) -> Value {
    let f = &run.job.factors;
    let cell = cell_of(block, f);
    let mut first =
        Map::from_iter([("id".to_owned(), run.job.id.into()), ("motor".to_owned(), run.motor.as_str().into())]);
    first.extend(levels(f, cell.and_then(|cell| cell.with.as_ref())));
    let noise = cell.map_or("", |cell| &cell.noise);
    joined(first, value!({"noise": noise, "seed": f.seed, "cost": run.outcome.cost}))
}

/// A parameter over the motors; without limits nothing is said of them.
fn spread(spread: &Spread, is_limited: bool) -> Value {
    let mut entry = Map::from_iter([("unit".to_owned(), spread.named.0.unit().into())]);
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
        "parameter": excess.estimate.name(),
        "value": excess.value,
        "unit": excess.estimate.parameter.unit(),
        "ci95": excess.estimate.ci95,
        "limit": excess.limit,
        "above": excess.is_above,
    })
}
