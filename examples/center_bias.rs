//! Tests searches for a bias towards the centre of the box with the protocol of J. Kudela ("The Evolutionary Computation Methods No One
//! Should Use", arXiv:2301.01984, 2023): the errors on thirteen functions are compared with those on the same functions shifted by a
//! tenth of the range, towards lower values. A method is biased if the geometric mean of the errors grows more than tenfold.
//!
//! The functions are f1 to f13 of X. Yao, Y. Liu and G. Lin (IEEE Trans. Evol. Comput. 3 (1999)); f7 is without its noise.
//!
//! ```sh
//! cargo run --release --example center_bias             # 10 dimensions, 5,000 evaluations, 5 runs: seconds
//! cargo run --release --example center_bias -- full 20     # 30 dimensions, 50,000 evaluations, 20 runs, 20 repetitions: an hour
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]
#![allow(clippy::cast_precision_loss, reason = "counts are small")]

use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::optimize::{Budget, ConfiguredSearch, Run, SEARCHES, SearchSettings, minimize};
use std::f64::consts::{E, PI, TAU};
use std::ops::ControlFlow;

/// Range of each variable, and the function of a point relative to the shift.
struct Function {
    range: (f64, f64),
    cost: fn(&[f64]) -> f64,
}

/// Dimensions, evaluations and number of runs.
struct Protocol {
    dimensions: usize,
    evaluations: usize,
    runs: u64,
}

/// Error below which a function counts as solved.
const SOLVED: f64 = 1e-8;
const POPULATION: usize = 50;

fn sum(x: &[f64], of: impl Fn(f64) -> f64) -> f64 {
    x.iter().map(|x| of(*x)).sum()
}

/// The penalty of f12 and f13 for variables beyond `limit`.
fn beyond(x: &[f64], limit: f64) -> f64 {
    sum(x, |x| 100.0 * (x.abs() - limit).max(0.0).powi(4))
}

fn prefix_squares(x: &[f64]) -> f64 {
    let mut prefix = 0.0;
    let mut square = |x: &f64| {
        prefix += x;
        prefix * prefix
    };
    x.iter().map(&mut square).sum()
}

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (x[0] - 1.0).powi(2)).sum()
}

fn quartic(x: &[f64]) -> f64 {
    (1..).zip(x).map(|(n, x)| f64::from(n) * x.powi(4)).sum()
}

fn ackley(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    -20.0 * (-0.2 * (sum(x, |x| x * x) / n).sqrt()).exp() - (sum(x, |x| (TAU * x).cos()) / n).exp() + 20.0 + E
}

fn griewank(x: &[f64]) -> f64 {
    let product: f64 = (1..).zip(x).map(|(n, x)| (x / f64::from(n).sqrt()).cos()).product();
    sum(x, |x| x * x) / 4000.0 - product + 1.0
}

fn penalized(x: &[f64]) -> f64 {
    let y: Vec<f64> = x.iter().map(|x| 1.0 + (x + 1.0) / 4.0).collect();
    let between: f64 = y.windows(2).map(|y| (y[0] - 1.0).powi(2) * (1.0 + 10.0 * (PI * y[1]).sin().powi(2))).sum();
    let ends = 10.0 * (PI * y[0]).sin().powi(2) + (y[y.len() - 1] - 1.0).powi(2);
    PI / y.len() as f64 * (ends + between) + beyond(x, 10.0)
}

fn penalized_2(x: &[f64]) -> f64 {
    let last = x[x.len() - 1];
    let between: f64 = x.windows(2).map(|x| (x[0] - 1.0).powi(2) * (1.0 + (3.0 * PI * x[1]).sin().powi(2))).sum();
    let ends = (3.0 * PI * x[0]).sin().powi(2) + (last - 1.0).powi(2) * (1.0 + (TAU * last).sin().powi(2));
    0.1 * (ends + between) + beyond(x, 5.0)
}

