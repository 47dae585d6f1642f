//! Measures the evaluation of users' models on one thread: relative to the kernels of the DC motor, relative to the same machines
//! written by hand for candidates side by side, and to the multiply–add peak of the same run. All ratios are medians of alternating
//! calls. `benches/results/models` keeps the output.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Norm, Scale};
use motorfit::estimate::model::{refine_model, signal_sigma};
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::evaluate::{Level, Simd};
use motorfit::experiment::{Excitation, simulated};
use motorfit::model::{BuiltIn, IntegrationMethod, Model};
use motorfit::motor::{Discretization, Parameter, Parameters};
use motorfit::named::Named as _;
use motorfit::record::Record;
use motorfit::study::{ThroughputSpec, contenders, throughput};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::ThreadPoolBuilder;
use std::ops::ControlFlow;
use std::time::Instant;
use support::twins::{self, Recorded};
use support::{candidates_of, evaluate, extended_problem, median, problem_with, seconds};

const CANDIDATES: usize = 960;
const SAMPLES: usize = 2001;
const ROUNDS: usize = 15;

/// Returns a recording of the paper's motor M2 under a square voltage that passes zero.
fn square() -> Record {
    let time_s: Vec<f64> = (0..SAMPLES).map(|n| 1e-3 * n as f64).collect();
    let voltage = (0..SAMPLES).map(|n| if (n / 250).is_multiple_of(2) { 10.5 } else { -6.0 }).collect();
    simulated(&Parameters::M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap()
}

/// Returns a recording of the DC motor without load for a model of it.
fn recording_of(record: &Record) -> ModelRecording {
    let samples = record.samples();
    ModelRecording {
        step_s: vec![1e-3],
        inputs: vec![samples.voltage.clone(), vec![0.0; record.len()]],
        measured: vec![samples.current.clone(), samples.speed.clone()],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s: samples.time_s.clone(),
    }
}

/// Returns the model's problem on the recording, with the criterion ise unless the standard one is asked for.
fn problem(model: &Model, recording: ModelRecording, method: Option<IntegrationMethod>) -> ModelProblem {
    let criterion = match method {
        Some(_) => Criterion { norm: Norm::Euclidean, scale: Scale::None, ..Criterion::default() },
        None => Criterion::default(),
    };
    let settings = ModelSettings {
        criterion,
        method: method.map(|of| (of, 1)),
        has_known_initial: true,
        ..ModelSettings::default()
    };
    ModelProblem::new(model, ModelSpace::new(model, 1), vec![recording], settings).unwrap()
}

/// Returns candidates of a model, uniform in their coordinates over the inner half of the bounds.
fn candidates(problem: &ModelProblem) -> Vec<f64> {
    let mut numbers = Xoshiro256PlusPlus::seed_from_u64(7);
    let axes = &problem.space().free;
    (0..CANDIDATES)
        .flat_map(|_| axes.iter().map(|axis| axis.at(numbers.random_range(0.25..0.75))).collect::<Vec<_>>())
        .collect()
}

/// Returns the median of the ratio of two times over alternating calls, and the shortest time of the first \[s\].
fn compared(mut own: impl FnMut(), mut other: impl FnMut()) -> (f64, f64) {
    own();
    other();
    let mut best = f64::INFINITY;
    let ratios = (0..ROUNDS).map(|_| {
        let (before, between, after) = (seconds(&mut other), seconds(&mut own), seconds(&mut other));
        best = best.min(between);
        (before + after) / (2.0 * between)
    });
    let ratios: Vec<f64> = ratios.collect();
    (median(ratios), best)
}

/// Returns the largest number of multiply–adds per second of one core, as `motorfit bench` measures it.
fn peak() -> Option<f64> {
    let spec = ThroughputSpec { populations: vec![64], samples: vec![16], budget_s: 0.05 }.checked().ok()?;
    throughput(&spec, contenders(1, false, true).ok()?, &mut |_, _| ControlFlow::Continue(())).ok()?.fma_peak
}

fn steps(time_s: f64) -> String {
    format!("{:.0}", 1e-6 * (CANDIDATES * SAMPLES) as f64 / time_s)
}

fn main() {
    let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let peak = peak();
        println!(
            "{}, peak {:.1e} multiply-adds per second of one core\n",
            Level::best().name(),
            peak.unwrap_or(f64::NAN)
        );
        beside_kernels();
        println!();
        chains(peak);
        println!();
        beside_twins(peak);
        println!();
        derivatives();
        println!();
        beginnings();
    });
}

