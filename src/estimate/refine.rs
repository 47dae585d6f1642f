//! Refinement: output-error Levenberg–Marquardt in the logarithms of the parameters, within the bounds of the space.
//!
//! What is minimized is the weighted sum of squares `Σ_r Σ_c Σ_n e²/σ_rc²` over recordings and channels, the negative
//! log likelihood of white normal noise. Where σ is not given it is that of the residuals, in rounds of reweighting until it stands; the fixed point is the
//! maximum-likelihood estimate. Damping follows H. B. Nielsen (1999), scaled by the diagonal (D. W. Marquardt 1963).

use super::normal::{Fit, Normal, Sigma};
use super::uncertainty::{Uncertainty, uncertainty};
use crate::criterion::{Criterion, Norm, Scale};
use crate::evaluate::{Model, Problem, Signals};
use crate::motor::{Parameters, Space};
use crate::record::Record;
use crate::{Error, ErrorKind, Result};
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// How a refinement works.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RefineOptions {
    /// How the motor is simulated.
    pub model: Model,
    /// σ of the noise of current \[A\] and speed \[rad/s\] of each recording; `None` takes that of the residuals.
    pub sigma: Option<Vec<[f64; 2]>>,
}

/// A refined estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Values of the free parameters, in the order of the space.
    pub values: Vec<f64>,
    /// The parameters of the first recording, those held included.
    pub parameters: Parameters,
    /// State `[i, ω]` at the start of each recording, estimated where it was free.
    pub initial: Vec<[f64; 2]>,
    /// σ of the residuals of current and speed over all recordings; `None` for a channel not measured.
    pub sigma: [Option<f64>; 2],
    /// The same of each recording; 1 for a channel not measured.
    pub sigmas: Vec<[f64; 2]>,
    /// Sum of squared residuals of current \[A²\] and speed \[rad²/s²\] of each recording.
    pub squares: Vec<[f64; 2]>,
    /// The bound, if any, that each free parameter stands at: `min` or `max`.
    pub at_bound: Vec<Option<&'static str>>,
    /// How sure it is.
    pub uncertainty: Uncertainty,
    /// Whether the last step was far below a standard error.
    pub converged: bool,
    /// Simulations with derivatives.
    pub evaluations: usize,
}

impl Refined {
    /// The sum of squared residuals in units of `sigma`, one pair for each recording.
    #[must_use]
    pub fn weighted(&self, sigma: &[[f64; 2]]) -> f64 {
        let pairs = self.squares.iter().flatten().zip(sigma.iter().flatten());
        pairs.map(|(squares, sigma)| squares / (sigma * sigma)).sum()
    }
}

/// Simulations of one refinement at most.
const EVALUATIONS_MAX: usize = 200;
/// A refinement ends when its step is shorter than this many standard errors.
const STEP_MAX: f64 = 1e-6;
/// And a round of weights before the last when shorter than this many.
const STEP_MAX_ROUND: f64 = 1e-2;
/// Damping below which the length of a step is that of what is left to go.
const UNDAMPED: f64 = 1e-2;
/// Rounds of weights, and the change of σ that ends them.
const ROUNDS_MAX: usize = 30;
const SIGMA_CHANGE: f64 = 1e-6;
/// Longest step in a logarithm.
const TRUST: f64 = 1.0;
/// Residuals below this part of a channel's rms are rounding.
const SIGMA_MIN: f64 = 1e-13;
/// The smallest σ whose square is a number like any other.
const SMALLEST: f64 = 1e-150;

/// Refines the parameters `start` (one value per free axis of `space`) on one or more recordings.
///
/// # Errors
/// `Usage` when `start` does not fit the space or is not positive and finite; `NotIdentified` when the motor diverges
/// there, or nothing is measured.
pub fn refine(records: &[Record], space: &Space, start: &[f64], options: &RefineOptions) -> Result<Refined> {
    refine_on(&fit_problem(records, space, options.model)?, start, options.sigma.as_deref())
}

/// Like [`refine`], on a problem that [`fit_problem`] has made, so that many refinements need one.
///
/// # Errors
/// As [`refine`], and `Usage` when the problem has another criterion.
pub fn refine_on(problem: &Problem, start: &[f64], sigma: Option<&[[f64; 2]]>) -> Result<Refined> {
    check_plain(problem)?;
    if sigma.is_some_and(|sigma| sigma.len() != problem.signals().len()) {
        return Err(Error::usage("σ is not given for each recording", "Give one pair for each, in their order."));
    }
    refine_problem(problem, start, sigma, true)
}

