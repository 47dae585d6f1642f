//! Calls of `identify` with extreme recordings, specifications and inconsistent results.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, WIDE, records, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::criterion::{Criterion, Noise, Scale};
use motorfit::device::{DeviceSpec, DeviceUsed};
use motorfit::estimate::fit_problem;
use motorfit::evaluate::{Model, Problem, SearchProblem};
use motorfit::experiment::with_noise;
use motorfit::identify::{
    BatchCosts, Identifiability, Identification, IdentifySpec, Inspection, Machine, Method, ParameterEstimate, Polish,
    PreparedSearch, SearchRun, Status, TrustLevel, fit_on, has_all_channels, hold_out, identify, identify_with,
    likelihood_profiles, needs_voltage, search_problem, validate, verify_at, with_cost_on,
};
use motorfit::motor::{Axis, Parameter, Parameters, Scope, Space, With};
use motorfit::named::Named;
use motorfit::optimize::{GwoOptions, JayaOptions, SEARCHES, SearchSettings};
use motorfit::record::Record;
use motorfit::report::{likelihood_chart, likelihood_document};
use std::ops::ControlFlow;
use std::sync::LazyLock;

/// Returns a specification whose identification takes some milliseconds.
fn quick() -> IdentifySpec {
    IdentifySpec { population: 6, generations: 3, device: DeviceSpec::Cpu, ..IdentifySpec::default() }
}

/// Returns the identification of a step with noise.
pub fn fitted() -> Identification {
    static FOUND: LazyLock<Identification> =
        LazyLock::new(|| identify(&[with_noise(&step(200), [0.01, 0.1], 1).unwrap()], &quick()).unwrap());
    FOUND.clone()
}

/// Returns copies of a result with inconsistent parts or NaN.
pub fn mangled(found: &Identification) -> Vec<Identification> {
    let mut all = vec![found.clone()];
    let mut with = |change: &dyn Fn(&mut Identification)| {
        let mut other = found.clone();
        change(&mut other);
        all.push(other);
    };
    with(&|f| f.values.clear());
    with(&|f| f.values.extend([f64::NAN; 3]));
    with(&|f| f.values.iter_mut().for_each(|v| *v = f64::NAN));
    with(&|f| f.machine.initial.clear());
    with(&|f| f.machine.initial = vec![[f64::NAN; 2]; 3]);
    with(&|f| f.uncertainty = None);
    with(&|f| f.residual_tests.clear());
    with(&|f| f.machine.regressions.clear());
    with(&|f| f.fit_percent_by_recording.clear());
    with(&|f| (f.cost, f.fit_percent) = (f64::NAN, vec![Some(f64::NAN), Some(f64::INFINITY)]));
    with(&|f| f.history = vec![f64::NAN, f64::INFINITY, 0.0, -1.0]);
    with(&|f| f.residual_sigma = vec![None; 2]);
    with(&|f| f.selection = Some(Vec::new()));
    with(&|f| {
        f.machine.unidentified = vec![(Parameter::Load, Scope::Recording(u32::MAX)), (Parameter::R, Scope::Shared)]
    });
    with(&|f| f.warnings.clear());
    let own = Axis { parameter: Parameter::Load, scope: Scope::Recording(0), min: -1.0, max: 1.0 };
    if let Ok(space) = Space::new([found.space.free(), &[own]].concat(), Vec::new()) {
        with(&|f| f.machine.space = space.clone());
    }
    with(&|f| {
        if let Some(u) = &mut f.uncertainty {
            (u.std_error, u.ci95, u.correlation) = (Vec::new(), Vec::new(), Vec::new());
        }
    });
    with(&|f| {
        if let Some(u) = &mut f.uncertainty {
            u.correlation.iter_mut().flatten().for_each(|entry| *entry = Some(f64::NAN));
            u.std_error.iter_mut().for_each(|entry| *entry = Some(f64::INFINITY));
        }
    });
    for value in FEW {
        with(&|f| f.machine.parameters = Parameters { r: value, l: value, k: value, b: value, j: value });
    }
    all
}