const FUNCTIONS: [Function; 13] = [
    Function { range: (-100.0, 100.0), cost: |x| sum(x, |x| x * x) },
    Function { range: (-10.0, 10.0), cost: |x| sum(x, f64::abs) + x.iter().map(|x| x.abs()).product::<f64>() },
    Function { range: (-100.0, 100.0), cost: prefix_squares },
    Function { range: (-100.0, 100.0), cost: |x| x.iter().fold(0.0, |most, x| x.abs().max(most)) },
    Function { range: (-30.0, 30.0), cost: rosenbrock },
    Function { range: (-100.0, 100.0), cost: |x| sum(x, |x| (x + 0.5).floor().powi(2)) },
    Function { range: (-1.28, 1.28), cost: quartic },
    Function {
        range: (-500.0, 500.0),
        cost: |x| 418.982_887_272_433_8 * x.len() as f64 - sum(x, |x| x * x.abs().sqrt().sin()),
    },
    Function { range: (-5.12, 5.12), cost: |x| sum(x, |x| x * x - 10.0 * (TAU * x).cos() + 10.0) },
    Function { range: (-32.0, 32.0), cost: ackley },
    Function { range: (-600.0, 600.0), cost: griewank },
    Function { range: (-50.0, 50.0), cost: penalized },
    Function { range: (-50.0, 50.0), cost: penalized_2 },
];

/// Returns the mean logarithm of the errors of a search on all functions, shifted by a part of the range.
fn mean_logarithm(search: ConfiguredSearch, protocol: &Protocol, shift: f64, seed: u64) -> Result<f64> {
    let mut total = 0.0;
    for Function { range, cost } in &FUNCTIONS {
        let moved = shift * (range.1 - range.0);
        let generations = protocol.evaluations / POPULATION;
        let run = |run: u64| {
            let bounds = vec![*range; protocol.dimensions];
            let settings =
                SearchSettings { bounds, population: POPULATION, generations, seed, run, ..SearchSettings::default() };
            Ok(Run::new(search.begin(settings)?))
        };
        let mut runs: Vec<Run> = (0..protocol.runs).map(run).collect::<Result<_>>()?;
        let mut evaluate = |populations: &[Candidates<'_>], costs: &mut [f64]| {
            let rows = populations.iter().flat_map(|table| (0..table.count()).map(|row| table.row(row)));
            let mut point = vec![0.0; protocol.dimensions];
            for (to, row) in costs.iter_mut().zip(rows) {
                point.iter_mut().zip(row).for_each(|(x, value)| *x = value - moved);
                *to = cost(&point);
            }
            Ok(())
        };
        let budget = Budget { generations, slice: usize::MAX };
        minimize(&mut runs, budget, &mut evaluate, &mut |_| ControlFlow::Continue(()))?;
        total += runs.iter().map(|run| run.cost().max(SOLVED).ln()).sum::<f64>() / runs.len() as f64;
    }
    Ok(total / FUNCTIONS.len() as f64)
}

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let is_full = given.first().is_some_and(|word| word == "full");
    let repetitions: u64 = given.get(1).and_then(|word| word.parse().ok()).unwrap_or(1);
    let protocol = match is_full {
        true => Protocol { dimensions: 30, evaluations: 50_000, runs: 20 },
        false => Protocol { dimensions: 10, evaluations: 5_000, runs: 5 },
    };
    println!("geometric mean of the errors with a shifted optimum, relative to that with a centred one");
    println!("method          lowest    highest  biased in");
    for search in SEARCHES.into_iter().filter(|search| search.name != "multistart") {
        let ratio = |seed: u64| -> Result<f64> {
            let [centred, shifted] = [0.0, -0.1].map(|shift| mean_logarithm(search.into(), &protocol, shift, seed));
            Ok((shifted? - centred?).exp())
        };
        let ratios: Vec<f64> = (1..=repetitions).map(ratio).collect::<Result<_>>()?;
        let [low, high] = [f64::min, f64::max].map(|of| ratios.iter().copied().reduce(of).unwrap_or(f64::NAN));
        let biased = ratios.iter().filter(|ratio| **ratio > 10.0).count();
        println!("{:<10} {low:>11.2e} {high:>10.2e}  {biased} of {repetitions}", search.name);
    }
    Ok(())
}
