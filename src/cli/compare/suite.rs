//! The command `compare --suite`: searches on problems with known optima.

use super::subject::requested;
use crate::cli::args::CompareArgs;
use crate::cli::prelude::*;
use motorfit::numeric::count_u64;
use motorfit::report::suite::{ioh_files, suite_csv, suite_document, suite_page, suite_tables};
use motorfit::study::suite::{Entrant, Suite, SuiteResult, SuiteSpec, run_suite};

/// Width of printed notes \[characters\].
const WIDTH: usize = 80;

pub(super) fn run(suite: Suite, args: &CompareArgs, style: &Style) -> Result<Outcome> {
    let device = inputs::device(&args.device, style)?;
    let threads = device.threads;
    let spec = SuiteSpec {
        suite,
        entrants: Entrant::all(&requested(args))?,
        budgets: args.budgets.clone(),
        runs: args.runs,
        seed: args.seed,
        device: device.device,
        precision: device.precision,
        evaluator: device.evaluator,
        throughput_profile: device.throughput_profile,
    };
    let ioh = args.out.as_deref().map(|folder| folder.join("ioh"));
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let ioh = ioh.as_deref().map(Out::take).transpose()?;
    let mut observe = progress::reporter(style, "problem");
    let result = with_threads(threads, || {
        run_suite(&spec, &mut |progress| {
            observe(progress);
            signals::searching(true);
            signals::interrupted()
        })
    })?;
    drop(observe);
    style.warnings(&result.warnings);
    if result.interrupted {
        style.note("interrupted: the results are those of the complete problems");
    }
    let document = json(&suite_document(&result));
    if args.json {
        data(&document)?
    } else {
        show(&text(&result))?
    }
    if let (Some(out), Some(ioh)) = (out, ioh) {
        out.write(&report(args, &result, document), style)?;
        ioh.write(&ioh_files(&result), style)?;
    }
    Ok(if result.interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn report(args: &CompareArgs, result: &SuiteResult, document: String) -> Vec<(String, String)> {
    let spec = &result.spec;
    let device = args.device.0.text(Setting::Device).unwrap_or_default();
    let list = |numbers: Vec<String>| numbers.join(", ");
    let how = out::reproduced(vec![
        ("suite", format!("{}, version {}, {} problems", spec.suite.name(), result.version, result.problems.len())),
        ("methods", list((0..spec.entrants.len()).map(|entrant| result.name(entrant)).collect())),
        ("budgets", list(spec.budgets.iter().map(u64::to_string).collect())),
        ("runs", spec.runs.to_string()),
        ("seed", spec.seed.to_string()),
        ("requested device", format!("{device}, threads {}", rayon::current_num_threads())),
        ("evaluations", result.evaluations.to_string()),
        ("time of all runs", engineering(result.seconds, "s", 3)),
    ]);
    let mut files = vec![
        ("report.html".to_owned(), suite_page(result, &how).html(!args.page.no_script)),
        ("result.json".to_owned(), document),
    ];
    files.extend(suite_tables(result).iter().map(|table| (format!("{}.csv", table.id), table.csv())));
    files.push(("runs.csv".to_owned(), suite_csv(result)));
    files.push(("suite.toml".to_owned(), spec.suite.definition().to_owned()));
    files
}

fn text(result: &SuiteResult) -> String {
    let SuiteResult { evaluations, seconds, device, version, .. } = result;
    let rate = significant(count_u64(*evaluations) / seconds, 3);
    let mut text = format!(
        "suite {}, version {version}: {} problems\n{evaluations} evaluations in {}, {rate} a second\non {device}\n",
        result.spec.suite.name(),
        result.problems.len(),
        engineering(*seconds, "s", 3)
    );
    for table in suite_tables(result) {
        let _ = write!(text, "\n{}", table.text(terminal::table_width(WIDTH)));
    }
    text
}