/// Returns unusual specifications.
fn specs() -> Vec<IdentifySpec> {
    let usual = quick();
    let mut all = vec![
        usual.clone(),
        IdentifySpec { population: 0, ..usual.clone() },
        IdentifySpec { generations: 0, ..usual.clone() },
        IdentifySpec { threads: Some(usize::MAX), ..usual.clone() },
        IdentifySpec {
            device: DeviceSpec::GpuIndex(usize::MAX),
            method: GwoOptions::default().into(),
            ..usual.clone()
        },
        IdentifySpec { polish: Polish::None, ..usual.clone() },
        IdentifySpec { polish: Polish::None, auto_bounds: Vec::new(), ..usual.clone() },
        IdentifySpec { method: Method::SteiglitzMcBride, seed: u64::MAX, ..usual.clone() },
        IdentifySpec { auto_bounds: vec![Parameter::Load; 3], ..usual.clone() },
        IdentifySpec { per_recording: vec![Parameter::R, Parameter::R], ..usual.clone() },
        IdentifySpec { per_recording: Parameter::ALL.to_vec(), ..usual.clone() },
        IdentifySpec { with: With::These(Vec::new()), ..usual.clone() },
        IdentifySpec { space: all_fixed(), ..usual.clone() },
        IdentifySpec {
            population: usize::MAX,
            generations: usize::MAX,
            method: GwoOptions::default().into(),
            ..usual.clone()
        },
    ];
    for value in [f64::NAN, f64::INFINITY, -1e300, 5e-324] {
        let criterion = Criterion {
            scale: Scale::Noise,
            time_origin_s: Some(value),
            noise: Noise::Decibels(value),
            ..Criterion::default()
        };
        all.push(IdentifySpec { criterion, method: JayaOptions::default().into(), ..usual.clone() });
    }
    all
}

/// Returns a space without free parameters.
pub fn all_fixed() -> Space {
    let held: Vec<(Parameter, f64)> = Parameter::ALL.into_iter().map(|p| (p, 1.0)).collect();
    Space::table2_to_extend(&[], &held).unwrap()
}

pub fn words(calls: &mut Calls) {
    let mut searches: Vec<Method> = SEARCHES.into_iter().map(|search| Method::Search(search.into())).collect();
    searches.extend([Method::Auto, Method::SteiglitzMcBride]);
    for word in texts() {
        ask!(calls, word;
            "identify::Polish::named" => <Polish as Named>::named("polish", &word),
            "identify::TrustLevel::named" => <TrustLevel as Named>::named("level", &word),
        );
        for mut method in searches.clone() {
            let name = method.name();
            ask!(calls, (name, &word);
                "identify::Method::set" => method.set(&word, &word),
                "identify::Method::set" => method.set("mutation", &word),
            );
        }
    }
    for (method, count) in searches.iter().flat_map(|m| COUNTS.map(|c| (m, c))) {
        drive!(calls, method;
            "identify::Method::name" => method.name(),
            "identify::Method::is_search" => method.is_search(),
            "identify::Method::coordinates" => method.coordinates(),
            "identify::Method::search" => method.search(),
            "identify::Method::from" => Method::from(GwoOptions::default()),
        );
        for bounds in [vec![], vec![(0.0, 1.0)], vec![(f64::NAN, 1.0); 2], vec![(1.0, 0.0)]] {
            let setup = SearchSettings {
                bounds,
                population: count,
                generations: count,
                seed: 1,
                run: u64::MAX,
                ..SearchSettings::default()
            };
            ask!(calls, (method, &setup); "identify::Method::optimizer" => method.optimizer(setup.clone()).map(drop));
        }
    }
    for spec in specs() {
        drive!(calls, spec;
            "identify::IdentifySpec::is_extended" => spec.is_extended(),
            "identify::IdentifySpec::is_polished" => spec.is_polished(),
            "identify::IdentifySpec::by_kernel" => spec.clone().by_kernel().evaluator,
        );
    }
    let statuses = [Status::Agrees, Status::SearchStuck, Status::ReferenceFailed, Status::NotApplicable];
    drive!(calls, ();
        "identify::Polish::name" => Polish::ALL.map(Polish::name),
        "identify::TrustLevel::name" => TrustLevel::ALL.map(TrustLevel::name),
        "identify::Status::name" => statuses.map(Status::name),
    );
    for value in NUMBERS {
        drive!(calls, value;
            "identify::Identifiability::errors" => Identifiability::Identifies { relative_error: [Some(value); 5] }.errors(),
        );
    }
}

