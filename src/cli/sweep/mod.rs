//! The command `sweep`: plan, run, status and merge, or all in one.

pub(crate) mod args;
mod trust;

use super::args::{Shown, Strict, SweepAction, SweepArgs};
use super::prelude::*;
use motorfit::numeric::{count_u64, index};
#[cfg(feature = "parquet")]
use motorfit::report::sweep::write_parquet;
use motorfit::report::sweep::{
    all_within_limits, motors_csv, shortened, status_document, sweep_answer, sweep_document, sweep_page, sweep_tables,
    tally_document,
};
use motorfit::study::sweep::{Limits, Merged, Shard, Sweep, SweepStatus, Tally};
use motorfit::text::counted;
use std::io::Read as _;
use trust::{level_text, trusted};

/// Width of printed tables \[characters\].
const WIDTH: usize = 80;
/// Largest number of printed rows of a table.
const ROWS: usize = 40;

pub(super) fn run(args: &SweepArgs, style: &Style) -> Result<Outcome> {
    match &args.action {
        Some(SweepAction::Plan { study, out }) => {
            let (sweep, again) = Sweep::plan(study, out, cache::throughput_profile(style))?;
            show(&planned(&sweep, out, again))?;
            Ok(Outcome::Done)
        }
        Some(SweepAction::Run { dir, shard, threads, json: as_json, strict }) => {
            let shard: Shard = shard.parse()?;
            let tally = shard_run(&Sweep::open(dir)?, shard, threads.threads, style)?;
            let document = tally_document(shard, &tally);
            if *as_json {
                data(&json(&document))?
            } else {
                show(&tally_text(shard, &tally))?
            }
            Ok(ended(&tally, *strict))
        }
        Some(SweepAction::Status { dir, json: as_json }) => {
            let status = Sweep::open(dir)?.status()?;
            if *as_json {
                data(&json(&status_document(&status)))?
            } else {
                show(&status_text(&status))?
            }
            Ok(Outcome::Done)
        }
        Some(SweepAction::Merge { dir, shown, out, json: as_json, strict }) => {
            merge(&Sweep::open(dir)?, Show::new(shown, out.as_deref(), *as_json)?, *strict, style)
        }
        None => all(args, style),
    }
}

fn all(args: &SweepArgs, style: &Style) -> Result<Outcome> {
    // Clap requires both without a subcommand.
    let (Some(study), Some(out)) = (&args.study, &args.out) else { return Ok(Outcome::Done) };
    let outputs = Show::new(&args.shown, args.report.as_deref(), args.json)?;
    let (sweep, again) = Sweep::plan(study, out, cache::throughput_profile(style))?;
    outputs.check(&sweep)?;
    style.note(planned(&sweep, out, again).trim_end());
    let tally = shard_run(&sweep, Shard::ALL, args.threads.threads, style)?;
    style.note(tally_text(Shard::ALL, &tally).trim_end());
    if tally.interrupted || tally.fault.is_some() {
        if args.json {
            data(&json(&tally_document(Shard::ALL, &tally)))?;
        }
        return Ok(ended(&tally, args.strict));
    }
    merge(&sweep, outputs, args.strict, style)
}

fn planned(sweep: &Sweep, folder: &Path, again: bool) -> String {
    let manifest = sweep.manifest();
    let (runs, device, motors) = (manifest.runs, &manifest.device, manifest.motors.len());
    let [name, folder] = [&manifest.name, &folder.display().to_string()].map(|text| printable(text));
    let tables = if device.tables { " with tables of poles" } else { "" };
    let on = format!("motor{} on {} {}{tables}", if motors == 1 { "" } else { "s" }, device.kind, device.precision);
    let planned = if again { "as planned" } else { "planned" };
    let runs = counted(index(runs), "run");
    format!("{name}: {runs} of {motors} {on}, {planned} in {folder}\n")
}

