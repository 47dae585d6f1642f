//! Proves: Steiglitz–McBride and the refinement estimate the parameters of simulated recordings at the Cramér–Rao bound, over
//! seeds, random motors, excitations, sampling periods and kinds of poles; 95 % intervals cover in 93 to 97 %; the global
//! reference finds the global optimum, and a search in a local optimum is reported as stuck.
//! Does not prove: anything about real motors.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(
    clippy::cast_precision_loss,
    clippy::needless_range_loop,
    reason = "small numbers; an index runs over several arrays"
)]

use crate::support::m2_record;
use crate::support::rates::{cases, covers, is_rare, reaches, rms_most};
use motorfit::criterion::{Criterion, Noise, Norm, Scale};
use motorfit::estimate::{
    RefineOptions, Refined, SmFailure, fit_problem, global_reference, refine, refine_coarse, refine_on,
    steiglitz_mcbride, steiglitz_mcbride_on,
};
use motorfit::evaluate::{Initial, Model, Problem};
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::identify::{IdentifySpec, Method, Polish, Status, identify, verify_at};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters, Space};
use motorfit::optimize::GwoOptions;
use motorfit::record::{Record, Samples};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

const M2: Parameters = Parameters::M2;

/// Returns bounds of two decades to each side.
fn wide(truth: [f64; 5]) -> Space {
    let bounds = Parameter::ALL.map(|p| (p, truth[p as usize] / 100.0, truth[p as usize] * 100.0));
    Space::table2_with(&bounds, &[]).unwrap()
}

fn refined(record: &Record, space: &Space, start: [f64; 5], sigma: Option<[f64; 2]>) -> Refined {
    refine(
        std::slice::from_ref(record),
        space,
        &start,
        &RefineOptions { model: Model::default(), sigma: sigma.map(|s| vec![s.to_vec()]) },
    )
    .unwrap()
}

/// Returns the Cramér–Rao bound for known σ: the standard errors of a refinement at the truth without noise.
fn bound(clean: &Record, truth: [f64; 5], sigma: [f64; 2]) -> [f64; 5] {
    let errors = refined(clean, &wide(truth), truth, Some(sigma)).uncertainty.std_error;
    std::array::from_fn(|p| errors[p].unwrap_or(f64::NAN))
}

fn rms(errors: &[[f64; 5]]) -> [f64; 5] {
    [0, 1, 2, 3, 4].map(|p| (errors.iter().map(|e| e[p] * e[p]).sum::<f64>() / errors.len() as f64).sqrt())
}

#[test]
fn without_noise_the_estimates_are_exact() {
    let sine: Vec<f64> = (0..3001).map(|n| 4.0 * (0.02 * f64::from(n)).sin() + 3.0).collect();
    let time_s: Vec<f64> = (0..3001).map(|n| f64::from(n) * 1e-3).collect();
    let step = Excitation::step(10.5, 1.0, 3.0, 1e-3).unwrap();
    let sine = Excitation { time_s, voltage: sine, torque: None };
    for (excitation, discretization) in
        [(&step, Discretization::Zoh), (&sine, Discretization::Zoh), (&sine, Discretization::Foh)]
    {
        let record = simulated(&M2, excitation, discretization).unwrap();
        let model = Model { discretization, initial: Initial::Auto };
        let found = steiglitz_mcbride(&record, model).unwrap().unwrap();
        assert!(found.converged);
        for (found, truth) in found.parameters.to_array().iter().zip(M2.to_array()) {
            assert!((found / truth - 1.0).abs() <= 1e-9, "{discretization:?}: {found} for {truth}");
        }
    }
}

#[test]
fn at_every_noise_level_both_reach_the_cramer_rao_bound() {
    let clean = m2_record();
    let truth = M2.to_array();
    for decibels in [80.0, 60.0, 40.0, 30.0, 20.0] {
        let sigma = noise_of(&clean, Noise::Decibels(decibels));
        let bound = bound(&clean, truth, sigma);
        let errors: Vec<[[f64; 5]; 2]> = (0..cases(50, 200))
            .into_par_iter()
            .map(|seed| {
                let noisy = with_noise(&clean, sigma, seed).unwrap();
                let sm = steiglitz_mcbride(&noisy, Model::default()).unwrap().unwrap().parameters.to_array();
                let space = wide(truth);
                let lm = refined(&noisy, &space, sm, None);
                // The optimum is that of a refinement from the truth, and with known σ the estimate is the same.
                let other = refined(&noisy, &space, truth, None);
                let known = refined(&noisy, &space, truth, Some(sigma));
                for p in 0..5 {
                    assert!((lm.values[p] - other.values[p]).abs() <= 1e-3 * bound[p], "{decibels} dB, seed {seed}");
                    assert!((lm.values[p] - known.values[p]).abs() <= 0.1 * bound[p], "{decibels} dB, seed {seed}");
                }
                [sm, [0, 1, 2, 3, 4].map(|p| lm.values[p])]
                    .map(|v| [0, 1, 2, 3, 4].map(|p| (v[p] - truth[p]) / bound[p]))
            })
            .collect();
        let [sm, lm] = [0, 1].map(|n| rms(&errors.iter().map(|e| e[n]).collect::<Vec<_>>()));
        println!("{decibels} dB: rmse/CRB SM {sm:.2?}, LM {lm:.2?}");
        // Steiglitz–McBride may lose 5 % to the bound.
        let most = rms_most(errors.len());
        assert!(sm.iter().all(|v| *v <= most + 0.05) && lm.iter().all(|v| *v <= most), "{decibels} dB: {sm:?} {lm:?}");
    }
}

