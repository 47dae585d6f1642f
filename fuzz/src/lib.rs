//! Bodies of the fuzz targets, shared by cargo-fuzz (`fuzz_targets/`) and, on a stable compiler, `tests/fuzz.rs`.
//! Each takes arbitrary bytes and a folder for files, panics if an invariant is violated, and returns true if the input was
//! accepted.

use motorfit::Error;
use motorfit::candidates::Candidates;
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::model::{Model, ShaderPrecision};
use motorfit::record::{
    BadRows, Gaps, Mask, Offset, Preparation, ReadOptions, Record, diagnose, parse_columns, preview, read_bytes,
};
use motorfit::study::sweep::Sweep;
use std::path::Path;

/// Body of a fuzz target.
pub type Target = fn(&[u8], &Path) -> bool;

/// Names of the targets, their bodies, and the dictionaries of the mutations.
pub const TARGETS: [(&str, Target, &[&str]); 4] = [
    ("recording", recording, &RECORDING_WORDS),
    ("study", study, &STUDY_WORDS),
    ("columns", columns, &COLUMNS_WORDS),
    ("model", model, &MODEL_WORDS),
];

const MODEL_WORDS: [&str; 44] = [
    "format = 1\n",
    "name = \"x\"\n",
    "[inputs]\n",
    "[parameters]\n",
    "[constants]\n",
    "[signals]\n",
    "[let]\n",
    "[states]\n",
    "[outputs]\n",
    "[export]\n",
    "k = { unit = \"N*m\", min = 1, max = 2, log = true }\n",
    "x = { unit = \"rad\", d = \"w\", initial = \"free\" }\n",
    "y = { value = \"x\", unit = \"rad\", average = \"k\" }\n",
    "delay = \"td\"",
    "latency = \"td\"",
    "initial = \"measured\"",
    "unit = \"1\"",
    "armature = \"J\"",
    "stick(w, Tc)",
    "select(w < 0 && i > 1 || v <= 2, i, w)",
    "deadzone(w, b)",
    "clamp(i, -1, 1)",
    "sin(",
    "tanh(",
    "exp(",
    "log(",
    "sqrt(",
    "atan2(w, i)",
    "pow(w, 3)",
    "max(i, w)",
    "sign(w)",
    "abs(w)",
    "^2",
    "^-1",
    "/0",
    "((((((((",
    "))))",
    "+ -",
    "1e308",
    "1e-400",
    "\u{3c9}",
    "\\n",
    "'",
    "\"\"\"",
];

const RECORDING_WORDS: [&str; 36] = [
    "time",
    "t [ms]",
    "voltage",
    "pwm",
    "current",
    "I [mA]",
    "speed",
    "rpm",
    "position [deg]",
    "load_torque",
    "NaN",
    "inf",
    "1e308",
    "-1e-308",
    "1e999",
    "0",
    "-0",
    "18446744073709551616",
    "1,5",
    "\"",
    "\n",
    "\r\n",
    ";",
    "\t",
    ",,",
    "\u{feff}",
    "sep=;\n",
    "14:03:00.018 -> ",
    "[",
    "{",
    "null",
    "\0\0\0\0",
    "PK\u{3}\u{4}",
    "MATLAB 5.0 ",
    "<c r=\"XFD1048576\">",
    "#",
];

const STUDY_WORDS: [&str; 38] = [
    "recordings = [",
    "\"a.csv\"",
    "\"*.csv\"",
    "\"**/*\"",
    "\"../\"",
    "{motor = \"m\", files = [\"a.csv\"]}",
    "methods = ",
    "\"auto\"",
    "\"sm\"",
    "\"gwo\"",
    "seeds = \"1..20\"",
    "\"0..18446744073709551615\"",
    "population = [50]",
    "generations = ",
    "with = [\"coulomb\"]",
    "bounds = ",
    "fix = {J = 1e-4}",
    "{R = [0.1, 1.0]}",
    "split = 0.7",
    "validate = [\"b.csv\"]",
    "per_recording = [\"TL\"]",
    "polish = [\"lm\"]",
    "noise = [\"40dB\"]",
    "criterion = [\"nrmse\"]",
    "set = ",
    "columns = ",
    "rate = ",
    "mask = [\"auto\"]",
    "precision = \"f32\"",
    "nan",
    "inf",
    "9223372036854775807",
    "-1",
    "1e308",
    "\n[x]\n",
    "\"\"\"",
    "[[",
    "]",
];

