//! Proves: fits of recordings that are cropped, filtered, decimated, resampled or masked are unbiased with valid standard
//! errors, over 60 seeds; irregular sampling is simulated with the true steps; offsets are subtracted.
//! Does not prove: preparation of recordings with faults of the drive that the masks do not cover.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small numbers")]

use crate::support;
use crate::support::{changed, m2_record};
use motorfit::estimate::{RefineOptions, Refined, refine};
use motorfit::experiment::{Excitation, simulated, with_noise};
use motorfit::motor::{Discretization, Parameters, Space};
use motorfit::record::{Mask, Offset, Preparation, Quantity, Record, parse_masks};

const TRUTH: [f64; 5] = [0.921_042, 0.007_759, 0.073_472, 0.000_678, 0.000_136];
/// Standard deviations of 40 dB of noise in the M2 recording \[A, rad/s\].
const SIGMA: [f64; 2] = [0.012, 1.04];

fn prepared(record: &Record, preparation: &Preparation) -> Record {
    let mut records = preparation.apply(record).unwrap();
    assert_eq!(records.len(), 1);
    records.pop().unwrap()
}

fn fit(records: &[Record]) -> Refined {
    refine(records, &Space::table2(), &TRUTH, &RefineOptions::default()).unwrap()
}

/// Returns for each parameter the mean and the rms of z = error/(standard error) over recordings with noise.
fn z_scores(clean: &Record, preparation: &Preparation) -> [[f64; 2]; 5] {
    const SEEDS: u64 = 60;
    let mut sums = [[0.0; 2]; 5];
    for seed in 0..SEEDS {
        let found = fit(&[prepared(&with_noise(clean, SIGMA, 1000 + seed).unwrap(), preparation)]);
        for (n, sums) in sums.iter_mut().enumerate() {
            let z = (found.values[n] - TRUTH[n]) / found.uncertainty.std_error[n].unwrap();
            sums[0] += z / SEEDS as f64;
            sums[1] += z * z / SEEDS as f64;
        }
    }
    sums.map(|[mean, square]| [mean, square.sqrt()])
}

/// Returns a recording under persistent steps up and down, without noise.
fn lively(period_s: f64, jitter: f64) -> Record {
    let count = (3.0 / period_s) as u32;
    let time_s: Vec<f64> =
        (0..count).map(|n| period_s * (f64::from(n) + jitter * (f64::from(n) * 2.4).sin())).collect();
    let voltage = time_s.iter().map(|t| [0.0, 10.5, 4.0, -6.0, 8.0, -3.0][(t / 0.5) as usize % 6]).collect();
    simulated(&Parameters::M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap()
}

#[test]
fn filtering_all_signals_alike_gives_no_bias() {
    let filter = |text: &str| Preparation { filter: Some(text.parse().unwrap()), ..Preparation::default() };
    let cases = [
        ("as recorded", Preparation::default()),
        ("Chebyshev 100 Hz", filter("chebyshev:100")),
        ("Butterworth 40 Hz", filter("butterworth:40:3")),
        ("every 4th", Preparation { decimate: Some(4), ..Preparation::default() }),
        ("every 6th", Preparation { decimate: Some(6), ..Preparation::default() }),
        ("370 Hz", Preparation { rate_hz: Some(370.0), ..Preparation::default() }),
        ("250 Hz, filtered", Preparation { rate_hz: Some(250.0), ..filter("butterworth:50:2") }),
        ("cut", Preparation { crop: [Some(0.3), Some(2.2)], ..Preparation::default() }),
    ];
    for (name, preparation) in cases {
        let z = z_scores(&lively(0.001, 0.0), &preparation);
        println!("{name}: {z:.2?}");
        // Over 60 seeds the mean of z is 0 ± .13 and its rms 1 ± .09; the bounds are four standard errors. A filter that
        // removes information makes standard errors too large, hence the low limit of the rms.
        for [mean, rms] in z {
            assert!(mean.abs() < 0.52, "{name}: bias {mean}");
            assert!((0.55..1.36).contains(&rms), "{name}: {rms}");
        }
    }
}

#[test]
fn filters_start_from_rest_or_motion() {
    let filter = Preparation { filter: Some("butterworth:100".parse().unwrap()), ..Preparation::default() };
    let decimate = Preparation { decimate: Some(2), ..Preparation::default() };
    // A start from rest with a voltage at the first sample, and a start in motion.
    let at_once = changed(&lively(0.001, 0.0), |_| ());
    let at_once = Preparation { crop: [Some(0.5), None], ..Preparation::default() }.apply(&at_once).unwrap();
    let time_s: Vec<f64> = (0..2500).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = time_s.iter().map(|t| [10.5, 4.0, -6.0, 8.0, -3.0][(t / 0.5) as usize % 5]).collect();
    let from_rest = simulated(&Parameters::M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh);
    for preparation in [filter, decimate] {
        let z = z_scores(&from_rest.clone().unwrap(), &preparation);
        assert!(z.iter().all(|[mean, rms]| mean.abs() < 0.52 && (0.55..1.36).contains(rms)), "{z:.2?}");
        let moving = Preparation { crop: [Some(0.03), None], ..preparation };
        let z = z_scores(&at_once[0], &moving);
        assert!(z.iter().all(|[mean, rms]| mean.abs() < 0.52 && (0.55..1.36).contains(rms)), "{z:.2?}");
    }
}

#[test]
fn filtering_only_the_outputs_gives_a_bias() {
    // Shows that the tests above can fail: filtering only the outputs delays them against the voltage.
    let clean = lively(0.001, 0.0);
    let preparation = Preparation { filter: Some("butterworth:40:3".parse().unwrap()), ..Preparation::default() };
    let filtered = prepared(&clean, &preparation);
    let one_sided = changed(&filtered, |samples| samples.voltage.clone_from(&clean.samples().voltage));
    let found = fit(&[one_sided]);
    let worst = found.values.iter().zip(TRUTH).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst > 0.1, "{worst}");
    let both = fit(&[filtered]);
    // Without noise the filter's initial transient and rounding errors remain.
    assert!(both.values.iter().zip(TRUTH).all(|(a, b)| (a / b - 1.0).abs() < 1e-8), "{:?}", both.values);
}

