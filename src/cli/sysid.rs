//! The command `sysid`: a mechanism of a robot from a log with the tests of SysId.

use super::args::SysidArgs;
use super::output;
use super::prelude::*;
use motorfit::analysis::{CONTROLLERS, Controller, FeedbackWeights};
use motorfit::identify::TrustLevel;
use motorfit::identify::mechanism::{Feedback, MechanismFit, MechanismSpec, identify_mechanism, mechanism_signals};
use motorfit::identify::model::ModelProgress;
use motorfit::optimize::{Progress, Stop};
use motorfit::record::Record;
use motorfit::report::{
    FeedbackDesign, MechanismLine, columns_csv, command_line, mechanism_code, mechanism_document, mechanism_lines,
    mechanism_page, mechanism_selection,
};

/// Text in place of reasons for a level of trust.
const WITHOUT_REASONS: &str = "no test of the residuals, the search or the log contradicts the standard errors";

pub(super) fn run(args: &SysidArgs, style: &Style) -> Result<Outcome> {
    let controller = controller(args)?;
    let weights = weights(args)?;
    let (records, is_linear) = records(args)?;
    let out = args.out.as_deref().map(Out::take).transpose()?;
    let spec = MechanismSpec { kind: args.mechanism, is_linear, seed: 1 };
    let mut observe = progress::reporter(style, "round");
    let mut look = |progress: ModelProgress| {
        let (generation, generations) = (progress.done, progress.of);
        observe(&Progress { generation, generations, evaluations: 0, cost: f64::NAN });
        signals::searching(generation < generations);
        signals::interrupted()
    };
    let fit = with_threads(args.threads, || identify_mechanism(&records, &spec, &mut look))?;
    drop(observe);
    style.warnings(&fit.found.warnings);
    if fit.found.stop == Stop::Interrupted {
        style.note("interrupted: the result is the best so far");
    }
    let design = FeedbackDesign::of(&fit, weights, &controller);
    let document = json(&mechanism_document(&records, &fit, &design));
    if args.json {
        data(&document)?;
    } else {
        let next = fit.found.trust.next.as_ref().map(|next| next.spelled(command_line));
        let text = output::trust_line(&fit.found.trust, WITHOUT_REASONS, next.as_deref())
            + &text(&records, &fit, &design, style);
        show(&text)?;
    }
    if let Some(out) = out {
        let how = out::reproduced(vec![
            ("mechanism", mechanism_selection(&fit)),
            ("integration", fit.found.method.described()),
            ("evaluations", fit.found.evaluations.to_string()),
            ("time", engineering(fit.found.seconds, "s", 3)),
        ]);
        let page = mechanism_page(&records, &fit, &design, &how).html(!args.page.no_script);
        let files = [
            ("report.html".to_owned(), page),
            ("curves.csv".to_owned(), curves(&fit)),
            ("result.json".to_owned(), document),
        ];
        out.write(&files, style)?;
    }
    Ok(match fit.found.trust.level {
        _ if fit.found.stop == Stop::Interrupted => Outcome::Interrupted,
        TrustLevel::Check | TrustLevel::Poor if args.strict => Outcome::Untrusted,
        _ => Outcome::Done,
    })
}

/// Returns the controller of the feedback loop.
fn controller(args: &SysidArgs) -> Result<Controller> {
    let named = CONTROLLERS.iter().find(|of| of.name == args.controller).unwrap_or(&CONTROLLERS[0]);
    let period_s = args.period.unwrap_or(named.period_s);
    let delay_s = args.delay.unwrap_or(named.delay_s);
    if !(period_s > 0.0 && period_s <= 1.0) {
        let hint = "Give seconds above 0 and up to 1, usually 0.02 or 0.001.";
        return Err(Error::usage(format!("--period is {period_s}"), hint));
    }
    if !(0.0..=1.0).contains(&delay_s) {
        return Err(Error::usage(format!("--delay is {delay_s}"), "Give seconds from 0 to 1."));
    }
    Ok(Controller { period_s, delay_s, ..*named })
}

/// Returns the weights of the regulators.
fn weights(args: &SysidArgs) -> Result<FeedbackWeights> {
    let SysidArgs { position_error: position, velocity_error: velocity, max_voltage: volts, .. } = *args;
    for (flag, value) in [("position-error", position), ("velocity-error", velocity), ("max-voltage", volts)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::usage(format!("--{flag} is {value}"), "Give a number above 0."));
        }
    }
    Ok(FeedbackWeights { position, velocity, volts })
}

/// Reads the tests, with an angle or, if the log has a length, with a length; true for a length.
fn records(args: &SysidArgs) -> Result<(Vec<Record>, bool)> {
    let reading = |is_linear: bool| settings::signal_reading(&args.recordings.reading.0, mechanism_signals(is_linear));
    // Stdin can be read once.
    let piped = match &args.recordings.records[..] {
        [only] if stdio::is_stdio(only) => Some(stdio::stdin()?),
        _ => None,
    };
    let read = |is_linear: bool| match &piped {
        Some(bytes) => reading(is_linear)?.records_from_bytes(bytes, None).map_err(|error| error.in_part("stdin")),
        None => inputs::records_with(&args.recordings.records, &reading(is_linear)?),
    };
    let by_angle = match read(false) {
        Ok(records) => return Ok((records, false)),
        Err(error) => error,
    };
    match read(true) {
        Ok(records) => Ok((records, true)),
        // Only the unit of an angle was wrong.
        Err(by_length) if by_angle.to_string().contains("does not convert to rad") => Err(by_length),
        Err(_) => Err(by_angle),
    }
}