fn shard_run(sweep: &Sweep, shard: Shard, threads: Option<usize>, style: &Style) -> Result<Tally> {
    motorfit::device::check_threads(threads)?;
    signals::remark("interrupted: finished runs are kept; run the command again to continue");
    let mut observe = progress::sweep_reporter(style);
    let tally = with_threads(threads, || {
        sweep.run(shard, &mut |progress| {
            observe(progress);
            signals::interrupted()
        })
    });
    drop(observe);
    signals::remark(signals::NO_RESULT);
    let tally = tally?;
    style.warnings(&tally.warnings);
    for failed in &tally.failures.named {
        let runs = if failed.runs == 1 {
            String::new()
        } else {
            format!(" and {}", counted(index(failed.runs - 1), "more run"))
        };
        style.complaint(&format!("run {}{runs} ({}): {}", failed.id, failed.motor, failed.message));
    }
    if tally.failures.others > 0 {
        let have = if tally.failures.others == 1 { "has" } else { "have" };
        style.complaint(&format!("{} {have} no result", counted(index(tally.failures.others), "more run")));
    }
    if let Some(fault) = &tally.fault {
        style.error(fault);
        if tally.lost > 0 {
            style.complaint(&format!(
                "{} could not be written and will be repeated",
                counted(index(tally.lost), "finished run")
            ));
        }
    }
    Ok(tally)
}

fn ended(tally: &Tally, strict: Strict) -> Outcome {
    if tally.interrupted {
        Outcome::Interrupted
    } else if tally.failed > 0 || tally.fault.is_some() || tally.before + tally.finished < tally.total {
        Outcome::Incomplete
    } else {
        trusted(&tally.trust, strict)
    }
}

fn tally_text(shard: Shard, tally: &Tally) -> String {
    let mut text = String::new();
    if shard.count > 1 {
        let _ = write!(text, "shard {}/{}: ", shard.index, shard.count);
    }
    let _ = write!(text, "{} of {} finished", tally.before + tally.finished, counted(index(tally.total), "run"));
    if tally.finished > 0 {
        let rate = count_u64(tally.finished) / tally.seconds;
        let seconds = engineering(tally.seconds, "s", 3);
        let _ = write!(text, ", {} now in {seconds}, {} per second", tally.finished, significant(rate, 3));
    }
    if tally.failed > 0 {
        let _ = write!(text, "; {} without a result", tally.failed);
    }
    if tally.trust.is_known() {
        let _ = write!(text, "; trust: {}", level_text(&tally.trust));
    }
    if let Some(device) = &tally.device {
        let _ = write!(text, "\non {}", printable(&device.to_string()));
    }
    if tally.interrupted {
        text.push_str("\ninterrupted: finished runs are kept; run the command again to continue");
    }
    text + "\n"
}

fn status_text(status: &SweepStatus) -> String {
    let mut text =
        format!("{}: {} of {} finished", printable(&status.name), status.done, counted(index(status.runs), "run"));
    if status.failed > 0 {
        let _ = write!(text, ", {} without a result", status.failed);
    }
    text.push_str(if status.merged { "; merged\n" } else { "\n" });
    for shard in &status.shards {
        let running = if shard.running { ", running" } else { "" };
        let failed = if shard.failed > 0 { format!(", {} without a result", shard.failed) } else { String::new() };
        let _ = writeln!(
            text,
            "  shard {}/{}: {} finished{failed}{running}",
            shard.shard.index, shard.shard.count, shard.done
        );
    }
    text
}

/// Outputs of merged results, whose paths are checked before the runs start.
struct Show<'a> {
    /// True if the page has its script.
    has_script: bool,
    limits: Limits,
    out: Option<Out>,
    parquet: Option<&'a Path>,
    /// File of the motors as CSV.
    csv: Option<&'a Path>,
    /// True if motors outside the limits make the exit code 6.
    strict_limits: bool,
    json: bool,
}

impl<'a> Show<'a> {
    fn new(shown: &'a Shown, report: Option<&Path>, json: bool) -> Result<Self> {
        let parquet = shown.parquet.as_deref();
        if let Some(path) = parquet {
            check_parquet(path)?;
        }
        let limits = Limits::parse(&shown.limits)?;
        let (csv, strict_limits) = (shown.csv.as_deref(), shown.strict_limits);
        if json && csv.is_some_and(stdio::is_stdio) {
            let message = "--csv - and --json both write to stdout";
            return Err(Error::usage(message, "Name a file with --csv."));
        }
        Ok(Self {
            limits,
            out: report.map(Out::take).transpose()?,
            parquet,
            csv,
            strict_limits,
            json,
            has_script: !shown.page.no_script,
        })
    }