/// Like [`refine_on`] to a hundredth of a standard error under the weights `sigma`: to compare starts.
///
/// # Errors
/// As [`refine_on`].
pub fn refine_roughly(problem: &Problem, start: &[f64], sigma: &[[f64; 2]]) -> Result<Refined> {
    check_plain(problem)?;
    refine_problem(problem, start, Some(sigma), false)
}

/// The problem of a fit: every error counts alike until it is divided by σ.
///
/// # Errors
/// As [`Problem::new`].
pub fn fit_problem(records: &[Record], space: &Space, model: Model) -> Result<Problem> {
    Problem::new(records, model, space.clone(), plain())
}

pub(super) fn check_plain(problem: &Problem) -> Result<()> {
    if *problem.criterion() == plain() {
        return Ok(());
    }
    Err(Error::usage("the problem weighs its errors, which an estimate does itself", "Make it with fit_problem."))
}

/// Sums of squares, each channel as it is.
pub(super) fn plain() -> Criterion {
    Criterion { norm: Norm::Euclidean, scale: Scale::None, ..Criterion::default() }
}

/// σ to begin with: what a recording itself shows, but no less than a ten-thousandth of the signal; 1 for a channel not
/// measured.
pub(super) fn first_sigma(signals: &Signals) -> [f64; 2] {
    [0, 1].map(|channel| {
        if !signals.has(channel) {
            return 1.0;
        }
        signals.noise(channel).max(1e-4 * signals.rms(channel)).max(SMALLEST)
    })
}

/// Like [`refine`]; without `thorough` it stops at a hundredth of a standard error under the weights it begins with.
pub(super) fn refine_problem(
    problem: &Problem,
    start: &[f64],
    sigma: Option<&[[f64; 2]]>,
    thorough: bool,
) -> Result<Refined> {
    let fit = Fit::new(problem);
    let axes = problem.space().free();
    let fits = axes.len() == start.len() && axes.iter().zip(start).all(|(axis, v)| axis.parameter.admits(*v));
    if !fits {
        let message = format!("{} starting values for {} free parameters", start.len(), axes.len());
        return Err(Error::usage(message, "Give one value per free parameter, positive for R, L, K, B and J."));
    }
    let mut search = Search::new(
        &fit,
        start,
        sigma.map_or_else(|| problem.signals().iter().map(|s| first_sigma(s)).collect(), <[_]>::to_vec),
    )?;
    if thorough && sigma.is_none() && search.is_near() {
        search.reweight();
    }
    let mut converged = search.run(if thorough && sigma.is_some() { STEP_MAX } else { STEP_MAX_ROUND });
    if thorough && sigma.is_none() {
        for _ in 0..ROUNDS_MAX {
            let change = search.reweight();
            let last = change < SIGMA_CHANGE;
            converged = search.run(if last { STEP_MAX } else { STEP_MAX_ROUND });
            if last {
                break;
            }
        }
    }
    Ok(search.finish(converged))
}

/// A descent on its way.
struct Search<'a> {
    fit: &'a Fit<'a>,
    lower: DVector<f64>,
    upper: DVector<f64>,
    at: DVector<f64>,
    normal: Normal,
    sigma: Sigma,
    damping: f64,
    evaluations: usize,
}

impl<'a> Search<'a> {
    fn new(fit: &'a Fit<'a>, start: &[f64], sigma: Sigma) -> Result<Self> {
        let axes = fit.problem.space().free();
        let bound = |of: &dyn Fn(usize) -> f64, open: f64| {
            DVector::from_fn(fit.unknowns, |n, _| axes.get(n).map_or(open, |axis| axis.coordinate(of(n))))
        };
        let lower = bound(&|n| axes[n].min, f64::NEG_INFINITY);
        let upper = bound(&|n| axes[n].max, f64::INFINITY);
        let at = clamp(&fit.start(start), &lower, &upper);
        let normal = fit.normal(&at);
        if !normal.is_finite() {
            return Err(Error::new(
                ErrorKind::NotIdentified,
                "the motor diverges where the refinement begins",
                "Start elsewhere, or use --discretization zoh, which cannot diverge by itself.",
            ));
        }
        Ok(Self { fit, lower, upper, at, normal, sigma, damping: 1e-3, evaluations: 1 })
    }

