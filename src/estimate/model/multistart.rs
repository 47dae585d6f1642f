//! Optima of a model over its bounds: descents from the best of a batch of random candidates that lie apart. Where these do not agree,
//! and for friction that sticks, descents begin at the best of small populations.

use super::descent::Descent;
use super::fit::{Fit, Normal};
use crate::candidates::Candidates;
use crate::evaluate::model::{ModelAxis, ModelEvaluator, ModelProblem};
use crate::numeric::{count, noise_sigma, rms, standard_deviation};
use crate::{Error, Result};
use rand::{RngExt as _, SeedableRng as _};
use std::ops::ControlFlow;

/// Number of candidates for each free parameter, and the limits of their number.
const CANDIDATES_PER_AXIS: usize = 400;
const CANDIDATES: [usize; 2] = [1024, 8192];
/// Samples on which random candidates and populations are evaluated: they give starts only.
const SAMPLES_SCREENED: usize = 4000;
/// Number of descents of a round.
const STARTS: usize = 12;
/// Rounds at most; a further one begins if fewer than [`ARRIVALS`] descents ended in the lowest optimum.
const ROUNDS: usize = 3;
/// Rounds at most for a model with friction that sticks.
const ROUNDS_STICKING: usize = 2;
/// Descents that must end in the lowest optimum.
pub(crate) const ARRIVALS: usize = 3;
/// Smallest distance of two starts, as a fraction of the range of some coordinate.
const APART: f64 = 0.1;
/// Standard deviation of the residuals, in those of the noise, up to which an optimum explains an output.
pub(super) const NOISY: f64 = 2.0;
/// Relative difference of costs within which descents ended in the same optimum.
const SAME: f64 = 1e-4;
/// Rounds at most around the lowest optimum of descents that do not agree, descents of each, and their distances from it, as fractions of
/// the range of each coordinate: from some standard errors to where random starts are.
const ROUNDS_AROUND: usize = 4;
const AROUND: usize = 8;
const DISTANCES: [f64; 2] = [3e-3, 0.1];
/// Simulations of a descent at most.
const SIMULATIONS: usize = 80;
/// Part of the cost below which the gain of a descent with friction that sticks ends it.
const STALLED: f64 = 1e-3;

/// The lowest optimum that descents from many starts found.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOptima {
    /// Values of the free parameters at the lowest optimum.
    pub values: Vec<f64>,
    /// Initial values of the open states of each recording there.
    pub initial: Vec<Vec<f64>>,
    /// Cost there: the sum of squares, each output divided by its standard deviation.
    pub cost: f64,
    /// Number of descents.
    pub starts: usize,
    /// Number of descents that ended in the lowest optimum.
    pub arrivals: usize,
    /// Number of evaluated candidates, a simulation with derivatives as one.
    pub evaluations: u64,
    /// True if the search was ended before its end.
    pub is_interrupted: bool,
}

/// A function that evolves populations on a problem with an evaluator and a seed; returns the best candidate of each, and the number of
/// evaluated candidates.
pub type Populations<'a> = dyn FnMut(&ModelProblem, &mut dyn ModelEvaluator, u64) -> Result<(Vec<Vec<f64>>, u64)> + 'a;

/// Starts of descents beside the best of random candidates.
pub struct ModelStarts<'a> {
    /// Values of the free parameters, each a start of the first round.
    pub given: &'a [Vec<f64>],
    /// Populations that give the starts for friction that sticks, and where other descents do not agree.
    pub populations: &'a mut Populations<'a>,
}