/// Drives the interface of the machine of a result.
pub fn of_machine<M: Machine>(calls: &mut Calls, shown: &str, found: &Identification<M>, records: &[Record]) {
    drive!(calls, shown;
        "identify::Machine::title" => found.machine.title(),
        "identify::Machine::free" => found.machine.free(),
        "identify::ParameterEstimate::named" => ParameterEstimate::named("", "\u{0}"),
        "identify::Machine::missing_channel" => M::missing_channel(found),
        "identify::Trust::subject" => found.trust.subject(),
        "identify::Machine::groups" => found.machine.groups().to_vec(),
        "identify::Machine::combinations" => found.machine.combinations().to_vec(),
        "identify::Machine::bounds" => found.machine.bounds(),
        "identify::Machine::equations" => M::equations(found),
        "identify::Machine::states" => M::states(found),
        "identify::Machine::residuals" => M::residuals(found),
        "identify::Machine::analysis" => M::analysis(found),
        "identify::Machine::validation" => M::validation(found),
    );
    ask!(calls, shown;
        "identify::Machine::modelled" => M::modelled(found, records),
        "identify::Machine::modelled" => M::modelled(found, &[]),
    );
}

pub fn results(calls: &mut Calls) {
    let records = [step(60), step(30)];
    let problem = Problem::new(&records, Model::default(), Space::table2(), Criterion::default()).unwrap();
    for mut found in mangled(&fitted()) {
        let shown = format!("{:?} {:?} {:?}", found.values, found.parameters, found.uncertainty);
        drive!(calls, shown;
            "identify::Identification::at_bound" => Parameter::ALL.map(|p| found.at_bound(p)),
            "identify::ParameterEstimate::label" => found.estimates.iter().map(ParameterEstimate::label).count(),
            "identify::ParameterEstimate::remark" => found.estimates.iter().map(ParameterEstimate::remark).count(),
            "identify::Identification::extensions" => found.extensions(),
            "identify::with_cost_on" => with_cost_on(&problem, &found),
        );
        of_machine(calls, &shown, &found, &records);
        let spec = quick();
        ask!(calls, shown;
            "identify::Identification::modelled" => found.modelled(&[]),
            "identify::Identification::modelled" => found.modelled(&records),
            "identify::validate" => validate(&[], &spec, &found),
            "identify::validate" => validate(&records, &spec, &found),
            "identify::hold_out" => hold_out(&mut found, &records, &[], &spec),
            "identify::hold_out" => hold_out(&mut found, &records[..1], &records, &spec),
        );
    }
}

pub fn identifications(calls: &mut Calls) {
    let (odd, specs) = (records(), specs());
    drive!(calls, "none"; "identify::has_all_channels" => has_all_channels(&[]));
    ask!(calls, "none";
        "identify::needs_voltage" => needs_voltage(&[]),
        "identify::identify" => identify(&[], &quick()),
        "identify::verify_at" => verify_at(&[], &quick(), &[]),
        "identify::PreparedSearch::new" => PreparedSearch::new(&[], &quick()).map(drop),
        "identify::BatchCosts::new" => BatchCosts::new(&[], &quick()).map(drop),
        "identify::search_problem" => search_problem(&[], &quick()),
    );
    for (n, record) in odd.iter().enumerate() {
        drive!(calls, record;
            "identify::has_all_channels" => has_all_channels(std::slice::from_ref(record)),
            "identify::Inspection::of" => Inspection::of(record),
        );
        let spec = &specs[n % specs.len()];
        one(calls, std::slice::from_ref(record), spec);
    }
    for spec in &specs {
        one(calls, &[with_noise(&step(120), [0.01, 0.1], 1).unwrap()], spec);
    }
    one(calls, &[step(60), odd[0].clone()], &specs[0]);
}

