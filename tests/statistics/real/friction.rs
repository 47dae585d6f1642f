//! Six nested models of the friction of a servo, from `examples/friction`, on sixteen recordings.

use crate::support::rates::cases;
use crate::support::recordings::set;
use motorfit::evaluate::model::ModelRecording;
use motorfit::identify::model::{ModelFit, ModelIdentification, ModelSpec, hold_out_model, identify_model};
use motorfit::model::Model;
use motorfit::numeric::standard_deviation;
use std::ops::ControlFlow;
use std::path::Path;

/// Recordings of the fit, and those that are held out: one of each gain of the position control, four different motions. All twelve others
/// would take three times as long.
const FITTED: [(u64, &str); 4] =
    [(100, "lift_and_drop"), (200, "up_and_down"), (400, "sin_sin"), (800, "sin_time_square")];
const HELD_OUT: [(u64, &str); 4] =
    [(100, "sin_time_square"), (200, "lift_and_drop"), (400, "up_and_down"), (800, "sin_sin")];

/// Returns a recording with the gain of its position control and the name of its motion.
fn recording(path: &Path) -> (ModelRecording, (u64, String)) {
    let all: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let entries = all["entries"].as_array().unwrap();
    let column = |of: &dyn Fn(&serde_json::Value) -> f64| entries.iter().map(of).collect::<Vec<f64>>();
    let number = |of: &'static str| column(&|entry| entry[of].as_f64().unwrap());
    let enabled = column(&|entry| f64::from(u8::from(entry["torque_enable"].as_bool().unwrap())));
    let volts = column(&|entry| {
        // The duty of ±885 is stored as an unsigned number of 16 bits.
        let load = entry["load"].as_i64().unwrap();
        let load = if load > 32_767 { load - 65_536 } else { load };
        load as f64 / 885.0 * entry["input_volts"].as_f64().unwrap()
    });
    let volts = volts.iter().zip(&enabled).map(|(volts, enabled)| volts * enabled).collect();
    let constant = |of: &str| vec![all[of].as_f64().unwrap(); entries.len()];
    let time_s = number("timestamp");
    let mut step_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    step_s.push(step_s[step_s.len() - 1]);
    let of = (all["kp"].as_f64().unwrap() as u64, all["trajectory"].as_str().unwrap().to_owned());
    let recording = ModelRecording {
        step_s,
        inputs: vec![volts, enabled, constant("mass"), constant("length")],
        measured: vec![Some(number("position"))],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s,
    };
    (recording, of)
}

/// Returns the root mean square of the residuals relative to the deviation of each recording.
fn error(found: &ModelIdentification, recordings: &[ModelRecording]) -> f64 {
    let of = |(fit, recording): (&ModelFit, &ModelRecording)| {
        let deviation = standard_deviation(recording.measured[0].as_ref().unwrap());
        recording.len() as f64 * (fit.residual_sigma[0].unwrap() / deviation).powi(2)
    };
    let squares: f64 = found.fits.iter().zip(recordings).map(of).sum();
    (squares / recordings.iter().map(ModelRecording::len).sum::<usize>() as f64).sqrt()
}

#[test]
fn nested_models_of_friction_never_explain_less_than_those_they_contain() {
    let Some(folder) = set("rhoban-bam-xl330") else { return };
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|of| of == "json"));
    files.sort();
    let (mut fitted, mut held_out) = (Vec::new(), Vec::new());
    for file in &files {
        let (recording, (gain, motion)) = recording(file);
        let is_among = |list: &[(u64, &str)]| list.contains(&(gain, motion.as_str()));
        if is_among(&FITTED) {
            fitted.push(recording);
        } else if is_among(&HELD_OUT) {
            held_out.push(recording);
        }
    }
    assert_eq!((files.len(), fitted.len(), held_out.len()), (16, 4, 4));
    // Each model, those that it contains, and the values of its further parameters there, by names of theirs or as numbers.
    type Further<'a> = &'a [(&'a str, &'a str)];
    let nested: [(&str, &[usize], Further<'_>); 6] = [
        ("coulomb-viscous", &[], &[]),
        ("stribeck", &[0], &[("Ts", "0")]),
        ("load", &[0], &[("mu", "0")]),
        ("load-stribeck", &[1, 2], &[("Ts", "0"), ("mu", "0"), ("mus", "0")]),
        ("directional", &[3], &[("mum", "mu"), ("mue", "mu"), ("musm", "mus"), ("muse", "mus")]),
        ("quadratic", &[4], &[("qm", "0"), ("qe", "0")]),
    ];
    let mut done: Vec<(Model, ModelIdentification, f64)> = Vec::new();
    // The two largest take three quarters of the time.
    for (name, contained, further) in nested.into_iter().take(cases(4, 6)) {
        let model = Model::open(Path::new(&format!("examples/friction/{name}.toml"))).unwrap();
        let best = contained.iter().min_by(|a, b| done[**a].2.total_cmp(&done[**b].2));
        let mut start: Vec<(String, f64)> = Vec::new();
        if let Some((of, found, _)) = best.map(|best| &done[*best]) {
            let value = |name: &str| {
                let place = of.parameters().iter().position(|parameter| parameter.name == name)?;
                found.values.get(place).copied()
            };
            for parameter in model.parameters() {
                let other = further.iter().find(|(own, _)| *own == parameter.name).map(|(_, other)| *other);
                let value = value(&parameter.name).or_else(|| value(other?)).or_else(|| other?.parse().ok());
                start.extend(value.map(|value| (parameter.name.clone(), value)));
            }
        }
        let spec = ModelSpec { starts: vec![start], ..ModelSpec::default() };
        let begin = std::time::Instant::now();
        let mut found = identify_model(&model, &fitted, &spec, &mut |_| ControlFlow::Continue(())).unwrap();
        let seconds = begin.elapsed().as_secs_f64();
        hold_out_model(&mut found, &fitted, &held_out, &spec).unwrap();
        let own = error(&found, &fitted);
        println!(
            "{name}: error {own:.4}, fit {:.1} %, held out {:.1} %, {seconds:.1} s",
            found.fit_percent[0].unwrap(),
            found.held_out_percent[0].unwrap()
        );
        for of in contained {
            // Steps of another length change the error by some thousandths.
            assert!(own < 1.01 * done[*of].2, "{name}: {own} after {}", done[*of].2);
        }
        done.push((model, found, own));
    }
    // Friction that depends on the load explains other motions too; the larger models overfit four recordings.
    let [first, load] = [0, 2].map(|n: usize| done[n].1.held_out_percent[0].unwrap());
    assert!(load > first + 10.0, "held out: {first} to {load} %");
}
