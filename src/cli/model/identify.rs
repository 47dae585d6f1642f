//! `identify` with a user's model.

use crate::cli::args::IdentifyArgs;
use crate::cli::prelude::*;
use crate::cli::{export, output, plot, terminal};
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::TrustLevel;
use motorfit::identify::model::{ModelIdentification, ModelProgress, ModelSpec, hold_out_model, identify_model};
use motorfit::model::Model;
use motorfit::optimize::{Progress, Stop};
use motorfit::record::Record;
use motorfit::report::{
    columns_csv, command_line, exported_model, model_document, model_figure, model_page, model_selection_table,
    model_selection_text,
};
use motorfit::settings::Value;

/// Text in place of reasons for a level of trust.
const WITHOUT_REASONS: &str = "no test of the residuals or the search contradicts the standard errors";
/// Width of printed plots \[characters\].
const WIDTH: usize = 100;

pub(in crate::cli) fn run(args: &IdentifyArgs, path: &Path, style: &Style) -> Result<Outcome> {
    let model = Model::open(path)?;
    let mut given = args.search.0.and(&args.problem.0).and(&args.device.0);
    given.put(Setting::Start, Value::List(args.start.clone()));
    let spec = settings::model_spec(&given)?;
    let reading = settings::model_reading(&args.recordings.reading.0.and(&args.problem.0), &model)?;
    let records = inputs::records_with(&args.recordings.records, &reading)?;
    let mut held_out = inputs::records_with(&args.validate, &reading)?;
    let records = inputs::fitted_part(records, args.split, &mut held_out)?;
    export::check(args)?;
    out::check_drawings(args.svg.as_deref(), args.json || records.len() > 1)?;
    let of = |records: &[Record]| records.iter().map(|r| ModelRecording::new(&model, r)).collect::<Result<Vec<_>>>();
    let (recordings, others) = (of(&records)?, of(&held_out)?);
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let mut observe = progress::reporter(style, "round");
    let mut look = |progress: ModelProgress| {
        let (generation, generations) = (progress.done, progress.of);
        observe(&Progress { generation, generations, evaluations: 0, cost: f64::NAN });
        signals::searching(generation < generations);
        signals::interrupted()
    };
    let found = with_threads(given.count(Setting::Threads), || identify_model(&model, &recordings, &spec, &mut look));
    drop(observe);
    let mut found = found?;
    // With the generic terms of the result.
    let model = found.model.clone();
    hold_out_model(&model, &mut found, &recordings, &others, &spec)?;
    style.warnings(&found.warnings);
    if found.stop == Stop::Interrupted {
        style.note("interrupted: the result is the best so far");
    }
    let document = json(&model_document(&records, &model, &spec, &found));
    if args.json {
        data(&document)?;
    } else if !args.svg.as_deref().is_some_and(stdio::is_stdio) && !export::is_printed(args) {
        let next = found.trust.next.as_ref().map(|next| next.spelled(command_line));
        show(
            &(output::trust_line(&found.trust, WITHOUT_REASONS, next.as_deref())
                + &table(&records, &model, &spec, &found, style)),
        )?;
        if args.plot {
            data(&plots(&model, &recordings, &found))?;
        }
    }
    let exported = export::file(args, || Ok(exported_model(&records, (&model, &recordings), &found)))?;
    export::print(args, exported.as_ref(), &found.trust, style)?;
    if let Some(path) = &args.svg {
        let drawing = |(recording, fit)| model_figure(&model, recording, fit).file("", false);
        out::drawings(path, &recordings.iter().zip(&found.fits).map(drawing).collect::<Vec<_>>(), style)?;
    }
    if let Some(out) = out {
        let mut files = report(&records, (&model, &recordings), (&spec, &found), document, !args.page.no_script);
        files.extend(exported);
        out.write(&files, style)?;
    }
    Ok(match found.trust.level {
        _ if found.stop == Stop::Interrupted => Outcome::Interrupted,
        TrustLevel::Check | TrustLevel::Poor if args.strict => Outcome::Untrusted,
        _ => Outcome::Done,
    })
}

