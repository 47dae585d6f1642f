//! Results as JSON documents. What is not available or not finite is `null`.

use super::identified;
use super::spelling::command_line;
use crate::estimate::{ReferenceKind, Uncertainty};
use crate::evaluate::{Level, Problem, cpu_name};
use crate::identify::{
    Costs, Estimated, HeldOut, Identification, IdentifySpec, Ladder, Place, Rung, Validation, Warning,
};
use crate::motor::{Input, Parameter, Parameters, Scope};
use crate::record::{Record, Severity};
use crate::text::printable_json;
use serde_json::{Map, Value, json as value};

/// A JSON document as text, one line end at its end; control characters that JSON allows raw are escaped too.
#[must_use]
pub fn json(document: &Value) -> String {
    printable_json(&format!("{document:#}\n"))
}

/// Warnings of a severity: those of a result and, apart from them, remarks.
pub(super) fn warnings(list: &[Warning], severity: Severity) -> Value {
    let one = |w: &Warning| {
        let place = w.place.as_ref().map(place_of);
        let remedy = w.remedy.as_ref().map(|remedy| remedy.spelled(command_line));
        value!({"code": w.code, "message": w.message.spelled(command_line), "place": place, "remedy": remedy})
    };
    list.iter().filter(|w| w.severity == severity).map(one).collect()
}

fn place_of(place: &Place) -> Value {
    let figures: Map<String, Value> = place.figures.iter().map(|(name, v)| ((*name).to_owned(), (*v).into())).collect();
    value!({
        "record": place.recording, "quantity": place.quantity.map(|q| q.to_string()), "times_s": place.times_s,
        "lines": place.lines, "figures": figures, "text": place.to_string(),
    })
}

pub(super) fn record_head(record: &Record) -> Value {
    let source = record.source();
    value!({
        "path": source.path.as_ref().map(|path| path.to_string_lossy()),
        "part": source.part,
        "sha256": source.sha256,
        "samples": record.len(),
        "period_s": record.period_s(),
        "columns": columns(record),
        "notes": source.notes,
    })
}

/// A state at the start; a current that is the input is none.
fn initial_state(input: Input, [current, speed]: [f64; 2]) -> Value {
    value!({"current": (input == Input::Voltage).then_some(current), "speed": speed})
}

/// The columns as they were understood.
fn columns(record: &Record) -> Value {
    let columns = record.source().columns.iter().map(|c| {
        value!({"quantity": c.quantity.to_string(), "heading": c.heading, "conversion": c.conversion,
            "unit": c.unit, "unit_named": c.unit_named})
    });
    columns.collect()
}

/// The JSON document of an identification.
pub struct IdentifyDocument;

impl IdentifyDocument {
    /// What was found, with what was asked for.
    #[must_use]
    pub fn of(records: &[Record], spec: &IdentifySpec, found: &Identification) -> Value {
        let names = Names::of(spec);
        let axes = found.space.free().iter();
        let bounds: Map<String, Value> =
            axes.map(|a| (a.parameter.symbol().to_owned(), value!([a.min, a.max]))).collect();
        let check = &found.verification;
        let searched = &found.searched;
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"),
            "records": records.iter().map(record_head).collect::<Value>(),
            "method": spec.method.name(),
            "polish": spec.polish.name(),
            "seed": spec.seed,
            "population": spec.population,
            "generations": spec.generations,
            "criterion": names.criterion,
            "scale": names.scale,
            "input": identified::name_of(found.input),
            "discretization": names.discretization,
            "initial": names.initial,
            "bounds": bounds,
            "device": {"kind": found.device_kind, "name": found.device, "precision": found.precision},
            "parameters": parameters(records, found),
            "with": found.extensions().iter().map(|e| e.name()).collect::<Value>(),
            "ladder": found.ladder.as_ref().map(ladder),
            "cost": found.cost,
            "searched": {"method": searched.method, "parameters": plain(&searched.parameters), "cost": searched.cost},
            "fit_percent": {"current": found.fit_percent[0], "speed": found.fit_percent[1]},
            "residual_sigma": {"current": found.residual_sigma[0], "speed": found.residual_sigma[1]},
            "initial_state": found.initial.iter().map(|state| initial_state(found.input, *state)).collect::<Value>(),
            "correlation": found.uncertainty.as_ref().map(|u| correlation(found, u)),
            "rank": found.uncertainty.as_ref().map(|u| u.rank),
            "condition": found.uncertainty.as_ref().map(|u| u.condition),
            "residuals": found.uncertainty.as_ref().map(|u| identified::residuals(found, u)),
            "characteristics": identified::characteristics(found),
            "repeatability": found.repeatability.as_ref().map(identified::repeatability),
            "verification": {
                "status": check.status.name(),
                "reference": check.reference.map(ReferenceKind::name),
                "steiglitz_mcbride": check.steiglitz_mcbride.as_ref().map(plain),
                "levenberg_marquardt": check.levenberg_marquardt.as_ref().map(plain),
                "cost_gap": check.cost_gap,
                "cpu_gpu_cost_difference": found.cost_difference,
            },
            "validation": found.validation.as_ref().map(validation),
            "warnings": warnings(&found.warnings, Severity::Report),
            "remarks": warnings(&found.warnings, Severity::Mention),
            "stop": found.stop.name(),
            "evaluations": found.evaluations,
            "history": found.history,
            "seconds": found.seconds,
        })
    }
}

