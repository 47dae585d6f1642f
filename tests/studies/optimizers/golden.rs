//! Evaluations until a target cost, as a distribution over runs, against those of independent implementations: pycma (CMA-ES with
//! BIPOP), scipy (DE) and minion (L-SHADE). `tests/golden/optimizers.py` made the file.

use motorfit::identify::Method;
use motorfit::named::Named as _;
use motorfit::optimize::SearchSettings;

const BEST: [f64; 5] = [1.3, -2.1, 0.7, 2.9, -0.4];

/// Returns the cost of a function of the generator.
fn cost(function: &str, x: &[f64]) -> f64 {
    let z: Vec<f64> = x.iter().zip(BEST).map(|(x, best)| x - best).collect();
    let scaled = |z: &[f64], power: f64| -> f64 {
        (0..5).map(|n| 10f64.powf(power * f64::from(n)) * z[n as usize].powi(2)).sum()
    };
    match function {
        "sphere" => scaled(&z, 0.0),
        "ellipsoid" => scaled(&z, 1.5),
        "rosenbrock" => {
            let z: Vec<f64> = z.iter().map(|z| z + 1.0).collect();
            z.windows(2).map(|z| 100.0 * (z[1] - z[0] * z[0]).powi(2) + (1.0 - z[0]).powi(2)).sum()
        }
        "rastrigin" => z.iter().map(|z| z * z - 10.0 * (std::f64::consts::TAU * z).cos() + 10.0).sum(),
        "corner" => {
            let z: Vec<f64> = x.iter().zip([6.0, -2.1, -7.0, 5.5, -0.4]).map(|(x, best)| x - best).collect();
            scaled(&z, 0.5) - (1.0 + 40.0 + 0.25 * 10f64.powf(1.5))
        }
        other => panic!("{other}"),
    }
}

/// A line of the file: a search on a function.
struct Case<'a> {
    method: &'a str,
    function: &'a str,
    target: f64,
    budget: usize,
    /// Sorted evaluations of the runs of the other implementation.
    theirs: Vec<f64>,
}

impl<'a> Case<'a> {
    fn new(line: &'a str) -> Self {
        let cells: Vec<&str> = line.split(',').collect();
        let theirs = cells[4..].iter().map(|cell| cell.parse().unwrap()).collect();
        let (target, budget) = (cells[2].parse().unwrap(), cells[3].parse().unwrap());
        Self { method: cells[0], function: cells[1], target, budget, theirs }
    }

    /// Returns the number of evaluations that a run takes to reach the target; +∞ if it spends its budget before.
    fn evaluations(&self, run: u64) -> f64 {
        // The populations of the generator; that of CMA-ES is its own.
        let population = if self.method == "lshade" { 90 } else { 50 };
        let (bounds, generations) = (vec![(-5.0, 5.0); 5], self.budget / population);
        let setup = SearchSettings { bounds, population, generations, run, ..SearchSettings::default() };
        let mut search = Method::named("method", self.method).unwrap().optimizer(setup).unwrap();
        let mut spent = 0;
        while spent < self.budget {
            let costs: Vec<f64> = search.ask().values().chunks(5).map(|x| cost(self.function, x)).collect();
            if costs.is_empty() {
                break;
            }
            if let Some(first) = costs.iter().position(|cost| *cost <= self.target) {
                return (spent + first + 1) as f64;
            }
            spent += costs.len();
            search.tell(&costs);
        }
        f64::INFINITY
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Returns the largest difference of the empirical distribution functions of two samples (Kolmogorov and Smirnov).
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let share = |values: &[f64], at: f64| values.iter().filter(|v| **v <= at).count() as f64 / values.len() as f64;
    a.iter().chain(b).map(|at| (share(a, *at) - share(b, *at)).abs()).fold(0.0, f64::max)
}

#[test]
fn searches_take_as_many_evaluations_as_independent_implementations() {
    let golden = std::fs::read_to_string("tests/golden/optimizers.csv").unwrap();
    let (mut compared, mut failures) = (0, Vec::new());
    for case in golden.lines().map(Case::new) {
        let Case { method, function, theirs, .. } = &case;
        let ours: Vec<f64> = (0..theirs.len() as u64).map(|run| case.evaluations(run)).collect();
        let distance = distance(&ours, theirs);
        println!("{method} {function}: medians {} and {}, distance {distance:.3}", median(&ours), median(theirs));
        // Samples of one distribution are further apart with probability α: D² = ln(2/α) / n for two samples of n.
        let limit = ((2.0_f64 / 1e-4).ln() / theirs.len() as f64).sqrt();
        // Bounds are treated in other ways: pycma maps the box, scipy and minion draw again.
        if *function == "corner" {
            assert!(ours.iter().all(|spent| spent.is_finite()), "{method}");
            assert!(median(&ours) < 1.5 * median(theirs), "{method}");
        } else if distance > limit {
            failures.push(format!("{method} {function}: {distance:.3} above {limit:.3}"));
        }
        compared += 1;
    }
    assert_eq!(compared, 15);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
