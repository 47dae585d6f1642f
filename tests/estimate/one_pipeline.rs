//! Proves: the DC motor as a user's model gives the values, standard errors, level of trust and reasons of the built-in motor, on good
//! recordings and on spoiled ones; a recording that is given twice, and recordings of different motors, are found for both.
//! Does not prove: checks that the built-in motor has alone, which are listed in `ALONE`.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use crate::support::{changed, of_model};
use motorfit::analysis::record_warnings;
use motorfit::criterion::Noise;
use motorfit::evaluate::model::ModelRecording;
use motorfit::evaluate::{Initial, Model as Simulated};
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::identify::{Identification, IdentifySpec, TrustLevel, TrustReason, identify};
use motorfit::model::{BuiltIn, Model};
use motorfit::motor::{Axis, Discretization, Parameter, Parameters, Scope, Space};
use motorfit::numeric::count;
use motorfit::record::{FINDINGS, Mask, Record, Samples, parse_masks};
use motorfit::warning::Warning;
use std::ops::ControlFlow;

/// Reasons of checks that one of the two has alone.
const ALONE: [&str; 4] = ["late_voltage", "model_incomplete", "outliers", "between_samples"];

/// Returns a recording of a motor from rest, with noise of 40 dB.
fn recorded(motor: &Parameters, (high, low): (f64, f64), seed: u64) -> Record {
    let mut voltage: Vec<f64> = (0..1000).map(|n| if (n / 130) % 2 == 0 { high } else { low }).collect();
    voltage[..50].fill(0.0);
    let time_s = (0..1000).map(|n| 1e-3 * count(n)).collect();
    let clean = simulated(motor, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap();
    with_noise(&clean, noise_of(&clean, Noise::Decibels(40.0)), seed).unwrap()
}

type Both = (motorfit::Result<Identification>, motorfit::Result<ModelIdentification>);

/// Identifies the motor by both.
fn both(records: &[Record]) -> Both {
    // Both from rest, without initial states to estimate.
    let model = Model::parse(&BuiltIn::DcMotor.source().replace("\"measured\"", "0")).unwrap();
    let recordings: Vec<ModelRecording> = records.iter().map(of_model).collect();
    let found = identify_model(&model, &recordings, &ModelSpec::default(), &mut |_| ControlFlow::Continue(()));
    (identify(records, &IdentifySpec::default()), found)
}

fn codes(reasons: &[TrustReason]) -> Vec<&'static str> {
    let mut codes: Vec<&str> = reasons.iter().map(|reason| reason.code).filter(|code| !ALONE.contains(code)).collect();
    codes.sort_unstable();
    codes
}

#[test]
fn warnings_about_results_are_those_of_the_motor() {
    let wave = |samples: &mut Samples| {
        let of = |(n, value): (usize, &mut f64)| *value += 2.0 * (0.02 * count(n)).sin();
        samples.speed.iter_mut().flatten().enumerate().for_each(of);
    };
    let record = recorded(&Parameters::M2, (8.0, -4.0), 3);
    let (one, late) = (changed(&record, wave), changed(&record, |samples| samples.voltage.rotate_right(4)));
    // The inductance ends at a bound that it does not fit.
    let axis = |parameter: Parameter| if parameter == Parameter::L { [0.02, 0.1] } else { [1e-6, 1e3] };
    let free = Parameter::ALL.map(|parameter| {
        let [min, max] = axis(parameter);
        Axis { parameter, scope: Scope::Shared, min, max }
    });
    let bounded = IdentifySpec {
        space: Space::new(free.to_vec(), Vec::new()).unwrap(),
        auto_bounds: Vec::new(),
        ..IdentifySpec::default()
    };
    let own_bounds = Parameter::ALL.map(|p| (p.symbol().to_owned(), axis(p))).to_vec();
    let model_bounded = ModelSpec { bounds: own_bounds, ..ModelSpec::default() };
    let model = Model::parse(&BuiltIn::DcMotor.source().replace("\"measured\"", "0")).unwrap();
    let known = ["at_bound", "poor_fit", "residuals_not_white", "residuals_follow_voltage", "not_converged"];
    for (name, record, spec, model_spec, expected) in [
        ("right", &record, IdentifySpec::default(), ModelSpec::default(), vec![]),
        ("wave", &one, IdentifySpec::default(), ModelSpec::default(), vec!["residuals_not_white"]),
        (
            "late",
            &late,
            IdentifySpec::default(),
            ModelSpec::default(),
            vec!["residuals_follow_voltage", "residuals_not_white"],
        ),
        ("bound", &record, bounded, model_bounded, vec!["at_bound", "residuals_follow_voltage", "residuals_not_white"]),
    ] {
        let own = identify(std::slice::from_ref(record), &spec).unwrap();
        let recordings = [of_model(record)];
        let found = identify_model(&model, &recordings, &model_spec, &mut |_| ControlFlow::Continue(())).unwrap();
        let codes = |warnings: &[Warning]| {
            let mut codes: Vec<&str> = warnings.iter().map(|w| w.code).filter(|code| known.contains(code)).collect();
            codes.sort_unstable();
            codes
        };
        assert_eq!(codes(&own.warnings), expected, "{name}");
        assert_eq!(codes(&found.warnings), expected, "{name}: {:?}", found.warnings);
    }
}