/// Held-out recordings.
fn validation(validation: &Validation) -> Value {
    let pair = |[current, speed]: [Option<f64>; 2]| value!({"current": current, "speed": speed});
    let one = |held: &HeldOut| {
        let [current, speed] = held.initial;
        value!({
            "record": record_head(&held.record),
            "fit_percent": pair(held.fit_percent),
            "residual_sigma": pair(held.residual_sigma),
            "residuals": identified::tests(&held.residual_tests),
            "initial_state": {"current": current, "speed": speed},
            "initial_state_estimated": held.initial_is_estimated,
            "estimated": held.own.iter().map(|(p, v)| (p.symbol().to_owned(), Value::from(*v))).collect::<Map<_, _>>(),
        })
    };
    value!({
        "fit_percent": pair(validation.fit_percent),
        "residual_sigma": pair(validation.residual_sigma),
        "records": validation.held_out.iter().map(one).collect::<Value>(),
    })
}

/// The JSON document of an evaluation.
pub struct EvaluateDocument {
    /// How many were evaluated.
    pub candidates: u64,
    /// Whether the user ended it early.
    pub interrupted: bool,
    /// In how many seconds, all in all.
    pub seconds: f64,
}

impl EvaluateDocument {
    /// The best candidates (cost, values of the free parameters), with what they were evaluated on.
    #[must_use]
    pub fn of<'a>(&self, records: &[Record], costs: &Costs, best: impl Iterator<Item = (f64, &'a [f64])>) -> Value {
        let problem = costs.problem();
        let (kind, name, precision) = costs.device();
        let bounds = problem.space().free().iter().map(|a| (a.parameter.symbol().to_owned(), value!([a.min, a.max])));
        let entry = |(cost, values): (f64, &[f64])| value!({"cost": cost, "parameters": meant(problem, values)});
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"),
            "records": records.iter().map(record_head).collect::<Value>(),
            "criterion": problem.criterion().norm.name(),
            "scale": problem.criterion().scale.name(),
            "bounds": bounds.collect::<Map<String, Value>>(),
            "device": {"kind": kind, "name": name, "precision": precision},
            "candidates": self.candidates,
            "stop": if self.interrupted { "interrupted" } else { "budget_spent" },
            "seconds": self.seconds,
            "best": best.map(entry).collect::<Value>(),
            "warnings": warnings(costs.warnings(), Severity::Report),
        })
    }
}

/// What a candidate means: values by symbol, lists of them where each recording has its own.
fn meant(problem: &Problem, candidate: &[f64]) -> Value {
    let space = problem.space();
    let extensions = space.free().iter().map(|axis| axis.parameter).chain(space.fixed().iter().map(|(p, _, _)| *p));
    let value = |p: Parameter, recording: usize| {
        let own = problem.extensions(candidate, recording);
        if p.is_extension() { own.get(p) } else { problem.parameters(candidate, recording).get(p) }
    };
    let all = Parameter::ALL.into_iter().chain(extensions.filter(|p| p.is_extension()));
    let entry = |p: Parameter| {
        let is_own = space.free().iter().any(|axis| axis.parameter == p && matches!(axis.scope, Scope::Recording(_)));
        let of = |n| Value::from(value(p, n));
        let value = if is_own { (0..problem.signals().len()).map(of).collect() } else { of(0) };
        (p.symbol().to_owned(), value)
    };
    Value::Object(all.map(entry).collect())
}

/// Values by symbol.
pub(super) fn plain(parameters: &Parameters) -> Value {
    let values = Parameter::ALL.iter().map(|p| (p.symbol().to_owned(), parameters.get(*p).into()));
    Value::Object(values.collect())
}

/// Where a parameter stands among the free ones.
fn place(found: &Identification, parameter: Parameter) -> Option<usize> {
    found.space.free().iter().position(|axis| axis.parameter == parameter)
}