#[test]
fn decimation_differs_in_the_third_order_of_the_period() {
    let clean = lively(0.0005, 0.0);
    let error = |every: usize| {
        let found = fit(&[prepared(&clean, &Preparation { decimate: Some(every), ..Preparation::default() })]);
        found.values.iter().zip(TRUTH).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
    };
    let [two, four, eight] = [error(2), error(4), error(8)];
    println!("{two:.2e} {four:.2e} {eight:.2e}");
    // 4 ms are half the electrical time constant. Measured errors: 1.9e-5, 1.0e-6 and 2.5e-8, of third order or better.
    assert!(eight < 4e-5 && four < eight / 8.0 && two < four / 8.0, "{two} {four} {eight}");
    // A zero-order hold of the mean input, without its first moment, biases L by 2.5 % at 4 ms.
    let decimated = prepared(&clean, &Preparation { decimate: Some(8), ..Preparation::default() });
    let level = changed(&decimated, |_| {});
    assert!((fit(&[level]).values[1] / TRUTH[1] - 1.0).abs() > 0.01);
}

#[test]
fn jitter_is_simulated_with_the_true_steps() {
    let z = z_scores(&lively(0.001, 0.04), &Preparation::default());
    assert!(z.iter().all(|[mean, rms]| mean.abs() < 0.52 && (0.64..1.36).contains(rms)), "{z:.2?}");
    let much = lively(0.001, 0.3);
    assert!(!much.steps().step_index.is_empty());
    let z = z_scores(&much, &Preparation::default());
    assert!(z.iter().all(|[mean, rms]| mean.abs() < 0.52 && (0.64..1.36).contains(rms)), "{z:.2?}");
    let regular = prepared(&much, &Preparation { rate_hz: Some(1000.0), ..Preparation::default() });
    assert!(regular.steps().step_index.is_empty() && (regular.period_s() - 0.001).abs() < 1e-9);
    let error = fit(&[regular]).values.iter().zip(TRUTH).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    // The kinks of the current between samples limit cubic interpolation.
    assert!(error < 5e-3, "{error}");
}

