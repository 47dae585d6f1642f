//! Optima of a model over its bounds: descents from the best of a batch of random candidates that lie apart. Where these do not agree,
//! and for friction that sticks, descents begin at the best of small populations; where these do not agree either, the lowest ends are
//! searched around (`around.rs`).

use super::around::{ROUNDS as ROUNDS_AROUND, search_around};
use super::ends::{End, SearchPoint, descend};
use super::fitted::check;
use super::search::Search;
use motorfit_core::candidates::Candidates;
use motorfit_core::{Error, Result};
use motorfit_evaluate::Evaluator;
use motorfit_evaluate::model::ModelProblem;
use motorfit_model::Model;
use rand::{RngExt as _, SeedableRng as _};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Number of candidates for each free parameter, and the limits of their number.
const CANDIDATES_PER_AXIS: usize = 400;
const CANDIDATES: [usize; 2] = [1024, 8192];
/// Samples on which random candidates and populations are evaluated: they give starts only.
const SAMPLES_SCREENED: usize = 4000;
/// Number of descents of a round.
const STARTS: usize = 12;
/// Rounds at most; a further one begins if too few descents ended in the lowest optimum.
const ROUNDS: usize = 3;
/// Rounds at most for a model with friction that sticks.
const ROUNDS_STICKING: usize = 2;
/// Smallest distance of two starts, as a fraction of the range of some coordinate.
const APART: f64 = 0.1;

/// The lowest optimum that descents from many starts found.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOptima {
    /// Values of the free parameters at the lowest optimum.
    pub values: Vec<f64>,
    /// Initial values of the open states of each recording there.
    pub initial: Vec<Vec<f64>>,
    /// Cost there: the sum of squares, each output divided by its standard deviation.
    pub cost: f64,
    /// Number of starts over the bounds.
    pub starts: usize,
    /// Number of these starts from which the lowest optimum was reached, by a descent or by further ones around its end.
    pub arrivals: usize,
    /// Number of evaluated candidates, a simulation with derivatives as one.
    pub evaluations: u64,
    /// True if the search was ended before its end.
    pub is_interrupted: bool,
}

/// A function that evolves populations on a problem with an evaluator and a seed; returns the best candidate of each, and the number of
/// evaluated candidates.
pub type Populations<'a> =
    dyn FnMut(&Arc<ModelProblem>, &mut dyn Evaluator<ModelProblem>, u64) -> Result<(Vec<Vec<f64>>, u64)> + 'a;

/// Starts of descents beside the best of random candidates.
pub struct ModelStarts<'a> {
    /// Values of the free parameters, each a start of the first round, which takes part in the search without being evidence.
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
    evaluator: &mut dyn Evaluator<ModelProblem>,
    seed: u64,
    starts: ModelStarts<'_>,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<ModelOptima> {
    let mut search = Search::new(problem, seed);
    let is_interrupted = rounds(&mut search, evaluator, starts, observe)?;
    let Some(best) = search.lowest() else {
        let hint = "Check units and bounds of the parameters: within them the simulated machine grows without limit.";
        return Err(Error::not_identified("the model diverges from every start", hint));
    };
    let End { at: SearchPoint { values, initial, .. }, cost, .. } = best.clone();
    let (starts, arrivals, evaluations) = (search.starts(), search.arrivals(), search.evaluations);
    Ok(ModelOptima { values, initial, cost, starts, arrivals, evaluations, is_interrupted })
}

/// The end of a descent from a given start.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEnd {
    /// Values of the free parameters.
    pub values: Vec<f64>,
    /// Initial values of the open states of each recording.
    pub initial: Vec<Vec<f64>>,
    /// Cost: the sum of squares, each output divided by its standard deviation.
    pub cost: f64,
}

/// Descends from given starts, by themselves; a start from which the model diverges has no end. Returns the number of simulations too.
///
/// # Errors
/// Returns `Usage` if a start does not fit the space.
pub fn model_ends(problem: &ModelProblem, given: &[Vec<f64>]) -> Result<(Vec<ModelEnd>, u64)> {
    let initial = problem.open_initials();
    given.iter().try_for_each(|start| check(problem, start, &initial))?;
    let start = |values: &Vec<f64>| SearchPoint { values: values.clone(), initial: initial.clone(), is_given: true };
    let (ends, simulations) = descend(problem, &given.iter().map(start).collect::<Vec<_>>(), false);
    let end = |End { at: SearchPoint { values, initial, .. }, cost }: End| ModelEnd { values, initial, cost };
    Ok((ends.into_iter().flatten().map(end).collect(), simulations))
}

/// Descends in rounds until enough starts reached the lowest optimum; returns true if `observe` ended the search.
fn rounds(
    search: &mut Search<'_>,
    evaluator: &mut dyn Evaluator<ModelProblem>,
    ModelStarts { given, populations }: ModelStarts<'_>,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<bool> {
    let problem = search.problem;
    let initial = problem.open_initials();
    for start in given {
        check(problem, start, &initial)?;
    }
    let has_stick = problem.model().reactions() > 0;
    let screened = problem.with_fewer_samples(SAMPLES_SCREENED)?;
    let screened = &Arc::new(screened.unwrap_or_else(|| problem.clone()));
    // With matrix exponentials derivatives are cheap, so that every round has random candidates too.
    let is_affine = has_stick && problem.method().stiffness.is_affine;
    let (rounds, all_rounds) = (rounds_spread(problem.model()), rounds_max(problem.model()));
    for round in 0..rounds {
        let mut all = if round == 0 { given.to_vec() } else { Vec::new() };
        let given = all.len();
        let number = (CANDIDATES_PER_AXIS * search.problem.space().free.len()).clamp(CANDIDATES[0], CANDIDATES[1]);
        let round_seed = search.seed.wrapping_mul(ROUNDS as u64).wrapping_add(round as u64);
        let has_populations = (round == 0) == has_stick;
        if !has_populations || is_affine {
            all.extend(best_apart(screened, evaluator, number, round_seed)?);
            search.evaluations += number as u64;
        }
        if has_populations {
            let (best, evaluated) = populations(screened, evaluator, round_seed)?;
            all.extend(best);
            search.evaluations += evaluated;
        }
        let start = |(n, values)| SearchPoint { values, initial: initial.clone(), is_given: n < given };
        let starts: Vec<SearchPoint> = all.into_iter().enumerate().map(start).collect();
        let (found, simulations) = descend(search.problem, &starts, true);
        search.evaluations += simulations;
        search.ends.extend(found.into_iter().flatten());
        if observe(round + 1, all_rounds).is_break() {
            return Ok(true);
        }
        // One more round where several descents agree on an optimum that leaves more than noise.
        if search.is_conclusive() && (search.problem.space().free.is_empty() || round > 0 || search.explains()) {
            break;
        }
    }
    let is_interrupted = search_around(search, &mut |round| observe(rounds + round, all_rounds).is_break());
    Ok(observe(all_rounds, all_rounds).is_break() || is_interrupted)
}

/// Returns the number of rounds of starts over the bounds at most.
fn rounds_spread(model: &Model) -> usize {
    if model.reactions() > 0 { ROUNDS_STICKING } else { ROUNDS }
}

/// Returns the number of rounds of a search at most, those around its lowest ends included.
#[doc(hidden)]
pub fn rounds_max(model: &Model) -> usize {
    rounds_spread(model) + ROUNDS_AROUND
}

/// Returns the best of random candidates that lie apart from each other.
fn best_apart(
    problem: &Arc<ModelProblem>,
    evaluator: &mut dyn Evaluator<ModelProblem>,
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