/// Returns a random motor within the bounds of Table 2, uniform or log-uniform.
fn random_motor(seed: u64, logarithmic: bool) -> [f64; 5] {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed + 1);
    let bounds = Space::table2().bounds();
    std::array::from_fn(|p| {
        let (min, max) = bounds[p];
        if logarithmic { generator.random_range(min.ln()..max.ln()).exp() } else { generator.random_range(min..max) }
    })
}

#[test]
fn a_thousand_random_motors() {
    for (logarithmic, decibels) in [false, true].into_iter().flat_map(|l| [60.0, 40.0, 30.0].map(|d| (l, d))) {
        let one = |seed: u64| {
            let truth = random_motor(seed, logarithmic);
            let step = Excitation::step(10.5, 1.0, 3.0, 1e-3).unwrap();
            let clean = simulated(&Parameters::from_array(truth), &step, Discretization::Zoh).unwrap();
            let sigma = noise_of(&clean, Noise::Decibels(decibels));
            let (noisy, space) = (with_noise(&clean, sigma, seed).unwrap(), wide(truth));
            let best = refined(&noisy, &space, truth, None);
            let at = |n: usize| best.uncertainty.std_error[n].unwrap_or(best.values[n]);
            let bound = bound(&clean, truth, sigma);
            let sm = steiglitz_mcbride(&noisy, Model::default()).unwrap().ok().map(|e| e.parameters.to_array());
            let errors = sm.map(|sm| [0, 1, 2, 3, 4].map(|p| (sm[p] - truth[p]).abs() / bound[p]));
            // Motors that are not identifiable at 30 dB have no unique optimum.
            let knows = best.uncertainty.unidentifiable.is_empty() && best.at_bound.iter().all(Option::is_none);
            let found = identify(std::slice::from_ref(&noisy), &IdentifySpec::default());
            let apart = if knows {
                let found = found.unwrap_or_else(|e| panic!("{truth:?}: {e}"));
                assert_eq!(found.verification.status, Status::Agrees, "{truth:?}");
                let found = found.parameters.to_array();
                (0..5).map(|p| (found[p] - best.values[p]).abs() / at(p)).fold(0.0, f64::max)
            } else {
                0.0
            };
            // Compares the global reference within the bounds of Table 2 with a refinement from the truth.
            let sigma = &best.sigmas;
            let problem = fit_problem(std::slice::from_ref(&noisy), &Space::table2(), Model::default()).unwrap();
            let reference = global_reference(&problem, sigma);
            let local = refined(&noisy, &Space::table2(), truth, Some([sigma[0][0], sigma[0][1]]));
            let gap = reference.unwrap().refined.weighted(sigma) / local.weighted(sigma) - 1.0;
            (errors, apart, gap, knows)
        };
        let all: Vec<_> = (0..cases(100, 1000)).into_par_iter().map(one).collect();
        let count = all.len();
        let served: Vec<[f64; 5]> = all.iter().filter_map(|a| a.0).collect();
        let medians = [0, 1, 2, 3, 4].map(|p| {
            let mut of: Vec<f64> = served.iter().map(|e| e[p]).collect();
            of.sort_by(f64::total_cmp);
            of[of.len() / 2]
        });
        let outliers = served.iter().filter(|e| e.iter().any(|v| *v > 10.0)).count();
        let apart = all.iter().map(|a| a.1).fold(0.0, f64::max);
        let gap = all.iter().map(|a| a.2).fold(f64::NEG_INFINITY, f64::max);
        let unknown = all.iter().filter(|a| !a.3).count();
        println!(
            "log {logarithmic}, {decibels} dB: median |error|/CRB {medians:.2?}, {outliers} outliers, {} without SM, \
             identify apart {apart:.0e}, reference gap {gap:.0e}, {unknown} not identifiable",
            count - served.len()
        );
        // The median of the magnitude of a standard normal number is 0.675, and that of `count` numbers deviates by 0.79/√count; the
        // limit is five deviations above.
        let most = 0.675 + 3.95 / (count as f64).sqrt();
        assert!(medians.iter().all(|m| *m <= most), "{medians:?}");
        let unserved = count - served.len();
        assert!(is_rare(unserved, count, 0.002) && is_rare(outliers, count, 0.005) && is_rare(unknown, count, 0.002));
        assert!(apart <= 1e-3, "the refinement lands elsewhere: {apart}");
        assert!(gap <= 1e-9, "the reference missed the optimum by {gap}");
    }
}

