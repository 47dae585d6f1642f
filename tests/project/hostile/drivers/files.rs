//! Calls with unusual paths, and simulated experiments.

use crate::hostile::arguments::{FEW, NUMBERS, WIDE, records, signals, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::criterion::Noise;
use motorfit::experiment::{Excitation, StepExperiment, drive, noise_of, simulated, with_noise};
use motorfit::file::{
    create, is_at, remove_leftovers, replace, replace_if, sync, sync_folder, unreadable, unwritable, with_similar_name,
};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters};
use motorfit::record::{ReadOptions, Reading, read, read_inputs, read_joined, read_recording};
use motorfit::study::sweep::Sweep;
use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Returns paths in a folder that are not regular files, or are unusual ones.
pub fn paths(folder: &Path) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder.join("folder")).unwrap();
    std::fs::write(folder.join("empty"), "").unwrap();
    std::fs::write(folder.join("zeros"), [0; 4096]).unwrap();
    let mut all: Vec<PathBuf> =
        ["folder", "empty", "zeros", "none", "none/none", "empty/none", "folder/", "a\u{202e}b"]
            .map(|name| folder.join(name))
            .to_vec();
    #[cfg(unix)]
    {
        let pipe = folder.join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if made.is_ok_and(|status| status.success()) || pipe.exists() {
            all.push(pipe.clone());
            all.push(pipe.join("below"));
        }
        // The links may exist from an earlier call.
        let _ = std::os::unix::fs::symlink("circle", folder.join("circle"));
        let _ = std::os::unix::fs::symlink("nowhere", folder.join("dangling"));
        all.extend(["circle", "dangling"].map(|name| folder.join(name)));
    }
    // Paths that leave the folder are excluded, because files are written.
    all.extend(texts().iter().filter(|word| !word.contains('/') && !word.contains("..")).map(|word| folder.join(word)));
    all
}

pub fn files(calls: &mut Calls) {
    let folder = tempfile::tempdir().unwrap();
    let open = std::fs::File::create(folder.path().join("open")).unwrap();
    // Reading comes first, because writing replaces the files.
    for path in paths(folder.path()) {
        drive!(calls, path;
            "file::is_at" => is_at(&open, &path),
            "file::sync_folder" => sync_folder(&path).is_ok(),
            "record::Reading::files" => Reading::files(&path),
        );
        // Reading a pipe would wait for a writer.
        if path.ends_with("pipe") {
            continue;
        }
        ask!(calls, path;
            "record::read" => read(&path, &ReadOptions::default()),
            "record::read_recording" => read_recording(&path, &[]),
            "record::read_inputs" => read_inputs(&path, &[]),
            "record::read_joined" => read_joined(&[path.clone(), path.clone()], &ReadOptions::default()),
            "record::Reading::records" => Reading::default().records(&path),
            "study::sweep::Sweep::open" => Sweep::open(&path),
            "study::sweep::Sweep::plan" => Sweep::plan(&path, &folder.path().join("sweep"), None),
        );
    }
    for path in paths(folder.path()) {
        drive!(calls, path;
            "file::remove_leftovers" => remove_leftovers(&path),
            "file::with_similar_name" => with_similar_name(motorfit::Error::data("a", "b").in_file(&path)),
            "file::unreadable" => [std::io::ErrorKind::NotFound, std::io::ErrorKind::Other].map(|kind| unreadable(&path, &kind.into())),
        );
        let failed = |error: std::io::Error| unwritable(&path, &error);
        ask!(calls, path;
            "file::replace" => replace(&path, |_| Err(motorfit::Error::usage("a", "b"))),
            "file::replace_if" => replace_if(&path, |_| Ok(None::<()>)),
            "file::create" => create(&path, b"a").and_then(|made| made.map_err(failed)),
            "file::replace" => replace(&path, |file| file.write_all(b"a").map_err(failed)),
            "file::replace_if" => replace_if(&path, |file| file.write_all(b"a").map(Some).map_err(failed)),
        );
    }
    drive!(calls, ();
        "file::sync" => sync(&open).is_ok(),
        "file::sync_folder" => [sync_folder(Path::new("")).is_ok(), sync_folder(Path::new("\0")).is_ok()],
        "file::is_at" => [is_at(&open, Path::new("")), is_at(&open, &folder.path().join("open"))],
        "file::unwritable" => {
            [std::io::ErrorKind::StorageFull, std::io::ErrorKind::Other].map(|kind| unwritable(Path::new("\0"), &kind.into()))
        },
    );
}