fn text(records: &[Record], fit: &MechanismFit, design: &FeedbackDesign<'_>, style: &Style) -> String {
    let mut text = String::new();
    if !style.quiet {
        let _ = writeln!(text, "{}\n", inputs::all_understood(records));
    }
    let lines = mechanism_lines(fit);
    let _ = writeln!(text, "  {DIM}{:<22}{:>12} {:<10} {:>11}   95 % interval{DIM:#}", "", "", "", "std. error");
    for line in &lines {
        let MechanismLine { name, text: about, value, unit, std_error, ci95, at_bound } = line;
        let value = value.map_or_else(|| "\u{2013}".to_owned(), |value| significant(value, 6));
        let remark = match (std_error.zip(*ci95), at_bound) {
            (Some((error, [low, high])), _) => {
                format!("{:>11}   {} … {}", significant(error, 2), significant(low, 6), significant(high, 6))
            }
            (_, Some(side)) => format!("{DIM}at its {} bound{DIM:#}", if *side == "max" { "upper" } else { "lower" }),
            _ => format!("{DIM}not identifiable{DIM:#}"),
        };
        let _ = writeln!(text, "  {STRONG}{name:<8}{STRONG:#}{about:<14}{value:>12} {unit:<10} {remark}");
    }
    text.push('\n');
    for (name, value) in rows(fit, design) {
        let _ = writeln!(text, "  {name:<10}{}", printable(&value));
    }
    text
}

fn rows(fit: &MechanismFit, design: &FeedbackDesign<'_>) -> Vec<(&'static str, String)> {
    let mut rows = vec![("mechanism", mechanism_selection(fit))];
    if let Some((ka, kv)) = fit.in_unit("kA").zip(fit.in_unit("kV")) {
        rows.push(("response", format!("time constant kA/kV {}", engineering(ka.0 / kv.0, "s", 4))));
    }
    if let Some(fit) = fit.found.fit_percent.first().copied().flatten() {
        rows.push(("fit", format!("velocity {} %", motorfit::text::decimals(fit, 2))));
    }
    let gain = |value: f64, error: Option<f64>| {
        let error = error.map_or_else(String::new, |error| format!(" ± {}", significant(error, 2)));
        format!("{}{error}", significant(value, 5))
    };
    let of = |feedback: Option<Feedback>| match feedback {
        Some(Feedback { gains, std_error: [kp, kd] }) if gains.kd.abs() > 0.0 => {
            format!("kP {}, kD {}", gain(gains.kp, kp), gain(gains.kd, kd))
        }
        Some(Feedback { gains, std_error }) => format!("kP {}", gain(gains.kp, std_error[0])),
        None => "\u{2013}".to_owned(),
    };
    let (controller, weights, unit) = (design.controller, design.weights, fit.unit.symbol);
    let [period, delay] = [controller.period_s, controller.delay_s].map(|seconds| engineering(seconds, "s", 3));
    rows.push((
        "feedback",
        format!("{}: period {period}, delay {delay}, at most {} V", controller.name, Shortest(weights.volts)),
    ));
    let [velocity, position] = [weights.velocity, weights.position].map(Shortest);
    rows.push(("", format!("velocity {} (error of {velocity} {unit}/s)", of(design.velocity))));
    rows.push(("", format!("position {} (error of {position} {unit})", of(design.position))));
    let mut code = mechanism_code(fit).into_iter();
    rows.extend(code.next().map(|line| ("code", line)));
    rows.extend(code.map(|line| ("", line)));
    rows.push(("time", engineering(fit.found.seconds, "s", 3)));
    rows
}

/// Returns CSV with the measured and modelled velocity of all tests, one after the other, in the unit of the log.
fn curves(fit: &MechanismFit) -> String {
    let unit = fit.unit.symbol;
    let heads = ["test".to_owned(), "time_s".to_owned(), "voltage [V]".to_owned()].into_iter();
    let heads: Vec<String> = heads.chain(["velocity", "velocity model"].map(|of| format!("{of} [{unit}/s]"))).collect();
    let mut columns = vec![Vec::new(); heads.len()];
    for ((n, recording), fitted) in (1_u32..).zip(&fit.recordings).zip(&fit.found.fits) {
        let measured = recording.measured.first().and_then(Option::as_ref);
        let (Some(measured), Some(simulated), Some(volts)) =
            (measured, fitted.simulated.first(), recording.inputs.first())
        else {
            continue;
        };
        let scaled = |values: &[f64]| values.iter().map(|value| value / fit.unit.factor).collect::<Vec<_>>();
        columns[0].extend(vec![f64::from(n); recording.len()]);
        columns[1].extend(&recording.time_s);
        columns[2].extend(volts);
        columns[3].extend(scaled(measured));
        columns[4].extend(scaled(simulated));
    }
    columns_csv(&heads, &columns)
}
