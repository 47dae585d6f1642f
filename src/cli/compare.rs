//! The command `compare`: methods under equal budgets.

use super::args::CompareArgs;
use super::prelude::*;
use motorfit::evaluate::{Initial, Model};
use motorfit::identify::{IdentifySpec, Method};
use motorfit::numeric::{count, count_u64};
use motorfit::report::compare::{compare_document, invariance, paper_tables, quartiles, setting_name, tables};
use motorfit::report::figures::model;
use motorfit::report::{Table, compare_page};
use motorfit::settings::Value;
use motorfit::study::compare::{Block, CompareSettings, CompareSpec, Comparison, ComparisonSubject, compare, reached};

/// Width of printed tables \[characters\].
const WIDTH: usize = 80;

pub(super) fn run(args: &CompareArgs, style: &Style) -> Result<Outcome> {
    if let Some(suite) = args.suite {
        return super::suite::run(suite, args, style);
    }
    let device = inputs::device(&args.device, style)?;
    let threads = device.threads;
    let (subject, requested) = (subject(args)?, requested(args));
    let spec = spec(args, &requested, device)?;
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
        out.write(&report(args, &comparison, document), style)?;
    }
    Ok(if comparison.interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn report(args: &CompareArgs, comparison: &Comparison, document: String) -> Vec<(String, String)> {
    let spec = &comparison.spec;
    let bounds = spec.space.free().iter().map(|a| format!("{}={}:{}", a.parameter.symbol(), a.min, a.max));
    let fixed = spec.space.fixed().iter().map(|(p, _, value)| format!("{}={value}", p.symbol()));
    let settings = spec.settings.iter().map(|setting| {
        let methods: Vec<&str> = setting.methods.iter().map(Method::name).collect();
        format!("{}: {}", setting_name(setting), methods.join(", "))
    });
    let sm = format!("{} records with new noise, {} dB where simulated", spec.noise_records, spec.noise_db);
    let device = args.device.0.text(Setting::Device).unwrap_or_default();
    let how = out::reproduced(vec![
        ("settings", settings.collect::<Vec<_>>().join("; ")),
        ("steiglitz-mcbride", if spec.steiglitz_mcbride { sm } else { "no".to_owned() }),
        ("discretization", spec.model.discretization.name().to_owned()),
        ("fixed", fixed.collect::<Vec<_>>().join(", ")),
        ("target", spec.target.map_or("a range".to_owned(), |cost| cost.to_string())),
        ("requested device", format!("{device}, threads {}", rayon::current_num_threads())),
        ("runs", spec.runs.to_string()),
        ("seed", spec.seed.to_string()),
        ("bounds", bounds.collect::<Vec<_>>().join(", ")),
        ("evaluations", comparison.evaluations.to_string()),
        ("time of all runs", engineering(comparison.batch_seconds, "s", 3)),
    ]);
    let page = compare_page(comparison, args.preset.is_some(), &how);
    let mut files =
        vec![("report.html".to_owned(), page.html(!args.page.no_script)), ("result.json".to_owned(), document)];
    if args.preset.is_some() {
        files.extend(paper_tables(comparison).iter().map(|table| (format!("{}.csv", table.id), table.csv())));
    }
    files.extend(invariance(comparison).map(|table| ("invariance.csv".to_owned(), table.csv())));
    files.push(("curves.csv".to_owned(), curves(comparison)));
    for (n, block) in (1..).zip(&comparison.blocks) {
        let tables = tables(comparison, block);
        files.extend(tables.iter().map(|table| (format!("block{n}-{}.csv", table.id), table.csv())));
        files.push((format!("block{n}-runs.csv"), runs(block)));
        files.push((format!("block{n}-history.csv"), history(block)));
        files.push((format!("block{n}-reached.csv"), shares(comparison, block)));
    }
    files
}

/// Returns CSV with a line for each run: its method, number, cost, evaluations and parameters.
fn runs(block: &Block) -> String {
    let mut text = String::from("method,run,cost,evaluations,R,L,K,B,J\n");
    for result in &block.results {
        for (n, run) in result.runs.iter().enumerate() {
            let values = run
                .parameters
                .map_or_else(|| vec![String::new(); 5], |p| p.to_array().map(|v| Shortest(v).to_string()).to_vec());
            let cost = if run.cost.is_finite() { Shortest(run.cost).to_string() } else { String::new() };
            let _ = writeln!(text, "{},{n},{cost},{},{}", result.method.name(), run.evaluations, values.join(","));
        }
    }
    text
}

/// Returns CSV with the first recording and its simulations by the best run of each method of the first block.
fn curves(comparison: &Comparison) -> String {
    let Some(record) = comparison.subject.records.first() else { return String::new() };
    let samples = record.samples();
    let none = || vec![f64::NAN; record.len()];
    let mut heads = ["time_s", "voltage_V", "current_A", "speed_rad_s"].map(str::to_owned).to_vec();
    let mut columns = vec![
        samples.time_s.clone(),
        samples.voltage.clone(),
        samples.current.clone().unwrap_or_else(none),
        samples.speed.clone().unwrap_or_else(none),
    ];
    let results = comparison.blocks.first().map_or(&[][..], |block| &block.results);
    let best = results.iter().filter_map(|c| Some((c.method.name(), c.best()?.parameters?)));
    let sm = comparison.steiglitz.as_ref().and_then(|sm| Some(("sm", *sm.estimate.as_ref().ok()?)));
    let initial = comparison.initial.first().copied().unwrap_or_default();
    for (name, parameters) in best.chain(sm) {
        let [current, speed] = model(record, &parameters, initial, comparison.spec.model.discretization);
        heads.extend([format!("{name}_current_A"), format!("{name}_speed_rad_s")]);
        columns.extend([current, speed]);
    }
    out::curves(&heads, &columns)
}

/// Returns CSV with the share of targets that each method reached, over evaluations and over time.
fn shares(comparison: &Comparison, block: &Block) -> String {
    let (_, reached) = reached(block, comparison.spec.target);
    let (mut heads, mut columns) = (Vec::new(), Vec::new());
    for (result, reached) in block.results.iter().zip(reached) {
        let name = result.method.name();
        heads.extend(["evaluations", "seconds", "share"].map(|what| format!("{name}_{what}")));
        columns.extend([reached.evaluations, reached.seconds, reached.share]);
    }
    out::curves(&heads, &columns)
}

/// Returns CSV with the quartiles over runs of the lowest cost after each generation.
fn history(block: &Block) -> String {
    let names = block.results.iter().flat_map(|c| ["q25", "median", "q75"].map(|q| format!("{}_{q}", c.method.name())));
    let heads: Vec<String> = std::iter::once("generation".to_owned()).chain(names).collect();
    let all: Vec<Vec<[f64; 3]>> = block.results.iter().map(quartiles).collect();
    let longest = all.iter().map(Vec::len).max().unwrap_or(0);
    let mut columns = vec![(1..=longest).map(count).collect::<Vec<f64>>()];
    for quartiles in &all {
        columns.extend((0..3).map(|k| quartiles.iter().map(|q| q[k]).collect::<Vec<f64>>()));
    }
    out::curves(&heads, &columns)
}

fn subject(args: &CompareArgs) -> Result<ComparisonSubject> {
    if args.records.is_empty() {
        return ComparisonSubject::m2();
    }
    let mut given = args.reading.0.clone();
    given.put(Setting::Discretization, Value::Text(args.discretization.name().to_owned()));
    Ok(ComparisonSubject { records: inputs::records(&args.records, &given)?, truth: None })
}

pub(super) fn requested(args: &CompareArgs) -> CompareSettings {
    CompareSettings {
        methods: args.methods.clone(),
        criteria: args.criteria.clone(),
        population: args.population.clone(),
        generations: args.generations.clone(),
        set: args.set.clone(),
        transforms: args.transform.clone(),
        bounds: args.bounds.clone(),
        fix: args.fix.clone(),
    }
}

fn spec(args: &CompareArgs, requested: &CompareSettings, device: IdentifySpec) -> Result<CompareSpec> {
    let model = Model { discretization: args.discretization, initial: Initial::Auto };
    let base = if args.preset.is_some() { CompareSpec::paper() } else { CompareSpec::default() };
    Ok(CompareSpec {
        settings: if args.preset.is_some() { base.settings } else { requested.settings()? },
        runs: args.runs,
        seed: args.seed,
        model,
        steiglitz_mcbride: requested.methods.contains(&Method::SteiglitzMcBride),
        noise_records: args.noise_records,
        target: args.target,
        device: device.device,
        precision: device.precision,
        throughput_profile: device.throughput_profile,
        ..base
    })
}

fn text(args: &CompareArgs, comparison: &Comparison) -> String {
    let mut text = String::new();
    match comparison.subject.truth {
        Some(_) => text.push_str("simulated M2 motor, 10.5 V from 1 s on, 3001 samples in steps of 1 ms, no noise\n"),
        None => {
            for record in &comparison.subject.records {
                let _ = writeln!(text, "{}", inputs::understood(record));
            }
        }
    }
    let Comparison { evaluations, batch_seconds, device: (_, device, precision), .. } = comparison;
    let rate = significant(count_u64(*evaluations) / batch_seconds, 3);
    let seconds = engineering(*batch_seconds, "s", 3);
    let _ = writeln!(text, "{evaluations} evaluations in {seconds}, {rate} a second\non {device}, {precision}");
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