/// Returns motors with extreme values, with and without extensions.
fn motors() -> Vec<Extended> {
    let usual = Extended::from(&Parameters::M2);
    let mut all = vec![usual];
    for value in FEW {
        all.extend(Parameter::ALL.into_iter().map(|p| usual.with(p, value)));
        all.extend(Parameter::EXTENSIONS.into_iter().map(|p| usual.with(p, value)));
    }
    all
}

pub fn experiments(calls: &mut Calls) {
    let durations = [f64::NAN, f64::INFINITY, -1.0, 0.0, 5e-324, 0.5, f64::MAX];
    let periods = [f64::NAN, f64::INFINITY, -1.0, 0.0, 5e-324, 1e-3, 0.5, f64::MAX];
    for (volts, at_s) in FEW.into_iter().flat_map(|a| FEW.map(|b| (a, b))) {
        for (duration_s, period_s) in durations.into_iter().flat_map(|a| periods.map(|b| (a, b))) {
            let with = (volts, at_s, duration_s, period_s);
            ask!(calls, with;
                "experiment::Excitation::step" => Excitation::step(volts, at_s, duration_s, period_s),
                "experiment::StepExperiment::new" => StepExperiment::new(&Parameters::M2, volts, at_s, [duration_s, period_s]),
            );
        }
    }
    for motor in motors() {
        for (volts, period_s) in [(10.0, 1e-3), (1e9, 0.5), (-1e-300, 1e-3)] {
            let with = (motor.parameters(), volts, period_s);
            let made = calls.ask("experiment::StepExperiment::new", &with, || {
                StepExperiment::new(motor, volts, 0.01, [0.5, period_s])
            });
            if let Some(experiment) = made.flatten() {
                streamed(calls, &experiment);
            }
        }
    }
    for (time_s, voltage) in signals().into_iter().flat_map(|a| signals().into_iter().map(move |b| (a.clone(), b))) {
        for torque in [None, Some(voltage.clone()), Some(Vec::new())] {
            let excitation = Excitation { time_s: time_s.clone(), voltage: voltage.clone(), torque };
            ask!(calls, excitation; "experiment::simulated" => simulated(&Parameters::M2, &excitation, Discretization::Zoh));
        }
    }
    let step = Excitation::step(1.0, 0.01, 0.2, 1e-3).unwrap();
    for (motor, how) in motors().into_iter().flat_map(|m| Discretization::ALL.map(|how| (m, how))) {
        ask!(calls, (motor.parameters(), how); "experiment::simulated" => simulated(motor, &step, how));
    }
    noises(calls);
}

fn streamed(calls: &mut Calls, experiment: &StepExperiment) {
    drive!(calls, experiment; "experiment::StepExperiment::samples" => experiment.samples());
    let _ = calls
        .ask("experiment::StepExperiment::figures", experiment, || experiment.figures(&mut || ControlFlow::Break(())));
    let figures = calls.ask("experiment::StepExperiment::figures", experiment, || {
        experiment.figures(&mut || ControlFlow::Continue(()))
    });
    let Some(figures) = figures.flatten() else { return };
    for value in NUMBERS {
        drive!(calls, value;
            "experiment::StepFigures::sigma" => [
                figures.sigma(Noise::Estimated), figures.sigma(Noise::Decibels(value)), figures.sigma(Noise::Sigma([Some(value), None])),
            ],
        );
    }
    for (sigma, seed) in FEW.into_iter().zip(WIDE) {
        let with = (experiment, sigma);
        ask!(calls, with;
            "experiment::StepExperiment::write" =>
                experiment.write(&figures, ([sigma; 2], seed), sigma, &mut |_| Ok(ControlFlow::Continue(()))),
            "experiment::StepExperiment::write" =>
                experiment.write(&figures, ([0.0; 2], seed), sigma, &mut |_| Ok(ControlFlow::Break(()))),
        );
    }
}

fn noises(calls: &mut Calls) {
    for record in records() {
        drive!(calls, record; "experiment::drive" => drive(&record).voltage.len());
        for (value, seed) in NUMBERS.into_iter().zip(WIDE.into_iter().cycle()) {
            drive!(calls, (value, &record);
                "experiment::noise_of" => [
                    noise_of(&record, Noise::Estimated), noise_of(&record, Noise::Decibels(value)),
                    noise_of(&record, Noise::Sigma([None, Some(value)])),
                ],
            );
            let noisy =
                calls.ask("experiment::with_noise", &(value, &record), || with_noise(&record, [value, -value], seed));
            let finite = |noisy: &motorfit::record::Record| {
                noisy.samples().signals().all(|(_, s)| s.iter().all(|v| v.is_finite()))
            };
            assert!(noisy.as_ref().is_none_or(finite), "noise of {value}");
        }
    }
}
