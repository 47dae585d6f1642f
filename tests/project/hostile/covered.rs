//! Proves: every public function is called with hostile arguments, or is listed with a reason; none panics or hangs.

use crate::hostile::calls::Calls;
use crate::hostile::drivers::{
    analysis, estimate, evaluate, files, ground, identify, mechanisms, models, motor, optimize, record, report,
    settings, study, suite, sweep,
};
use crate::hostile::list::public_functions;
use std::path::Path;

/// Functions that no driver calls, each with the reason. A new public function gets a driver instead of an entry.
const NOT_YET: &[(&str, &str)] = &[];

type Driver = fn(&mut Calls);

/// Drivers of the modules.
const DRIVERS: &[Driver] = &[
    ground::texts_of_all_kinds,
    ground::numbers,
    ground::settings_and_errors,
    ground::candidates,
    ground::criteria,
    motor::parameters,
    motor::features_and_spaces,
    motor::values,
    motor::simulations,
    optimize::settings,
    optimize::coordinates,
    optimize::samples,
    record::words,
    record::made_of_signals,
    record::recordings,
    settings::languages,
    settings::given,
    files::files,
    files::experiments,
    identify::words,
    identify::results,
    identify::identifications,
    analysis::motors,
    analysis::residuals,
    analysis::of_recordings,
    study::compared,
    study::compare_specs,
    study::maps,
    study::speeds,
    suite::suites,
    suite::suite_settings,
    sweep::figures,
    sweep::sweeps,
    report::words,
    report::plots,
    report::identified,
    report::compared,
    report::swept,
    evaluate::problems,
    evaluate::levels,
    evaluate::devices,
    #[cfg(feature = "gpu")]
    evaluate::gpus,
    evaluate::estimates,
    estimate::identifiable_recordings,
    models::languages,
    models::signals,
    models::settings,
    models::problems,
    models::identifications,
    models::exports,
    mechanisms::feedback,
    mechanisms::mechanisms,
    mechanisms::words,
];

#[test]
fn no_public_function_panics_or_hangs() {
    let all = public_functions(Path::new(env!("CARGO_MANIFEST_DIR")));
    assert!(all.len() > 500, "{} functions were found", all.len());
    let mut calls = Calls::default();
    DRIVERS.iter().for_each(|driver| driver(&mut calls));
    for name in &calls.panicked {
        assert!(all.get(*name) == Some(&true), "{name} panics, and nothing says so");
    }
    let mut faults = calls.faults;
    for name in all.keys() {
        let left_out = NOT_YET.iter().any(|(left_out, _)| left_out == name);
        if left_out == calls.called.contains(name.as_str()) {
            faults.push(format!("{name} is {}", if left_out { "driven and left out" } else { "not driven" }));
        }
    }
    let known = |name: &&str| all.contains_key(*name);
    let unknown = calls.called.into_iter().chain(NOT_YET.iter().map(|(name, _)| *name)).filter(|name| !known(name));
    faults.extend(unknown.map(|name| format!("{name} is no public function")));
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(200)].join("\n"));
}
