//! The command `compare`: methods under equal budgets, for the DC motor or a user's model.

mod files;
mod subject;
mod suite;

use super::args::CompareArgs;
use super::prelude::*;
use motorfit::numeric::count_u64;
use motorfit::report::Table;
use motorfit::report::compare::{compare_document, invariance, paper_tables, setting_name, tables};
use motorfit::study::compare::{CompareSpec, Comparison, compare};
use subject::requested;

/// Width of printed tables \[characters\].
const WIDTH: usize = 80;

pub(super) fn run(args: &CompareArgs, style: &Style) -> Result<Outcome> {
    if let Some(suite) = args.suite {
        return suite::run(suite, args, style);
    }
    let device = inputs::device(&args.device, style)?;
    let threads = device.threads;
    let (subject, requested) = (subject::subject(args)?, requested(args));
    let spec = subject::spec(args, &requested, device)?;
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let mut observe = progress::reporter(style, "generation");
    let comparison = with_threads(threads, || {
        let spec = CompareSpec { space: requested.space(&subject, spec.model)?, ..spec };
        compare(subject, &spec, &mut |progress| {
            observe(progress);
            signals::searching(progress.generation < progress.generations);
            signals::interrupted()
        })
    })?;
    drop(observe);
    style.warnings(&comparison.warnings);
    if comparison.interrupted {
        style.note("interrupted: the results are the best so far");
    }
    let document = json(&compare_document(&comparison, args.preset.is_some()));
    if args.json {
        data(&document)?
    } else {
        show(&text(args, &comparison))?
    }
    if let Some(out) = out {
        out.write(&files::report(args, &comparison, document), style)?;
    }
    Ok(if comparison.interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn text(args: &CompareArgs, comparison: &Comparison) -> String {
    let mut text = String::new();
    match comparison.subject.truth() {
        Some(_) => text.push_str("simulated M2 motor, 10.5 V from 1 s on, 3001 samples in steps of 1 ms, no noise\n"),
        None => {
            for record in &comparison.subject.records {
                let _ = writeln!(text, "{}", inputs::understood(record));
            }
        }
    }
    let Comparison { evaluations, batch_seconds, device, .. } = comparison;
    let rate = significant(count_u64(*evaluations) / batch_seconds, 3);
    let seconds = engineering(*batch_seconds, "s", 3);
    let _ = writeln!(text, "{evaluations} evaluations in {seconds}, {rate} a second\non {device}");
    let add = |text: &mut String, tables: &[Table]| {
        for table in tables {
            let _ = write!(text, "\n{}", table.text(terminal::table_width(WIDTH)));
        }
    };
    if args.preset.is_some() {
        add(&mut text, &paper_tables(comparison));
    }
    add(&mut text, invariance(comparison).as_slice());
    for block in &comparison.blocks {
        let _ = writeln!(text, "\n{STRONG}{}{STRONG:#}", setting_name(&block.setting));
        add(&mut text, &tables(comparison, block));
    }
    text
}
