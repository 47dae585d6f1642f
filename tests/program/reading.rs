//! Proves: every command reads, prepares and diagnoses recordings alike, by the same flags; columns and findings are reported
//! with code, place and remedy in text, JSON and pages; wrong flags are rejected with a remedy.
//! Does not prove: the rules themselves (diagnose) and preparation (preparation.rs).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small numbers"
)]

use crate::support::program::{EXAMPLE, Folder, fails, json, ok, run, text};
use crate::support::recordings;
use crate::support::{changed, driven, m2_record};
use motorfit::analysis::detect_intersample;
use motorfit::motor::{Discretization, Parameters};
use motorfit::record::{Record, write_csv};
use serde_json::Value;

fn value(document: &Value, symbol: &str) -> f64 {
    document["parameters"][symbol]["value"].as_f64().unwrap()
}

/// Returns a recording under steps up and down at 1 kHz, with changed samples.
fn steps(change: impl FnOnce(&mut motorfit::record::Samples)) -> Record {
    let time: Vec<f64> = (0..4000).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = time.iter().map(|t| [0.0, 10.0, 4.0, -8.0, 0.0, 9.0, -3.0, 6.0][(t / 0.5) as usize % 8]).collect();
    let noisy = motorfit::experiment::with_noise(&driven(time, voltage, None), [0.012, 1.04], 5).unwrap();
    changed(&noisy, change)
}

#[test]
fn preparation_by_flags() {
    let whole = json(&["identify", EXAMPLE, "--json"]);
    for (flags, samples, period, note) in [
        (&["--crop", "0.5:2"][..], 1501, 0.001, "cropped to 0.500000 s … 2.00000 s"),
        (&["--crop", ":2"], 2001, 0.001, "cropped"),
        (&["--rate", "500"], 1501, 0.002, "one of 2 samples kept"),
        (&["--decimate", "4"], 751, 0.004, "one of 4 samples kept"),
        (&["--rate", "800"], 2401, 0.00125, "regular clock of 1.6000 kHz"),
        (&["--filter", "chebyshev:100:4:0.5"], 3001, 0.001, "low-pass: Chebyshev (0.5 dB), order 4, 100.0 Hz"),
        (&["--mask", "1.5:1.7,current@2:2.1"], 3001, 0.001, "masked: 201 samples"),
        (&["--offset", "current=0,speed=0"], 3001, 0.001, "offsets subtracted"),
        (&["--offset", "auto"], 3001, 0.001, "offsets subtracted"),
        (&["--mask", "auto"], 3001, 0.001, ""),
    ] {
        let document = json(&[&["identify", EXAMPLE, "--json"], flags].concat());
        let record = &document["records"][0];
        assert_eq!(record["samples"], samples, "{flags:?}");
        assert!((record["period_s"].as_f64().unwrap() / period - 1.0).abs() < 1e-9, "{flags:?}");
        let notes = record["notes"].to_string();
        assert!(notes.contains(note), "{flags:?}: {notes}");
        for symbol in ["R", "L", "K", "B", "J"] {
            let error = whole["parameters"][symbol]["std_error"].as_f64().unwrap();
            let apart = (value(&document, symbol) - value(&whole, symbol)).abs() / error;
            assert!(apart < 3.0, "{flags:?}: {symbol} is {apart} standard errors off");
        }
    }
    for command in ["inspect", "compare", "evaluate"] {
        let more: &[&str] = match command {
            "compare" => &["--runs", "2", "--generations", "5", "--noise-records", "2"],
            "evaluate" => &["--sample", "uniform:10"],
            _ => &[],
        };
        let document = json(&[&[command, EXAMPLE, "--json", "--rate", "500"], more].concat());
        assert_eq!(document["records"][0]["samples"], 1501, "{command}");
    }
}

