//! Calls of `report` with inconsistent results.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, records, signals, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use crate::hostile::drivers::files::paths;
use crate::hostile::drivers::identify::{fitted, mangled};
use crate::hostile::drivers::study::{benchmarks, comparisons};
use crate::hostile::drivers::sweep::summaries;
use motorfit::Error;
use motorfit::analysis::NoiseFloor;
use motorfit::identify::{BatchCosts, Identifiability, Identification, IdentifySpec, Inspection, SelectionStep};
use motorfit::motor::{Discretization, Parameters};
use motorfit::report::sweep as of_sweep;
use motorfit::report::{
    AxisScale, Band, Card, Chart, EvaluateDocument, ExportedParameter, Figure, Form, Item, Map, Mark, Page, Panel,
    Part, Recorded, Reproduced, Requested, ResidualRow, Section, Series, Shown, SignalFacts, Table, Trust,
    bench_document, characteristics_lines, columns_csv, command_line, compare, compare_page, compare_parts, curves_csv,
    devices_document, estimate_rows, figures, folded, heat_map, html_fragment, identify_document, identify_page,
    identify_parts, inspect_document, inspect_page, json, noise_floor_text, plain_text, record_figure, residual_panels,
    selection_table, selection_text, signals_csv, verdict, verdicts,
};
use motorfit::setting::{Command, Reference, Setting};
use motorfit::study::ThroughputSpec;
use motorfit::study::sweep::{Limits, Shard, SweepStatus, Tally};

fn how(word: &str) -> Reproduced {
    Reproduced { command: word.to_owned(), options: vec![(word.to_owned(), word.to_owned())] }
}

/// Renders a page whose every text is `word`.
fn whole_page(calls: &mut Calls, word: &str, parts: &[Part]) {
    let text = || word.to_owned();
    let sections = [true, false].map(|is_folded| Section { heading: text(), parts: parts.to_vec(), is_folded });
    let card = Card { symbol: text(), name: text(), value: text(), unit: text(), remark: text() };
    let trust = Some(Trust { level: "", text: text() });
    let page = Page { title: text(), trust, cards: vec![card], answer: text(), sections: sections.to_vec() };
    drive!(calls, word; "report::Page::html" => [page.html(true), page.html(false)]);
}

pub fn words(calls: &mut Calls) {
    for word in texts() {
        let mut table = Table::new(word.clone(), word.clone(), &[&word, &word]);
        let item =
            Item { name: word.clone(), grave: true, text: word.clone(), details: vec![(word.clone(), word.clone())] };
        let figure = Figure {
            id: word.clone(),
            svg: format!("<svg {word}>"),
            alternative: word.clone(),
            caption: word.clone(),
            map: true,
        };
        drive!(calls, word;
            "report::Table::new" => Table::new("", "", &[""; 0]).csv(),
            "report::Table::note" => table.note(word.clone()),
            "report::Table::row" => table.row([word.clone()]),
            "report::Table::row" => table.row(vec![word.clone(); 5]),
            "report::Table::csv" => table.csv(),
            "report::Figure::scaled" => (figure.scaled(&word), Figure { svg: word.clone(), ..figure.clone() }.scaled("")),
            "report::command_line" => [Setting::Columns, Setting::Out].map(|setting| command_line(&setting.to(word.clone()))),
            "report::json" => json(&serde_json::json!({ word.clone(): word })),
        );
        for width in COUNTS {
            drive!(calls, (&word, width); "report::folded" => folded(&word, width));
        }
        let parts = vec![
            Part::Text(word.clone()),
            Part::Warning(word.clone()),
            Part::Table(table.clone()),
            Part::Figure(figure),
            Part::List(vec![(word.clone(), word.clone())]),
            Part::Typed(word.clone()),
            Part::Items(vec![item]),
        ];
        fragments(calls, &word, &parts);
        whole_page(calls, &word, &parts);
        // Aligning columns of 65,536 characters takes seconds and tests no more than 300.
        if word.len() < 1000 {
            for n in COUNTS {
                drive!(calls, (&word, n);
                    "report::Table::text" => table.text(n),
                    "report::sweep::shortened" => of_sweep::shortened(&table, n).rows.len(),
                );
            }
        }
    }
    drive!(calls, ();
        "report::Page::html" => Page::default().html(true),
        "report::devices_document" => COUNTS.map(devices_document),
        "report::command_line" => command_line(&Reference::Command(Command::PlanSweep)),
    );
    for value in NUMBERS {
        drive!(calls, value; "report::columns_csv" => columns_csv(&["a,b".to_owned()], &[vec![value; 2], Vec::new()]));
        drive!(calls, value; "report::json" => json(&serde_json::json!([value, null])));
        let floor = NoiseFloor {
            groups: vec![vec![usize::MAX], vec![]],
            samples: vec![],
            best_achievable_percent: [Some(value), None],
            sigma: [Some(value); 2],
        };
        drive!(calls, value; "report::noise_floor_text" => noise_floor_text(&floor));
        selections(calls, value);
    }
    drive!(calls, "none"; "report::selection_table" => selection_table(&fitted()), "report::verdicts" => verdicts(&[], 2));
}

