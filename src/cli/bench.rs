//! The command `bench`: throughput of CPU and GPU evaluation over population sizes.

use super::args::BenchArgs;
use super::prelude::*;
use motorfit::evaluate::Level;
use motorfit::model::Model;
use motorfit::numeric::count;
use motorfit::optimize::Progress;
use motorfit::report::{AxisScale, Chart, Form, Panel, Series, bench_document};
use motorfit::study::{
    Contender, Crossover, Measurement, Throughput, ThroughputSpec, contenders, model_contenders, throughput,
};

pub(super) fn run(args: &BenchArgs, style: &Style) -> Result<Outcome> {
    motorfit::device::check_threads(args.threads)?;
    let threads = args.threads.unwrap_or_else(|| rayon::current_num_threads().min(motorfit::device::THREADS_MAX));
    let spec =
        ThroughputSpec { populations: args.populations.clone(), samples: args.samples.clone(), budget_s: args.seconds }
            .checked()?;
    let model = args.model.model.as_deref().map(Model::open).transpose()?;
    if model.is_some() && args.plain {
        return Err(Error::usage("--plain is a form of the DC motor", "Leave it out with --model."));
    }
    let mut observe = progress::reporter(style, "case");
    let mut look = |done, all| {
        observe(&Progress { generation: done, generations: all, evaluations: done as u64, cost: f64::NAN });
        signals::interrupted()
    };
    let result = match &model {
        None => throughput(&spec, contenders(threads, !args.no_gpu, args.plain)?, &mut look)?,
        Some(model) => throughput(&spec, model_contenders(model, threads, !args.no_gpu)?, &mut look)?,
    };
    drop(observe);
    for refused in &result.refused {
        style.note(&format!("not measured: {refused}"));
    }
    let text = if args.json { json(&bench_document(&spec, &result)) } else { text(&spec, &result) };
    show(&text)?;
    if result.interrupted {
        style.note("interrupted: the result has only the measurements made so far");
    } else if !args.no_gpu && !args.no_keep && model.is_none() {
        keep(&spec, &result, style);
    }
    if let Some(path) = &args.svg {
        plots(path, &spec, &result, style)?;
    }
    Ok(if result.interrupted { Outcome::Interrupted } else { Outcome::Done })
}

/// Smallest value for the largest population of a measurement that is stored. Throughput beyond it is extrapolated.
const KEPT_FROM: usize = 10_000;

/// Stores the throughput profile for `--device auto`. A failure is noted and is not an error.
fn keep(spec: &ThroughputSpec, result: &Throughput, style: &Style) {
    let threads = result.baseline().map_or(0, |n| result.contenders[n].threads);
    let largest = spec.populations.iter().copied().max().unwrap_or(0);
    if spec.populations.len() < 3 || largest < KEPT_FROM || threads != rayon::current_num_threads() {
        let few = format!("not stored for --device auto: needs three populations, one of at least {KEPT_FROM}");
        style.note(&format!("{few}, and all threads"));
        return;
    }
    let Some(throughput_profile) =
        result.throughput_profile().filter(|throughput_profile| !throughput_profile.adapters.is_empty())
    else {
        return;
    };
    match cache::keep(&throughput_profile) {
        Ok(Some(path)) => style.note(&format!("stored for --device auto: {}", path.display())),
        Ok(None) => style.note("not stored for --device auto: there is no home folder"),
        Err(error) => style.note(&format!("not stored for --device auto: {error}")),
    }
}

fn plots(path: &Path, spec: &ThroughputSpec, result: &Throughput, style: &Style) -> Result<()> {
    for &samples in &spec.samples {
        let points = |n: usize| {
            let point = |m: &Measurement| m.rate().map(|rate| (count(m.population), rate));
            result.of(n).filter(|m| m.samples == samples).filter_map(point).collect()
        };
        let of = |(n, contender): (usize, &Contender)| Series::new(&contender.name, n + 1, Form::Line, points(n));
        let series = result.contenders.iter().enumerate().map(of).collect();
        let label = format!("candidate-steps per second [1/s], {samples} samples, end to end");
        let chart = Chart {
            axis: "candidates in a batch [1]".to_owned(),
            panels: vec![Panel { scales: [AxisScale::Log, AxisScale::Log], ..Panel::new(&label, series) }],
            alternative: "by candidates in a batch".to_owned(),
            ..Chart::default()
        };
        let file = out::numbered(path, (spec.samples.len() > 1).then_some(samples));
        out::write_file(&file, &chart.figure().file("", false))?;
        style.note(&format!("wrote {}", file.display()));
    }
    Ok(())
}