#[test]
fn columns_and_files_by_flags() {
    let folder = Folder::new();
    let record = m2_record();
    let samples = record.samples();
    let rows = |row: &dyn Fn(usize) -> String| (0..record.len()).map(|n| row(n) + "\n").collect::<String>();
    let [current, speed] = record.measured().map(Option::unwrap);
    let bare = folder.file("bare.txt", rows(&|n| format!("{} {} {}", samples.voltage[n], current[n], speed[n])));
    let columns = "voltage=1:V,current=2:A,speed=3:rad/s";
    let found = json(&["identify", &bare, "--columns", columns, "--rate", "1000", "--json"]);
    assert!((value(&found, "R") / 0.921_042 - 1.0).abs() < 1e-6);
    assert_eq!(found["records"][0]["samples"], 3001, "the rate is that of the file");
    let flag = folder.file(
        "flag.csv",
        format!(
            "tick,on,mA,w\n{}",
            rows(&|n| {
                format!("{n},{},{},{}", if samples.voltage[n] > 0.0 { 0.7 } else { 0.6 }, 1e3 * current[n], speed[n])
            })
        ),
    );
    let columns = "time=tick:1kHz,voltage=on:0..10.5,current=mA:mA,speed=w:rad/s";
    let found = json(&["identify", &flag, "--columns", columns, "--json"]);
    assert!((value(&found, "K") / 0.073_472 - 1.0).abs() < 1e-6);
    assert_eq!(found["records"][0]["columns"][1]["conversion"], "flag: 0 or 10.500");
    let first = folder.file(
        "a.csv",
        format!("t,u,i\n{}", rows(&|n| format!("{},{},{}", samples.time_s[n], samples.voltage[n], current[n]))),
    );
    let second = folder.file("b.csv", format!("t,w\n{}", rows(&|n| format!("{},{}", samples.time_s[n], speed[n]))));
    let both = json(&["identify", &format!("{first}+{second}"), "--json"]);
    assert!((value(&both, "J") / 0.000_136 - 1.0).abs() < 1e-6);
    assert!(both["records"][0]["path"].as_str().unwrap().contains("a.csv+"));
    fails(&["identify", &first, "--columns", "voltage=u*x"], 3, "no column \"x\" in \"u*x\"");
    fails(&["identify", &format!("{first}+nothing.csv")], 3, "nothing.csv");
}

#[test]
fn wrong_flags_are_refused() {
    for (flags, part) in [
        (&["--crop", "1"][..], "not FROM:TO"),
        (&["--crop", "2:1"], "holds nothing"),
        (&["--crop", "a:1"], "--crop"),
        (&["--crop", "7:9"], "leaves 0 samples"),
        (&["--filter", "bessel:5"], "not a filter"),
        (&["--filter", "butterworth:600"], "half the sampling rate"),
        (&["--mask", "power@1:2"], "neither current nor speed"),
        (&["--offset", "power=1"], "not a signal"),
        (&["--offset", "current=1,current=2"], "twice"),
        (&["--decimate", "0"], "--decimate is 0"),
        (&["--decimate", "2000"], "leaves too little"),
        (&["--rate", "0"], "--rate is 0"),
        (&["--rate", "nan"], "--rate is NaN"),
        (&["--rate", "1e13"], "more than 100000000 samples"),
        (&["--rate", "500", "--decimate", "2"], "cannot be used with"),
        (&["--gaps", "ignore"], "invalid value"),
    ] {
        fails(&[&["identify", EXAMPLE], flags].concat(), 2, part);
    }
    fails(&["inspect", EXAMPLE, "--columns", "position=current_A*2"], 3, "unit \"none\" of position is not known");
}

