//! Proves: the selection among the optional terms of a model finds those of the simulated machine; the score test names a term that is
//! left out, and seldom one where the model is complete; one that the machine does not have is no reason against a result; named and generic terms, and errors of names; the program with them, and the
//! mask `auto` of wrong samples.
//! Does not prove: that the selection finds terms whose effect is near the noise.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]

use crate::support::program::{Folder, json, ok};
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::identify::model::{ModelIdentification, ModelSpec, ModelTerms, identify_model};
use motorfit::model::Model;
use motorfit::numeric::{count, standard_deviation};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use std::ops::ControlFlow;

/// A drive with dry friction, drag and a constant load, each optional.
const DRIVE: &str = r#"
format = 1
name = "Drive"
[inputs]
u = { unit = "V" }
[parameters]
k = { unit = "rad/s^2/V", min = 1, max = 1000, log = true }
b = { unit = "1/s", min = 0.1, max = 100, log = true }
Tc = { unit = "rad/s^2", min = 0, max = 200, neutral = 0, term = "coulomb" }
D = { unit = "1/rad", min = 0, max = 1, neutral = 0, term = "drag" }
load = { unit = "rad/s^2", min = -100, max = 100, neutral = 0 }
[states]
w = { unit = "rad/s", d = "k*u - b*w - D*w*abs(w) - load - stick(w, Tc)", initial = 0 }
[outputs]
w = { value = "w", unit = "rad/s" }
"#;

/// Terms with the values of their parameters, of some standard errors of the parameters they would bias.
const TRUE: [(&str, usize, f64); 3] = [("coulomb", 2, 15.0), ("drag", 3, 0.02), ("load", 4, 12.0)];

/// Returns the terms of a number between 0 and 7, a bit for each.
fn terms(number: usize) -> Vec<String> {
    TRUE.iter().enumerate().filter(|(n, _)| number >> n & 1 == 1).map(|(_, (name, ..))| (*name).to_owned()).collect()
}

/// Returns a recording of the drive with some terms, with noise of 34 dB.
fn recorded(number: usize, seed: u64) -> ModelRecording {
    let model = Model::parse(DRIVE).unwrap();
    let levels = [0.0, 6.0, 2.0, -3.0, 0.0, -9.0, 9.0, 4.0, -1.0, -5.0];
    let time_s: Vec<f64> = (0..1200).map(|n| 2e-3 * count(n)).collect();
    let input: Vec<f64> = (0..1200).map(|n| levels[n / 60 % levels.len()]).collect();
    let mut recording = ModelRecording::to_simulate(&model, time_s, vec![input]).unwrap();
    let mut values = [40.0, 5.0, 0.0, 0.0, 0.0];
    for (n, (_, place, value)) in TRUE.iter().enumerate() {
        values[*place] = if number >> n & 1 == 1 { *value } else { 0.0 };
    }
    // With short steps: the recording is no imitation of the fit.
    let settings =
        ModelSettings { method: Some((motorfit::model::IntegrationMethod::RungeKutta, 8)), ..ModelSettings::default() };
    let problem = ModelProblem::new(&model, ModelSpace::all_fixed(&values), vec![recording.clone()], settings).unwrap();
    let mut signal = problem.simulate(&[], 0, problem.open_initial(0)).outputs.remove(0);
    let sigma = 0.02 * standard_deviation(&signal);
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1000 * seed + number as u64);
    for value in &mut signal {
        let normal: f64 = StandardNormal.sample(&mut numbers);
        *value += sigma * normal;
    }
    recording.measured = vec![Some(signal)];
    recording
}