    /// Checks that there are limits for `--strict-limits`.
    fn check(&self, sweep: &Sweep) -> Result<()> {
        if sweep.limits_or_own(self.limits.clone())?.is_empty() && self.strict_limits {
            let message = "--strict-limits has no limits";
            return Err(Error::usage(message, "Give --limits, or the key limits in the study."));
        }
        Ok(())
    }
}

/// Checks a path for Parquet. Only an existing Parquet file may be replaced, never a manifest, results or a recording.
fn check_parquet(path: &Path) -> Result<()> {
    if cfg!(not(feature = "parquet")) {
        let message = "this build cannot write Parquet";
        return Err(Error::usage(
            message,
            "Build with the feature parquet, or use results.jsonl, which has the same data.",
        ));
    }
    let mut head = [0; 4];
    let file = std::fs::File::open(path);
    if path.exists() && !file.is_ok_and(|mut file| file.read_exact(&mut head).is_ok() && head == *b"PAR1") {
        let message = "exists and is not Parquet; it is left unchanged";
        return Err(Error::data(message, "Name a new file with --parquet.").in_file(path));
    }
    Ok(())
}

fn merge(sweep: &Sweep, outputs: Show<'_>, strict: Strict, style: &Style) -> Result<Outcome> {
    outputs.check(sweep)?;
    let Show { limits, out, parquet: wanted, csv, strict_limits, json: as_json, has_script } = outputs;
    let limits = sweep.limits_or_own(limits)?;
    let Merged { results, summary, damaged } = sweep.merge()?;
    if damaged > 0 && summary.missing > 0 {
        let are = if damaged == 1 { "is" } else { "are" };
        style.complaint(&format!("{} of the results {are} damaged", counted(index(damaged), "line")));
    }
    if summary.missing > 0 {
        let are = if summary.missing == 1 { "is" } else { "are" };
        style.complaint(&format!(
            "{} of {} {are} missing: run the sweep again, then merge",
            summary.missing,
            counted(index(summary.runs), "run")
        ));
    }
    if let Some(path) = wanted {
        #[cfg(feature = "parquet")]
        write_parquet(&results, &summary, path)?;
        style.note(&format!("wrote {}", path.display()));
    }
    style.note(&format!("wrote {}", results.display()));
    let document = json(&sweep_document(&summary, &limits));
    if let Some(path) = csv {
        out::write_file(path, &motors_csv(&summary, &limits))?;
        if !stdio::is_stdio(path) {
            style.note(&format!("wrote {}", path.display()));
        }
    }
    let tables = sweep_tables(&summary, &limits);
    if as_json {
        data(&document)?;
    } else if !csv.is_some_and(stdio::is_stdio) {
        let answer = printable(&sweep_answer(&summary, &limits));
        let mut text = format!("{STRONG}{}{STRONG:#}: {answer}\n", printable(&summary.name));
        for table in &tables {
            let _ = write!(text, "\n{}", shortened(table, ROWS).text(terminal::table_width(WIDTH)));
        }
        show(&text)?;
    }
    if let Some(out) = out {
        let how = out::reproduced(vec![
            ("study", sweep.manifest().path.clone()),
            ("sweep", sweep.folder().display().to_string()),
        ]);
        let mut files = vec![("report.html".to_owned(), sweep_page(&summary, &limits, &how).html(has_script))];
        files.push(("result.json".to_owned(), document));
        files.extend(tables.iter().map(|table| (format!("table-{}.csv", table.id), table.csv())));
        files.push(("motors.csv".to_owned(), motors_csv(&summary, &limits)));
        out.write(&files, style)?;
    }
    Ok(match trusted(&summary.trust.levels, strict) {
        _ if strict_limits && !all_within_limits(&summary, &limits) => Outcome::OutsideLimits,
        _ if !summary.is_complete() => Outcome::Incomplete,
        outcome => outcome,
    })
}