const COLUMNS_WORDS: [&str; 40] = [
    "time=",
    "voltage=",
    "current=",
    "speed=",
    "position=",
    "load_torque=",
    ",",
    "#1",
    "#2",
    "#5",
    "#6",
    "#0",
    "tick",
    "duty",
    "\"supply (V)\"",
    "count",
    "angle",
    "+",
    "-",
    "*",
    "/",
    "^",
    "(",
    ")",
    "sin(",
    "cos(",
    "abs(",
    "int8(",
    "int16(",
    "int32(",
    "cumsum(",
    "pi",
    ":V",
    ":ms",
    ":8kHz",
    ":turns",
    "..",
    "1e308",
    "0",
    "-",
];

/// Asserts that an error has a hint.
fn check_error(error: &Error) {
    assert!(!error.hint().is_empty(), "{error} has no hint");
}

/// Asserts that a recording has at least two samples, strictly increasing times, and finite signals of equal length.
fn check_record(record: &Record) {
    let samples = record.samples();
    assert!(samples.time_s.len() >= 2 && samples.time_s.iter().all(|t| t.is_finite()));
    assert!(samples.time_s.windows(2).all(|t| t[1] > t[0]));
    assert!(samples.signals().all(|(_, signal)| signal.len() == record.len() && signal.iter().all(|v| v.is_finite())));
}

/// Reads the bytes as a file of any format: they give valid recordings, which are diagnosed and prepared, or an error with a
/// hint. The last byte selects the options.
pub fn recording(bytes: &[u8], _: &Path) -> bool {
    let Some((&how, bytes)) = bytes.split_last() else { return false };
    let columns = match how % 4 {
        0 => "",
        1 => "time=#1:8kHz,voltage=#2*12/255:V,speed=#3:rpm",
        2 => "voltage=#2:0..12,position=cumsum(#3)/4096:turns,load_torque=int16(#2)*sin(position)/(#3-1)",
        _ => "time=#1,voltage=#2,current=#3*-1+0.5:mA",
    };
    let options = ReadOptions {
        columns: parse_columns(columns).unwrap_or_default(),
        rate_hz: (how & 4 != 0).then_some(1000.0),
        gaps: [Gaps::Error, Gaps::Keep, Gaps::Split][usize::from(how / 8) % 3],
        bad_rows: if how & 128 != 0 { BadRows::Skip } else { BadRows::Error },
        drop_repeats: how & 64 != 0,
        ..ReadOptions::default()
    };
    let records = match read_bytes(bytes, None, &options) {
        Ok(records) => records,
        Err(error) => {
            check_error(&error);
            if let Err(error) = preview(bytes, None, &options) {
                check_error(&error);
            }
            return false;
        }
    };
    assert!(!records.is_empty());
    // A file that gives recordings can be previewed.
    let tables = preview(bytes, None, &options);
    assert!(tables.is_ok_and(|tables| tables.iter().all(|table| !table.columns.is_empty())));
    for record in &records {
        check_record(record);
        for finding in diagnose(record) {
            assert!(finding.places.iter().all(|p| p.start < p.end && p.end <= record.len()));
        }
        let preparation = Preparation {
            offset: Offset::Auto,
            mask: vec![Mask::Auto],
            rate_hz: (how & 128 != 0).then_some(0.3 / record.period_s()).filter(|_| record.len() < 10_000),
            filter: "butterworth:50:2".parse().ok().filter(|_| how & 32 != 0),
            ..Preparation::default()
        };
        match preparation.apply(record) {
            Ok(prepared) => prepared.iter().for_each(check_record),
            Err(error) => check_error(&error),
        }
    }
    true
}

