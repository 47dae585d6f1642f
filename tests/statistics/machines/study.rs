//! A study of a model over many machines: shares, their limits, and a printed summary.

use crate::machines::draw::{Machine, Numbers};
use crate::machines::judge::{Compared, Judged, judged};
use crate::support::rates::cases;
use motorfit::identify::TrustLevel;
use motorfit::model::BuiltIn;
use motorfit::numeric::{mean, median, peak, rms, sorted};

/// Limits of the shares of a study. Three standard deviations of a binomial distribution are added to each.
pub struct Limits {
    /// Numbers of the machines without `MOTORFIT_FULL`.
    pub machines: std::ops::Range<u64>,
    /// Smallest share of machines whose optimum is reached.
    pub reached: f64,
    /// Smallest share of machines with the level good.
    pub good: f64,
    /// Smallest and largest share of 95 % intervals of reached optima that contain the truth.
    pub coverage: [f64; 2],
    /// Largest relative errors of parameters.
    pub errors: &'static [(&'static str, f64)],
}

/// Smallest coverage of the intervals of results with the level good.
const CERTIFIED: f64 = 0.93;
/// Largest error of a parameter of a result with the level good, in standard errors. Among 5000 errors of a normal distribution one is
/// larger with a probability of 0.3 %.
const LARGEST: f64 = 5.0;

/// Returns the number of true values and that of all.
fn counted(values: impl Iterator<Item = bool>) -> (f64, f64) {
    values.fold((0.0, 0.0), |(is_true, all), value| (is_true + f64::from(u8::from(value)), all + 1.0))
}

/// Returns three standard deviations of a share of `n` that is expected to be `p`.
fn margin(p: f64, n: f64) -> f64 {
    3.0 * (p * (1.0 - p) / n.max(1.0)).sqrt()
}

fn covered<'a>(of: impl Iterator<Item = &'a Judged>) -> (f64, f64) {
    counted(of.flat_map(|judged| &judged.parameters).filter_map(|of| of.is_covered))
}

/// Simulates and identifies machines of a model, prints a line for each and a summary, and checks the limits.
pub fn judge(of: BuiltIn, draw: fn(&mut Numbers) -> Machine, limits: &Limits) {
    let name = of.name();
    let mut all = Vec::new();
    for machine in cases(limits.machines.clone(), 0..30) {
        let judged = judged(of, draw, machine);
        println!("{name} {judged}");
        all.push(judged);
    }
    summary(name, &all);
    let is_good = |judged: &&Judged| judged.level == TrustLevel::Good;
    // No wrong estimate is certified.
    for judged in all.iter().filter(is_good) {
        for Compared { name: parameter, deviations, .. } in &judged.parameters {
            let off = deviations.unwrap().abs();
            assert!(off < LARGEST, "{name} {}: good, but {parameter} is off by {off} standard errors", judged.machine);
        }
    }
    let (inside, intervals) = covered(all.iter().filter(is_good));
    // Parameters that scale together, such as a torque constant with inertia and friction, are inside or outside together: half of the
    // intervals of a machine count as independent.
    let least = (CERTIFIED - margin(CERTIFIED, intervals / 2.0)) * intervals;
    assert!(inside >= least, "{name}: {inside} of {intervals} intervals of results with the level good");
    let (good, machines) = counted(all.iter().map(|judged| judged.level == TrustLevel::Good));
    assert!(good >= (limits.good - margin(limits.good, machines)) * machines, "{name}: {good} of {machines} good");
    let (reached, machines) = counted(all.iter().map(|judged| judged.is_reached));
    let least = (limits.reached - margin(limits.reached, machines)) * machines;
    assert!(reached >= least, "{name}: {reached} of {machines} optima reached");
    let (inside, intervals) = covered(all.iter().filter(|judged| judged.is_reached));
    let [least, most] = limits.coverage;
    let range = [least - margin(least, intervals), most + margin(most, intervals)];
    let share = inside / intervals;
    assert!((range[0]..=range[1]).contains(&share), "{name}: {share} of {intervals} intervals cover, not {range:?}");
    for (parameter, largest) in limits.errors {
        for judged in &all {
            let of = judged.parameters.iter().find(|of| of.name == *parameter).unwrap();
            let error = of.error.unwrap().abs();
            assert!(error < *largest, "{name} {}: {parameter} is off by {error}", judged.machine);
        }
    }
}

fn summary(name: &str, all: &[Judged]) {
    let (reached, machines) = counted(all.iter().map(|judged| judged.is_reached));
    let percent = |(inside, all): (f64, f64)| format!("{:.1} % of {all}", 100.0 * inside / f64::max(all, 1.0));
    let of_reached = percent(covered(all.iter().filter(|judged| judged.is_reached)));
    let missing = all.iter().flat_map(|judged| &judged.parameters).filter(|of| of.is_covered.is_none()).count();
    let levels = [TrustLevel::Good, TrustLevel::Check, TrustLevel::Poor].map(|level| {
        let (of_level, _) = counted(all.iter().map(|judged| judged.level == level));
        format!("{} {of_level} ({})", level.name(), percent(covered(all.iter().filter(|judged| judged.level == level))))
    });
    let seconds: Vec<f64> = all.iter().map(|judged| judged.seconds).collect();
    println!(
        "{name}: reached {reached} of {machines}; covered {}, {of_reached} of reached, {missing} without an interval; {}; \
         median {:.1} s, largest {:.1} s",
        percent(covered(all.iter())),
        levels.join(", "),
        median(&sorted(&seconds)),
        peak(&seconds)
    );
    for number in 0..all[0].parameters.len() {
        let of = || all.iter().filter(|judged| judged.is_reached).map(move |judged| &judged.parameters[number]);
        let deviations: Vec<f64> = of().filter_map(|of| of.deviations).collect();
        let errors: Vec<f64> = all.iter().filter_map(|judged| judged.parameters[number].error).collect();
        println!(
            "{name} {}: covered {}, errors of mean {:.2} σ and root mean square {:.2} σ, largest {:.1} σ; median {:.2} %, largest {:.2} %",
            all[0].parameters[number].name,
            percent(counted(of().filter_map(|of| of.is_covered))),
            mean(&deviations),
            rms(&deviations),
            peak(&deviations),
            100.0 * median(&sorted(&errors.iter().map(|error| error.abs()).collect::<Vec<_>>())),
            100.0 * peak(&errors)
        );
    }
}