#[test]
fn fits_in_a_local_optimum_are_reported_as_stuck() {
    let one = |seed: u64| {
        let truth = random_motor(seed, true);
        let space = wide(truth);
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed + 5000);
        let start = space.bounds().into_iter().map(|(min, max)| generator.random_range(min.ln()..max.ln()).exp());
        let start: Vec<f64> = start.collect();
        let decibels = [40.0, 20.0, 10.0][usize::try_from(seed % 3).unwrap()];
        let recorded = |excitation: &Excitation| {
            let clean = simulated(&Parameters::from_array(truth), excitation, Discretization::Zoh).unwrap();
            with_noise(&clean, noise_of(&clean, Noise::Decibels(decibels)), seed).unwrap()
        };
        let step = Excitation::step(10.5, 1.0, 3.0, 1e-3).unwrap();
        let time_s: Vec<f64> = (0..1500).map(|n| 1e-3 * f64::from(n)).collect();
        let voltage = time_s.iter().map(|_| generator.random_range(-10.0..10.0)).collect();
        let changing = Excitation { time_s, voltage, torque: None };
        // A step, a voltage that changes at every sample, or both.
        let noisy: Vec<Record> = match seed / 3 % 3 {
            0 => vec![recorded(&step)],
            1 => vec![recorded(&changing)],
            _ => vec![recorded(&step), recorded(&changing)],
        };
        let problem = fit_problem(&noisy, &space, Model::default()).unwrap();
        // A refinement from a remote start may end on a plateau; others go on from there until one changes nothing.
        let mut from = start;
        let fit = loop {
            let fit = refine_on(&problem, &from, None).unwrap();
            let is_same = from.iter().zip(&fit.values).all(|(a, b)| (a / b - 1.0).abs() < 1e-3);
            from.clone_from(&fit.values);
            if is_same {
                break fit;
            }
        };
        // The search of the box that knows nothing of the fit.
        let best = global_reference(&problem, &fit.weights).unwrap().refined;
        let above = fit.weighted(&fit.weights) / best.weighted(&fit.weights) - 1.0;
        (above, verify_at(&noisy, &IdentifySpec { space: space.clone(), ..IdentifySpec::default() }, &from).unwrap())
    };
    let count = cases(600, 6000);
    let all: Vec<_> = (0..count).into_par_iter().map(one).collect();
    for (above, found) in &all {
        // The verdict calls differences up to 1e-6 equal; no optimum is so near to another.
        let expected = if *above > 1e-6 { Status::SearchStuck } else { Status::Agrees };
        assert_eq!(found.status, expected, "the fit is {above:e} above the lowest: {found:?}");
    }
    let stuck = all.iter().filter(|(above, _)| *above > 1e-6).count();
    println!("{stuck} of {count} fits from random starts are in a local optimum");
    assert!(reaches(stuck, all.len(), 1.0 / 60.0) && is_rare(stuck, all.len(), 1.0 / 6.0), "{stuck}");
}

#[test]
fn a_small_search_with_refinement_reaches_the_bound() {
    let clean = m2_record();
    let truth = M2.to_array();
    let sigma = noise_of(&clean, Noise::Decibels(40.0));
    let bound = bound(&clean, truth, sigma);
    let errors: Vec<[f64; 5]> = (0..cases(40, 100))
        .map(|seed| {
            let noisy = with_noise(&clean, sigma, seed).unwrap();
            let spec = IdentifySpec {
                method: Method::from(GwoOptions::default()),
                population: 20,
                generations: 10,
                seed,
                auto_bounds: Vec::new(),
                ..IdentifySpec::default()
            };
            let found = identify(&[noisy], &spec).unwrap();
            assert!(found.verification.refined_agrees, "seed {seed}");
            [0, 1, 2, 3, 4].map(|p| (found.parameters.to_array()[p] - truth[p]) / bound[p])
        })
        .collect();
    let rms = rms(&errors);
    println!("GWO 20×10 then LM at 40 dB: rmse/CRB {rms:.2?}");
    assert!(rms.iter().all(|v| *v <= rms_most(errors.len())), "{rms:?}");
}

#[test]
fn the_refinement_starts_anywhere_in_the_box() {
    let clean = m2_record();
    let sigma = noise_of(&clean, Noise::Decibels(40.0));
    let noisy = with_noise(&clean, sigma, 5).unwrap();
    let best = refined(&noisy, &Space::table2(), M2.to_array(), None);
    let lands = |seed: &u64| {
        let found = refined(&noisy, &Space::table2(), random_motor(*seed, false), None);
        (0..5).all(|p| (found.values[p] - best.values[p]).abs() <= 1e-3 * best.uncertainty.std_error[p].unwrap())
    };
    let count = cases(200, 1000);
    let landed = (0..count).into_par_iter().filter(lands).count();
    println!("{landed} of {count} starts land");
    assert!(reaches(landed, usize::try_from(count).unwrap(), 0.98), "{landed}");
}