/// Returns the tables: one for each recording, with a column for each evaluator.
fn text(spec: &ThroughputSpec, result: &Throughput) -> String {
    let mut text = String::new();
    for (n, contender) in result.contenders.iter().enumerate() {
        let _ = writeln!(text, "{STRONG}{}{STRONG:#}  {}", letter(n), contender.name);
    }
    if let Some(peak) = result.fma_peak {
        let (peak, level) = (significant(peak, 3), Level::best().name());
        let _ = writeln!(text, "peak of one core in this run: {peak} multiply-adds per second ({level})");
    }
    for &samples in spec.samples.iter().filter(|s| result.measurements.iter().any(|m| m.samples == **s)) {
        let _ = writeln!(
            text,
            "\n{STRONG}{samples} samples{STRONG:#}: candidate-steps per second, end to end {DIM}(± half the 95 % interval of \
             the median;\nonce: fewer than six rounds; \u{2013} too slow for the time given){DIM:#}"
        );
        text.push_str(&table(spec, result, samples));
        kernels(&mut text, spec, result, samples);
        crossovers(&mut text, result, samples);
    }
    control(&mut text, result);
    if result.contenders.iter().all(|c| matches!(c.kind, "cpu" | "software")) {
        text.push_str("No GPU was measured. Software adapters run on the CPU.\n");
    }
    text
}

fn all_contenders(result: &Throughput) -> Vec<usize> {
    (0..result.contenders.len()).collect()
}

fn letter(n: usize) -> char {
    char::from(b'A' + u8::try_from(n % 26).unwrap_or(0))
}

fn table(spec: &ThroughputSpec, result: &Throughput, samples: usize) -> String {
    let cell = |n: usize, population: usize| {
        let measured = result.case(n, population, samples).and_then(|m| Some((m.rate()?, m)));
        match measured.map(|(rate, m)| (rate, m.rounds, m.spread().unwrap_or(0.0))) {
            Some((rate, 1..=5, _)) => format!("{rate:.2e}  once"),
            Some((rate, _, spread)) => format!("{rate:.2e} ±{:>2.0} %", 100.0 * spread),
            None if result.case(n, population, samples).is_none() => String::new(),
            None => "\u{2013}".to_owned(),
        }
    };
    population_table(spec, &all_contenders(result), &cell)
}

fn kernels(text: &mut String, spec: &ThroughputSpec, result: &Throughput, samples: usize) {
    let has_clock = |n: &usize| result.of(*n).any(|m| m.samples == samples && m.kernel.is_some());
    let timed: Vec<usize> = all_contenders(result).into_iter().filter(has_clock).collect();
    if timed.is_empty() {
        return;
    }
    let _ = writeln!(text, "kernel time only, by the adapter's clock {DIM}(and its share of the total){DIM:#}");
    let cell = |n: usize, population: usize| {
        let share = |m: &Measurement| Some((m.kernel_rate()?, m.kernel.map(|[kernel, whole]| 100.0 * kernel / whole)?));
        let known = result.case(n, population, samples).and_then(share);
        known.map_or("\u{2013}".to_owned(), |(rate, share)| format!("{rate:.2e} {share:>3.0} %"))
    };
    text.push_str(&population_table(spec, &timed, &cell));
}

/// Returns a table with a row for each population and a column for each evaluator.
fn population_table(spec: &ThroughputSpec, contenders: &[usize], cell: &dyn Fn(usize, usize) -> String) -> String {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let letters = contenders.iter().map(|&n| letter(n).to_string());
    table.set_header(std::iter::once("candidates".to_owned()).chain(letters));
    for &population in &spec.populations {
        let cells = contenders.iter().map(|&n| cell(n, population));
        table.add_row(std::iter::once(population.to_string()).chain(cells));
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(comfy_table::CellAlignment::Right);
        column.set_padding((1, 0));
    }
    format!("{table}\n")
}

/// Writes the fraction of the peak that kernels reach, and the population from which each other evaluator is faster.
fn crossovers(text: &mut String, result: &Throughput, samples: usize) {
    let Some(baseline) = result.baseline() else { return };
    let rates = |n: usize| result.of(n).filter(|m| m.samples == samples).filter_map(Measurement::rate);
    for (n, contender) in result.contenders.iter().enumerate() {
        if contender.evaluator != "kernel" {
            let against = match result.crossover(n, baseline, samples) {
                Crossover::From(population) => {
                    format!("faster than {} from {population} candidates on", letter(baseline))
                }
                Crossover::Never => format!("never faster than {}", letter(baseline)),
                Crossover::Unknown => format!("not compared with {}", letter(baseline)),
            };
            let ready = if contender.evaluator == "tables" { ", not counting the computation of cells" } else { "" };
            let _ = writeln!(text, "  {}: {against}{ready}", letter(n));
        } else if let (Some(peak), Some(operations)) = (result.fma_peak, contender.operations)
            && n > 0
            && rates(n).next().is_some()
        {
            let threads = contender.threads;
            let share = 100.0 * (rates(n).fold(0.0, f64::max) * operations / (peak * count(threads)));
            let cores = if threads == 1 { "core" } else { "cores" };
            let _ = write!(text, "  {}: {share:.0} % of the peak of {threads} {cores} ", letter(n));
            let _ = writeln!(
                text,
                "({operations} operations a step; more than 100 % if additions have ports of their own)"
            );
        }
    }
}

fn control(text: &mut String, result: &Throughput) {
    let Some(control) = result.control() else { return };
    let (name, apart, cases) = (letter(control.contender), control.apart, control.cases);
    let [median, most] = control.difference.map(|part| 100.0 * part);
    let _ = writeln!(
        text,
        "\nControl: {name} measured twice in the same rounds differs by {median:.1} % in the median case, {most:.1} % at most, \
         and in {apart} of {cases}\ncases by more than both intervals. Smaller differences between evaluators are noise."
    );
}
