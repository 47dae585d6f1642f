//! Calls of `analysis` with extreme motors and recordings.

use crate::hostile::arguments::{FEW, NUMBERS, records, signals, step};
use crate::hostile::calls::{Calls, ask, drive};
use crate::hostile::drivers::identify::{fitted, mangled};
use motorfit::analysis::{
    Characteristics, FittedMotor, Intersample, Regressors, ResidualCorrelation, Residuals, TransferFunctions,
    characteristics, detect_intersample, noise_floor, record_warnings, regression, regressions, residual_input_test,
    split, suspicions, warnings_of_records,
};
use motorfit::evaluate::Model;
use motorfit::motor::{Discretization, Input, Parameter, Parameters, Space};
use motorfit::record::{Quantity, Record};

pub fn motors(calls: &mut Calls) {
    for found in mangled(&fitted()) {
        let motor = calls.call("analysis::FittedMotor::from", &found.values, || FittedMotor::from(&found)).unwrap();
        of_motor(calls, motor);
    }
    let uncertainty = fitted().uncertainty;
    for (value, space) in
        FEW.into_iter().flat_map(|v| [(v, Space::table2()), (v, crate::hostile::drivers::identify::all_fixed())])
    {
        for (input, values) in [Input::Voltage, Input::Current].into_iter().flat_map(|i| [0, 1, 5, 9].map(|n| (i, n))) {
            let values = vec![value; values];
            let parameters = Parameters { r: value, l: 1.0, k: value, b: 0.0, j: value };
            for residual_sigma in [&[None, Some(value)][..], &[Some(value), None], &[None; 2], &[]] {
                let uncertainty = uncertainty.as_ref();
                let (parameters, space, values, unidentified) = (&parameters, &space, &values[..], &[][..]);
                of_motor(
                    calls,
                    FittedMotor { input, parameters, space, values, unidentified, uncertainty, residual_sigma },
                );
            }
            for entry in [None, Some(value), Some(-1.0)] {
                let covariance = [[entry; 8]; 8];
                drive!(calls, (value, entry);
                    "analysis::characteristics" => characteristics(input, &parameters, [entry; 3], &covariance),
                );
            }
        }
    }
}

fn of_motor(calls: &mut Calls, motor: FittedMotor<'_>) {
    let all = calls.call("analysis::Characteristics::of", &motor, || Characteristics::of(motor)).flatten();
    drive!(calls, motor;
        "analysis::FittedMotor::lacks" => Parameter::ALL.map(|p| motor.lacks(p)),
        "analysis::FittedMotor::shared" => Parameter::EXTENSIONS.map(|p| motor.shared(p)),
        "analysis::Characteristics::named_of" => Characteristics::named_of(motor),
        "analysis::Characteristics::named" => [Input::Voltage, Input::Current].map(|input| Characteristics::named(all.as_ref(), input)),
    );
}

pub fn residuals(calls: &mut Calls) {
    let all = signals();
    for voltage in &all {
        let Some(regressors) = calls.call("analysis::Regressors::new", voltage, || Regressors::new(voltage)) else {
            continue;
        };
        for values in &all {
            let marks = [vec![], vec![false; values.len()], vec![true, false]];
            let moves = [vec![], vec![values.clone()], vec![vec![0.0; 3]]];
            for (counting, sensitivities) in marks.iter().zip(&moves) {
                let residuals = Residuals { values, regressors: &regressors, counting, sensitivities };
                drive!(calls, (voltage, values);
                    "analysis::residual_input_test" => residual_input_test(&residuals),
                    "analysis::ResidualCorrelation::of" => ResidualCorrelation::of(values, voltage),
                );
            }
        }
    }
    drive!(calls, (); "analysis::ResidualCorrelation::cross_lags" => ResidualCorrelation::cross_lags().count());
    for (a, b) in NUMBERS.into_iter().zip(NUMBERS.into_iter().rev()) {
        let motor = Parameters { r: a, l: b, k: a, b, j: 1.0 };
        drive!(calls, motor; "analysis::TransferFunctions::of" => TransferFunctions::of(&motor));
        let found = Intersample { better: Discretization::Rk4, log_likelihood: a, sigma_ratio: b };
        drive!(calls, found; "analysis::Intersample::warning" => found.warning(Quantity::Time));
    }
}

pub fn of_recordings(calls: &mut Calls) {
    let all = records();
    drive!(calls, "none";
        "analysis::warnings_of_records" => warnings_of_records(&[]),
        "analysis::regression" => NUMBERS.map(|window| regression(&[], window)),
        "analysis::regressions" => regressions(&[], Some(f64::NAN)),
        "analysis::suspicions" => suspicions(&[], Discretization::Zoh),
    );
    ask!(calls, "none";
        "analysis::noise_floor" => noise_floor(&[], Model::default()),
        "analysis::split" => split(Vec::new(), f64::NAN, &mut Vec::new()),
    );
    for (n, record) in all.iter().enumerate() {
        let (one, two) = (std::slice::from_ref(record), [record.clone(), step(60)]);
        drive!(calls, record;
            "analysis::record_warnings" => record_warnings(record),
            "analysis::warnings_of_records" => (warnings_of_records(one), warnings_of_records(&two)),
            "analysis::regression" => NUMBERS.map(|window| (regression(one, window), regression(&two, window))),
            "analysis::regressions" => NUMBERS.map(|seconds| regressions(&two, Some(seconds))),
        );
        for fraction in NUMBERS {
            ask!(calls, (fraction, record); "analysis::split" => split(two.to_vec(), fraction, &mut Vec::new()));
        }
        let refs: [Vec<&Record>; 2] = [vec![record, record], vec![record, &two[1]]];
        for records in &refs {
            ask!(calls, record; "analysis::noise_floor" => noise_floor(records, Model::default()));
        }
        let how = Discretization::ALL[n % Discretization::ALL.len()];
        drive!(calls, (record, how); "analysis::suspicions" => suspicions(one, how));
        for (value, how) in FEW.into_iter().zip(Discretization::ALL.into_iter().cycle()) {
            ask!(calls, (record, value, how);
                "analysis::detect_intersample" => detect_intersample(record, Some(&[value; 5]), how));
        }
    }
}