/// Drives the table of a selection whose fit is `value`.
fn selections(calls: &mut Calls, value: f64) {
    let taken = SelectionStep {
        with: vec!["\0".to_owned(); 9],
        free: usize::MAX,
        fit_percent: vec![Some(value)],
        gain: Some(value),
        taken: true,
    };
    let mut found = fitted();
    found.selection = Some(vec![taken.clone(), taken]);
    drive!(calls, value; "report::selection_table" => selection_table(&found));
}

fn fragments(calls: &mut Calls, word: &str, parts: &[Part]) {
    drive!(calls, word; "report::html_fragment" => html_fragment(parts));
    // Aligning columns takes as long as in `words`.
    if word.len() < 1000 {
        for n in COUNTS {
            drive!(calls, (word, n); "report::plain_text" => plain_text(parts, n));
        }
    }
}

pub fn plots(calls: &mut Calls) {
    for values in signals().into_iter().chain([vec![f64::MIN, f64::MAX], vec![1.0, f64::NAN, 2.0]]) {
        let points: Vec<(f64, f64)> = values.iter().copied().zip(values.iter().rev().copied()).collect();
        let forms = [Form::Line, Form::Steps, Form::Dots, Form::Marks, Form::Stems, Form::Bars, Form::Box];
        let scales = [AxisScale::Linear, AxisScale::Log, AxisScale::Rows(vec!["\u{1b}".to_owned(), String::new()])];
        for (n, form) in forms.into_iter().enumerate() {
            for band in FEW {
                let series =
                    calls.call("report::Series::new", &values, || Series::new("<", 9, form, points.clone())).unwrap();
                let bands = [Band::None, Band::Half(band), Band::Between(vec![[band, -band]; 2])];
                let with = bands[n % 3].clone();
                let series = calls.call("report::Series::with_band", &band, || series.with_band(with)).unwrap();
                let panel = calls
                    .call("report::Panel::new", &values, || Panel::new("\0", vec![series.clone(), series]))
                    .unwrap();
                let panel = Panel {
                    axis: (band > 0.0).then(|| "\u{202e}".to_owned()),
                    scales: [scales[n % 2].clone(), scales[(n + usize::from(band < 0.0)) % 3].clone()],
                    limits: [vec![-band], vec![band, f64::NAN]],
                    marks: vec![Mark { range: [band, -band], label: "\u{202e}".to_owned() }],
                    ..panel
                };
                drive!(calls, (&values, band); "report::Panel::within" => panel.within([band, f64::NAN]));
                let chart = Chart {
                    axis: "\0".to_owned(),
                    panels: vec![panel.clone(), panel],
                    is_grid: band > 0.0,
                    ..Chart::default()
                };
                let figure = calls.call("report::Chart::figure", &band, || chart.figure()).unwrap();
                drive!(calls, (&values, band);
                    "report::Figure::file" => [figure.file("", true), figure.file("class=\"a\"", false)]);
                let sections =
                    vec![Section { heading: String::new(), parts: vec![Part::Chart(chart)], is_folded: false }];
                drive!(calls, (&values, band); "report::Page::html" => Page { sections, ..Page::default() }.html(true));
            }
        }
        let square = values.chunks(5).take(5).map(<[f64]>::to_vec).collect::<Vec<_>>();
        let (low, high) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(1.0));
        for rows in [vec![], vec![vec![]], square, vec![vec![1.0, 2.0], vec![3.0]]] {
            for ranges in [[[0.0, 1.0]; 2], [[low, high]; 2], [[1.0, 1.0]; 2], [[1.0, 0.0]; 2]] {
                let map = Map {
                    title: "",
                    labels: ["\0", ">"],
                    ranges,
                    values: rows.clone(),
                    mark: [low, high],
                    curve: points.iter().copied().take(50).collect(),
                };
                drive!(calls, (&rows, ranges, low, high); "report::heat_map" => heat_map(&map));
            }
        }
    }
}