#[test]
fn findings_are_reported_everywhere_with_place_and_remedy() {
    let folder = Folder::new();
    let clipped = steps(|s| s.current.as_mut().unwrap().iter_mut().for_each(|i| *i = i.clamp(-4.0, 4.0)));
    let path = folder.file("clipped.csv", write_csv(&clipped));
    let out = folder.path("out");
    let document = json(&["identify", &path, "--json", "--out", &out]);
    let warning = document["warnings"].as_array().unwrap().iter().find(|w| w["code"] == "current_clipped").unwrap();
    assert_eq!(warning["place"]["quantity"], "current");
    assert!(warning["place"]["lines"][0][0].as_u64().unwrap() > 500, "{warning}");
    assert!(warning["remedy"].as_str().unwrap().contains("--mask auto"), "{warning}");
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(page.contains("as if it were cut off there") && page.contains("--mask auto"));
    let shown = text(&run(&["identify", &path]).stderr);
    assert!(shown.contains("warning:") && shown.contains("(line") && shown.contains("[current_clipped]"), "{shown}");
    assert!(text(&run(&["identify", &path, "-q"]).stderr).is_empty());
    // The advised flag removes the finding.
    let masked = json(&["identify", &path, "--json", "--mask", "auto"]);
    let apart = |document: &Value| {
        let error = document["parameters"]["R"]["std_error"].as_f64().unwrap();
        (value(document, "R") - 0.921_042).abs() / error
    };
    // Standard errors allow for coloured residuals; the clipped current biases by 20 of them.
    assert!(apart(&document) > 10.0 && apart(&masked) < 4.0, "{} {}", apart(&document), apart(&masked));
    assert_ne!(document["trust"]["level"], "good", "{}", document["trust"]);
    assert!(!masked["warnings"].to_string().contains("current_clipped"), "{}", masked["warnings"]);
    // A good recording has no warnings; remarks are shown by `inspect`.
    assert_eq!(text(&run(&["identify", EXAMPLE]).stderr), "");
    assert!(text(&run(&["identify", EXAMPLE, "-v"]).stderr).contains("[single_edge]"));
    let compared = json(&["compare", &path, "--json", "--runs", "2", "--generations", "5", "--noise-records", "2"]);
    assert!(compared["warnings"].to_string().contains("current_clipped"));
}

#[test]
fn a_rate_too_low_for_the_motor_is_reported() {
    let folder = Folder::new();
    let path = folder.file("steps.csv", write_csv(&steps(|_| ())));
    let coarse = |flags: &[&str]| {
        let document = json(&[&["identify", &path, "--json"], flags].concat());
        document["warnings"].to_string().contains("coarse_rate")
    };
    assert!(!coarse(&[]) && !coarse(&["--decimate", "4"]) && coarse(&["--decimate", "10"]));
    assert!(!coarse(&["--rate", "1700"]) && coarse(&["--rate", "300"]));
}

