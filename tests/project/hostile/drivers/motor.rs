//! Calls of `motor`: parameters, spaces, step maps, simulation.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, signals, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::coordinate::Coordinate;
use motorfit::motor::{
    Axis, Discretization, Dual, Extended, ExtendedWalk, Extension, Input, InputHistory, Method, ModelFeatures, Number,
    Parameter, Parameters, Scope, SimulationInput, SimulationSettings, Space, StepMap, With, inverse, matrix_logarithm,
    product, response, simulate, step_maps, times, walk,
};
use motorfit::named::Named;

fn all_parameters() -> impl Iterator<Item = Parameter> {
    Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS)
}

fn coordinates(calls: &mut Calls, range: Coordinate) {
    drive!(calls, range;
        "coordinate::Coordinate::of" => NUMBERS.map(|value| range.of(value)),
        "coordinate::Coordinate::value" => NUMBERS.map(|value| range.value(value)),
        "coordinate::Coordinate::slope" => NUMBERS.map(|value| range.slope(value)),
        "coordinate::Coordinate::around" => NUMBERS.map(|value| range.around(value, value)),
        "coordinate::Coordinate::at" => NUMBERS.map(|value| range.at(value)),
        "coordinate::Coordinate::is_idle" => NUMBERS.map(|value| range.is_idle(value)),
    );
}

pub fn parameters(calls: &mut Calls) {
    for word in texts() {
        ask!(calls, word;
            "motor::Parameter::from_str" => word.parse::<Parameter>(),
            "motor::Extension::from_str" => word.parse::<Extension>(),
            "motor::Extension::named" => <Extension as Named>::named("with", &word),
            "motor::Discretization::named" => <Discretization as Named>::named("discretization", &word),
            "motor::Input::named" => <Input as Named>::named("input", &word),
            "motor::With::from_str" => word.parse::<With>(),
            "motor::With::parse" => With::parse(&[word.clone(), word.clone()]),
        );
        drive!(calls, word; "motor::Scope::named" => Scope::named(&word));
    }
    ask!(calls, (); "motor::With::parse" => With::parse(&[]));
    for p in all_parameters() {
        drive!(calls, p;
            "motor::Parameter::text" => p.text(),
            "motor::Parameter::symbol" => p.symbol(),
            "motor::Parameter::unit" => p.unit(),
            "motor::Parameter::name" => p.name(),
            "motor::Parameter::is_extension" => p.is_extension(),
            "motor::Parameter::neutral" => p.neutral(),
            "motor::Parameter::admits" => NUMBERS.map(|value| p.admits(value)),
            "motor::Parameter::lowest" => p.lowest(),
            "motor::Parameter::domain" => p.domain(),
            "motor::Parameter::channel" => p.channel(),
            "motor::Parameter::default_bounds" => p.default_bounds(),
            "motor::Parameter::table2" => p.table2(),
            "motor::Extension::of" => Extension::of(p),
            "motor::With::may_have" => [With::Auto, With::These(Vec::new())].map(|with| with.may_have(p)),
        );
        for scope in [Scope::Shared, Scope::Recording(0), Scope::Recording(u32::MAX)] {
            drive!(calls, (p, scope);
                "motor::Scope::covers" => scope.covers(u32::MAX),
                "motor::Scope::name" => scope.name(p),
                "motor::Scope::recording" => scope.recording(),
                "motor::Scope::order" => scope.order(p),
            );
            for (min, max) in FEW.into_iter().flat_map(|a| FEW.map(|b| (a, b))) {
                let axis = Axis { parameter: p, scope, min, max };
                drive!(calls, axis;
                    "motor::Axis::coordinate" => NUMBERS.map(|value| axis.coordinate(value)),
                    "motor::Axis::value" => NUMBERS.map(|value| axis.value(value)),
                    "motor::Axis::slope" => NUMBERS.map(|value| axis.slope(value)),
                    "motor::Axis::range" => axis.range(),
                    "motor::Axis::neutral" => axis.neutral(),
                    "motor::Axis::middle" => axis.middle(),
                );
                coordinates(calls, axis.range());
                ask!(calls, axis;
                    "motor::Space::new" => Space::new(vec![axis, axis], vec![(p, scope, min)]),
                    "motor::Space::table2_with" => Space::table2_with(&[(p, min, max)], &[]),
                    "motor::Space::table2_to_extend" => Space::table2_to_extend(&[], &[(p, min), (p, max)]),
                );
            }
        }
    }
    ask!(calls, (); "motor::Space::new" => Space::new(Vec::new(), Vec::new()));
    for one in Extension::ALL {
        drive!(calls, one;
            "motor::Extension::name" => one.name(),
            "motor::Extension::parameters" => one.parameters(),
            "motor::Extension::is_delay_like" => one.is_delay_like(),
            "motor::Extension::resembles" => Extension::ALL.map(|other| one.resembles(other)),
            "motor::Extension::acts_on_current" => one.acts_on_current(),
            "motor::Extension::needs" => one.needs(),
        );
    }
}