/// Drives the interface of the machine of a result for documents and pages.
pub fn of_shown<M: Shown>(calls: &mut Calls, shown: &str, (spec, found): (&M::Spec, &Identification<M>)) {
    drive!(calls, shown;
        "report::estimate_rows" => estimate_rows(found).len(),
        "report::EstimateRow::is_list" => estimate_rows(found).iter().filter(|row| row.is_list()).count(),
        "report::Shown::requested" => M::requested(spec),
        "report::Shown::named" => M::named(found),
        "report::Shown::settings" => M::settings(spec),
        "report::Shown::hold" => M::hold(found),
        "report::Shown::at_start" => [0, usize::MAX].map(|n| M::at_start(found, n).is_some()),
        "report::Shown::held_out_percent" => M::held_out_percent(found).is_some(),
        "report::Shown::curves" => M::curves(found, &[], &[]),
        "report::Shown::note" => M::note(found),
        "report::Shown::sections" => M::sections(found).len(),
        "report::ExportedParameter::from" => found.estimates.iter().map(ExportedParameter::from).count(),
    );
}

pub fn identified(calls: &mut Calls) {
    let spec = IdentifySpec::default();
    let all = [vec![], vec![step(200)], vec![step(30), step(40)]];
    for found in mangled(&fitted()) {
        let shown = format!("{:?} {:?} {:?}", found.values, found.parameters, found.uncertainty);
        drive!(calls, shown;
            "report::characteristics_lines" => characteristics_lines(&found),
            "report::figures::correlations" => figures::correlations(&found).is_some(),
            "report::figures::history" => figures::history(&found, &Requested::from(&spec)).is_some(),
            "report::identify_parts" => identify_parts(&spec, &found, command_line).len(),
            "report::selection_text" => selection_text(&found),
            "report::verdicts" => (verdicts(&found.residual_tests, 2), verdicts(&found.residual_tests, 0)),
            "report::verdict" => verdict(&found),
            "report::Requested::from" => Requested::from(&spec),
        );
        of_shown(calls, &shown, (&spec, &found));
        for records in &all {
            drive!(calls, (records.len(), &shown);
                "report::curves_csv" => curves_csv(records, &found),
                "report::identify_document" => identify_document(records, &spec, &found),
                "report::signals_csv" => signals_csv((records, &[]), &found),
                "report::identify_page" => {
                    let recorded: Vec<Recorded> = records.iter().map(Recorded::from).collect();
                    identify_page((records, &recorded), &spec, &found, &how("\0")).html(true)
                },
            );
        }
    }
    for record in records() {
        for (value, method) in FEW.into_iter().zip(Discretization::ALL.into_iter().cycle()) {
            let parameters = Parameters { r: value, l: 1.0, k: value, b: value, j: 1.0 };
            drive!(calls, (&record, value);
                "report::figures::model" => figures::model(&record, &parameters, [value; 2], method),
                "report::SignalFacts::of" => SignalFacts::of(&record, value),
            );
        }
        let recorded = Recorded::from(&record);
        drive!(calls, record; "report::Recorded::from" => Recorded::from(&record));
        for signals in [[vec![], vec![]], [vec![f64::NAN; 9], vec![f64::MAX; 3]]] {
            let row = ResidualRow { name: "\0", record: &record, signals: &signals };
            drive!(calls, record;
                "report::residual_panels" => [residual_panels("", &[]), residual_panels("", &[row; 2])],
                "report::figures::responses" => figures::responses("", &recorded, "\0", &signals),
                "report::figures::response_charts" => figures::response_charts("", &recorded, &[("\0", &signals[..]); 2], &[[f64::NAN, 1.0]]),
                "report::figures::residual_correlations" => figures::residual_correlations("", &recorded, &signals, &[[f64::INFINITY; 2]]),
            );
        }
        let identifiability = Identifiability::Lacks { message: "a".into(), remedy: "b".into() };
        let inspection = Inspection { record: &record, warnings: Vec::new(), identifiability };
        for (band, inspections) in
            FEW.into_iter().flat_map(|b| [(b, vec![inspection.clone()]), (b, vec![inspection.clone(); 2])])
        {
            drive!(calls, (&record, band); "report::inspect_document" => inspect_document(&inspections, band));
        }
        drive!(calls, record; "report::record_figure" => record_figure(&record));
        drive!(calls, record; "report::inspect_page" => inspect_page(&[inspection], f64::NAN, &how("")).html(true));
    }
    drive!(calls, "none";
        "report::inspect_page" => inspect_page(&[], 0.0, &how("")).html(true),
        "report::inspect_document" => inspect_document(&[], f64::NAN),
    );
    let costs = BatchCosts::new(&[step(30)], &spec).unwrap();
    for (value, size) in FEW.into_iter().flat_map(|v| [0, 1, 5, 9].map(|n| (v, n))) {
        let document = EvaluateDocument { candidates: u64::MAX, interrupted: true, seconds: value };
        let values = vec![value; size];
        drive!(calls, (value, size);
            "report::EvaluateDocument::of" => document.of(&[], &costs, [(value, &values[..])].into_iter()),
        );
    }
}