fn report(
    records: &[Record],
    (model, recordings): (&Model, &[ModelRecording]),
    (spec, found): (&ModelSpec, &ModelIdentification),
    document: String,
    has_script: bool,
) -> Vec<(String, String)> {
    let how = out::reproduced(vec![
        ("model", format!("{}, sha256 {}", model.name(), model.digest())),
        ("method", found.searched.method.to_owned()),
        ("seed", spec.seed.to_string()),
        ("integration", found.method.described()),
        ("device", found.device.to_string()),
        ("evaluations", found.evaluations.to_string()),
        ("time", engineering(found.seconds, "s", 3)),
    ]);
    vec![
        ("report.html".to_owned(), model_page(records, (model, recordings), found, &how).html(has_script)),
        ("curves.csv".to_owned(), curves(model, recordings, found)),
        ("result.json".to_owned(), document),
    ]
}

/// Returns CSV with the measured and modelled signals of all recordings, one after the other.
fn curves(model: &Model, recordings: &[ModelRecording], found: &ModelIdentification) -> String {
    let mut heads = vec!["recording".to_owned(), "time_s".to_owned()];
    heads.extend(model.inputs().iter().map(|input| format!("{} [{}]", input.name, input.unit.text)));
    for output in model.outputs() {
        heads.push(format!("{} [{}]", output.name, output.unit.text));
        heads.push(format!("{} model [{}]", output.name, output.unit.text));
    }
    let mut columns = vec![Vec::new(); heads.len()];
    for ((n, recording), fit) in (1_u32..).zip(recordings).zip(&found.fits) {
        columns[0].extend(vec![f64::from(n); recording.len()]);
        columns[1].extend(&recording.time_s);
        for (column, input) in columns[2..].iter_mut().zip(&recording.inputs) {
            column.extend(input);
        }
        let first = 2 + recording.inputs.len();
        for (output, (measured, simulated)) in recording.measured.iter().zip(&fit.simulated).enumerate() {
            let measured = measured.clone().unwrap_or_else(|| vec![f64::NAN; recording.len()]);
            columns[first + 2 * output].extend(measured);
            columns[first + 2 * output + 1].extend(simulated);
        }
    }
    columns_csv(&heads, &columns)
}

fn table(records: &[Record], model: &Model, spec: &ModelSpec, found: &ModelIdentification, style: &Style) -> String {
    let mut text = String::new();
    if !style.quiet {
        let _ = writeln!(text, "{}\n", inputs::all_understood(records));
    }
    let names = found.estimates.iter().map(|e| e.label().len()).chain(found.identified.iter().map(|c| c.name.len()));
    let width = names.max().unwrap_or(1).max(4);
    let units = found.estimates.iter().map(|e| e.unit.len()).chain(found.identified.iter().map(|c| c.unit.len()));
    let units = units.max().unwrap_or(1).max(4);
    if found.uncertainty.is_some() {
        let _ = writeln!(
            text,
            "  {DIM}{:<width$}{:>14} {:<units$} {:>11}   95 % interval{DIM:#}",
            "", "", "", "std. error"
        );
    }
    for e in &found.estimates {
        let value = e.value.map_or("–".to_owned(), |value| significant(value, 6));
        let _ = write!(text, "  {STRONG}{:<width$}{STRONG:#}{value:>14} {:<units$}", e.label(), e.unit);
        let remark = match (e.std_error.zip(e.ci95), e.at_bound) {
            (Some((error, [low, high])), _) => {
                format!("{:>11}   {} … {}", significant(error, 2), significant(low, 6), significant(high, 6))
            }
            _ if e.fixed => format!("{DIM}fixed{DIM:#}"),
            (_, Some(side)) => format!("{DIM}at its {} bound{DIM:#}", if side == "max" { "upper" } else { "lower" }),
            _ if e.value.is_none() => format!("{DIM}not identifiable{DIM:#}"),
            _ => String::new(),
        };
        let _ = writeln!(text, " {remark}");
    }
    for c in &found.identified {
        let value = significant(c.value, 6);
        let error = significant(c.std_error, 2);
        let [low, high] = c.ci95.map(|end| significant(end, 6));
        let _ = writeln!(
            text,
            "  {STRONG}{:<width$}{STRONG:#}{value:>14} {:<units$} {error:>11}   {low} … {high}",
            c.name, c.unit
        );
    }
    text.push('\n');
    for (name, value) in lines(model, spec, found) {
        let _ = writeln!(text, "  {name:<10}{}", printable(&value));
    }
    if let Some(table) = model_selection_table(model, found).filter(|_| style.verbose) {
        let _ = write!(text, "\n{}", table.text(terminal::table_width(WIDTH)));
    }
    text
}

