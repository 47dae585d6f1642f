//! The command `identify`: parameters of one machine, the DC motor or a user's model, from one or more recordings.

use super::args::IdentifyArgs;
use super::identified::{self, Told};
use super::prelude::*;
use super::{export, next, output, plot};
use motorfit::analysis::suspicions;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::model::{ModelProgress, hold_out_model, identify_model};
use motorfit::identify::{Identification, Polish, TrustLevel, hold_out, identify_with};
use motorfit::model::Model;
use motorfit::optimize::{Progress, Stop};
use motorfit::record::Record;
use motorfit::report::{
    Exported, Recorded, exported_model, exported_motor, figures, identify_document, identify_page, selection_table,
    signals_csv,
};
use motorfit::settings::Value;
use std::ops::ControlFlow;

pub(super) fn run(args: &IdentifyArgs, style: &Style) -> Result<Outcome> {
    match &args.model.model {
        Some(path) => of_model(args, path, style),
        None => of_motor(args, style),
    }
}

/// Checks the outputs that the arguments name, and takes the folder of the report.
fn outputs(args: &IdentifyArgs, records: &[Record]) -> Result<Option<Out>> {
    export::check(args)?;
    out::check_drawings(args.svg.as_deref(), args.json || records.len() > 1)?;
    args.out.as_deref().map(Out::take).transpose()
}

/// Returns an observer that shows the progress and looks for an interruption.
fn observer(style: &Style, unit: &'static str) -> impl FnMut(&Progress) -> ControlFlow<()> {
    let mut observe = progress::reporter(style, unit);
    move |progress| {
        observe(progress);
        signals::searching(progress.generation < progress.generations);
        signals::interrupted()
    }
}

fn of_motor(args: &IdentifyArgs, style: &Style) -> Result<Outcome> {
    if !args.start.is_empty() {
        let hint = "Leave it out: the DC motor's estimates do not depend on a start.";
        return Err(Error::usage("--start is for own models", hint));
    }
    let given = args.search.0.and(&args.problem.0).and(&args.device.0);
    let spec = inputs::checked(settings::identify(&given)?, &given, style)?;
    let reading = args.recordings.reading.0.and(&args.problem.0);
    let records = inputs::records(&args.recordings.records, &reading)?;
    let mut held_out = inputs::records(&args.validate, &reading)?;
    let spec = settings::with_intersample_of(spec, &given, &records);
    let records = &inputs::fitted_part(records, args.split, &mut held_out)?;
    let out = outputs(args, records)?;
    let mut observe = observer(style, "generation");
    let found = identify_with(records, &spec, &mut observe);
    drop(observe);
    let mut found = found.inspect_err(|_| style.warnings(&suspicions(records, spec.model.discretization)))?;
    hold_out(&mut found, records, &held_out, &spec)?;
    let recorded = records.iter().map(Recorded::from).collect();
    let exported = || exported_motor(records, &found);
    let done = Done { records, recorded, spec: &spec, found: &found, exported: &exported };
    done.finish(args, out, style)
}

fn of_model(args: &IdentifyArgs, path: &Path, style: &Style) -> Result<Outcome> {
    let model = Model::open(path)?;
    let mut given = args.search.0.and(&args.problem.0).and(&args.device.0);
    given.put(Setting::Start, Value::List(args.start.clone()));
    let spec = settings::model_spec(&given)?;
    let reading = settings::model_reading(&args.recordings.reading.0.and(&args.problem.0), &model)?;
    let records = inputs::records_with(&args.recordings.records, &reading)?;
    let mut held_out = inputs::records_with(&args.validate, &reading)?;
    let records = &inputs::fitted_part(records, args.split, &mut held_out)?;
    let of = |records: &[Record]| records.iter().map(|r| ModelRecording::new(&model, r)).collect::<Result<Vec<_>>>();
    let (recordings, others) = (of(records)?, of(&held_out)?);
    let out = outputs(args, records)?;
    let mut observe = observer(style, "round");
    let mut look = |progress: ModelProgress| {
        let (generation, generations) = (progress.done, progress.of);
        observe(&Progress { generation, generations, evaluations: 0, cost: f64::NAN })
    };
    let found = with_threads(given.count(Setting::Threads), || identify_model(&model, &recordings, &spec, &mut look));
    drop(observe);
    let mut found = found?;
    hold_out_model(&mut found, &recordings, &others, &spec)?;
    let signals = |recording| Recorded::of_model(&found.model, recording, spec.is_first_order_hold);
    let recorded = recordings.iter().map(signals).collect();
    let exported = || Ok(exported_model(records, &recordings, &found));
    let done = Done { records, recorded, spec: &spec, found: &found, exported: &exported };
    done.finish(args, out, style)
}