#[test]
fn intervals_cover() {
    let clean = m2_record();
    let truth = M2.to_array();
    for [current, speed] in [[40.0, 40.0], [50.0, 30.0], [30.0, 50.0]] {
        let sigma = [noise_of(&clean, Noise::Decibels(current))[0], noise_of(&clean, Noise::Decibels(speed))[1]];
        let covered: Vec<[bool; 5]> = (0..cases(250, 1000))
            .into_par_iter()
            .map(|seed| {
                let fit = refined(&with_noise(&clean, sigma, seed).unwrap(), &wide(truth), truth, None);
                [0, 1, 2, 3, 4].map(|p| {
                    let [low, high] = fit.uncertainty.ci95[p].unwrap();
                    (low..=high).contains(&truth[p])
                })
            })
            .collect();
        let (inside, count) = ([0, 1, 2, 3, 4].map(|p| covered.iter().filter(|c| c[p]).count()), covered.len());
        println!("{current} and {speed} dB: 95 % intervals cover in {inside:?} of {count}");
        // A coverage of 95 % over 1000 seeds has a standard deviation of 0.7 %.
        assert!(inside.iter().all(|inside| covers(*inside, count, [0.93, 0.97])), "{inside:?} of {count}");
    }
}

/// Returns voltages other than a step, with names.
fn excitations(count: u32) -> Vec<(&'static str, Vec<f64>)> {
    let of = |f: &dyn Fn(u32) -> f64| (0..count).map(f).collect::<Vec<f64>>();
    let share = |n: u32| f64::from(n) / f64::from(count);
    vec![
        ("PRBS", of(&|n| if (n / 23).wrapping_mul(2_654_435_761) & 0x1_0000 == 0 { 8.0 } else { -4.0 })),
        ("ramp", of(&|n| 12.0 * share(n))),
        ("sine sweep", of(&|n| 6.0 * (40.0 * std::f64::consts::PI * share(n) * share(n)).sin())),
        ("staircase through zero", of(&|n| [0.0, 6.0, 10.0, 0.0, -5.0, -10.0, 3.0, 0.0][(n * 8 / count) as usize])),
    ]
}

