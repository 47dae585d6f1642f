//! Hostile arguments: numbers, counts, texts, signals and recordings.

use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameters};
use motorfit::record::{Record, Samples};

/// Numbers at the limits of double precision, and ordinary ones.
pub const NUMBERS: [f64; 17] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    5e-324,
    -5e-324,
    f64::MIN_POSITIVE,
    f64::MAX,
    f64::MIN,
    1e-300,
    9_007_199_254_740_993.0,
    1e9,
    1.0,
    -1.0,
    0.5,
    1e-3,
];

/// A few numbers, for functions of several arguments.
pub const FEW: [f64; 7] = [f64::NAN, f64::INFINITY, -1.0, 0.0, 5e-324, 1.0, f64::MAX];

/// Counts, indices and sizes.
pub const COUNTS: [usize; 10] =
    [0, 1, 2, 3, 7, 1000, u32::MAX as usize, usize::MAX / 2 + 1, usize::MAX - 1, usize::MAX];

/// Counts of 64 bits.
pub const WIDE: [u64; 9] = [0, 1, 2, 7, 1000, 1 << 53, u64::MAX / 2 + 1, u64::MAX - 1, u64::MAX];

/// Returns texts that are invalid for any parser, and some that are nearly valid.
#[expect(clippy::too_many_lines, reason = "a list")]
pub fn texts() -> Vec<String> {
    let short = [
        "",
        " ",
        "\0",
        "\n",
        "\r\n",
        "\u{202e}abc\u{2066}",
        "\u{feff}",
        "é",
        "🦀",
        "\u{1b}[31m",
        "NaN",
        "inf",
        "-inf",
        "-1",
        "1e999",
        "1e-999",
        "-0",
        "0x10",
        "18446744073709551616",
        "4294967296",
        ":",
        "::",
        ",",
        ",,",
        "=",
        "==",
        "a=b",
        "R=1",
        "R=nan",
        "R=1e309",
        "R=-1",
        "R=0.1:1",
        "R=1:0.1",
        "R=::",
        "R=1,L=2,K=3,B=4,J=5",
        "auto",
        "none",
        "[",
        "R[4294967295]",
        "R[4294967296]",
        "R[",
        "R[-1]",
        "butterworth:50:2",
        "butterworth:nan:99999999999999999999",
        "chebyshev:50:2:inf",
        "euclidean:peak",
        "nrmse:",
        ":std",
        "1/1",
        "0/0",
        "18446744073709551615/18446744073709551615",
        "gpu",
        "gpu:",
        "gpu:18446744073709551616",
        "gpu:99999",
        "speed=#1",
        "time=#0",
        "voltage=#1*(2",
        "time=#1:kHz",
        "a/b",
        "..",
        "/",
        "1:2:3",
        "0.5:0.1",
        "current=",
        "20db",
        "1,2",
        "dead-time",
        "coulomb,coulomb",
        "sm",
        "gwo",
        "voltage:0..1",
        "speed:1:nan",
        "1e308:1e309",
        "%",
        "'",
        "\"",
        "\\",
        "*",
        "**/**",
        "?",
        "{",
        "}}",
    ];
    let mut texts: Vec<String> = short.map(str::to_owned).to_vec();
    for one in ["a", "1", "(", "-", "\u{202e}", "#1+", ",", ":", "🦀"] {
        texts.push(one.repeat(65_536 / one.len()));
    }
    texts
}

/// Returns signals of various values and lengths.
pub fn signals() -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = NUMBERS.iter().map(|number| vec![*number]).collect();
    all.push(Vec::new());
    all.push(NUMBERS.to_vec());
    all.push(NUMBERS.iter().rev().copied().collect());
    all.push(vec![f64::NAN; 100]);
    all.push(vec![0.0; 100]);
    all.push(vec![f64::MAX; 5]);
    all.push(vec![f64::MAX, f64::MIN, f64::MAX, f64::MIN]);
    all.push(vec![5e-324; 9]);
    all.push((0..37).map(f64::from).collect());
    all.push((0..20_000).map(|n| f64::from(n % 7)).collect());
    all
}

/// Returns extreme recordings that are accepted.
pub fn records() -> Vec<Record> {
    let even = |count: u32, period: f64| -> Vec<f64> { (0..count).map(|n| f64::from(n) * period).collect() };
    let wave = |count: u32, size: f64| -> Vec<f64> { (0..count).map(|n| size * f64::from(n % 5) - size).collect() };
    let mut all = Vec::new();
    for count in [2, 3, 4, 5, 9, 40] {
        for (period, size) in [(1e-3, 1.0), (1e-300, 1e9), (1e6, 1e-300), (5e-324, 0.0), (1e300, 1.0), (0.1, 1e9)] {
            let (time_s, signal) = (even(count, period), Some(wave(count, size)));
            for (voltage, current, speed) in [
                (wave(count, size), signal.clone(), signal.clone()),
                (wave(count, size), None, signal.clone()),
                (vec![0.0; count as usize], signal.clone(), None),
                (Vec::new(), signal.clone(), Some(vec![0.0; count as usize])),
            ] {
                all.push(Samples {
                    time_s: time_s.clone(),
                    voltage,
                    torque: signal.clone(),
                    current,
                    speed,
                    ..Samples::default()
                });
            }
        }
    }
    let mut accepted: Vec<Record> = all.into_iter().filter_map(|samples| Record::new(samples).ok()).collect();
    assert!(accepted.len() > 40, "{} are accepted", accepted.len());
    accepted.push(step(60));
    accepted
}

/// Returns a step response of the M2 motor.
pub fn step(samples: u32) -> Record {
    let step = Excitation::step(10.5, 0.005, f64::from(samples - 1) * 1e-3, 1e-3).unwrap();
    simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap()
}