    /// Descends until a step is shorter than `enough` standard errors; false when it has not got there.
    fn run(&mut self, enough: f64) -> bool {
        let mut growth = 2.0;
        while self.evaluations < EVALUATIONS_MAX {
            let (matrix, gradient) = self.fit.weighted(&self.normal, &self.sigma);
            let cost = self.normal.cost(&self.sigma);
            let free = self.free(&gradient);
            let Some(step) = damped_step(&matrix, &gradient, &free, self.damping) else {
                self.damping = (self.damping * growth).max(1e-12);
                growth *= 2.0;
                if self.damping > 1e16 {
                    return false;
                }
                continue;
            };
            let next = clamp(&(&self.at + self.trusted(step)), &self.lower, &self.upper);
            let step = &next - &self.at;
            let length = step.dot(&(&matrix * &step)).max(0.0).sqrt();
            let smallest = step.iter().zip(&self.at).all(|(s, x)| s.abs() <= 1e-15 * x.abs().max(1.0));
            if smallest {
                return true;
            }
            // What a simulation could add is far below the noise. Where weights are to change, the step is left to the next
            // ones, which begin from the sums known here.
            if length < enough && self.damping < UNDAMPED {
                if enough <= STEP_MAX {
                    self.at = next;
                }
                return true;
            }
            let normal = self.fit.normal(&next);
            self.evaluations += 1;
            let after = if normal.is_finite() { normal.cost(&self.sigma) } else { f64::INFINITY };
            let predicted = 2.0 * step.dot(&gradient) - step.dot(&(&matrix * &step));
            if after < cost {
                let ratio = ((cost - after) / predicted).clamp(0.0, 1.0);
                self.damping = (self.damping * (1.0 / 3.0_f64).max(1.0 - (2.0 * ratio - 1.0).powi(3))).max(1e-14);
                growth = 2.0;
                (self.at, self.normal) = (next, normal);
                if length < enough {
                    return true;
                }
            } else {
                // No descent by so short a step: what is left is rounding.
                if length < enough.max(1e-3) && (after - cost).abs() <= 1e-12 * cost {
                    return true;
                }
                self.damping = (self.damping * growth).max(1e-12);
                growth *= 2.0;
                if self.damping > 1e16 {
                    return length < enough.max(1e-3);
                }
            }
        }
        false
    }

    /// Which unknowns may move: not those at a bound that the descent pushes against.
    fn free(&self, gradient: &DVector<f64>) -> Vec<usize> {
        let held = |n: usize| {
            (self.at[n] <= self.lower[n] && gradient[n] < 0.0) || (self.at[n] >= self.upper[n] && gradient[n] > 0.0)
        };
        (0..self.fit.unknowns).filter(|&n| !held(n)).collect()
    }

    /// A step whose logarithms all stay within the trust.
    fn trusted(&self, step: DVector<f64>) -> DVector<f64> {
        let longest = step.iter().take(self.fit.problem.space().free().len()).fold(0.0, |m: f64, v| m.max(v.abs()));
        if longest > TRUST { step * (TRUST / longest) } else { step }
    }

    /// Whether the residuals are not far above the noise, so that they tell its σ.
    fn is_near(&self) -> bool {
        let residuals = self.residual_sigma();
        residuals.iter().flatten().zip(self.sigma.iter().flatten()).all(|(found, noise)| *found < 2.0 * noise)
    }

    /// σ of the residuals, corrected for what the unknowns took; returns its largest relative change.
    fn reweight(&mut self) -> f64 {
        let sigma = self.residual_sigma();
        let pairs = sigma.iter().flatten().zip(self.sigma.iter().flatten());
        let largest = pairs.map(|(new, old)| (new / old - 1.0).abs()).fold(0.0, f64::max);
        self.sigma = sigma;
        self.damping = self.damping.min(1e-3);
        largest
    }

    /// What is left of one in the degrees of freedom.
    #[expect(clippy::cast_precision_loss, reason = "counts of samples are far below 2^53")]
    fn freedom(&self) -> f64 {
        1.0 - (self.fit.unknowns as f64 / self.fit.count() as f64).min(0.9)
    }