/// Searches the bounds of a problem from many starts, which the evaluator finds among random candidates, and from further ones.
/// `observe` may end the search between rounds.
///
/// # Errors
/// Returns `Usage` if a given start does not fit the space, `NotIdentified` if the model diverges from every start, and a device error if
/// the evaluator fails.
pub fn model_optima(
    problem: &ModelProblem,
    evaluator: &mut dyn ModelEvaluator,
    (estimates_initial, seed): (bool, u64),
    starts: ModelStarts<'_>,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<ModelOptima> {
    let fit = Fit { problem, estimates_initial };
    let initial: Vec<Vec<f64>> = (0..problem.recordings()).map(|n| problem.open_initial(n).to_vec()).collect();
    let ModelStarts { given, populations } = starts;
    for start in given {
        fit.check(start, &initial)?;
    }
    let has_stick = problem.model().reactions() > 0;
    let screened = problem.with_fewer_samples(SAMPLES_SCREENED)?;
    let screened = screened.as_ref().unwrap_or(problem);
    // With matrix exponentials derivatives are cheap, so that every round has random candidates too.
    let is_affine = has_stick && problem.method().stiffness.is_affine;
    let mut ends: Vec<End> = Vec::new();
    let mut evaluations = 0;
    let mut is_interrupted = false;
    let rounds = if has_stick { ROUNDS_STICKING } else { ROUNDS };
    for round in 0..rounds {
        let mut starts = if round == 0 { given.to_vec() } else { Vec::new() };
        let number = (CANDIDATES_PER_AXIS * fit.axes()).clamp(CANDIDATES[0], CANDIDATES[1]);
        let round_seed = seed.wrapping_mul(ROUNDS as u64).wrapping_add(round as u64);
        let has_populations = (round == 0) == has_stick;
        if !has_populations || is_affine {
            starts.extend(best_apart(screened, evaluator, number, round_seed)?);
            evaluations += number as u64;
        }
        if has_populations {
            let (best, evaluated) = populations(screened, evaluator, round_seed)?;
            starts.extend(best);
            evaluations += evaluated;
        }
        let found = descend(&fit, &starts);
        evaluations += found.iter().map(|end| end.simulations as u64).sum::<u64>();
        ends.extend(found);
        is_interrupted = observe(round + 1, rounds).is_break();
        // One more round where several descents agree on an optimum that leaves more than noise.
        let is_found =
            |best: &End| fit.axes() == 0 || (arrivals(&ends) >= ARRIVALS && (round > 0 || explains(problem, best)));
        if is_interrupted || lowest(&ends).is_some_and(is_found) {
            break;
        }
    }
    if !is_interrupted {
        evaluations += confirmed(&fit, &mut ends, seed);
    }
    let Some(best) = lowest(&ends) else {
        let hint = "Check units and bounds of the parameters: within them the simulated machine grows without limit.";
        return Err(Error::not_identified("the model diverges from every start", hint));
    };
    Ok(ModelOptima {
        values: best.values.clone(),
        initial: best.initial.clone(),
        cost: best.cost,
        starts: ends.len(),
        arrivals: arrivals(&ends),
        evaluations,
        is_interrupted,
    })
}

/// Descends from around the lowest optimum of descents that do not agree, until enough of these end in it, and adds their ends; returns
/// the number of simulations. A backlash has many optima close to each other, of which few random starts reach the same.
fn confirmed(fit: &Fit<'_>, ends: &mut Vec<End>, seed: u64) -> u64 {
    let axes = &fit.problem.space().free;
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5eed);
    let mut simulations = 0;
    for _ in 0..ROUNDS_AROUND {
        let Some(best) = lowest(ends) else { break };
        // Descents with friction that sticks end where the cost has kinks, and do not agree on what leaves more than noise.
        let is_rough = fit.problem.model().reactions() > 0 && !explains(fit.problem, best);
        if axes.is_empty() || arrivals(ends) >= ARRIVALS || is_rough {
            break;
        }
        let values = &best.values;
        let starts: Vec<Vec<f64>> = (0..AROUND)
            .map(|_| {
                let distance = DISTANCES[0] * (DISTANCES[1] / DISTANCES[0]).powf(numbers.random::<f64>());
                let moved = |(axis, value): (&ModelAxis, &f64)| {
                    let range = axis.coordinate(axis.max) - axis.coordinate(axis.min);
                    let change = distance * range * (2.0 * numbers.random::<f64>() - 1.0);
                    axis.value(axis.coordinate(*value) + change)
                };
                axes.iter().zip(values).map(moved).collect()
            })
            .collect();
        let found = descend(fit, &starts);
        simulations += found.iter().map(|end| end.simulations as u64).sum::<u64>();
        ends.extend(found);
    }
    simulations
}

/// The end of a descent.
struct End {
    values: Vec<f64>,
    initial: Vec<Vec<f64>>,
    cost: f64,
    simulations: usize,
}

