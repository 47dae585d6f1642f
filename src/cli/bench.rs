//! `bench`: CPU against GPU evaluation over population sizes.

use super::args::BenchArgs;
use super::output::{DIM, STRONG, Style, data};
use super::progress::Reporter;
use super::{Outcome, files, interrupt};
use motorfit::evaluate::Level;
use motorfit::optimize::Progress;
use motorfit::report::plot::{Line, log_log};
use motorfit::report::{BenchDocument, json};
use motorfit::study::{Measurement, Throughput, ThroughputSpec, contenders, throughput};
use motorfit::text::significant;
use motorfit::{Error, Result};
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;

pub(super) fn run(args: &BenchArgs, style: &Style) -> Result<Outcome> {
    let threads = args.threads.unwrap_or_else(rayon::current_num_threads);
    if !(1..=1024).contains(&threads) {
        return Err(Error::usage(format!("--threads is {threads}"), "Give 1 to 1024, or leave it out for all."));
    }
    let spec = ThroughputSpec {
        populations: args.populations.clone(),
        samples: args.samples.clone(),
        budget_s: args.seconds,
        threads,
        gpus: !args.no_gpu,
    };
    interrupt::listen()?;
    let (contenders, refused) = contenders(&spec)?;
    let mut reporter = Reporter::of(style, "case");
    let result = throughput(&spec, contenders, refused, &mut |done, all| {
        reporter.show(&Progress { generation: done, generations: all, evaluations: done as u64, cost: f64::NAN });
        if interrupt::pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    drop(reporter);
    let result = result?;
    for refused in &result.refused {
        style.note(&format!("not measured: {refused}"));
    }
    if let Some(path) = &args.svg {
        plots(path, &spec, &result, style)?;
    }
    let text = if args.json { json(&BenchDocument::of(&spec, &result)) } else { text(&spec, &result) };
    data(&text)?;
    Ok(if result.interrupted { Outcome::Interrupted } else { Outcome::Done })
}

/// A plot for each recording.
fn plots(path: &Path, spec: &ThroughputSpec, result: &Throughput, style: &Style) -> Result<()> {
    for &samples in &spec.samples {
        let points = |n: usize| {
            let of = |m: &&Measurement| m.contender == n && m.samples == samples;
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            let point = |m: &Measurement| m.rate().map(|rate| (m.population as f64, rate));
            result.measurements.iter().filter(of).filter_map(point).collect()
        };
        let names = result.contenders.iter().enumerate();
        let lines = names.map(|(n, contender)| Line { name: contender.name.clone(), points: points(n) }).collect();
        let title = format!("{samples} samples, end to end");
        let svg = log_log(&title, ["candidates in a batch", "candidate-steps a second [1/s]"], lines);
        let mut file = path.to_path_buf();
        if spec.samples.len() > 1 {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            file.set_file_name(format!("{stem}-{samples}.svg"));
        }
        files::write(&file, &svg)?;
        style.note(&format!("wrote {}", file.display()));
    }
    Ok(())
}

/// Tables: one for each recording, a column for each contender.
fn text(spec: &ThroughputSpec, result: &Throughput) -> String {
    let mut text = String::new();
    for (n, contender) in result.contenders.iter().enumerate() {
        let _ = writeln!(text, "{STRONG}{}{STRONG:#}  {}", letter(n), contender.name);
    }
    if let Some(peak) = result.fma_peak {
        let _ = writeln!(
            text,
            "one core's peak in this run: {} multiply-adds a second ({})",
            significant(peak, 3),
            Level::best().name()
        );
    }
    for &samples in &spec.samples {
        let _ = writeln!(
            text,
            "\n{STRONG}{samples} samples{STRONG:#}: candidate-steps a second, end to end {DIM}(± spread of the rounds; \
             \u{2013} too slow for the time given){DIM:#}"
        );
        text.push_str(&table(spec, result, samples));
        crossovers(&mut text, result, samples);
    }
    if result.contenders.iter().all(|c| matches!(c.kind, "cpu" | "software")) {
        text.push_str("\nNo GPU was measured: a software adapter runs on the CPU.\n");
    }
    text
}

fn letter(n: usize) -> char {
    char::from(b'A' + u8::try_from(n % 26).unwrap_or(0))
}

fn table(spec: &ThroughputSpec, result: &Throughput, samples: usize) -> String {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let letters = (0..result.contenders.len()).map(|n| letter(n).to_string());
    table.set_header(std::iter::once("candidates".to_owned()).chain(letters));
    for &population in &spec.populations {
        let cell = |n: usize| {
            let of = |m: &&Measurement| m.contender == n && m.population == population && m.samples == samples;
            match result.measurements.iter().find(of).and_then(|m| Some((m.rate()?, m))) {
                Some((rate, m)) if m.rounds > 1 => format!("{rate:.2e} ±{:>2.0} %", 100.0 * m.spread),
                Some((rate, _)) => format!("{rate:.2e}  once"),
                None => "\u{2013}".to_owned(),
            }
        };
        table.add_row(std::iter::once(population.to_string()).chain((0..result.contenders.len()).map(cell)));
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(comfy_table::CellAlignment::Right);
    }
    format!("{table}\n")
}

/// What fraction of the peak the best CPU reaches, and from where on adapters win.
fn crossovers(text: &mut String, result: &Throughput, samples: usize) {
    let Some(baseline) = result.contenders.iter().rposition(|c| c.kind == "cpu") else { return };
    let rates = |n: usize| result.measurements.iter().filter(move |m| m.contender == n && m.samples == samples);
    let best = |n: usize| rates(n).filter_map(Measurement::rate).fold(0.0, f64::max);
    if let Some(peak) = result.fma_peak {
        for (n, contender) in result.contenders.iter().enumerate().skip(1).filter(|(_, c)| c.kind == "cpu") {
            #[expect(clippy::cast_precision_loss, reason = "small")]
            let share = 100.0 * best(n) * BenchDocument::OPERATIONS / (peak * contender.threads as f64);
            let _ = writeln!(
                text,
                "  {}: {share:.0} % of the peak of {} core{} ({} operations a step)",
                letter(n),
                contender.threads,
                if contender.threads == 1 { "" } else { "s" },
                BenchDocument::OPERATIONS
            );
        }
    }
    for n in (0..result.contenders.len()).filter(|n| result.contenders[*n].kind != "cpu") {
        let against = match result.crossover(n, baseline, samples) {
            Some(population) => format!("faster than {} from {population} candidates on", letter(baseline)),
            None => format!("never faster than {}", letter(baseline)),
        };
        let _ = writeln!(text, "  {}: {against}", letter(n));
    }
}