#[test]
fn other_excitations_periods_and_motors_without_flags() {
    let coreless = Parameters { r: 2.0, l: 1e-4, k: 0.01, b: 1e-6, j: 1e-7 };
    let large = Parameters { r: 0.3, l: 0.004, k: 0.8, b: 0.01, j: 0.05 };
    let overdamped = Parameters { r: 0.9, l: 0.001, k: 0.02, b: 1e-4, j: 5e-4 };
    // R/L = B/J + 2K/√(LJ) gives a double pole.
    let repeated = {
        let (l, k, b, j): (f64, f64, f64, f64) = (0.005, 0.05, 1e-3, 1e-3);
        Parameters { r: l * (b / j + 2.0 * k / (l * j).sqrt()) * (1.0 + 1e-9), l, k, b, j }
    };
    for (name, motor, period) in [
        ("M2, 0.1 ms", M2, 1e-4),
        ("M2, 1 ms", M2, 1e-3),
        ("M2, 10 ms", M2, 1e-2),
        ("overdamped", overdamped, 1e-3),
        ("nearly repeated poles", repeated, 1e-3),
        ("tiny coreless", coreless, 1e-4),
        ("large slow", large, 1e-2),
    ] {
        let count = 6000;
        let mut all = excitations(count);
        all.push(("step", (0..count).map(|n| if n < 300 { 0.0 } else { 10.0 }).collect()));
        for (shape, voltage) in all {
            let time_s = (0..count).map(|n| f64::from(n) * period).collect();
            let clean = simulated(&motor, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap();
            let sigma = noise_of(&clean, Noise::Decibels(50.0));
            let noisy = with_noise(&clean, sigma, 3).unwrap();
            let found = match identify(std::slice::from_ref(&noisy), &IdentifySpec::default()) {
                Ok(found) => found,
                Err(error) => {
                    // A failure is allowed only if the parameters are not identifiable at the truth.
                    let best = refined(&noisy, &wide(motor.to_array()), motor.to_array(), None);
                    let tells = best.uncertainty.unidentifiable.is_empty() && best.at_bound.iter().all(Option::is_none);
                    assert!(!tells, "{name}, {shape}: {error}");
                    println!("{name}, {shape}: {error}");
                    continue;
                }
            };
            assert_eq!(found.verification.status, Status::Agrees, "{name}, {shape}");
            for e in found.estimates {
                // Unidentifiable parameters have neither, and are reported.
                let (Some(value), Some(error)) = (e.value, e.std_error) else {
                    assert!(found.warnings.iter().any(|w| w.code == "not_identifiable"), "{name}, {shape}");
                    continue;
                };
                let (truth, symbol) =
                    (motor.get(e.name.parse::<Parameter>().unwrap()), e.name.parse::<Parameter>().unwrap().symbol());
                // Among 175 comparisons five standard errors are exceeded with probability 1e-4.
                assert!(
                    (value - truth).abs() < 5.0 * error,
                    "{name}, {shape}, {symbol}: {value} ± {error} for {truth}"
                );
            }
        }
    }
}

#[test]
fn a_start_in_motion() {
    // The last 2.9 s of a recording whose voltage changes twice, so that it starts in motion.
    let voltage: Vec<f64> = (0..3000).map(|n| if n < 1500 { 9.0 } else { 4.0 }).collect();
    let time_s: Vec<f64> = (0..3000).map(|n| f64::from(n) * 1e-3).collect();
    let clean = simulated(&M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap();
    let sigma = noise_of(&clean, Noise::Decibels(40.0));
    let noisy = with_noise(&clean, sigma, 3).unwrap();
    let mut late = noisy.samples().clone();
    for signal in [Some(&mut late.time_s), Some(&mut late.voltage), late.current.as_mut(), late.speed.as_mut()] {
        signal.unwrap().drain(..100);
    }
    let late = Record::new(late).unwrap();
    for (method, searched) in [(Method::Auto, "sm"), (Method::from(GwoOptions::default()), "gwo")] {
        let found = identify(std::slice::from_ref(&late), &IdentifySpec { method, ..IdentifySpec::default() }).unwrap();
        assert_eq!((found.searched.method, found.verification.status), (searched, Status::Agrees));
        let errors = found.uncertainty.as_ref().unwrap().std_error.clone();
        for p in 0..5 {
            let (value, truth) = (found.parameters.to_array()[p], M2.to_array()[p]);
            assert!((value - truth).abs() < 5.0 * errors[p].unwrap(), "{value} for {truth}");
        }
        let state = [clean.samples().current.as_ref().unwrap()[100], clean.samples().speed.as_ref().unwrap()[100]];
        assert!((found.initial[0][1] - state[1]).abs() < sigma[1], "better than one sample tells: {:?}", found.initial);
    }
}

#[test]
fn a_search_in_a_local_optimum_is_stuck() {
    // The local optimum of the unscaled criterion, with electrical and mechanical dynamics exchanged, has a Euclidean cost of
    // 52.4.
    let spec = |seed| IdentifySpec {
        method: Method::from(GwoOptions::default()),
        polish: Polish::None,
        population: 30,
        generations: 60,
        criterion: Criterion { norm: Norm::Euclidean, scale: Scale::None, ..Criterion::default() },
        auto_bounds: Vec::new(),
        seed,
        ..IdentifySpec::default()
    };
    let runs: Vec<_> = (1..=60).map(|seed| identify(&[m2_record()], &spec(seed)).unwrap()).collect();
    let (trapped, free): (Vec<_>, Vec<_>) = runs.iter().partition(|r| r.cost > 51.0 && r.parameters.l > 0.05);
    println!("{} of 60 are trapped", trapped.len());
    assert!(trapped.len() >= 3);
    for run in trapped {
        assert_eq!(run.verification.status, Status::SearchStuck);
        assert!(run.verification.cost_gap.unwrap() > 1.0);
        assert!(run.warnings.iter().any(|w| w.code == "search_stuck"));
        let reference = run.verification.levenberg_marquardt.unwrap();
        assert!((reference.r / M2.r - 1.0).abs() < 1e-6, "{reference:?}");
    }
    // With a criterion without this local optimum the same search agrees.
    let std = |seed| IdentifySpec { criterion: Criterion::default(), population: 100, generations: 100, ..spec(seed) };
    assert!(
        (1..=10).all(|seed| { identify(&[m2_record()], &std(seed)).unwrap().verification.status == Status::Agrees })
    );
    assert!(free.len() > 20);
    // Parameters given by the caller are verified alike.
    let swapped = verify_at(&[m2_record()], &spec(1), &[1.0, 0.1, 0.0735, 1e-3, 1e-5]).unwrap();
    assert_eq!(swapped.status, Status::SearchStuck);
}

/// Motors with Coulomb friction under a sine: R, L, K, B, J, the friction, the step \[s\] and the angular frequency \[rad/s\]. Without the friction
/// the fit has two optima, and the lower one has the smaller region of attraction.
const TWO_OPTIMA: [[f64; 8]; 3] = [
    [0.18, 0.002969, 0.02379, 2.704e-4, 4.269e-5, 0.1624, 1.341e-4, 199.9],
    [0.333, 0.005696, 0.02072, 2.775e-5, 3.082e-5, 0.09243, 2.607e-4, 194.8],
    [0.1677, 0.003975, 0.02226, 3.314e-4, 3.503e-4, 0.2919, 7.074e-4, 11.94],
];

#[test]
fn a_lower_optimum_with_a_smaller_region_is_found() {
    // A region of attraction of a tenth to a fifth of the box is missed by 24 independent starts in 0.5 to 8 % of cases, by six in 26 to 53 %.
    let one = |seed: u64| {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut near = TWO_OPTIMA[usize::try_from(seed % 3).unwrap()];
        near[..6].iter_mut().for_each(|value| *value *= random.random_range(-0.05_f64..0.05).exp());
        let [r, l, k, b, j, friction, step, frequency] = near;
        let time_s: Vec<f64> = (0..2001).map(|n| step * f64::from(n)).collect();
        let voltage = time_s.iter().map(|time| 8.0 * (frequency * time).sin()).collect();
        let motor = Extended::from(&Parameters { r, l, k, b, j }).with(Parameter::Coulomb, friction);
        let excitation = Excitation { time_s, voltage, torque: None };
        let record = simulated(motor, &excitation, Discretization::Zoh).unwrap();
        let sigma = [record.measured().map(|signal| 0.05 * motorfit::numeric::rms(signal.unwrap())).to_vec()];
        let space = Space::table2_with(&[], &[(Parameter::R, r)]).unwrap();
        let problem = fit_problem(&[record], &space, Model::default()).unwrap();
        let found = global_reference(&problem, &sigma).unwrap();
        let costs: Vec<f64> = (0..100)
            .filter_map(|_| {
                let start: Vec<f64> =
                    space.free().iter().map(|axis| axis.min * (axis.max / axis.min).powf(random.random())).collect();
                Some(refine_coarse(&problem, &start, &sigma).ok()?.weighted(&sigma))
            })
            .collect();
        let lowest = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let region = costs.iter().filter(|cost| **cost < 1.001 * lowest).count();
        // Rough refinements end within a hundredth of a standard error.
        (region, found.is_conclusive() && found.refined.weighted(&sigma) > 1.001 * lowest)
    };
    let count = cases(30, 60);
    let all: Vec<(usize, bool)> = (0..count).into_par_iter().map(one).collect();
    let small = all.iter().filter(|(region, _)| *region < 30).count();
    let wrong = all.iter().filter(|(_, is_wrong)| *is_wrong).count();
    println!("{small} of {count} lowest optima have regions below 30 %; {wrong} were missed by a conclusive reference");
    assert!(reaches(small, all.len(), 2.0 / 3.0), "{small}");
    assert!(is_rare(wrong, all.len(), 0.05), "{wrong}");
}

#[test]
fn one_problem_serves_both_estimates() {
    let clean = m2_record();
    let record = with_noise(&clean, noise_of(&clean, Noise::Decibels(30.0)), 1).unwrap();
    let records = std::slice::from_ref(&record);
    let problem = fit_problem(records, &Space::table2(), Model::default()).unwrap();
    let estimate = steiglitz_mcbride(&record, Model::default()).unwrap().unwrap();
    assert_eq!(steiglitz_mcbride_on(&problem, 0).unwrap(), Ok(estimate));
    let (space, start) = (wide(estimate.parameters.to_array()), estimate.parameters.to_array());
    let on_it = refine_on(&problem.with_space(space.clone()), &start, None).unwrap();
    assert_eq!(on_it, refined(&record, &space, start, None));
    assert!(steiglitz_mcbride_on(&problem, 1).is_err());
    assert!(refine_on(&problem, &start, Some(&[])).is_err());
    let other = Problem::new(records, Model::default(), space, Criterion::default()).unwrap();
    assert!(refine_on(&other, &start, None).is_err() && steiglitz_mcbride_on(&other, 0).is_err());
}

#[test]
fn a_bad_start_is_no_obstacle() {
    // A load torque that steps with the voltage makes the two numerators unidentifiable, which is reported.
    let of = |f: &dyn Fn(u32) -> f64| (0..1500).map(f).collect::<Vec<f64>>();
    let (time_s, voltage) = (of(&|n| f64::from(n) * 1e-3), of(&|n| if n < 200 { 0.0 } else { 8.0 }));
    let torque = Some(of(&|n| if n < 200 { 0.0 } else { 0.02 }));
    let clean = simulated(&M2, &Excitation { time_s, voltage, torque }, Discretization::Zoh).unwrap();
    let sigma = noise_of(&clean, Noise::Decibels(40.0));
    for seed in 0..60 {
        let noisy = with_noise(&clean, sigma, seed).unwrap();
        assert_eq!(steiglitz_mcbride(&noisy, Model::default()).unwrap().unwrap_err(), SmFailure::RankDeficient);
        let found = identify(&[noisy], &IdentifySpec::default()).unwrap();
        let errors = found.uncertainty.as_ref().unwrap().std_error.clone();
        for p in 0..5 {
            let (value, truth) = (found.parameters.to_array()[p], M2.to_array()[p]);
            assert!((value - truth).abs() < 5.0 * errors[p].unwrap(), "seed {seed}: {value} for {truth}");
        }
    }
}

#[test]
fn each_recording_has_its_own_noise() {
    // A good and a noisy recording: the noisy one does not reduce the accuracy, and the intervals still cover.
    let clean = m2_record();
    let truth = M2.to_array();
    let levels = [60.0, 15.0].map(|d| noise_of(&clean, Noise::Decibels(d)));
    let errors: Vec<[f64; 5]> = (0..cases(40, 100))
        .into_par_iter()
        .map(|seed| {
            let records =
                [with_noise(&clean, levels[0], seed).unwrap(), with_noise(&clean, levels[1], seed + 1000).unwrap()];
            let joint = identify(&records, &IdentifySpec::default()).unwrap();
            let alone = identify(&records[..1], &IdentifySpec::default()).unwrap();
            let of = |found: &motorfit::identify::Identification, p: usize| {
                found.uncertainty.as_ref().unwrap().std_error[p].unwrap()
            };
            [0, 1, 2, 3, 4].map(|p| {
                assert!(of(&joint, p) <= 1.001 * of(&alone, p), "seed {seed}");
                (joint.parameters.to_array()[p] - truth[p]) / of(&joint, p)
            })
        })
        .collect();
    let rms = rms(&errors);
    println!("joint fit of 60 and 15 dB: error over standard error {rms:.2?}");
    // Over 100 seeds the rms is 1 ± 0.07; the tolerance is three and a half deviations.
    let tolerance = 2.5 / (errors.len() as f64).sqrt();
    assert!(rms.iter().all(|v| (v - 1.0).abs() < tolerance), "{rms:?}");
}

#[test]
fn default_bounds_are_reported_when_active() {
    // Sampled far too slowly for the inductance: the best fit has a parameter at a bound, which is reported, and the others
    // are given.
    let coarse = Excitation::step(10.5, 1.0, 20.0, 0.1).unwrap();
    let clean = simulated(&M2, &coarse, Discretization::Zoh).unwrap();
    let sigma = noise_of(&clean, Noise::Decibels(40.0));
    let (mut refused, mut given) = (0, 0);
    for seed in 0..20 {
        match identify(&[with_noise(&clean, sigma, seed).unwrap()], &IdentifySpec::default()) {
            Ok(found) => {
                for e in found.estimates {
                    let (Some(value), Some(error)) = (e.value, e.std_error) else { continue };
                    let truth = M2.get(e.name.parse::<Parameter>().unwrap());
                    assert!((value - truth).abs() < 5.0 * error, "seed {seed}: {value} for {truth}");
                    given += 1;
                }
            }
            Err(error) => {
                assert!(
                    error.to_string().contains("do not identify") || error.to_string().contains("not identifiable"),
                    "{error}"
                );
                refused += 1;
            }
        }
    }
    println!("{refused} of 20 refused, {given} parameters given");
    // The widest possible bounds do not panic.
    let all = Parameter::ALL.map(|p| (p, 1e-160, 1e160));
    let spec = IdentifySpec {
        space: Space::table2_with(&all, &[]).unwrap(),
        auto_bounds: Vec::new(),
        ..IdentifySpec::default()
    };
    let _ = identify(&[m2_record()], &spec);
}

#[test]
fn recordings_of_different_kinds_are_one_fit() {
    // A step at 1 ms; a square wave with load torque at 2 ms, starting in motion; speed only at 1 ms.
    let of = |count: u32, f: &dyn Fn(u32) -> f64| (0..count).map(f).collect::<Vec<f64>>();
    let sigma = [0.02, 0.5];
    let make = |period: f64, voltage: Vec<f64>, torque: Option<Vec<f64>>, seed: u64| {
        let time_s = (0..u32::try_from(voltage.len()).unwrap()).map(|n| f64::from(n) * period).collect();
        let clean = simulated(&M2, &Excitation { time_s, voltage, torque }, Discretization::Zoh).unwrap();
        with_noise(&clean, sigma, seed).unwrap()
    };
    let step = make(1e-3, of(2000, &|n| if n < 100 { 0.0 } else { 8.0 }), None, 1);
    let loaded = make(
        2e-3,
        of(1500, &|n| if (n / 150) % 2 == 0 { 9.0 } else { 2.0 }),
        Some(of(1500, &|n| if n > 700 { 0.02 } else { 0.0 })),
        2,
    );
    let cut = |record: &Record, first: usize| {
        let mut samples = record.samples().clone();
        samples.time_s.drain(..first);
        samples.voltage.drain(..first);
        for signal in [&mut samples.torque, &mut samples.current, &mut samples.speed].into_iter().flatten() {
            signal.drain(..first);
        }
        Record::new(samples).unwrap()
    };
    let mut ramp = make(1e-3, of(2000, &|n| 0.005 * f64::from(n)), None, 3).samples().clone();
    ramp.current = None;
    let records = [step, cut(&loaded, 80), Record::new(ramp).unwrap()];
    let joint = identify(&records, &IdentifySpec::default()).unwrap();
    let alone = identify(&records[..1], &IdentifySpec::default()).unwrap();
    let errors = [joint.uncertainty.as_ref().unwrap(), alone.uncertainty.as_ref().unwrap()].map(|u| &u.std_error);
    for p in 0..5 {
        let (value, truth) = (joint.parameters.to_array()[p], M2.to_array()[p]);
        let [joint, alone] = errors.map(|e| e[p].unwrap());
        assert!((value - truth).abs() < 4.5 * joint, "{value} ± {joint} for {truth}");
        assert!(joint < alone, "more data, more certain: {joint} {alone}");
    }
    assert_eq!(joint.verification.status, Status::Agrees);
    assert_eq!((joint.initial[0], joint.initial[2]), ([0.0; 2], [0.0; 2]));
    assert!(joint.initial[1][1] > 50.0, "it starts at speed: {:?}", joint.initial);
    for (found, sigma) in joint.residual_sigma.iter().zip(sigma) {
        assert!((found.unwrap() / sigma - 1.0).abs() < 0.05);
    }
}

#[test]
fn few_samples_are_pointed_out() {
    for (samples, expected) in [(8, true), (40, false)] {
        let step = Excitation::step(10.5, 0.0, 0.01 * f64::from(samples - 1), 0.01).unwrap();
        let clean = simulated(&M2, &step, Discretization::Zoh).unwrap();
        let record = with_noise(&clean, noise_of(&clean, Noise::Decibels(60.0)), 1).unwrap();
        let found = identify(&[record], &IdentifySpec::default()).unwrap();
        assert_eq!(found.warnings.iter().any(|w| w.code == "few_samples"), expected, "{samples} samples");
    }
}

#[test]
fn unidentifiable_parameters_are_a_clear_error() {
    // At constant speed under a constant voltage L and J are not identifiable.
    let (current, speed): (Vec<f64>, Vec<f64>) = (vec![1.182_047; 500], vec![128.0935; 500]);
    let time_s = (0..500).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = vec![10.5; 500];
    let steady = Record::new(Samples {
        time_s,
        voltage,
        torque: None,
        current: Some(current),
        speed: Some(speed),
        ..Samples::default()
    })
    .unwrap();
    let steady = with_noise(&steady, [0.01, 0.5], 1).unwrap();
    let error = identify(&[steady], &IdentifySpec::default()).unwrap_err();
    assert_eq!(error.kind(), motorfit::ErrorKind::NotIdentified);
    assert!(error.to_string().contains("do not identify"), "{error}");
    assert!(error.hint().to_string().contains("voltage is constant"), "{}", error.hint());
}

#[test]
fn every_failure_of_steiglitz_mcbride_is_named() {
    let fails = |record: &Record| match steiglitz_mcbride(record, Model::default()).unwrap() {
        Ok(found) => panic!("{found:?}"),
        Err(failure) => failure,
    };
    let changed = |f: &dyn Fn(&mut Samples)| {
        let mut samples = with_noise(&m2_record(), [0.01, 1.0], 1).unwrap().samples().clone();
        f(&mut samples);
        Record::new(samples).unwrap()
    };
    assert_eq!(fails(&changed(&|s| s.current = None)), SmFailure::ChannelMissing);
    let jitter = |s: &mut Samples| s.time_s.iter_mut().enumerate().for_each(|(n, t)| *t += 2e-4 * (n as f64).sin());
    assert_eq!(fails(&changed(&jitter)), SmFailure::Irregular);
    assert_eq!(fails(&changed(&|s| s.voltage.fill(0.0))), SmFailure::RankDeficient);
    assert_eq!(fails(&changed(&|s| s.speed.iter_mut().flatten().for_each(|v| *v = -*v))), SmFailure::NotAMotor);
    // Poles at −0.9 and 0.8: a pole on the negative real axis has no continuous-time motor.
    let alternating = |s: &mut Samples| {
        let (mut x, mut y) = (0.0, 0.0);
        for n in 0..s.voltage.len() {
            s.current.as_mut().unwrap()[n] = x;
            s.speed.as_mut().unwrap()[n] = y;
            (x, y) = (-0.9 * x + 0.1 * s.voltage[n], 0.8 * y + 0.3 * x);
        }
    };
    assert_eq!(fails(&changed(&alternating)), SmFailure::NoRealLogarithm);
    // A pole at 1.005 is unstable.
    let running = |s: &mut Samples| {
        let (mut x, mut y) = (0.0, 0.0);
        for n in 0..s.voltage.len() {
            s.current.as_mut().unwrap()[n] = x;
            s.speed.as_mut().unwrap()[n] = y;
            (x, y) = (1.005 * x + 0.01 * s.voltage[n], 0.8 * y + 0.3 * x);
        }
    };
    assert_eq!(fails(&changed(&running)), SmFailure::Unstable);
    // Requested by name it fails; `auto` starts from a resampled copy.
    let by_name = IdentifySpec { method: Method::SteiglitzMcBride, ..IdentifySpec::default() };
    assert!(identify(&[changed(&jitter)], &by_name).is_err());
    let found = identify(&[changed(&jitter)], &IdentifySpec::default()).unwrap();
    assert!(found.searched.method == "sm" && found.warnings.iter().all(|w| w.code != "sm_failed"));
    assert_eq!(found.verification.steiglitz_mcbride, None, "no estimate of the recording itself");
}