fn lowest(ends: &[End]) -> Option<&End> {
    ends.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Returns true if an optimum leaves no more than noise of every output. Many descents may end in one that does not: on a plateau, where
/// an effect does not act.
fn explains(problem: &ModelProblem, end: &End) -> bool {
    (0..problem.recordings()).all(|recording| {
        let of = problem.recording(recording);
        let outputs = problem.simulate(&end.values, recording, &end.initial[recording]).outputs;
        outputs.iter().zip(&of.measured).all(|(own, measured)| {
            let Some(measured) = measured else { return true };
            let counting = (0..of.len()).filter(|n| of.counts(*n));
            let residuals: Vec<f64> = counting.map(|n| measured[n] - own[n]).collect();
            rms(&residuals) <= NOISY * noise_sigma(measured)
        })
    })
}

/// Returns the number of descents that ended at the lowest cost.
fn arrivals(ends: &[End]) -> usize {
    let lowest = ends.iter().map(|end| end.cost).fold(f64::INFINITY, f64::min);
    ends.iter().filter(|end| end.cost <= lowest * (1.0 + SAME) + f64::MIN_POSITIVE).count()
}

/// Returns the divisor of each block: the standard deviation of the measured output, so that all outputs count alike.
pub(super) fn deviations(problem: &ModelProblem, normal: &Normal) -> Vec<f64> {
    let one = |block: &super::fit::Block| {
        let signal = problem.recording(block.recording).counted(block.output).unwrap_or_default();
        let deviation = standard_deviation(&signal);
        if deviation > 0.0 { deviation } else { crate::numeric::peak(&signal).max(1e-9) }
    };
    normal.blocks.iter().map(one).collect()
}

/// Descends from each start, all side by side; a start from which the model diverges has no end.
fn descend(fit: &Fit<'_>, starts: &[Vec<f64>]) -> Vec<End> {
    let problem = fit.problem;
    let initial: Vec<Vec<f64>> = (0..problem.recordings()).map(|n| problem.open_initial(n).to_vec()).collect();
    let starts: Vec<_> = starts.iter().map(|start| fit.at(start, &initial)).collect();
    let mut descents: Vec<Descent<'_>> =
        Descent::all(fit, &starts, |normal| deviations(problem, normal)).into_iter().flatten().collect();
    for descent in &mut descents {
        descent.stall = (problem.model().reactions() > 0).then_some(STALLED);
        // In units of the deviations of the signals a step of 1e-7 is far below any noise.
        descent.begin(1e-7 * count(problem.counted()).sqrt(), SIMULATIONS);
    }
    loop {
        let proposed: Vec<(usize, _)> =
            descents.iter_mut().enumerate().filter_map(|(n, descent)| Some((n, descent.propose()?))).collect();
        if proposed.is_empty() {
            break;
        }
        let (numbers, points): (Vec<usize>, Vec<_>) = proposed.into_iter().unzip();
        for (n, normal) in numbers.into_iter().zip(fit.normals(&points)) {
            descents[n].receive(normal);
        }
        let lowest = descents.iter().map(Descent::cost).fold(f64::INFINITY, f64::min);
        descents.iter_mut().for_each(|descent| descent.lowest = lowest * (1.0 + SAME));
    }
    let end = |descent: Descent<'_>| End {
        values: fit.values(&descent.at),
        initial: (0..problem.recordings()).map(|n| fit.initial(&descent.at, n)).collect(),
        cost: descent.cost(),
        simulations: descent.evaluations,
    };
    descents.into_iter().map(end).collect()
}

/// Returns the best of random candidates that lie apart from each other.
fn best_apart(
    problem: &ModelProblem,
    evaluator: &mut dyn ModelEvaluator,
    number: usize,
    seed: u64,
) -> Result<Vec<Vec<f64>>> {
    let axes = &problem.space().free;
    if axes.is_empty() {
        return Ok(vec![Vec::new()]);
    }
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let fractions: Vec<f64> = (0..number * axes.len()).map(|_| numbers.random::<f64>()).collect();
    let values: Vec<f64> = fractions.iter().enumerate().map(|(n, f)| axes[n % axes.len()].at(*f)).collect();
    let mut costs = vec![0.0; number];
    evaluator.costs(problem, Candidates::new(&values, axes.len()), &mut costs)?;
    let mut order: Vec<usize> = (0..number).filter(|n| costs[*n].is_finite()).collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    let of = |n: usize| &fractions[n * axes.len()..(n + 1) * axes.len()];
    let mut chosen: Vec<usize> = Vec::new();
    for n in order {
        let is_apart = |other: &usize| of(n).iter().zip(of(*other)).any(|(a, b)| (a - b).abs() > APART);
        if chosen.len() < STARTS && chosen.iter().all(is_apart) {
            chosen.push(n);
        }
    }
    Ok(chosen.into_iter().map(|n| values[n * axes.len()..(n + 1) * axes.len()].to_vec()).collect())
}