pub fn compared(calls: &mut Calls) {
    for comparison in comparisons() {
        let shown = format!("{:?} {:?}", comparison.blocks, comparison.subject.truth());
        drive!(calls, shown;
            "report::compare::compare_document" => [true, false].map(|paper| compare::compare_document(&comparison, paper)),
            "report::compare::curves" => compare::curves(&comparison),
            "report::compare::invariance" => compare::invariance(&comparison).is_some(),
            "report::compare::paper_tables" => compare::paper_tables(&comparison),
            "report::compare_parts" => compare_parts(&comparison, command_line).len(),
            "report::compare_page" => [true, false].map(|paper| compare_page(&comparison, paper, &how("")).html(true)),
        );
        for block in &comparison.blocks {
            drive!(calls, shown;
                "report::compare::setting_name" => compare::setting_name(&block.setting),
                "report::compare::tables" => compare::tables(&comparison, block),
                "report::compare::quartiles" => block.results.iter().map(compare::quartiles).collect::<Vec<_>>(),
                "report::figures::convergence" => figures::convergence("", block),
                "report::figures::distributions" => figures::distributions("\0", &comparison, block),
                "report::figures::errors" => figures::errors("", &comparison, block).is_some(),
                "report::figures::waterfall" => figures::waterfall("", block),
            );
        }
    }
    for (result, count) in benchmarks().iter().zip(COUNTS.into_iter().cycle()) {
        let spec = ThroughputSpec { populations: vec![count], samples: vec![count], budget_s: f64::NAN };
        drive!(calls, (result.contenders.len(), &result.measurements); "report::bench_document" => bench_document(&spec, result));
    }
}

pub fn swept(calls: &mut Calls) {
    let folder = tempfile::tempdir().unwrap();
    let all_limits = [
        Limits::default(),
        Limits::new(vec![("R".to_owned(), f64::NEG_INFINITY, 0.0), ("TL".to_owned(), 5e-324, f64::INFINITY)]).unwrap(),
    ];
    let summaries = summaries();
    for (summary, limits) in summaries.iter().flat_map(|s| all_limits.iter().map(move |l| (s, l))) {
        drive!(calls, (summary, limits);
            "report::sweep::motors_csv" => of_sweep::motors_csv(summary, limits),
            "report::sweep::sweep_answer" => of_sweep::sweep_answer(summary, limits),
            "report::sweep::sweep_document" => of_sweep::sweep_document(summary, limits),
            "report::sweep::sweep_page" => of_sweep::sweep_page(summary, limits, &how("")).html(true),
            "report::sweep::all_within_limits" => of_sweep::all_within_limits(summary, limits),
            "study::sweep::SweepParameter::unknown" => motorfit::study::sweep::SweepParameter::unknown(""),
            "report::sweep::sweep_parts" => of_sweep::sweep_parts(summary, limits).len(),
            "report::sweep::sweep_tables" => of_sweep::sweep_tables(summary, limits),
        );
    }
    let missing = folder.path().join("none");
    for path in paths(folder.path()).into_iter().filter(|path| !path.ends_with("pipe")).chain([missing]) {
        ask!(calls, path;
            "report::sweep::write_parquet" => of_sweep::write_parquet(&path, &summaries[0], &folder.path().join("out.parquet")),
        );
    }
    let results = folder.path().join("empty");
    std::fs::write(&results, "").unwrap();
    for path in paths(folder.path()) {
        ask!(calls, path; "report::sweep::write_parquet" => of_sweep::write_parquet(&results, &summaries[1], &path));
    }
    let tally = Tally {
        total: 0,
        before: u64::MAX,
        failed: u64::MAX,
        fault: Some(Error::usage("a", "b")),
        seconds: f64::NAN,
        ..Tally::default()
    };
    let status = SweepStatus {
        name: "\0".to_owned(),
        runs: 0,
        done: u64::MAX,
        failed: u64::MAX,
        missing: u64::MAX,
        merged: true,
        shards: Vec::new(),
    };
    drive!(calls, ();
        "report::sweep::tally_document" => of_sweep::tally_document(Shard { index: 0, count: u64::MAX }, &tally),
        "report::sweep::status_document" => of_sweep::status_document(&status),
    );
}
