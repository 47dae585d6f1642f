//! Files of the report of `compare`.

use crate::cli::args::CompareArgs;
use crate::cli::prelude::*;
use motorfit::criterion::Criterion;
use motorfit::identify::Method;
use motorfit::numeric::count;
use motorfit::report::compare::{curves, invariance, paper_tables, quartiles, setting_name, tables};
use motorfit::report::{columns_csv, compare_page};
use motorfit::study::compare::{Block, ComparedMachine, Comparison, reached};

/// Returns the files of a report: the page, the document and the tables.
pub(super) fn report(args: &CompareArgs, comparison: &Comparison, document: String) -> Vec<(String, String)> {
    let how = out::reproduced(settings(args, comparison));
    let page = compare_page(comparison, args.preset.is_some(), &how);
    let mut files =
        vec![("report.html".to_owned(), page.html(!args.page.no_script)), ("result.json".to_owned(), document)];
    if args.preset.is_some() {
        files.extend(paper_tables(comparison).iter().map(|table| (format!("{}.csv", table.id), table.csv())));
    }
    files.extend(invariance(comparison).map(|table| ("invariance.csv".to_owned(), table.csv())));
    let (heads, columns) = curves(comparison);
    files.push(("curves.csv".to_owned(), columns_csv(&heads, &columns)));
    for (n, block) in (1..).zip(&comparison.blocks) {
        let tables = tables(comparison, block);
        files.extend(tables.iter().map(|table| (format!("block{n}-{}.csv", table.id), table.csv())));
        files.push((format!("block{n}-runs.csv"), runs(comparison, block)));
        files.push((format!("block{n}-history.csv"), history(block)));
        files.push((format!("block{n}-reached.csv"), shares(comparison, block)));
    }
    files
}

/// Returns the names and values of the settings that reproduce a comparison.
fn settings(args: &CompareArgs, comparison: &Comparison) -> Vec<(&'static str, String)> {
    let spec = &comparison.spec;
    let parameters = || comparison.parameters.iter();
    let bounds = parameters().filter_map(|p| p.bounds().map(|[min, max]| format!("{}={min}:{max}", p.name)));
    let fixed = parameters().filter_map(|p| p.fixed().map(|value| format!("{}={value}", p.name)));
    let settings = spec.settings.iter().map(|setting| {
        let methods: Vec<&str> = setting.methods.iter().map(Method::name).collect();
        format!("{}: {}", setting_name(setting), methods.join(", "))
    });
    let device = args.device.0.text(Setting::Device).unwrap_or_default();
    let mut list = vec![("settings", settings.collect::<Vec<_>>().join("; "))];
    match &comparison.subject.machine {
        ComparedMachine::Motor { .. } => {
            let sm = format!("{} records with new noise, {} dB where simulated", spec.noise_records, spec.noise_db);
            list.push(("steiglitz-mcbride", if spec.steiglitz_mcbride { sm } else { "no".to_owned() }));
            list.push(("discretization", spec.model.discretization.name().to_owned()));
        }
        ComparedMachine::Model(of) => {
            list.push(("model", format!("{}, sha256 {}", of.model.name(), of.model.digest())));
            let problem = of.problem(Criterion::default()).ok();
            list.extend(problem.map(|problem| ("integration", problem.method().described())));
        }
    }
    list.extend([
        ("fixed", fixed.collect::<Vec<_>>().join(", ")),
        ("target", spec.target.map_or("a range".to_owned(), |cost| cost.to_string())),
        ("requested device", format!("{device}, threads {}", rayon::current_num_threads())),
        ("runs", spec.runs.to_string()),
        ("seed", spec.seed.to_string()),
        ("bounds", bounds.collect::<Vec<_>>().join(", ")),
        ("evaluations", comparison.evaluations.to_string()),
        ("time of all runs", engineering(comparison.batch_seconds, "s", 3)),
    ]);
    list
}

/// Returns CSV with a line for each run: its method, number, cost, evaluations and parameters.
fn runs(comparison: &Comparison, block: &Block) -> String {
    let names: Vec<&str> = comparison.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let mut text = format!("method,run,cost,evaluations,{}\n", names.join(","));
    for result in &block.results {
        for (n, run) in result.runs.iter().enumerate() {
            let values: Vec<String> = match &run.parameters {
                Some(values) => values.iter().map(|value| Shortest(*value).to_string()).collect(),
                None => vec![String::new(); names.len()],
            };
            let cost = if run.cost.is_finite() { Shortest(run.cost).to_string() } else { String::new() };
            let _ = writeln!(text, "{},{n},{cost},{},{}", result.method.name(), run.evaluations, values.join(","));
        }
    }
    text
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
    columns_csv(&heads, &columns)
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
    columns_csv(&heads, &columns)
}