pub fn features_and_spaces(calls: &mut Calls) {
    for some in [Vec::new(), all_parameters().collect(), vec![Parameter::Load; 1000]] {
        let features: ModelFeatures = some.iter().copied().collect();
        drive!(calls, some;
            "motor::ModelFeatures::with" => some.iter().fold(features, |f, p| f.with(*p)),
            "motor::ModelFeatures::has" => all_parameters().filter(|p| features.has(*p)).count(),
            "motor::ModelFeatures::has_any" => features.has_any(&some),
            "motor::ModelFeatures::extensions" => features.extensions(),
            "motor::ModelFeatures::is_linear" => features.is_linear(),
            "motor::ModelFeatures::is_delayed" => features.is_delayed(),
            "motor::ModelFeatures::is_biased" => features.is_biased(),
            "motor::ModelFeatures::is_averaged" => features.is_averaged(),
        );
    }
    let space = Space::table2();
    for signal in signals() {
        drive!(calls, signal;
            "motor::Space::parameters" => space.parameters(&signal, u32::MAX),
            "motor::Space::motor" => space.motor(&signal, 0),
        );
    }
    drive!(calls, ();
        "motor::Space::table2" => Space::table2(),
        "motor::Space::free" => space.free(),
        "motor::Space::fixed" => space.fixed(),
        "motor::Space::bounds" => space.bounds(),
        "motor::Space::features" => space.features(),
    );
    for recordings in COUNTS {
        let twice = [Parameter::R, Parameter::R, Parameter::Load];
        ask!(calls, recordings; "motor::Space::per_recording" => space.per_recording(&twice, recordings));
    }
}

/// Returns motors with extreme values.
fn motors() -> Vec<Extended> {
    let mut all: Vec<Extended> = NUMBERS.iter().map(|v| Extended::from(&Parameters::from_array([*v; 5]))).collect();
    all.push(Extended::from(&Parameters::M2));
    for value in NUMBERS {
        for p in Parameter::EXTENSIONS {
            all.push(Extended::from(&Parameters::M2).with(p, value));
        }
    }
    for value in [1.0, 3.0, 1e-3] {
        all.push(Parameter::EXTENSIONS.into_iter().fold(Extended::from(&Parameters::M2), |m, p| m.with(p, value)));
    }
    all
}

pub fn values(calls: &mut Calls) {
    let methods = Discretization::ALL
        .into_iter()
        .flat_map(|discretization| Input::ALL.into_iter().map(move |input| Method { discretization, input }));
    let methods: Vec<Method> = methods.collect();
    for motor in motors() {
        let plain = motor.parameters();
        drive!(calls, motor;
            "motor::Extended::from" => Extended::from(&plain),
            "motor::Extended::parameters" => motor.parameters(),
            "motor::Extended::features" => motor.features(),
            "motor::Extended::get" => all_parameters().map(|p| motor.get(p)).sum::<f64>(),
            "motor::Extended::set" => { let mut other = motor; all_parameters().for_each(|p| other.set(p, f64::NAN)); other },
            "motor::Extended::with" => motor.with(Parameter::DeadTime, f64::INFINITY),
            "motor::Extended::map" => motor.map(|v| v.to_string()),
            "motor::Parameters::from_array" => Parameters::from_array(motor.motor),
            "motor::Parameters::to_array" => plain.to_array(),
            "motor::Parameters::get" => all_parameters().map(|p| plain.get(p)).sum::<f64>(),
            "motor::Parameters::steady_state" => FEW.map(|v| plain.steady_state(v, -v)),
        );
        for (method, h) in methods.iter().flat_map(|method| FEW.map(|h| (*method, h))) {
            drive!(calls, (&motor, method, h);
                "motor::StepMap::new" => StepMap::new(&plain, h, method),
                "motor::StepMap::with_sensitivities" => StepMap::with_sensitivities(&plain, h, method),
                "motor::step_maps" => step_maps(&motor.motor.map(|v| [v, f64::NAN, -v]), h, method),
                "motor::Method::uses_next_input" => method.uses_next_input(),
                "motor::Discretization::uses_next_input" => method.discretization.uses_next_input(),
                "motor::Discretization::name" => method.discretization.name(),
                "motor::Input::name" => method.input.name(),
                "motor::Method::from" => Method::from(method.discretization),
            );
        }
    }
    for (a, b) in NUMBERS.into_iter().flat_map(|a| NUMBERS.map(|b| (a, b))) {
        let m = [a, b, b, a];
        drive!(calls, (a, b);
            "motor::product" => product(m, m),
            "motor::inverse" => inverse(m),
            "motor::times" => times(m, [b, a]),
            "motor::matrix_logarithm" => NUMBERS.map(|h| matrix_logarithm([a, b, h, 1.0], h)),
            "motor::Number::constant" => <Dual<3> as Number>::constant(a),
            "motor::Number::value" => <Dual<3> as Number>::constant(a).value(),
            "motor::Number::abs" => Number::abs(a) + Dual::<1>::constant(b).abs().value,
            "motor::Number::clip" => Number::clip(a, b) + Dual::<1>::constant(a).clip(Dual::constant(b)).value,
            "motor::Number::multiply_add" => f64::multiply_add::<true>(a, b, a) + f64::multiply_add::<false>(a, b, b),
        );
    }
}

