//! The command `evaluate --profile`: profile likelihoods of the free parameters of any machine.

use super::args::EvaluateArgs;
use super::model::inputs::ModelInputs;
use super::output::WITHOUT_REASONS;
use super::prelude::*;
use super::{next, output};
use motorfit::identify::model::model_likelihood_profiles;
use motorfit::identify::{Identification, LikelihoodProfile, likelihood_profiles};
use motorfit::optimize::Stop;
use motorfit::record::Record;
use motorfit::report::{Shown, likelihood_chart, likelihood_document};

pub(super) fn run(args: &EvaluateArgs, style: &Style) -> Result<Outcome> {
    if let Some(path) = args.model.model.as_deref() {
        let ModelInputs { model, spec, records, recordings, threads } = ModelInputs::new(args, path)?;
        let mut look = |_| signals::interrupted();
        let of = with_threads(threads, || model_likelihood_profiles(&model, &recordings, &spec, &mut look))?;
        return shown(args, &records, of, style);
    }
    let spec = inputs::spec(&args.problem, &args.device, style)?;
    let records = inputs::records(&args.recordings.records, &args.recordings.reading.0.and(&args.problem.0))?;
    let of = with_threads(spec.threads, || likelihood_profiles(&records, &spec))?;
    shown(args, &records, of, style)
}

/// Prints profiles, and writes their figure.
fn shown<M: Shown>(
    args: &EvaluateArgs,
    records: &[Record],
    (found, profiles): (Identification<M>, Vec<LikelihoodProfile>),
    style: &Style,
) -> Result<Outcome> {
    style.warnings(&found.warnings);
    if found.stop == Stop::Interrupted {
        style.note("interrupted before the profiles");
        return Ok(Outcome::Interrupted);
    }
    if let Some(path) = &args.svg {
        out::write_file(path, &likelihood_chart(&profiles).figure().file("", false))?;
        if stdio::is_stdio(path) {
            return Ok(Outcome::Done);
        }
        style.note(&format!("wrote {}", path.display()));
    }
    let next = found.trust.next.as_ref().map(|step| next::command(step, &args.recordings.records));
    if args.json {
        let mut document = likelihood_document(records, &found, &profiles);
        document["trust"]["next"] = next.into();
        data(&json(&document))?;
    } else {
        show(&(output::trust_line(&found.trust, WITHOUT_REASONS, next.as_deref()) + &table(&profiles)))?;
    }
    Ok(Outcome::Done)
}

/// Longest description that is shown \[characters\].
const DESCRIPTION_MAX: usize = 20;

fn table(profiles: &[LikelihoodProfile]) -> String {
    let mut text = format!(
        "  {DIM}{:<24}{:>12} {:<12} {:<25} 95 % by likelihood{DIM:#}\n",
        "", "estimate", "", "95 % by standard error"
    );
    let longest = |of: &dyn Fn(&LikelihoodProfile) -> &str| profiles.iter().map(|one| of(one).chars().count()).max();
    let width = longest(&|of| &of.name).unwrap_or(0);
    // Long descriptions would push the values out of sight.
    let is_described = longest(&|of| &of.description).unwrap_or(0) <= DESCRIPTION_MAX;
    for of in profiles {
        let digits = of.ci95.map_or(6, |[low, high]| digits(of.value, high - low));
        let number = |value: f64| significant(value, digits);
        let normal =
            of.ci95.map_or_else(|| "\u{2013}".to_owned(), |[low, high]| range([Some(low), Some(high)], number));
        let _ = writeln!(
            text,
            "  {STRONG}{:<width$}{STRONG:#}  {:<pad$}{:>12} {:<12} {normal:<25} {}",
            of.name,
            if is_described { &of.description } else { "" },
            number(of.value),
            if of.unit == "1" { "" } else { &of.unit },
            range(of.likelihood95, number),
            pad = 22_usize.saturating_sub(width),
        );
    }
    text
}

/// Returns the number of digits with which the ends of an interval differ in three.
fn digits(value: f64, width: f64) -> usize {
    let ratio = (value.abs() / width).log10();
    if ratio.is_finite() { motorfit::numeric::whole((3.0 + ratio.ceil()).clamp(3.0, 9.0)) } else { 6 }
}

/// Returns an interval, open where an end is not known.
fn range(ends: [Option<f64>; 2], number: impl Fn(f64) -> String) -> String {
    let [low, high] = ends.map(|end| end.map(&number));
    match (low, high) {
        (Some(low), Some(high)) => format!("{low} … {high}"),
        (Some(low), None) => format!("above {low}"),
        (None, Some(high)) => format!("below {high}"),
        (None, None) => "\u{2013}".to_owned(),
    }
}