/// Prints the speed of models that are affine beside that of the kernels for the same motor.
fn beside_kernels() {
    println!("| model | million candidate-steps per second | of the kernel for the DC motor |\n|---|---|---|");
    let record = square();
    let coulomb = [(Parameter::Coulomb, 0.0, 0.05)];
    let with_stick = BuiltIn::DcMotor.model().unwrap().text().replace("B*w - TL", "B*w - stick(w, Tc) - TL");
    let with_stick = with_stick.replace(
        "[states]",
        "Tc = { unit = \"N*m\", min = 0, max = 0.05, description = \"Coulomb friction\" }\n[states]",
    );
    let models = [BuiltIn::DcMotor.model().unwrap(), Model::parse(&with_stick).unwrap()];
    for (model, extensions) in models.iter().zip([&[][..], &coulomb]) {
        let own = problem(model, recording_of(&record), None);
        let kernel = match extensions {
            [] => problem_with(std::slice::from_ref(&record)),
            extensions => extended_problem(&record, extensions),
        };
        let values = candidates_of(kernel.space(), CANDIDATES);
        let (mut costs, mut others) = (vec![0.0; CANDIDATES], vec![0.0; CANDIDATES]);
        let width = kernel.space().free().len();
        let (ratio, time) = compared(
            || own.costs(Candidates::new(&values, width), &mut costs).unwrap(),
            || evaluate(&mut Simd::default(), &kernel, &values, &mut others),
        );
        let apart = costs.iter().zip(&others).map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max);
        assert!(apart < 1e-9, "the costs differ by {apart:e}");
        let name =
            if extensions.is_empty() { "DC motor, exact steps" } else { "with friction that sticks, exact steps" };
        println!("| {name} | {} | {ratio:.2} |", steps(time));
    }
}

/// Prints the speed of affine models by their number of states, and their multiply–adds beside the peak: N² for the states and two
/// operations for the error of the one output. An output that is twice a state is interpreted, and so are three states.
fn chains(peak: Option<f64>) {
    println!(
        "| states, exact steps | million candidate-steps per second | of the peak | interpreted | of the peak |\n|---|---|---|---|---|"
    );
    for states in 1..=3_usize {
        let [own, interpreted] = [1, 2].map(|factor| {
            let model = chain(states, factor);
            let voltage: Vec<f64> =
                (0..SAMPLES).map(|n| if (n / 250).is_multiple_of(2) { 8.0 } else { -5.0 }).collect();
            let recording = ModelRecording {
                step_s: vec![1e-3],
                inputs: vec![voltage.clone()],
                measured: vec![Some(voltage)],
                counting: Vec::new(),
                effective_sample_ratio: 1.0,
                name: None,
                assumed: None,
                time_s: (0..SAMPLES).map(|n| 1e-3 * n as f64).collect(),
            };
            let own = problem(&model, recording, None);
            let values = candidates(&own);
            (own, values)
        });
        let mut costs = vec![0.0; CANDIDATES];
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..ROUNDS {
            for ((problem, values), times) in [&own, &interpreted].into_iter().zip(&mut times) {
                times.push(seconds(|| problem.costs(Candidates::new(values, 2), &mut costs).unwrap()));
            }
        }
        let columns = times.map(|times| {
            let time = median(times);
            let rate = (CANDIDATES * SAMPLES * (states * states + 2)) as f64 / time;
            let share = peak.map_or_else(String::new, |peak| format!("{:.2}", rate / peak));
            format!("{} | {share}", steps(time))
        });
        println!("| {states} | {} |", columns.join(" | "));
    }
}

