//! Proves: motors as users' models: of fits with a wrong effect, unit, sign, clock or channel at most 1 % are trusted, and 95 % intervals of
//! trusted results of right fits cover in 94 to 96 %. The models are the linear motor, one with dry friction, and one with a position,
//! whose recordings are not examined by the rules of the motor.
//! Does not prove: machines with other channels than a motor, and simulations by other equations than the library's (`machines`); faults
//! in units within wider bounds than two decades.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

use crate::support::joint::{Truth, motor, numbers, records};
use crate::support::of_model;
use crate::support::rates::{cases, covers, is_rare, reaches};
use crate::trust::trusted_wrong_fits;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::TrustLevel;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::model::{BuiltIn, Model};
use motorfit::motor::{Extension, Parameter};
use motorfit::record::Record;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// The models by name, each with the extensions of the motors that it describes.
fn models() -> [(&'static str, Model, &'static [Extension]); 3] {
    let text = BuiltIn::DcMotor.source();
    let friction = text
        .replace("- B*w", "- B*w - stick(w, Tc)")
        .replace("[parameters]", "[parameters]\nTc = { unit = \"N*m\", min = 0, max = 1 }");
    let position = text.replace("[states]", "[states]\nq = { unit = \"rad\", d = \"w\", initial = 0 }");
    [
        ("linear", Model::parse(text).unwrap(), &[]),
        ("friction", Model::parse(&friction).unwrap(), &[Extension::Coulomb]),
        ("position", Model::parse(&position).unwrap(), &[]),
    ]
}

/// Fits a model within bounds of two decades on each side of the true values.
fn fitted(model: &Model, records: &[Record], truth: &Truth) -> motorfit::Result<ModelIdentification> {
    let recordings: Vec<ModelRecording> = records.iter().map(of_model).collect();
    let bounds = model.parameters().iter().map(|of| {
        let value = truth.motor.get(of.name.parse::<Parameter>().unwrap());
        (of.name.clone(), [if of.is_logarithmic { 0.01 * value } else { 0.0 }, 100.0 * value])
    });
    let spec = ModelSpec { bounds: bounds.collect(), ..ModelSpec::default() };
    identify_model(model, &recordings, &spec, &mut |_| ControlFlow::Continue(()))
}

#[test]
fn wrong_fits_of_models_are_not_trusted() {
    let [mut total, mut all] = [0, 0];
    for (name, model, has) in models() {
        let is_good = |records: &[Record], truth: &Truth| {
            fitted(&model, records, truth).is_ok_and(|found| found.trust.level == TrustLevel::Good)
        };
        let [wrong, count] = trusted_wrong_fits(cases(1, 100), has, &is_good);
        println!("{name}: {wrong} of {count} wrong fits trusted");
        [total, all] = [total + wrong, all + count];
    }
    assert!(is_rare(total, all, 0.01), "{total} of {all}, more than 1 %");
}

#[test]
fn intervals_of_trusted_models_cover() {
    let [mut inside, mut intervals] = [0, 0];
    for (name, model, has) in models() {
        let one = |seed: u64| {
            let mut numbers = numbers(20_000 + seed);
            let truth = motor(&mut numbers, has);
            let all = records(&mut numbers, &truth, 800, [40.0, 25.0][usize::from(seed % 2 == 1)]);
            let found = fitted(&model, &all[1..4], &truth).unwrap();
            let covers = found.estimates.iter().filter_map(|of| {
                let true_value = truth.motor.get(of.name.parse::<Parameter>().unwrap());
                of.ci95.map(|[low, high]| (low..=high).contains(&true_value))
            });
            (found.trust.level == TrustLevel::Good, covers.collect::<Vec<bool>>())
        };
        let all: Vec<(bool, Vec<bool>)> = (0..cases(4, 100)).into_par_iter().map(one).collect();
        let good = || all.iter().filter(|(good, _)| *good);
        let own: Vec<bool> = good().flat_map(|(_, covers)| covers.clone()).collect();
        let within = own.iter().filter(|inside| **inside).count();
        println!("{name}: good {} of {}, {within} of {} intervals cover", good().count(), all.len(), own.len());
        [inside, intervals] = [inside + within, intervals + own.len()];
        // As of the built-in motor, of whose right fits 99.5 % are trusted.
        assert!(reaches(good().count(), all.len(), 0.98), "{name}: few right fits are trusted");
    }
    assert!(covers(inside, intervals, [0.94, 0.96]), "{inside} of {intervals}");
}
