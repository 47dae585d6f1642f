//! Fit of the held-out recordings beside that of the fitted ones.

use super::figures::response_charts;
use super::identified::{noise_floor_text, verdicts};
use super::page::Part;
use super::recorded::Recorded;
use super::table::{Table, dash};
use motorfit_core::text::{decimals, significant};
use motorfit_identify::Identification;
use motorfit_identify::analysis::{HeldOut, ResidualTests, Validation};

const HEADS: [&str; 7] = [
    "recordings",
    "current [%]",
    "speed [%]",
    "residual σ [A, rad/s]",
    "white",
    "independent of the voltage",
    "estimated",
];

/// Returns the table of fits and a figure for each held-out recording.
pub(super) fn held_out(found: &Identification, validation: &Validation) -> Vec<Part> {
    let plots = |(n, held): (usize, &HeldOut)| {
        let recorded = Recorded::from(&held.record);
        response_charts(&format!("held-out-{n}"), &recorded, &[("model", &held.simulated)], &[]).map(Part::Chart)
    };
    let plots = (1..).zip(&validation.held_out).flat_map(plots);
    std::iter::once(Part::Table(table(found, validation))).chain(plots).collect()
}

fn table(found: &Identification, validation: &Validation) -> Table {
    let mut table = Table::new("held-out", "Fit of the fitted and the held-out recordings", &HEADS);
    let mut row = |name: String, fit: &[Option<f64>], sigma: &[Option<f64>], tests: &[ResidualTests], own| {
        let mut cells = vec![name];
        cells.extend(fit.iter().map(|f| f.map_or_else(dash, |f| decimals(f, 2))));
        cells.push(sigma.iter().map(|s| s.map_or_else(dash, |s| significant(s, 3))).collect::<Vec<_>>().join(", "));
        let tested = if tests.is_empty() { Default::default() } else { verdicts(tests, 2) };
        cells.extend(tested.map(|verdicts| verdicts.join(", ")));
        cells.push(own);
        table.row(cells);
    };
    let held = &validation.held_out;
    row("fitted".to_owned(), &found.fit_percent, &found.residual_sigma, &found.residual_tests, String::new());
    let tests: Vec<ResidualTests> = held.iter().map(|held| held.residual_tests.clone()).collect();
    let (several, single) = if let [one] = &held[..] { (&[][..], own(one)) } else { (&held[..], String::new()) };
    row("held out".to_owned(), &validation.fit_percent, &validation.residual_sigma, &tests, single);
    for (n, held) in (1..).zip(several) {
        row(
            name_of(n, held),
            &held.fit_percent,
            &held.residual_sigma,
            std::slice::from_ref(&held.residual_tests),
            own(held),
        );
    }
    if let Some(of) = &found.noise_floor {
        row("noise floor".to_owned(), &of.best_achievable_percent, &of.sigma, &[], String::new());
    }
    table.note(
        "Held-out recordings are simulated with the estimated parameters. The last column lists the quantities that are \
         estimated from the held-out recording: its initial state if it begins in motion, and parameters that each \
         recording has of its own. White and independent of the voltage are the verdicts on the residuals of current and \
         speed; the residuals of an adequate model are both.",
    );
    if let Some(of) = &found.noise_floor {
        table.note(format!("Noise floor: {}.", noise_floor_text(of)));
    }
    table
}

/// Lists the quantities that are estimated from the held-out recording itself.
fn own(held: &HeldOut) -> String {
    let initial = held.initial_is_estimated.then(|| "initial state".to_owned());
    let values = held.own.iter().map(|(p, v)| format!("{} = {} {}", p.symbol(), significant(*v, 3), p.unit()));
    initial.into_iter().chain(values).collect::<Vec<_>>().join(", ")
}

fn name_of(n: usize, held: &HeldOut) -> String {
    let source = held.record.source();
    let name = source.path.as_ref().map_or_else(|| format!("recording {n}"), |path| path.display().to_string());
    source.part.iter().fold(name, |name, part| format!("{name} ({part})"))
}