/// Returns a chain of first-order lags, whose output is the last state times a factor.
fn chain(states: usize, factor: usize) -> Model {
    let mut text = "format = 1\nname = \"chain\"\n[inputs]\nu = { unit = \"V\" }\n[parameters]\n\
        a = { unit = \"1/s\", min = 1, max = 30 }\nb = { unit = \"1/s\", min = 5, max = 60 }\n[states]\n"
        .to_owned();
    for n in 1..=states {
        let before = if n == 1 { "u".to_owned() } else { format!("x{}", n - 1) };
        text += &format!("x{n} = {{ unit = \"V\", d = \"b*{before} - a*x{n}\", initial = 0 }}\n");
    }
    Model::parse(&format!("{text}[outputs]\ny = {{ value = \"{factor}*x{states}\", unit = \"V\" }}\n")).unwrap()
}

/// Prints the speed of the interpreter beside machines written by hand, and its multiply–adds beside the peak.
fn beside_twins(peak: Option<f64>) {
    println!(
        "| model, Runge–Kutta | million candidate-steps per second | of hand-written lanes | of the peak |\n|---|---|---|---|"
    );
    let volts = |n: usize, period: usize| if (n / period).is_multiple_of(2) { 8.0 } else { -5.0 };
    let motor = Recorded {
        step_s: 1e-3,
        inputs: (0..SAMPLES).map(|n| [volts(n, 250)]).collect(),
        measured: (0..SAMPLES).map(|n| [0.1, 0.2 * n as f64]).collect(),
    };
    let machine = Recorded {
        step_s: 1e-4,
        inputs: (0..SAMPLES).map(|n| [0.1 * volts(n, 300), volts(n, 170)]).collect(),
        measured: (0..SAMPLES).map(|n| [0.1, -0.2, 0.02 * n as f64]).collect(),
    };
    row("DC motor", BuiltIn::DcMotor, &motor, twins::dc_motor, peak);
    row("PMSM", BuiltIn::Pmsm, &machine, twins::pmsm, peak);
}