/// Recording that is present beside a study.
const FOUND: &str = "time_s,voltage,current,speed\n0,0,0,0\n0.001,1,0.5,2\n0.002,1,0.7,5\n0.003,1,0.6,7\n";

/// Reads the bytes as a study with two recordings: it can be planned, opened and planned again with the same digest, or gives
/// an error with a hint.
///
/// # Panics
/// Panics if an invariant is violated or the folder cannot be written.
pub fn study(bytes: &[u8], folder: &Path) -> bool {
    let (study, plan) = (folder.join("study.toml"), folder.join("plan"));
    for name in ["a.csv", "b.csv"].map(|name| folder.join(name)) {
        if !name.exists() {
            std::fs::write(&name, FOUND).expect("a folder for files");
        }
    }
    std::fs::write(&study, bytes).expect("a folder for files");
    let planned = Sweep::plan(&study, &plan, None);
    let is_accepted = planned.is_ok();
    match planned {
        Err(error) => check_error(&error),
        Ok((sweep, is_known)) => {
            assert!(!is_known && sweep.manifest().runs > 0);
            let opened = Sweep::open(&plan).unwrap_or_else(|error| panic!("planned, but not opened: {error}"));
            assert!(opened.digest() == sweep.digest());
            let (again, is_known) =
                Sweep::plan(&study, &plan, None).unwrap_or_else(|error| panic!("not again: {error}"));
            assert!(is_known && again.digest() == sweep.digest());
        }
    }
    if plan.exists() {
        std::fs::remove_dir_all(&plan).expect("a folder for files");
    }
    is_accepted
}

/// Table for expressions: a clock, a duty cycle, a supply voltage, a 16-bit counter that wraps around, an angle.
const TABLE: &str = "tick,duty,\"supply (V)\",count,angle\n0,0,12,65530,0\n8,1,12,65534,1\n16,1,11.9,3,3\n24,0.5,11.9,9,6\n\
                     32,-0.5,12,12,8\n40,0,12.1,12,9\n48,-1,12,8,8\n56,1,12,1,5\n";

/// Reads the bytes as a column request for a small table: it gives valid recordings, or an error with a hint.
pub fn columns(bytes: &[u8], _: &Path) -> bool {
    let read = parse_columns(&String::from_utf8_lossy(bytes))
        .and_then(|columns| read_bytes(TABLE.as_bytes(), None, &ReadOptions { columns, ..ReadOptions::default() }));
    match read {
        Ok(ref records) => records.iter().for_each(check_record),
        Err(ref error) => check_error(error),
    }
    read.is_ok()
}

/// Reads the bytes as a model: it is simulated, evaluated and written as a shader, or gives an error with a hint.
pub fn model(bytes: &[u8], _: &Path) -> bool {
    let model = match Model::parse(&String::from_utf8_lossy(bytes)) {
        Ok(model) => model,
        Err(error) => {
            check_error(&error);
            return false;
        }
    };
    model.wgsl(ShaderPrecision::F64).iter().for_each(|shader| assert!(!shader.is_empty()));
    let time_s: Vec<f64> = (0..8).map(|n| 1e-3 * f64::from(n)).collect();
    let recording = ModelRecording {
        step_s: vec![1e-3],
        inputs: vec![time_s.iter().map(|t| (900.0 * t).sin()).collect(); model.inputs().len()],
        measured: vec![Some(time_s.clone()); model.outputs().len()],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s,
    };
    let space = ModelSpace::new(&model, 1);
    let candidates: Vec<f64> =
        [0.1, 0.5, 1.0].iter().flat_map(|at| space.free.iter().map(|axis| axis.at(*at))).collect();
    let width = space.free.len();
    match ModelProblem::new(&model, space, vec![recording], ModelSettings::default()) {
        Ok(problem) => {
            let mut costs = [0.0; 3];
            let candidates = Candidates::new(&candidates, width);
            if width > 0 {
                problem.costs(candidates, &mut costs).expect("candidates that fit the space");
            }
            assert!(costs.iter().all(|cost| *cost >= 0.0), "a cost that is negative or not a number");
        }
        Err(error) => check_error(&error),
    }
    true
}