/// Correlations of all five, `null` for those held or unknown.
fn correlation(found: &Identification, uncertainty: &Uncertainty) -> Value {
    let entry = |a: Parameter, b: Parameter| uncertainty.correlation[place(found, a)?][place(found, b)?];
    let row = |a: &Parameter| Parameter::ALL.iter().map(|b| Value::from(entry(*a, *b))).collect::<Value>();
    Parameter::ALL.iter().map(row).collect()
}

/// All parameters by their symbols. One that each of several recordings has for itself has a list of them.
fn parameters(records: &[Record], found: &Identification) -> Map<String, Value> {
    let mut all = Map::new();
    let estimates = found.estimates();
    for group in estimates.chunk_by(|a, b| a.parameter == b.parameter) {
        let Some(first) = group.first() else { continue };
        let own = matches!(first.scope, Scope::Recording(_));
        let entry = if let [only] = group {
            let scope = if own || (only.parameter == Parameter::Latency) { "recording" } else { "shared" };
            estimate(only, scope)
        } else {
            let of = |e: &Estimated| {
                let mut entry = estimate(e, "recording");
                if let Scope::Recording(n) = e.scope {
                    let path = records.get(n as usize).and_then(|r| r.source().path.as_ref());
                    entry["record"] = path.map(|path| path.to_string_lossy()).into();
                }
                entry
            };
            value!({
                "value": null, "unit": first.parameter.unit(), "std_error": null, "ci95": null, "at_bound": null,
                "fixed": first.fixed, "identified": first.value.is_some(), "scope": "recording",
                "recordings": group.iter().map(of).collect::<Value>(),
            })
        };
        all.insert(first.parameter.symbol().to_owned(), entry);
    }
    all
}

fn estimate(e: &Estimated, scope: &str) -> Value {
    value!({
        "value": e.value,
        "unit": e.parameter.unit(),
        "std_error": e.std_error,
        "ci95": e.ci95,
        "at_bound": e.at_bound,
        "fixed": e.fixed,
        "identified": e.value.is_some(),
        "scope": scope,
    })
}

/// The models that were tried.
fn ladder(ladder: &Ladder) -> Value {
    let rung = |rung: &Rung| {
        value!({
            "with": rung.with.iter().map(|e| e.name()).collect::<Value>(),
            "free": rung.free,
            "fit_percent": {"current": rung.fit_percent[0], "speed": rung.fit_percent[1]},
            "criterion_gain": rung.gain,
            "taken": rung.taken,
        })
    };
    ladder.rungs.iter().map(rung).collect()
}

/// Settings by their names.
pub struct Names {
    /// The criterion.
    pub criterion: &'static str,
    /// The scaling of the errors.
    pub scale: &'static str,
    /// The one-step method.
    pub discretization: &'static str,
    /// The state at the first sample.
    pub initial: &'static str,
}

impl Names {
    /// The names of a spec's settings.
    #[must_use]
    pub fn of(spec: &IdentifySpec) -> Self {
        Self {
            criterion: spec.criterion.norm.name(),
            scale: spec.criterion.scale.name(),
            discretization: spec.model.discretization.name(),
            initial: spec.model.initial.name(),
        }
    }
}

/// The JSON document of the devices of this machine.
pub struct Devices;

impl Devices {
    /// What this machine can evaluate on.
    #[must_use]
    pub fn of(threads: usize) -> Value {
        let levels: Vec<&str> = Level::available().map(Level::name).collect();
        let cpu = value!({
            "kind": "cpu", "name": cpu_name(), "threads": threads, "levels": levels, "used": Level::best().name(),
            "precisions": ["f64"],
        });
        let devices: Vec<Value> = std::iter::once(cpu).chain(gpus()).collect();
        value!({"motorfit": env!("CARGO_PKG_VERSION"), "devices": devices})
    }
}

#[cfg(feature = "gpu")]
fn gpus() -> Vec<Value> {
    let gpu = |a: crate::evaluate::gpu::AdapterFacts| {
        value!({
            "kind": "gpu", "index": a.index, "name": a.name, "type": a.kind, "backend": a.backend,
            "driver": a.driver, "precisions": if a.f64 { vec!["f32", "f64"] } else { vec!["f32"] },
            "binding_bytes_max": a.binding_bytes_max, "workgroups_max": a.workgroups_max,
        })
    };
    crate::evaluate::gpu::list().into_iter().map(gpu).collect()
}

#[cfg(not(feature = "gpu"))]
fn gpus() -> Vec<Value> {
    Vec::new()
}
