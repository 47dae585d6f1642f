//! Calls of `optimize`: settings, samples, the loop.

use crate::hostile::arguments::{COUNTS, FEW, WIDE, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::candidates::Candidates;
use motorfit::identify::Method;
use motorfit::named::Named;
use motorfit::optimize::{
    Budget, ConfiguredSearch, Coordinates, Evaluate, GeneticOptions, GwoOptions, JayaOptions, LocalOptimum, PsoOptions,
    Run, Sample, Sampling, SearchOptions, SearchSettings, Stop, minimize,
};
use std::ops::ControlFlow;

fn searches() -> Vec<ConfiguredSearch> {
    Method::all().iter().filter_map(Method::search).collect()
}

/// Returns valid and invalid boxes.
fn boxes() -> Vec<Vec<(f64, f64)>> {
    let mut boxes: Vec<Vec<(f64, f64)>> = FEW.iter().flat_map(|a| FEW.map(|b| vec![(*a, b)])).collect();
    boxes.extend([Vec::new(), vec![(0.0, 1.0); 3], vec![(-f64::MAX, f64::MAX); 2], vec![(1.0, 1.0); 65]]);
    boxes
}

pub fn settings(calls: &mut Calls) {
    for tuned in searches() {
        for place in COUNTS {
            calls.may_panic("optimize::ConfiguredSearch::shown", || tuned.shown(place));
        }
        drive!(calls, tuned;
            "optimize::ConfiguredSearch::from" => ConfiguredSearch::from(tuned.search),
            "optimize::ConfiguredSearch::shown" => (0..tuned.search.settings.len()).map(|n| tuned.shown(n)).collect::<String>(),
            "optimize::ConfiguredSearch::changed" => tuned.changed(),
            "optimize::Hyperparameter::form" => tuned.search.settings.iter().map(|s| s.form()).collect::<String>(),
        );
        for word in texts() {
            for name in tuned.search.settings.iter().map(|s| s.name).chain([word.as_str()]) {
                let mut changed = tuned;
                ask!(calls, (name, &word); "optimize::ConfiguredSearch::set" => changed.set(name, &word));
                drive!(calls, (name, &word); "optimize::ConfiguredSearch::changed" => changed.changed());
                begun(calls, changed, vec![(0.0, 1.0)], 3, 2);
            }
            if tuned.search.name == "gwo" {
                ask!(calls, word; "optimize::Stop::named" => <Stop as Named>::named("stop", &word));
            }
        }
    }
    for number in FEW {
        // Values written directly into the structures, which are not checked there.
        let typed = [
            ConfiguredSearch::from(GeneticOptions { crossover: number, mutation: number, ..GeneticOptions::default() }),
            ConfiguredSearch::from(PsoOptions { c1: number, velocity: number, ..PsoOptions::default() }),
        ];
        for tuned in typed {
            begun(calls, tuned, vec![(0.0, 1.0); 2], 4, 3);
        }
    }
    drive!(calls, ();
        "optimize::SearchOptions::values" => (GwoOptions::default().values(), JayaOptions::default().values()),
        "optimize::SearchOptions::of" => GeneticOptions::of(&GwoOptions::default().values()),
        "optimize::Stop::name" => Stop::ALL.map(Stop::name),
    );
    for bounds in boxes() {
        for (population, generations) in COUNTS.into_iter().flat_map(|p| COUNTS.map(|g| (p, g))) {
            let setup = SearchSettings {
                bounds: bounds.clone(),
                population,
                generations,
                seed: u64::MAX,
                run: u64::MAX,
                ..SearchSettings::default()
            };
            ask!(calls, setup; "optimize::SearchSettings::check" => setup.check());
            drive!(calls, setup; "optimize::SearchSettings::evaluations" => setup.evaluations());
        }
        for tuned in searches() {
            for population in [0, 1, 2, 3, 5, usize::MAX] {
                begun(calls, tuned, bounds.clone(), population, 3);
            }
        }
    }
}

/// Runs a search by ask and tell and by the loop, with extreme costs.
fn begun(calls: &mut Calls, tuned: ConfiguredSearch, bounds: Vec<(f64, f64)>, population: usize, generations: usize) {
    let setup = SearchSettings { bounds, population, generations, seed: u64::MAX, run: 1, ..SearchSettings::default() };
    let with = (tuned, &setup);
    let Some(mut search) = calls.ask("optimize::ConfiguredSearch::begin", &with, || tuned.begin(setup.clone())) else {
        return;
    };
    for cost in FEW {
        let size = search.ask().count();
        let end = LocalOptimum { values: vec![cost; setup.bounds.len()], cost, evaluations: 1 };
        drive!(calls, (&with, cost);
            "optimize::Optimizer::ask" => search.ask().count(),
            "optimize::Optimizer::tell" => search.tell(&vec![cost; size]),
            "optimize::Optimizer::best" => search.best().map(|best| best.cost),
            "optimize::Optimizer::evaluations_max" => search.evaluations_max(),
            "optimize::Optimizer::needs_local_search" => search.needs_local_search(),
            "optimize::Optimizer::local_searches" => search.local_searches().map(|local| local.starts.count()),
            "optimize::Optimizer::arrive" => search.arrive(&[end]),
        );
    }
    let size = search.ask().count();
    for wrong in [0, 1, size + 1] {
        calls.may_panic("optimize::Optimizer::tell", || search.tell(&vec![1.0; wrong]));
    }
    let Ok(search) = tuned.begin(setup.clone()) else { return };
    let mut runs = [Run::new(search)];
    for (generations, slice) in [(0, 0), (2, 1), (3, usize::MAX)] {
        let mut evaluate = |_: &[Candidates<'_>], costs: &mut [f64]| -> motorfit::Result<()> {
            costs.fill(f64::NAN);
            Ok(())
        };
        let mut observe = |_: &motorfit::optimize::Progress| ControlFlow::Continue(());
        ask!(calls, (&with, generations, slice);
            "optimize::minimize" => minimize(&mut runs, Budget { generations, slice }, &mut evaluate, &mut observe));
        drive!(calls, &with;
            "optimize::Run::cost" => runs[0].cost(),
            "optimize::Evaluate::overlaps" => Evaluate::overlaps(&evaluate),
            "optimize::Evaluate::local_search" => Evaluate::local_search(&evaluate).is_none(),
            "optimize::Evaluate::begin" => Evaluate::begin(&mut evaluate, &[]),
            "optimize::Evaluate::finish" => Evaluate::finish(&mut evaluate, &[], &mut []),
        );
    }
    calls
        .call("optimize::Run::new", &with, || tuned.begin(setup.clone()).map(|search| Run::new(search).cost()).is_ok());
    calls.call("optimize::minimize", &"no runs", || {
        let mut evaluate = |_: &[Candidates<'_>], _: &mut [f64]| -> motorfit::Result<()> { Ok(()) };
        minimize(&mut [], Budget { generations: 2, slice: 1 }, &mut evaluate, &mut |_| ControlFlow::Break(()))
    });
}

pub fn coordinates(calls: &mut Calls) {
    for word in texts() {
        ask!(calls, word; "optimize::Coordinates::from_str" => word.parse::<Coordinates>());
    }
    for number in FEW {
        for coordinates in [Coordinates::None, Coordinates::Mirror, Coordinates::Shift(number), Coordinates::Log] {
            for axis in FEW.into_iter().flat_map(|a| FEW.map(|b| (a, b))) {
                drive!(calls, (coordinates, axis);
                    "optimize::Coordinates::coordinate" => coordinates.coordinate(number, axis),
                    "optimize::Coordinates::value" => coordinates.value(number, axis),
                );
            }
            let bounds = vec![(0.5, 2.0), (0.0, 1.0)];
            for tuned in searches() {
                let setup =
                    SearchSettings { bounds: bounds.clone(), population: 5, coordinates, ..SearchSettings::default() };
                let Some(mut search) = calls
                    .ask("optimize::ConfiguredSearch::begin", &(tuned, coordinates), || tuned.begin(setup.clone()))
                else {
                    continue;
                };
                for _ in 0..3 {
                    let size = search.ask().count();
                    drive!(calls, coordinates; "optimize::Optimizer::tell" => search.tell(&vec![number; size]));
                }
            }
        }
    }
}

pub fn samples(calls: &mut Calls) {
    for sampling in [Sampling::Uniform, Sampling::LatinHypercube, Sampling::Sobol, Sampling::Grid] {
        for (bounds, number) in boxes().into_iter().flat_map(|b| WIDE.map(|n| (b.clone(), n))) {
            let with = (sampling, number, bounds.clone());
            let made =
                calls.ask("optimize::Sample::new", &with, || Sample::new(sampling, number, bounds.clone(), number));
            let Some(sample) = made else { continue };
            drive!(calls, with; "optimize::Sample::count" => sample.count());
            let mut values = vec![0.0; 2 * bounds.len()];
            for first in WIDE {
                calls.may_panic("optimize::Sample::fill", || sample.fill(first, &mut values));
                calls.may_panic("optimize::Sample::fill", || sample.fill(first, &mut values[1..]));
            }
            drive!(calls, with; "optimize::Sample::fill" => sample.fill(sample.count() - 1, &mut values[..bounds.len()]));
        }
    }
}
