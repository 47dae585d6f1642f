//! Results as JSON documents. Values that are not available or not finite are `null`.

use super::requested::Requested;
use super::shown::Shown;
use super::spelling::command_line;
use motorfit_core::Error;
use motorfit_core::setting::{Command, Reference, Spelling, Text};
use motorfit_core::text::{printable_json, shell_quoted};
use motorfit_evaluate::{CandidateValue, Level, SearchProblem, cpu_name};
use motorfit_identify::{BatchCosts, Identification, Keys};
use motorfit_motor::Parameter;
use motorfit_record::warning::Warning;
use motorfit_record::{Record, Severity};
use serde_json::{Value, json as value};

/// Formats a JSON document with a newline at its end. Control characters that JSON allows unescaped are escaped too.
#[must_use]
pub fn json(document: &Value) -> String {
    printable_json(&format!("{document:#}\n"))
}

/// Returns an error as a JSON object: its kind, its message and hint in the spelling of a front end, and its place where one is known.
#[must_use]
pub fn error_document(error: &Error, spelling: Spelling) -> Value {
    value!({
        "kind": error.kind().name(),
        "message": error.message().spelled(spelling),
        "hint": error.hint().spelled(spelling),
        "path": error.path().map(|path| path.display().to_string()),
        "part": error.part(),
        "line": error.line(),
        "column": error.column(),
    })
}

/// Returns the warnings of one severity, which separates the warnings of a result from its remarks.
pub(super) fn warnings(list: &[Warning], severity: Severity) -> Value {
    let one = |w: &Warning| {
        let remedy = w.remedy.as_ref().map(|remedy| remedy.spelled(command_line));
        value!({"code": w.code, "message": w.message.spelled(command_line), "place": w.place, "remedy": remedy})
    };
    list.iter().filter(|w| w.severity == severity).map(one).collect()
}

/// Returns the JSON document of an identification: its settings and its results.
#[must_use]
pub fn identify_document<M: Shown>(records: &[Record], spec: &M::Spec, found: &Identification<M>) -> Value {
    let mut record = value!(found);
    // A result refers to recordings by index, a document by file.
    let named = |entry: &mut Value| {
        let of = entry["record"].as_u64().and_then(|n| records.get(usize::try_from(n).ok()?));
        entry["record"] =
            value!(of.and_then(|record| record.source().path.as_ref()).map(|path| path.to_string_lossy()));
    };
    let parameters = record["parameters"].as_object_mut().into_iter().flatten();
    parameters.filter_map(|(_, entry)| entry.get_mut("recordings")?.as_array_mut()).flatten().for_each(named);
    record["left_out"].as_array_mut().into_iter().flatten().for_each(named);
    // Messages refer to settings; a document spells them as flags.
    record["warnings"] = warnings(&found.warnings, Severity::Report);
    record["remarks"] = warnings(&found.warnings, Severity::Mention);
    for (entry, reason) in record["trust"]["reasons"].as_array_mut().into_iter().flatten().zip(&found.trust.reasons) {
        entry["message"] = reason.message.spelled(command_line).into();
    }
    record["trust"]["next"] = value!(found.trust.next.as_ref().map(|step| next_command(records, step)));
    let Requested { method, polish, seed, population, generations, criterion } = M::requested(spec);
    let mut keys: Keys = vec![("motorfit", env!("CARGO_PKG_VERSION").into()), ("trust", Value::Null)];
    keys.extend(M::named(found));
    keys.extend([
        ("records", value!(records)),
        ("method", method.into()),
        ("polish", polish.into()),
        ("seed", seed.into()),
        ("population", population.into()),
        ("generations", generations.into()),
        ("criterion", criterion.norm.name().into()),
        ("scale", criterion.scale.name().into()),
    ]);
    keys.extend(M::settings(spec));
    joined(keys.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(), record)
}

/// Returns the command of the next step; only its text if it is none, or a recording is not a file.
fn next_command(records: &[Record], step: &Text) -> String {
    let step = step.spelled(command_line);
    if !step.starts_with("--") && !step.starts_with("motorfit ") {
        return step;
    }
    let path = |record: &Record| Some(shell_quoted(&record.source().path.as_ref()?.to_string_lossy()));
    let Some(mut paths) = records.iter().map(path).collect::<Option<Vec<String>>>() else { return step };
    // Several recordings of one file have the same path.
    paths.dedup();
    let identify = command_line(&Reference::Command(Command::Identify));
    let (operation, flags) = if step.starts_with("--") { (identify, step) } else { (step, String::new()) };
    [operation, paths.join(" "), flags].join(" ").trim_end().to_owned()
}