#[test]
fn masks_exclude_their_samples() {
    let clean = lively(0.001, 0.0);
    let clipped = changed(&clean, |s| s.current.as_mut().unwrap().iter_mut().for_each(|i| *i = i.clamp(-3.0, 3.0)));
    let biased = fit(std::slice::from_ref(&clipped)).values[0] / TRUTH[0] - 1.0;
    assert!(biased.abs() > 0.02, "it matters: {biased}");
    let times = clipped.samples().time_s.clone();
    let current = clipped.measured()[0].unwrap().to_vec();
    let masks: Vec<Mask> = times
        .iter()
        .zip(&current)
        .filter(|(_, i)| i.abs() >= 3.0)
        .map(|(t, _)| Mask::Time { channels: [true, false], from: t - 1e-4, to: t + 1e-4 })
        .collect();
    let masked = prepared(&clipped, &Preparation { mask: masks, ..Preparation::default() });
    let found = fit(std::slice::from_ref(&masked));
    assert!(found.values.iter().zip(TRUTH).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{:?}", found.values);
    // Masked values have no effect, in any evaluator.
    let odd = changed(&clean, |s| s.speed.as_mut().unwrap()[1000..1100].fill(1e6));
    let mask = parse_masks(&["speed@1:1.0995".to_owned()]).unwrap();
    let found = fit(&[prepared(&odd, &Preparation { mask, ..Preparation::default() })]);
    assert!(found.values.iter().zip(TRUTH).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{:?}", found.values);
    for (text, part) in
        [("1", "not FROM:TO"), ("2:1", "ends before"), ("power@1:2", "neither"), ("a:2", "expected a number")]
    {
        assert!(parse_masks(&[text.to_owned()]).unwrap_err().to_string().contains(part), "{text}");
    }
}

#[test]
fn masked_samples_count_nowhere() {
    use motorfit::criterion::{Criterion, Norm, Scale};
    use motorfit::evaluate::{Model, Scalar, Simd};
    let clean = with_noise(&lively(0.001, 0.0), SIGMA, 1).unwrap();
    let mask = parse_masks(&["current@0.4:0.7".to_owned(), "1.2:1.3".to_owned()]).unwrap();
    let masked = prepared(&clean, &Preparation { mask, ..Preparation::default() });
    let odd = {
        let with = changed(&clean, |s| {
            s.current.as_mut().unwrap()[400..=700].fill(77.0);
            s.speed.as_mut().unwrap()[1200..=1300].fill(-300.0);
            s.current.as_mut().unwrap()[1200..=1300].fill(-9.0);
        });
        let mask = parse_masks(&["current@0.4:0.7".to_owned(), "1.2:1.3".to_owned()]).unwrap();
        prepared(&with, &Preparation { mask, ..Preparation::default() })
    };
    let candidates = support::uniform(50, 3);
    for norm in support::NORMS {
        let criterion = Criterion { norm, scale: Scale::None, ..Criterion::default() };
        let costs = |record: &Record| {
            let problem = support::problem(std::slice::from_ref(record), Model::default(), criterion);
            let oracle = support::costs(&mut Scalar, &problem, &candidates);
            let simd = support::costs(&mut Simd::default(), &problem, &candidates);
            assert!(oracle.iter().zip(&simd).all(|(a, b)| (a - b).abs() <= 1e-12 * a.abs()), "{norm:?}");
            oracle
        };
        assert_eq!(costs(&masked), costs(&odd), "{norm:?}");
        assert_ne!(costs(&masked), costs(&clean));
    }
    // The mean is over unmasked samples; 101 are masked in all channels.
    let mse = Criterion { norm: Norm::Mse, scale: Scale::None, ..Criterion::default() };
    let ise = Criterion { norm: Norm::Ise, ..mse };
    let cost = |criterion| {
        let problem = support::problem(std::slice::from_ref(&masked), Model::default(), criterion);
        support::costs(&mut Scalar, &problem, &candidates)[0]
    };
    let counted = cost(ise) / 0.001 / cost(mse);
    assert!((counted - (clean.len() as f64 - 101.0)).abs() < 1e-6, "{counted}");
}

#[test]
fn offsets_and_cuts() {
    let clean = m2_record();
    let shifted = changed(&clean, |s| {
        s.current.as_mut().unwrap().iter_mut().for_each(|i| *i += 0.2);
        s.speed.as_mut().unwrap().iter_mut().for_each(|w| *w -= 1.5);
    });
    let auto = prepared(&shifted, &Preparation { offset: Offset::Auto, ..Preparation::default() });
    let given = Offset::Given(vec![(Quantity::Current, 0.2), (Quantity::Speed, -1.5)]);
    for record in [auto, prepared(&shifted, &Preparation { offset: given, ..Preparation::default() })] {
        let pairs = record.measured().into_iter().zip(clean.measured());
        for (ours, theirs) in pairs {
            assert!(ours.unwrap().iter().zip(theirs.unwrap()).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        assert!(record.source().notes[0].contains("offsets subtracted"), "{:?}", record.source().notes);
    }
    let moving = Preparation { crop: [Some(1.5), None], offset: Offset::Auto, ..Preparation::default() };
    let record = prepared(&shifted, &moving);
    assert!(record.source().notes[1].contains("no rest"), "{:?}", record.source().notes);
    assert_eq!((record.len(), record.samples().time_s[0]), (1501, clean.samples().time_s[1500]));
    let nothing = Preparation { crop: [Some(5.0), Some(6.0)], ..Preparation::default() };
    assert!(nothing.apply(&clean).unwrap_err().to_string().contains("from 0 s to 3 s"));
    for bad in [
        Preparation { rate_hz: Some(0.0), ..Preparation::default() },
        Preparation { rate_hz: Some(f64::NAN), ..Preparation::default() },
        Preparation { rate_hz: Some(1e12), ..Preparation::default() },
        Preparation { rate_hz: Some(1e-3), ..Preparation::default() },
        Preparation { decimate: Some(2000), ..Preparation::default() },
        Preparation { filter: Some("butterworth:600".parse().unwrap()), ..Preparation::default() },
    ] {
        assert!(!bad.apply(&clean).unwrap_err().hint().is_empty());
    }
}

#[test]
fn prepared_and_plain_recordings_fit_together() {
    let clean = lively(0.001, 0.0);
    let decimated = prepared(&clean, &Preparation { decimate: Some(3), ..Preparation::default() });
    let found = fit(&[decimated, clean]);
    assert!(found.values.iter().zip(TRUTH).all(|(a, b)| (a / b - 1.0).abs() < 1e-4), "{:?}", found.values);
}