#[test]
fn an_input_reset_and_a_drive_that_is_off_are_cut() {
    let folder = Folder::new();
    let reset = steps(|s| {
        let last = s.voltage.len() - 2;
        s.voltage[last..].fill(0.0);
    });
    let path = folder.file("reset.csv", write_csv(&reset));
    let found = json(&["identify", &path, "--json", "--mask", "auto"]);
    let inspected = ok(&["inspect", &path]);
    println!("{inspected}");
    assert!(found["records"][0]["samples"].as_u64().unwrap() >= 3998);
    let off = steps(|_| ());
    // From 1.6 s to 1.9 s the drive is off: the motor coasts, and is driven again from its state.
    let mut samples = off.samples().clone();
    let clean = driven(samples.time_s.clone(), samples.voltage.clone(), None);
    let clean = clean.measured().map(|signal| signal.unwrap().to_vec());
    let (mut i, mut w) = (0.0, 0.0);
    let p = Parameters::M2.to_array();
    for (n, v) in samples.voltage.clone().into_iter().enumerate() {
        let coasting = (1600..1900).contains(&n);
        // The noise of the recording is kept.
        samples.current.as_mut().unwrap()[n] += i - clean[0][n];
        samples.speed.as_mut().unwrap()[n] += w - clean[1][n];
        for _ in 0..50 {
            let h = 2e-5;
            let di = if coasting { -i / 1e-4 } else { (v - p[0] * i - p[2] * w) / p[1] };
            let dw = (p[2] * i - p[3] * w) / p[4];
            (i, w) = (i + h * di, w + h * dw);
        }
    }
    let path = folder.file("off.csv", write_csv(&Record::new(samples).unwrap()));
    let plain = json(&["identify", &path, "--json"]);
    assert!(plain["warnings"].to_string().contains("voltage_without_current"), "{}", plain["warnings"]);
    let cut = json(&["identify", &path, "--json", "--mask", "auto"]);
    assert_eq!(cut["records"].as_array().unwrap().len(), 2);
    assert_eq!(cut["records"][1]["part"], "segment 2");
    // The tolerance of 0.5 % is for the fifty Euler steps per sample of this test.
    let worst = |document: &Value| {
        let truth = ["R", "L", "K", "B", "J"].into_iter().zip(p);
        truth.map(|(symbol, p)| (value(document, symbol) / p - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(worst(&cut) < 0.01 && worst(&plain) > 0.05, "it matters: {} {}", worst(&cut), worst(&plain));
}

#[test]
fn inspect_makes_a_page() {
    let folder = Folder::new();
    let evil = steps(|s| s.speed.as_mut().unwrap().iter_mut().for_each(|w| *w = (*w / 6.0).round() * 6.0));
    let text = write_csv(&evil).replace("speed_rad_s", "speed<script>x</script> (rad/s)");
    let path = folder.file("odd <b>.csv", text);
    let out = folder.path("page");
    ok(&["inspect", &path, EXAMPLE, "--out", &out]);
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(page.contains("coarse_quantization") && page.contains("Fault") && page.contains("what to do"));
    assert!(page.contains("speed&lt;script&gt;x") && !page.contains("<b>.csv"));
    assert_eq!(page.matches("<script").count(), 1, "the script of the page alone");
    assert_eq!(page.matches("<figure class=\"traces\"").count(), 2, "the signals of each");
    let document: Value =
        serde_json::from_str(&std::fs::read_to_string(format!("{out}/result.json")).unwrap()).unwrap();
    assert_eq!(document["records"].as_array().unwrap().len(), 2);
    ok(&["inspect", EXAMPLE, "--out", &out]);
    let own = folder.path("own");
    std::fs::create_dir(&own).unwrap();
    std::fs::write(format!("{own}/report.html"), "mine").unwrap();
    fails(&["inspect", EXAMPLE, "--out", &own], 3, "left unchanged");
}

/// Returns a recording under a continuously varying voltage, simulated with a zero-order or first-order hold.
fn following(method: Discretization, seed: u64, speed_only: bool) -> Record {
    use motorfit::experiment::{Excitation, simulated, with_noise};
    let period = 0.004;
    let time_s: Vec<f64> = (0..1500).map(|n| f64::from(n) * period).collect();
    let voltage = time_s.iter().map(|t| 6.0 * (t * (2.0 + 4.0 * t)).sin() + 2.0 * (31.0 * t).sin()).collect();
    let clean = simulated(&Parameters::M2, &Excitation { time_s, voltage, torque: None }, method).unwrap();
    // The current distinguishes the holds at once; in the speed alone the electrical lag is similar, so the noise is lower.
    let noisy = with_noise(&clean, if speed_only { [0.0, 0.2] } else { [0.02, 1.0] }, seed).unwrap();
    changed(&noisy, |s| s.current = s.current.take().filter(|_| !speed_only))
}

#[test]
fn the_hold_of_the_voltage_is_detected_from_the_outputs() {
    let truth = Parameters::M2.to_array();
    let (zoh, foh) = (Discretization::Zoh, Discretization::Foh);
    for speed_only in [false, true] {
        let start = (!speed_only).then_some(&truth);
        let said = |made, taken, seed| detect_intersample(&following(made, seed, speed_only), start, taken).unwrap();
        for seed in 0..20 {
            assert_eq!(said(foh, zoh, seed).map(|b| b.better), Some(foh), "{speed_only} {seed}");
            assert_eq!(said(zoh, foh, seed).map(|b| b.better), Some(zoh), "{speed_only} {seed}");
            assert_eq!(said(zoh, zoh, seed), None);
            assert_eq!(said(foh, foh, seed), None);
        }
    }
    assert_eq!(
        detect_intersample(&m2_record(), Some(&truth), zoh).unwrap(),
        None,
        "one step is too little to tell a line by"
    );
    let folder = Folder::new();
    let path = folder.file("sampled.csv", write_csv(&following(foh, 1, false)));
    let document = json(&["identify", &path, "--json"]);
    assert!(document["warnings"].to_string().contains("--discretization foh"), "{}", document["warnings"]);
    let taken = json(&["identify", &path, "--json", "--discretization", "foh"]);
    assert!(!taken["warnings"].to_string().contains("between_samples"));
}

#[test]
fn uninformative_segments_do_not_affect_a_fit() {
    let folder = Folder::new();
    let record = steps(|_| {});
    let samples = record.samples();
    let speed = samples.speed.as_ref().unwrap();
    let current = samples.current.as_ref().unwrap();
    let good = |shift: f64, signal: &[f64]| -> String {
        (0..1500).map(|n| format!("{:.4},{},{}\n", samples.time_s[n] + shift, samples.voltage[n], signal[n])).collect()
    };
    // Long segments without motion, or without voltage.
    let flat = |shift: f64, volts: &dyn Fn(usize) -> f64, value: &dyn Fn(usize) -> f64| -> String {
        (0..2000).map(|n| format!("{:.4},{},{}\n", n as f64 * 1e-3 + shift, volts(n), value(n))).collect()
    };
    for (heading, signal, kind) in
        [("time_s,voltage_V,speed_rad_s", speed, "gain"), ("time_s,voltage_V,current_A", current, "R")]
    {
        let alone = folder.file("alone.csv", format!("{heading}\n{}", good(0.0, signal)));
        let of = |path: &str| {
            let found = json(&["identify", path, "--gaps", "split", "--json"]);
            if kind == "R" {
                value(&found, "R")
            } else {
                found["characteristics"]["output_error"]["gain"]["value"].as_f64().unwrap()
            }
        };
        let expected = of(&alone);
        for (volts, still) in [
            (&(|_| 0.0) as &dyn Fn(usize) -> f64, &(|_| 0.0) as &dyn Fn(usize) -> f64),
            (&(|n| if n > 50 { 6.0 } else { 0.0 }), &(|_| 1e-300)),
        ] {
            let zero = volts(100) == 0.0;
            let name = folder.file("two.csv", format!("{heading}\n{}{}", good(0.0, signal), flat(10.0, volts, still)));
            let run = run(&["identify", &name, "--gaps", "split"]);
            let said = text(&run.stdout) + &text(&run.stderr);
            assert!(!said.contains("the bounds of"), "{said}");
            if zero {
                assert!((of(&name) / expected - 1.0).abs() < 0.02, "{kind}: {} {expected}", of(&name));
            }
        }
        // A single recording without motion is rejected with its name.
        let idle = folder.file("idle.csv", format!("{heading}\n{}", flat(0.0, &|_| 0.0, &|n| (n as f64 * 1e-2).sin())));
        fails(&["identify", &idle], 4, "idle.csv: the voltage is zero throughout");
        let dead = folder.file("dead.csv", format!("{heading}\n{}", flat(0.0, &|n| (n / 100 % 3) as f64, &|_| 0.0)));
        fails(&["identify", &dead], 4, "is zero throughout");
    }
}

/// Returns the column arguments that an error's help advises, as shell words; `None` if it advises none.
fn advised(said: &str) -> Option<Vec<String>> {
    let help = said.split("Name the columns: --columns ").nth(1)?;
    let (value, rest) = match help.strip_prefix('\'') {
        Some(quoted) => quoted.split_once('\'')?,
        None => help.split_once([';', ' '])?,
    };
    let skip = rest.starts_with(" --bad-rows skip").then_some(["--bad-rows", "skip"]);
    Some(["--columns", value].into_iter().chain(skip.into_iter().flatten()).map(str::to_owned).collect())
}

/// Reads a file with the advised arguments of its error; returns the arguments and the resulting columns.
fn read_as_advised(path: &str) -> (Vec<String>, String) {
    let refusal = fails(&["identify", path], 3, "");
    let flags = advised(&refusal).unwrap_or_else(|| panic!("{path}: {refusal}"));
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let read = json(&[&["inspect", path, "--json"], &flags[..]].concat());
    let columns = read["records"][0]["columns"].as_array().unwrap_or_else(|| panic!("{read}")).clone();
    let column = |c: &Value| format!("{}: {} [{}]", c["quantity"], c["heading"], c["unit"]).replace('"', "");
    (columns.iter().map(column).collect(), flags.join(" "))
}

#[test]
fn a_refusal_names_the_columns_that_read_the_file() {
    let folder = Folder::new();
    let rows = |row: &dyn Fn(f64) -> String| (0..50).map(|n| row(f64::from(n)) + "\n").collect::<String>();
    let table = |heading: &str, row: &dyn Fn(f64) -> String| format!("{heading}\n{}", rows(row));
    for (name, text, flags) in [
        (
            "micros.csv",
            table("micros,duty,count", &|n| format!("{},{},{}", n * 1e4, (n / 50.0).fract(), n * n)),
            "--columns time=micros:us,voltage=duty*12:V,position=count/4096:turns",
        ),
        (
            "wide.csv",
            table("t (s);PWM, 10 bit;Drehzahl;I", &|n| {
                format!("{};{};{},5;0,1", n * 0.01, n * 20.0, n).replace('.', ",")
            }),
            "--columns time=\"t (s)\":s,voltage=\"PWM, 10 bit\"*12/1023:V,speed=Drehzahl:rpm,current=I:A",
        ),
        (
            "ticks.csv",
            table("t_ms,pwm,rpm", &|n| format!("{},{},{n}", n * 10.0, if n < 9.0 { 0.0 } else { 7200.0 })),
            "--columns time=t_ms:ms,voltage=pwm*12/7200:V,speed=rpm:rpm",
        ),
        (
            "flag.csv",
            table("t_ms,step,rpm", &|n| format!("{},{},{n}", n * 10.0, if n < 9.0 { 0.6 } else { 0.7 })),
            "--columns time=t_ms:ms,voltage=step:0..12,speed=rpm:rpm",
        ),
        (
            "steps.csv",
            table("dt,pwm,rpm", &|n| format!("{},{},{n}", 10.0 + n % 2.0, n * 5.0)).replace("\n11,", "\nreset\n11,"),
            "--columns time=cumsum(dt):ms,voltage=pwm*12/255:V,speed=rpm:rpm",
        ),
        ("serial.txt", rows(&|n| format!("12:00:{n:02}.000 -> {},{},{n}", n * 10.0, n * 5.0)), ""),
        (
            "plotter.txt",
            rows(&|n| format!("t={}, pwm={}, motor rpm={n}", n * 10.0, n * 5.0)),
            "--columns time=t:ms,voltage=pwm*12/255:V,speed=\"motor rpm\":rpm",
        ),
    ] {
        let path = folder.file(name, text);
        if flags.is_empty() {
            let said = fails(&["identify", &path], 3, "found numbers, expected a heading");
            assert!(said.contains("In the first row #1 is 0, #2 is 0, #3 is 0"), "{said}");
            let columns = "time=#1:ms,voltage=#2*12/255:V,speed=#3:rpm";
            let read = json(&["inspect", &path, "--columns", columns, "--json"]);
            assert!(read["records"][0]["notes"].to_string().contains("stamps of a serial monitor"), "{read}");
            continue;
        }
        if name == "steps.csv" {
            // A row that may belong to a running sum is not skipped silently.
            let said = fails(&["identify", &path], 3, "--bad-rows skip");
            assert!(
                said.contains(&flags.replace("time=", "'time=").replace(":rpm", ":rpm' --bad-rows skip")),
                "{said}"
            );
            continue;
        }
        assert_eq!(read_as_advised(&path).1, flags, "{name}");
    }
    // The advice keeps the named columns and does not guess unclear ones.
    let path = folder.file("part.csv", table("ticks,x,rpm", &|n| format!("{n},{n},{n}")));
    let said = fails(&["identify", &path, "--columns", "time=ticks:1kHz"], 3, "no column for voltage_V");
    assert!(!said.contains("Name the columns:"), "{said}");
    let said = fails(&["identify", &path, "--columns", "voltage=x*2"], 3, "no column for time_s");
    assert!(!said.contains("Name the columns:"), "{said}");
    let path = folder.file("named.csv", table("millis,x,rpm", &|n| format!("{},{n},{n}", n * 10.0)));
    let said = fails(&["identify", &path, "--columns", "voltage=x*2"], 3, "no column for time_s");
    assert!(said.contains("'voltage=x*2,time=millis:ms,speed=rpm:rpm'"), "{said}");
}

/// Logs that are rejected, and the columns that the help advises.
const ADVISED: [(&str, &str); 6] = [
    ("a_natural.csv", "time: millis [ms], voltage: pwm [V], current: current_mA [mA], speed: rpm [rpm]"),
    ("e_garbage.csv", "time: millis [ms], voltage: pwm [V], current: current_mA [mA], speed: rpm [rpm]"),
    ("d_nocurrent.csv", "time: millis [ms], voltage: pwm [V], speed: rpm [rpm]"),
    (
        "b_german.csv",
        "time: Zeit (ms) [ms], voltage: PWM (0-255) [V], current: Strom (mA) [mA], speed: Drehzahl (U/min) [U/min]",
    ),
    ("c_spanish.csv", "time: tiempo [ms], voltage: ciclo [V], current: corriente [mA], speed: velocidad [rpm]"),
    ("h_serial.txt", "time: t [ms], voltage: pwm [V], current: mA [mA], speed: rpm [rpm]"),
];
/// Logs that are read without arguments.
const PLAIN: [&str; 9] = [
    "f_volts.csv",
    "i_wrongunit.csv",
    "j_reversed.csv",
    "k_good.csv",
    "l_const.csv",
    "m_few.csv",
    "glitch.csv",
    "reg.csv",
    "reg2.csv",
];

#[test]
fn logs_of_newcomers_are_read_or_rejected_with_working_advice() {
    let Some(logs) = recordings::set("newcomer-logs") else { return };
    let path = |name: &str| logs.join(name).to_str().unwrap().to_owned();
    let mut seen = 0;
    for (name, columns) in ADVISED {
        let (read, flags) = read_as_advised(&path(name));
        assert_eq!(read.join(", "), columns, "{name}");
        assert_eq!(flags.contains("--bad-rows skip"), name == "e_garbage.csv", "{name}: {flags}");
        seen += 1;
    }
    let said = fails(&["identify", &path("g_noheader.csv")], 3, "found numbers, expected a heading");
    assert!(
        said.contains("time=#N:UNIT") && said.contains("In the first row #1 is 0, #2 is 0, #3 is 19, #4 is 1"),
        "{said}"
    );
    let named = "time=#1:ms,voltage=#2*12/255:V,speed=#3:rpm,current=#4:mA";
    assert_eq!(json(&["inspect", &path("g_noheader.csv"), "--columns", named, "--json"])["records"][0]["samples"], 402);
    let e = [
        "inspect",
        &path("e_garbage.csv"),
        "--columns",
        "time=millis:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=current_mA:mA",
    ];
    assert!(fails(&e, 3, "line ").contains("--bad-rows skip"));
    let skipped = json(&[&e[..], &["--bad-rows", "skip", "--json"]].concat());
    let notes = skipped["records"][0]["notes"].to_string();
    assert!(notes.contains("Sensor reset!") || notes.contains("could not be read"), "{notes}");
    // The advice is used literally.
    let reversed = fails(&["identify", &path("j_reversed.csv")], 4, "--columns 'speed=speed_rad_s*-1'");
    assert!(reversed.contains("[sign_reversed]"));
    let turned = json(&["identify", &path("j_reversed.csv"), "--columns", "speed=speed_rad_s*-1", "--json"]);
    assert!(turned["fit_percent"]["speed"].as_f64().unwrap() > 95.0);
    for name in PLAIN {
        let code = run(&["identify", &path(name)]).status.code();
        assert!(code == Some(0) || code == Some(4), "{name}: {code:?}");
        seen += 1;
    }
    let count = std::fs::read_dir(&logs).unwrap().filter(|entry| {
        let path = entry.as_ref().unwrap().path();
        path.extension().is_some_and(|kind| kind == "csv" || kind == "txt")
    });
    assert_eq!(count.count(), seen + 1, "every log");
}