fn one(calls: &mut Calls, records: &[Record], spec: &IdentifySpec) {
    let with = (spec, records);
    ask!(calls, with;
        "identify::needs_voltage" => needs_voltage(records),
        "identify::identify" => identify(records, spec),
        "identify::search_problem" => search_problem(records, spec),
        "identify::identify_with" => identify_with(records, spec, &mut |_| ControlFlow::Break(())),
    );
    if let Some((found, profiles)) =
        calls.ask("identify::likelihood_profiles", &with, || likelihood_profiles(records, spec))
    {
        drive!(calls, with;
            "report::likelihood_document" => likelihood_document(records, &found, &profiles),
            "report::likelihood_document" => likelihood_document(&[], &found, &[]),
            "report::likelihood_chart" => likelihood_chart(&profiles).figure(),
        );
    }
    for values in [vec![], vec![f64::NAN; 5], vec![1.0; 5], vec![0.0; 9]] {
        ask!(calls, (&with, &values); "identify::verify_at" => verify_at(records, spec, &values));
    }
    let problem = Problem::new(records, spec.model, spec.space.clone(), spec.criterion);
    if let (Ok(problem), Ok(plain)) = (problem, fit_problem(records, &spec.space, spec.model)) {
        ask!(calls, with; "identify::fit_on" => fit_on((&problem, &plain), (records, &[]), spec));
    }
    for prepared in [
        calls.ask("identify::PreparedSearch::new", &with, || PreparedSearch::new(records, spec)),
        calls.ask("identify::PreparedSearch::with_reference", &with, || PreparedSearch::with_reference(records, spec)),
    ]
    .into_iter()
    .flatten()
    {
        drive!(calls, with; "identify::PreparedSearch::problem" => prepared.problem().signals().len());
        let width = prepared.problem().space().free().len();
        for values in [vec![], vec![f64::NAN; width], vec![1.0; width], vec![0.0; width + 1]] {
            let device = DeviceUsed::default();
            let run = SearchRun { values: &values, evaluations: WIDE[8], device: &device };
            ask!(calls, (&with, &values);
                "identify::PreparedSearch::finish" => prepared.finish((records, &[]), spec, run),
                "identify::PreparedSearch::finish" => prepared.finish((&[], &[]), spec, run),
            );
        }
    }
    if let Some(costs) = calls.ask("identify::BatchCosts::new", &with, || BatchCosts::new(records, spec)) {
        batch_costs(calls, costs);
    }
}

/// Calls what searches need of a problem.
fn searched(calls: &mut Calls, problem: &dyn SearchProblem) {
    let names = problem.names();
    drive!(calls, names;
        "evaluate::SearchProblem::names" => problem.names(),
        "evaluate::SearchProblem::axes" => problem.axes(),
        "evaluate::SearchProblem::bounds" => problem.bounds(),
        "evaluate::SearchProblem::width" => problem.width(),
        "evaluate::SearchProblem::criterion" => *problem.criterion(),
        "evaluate::SearchProblem::steps" => problem.steps(),
        "evaluate::SearchProblem::is_small" => COUNTS.map(|count| problem.is_small(count)),
        "evaluate::SearchProblem::user_model" => problem.user_model().is_some(),
    );
    for values in [vec![], vec![f64::NAN; names.len()], vec![1.0; names.len()], vec![0.0; 99]] {
        drive!(calls, (&names, &values);
            "evaluate::SearchProblem::values_of" => problem.values_of(&values),
            "evaluate::SearchProblem::cost_of" => problem.cost_of(&values),
        );
        assert!(!problem.cost_of(&values).is_nan(), "{names:?} {values:?}");
    }
}

pub fn batch_costs(calls: &mut Calls, mut costs: BatchCosts) {
    drive!(calls, ();
        "identify::BatchCosts::problem" => costs.problem().width(),
        "identify::BatchCosts::device" => costs.device(),
        "identify::BatchCosts::steps" => costs.steps(),
        "identify::BatchCosts::warnings" => costs.warnings().len(),
    );
    let width = costs.problem().width();
    searched(calls, costs.problem());
    for (values, size) in [0, 1, width, width + 1, 3 * width].into_iter().flat_map(|v| [0, 1, 3].map(|s| (v, s))) {
        let (values, mut found) = (vec![f64::NAN; values], vec![0.0; size]);
        ask!(calls, (values.len(), size);
            "identify::BatchCosts::evaluate" => costs.evaluate(&values, &mut found),
            "identify::BatchCosts::finish" => costs.finish(&values, &mut found),
            "identify::BatchCosts::begin" => costs.begin(&values),
            "identify::BatchCosts::finish" => costs.finish(&[], &mut found),
        );
    }
}