#[test]
fn the_motor_as_a_model_is_judged_as_the_motor() {
    let motor = Parameters::M2;
    let other = Parameters { k: 1.05 * motor.k, ..motor };
    let one = recorded(&motor, (8.0, -4.0), 3);
    let coloured = |samples: &mut Samples| {
        // A slow wave beside the noise: the model lacks it.
        let wave = |(n, value): (usize, &mut f64)| *value += 2.0 * (0.02 * count(n)).sin();
        samples.speed.iter_mut().flatten().enumerate().for_each(wave);
    };
    let late = |samples: &mut Samples| samples.voltage.rotate_right(4);
    let cases = [
        ("one recording", vec![one.clone()]),
        ("two of one motor", vec![one.clone(), recorded(&motor, (5.0, -2.0), 4)]),
        ("two motors", vec![one.clone(), recorded(&other, (5.0, -2.0), 4)]),
        ("three, one of another motor", {
            vec![one.clone(), recorded(&other, (5.0, -2.0), 4), recorded(&motor, (7.0, -3.0), 5)]
        }),
        ("a speed that is too large", {
            let scale = |samples: &mut Samples| samples.speed.iter_mut().flatten().for_each(|w| *w *= 1.05);
            vec![one.clone(), changed(&recorded(&motor, (5.0, -2.0), 4), scale)]
        }),
        ("a wave in the speed", vec![changed(&one, coloured)]),
        ("a late voltage", vec![changed(&one, late)]),
    ];
    for (name, records) in cases {
        let (own, found) = both(&records);
        let (own, found) = (own.unwrap(), found.unwrap());
        let reasons = [codes(&own.trust.reasons), codes(&found.trust.reasons)];
        let errors = &own.uncertainty.as_ref().unwrap().std_error;
        let of_model = &found.uncertainty.as_ref().unwrap().std_error;
        for ((found, own), (of_model, error)) in found.values.iter().zip(&own.values).zip(of_model.iter().zip(errors)) {
            let (of_model, error) = (of_model.unwrap(), error.unwrap());
            // Both end within 1e-6 standard errors of the optimum of their weights, which rounds of weights leave at 1e-6 of σ. The
            // sandwich estimate depends on an autoregression of the residuals.
            assert!((found - own).abs() < 1e-3 * error, "{name}: {found} {own} ± {error}");
            assert!((of_model / error - 1.0).abs() < 1e-2, "{name}: ± {of_model}, {error}");
        }
        assert_eq!(reasons[0], reasons[1], "{name}");
        assert_eq!(own.trust.level, found.trust.level, "{name}: {:?} {:?}", own.trust, found.trust);
    }
}

#[test]
fn findings_about_recordings_are_those_of_the_motor() {
    let one = recorded(&Parameters::M2, (8.0, -4.0), 3);
    let spikes = |samples: &mut Samples| [200, 411, 702].map(|n| samples.current.as_mut().unwrap()[n] += 40.0);
    let held = |samples: &mut Samples| {
        let speed = samples.speed.as_mut().unwrap();
        (0..speed.len()).for_each(|n| speed[n] = speed[n - n % 5]);
    };
    let coarse =
        |samples: &mut Samples| samples.speed.iter_mut().flatten().for_each(|w| *w = (*w / 10.0).round() * 10.0);
    let reversed = |samples: &mut Samples| samples.current.iter_mut().flatten().for_each(|i| *i = -*i);
    let offset = |samples: &mut Samples| samples.current.iter_mut().flatten().for_each(|i| *i += 3.0);
    let cases = [
        ("outliers", changed(&one, |samples| _ = spikes(samples))),
        ("held_samples", changed(&one, held)),
        ("coarse_quantization", changed(&one, coarse)),
        ("sign_reversed", changed(&one, reversed)),
        ("rest_offset", changed(&one, offset)),
    ];
    let of_recordings = |warnings: &[Warning]| -> Vec<&'static str> {
        let own = warnings.iter().filter(|warning| FINDINGS.iter().any(|(code, _)| *code == warning.code));
        own.map(|warning| warning.code).collect()
    };
    for (code, record) in cases {
        let (_, found) = both(std::slice::from_ref(&record));
        let found = found.unwrap();
        let own = of_recordings(&record_warnings(&record));
        assert!(own.contains(&code), "{code}: {own:?}");
        assert_eq!(own, of_recordings(&found.warnings), "{code}");
        assert_ne!(found.trust.level, TrustLevel::Good, "{code}");
    }
}