fn lines(model: &Model, spec: &ModelSpec, found: &ModelIdentification) -> Vec<(&'static str, String)> {
    let fit = |fits: &[Option<f64>]| {
        let one = |(output, fit): (&motorfit::model::ModelOutput, &Option<f64>)| {
            fit.map(|fit| format!("{} {} %", output.name, motorfit::text::decimals(fit, 2)))
        };
        model.outputs().iter().zip(fits).filter_map(one).collect::<Vec<_>>().join(", ")
    };
    let residual = |sigma: &[Option<f64>]| {
        let one = |(output, sigma): (&motorfit::model::ModelOutput, &Option<f64>)| {
            sigma.map(|sigma| format!("{} {} {}", output.name, significant(sigma, 3), output.unit.text))
        };
        model.outputs().iter().zip(sigma).filter_map(one).collect::<Vec<_>>().join(", ")
    };
    let of = &found.verification;
    let search = match of.status {
        "agrees" => format!(
            "agrees: {} of {} starts spread over the bounds lead to this optimum, the lowest",
            of.arrivals, of.starts
        ),
        "search_stuck" => "search stuck: a better optimum is known".to_owned(),
        "reference_failed" => {
            format!("inconclusive: {} of {} starts lead to the lowest optimum", of.arrivals, of.starts)
        }
        _ => "not verified".to_owned(),
    };
    let mut lines = vec![("fit", fit(&found.fit_percent))];
    lines.extend(model_selection_text(found).map(|text| ("model", text)));
    if !found.held_out_percent.is_empty() {
        lines.push(("held out", fit(&found.held_out_percent)));
    }
    lines.push(("residual", residual(&found.residual_sigma)));
    lines.extend([
        (
            "cost",
            format!(
                "{} ({}, scale {})",
                significant(found.cost, 4),
                spec.criterion.norm.name(),
                spec.criterion.scale.name()
            ),
        ),
        (
            "method",
            format!(
                "{}, {} evaluations, seed {}{}",
                found.searched.method,
                found.evaluations,
                spec.seed,
                if spec.is_polished { ", then Levenberg–Marquardt" } else { "" }
            ),
        ),
        ("steps", found.method.described()),
        ("search", search),
        ("device", found.device.to_string()),
        ("time", engineering(found.seconds, "s", 3)),
    ]);
    lines
}

/// Returns plots of the measured outputs of all recordings for the terminal.
fn plots(model: &Model, recordings: &[ModelRecording], found: &ModelIdentification) -> String {
    let mut text = String::new();
    for (recording, fit) in recordings.iter().zip(&found.fits) {
        for ((output, measured), simulated) in model.outputs().iter().zip(&recording.measured).zip(&fit.simulated) {
            let Some(measured) = measured else { continue };
            let (name, unit, time_s) = (output.name.as_str(), output.unit.text.as_str(), &recording.time_s);
            let signal = plot::Signal { name, unit, time_s, measured, model: simulated };
            let _ = write!(text, "\n{}", plot::drawn(&signal, terminal::table_width(WIDTH)));
        }
    }
    text
}