/// Returns the values of the five parameters as an object with their symbols as keys.
pub(super) fn by_symbol(values: [impl Into<Value>; 5]) -> Value {
    Parameter::ALL.iter().zip(values).map(|(p, value)| (p.symbol().to_owned(), value.into())).collect()
}

/// Appends the entries of an object to another.
pub(super) fn joined(mut first: Value, others: Value) -> Value {
    if let (Value::Object(first), Value::Object(others)) = (&mut first, others) {
        first.extend(others);
    }
    first
}

/// Facts about an evaluation of candidates for its JSON document.
pub struct EvaluateDocument {
    /// Number of candidates evaluated.
    pub candidates: u64,
    /// True if the user ended the evaluation early.
    pub interrupted: bool,
    /// Duration of the evaluation \[s\].
    pub seconds: f64,
}

impl EvaluateDocument {
    /// Returns the reason for which the evaluation ended.
    fn stop(&self) -> &'static str {
        if self.interrupted { "interrupted" } else { "budget_spent" }
    }

    /// Returns the JSON document with the best candidates, each a cost and the values of the free parameters.
    #[must_use]
    pub fn of<'a>(
        &self,
        records: &[Record],
        costs: &BatchCosts,
        best: impl Iterator<Item = (f64, &'a [f64])>,
    ) -> Value {
        let problem = costs.problem();
        let entry = |(cost, values): (f64, &[f64])| value!({"cost": cost, "parameters": by_name(problem, values)});
        // The parameters of single recordings have the same bounds.
        let bounds = |(name, (min, max)): (String, (f64, f64))| {
            (name.split('[').next().unwrap_or(&name).to_owned(), value!([min, max]))
        };
        let model = problem.user_model().map(|of| value!({"model": {"name": of.name(), "sha256": of.digest()}}));
        let others = value!({
            "records": records,
            "criterion": problem.criterion().norm.name(),
            "scale": problem.criterion().scale.name(),
            "bounds": problem.names().into_iter().zip(problem.bounds()).map(bounds).collect::<Value>(),
            "device": costs.device(),
            "candidates": self.candidates,
            "stop": self.stop(),
            "seconds": self.seconds,
            "best": best.map(entry).collect::<Value>(),
            "warnings": warnings(costs.warnings(), Severity::Report),
        });
        let first = value!({"motorfit": env!("CARGO_PKG_VERSION")});
        joined(joined(first, model.unwrap_or_default()), others)
    }
}

/// Returns the parameters of a candidate by name, as lists if each recording has its own value.
fn by_name(problem: &dyn SearchProblem, candidate: &[f64]) -> Value {
    let entry = |(name, value)| match value {
        CandidateValue::Shared(value) => (name, Value::from(value)),
        CandidateValue::OfRecordings(values) => (name, Value::from(values)),
    };
    problem.values_of(candidate).into_iter().map(entry).collect()
}

/// Returns the JSON document of the devices of this machine; `threads` is the number of CPU threads.
#[must_use]
pub fn devices_document(threads: usize) -> Value {
    let levels: Vec<&str> = Level::available().map(Level::name).collect();
    let cpu = value!({
        "kind": "cpu", "name": cpu_name(), "threads": threads, "levels": levels, "used": Level::best().name(),
        "precisions": ["f64"],
    });
    let devices = vec![cpu];
    #[cfg(feature = "gpu")]
    let devices = {
        let gpu = |a: motorfit_gpu::AdapterFacts| {
            value!({
                "kind": "gpu", "index": a.index, "name": a.name, "type": a.kind, "backend": a.backend,
                "driver": a.driver, "precisions": if a.f64 { vec!["f32", "f64"] } else { vec!["f32"] },
                "binding_bytes_max": a.binding_bytes_max, "workgroups_max": a.workgroups_max,
            })
        };
        devices.into_iter().chain(motorfit_gpu::list().into_iter().map(gpu)).collect::<Value>()
    };
    value!({"motorfit": env!("CARGO_PKG_VERSION"), "devices": devices})
}