pub fn simulations(calls: &mut Calls) {
    let few = [0.0, 1.0, f64::NAN, -f64::MAX, 3.0];
    let steps: [(&[f64], &[u16]); 6] = [
        (&[], &[]),
        (&[1e-3], &[]),
        (&[f64::NAN], &[0]),
        (&[1e-3, f64::INFINITY], &[0, 1, 7, u16::MAX]),
        (&[0.0], &[]),
        (&[-1.0], &[]),
    ];
    for (step_s, step_index) in steps {
        for (voltage, voltage_end, torque) in
            [(&few[..], &[][..], &[][..]), (&[], &few, &few), (&few, &few[..2], &few[..1]), (&few[..1], &few, &few)]
        {
            let drive = SimulationInput { step_s, step_index, voltage, voltage_end, torque };
            for n in COUNTS {
                drive!(calls, (drive, n);
                    "motor::SimulationInput::index" => drive.index(n),
                    "motor::SimulationInput::step" => drive.step(n),
                    "motor::SimulationInput::end" => drive.end(n),
                );
            }
            for motor in motors() {
                let features = motor.features();
                for discretization in Discretization::ALL {
                    drive!(calls, (&motor, drive);
                        "motor::simulate" => simulate(&motor.parameters(), &drive, [f64::NAN, 0.0], discretization),
                        "motor::walk" => walk(&motor.parameters(), &drive, [1.0; 2], discretization, |_| ()),
                    );
                    for first_movement in [0, 2, usize::MAX] {
                        let history = InputHistory { voltage: f64::INFINITY, first_movement };
                        let settings = SimulationSettings { features, method: discretization.into(), history };
                        calls.may_panic("motor::ExtendedWalk::new", || {
                            ExtendedWalk::new(&motor, &drive, settings, [0.0; 2]).count()
                        });
                    }
                }
            }
        }
    }
    // A drive that lists its steps can be simulated for every motor.
    let voltage = [0.0, 1.0, 5.0, -3.0, 2.0, 2.0, 1e9, 0.0];
    let drive = SimulationInput { step_s: &[1e-3], step_index: &[], voltage: &voltage, voltage_end: &[], torque: &[] };
    for motor in motors() {
        for (first_movement, discretization) in
            [(0, Discretization::Zoh), (1, Discretization::Foh), (usize::MAX, Discretization::Rk4)]
        {
            let history = InputHistory { voltage: 0.0, first_movement };
            let settings = SimulationSettings { features: motor.features(), method: discretization.into(), history };
            drive!(calls, (&motor, first_movement);
                "motor::ExtendedWalk::new" => ExtendedWalk::new(&motor, &drive, settings, [0.0; 2]).count());
        }
    }
    for signal in &signals() {
        drive!(calls, signal; "motor::InputHistory::of" => [true, false].map(|at_rest| InputHistory::of(signal, at_rest)));
        for band in NUMBERS {
            drive!(calls, (band, signal);
                "motor::response" => (response(signal, signal, band), response(&[0.0], signal, band), response(signal, &[], band)));
        }
    }
}