    /// σ of the residuals of each recording and channel; 1 for a channel not measured.
    fn residual_sigma(&self) -> Sigma {
        let freedom = self.freedom();
        let of = |(recording, signals): (usize, &Arc<Signals>)| {
            [0, 1].map(|channel| {
                if !signals.has(channel) {
                    return 1.0;
                }
                #[expect(clippy::cast_precision_loss, reason = "counts of samples are far below 2^53")]
                let count = signals.count(channel) as f64;
                let sigma = (self.normal.squares(recording, channel) / (count * freedom).max(1.0)).sqrt();
                #[expect(clippy::cast_precision_loss, reason = "counts of samples are far below 2^53")]
                let part = (signals.len() as f64 / count).sqrt();
                sigma.max(SIGMA_MIN * part * signals.rms(channel)).max(SMALLEST)
            })
        };
        self.fit.problem.signals().iter().enumerate().map(of).collect()
    }

    /// The same of each channel over all recordings.
    fn pooled_sigma(&self) -> [Option<f64>; 2] {
        let signals = self.fit.problem.signals();
        [0, 1].map(|channel| {
            let measured = || (0..signals.len()).filter(|n| signals[*n].has(channel));
            let squares: f64 = measured().map(|n| self.normal.squares(n, channel)).sum();
            let count: usize = measured().map(|n| signals[n].count(channel)).sum();
            #[expect(clippy::cast_precision_loss, reason = "counts of samples are far below 2^53")]
            let freedom = (count as f64 * self.freedom()).max(1.0);
            (count > 0).then(|| (squares / freedom).sqrt())
        })
    }

    fn finish(self, converged: bool) -> Refined {
        let Self { fit, at, normal, evaluations, .. } = &self;
        let axes = fit.problem.space().free();
        // Samples behind a filter are not independent: fewer of them inform.
        let share = |(sigma, signals): (&[f64; 2], &Arc<Signals>)| sigma.map(|s| s / signals.independent.sqrt());
        let informing: Sigma = self.sigma.iter().zip(fit.problem.signals()).map(share).collect();
        let (matrix, gradient) = fit.weighted(normal, &informing);
        let free = self.free(&gradient);
        let at_bound = (0..axes.len()).map(|n| match (free.contains(&n), at[n] <= self.lower[n]) {
            (true, _) => None,
            (false, true) => Some("min"),
            (false, false) => Some("max"),
        });
        let (values, initial) = (fit.values(at), fit.initial(at));
        let recordings = fit.problem.signals().len();
        Refined {
            parameters: fit.problem.parameters(&values, 0),
            sigma: self.pooled_sigma(),
            sigmas: self.residual_sigma(),
            squares: (0..recordings).map(|n| [normal.squares(n, 0), normal.squares(n, 1)]).collect(),
            at_bound: at_bound.collect(),
            uncertainty: uncertainty(fit, &values, &initial, &matrix, &free),
            values,
            initial,
            converged,
            evaluations: *evaluations,
        }
    }
}

fn clamp(unknowns: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(unknowns.len(), |n, _| unknowns[n].max(lower[n]).min(upper[n]))
}

/// `(JᵀJ + λ diag JᵀJ)⁻¹ Jᵀe` of the unknowns that may move, zero in the others; `None` where it has no solution.
fn damped_step(matrix: &DMatrix<f64>, gradient: &DVector<f64>, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    // Scaled by the diagonal, so that units do not matter.
    let scale: Vec<f64> = free.iter().map(|&n| matrix[(n, n)].sqrt()).collect();
    let divisor = |n: usize| if scale[n] > 0.0 { scale[n] } else { 1.0 };
    let system = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        let own = if a == b { damping } else { 0.0 };
        matrix[(free[a], free[b])] / (divisor(a) * divisor(b)) + own
    });
    let right = DVector::from_fn(free.len(), |a, _| gradient[free[a]] / divisor(a));
    let solved = system.cholesky()?.solve(&right);
    let mut step = DVector::zeros(matrix.nrows());
    for (n, &place) in free.iter().enumerate() {
        step[place] = solved[n] / divisor(n);
    }
    step.iter().all(|v| v.is_finite()).then_some(step)
}
