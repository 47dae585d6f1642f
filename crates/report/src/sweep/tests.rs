//! Tests that the tables, the page and the document of synthetic sweeps have the results that were put in.

use super::sample::{how, line, product};
use super::words::grouped;
use super::{motors_csv, shortened, sweep_answer, sweep_document, sweep_page, sweep_tables};
use crate::table::Table;
use motorfit_study::sweep::{LevelCounts, Limits, TrustCounts};

fn table<'a>(tables: &'a [Table], id: &str) -> &'a Table {
    tables.iter().find(|table| table.id == id).unwrap()
}

#[test]
fn tables_are_whole_and_fit_the_terminal_when_shortened() {
    let (line, limits) = line();
    for (summary, limits) in [(&line, &limits), (&product(12), &Limits::default()), (&product(60), &limits)] {
        for table in sweep_tables(summary, limits) {
            assert!(table.rows.iter().all(|row| row.len() == table.heads.len()), "{}", table.id);
            let text = shortened(&table, 20).text(80);
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
            assert!(text.lines().count() <= 20 + 8, "{text}");
        }
    }
    let many = sweep_tables(&product(60), &Limits::default());
    let short = shortened(table(&many, "cost"), 20);
    assert_eq!((table(&many, "cost").rows.len(), short.rows.len()), (60, 20));
    assert!(short.notes.iter().any(|note| note.starts_with("40 more")), "{:?}", short.notes);
}

#[test]
fn motors_outside_limits_are_listed_by_excess() {
    let (summary, limits) = line();
    let tables = sweep_tables(&summary, &limits);
    let outside = table(&tables, "outside");
    let motors: Vec<&str> = outside.rows.iter().map(|row| row[0].rsplit('-').next().unwrap()).collect();
    assert_eq!(motors[0], "0080", "an inductance of two and a half times the usual");
    let mut sorted = motors.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, ["0017", "0080", "0081", "0200", "0299"]);
    assert!(outside.rows[0][1].starts_with("L [mH]") && outside.rows[0][4].starts_with("≤ 8.5349"), "{outside:?}");
    let limits_table = table(&tables, "limits");
    let counts = |n: usize| -> usize { limits_table.rows.iter().map(|row| row[n].parse::<usize>().unwrap()).sum() };
    assert_eq!((counts(3), counts(5)), (4 * 300 - 5, 5));
    assert!(counts(4) <= counts(3));
    assert_eq!(
        sweep_answer(&summary, &limits),
        "300 of 302 motors identified; 5 are outside the limits; 2 motors were not tested."
    );
    assert!(sweep_answer(&summary, &Limits::default()).ends_with("identified."));
    let csv = motors_csv(&summary, &limits);
    let line = |motor: &str| csv.lines().find(|line| line.contains(motor)).unwrap().to_owned();
    assert_eq!(csv.lines().count(), 1 + 302, "motors with and without a result");
    assert!(
        line("motor-0080").contains(",L,98.1,99.7,") && line("motor-0001").contains(",,98.1,99.7,"),
        "{}",
        line("motor-0080")
    );
    assert!(
        line("motor-0301").ends_with(",the motor does not move: nothing can be identified"),
        "{}",
        line("motor-0301")
    );
    let document = sweep_document(&summary, &limits);
    assert_eq!(document["outside"].as_array().unwrap().len(), 5);
    assert_eq!((&document["outside"][0]["id"], &document["outside"][0]["parameter"]), (&80.into(), &"L".into()));
    assert_eq!(document["motors"]["parameters"]["R"]["outside"], 2);
    assert!(document["motors"]["parameters"]["B"]["outside"].is_null(), "without limits nothing is outside");
}

#[test]
fn cells_come_in_the_order_of_the_study_with_their_quantiles() {
    let summary = product(12);
    let tables = sweep_tables(&summary, &Limits::default());
    let cost = table(&tables, "cost");
    assert_eq!(cost.heads[..3], ["method", "noise", "runs"]);
    assert_eq!(cost.rows[0][..3], ["gwo", "none", "200"]);
    assert_eq!(cost.rows[11][..2], ["random", "80dB"]);
    let document = sweep_document(&summary, &Limits::default());
    let cells = document["blocks"][0]["cells"].as_array().unwrap();
    assert_eq!((cells.len(), &cells[4]["noise"]), (12, &"85dB".into()));
    let q = &cells[7]["cost"];
    let order = ["min", "q05", "q25", "median", "q75", "q95", "max"].map(|name| q[name].as_f64().unwrap());
    assert!(order.is_sorted(), "{order:?}");
    assert!(table(&tables, "cost").notes[0].contains("gwo, noise none"), "{:?}", cost.notes);
}

