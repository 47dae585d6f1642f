//! Proves: the profile likelihood of a parameter is the minimum of the weighted sum of squares over the others, against a search by
//! sections on the scalar simulation; its 95 % intervals cover the true parameters over seeds, also where the likelihood is far from a
//! parabola.
//! Does not prove: coverage for models that do not describe the recording.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

use motorfit::experiment::{Excitation, simulated, with_noise};
use motorfit::identify::{IdentifySpec, LikelihoodProfile, Polish, likelihood_profiles};
use motorfit::motor::{Discretization, Parameter, Parameters, SimulationInput, Space, simulate};
use motorfit::record::Record;
use rayon::prelude::*;

const SIGMA: [f64; 2] = [0.3, 8.0];
const STEP_S: f64 = 2e-3;

/// Returns a recording of M2 under a step with noise of [`SIGMA`].
fn noisy(duration_s: f64, seed: u64) -> Record {
    let step = Excitation::step(10.5, 0.0, duration_s, STEP_S).unwrap();
    with_noise(&simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap(), SIGMA, seed).unwrap()
}

/// Returns the sum of squared errors in units of σ.
fn squares(record: &Record, motor: &Parameters, sigma: [f64; 2]) -> f64 {
    let input = SimulationInput {
        step_s: &[STEP_S],
        step_index: &[],
        voltage: &record.samples().voltage,
        voltage_end: &[],
        torque: &[],
    };
    let simulated = simulate(motor, &input, [0.0; 2], Discretization::Zoh);
    let of = |c: usize| {
        let measured = record.measured()[c].unwrap();
        let errors = measured.iter().zip(&simulated[c]).map(|(y, x)| ((y - x) / sigma[c]).powi(2));
        errors.sum::<f64>()
    };
    of(0) + of(1)
}

/// Returns the minimum of a function of one variable by golden sections.
fn least(range: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = range;
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    while high - low > 1e-9 * high {
        let [a, b] = [high - golden * (high - low), low + golden * (high - low)];
        if f(a) < f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    f(0.5 * (low + high))
}

fn of(profiles: &[LikelihoodProfile], parameter: Parameter) -> &LikelihoodProfile {
    profiles.iter().find(|of| of.axis.parameter == parameter).unwrap()
}

#[test]
fn a_profile_is_the_minimum_over_the_other_parameters() {
    let record = noisy(0.3, 3);
    let [_, l, _, b, j] = Parameters::M2.to_array();
    let fixed = [(Parameter::L, l), (Parameter::B, b), (Parameter::J, j)];
    let space = Space::table2_with(&[], &fixed).unwrap();
    let spec = IdentifySpec { space, ..IdentifySpec::default() };
    let (found, profiles) = likelihood_profiles(std::slice::from_ref(&record), &spec).unwrap();
    let sigma = [0, 1].map(|channel: usize| found.residual_sigma[channel].unwrap());
    let optimum = squares(&record, &found.parameters, sigma);
    let own = of(&profiles, Parameter::R);
    assert!(own.points.len() > 10);
    for point in &own.points {
        let with = |k: f64| squares(&record, &Parameters { r: point.value, k, ..found.parameters }, sigma);
        let expected = least([0.03, 0.15], with) - optimum;
        // The refinement ends when the sum changes by less than 1e-6 of itself.
        assert!((point.ratio - expected).abs() < 1e-3 * (1.0 + expected), "{point:?}: expected {expected}");
    }
    let [low, high] = own.likelihood95.map(Option::unwrap);
    for end in [low, high] {
        let with = |k: f64| squares(&record, &Parameters { r: end, k, ..found.parameters }, sigma);
        assert!((least([0.03, 0.15], with) - optimum - 3.84).abs() < 0.02, "{end}");
    }
}

#[test]
fn intervals_by_the_likelihood_cover_the_truth() {
    // A short, noisy recording.
    const SEEDS: u64 = 1000;
    let truth = Parameters::M2;
    let covered = |seed: u64| {
        let (_, profiles) = likelihood_profiles(&[noisy(0.2, 100 + seed)], &IdentifySpec::default()).unwrap();
        let is_inside = |parameter: Parameter, [low, high]: [Option<f64>; 2]| {
            let value = truth.get(parameter);
            u32::from(low.is_none_or(|low| low < value) && high.is_none_or(|high| value < high))
        };
        Parameter::ALL.map(|parameter| {
            let of = of(&profiles, parameter);
            let normal = of.ci95.map_or([None; 2], |ends| ends.map(Some));
            [is_inside(parameter, of.likelihood95), is_inside(parameter, normal)]
        })
    };
    let all: Vec<[[u32; 2]; 5]> = (0..SEEDS).into_par_iter().map(covered).collect();
    let counts = [0, 1].map(|kind| Parameter::ALL.map(|p| all.iter().map(|of| of[p as usize][kind]).sum::<u32>()));
    println!("covered of {SEEDS}, by the likelihood and by the standard errors: {counts:?}");
    let [counts, _] = counts;
    // The standard deviation of a count is 6.9; the limits are four of them from 950.
    assert!(counts.iter().all(|count| (922..=978).contains(count)), "{counts:?}");
}

#[test]
fn a_profile_needs_the_refinement() {
    let spec = IdentifySpec { polish: Polish::None, ..IdentifySpec::default() };
    let error = likelihood_profiles(&[noisy(0.3, 1)], &spec).unwrap_err();
    assert_eq!(error.kind(), motorfit::ErrorKind::Usage);
}

#[test]
fn profiles_with_parameters_fixed_have_no_intervals() {
    // Without the current only combinations of the parameters are identifiable.
    let mut samples = noisy(0.3, 5).samples().clone();
    samples.current = None;
    let record = Record::new(samples).unwrap();
    let (found, profiles) = likelihood_profiles(&[record], &IdentifySpec::default()).unwrap();
    assert!(!found.unidentified.is_empty() && !profiles.is_empty());
    assert!(profiles.iter().all(|of| of.likelihood95 == [None; 2] && of.points.len() > 1), "{profiles:?}");
    assert!(found.warnings.iter().any(|warning| warning.code == "profile_conditional"));
}