#[test]
fn the_next_step_for_a_clipped_current_leads_to_a_good_result() {
    let model = Model::parse(&BuiltIn::DcMotor.source().replace("\"measured\"", "0")).unwrap();
    let one = recorded(&Parameters::M2, (8.0, -4.0), 3);
    let clip = |samples: &mut Samples| samples.current.iter_mut().flatten().for_each(|i| *i = i.min(4.0));
    let mut recording = of_model(&changed(&one, clip));
    let found = |recording: &ModelRecording| {
        let of = std::slice::from_ref(recording);
        identify_model(&model, of, &ModelSpec::default(), &mut |_| ControlFlow::Continue(())).unwrap()
    };
    let next = found(&recording).trust.next.unwrap().to_string();
    assert!(next.starts_with("Exclude the samples: "), "{next}");
    let items: Vec<String> =
        next.trim_end_matches('.').rsplit([' ', '=']).next().unwrap().split(',').map(str::to_owned).collect();
    let masks = parse_masks(&items).unwrap();
    let is_masked = |time: &f64| {
        masks.iter().any(|mask| matches!(mask, Mask::Time { from, to, .. } if (*from..=*to).contains(time)))
    };
    let kept: Vec<bool> = recording.time_s.iter().map(|time| !is_masked(time)).collect();
    recording.counting = vec![kept; 2];
    assert_eq!(found(&recording).trust.level, TrustLevel::Good, "{next}");
}

#[test]
fn initial_states_are_taken_or_estimated_as_those_of_the_motor() {
    // Begins in motion.
    let record = recorded(&Parameters::M2, (8.0, -4.0), 3).slice(300..1000).unwrap();
    let model = BuiltIn::DcMotor.model().unwrap();
    for (initial, estimates_initial) in [(Initial::Measured, false), (Initial::Free, true)] {
        let spec = IdentifySpec { model: Simulated { initial, ..Simulated::default() }, ..IdentifySpec::default() };
        let own = identify(std::slice::from_ref(&record), &spec).unwrap();
        let spec = ModelSpec { estimates_initial, ..ModelSpec::default() };
        let found = identify_model(&model, &[of_model(&record)], &spec, &mut |_| ControlFlow::Continue(())).unwrap();
        let error = |n: usize| own.uncertainty.as_ref().unwrap().std_error[n].unwrap();
        for (n, (of_model, value)) in found.values.iter().zip(&own.values).enumerate() {
            // As above: both are the optimum of nearly the same weights.
            assert!((of_model - value).abs() < 1e-2 * error(n), "{initial:?}: {of_model}, {value} ± {}", error(n));
        }
        let first = record.measured().map(|signal| signal.unwrap()[0]);
        for ((of_model, value), first) in found.fits[0].initial.iter().zip(own.initial[0]).zip(first) {
            assert!((of_model - value).abs() < 1e-3 * value.abs(), "{initial:?}: {of_model}, {value}");
            assert_eq!(value.to_bits() == first.to_bits(), !estimates_initial, "{initial:?}: {value}, {first}");
        }
    }
}

#[test]
fn a_machine_with_a_position_is_not_judged_as_a_motor() {
    // Its current is reversed, which the rules of the motor would report.
    let text = BuiltIn::DcMotor
        .source()
        .replace("\"measured\"", "0")
        .replace("[states]", "[states]\nq = { unit = \"rad\", d = \"w\", initial = 0 }");
    let model = Model::parse(&text).unwrap();
    let one = recorded(&Parameters::M2, (8.0, -4.0), 3);
    let reversed = changed(&one, |samples| samples.current.iter_mut().flatten().for_each(|i| *i = -*i));
    let spec = ModelSpec { is_polished: false, ..ModelSpec::default() };
    let found = identify_model(&model, &[of_model(&reversed)], &spec, &mut |_| ControlFlow::Continue(())).unwrap();
    assert!(found.warnings.iter().all(|warning| warning.code != "sign_reversed"), "{:?}", found.warnings);
}

#[test]
fn a_recording_that_is_given_twice_is_refused() {
    let one = recorded(&Parameters::M2, (8.0, -4.0), 3);
    let (own, found) = both(&[one.clone(), recorded(&Parameters::M2, (5.0, -2.0), 4), one]);
    let [own, found] = [own.unwrap_err(), found.unwrap_err()];
    assert_eq!((own.to_string(), own.kind()), (found.to_string(), found.kind()));
    assert!(own.to_string().contains("recording 1 and recording 3 are the same recording"), "{own}");
}
