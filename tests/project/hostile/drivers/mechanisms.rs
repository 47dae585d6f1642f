//! Calls of functions on mechanisms and logs, with extreme characteristics, tests and files.

use crate::hostile::arguments::{FEW, NUMBERS, texts};
use crate::hostile::calls::Calls;
use motorfit::analysis::{CONTROLLERS, Controller, FeedbackWeights, position_feedback, velocity_feedback};
use motorfit::identify::mechanism::{
    MechanismFit, MechanismKind, MechanismSpec, PositionUnit, identify_mechanism, mechanism_regression,
    mechanism_signals,
};
use motorfit::named::Named as _;
use motorfit::record::{NamedSignal, Record, Samples, channels, test_of};
use motorfit::report::{
    FeedbackDesign, Reproduced, mechanism_code, mechanism_document, mechanism_lines, mechanism_page,
    mechanism_selection,
};
use motorfit::settings::{Given, signal_reading};
use std::ops::ControlFlow;
use std::path::Path;

/// Feedback gains of extreme characteristics, weights and controllers.
pub fn feedback(calls: &mut Calls) {
    for kv in NUMBERS {
        for ka in FEW {
            for of in FEW {
                let weights = FeedbackWeights { position: of, velocity: 1.5, volts: of };
                let controller = Controller { period_s: of, delay_s: 0.1, ..CONTROLLERS[0] };
                for controller in [controller, CONTROLLERS[4]] {
                    let with = (kv, ka, of, controller.name);
                    calls.call("analysis::velocity_feedback", &with, || {
                        velocity_feedback([kv, ka], &weights, &controller)
                    });
                    calls.call("analysis::position_feedback", &with, || {
                        position_feedback([kv, ka], &weights, &controller)
                    });
                }
            }
        }
    }
}

/// Returns recordings of a mechanism with signals of equal length.
fn tests_of(voltage: &[f64], velocity: &[f64], position: Option<&[f64]>) -> Option<Record> {
    let signal = |number, values: &[f64]| NamedSignal { number, is_input: number == 0, values: values.to_vec() };
    let mut named = vec![signal(0, voltage), signal(1, velocity)];
    named.extend(position.map(|position| signal(2, position)));
    let time_s = (0_u32..).take(voltage.len()).map(|n| 0.02 * f64::from(n)).collect();
    Record::new(Samples { time_s, named, ..Samples::default() }).ok()
}

/// Identifications of tests without movement, with one value, with huge values, and of a plain one; results with NaN.
pub fn mechanisms(calls: &mut Calls) {
    let ramp: Vec<f64> = (0..60).map(|n| 0.1 * f64::from(n)).collect();
    let square: Vec<f64> = (0..60).map(|n| if (n / 12) % 2 == 0 { 3.0 } else { -2.0 }).collect();
    let mut late = vec![0.0];
    for volts in &square[1..] {
        late.push(0.8 * late[late.len() - 1] + 0.1 * volts);
    }
    let signals = [vec![0.0; 60], square, ramp.clone(), late.clone(), ramp.iter().map(|v| v * 1e8).collect()];
    let mut fits: Vec<(Vec<Record>, MechanismFit)> = Vec::new();
    for voltage in &signals {
        for velocity in &signals {
            for position in [None, Some(&late[..])] {
                let records: Vec<Record> = tests_of(voltage, velocity, position).into_iter().collect();
                for kind in [None, Some(MechanismKind::Arm), Some(MechanismKind::Elevator)] {
                    let with = (voltage[1], velocity[59], kind);
                    for kind in MechanismKind::ALL {
                        calls.call("identify::mechanism::mechanism_regression", &with, || {
                            mechanism_regression(&records, kind)
                        });
                    }
                    for is_linear in [false, true] {
                        let spec = MechanismSpec { kind, is_linear, seed: 1 };
                        let found = calls.ask("identify::mechanism::identify_mechanism", &with, || {
                            identify_mechanism(&records, &spec, &mut |_| ControlFlow::Break(()))
                        });
                        fits.extend(found.map(|found| (records.clone(), found)));
                    }
                }
            }
        }
    }
    assert!(!fits.is_empty(), "no mechanism was identified");
    fits.truncate(8);
    for (records, fit) in &fits {
        let mut mangled = fit.clone();
        mangled.found.estimates.clear();
        mangled.found.uncertainty = None;
        mangled.regressions.clear();
        mangled.unit.factor = f64::NAN;
        [fit, &mangled].into_iter().for_each(|fit| results(calls, records, fit));
    }
}

fn results(calls: &mut Calls, records: &[Record], fit: &MechanismFit) {
    for name in ["kS", "kV", "offset", ""] {
        calls.call("identify::mechanism::MechanismFit::fitted", &name, || fit.fitted(&[]).len());
        calls.call("identify::mechanism::MechanismFit::estimate", &name, || fit.estimate(name).is_some());
        calls.call("identify::mechanism::MechanismFit::in_unit", &name, || fit.in_unit(name).is_some());
    }
    let weights = FeedbackWeights { position: f64::NAN, velocity: 0.0, volts: -1.0 };
    let how = Reproduced { command: String::new(), options: Vec::new() };
    for controller in &CONTROLLERS {
        calls.call("identify::mechanism::MechanismFit::feedback", &controller.name, || {
            fit.feedback(true, &weights, controller)
        });
        let design =
            calls.call("report::FeedbackDesign::of", &controller.name, || FeedbackDesign::of(fit, weights, controller));
        let Some(design) = design else { continue };
        calls.call("report::mechanism_document", &"", || mechanism_document(records, fit, &design));
        calls.call("report::mechanism_page", &"", || mechanism_page(records, fit, &design, &how).html(true));
    }
    calls.call("report::mechanism_lines", &"", || mechanism_lines(fit));
    calls.call("report::mechanism_code", &"", || mechanism_code(fit));
    calls.call("report::mechanism_selection", &"", || mechanism_selection(fit));
}

/// Kinds, units, names of tests, and files that are no logs.
pub fn words(calls: &mut Calls) {
    for kind in MechanismKind::ALL {
        for is_linear in [false, true] {
            calls.ask("identify::mechanism::MechanismKind::model", &(kind, is_linear), || kind.model(is_linear));
        }
        calls.call("identify::mechanism::MechanismKind::has_gravity", &kind, || kind.has_gravity());
    }
    for kind in MechanismKind::ALL {
        calls.call("identify::mechanism::MechanismKind::name", &kind, || kind.name());
    }
    for text in texts() {
        calls.ask("identify::mechanism::MechanismKind::named", &text, || MechanismKind::named("kind", &text));
        calls.call("record::test_of", &text, || test_of(&text));
        for is_linear in [false, true] {
            calls.call("identify::mechanism::PositionUnit::of_velocity", &text, || {
                PositionUnit::of_velocity(&text, is_linear)
            });
        }
        if !text.contains('\0') {
            calls.ask("record::channels", &text, || channels(Path::new(&text)));
        }
    }
    for is_linear in [false, true] {
        let signals = calls.call("identify::mechanism::mechanism_signals", &is_linear, || mechanism_signals(is_linear));
        let signals = signals.unwrap_or_default();
        calls.call("settings::signal_reading", &is_linear, || signal_reading(&Given::default(), signals).is_ok());
    }
}