fn identified(recording: &ModelRecording, with: ModelTerms) -> ModelIdentification {
    let model = Model::parse(DRIVE).unwrap();
    let spec = ModelSpec { with, ..ModelSpec::default() };
    identify_model(&model, std::slice::from_ref(recording), &spec, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Returns the warning about a missing term.
fn incomplete(found: &ModelIdentification) -> Option<String> {
    let warning = found.warnings.iter().find(|warning| warning.code == "model_incomplete")?;
    assert!(found.trust.reasons.iter().any(|reason| reason.code == "model_incomplete"));
    Some(warning.message.to_string())
}

#[test]
fn the_selection_finds_the_terms_of_the_machine() {
    let mut wrong = Vec::new();
    for number in 0..8 {
        for seed in 0..5 {
            let found = identified(&recorded(number, seed), ModelTerms::Auto);
            let mut with = found.with.clone();
            with.sort();
            let selection = found.selection.as_ref().unwrap();
            assert_eq!(selection.iter().filter(|step| step.taken).count(), 1 + found.with.len());
            if with != terms(number) {
                wrong.push((number, seed, with));
            }
        }
    }
    eprintln!("wrong selections of 40: {wrong:?}");
    // Odds of 20 to 1 are required for each of at most three terms.
    assert!(wrong.len() <= 2, "{wrong:?}");
}

#[test]
fn a_term_that_the_machine_does_not_have_ends_where_it_has_no_effect() {
    let (mut idle, mut known) = (0, 0);
    for seed in 0..10 {
        let found = identified(&recorded(0, seed), ModelTerms::These(vec!["drag".to_owned()]));
        let has = |code: &str| found.warnings.iter().any(|warning| warning.code == code);
        let drag = found.estimates.iter().find(|e| e.name == "D").unwrap();
        // As of the motor: no reason against the result.
        let is_blamed = found.trust.reasons.iter().any(|reason| reason.code == "at_bound");
        assert_eq!((has("at_bound"), is_blamed), (false, false), "{:?}", found.trust);
        assert_eq!(has("extension_idle"), drag.at_bound.is_some());
        idle += u32::from(drag.at_bound.is_some());
        known += u32::from(drag.std_error.is_some());
    }
    // The estimate of a drag of zero is at its bound for half of the seeds; ten have 5 ± 1.6.
    assert!((2..=8).contains(&idle) && idle + known == 10, "{idle} idle, {known} with errors");
}

#[test]
fn a_missing_term_is_named_and_a_complete_model_seldom_blamed() {
    let (mut alarms, mut wrong, mut named) = (Vec::new(), Vec::new(), 0);
    for number in 0..8 {
        for seed in 10..20 {
            let recording = recorded(number, seed);
            if let Some(message) = incomplete(&identified(&recording, ModelTerms::These(terms(number)))) {
                alarms.push((number, seed, message));
            }
        }
        for (n, (name, ..)) in TRUE.iter().enumerate().filter(|(n, _)| number >> n & 1 == 1) {
            let without = terms(number & !(1 << n));
            let found = identified(&recorded(number, 20), ModelTerms::These(without.clone()));
            let next = found.trust.next.as_ref().unwrap().spelled(motorfit::report::command_line);
            assert!(next.contains("--with"), "{next}");
            match incomplete(&found) {
                Some(message) if message.contains(name) => named += 1,
                // Where the residuals are strongly correlated, they have too little weight for one term.
                None => assert!(found.trust.reasons.iter().any(|of| of.code == "residuals"), "{:?}", found.trust),
                Some(message) => wrong.push((number, *name, message)),
            }
        }
    }
    eprintln!("false alarms of 80: {alarms:?}; named {named} of 12, wrong {wrong:?}");
    assert!(alarms.len() <= 2, "{alarms:?}");
    assert!(named >= 6 && wrong.is_empty(), "{named} {wrong:?}");
}

#[test]
fn terms_are_named_and_unknown_names_are_errors() {
    let recording = recorded(3, 1);
    let found = identified(&recording, ModelTerms::parse(&["coulomb".to_owned(), " drag".to_owned()]).unwrap());
    assert_eq!(found.with, ["coulomb", "drag"]);
    assert!(found.selection.is_none());
    let fixed: Vec<bool> = found.estimates.iter().map(|estimate| estimate.fixed).collect();
    assert_eq!(fixed, [false, false, false, false, true]);
    assert!((found.estimates[2].value.unwrap() - 15.0).abs() < 4.0 * found.estimates[2].std_error.unwrap());
    let all = identified(&recording, ModelTerms::parse(&[]).unwrap());
    assert_eq!((all.with.len(), all.space.free.len()), (3, 5));
    assert_eq!(identified(&recording, ModelTerms::parse(&["none".to_owned()]).unwrap()).space.free.len(), 2);
    let model = Model::parse(DRIVE).unwrap();
    let spec = ModelSpec { with: ModelTerms::These(vec!["coulom".to_owned()]), ..ModelSpec::default() };
    let error = identify_model(&model, &[recording], &spec, &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(error.hint().to_string().contains("coulomb"), "{error}");
    assert!(ModelTerms::parse(&["auto".to_owned(), "drag".to_owned()]).is_err());
    // Nothing is fitted where costs are evaluated.
    assert!(ModelSpec { with: ModelTerms::Auto, ..ModelSpec::default() }.space(&model, 1).is_err());
}

#[test]
fn generic_terms_are_selected_after_those_of_the_model() {
    // The sensor shows 3 rad/s too much, which no term of the text explains.
    let mut recording = recorded(2, 7);
    recording.measured[0].as_mut().unwrap().iter_mut().for_each(|value| *value += 3.0);
    let found = identified(&recording, ModelTerms::Auto);
    assert_eq!(found.with, ["offset", "drag"], "{:?}", found.selection);
    let offset = found.estimates.iter().find(|estimate| estimate.name == "offset_w").unwrap();
    assert!((offset.value.unwrap() - 3.0).abs() < 4.0 * offset.std_error.unwrap(), "{offset:?}");
    // By name too; a model without it is blamed, or its residuals are.
    let named = identified(&recording, ModelTerms::These(vec!["offset".to_owned(), "drag".to_owned()]));
    assert!((named.estimates[5].value.unwrap() - 3.0).abs() < 4.0 * named.estimates[5].std_error.unwrap());
    let without = identified(&recording, ModelTerms::These(vec!["drag".to_owned()]));
    assert_ne!(without.trust.level, motorfit::identify::TrustLevel::Good);
}

/// Returns a file of a recording as CSV.
fn csv(recording: &ModelRecording) -> String {
    let rows = recording.time_s.iter().zip(&recording.inputs[0]).zip(recording.measured[0].as_ref().unwrap());
    let rows = rows.map(|((time, u), w)| format!("{time:?},{u:?},{w:?}\n"));
    format!("time,u,w\n{}", rows.collect::<String>())
}

#[test]
fn the_program_selects_and_masks() {
    let folder = Folder::new();
    let model = folder.file("drive.toml", DRIVE);
    let recording = recorded(1, 3);
    let good = folder.file("good.csv", csv(&recording));
    let found = json(&["identify", &good, "--model", &model, "--with", "auto", "--json"]);
    assert_eq!(found["with"], serde_json::json!(["coulomb"]));
    assert_eq!(found["ladder"][0]["with"], serde_json::json!([]));
    assert!(
        found["ladder"].as_array().unwrap().iter().any(|step| step["taken"] == true && step["with"][0] == "coulomb")
    );
    assert!(found["ladder"][1]["fit_percent"]["w"].is_number() && found["alternatives"].is_array());
    let text = ok(&["identify", &good, "--model", &model, "--with", "auto", "-v"]);
    assert!(text.contains("coulomb; ") && text.contains("Model selection") && text.contains("ΔBIC"), "{text}");
    // Without a selection the keys are empty.
    let plain = json(&["identify", &good, "--model", &model, "--json"]);
    assert!(plain["ladder"].is_null() && plain["with"].as_array().unwrap().len() == 3);
    let mut spoiled = recording;
    for n in [150, 407, 408, 700, 1015] {
        spoiled.measured[0].as_mut().unwrap()[n] += 200.0;
    }
    let bad = folder.file("bad.csv", csv(&spoiled));
    let fit = |found: &serde_json::Value| {
        let k = &found["parameters"]["k"];
        ((k["value"].as_f64().unwrap() - 40.0) / k["std_error"].as_f64().unwrap(), found["trust"]["level"].clone())
    };
    let (_, without) = fit(&json(&["identify", &bad, "--model", &model, "--with", "coulomb", "--json"]));
    let (error, with) =
        fit(&json(&["identify", &bad, "--model", &model, "--with", "coulomb", "--mask", "auto", "--json"]));
    assert_eq!((without, with), ("poor".into(), "good".into()));
    assert!(error.abs() < 4.0, "{error}");
}