/// A finished identification.
struct Done<'a, M: Told> {
    records: &'a [Record],
    recorded: Vec<Recorded>,
    spec: &'a M::Spec,
    found: &'a Identification<M>,
    exported: &'a dyn Fn() -> Result<Exported>,
}

impl<M: Told> Done<'_, M> {
    /// Prints the result, and writes the files that the arguments name.
    fn finish(&self, args: &IdentifyArgs, out: Option<Out>, style: &Style) -> Result<Outcome> {
        let Self { records, spec, found, .. } = *self;
        style.warnings(&found.warnings);
        if found.stop == Stop::Interrupted {
            style.note("interrupted: the result is the best so far");
        }
        let next = found.trust.next.as_ref().map(|step| next::command(step, &args.recordings.records));
        let document = || {
            let mut document = identify_document(records, spec, found);
            document["trust"]["next"] = next.clone().into();
            json(&document)
        };
        if args.json {
            data(&document())?;
        } else if !args.svg.as_deref().is_some_and(stdio::is_stdio) && !export::is_printed(args) {
            let trust = output::trust_line(&found.trust, output::WITHOUT_REASONS, next.as_deref());
            show(&(trust + &self.table(style)))?;
            if args.plot {
                data(&self.plots()?)?;
            }
        }
        let exported = export::file(args, self.exported)?;
        export::print(args, exported.as_ref(), &found.trust, style)?;
        if let Some(path) = &args.svg {
            let drawing = |(recorded, signals): (&Recorded, &Vec<Vec<f64>>)| {
                figures::responses("response", recorded, "model", signals).file("", false)
            };
            let drawings: Vec<String> = self.recorded.iter().zip(&M::modelled(found, records)?).map(drawing).collect();
            out::drawings(path, &drawings, style)?;
        }
        if let Some(out) = out {
            let mut files = self.report(document(), !args.page.no_script);
            files.extend(exported);
            out.write(&files, style)?;
        }
        Ok(match found.trust.level {
            _ if found.stop == Stop::Interrupted => Outcome::Interrupted,
            TrustLevel::Check | TrustLevel::Poor if args.strict => Outcome::Untrusted,
            _ => Outcome::Done,
        })
    }

    fn report(&self, document: String, has_script: bool) -> Vec<(String, String)> {
        let Self { records, spec, found, .. } = *self;
        let how = out::reproduced(M::options(spec, found));
        let page = identify_page((records, &self.recorded), spec, found, &how);
        vec![
            ("report.html".to_owned(), page.html(has_script)),
            ("curves.csv".to_owned(), signals_csv((records, &self.recorded), found)),
            ("result.json".to_owned(), document),
        ]
    }

    /// Returns plots of the measured outputs of all recordings for the terminal.
    fn plots(&self) -> Result<String> {
        let mut text = String::new();
        for ((record, recorded), modelled) in
            self.records.iter().zip(&self.recorded).zip(&M::modelled(self.found, self.records)?)
        {
            for output in &recorded.outputs {
                let (Some(measured), Some(model)) = (&output.measured, modelled.get(output.number)) else { continue };
                let (name, unit) = (output.name.as_str(), self.found.outputs[output.number].unit.as_str());
                let signal = plot::Signal { name, unit, time_s: &recorded.time_s, measured, model };
                let drawn = plot::drawn(&signal, terminal::table_width(WIDTH));
                if self.records.len() > 1 && !drawn.is_empty() {
                    let _ = write!(text, "\n{}", inputs::name(record.source()));
                }
                let _ = write!(text, "\n{drawn}");
            }
        }
        Ok(text)
    }

    fn table(&self, style: &Style) -> String {
        let Self { records, spec, found, .. } = *self;
        let mut text = String::new();
        if !style.quiet {
            let _ = writeln!(text, "{}\n", inputs::all_understood(records));
        }
        identified::parameters(&mut text, found);
        text.push('\n');
        for (name, value) in identified::lines(records, &M::requested(spec), found) {
            let _ = writeln!(text, "  {name:<10}{}", printable(&value));
        }
        if !style.quiet && found.uncertainty.is_none() {
            let none = Polish::None.name();
            let _ = writeln!(
                text,
                "\n  {DIM}Without a polish there are no standard errors: leave out --polish {none}.{DIM:#}"
            );
        }
        if let (true, Some(table)) = (style.verbose, selection_table(found)) {
            let _ = write!(text, "\n{}", table.text(terminal::table_width(WIDTH)));
        }
        if style.verbose && !found.history.is_empty() {
            let _ = writeln!(text, "\n  generation  lowest cost");
            for (n, cost) in found.history.iter().enumerate() {
                let _ = writeln!(text, "  {:>10}  {}", n + 1, significant(*cost, 6));
            }
        }
        text
    }
}

/// Width of printed plots and tables \[characters\].
const WIDTH: usize = 100;