fn row<const N: usize, const U: usize>(
    name: &str,
    model: BuiltIn,
    recorded: &Recorded<N, U>,
    twin: impl Fn(&[f64], usize, &Recorded<N, U>) -> f64,
    peak: Option<f64>,
) {
    let model = model.model().unwrap();
    let signal = |of: usize| recorded.inputs.iter().map(|inputs| inputs.get(of).copied().unwrap_or(0.0)).collect();
    let recording = ModelRecording {
        step_s: vec![recorded.step_s],
        inputs: (0..model.inputs().len()).map(signal).collect(),
        measured: (0..N).map(|of| Some(recorded.measured.iter().map(|all| all[of]).collect())).collect(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s: (0..SAMPLES).map(|n| recorded.step_s * n as f64).collect(),
    };
    let own = problem(&model, recording, Some(IntegrationMethod::RungeKutta));
    let values = candidates(&own);
    let width = own.space().free.len();
    let mut costs = vec![0.0; CANDIDATES];
    let (ratio, time) = compared(
        || own.costs(Candidates::new(&values, width), &mut costs).unwrap(),
        || assert!(twin(&values, width, recorded).is_finite()),
    );
    let rate = (CANDIDATES * SAMPLES * own.work()) as f64 / time;
    let share = peak.map_or_else(String::new, |peak| format!("{:.2}", rate / peak));
    println!("| {name} | {} | {ratio:.2} | {share} |", steps(time));
}

/// Prints the time of a simulation with all derivatives and its normal equations, in simulations without derivatives.
fn derivatives() {
    println!(
        "| model, Runge–Kutta | parameters | simulation with all derivatives [ms] | of a plain one |\n|---|---|---|---|"
    );
    for (of, values) in [
        (BuiltIn::DcMotor, &[0.92, 7.8e-3, 0.073, 6.8e-4, 1.4e-4][..]),
        (BuiltIn::Pmsm, &[0.5, 1e-3, 1.5e-3, 0.05, 1e-4, 2e-4]),
        (BuiltIn::DcThermal, &[1.0, 1.0, 0.05, 1e-5, 1e-5, 5.0, 4.0, 1e-3]),
    ] {
        let model = of.model().unwrap();
        let level = |number: usize, n: usize| if (n / (90 + 40 * number)).is_multiple_of(2) { 6.0 } else { 1.0 };
        let input = |number: usize| (0..SAMPLES).map(|n| level(number, n)).collect::<Vec<f64>>();
        let mut recording = ModelRecording {
            step_s: vec![1e-4],
            inputs: (0..model.inputs().len()).map(input).collect(),
            measured: vec![Some(input(0)); model.outputs().len()],
            counting: Vec::new(),
            effective_sample_ratio: 1.0,
            name: None,
            assumed: None,
            time_s: (0..SAMPLES).map(|n| 1e-4 * n as f64).collect(),
        };
        // Its own trajectory is measured, so that the fit ends after few simulations.
        let initial = vec![vec![0.0; problem(&model, recording.clone(), None).open_initial(0).len()]];
        let own = problem(&model, recording.clone(), Some(IntegrationMethod::RungeKutta));
        recording.measured = own.simulate(values, 0, &initial[0]).outputs.into_iter().map(Some).collect();
        let own = problem(&model, recording, Some(IntegrationMethod::RungeKutta));
        let start: Vec<f64> = values.iter().map(|value| 1.1 * value).collect();
        let (mut ratios, mut times) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            let plain = median((0..5).map(|_| seconds(|| drop(own.simulate(&start, 0, &initial[0])))).collect());
            let begin = Instant::now();
            let found = refine_model(&own, &start, &initial, Some(&signal_sigma(&own))).unwrap();
            // One more simulation tests the residuals.
            let time = begin.elapsed().as_secs_f64() / (found.evaluations + 1) as f64;
            ratios.push(time / plain);
            times.push(1e3 * time);
        }
        println!("| {} | {} | {:.2} | {:.1} |", of.name(), values.len(), median(times), median(ratios));
    }
}

/// Prints the time from the text of a model to a problem that can be evaluated.
fn beginnings() {
    println!("| model | read [ms] | compile for a recording [ms] |\n|---|---|---|");
    for of in BuiltIn::all() {
        let text = of.model().unwrap().text().to_owned();
        let read = median((0..ROUNDS).map(|_| 1e3 * seconds(|| drop(Model::parse(&text).unwrap()))).collect());
        let model = of.model().unwrap();
        let time_s: Vec<f64> = (0..64).map(|n| 1e-3 * f64::from(n)).collect();
        let recording = ModelRecording {
            step_s: vec![1e-3],
            inputs: vec![time_s.clone(); model.inputs().len()],
            measured: vec![Some(time_s.clone()); model.outputs().len()],
            counting: Vec::new(),
            effective_sample_ratio: 1.0,
            name: None,
            assumed: None,
            time_s,
        };
        let settings = ModelSettings { method: Some((IntegrationMethod::RungeKutta, 1)), ..ModelSettings::default() };
        let compile = |_| {
            let (space, recordings) = (ModelSpace::new(&model, 1), vec![recording.clone()]);
            let begin = Instant::now();
            drop(ModelProblem::new(&model, space, recordings, settings).unwrap());
            1e3 * begin.elapsed().as_secs_f64()
        };
        println!("| {} | {read:.2} | {:.2} |", of.name(), median((0..ROUNDS).map(compile).collect()));
    }
}