#[test]
fn results_are_counted_by_their_level_of_trust() {
    let counts = |good, check, poor, reasons: &[(&str, u64)]| TrustCounts {
        levels: LevelCounts { good, check, poor, unknown: 0 },
        reasons: reasons.iter().map(|(code, runs)| ((*code).to_owned(), *runs)).collect(),
    };
    let mut summary = product(12);
    assert!(sweep_tables(&summary, &Limits::default()).iter().all(|table| table.id != "trust"), "none has a level");
    assert!(sweep_document(&summary, &Limits::default())["trust"].is_null());
    let cells = &mut summary.blocks[0].cells;
    cells.iter_mut().for_each(|cell| cell.trust = counts(200, 0, 0, &[]));
    summary.trust = counts(2400, 0, 0, &[]);
    assert!(sweep_tables(&summary, &Limits::default()).iter().all(|table| table.id != "trust"), "all are good");
    assert!(sweep_answer(&summary, &Limits::default()).contains(" results: good."));
    let codes = [("at_bound", 2), ("few_samples", 1), ("residuals", 9), ("search_stuck", 5)];
    summary.blocks[0].cells[3].trust = counts(185, 10, 5, &codes);
    summary.trust = counts(2385, 10, 5, &codes);
    let tables = sweep_tables(&summary, &Limits::default());
    let trust = table(&tables, "trust");
    assert_eq!(trust.heads, ["method", "noise", "good", "check", "poor", "commonest reasons"]);
    assert_eq!(trust.rows[2][2..], ["200", "0", "0", "none"]);
    assert_eq!(trust.rows[3][2..], ["185", "10", "5", "residuals 9, search_stuck 5, at_bound 2, …"]);
    let answer = sweep_answer(&summary, &Limits::default());
    assert!(answer.contains(" Trust in the results: 2,385 good, 10 to be checked, 5 poor. Lowest"), "{answer}");
    let page = sweep_page(&summary, &Limits::default(), &how()).html(true);
    assert!(page.contains("5 of 2,400 runs have a poor level of trust") && page.contains("search_stuck 5"));
    let document = sweep_document(&summary, &Limits::default());
    let cell = &document["blocks"][0]["cells"][3]["trust"];
    assert_eq!((&document["trust"]["poor"], &cell["check"], &cell["good"]), (&5.into(), &10.into(), &185.into()));
    assert_eq!(cell["reasons"][0], serde_json::json!({"code": "residuals", "runs": 9}));
    assert!(cell.get("unknown").is_none() && cell["reasons"][3]["code"] == "few_samples");
    // Results of an earlier version beside others.
    summary.blocks[0].cells[3].trust.levels.unknown = 7;
    let tables = sweep_tables(&summary, &Limits::default());
    assert_eq!(table(&tables, "trust").heads[5], "unknown");
}

#[test]
fn the_page_escapes_names_from_files_and_warns() {
    let (mut summary, limits) = line();
    let evil = "<img src=x onerror=alert(1)>\u{202e}";
    summary.results[80].motor = evil.to_owned();
    summary.blocks[0].worst[0].motor = evil.to_owned();
    summary.failures.named[0].message = evil.to_owned();
    summary.blocks[0].cells[0].noise = evil.to_owned();
    summary.varied = vec!["noise"];
    summary.name = evil.to_owned();
    (summary.missing, summary.taken_over) = (1, 2);
    let page = sweep_page(&summary, &limits, &how()).html(true);
    assert!(!page.contains("<img") && !page.contains('\u{202e}') && page.contains("&lt;img"));
    assert!(page.matches("class=\"warning\"").count() == 3, "failed, missing, taken over");
    assert!(page.contains("1 of 302 runs is not finished") && page.contains("2 of 302 runs have no result"));
    let mut cells = product(2);
    cells.blocks[0].cells[1].noise = evil.to_owned();
    let page = sweep_page(&cells, &Limits::default(), &how()).html(true);
    assert!(!page.contains("<img") && !page.contains('\u{202e}') && page.contains("&lt;img"));
}

#[test]
fn a_sweep_without_results_is_a_page_too() {
    let (mut summary, limits) = line();
    summary.results.clear();
    let cell = &mut summary.blocks[0].cells[0];
    (cell.costs, cell.parameters, cell.failed) = (Vec::new(), Default::default(), 300);
    (summary.failed, summary.blocks[0].worst) = (302, Vec::new());
    assert_eq!(sweep_answer(&summary, &limits), "0 of 302 motors identified.");
    assert!(sweep_page(&summary, &limits, &how()).html(true).contains("302 of 302 runs have no result"));
    assert!(sweep_document(&summary, &limits)["blocks"][0]["cells"][0]["cost"]["median"].is_null());
    summary.blocks.clear();
    assert!(!sweep_page(&summary, &limits, &how()).html(true).contains("NaN"));
}

#[test]
fn counts_are_grouped() {
    assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
}
