//! Proves: given starts of own models are read as several, lead to optima that the search does not find, and change nothing else: neither
//! the other starts nor a result that they do not improve.
//! Does not prove: that a start is better where the steps of the integration matter.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::float_cmp,
    reason = "a test may stop; exact equality is meant"
)]

use motorfit::evaluate::model::ModelRecording;
use motorfit::experiment::white_noise;
use motorfit::identify::Method;
use motorfit::identify::Status;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::model::Model;
use motorfit::numeric::count;
use motorfit::optimize::GwoOptions;
use motorfit::setting::Setting;
use motorfit::settings::{Given, Value, model_spec};
use std::ops::ControlFlow;

/// The gain is that of the machine in an interval of p of some 1e-5, which random candidates miss; elsewhere p has no effect.
const MODEL: &str = r#"
format = 1
name = "Needle"

[inputs]
u = { unit = "1" }

[parameters]
p = { unit = "1", min = 0, max = 1 }
T = { unit = "s", min = 1e-3, max = 0.1, log = true }

[states]
x = { unit = "1", d = "((0.5 + exp(-((p - 0.37)/2e-6)^2))*u - x)/T", initial = 0 }

[outputs]
x = { value = "x", unit = "1" }
"#;
/// Two values of p have the same gain.
const TRUTH: [f64; 2] = [0.370_001, 0.02];
const SAMPLES: usize = 400;

fn recording() -> ModelRecording {
    let input = |n: usize| if (n / 60).is_multiple_of(2) { 1.0 } else { -0.5 };
    let gain = 0.5 + (-0.25_f64).exp();
    let (decay, mut x) = ((-1e-3 / TRUTH[1]).exp(), 0.0);
    let mut signal = white_noise(SAMPLES, 0.01, 1, 0);
    for (n, value) in signal.iter_mut().enumerate() {
        *value += x;
        x = gain * input(n) + (x - gain * input(n)) * decay;
    }
    ModelRecording {
        time_s: (0..SAMPLES).map(|n| count(n) * 1e-3).collect(),
        step_s: vec![1e-3],
        inputs: vec![(0..SAMPLES).map(input).collect()],
        measured: vec![Some(signal)],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

fn start(of: &[(&str, f64)]) -> Vec<(String, f64)> {
    of.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

fn fit(spec: ModelSpec) -> ModelIdentification {
    let model = Model::parse(MODEL).unwrap();
    identify_model(&model, &[recording()], &spec, &mut |_| ControlFlow::Continue(())).unwrap()
}

#[test]
fn each_start_is_tried() {
    let near = start(&[("p", TRUTH[0] + 5e-7), ("T", 0.01)]);
    // Without a refinement the result of a population search is the best candidate of its population.
    for (is_polished, method) in
        [(true, Method::Auto), (false, Method::Auto), (true, Method::Search(GwoOptions::default().into()))]
    {
        let of = |starts: Vec<Vec<(String, f64)>>| {
            fit(ModelSpec { starts, is_polished, method, generations: 10, ..ModelSpec::default() })
        };
        let alone = of(Vec::new());
        assert!(alone.fit_percent[0].unwrap() < 60.0, "the search found it: {:?}", alone.values);
        for starts in [vec![near.clone()], vec![start(&[("p", 0.7)]), near.clone()], vec![near.clone(), Vec::new()]] {
            let found = of(starts);
            // The noise has 1 % of the signal; the standard error of T is some 0.2 %.
            assert!(found.fit_percent[0].unwrap() > 97.0, "{:?}", found.fit_percent);
            assert!((found.values[1] / TRUTH[1] - 1.0).abs() < 0.02, "{:?}", found.values);
            assert_ne!(found.verification.status, Status::Agrees, "no start over the bounds led there");
        }
    }
}

#[test]
fn a_start_that_is_no_better_changes_nothing() {
    for seed in 0..3_u32 {
        let of = |starts: Vec<Vec<(String, f64)>>| fit(ModelSpec { starts, seed: seed.into(), ..ModelSpec::default() });
        let alone = of(Vec::new());
        // Its own estimate, from which a descent ends there up to the last digits.
        let own = start(&[("p", alone.values[0]), ("T", alone.values[1])]);
        let found = of(vec![own]);
        assert_eq!((&found.values, &found.searched, &found.trust), (&alone.values, &alone.searched, &alone.trust));
        let counts = |of: &ModelIdentification| (of.verification.starts, of.verification.arrivals);
        assert_eq!(counts(&found), counts(&alone));
        // Any start: better, or the same.
        let other = of(vec![start(&[("p", 0.1 + 0.2 * f64::from(seed)), ("T", 0.01)])]);
        assert!(other.cost < alone.cost || other.values == alone.values, "{} {}", other.cost, alone.cost);
    }
}

#[test]
fn lists_of_starts_are_read_as_they_are_given() {
    let of = |items: &[&str]| {
        let mut given = Given::default();
        given.put(Setting::Start, Value::List(items.iter().map(|item| (*item).to_owned()).collect()));
        model_spec(&given).map(|spec| spec.starts)
    };
    let pair = |a: f64, b: f64| start(&[("a", a), ("b", b)]);
    // A list, and the same over two items.
    assert_eq!(of(&["a=1,b=2"]).unwrap(), [pair(1.0, 2.0)]);
    assert_eq!(of(&["a=1", "b=2"]).unwrap(), [pair(1.0, 2.0)]);
    // A name again begins another start, wherever it stands in its item.
    assert_eq!(of(&["a=1,b=2", "a=3,b=4"]).unwrap(), [pair(1.0, 2.0), pair(3.0, 4.0)]);
    assert_eq!(of(&["a=1", "b=2,a=3"]).unwrap(), [start(&[("a", 1.0)]), start(&[("b", 2.0), ("a", 3.0)])]);
    assert_eq!(of(&["a=1", "a=2", "b=3"]).unwrap(), [start(&[("a", 1.0)]), pair(2.0, 3.0)]);
    assert_eq!(of(&[]).unwrap(), [] as [Vec<(String, f64)>; 0]);
    // Within one item it is an error.
    let error = of(&["a=1,b=2,a=3"]).unwrap_err().error.to_string();
    assert!(error.contains("gives a twice"), "{error}");
}

#[test]
fn the_response_at_the_first_start_is_beside_the_fit() {
    let of = |text: &str, starts: Vec<Vec<(String, f64)>>| {
        let model = Model::parse(text).unwrap();
        let spec = ModelSpec { starts, ..ModelSpec::default() };
        let found = identify_model(&model, &[recording()], &spec, &mut |_| ControlFlow::Continue(())).unwrap();
        found.fits[0].at_start.clone()
    };
    // Far from the interval the gain is a half; T begins in the middle of its logarithm.
    let mut x = 0.0;
    let expected: Vec<f64> = recording().inputs[0]
        .iter()
        .map(|u| {
            let own = x;
            x = 0.5 * u + (x - 0.5 * u) * (-1e-3_f64 / 0.01).exp();
            own
        })
        .collect();
    let starts = || vec![start(&[("p", 0.7)]), start(&[("p", 0.1), ("T", 0.05)])];
    let usual = MODEL.replace("max = 1 }", "max = 1, value = 0.7 }").replace("max = 0.1,", "max = 0.1, value = 0.01,");
    for found in [of(MODEL, starts()), of(&usual, Vec::new())] {
        let found = found.unwrap();
        let error = found[0].iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Both are exact, up to rounding.
        assert!(error < 1e-12, "{error:e}");
    }
    assert_eq!(of(MODEL, Vec::new()), None, "neither a start nor usual values");
}
