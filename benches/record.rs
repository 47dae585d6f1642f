//! Measures reading of recordings, in megabytes of CSV per second on one core, and the time of diagnostics.
//!
//! Reading includes SHA-256 of every byte and correctly rounded parsing of every number, which are also measured alone. With
//! `-- FILE` the file is read once, and the peak memory is printed.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::cast_precision_loss, reason = "a bench prints and stops")]

use motorfit::record::{ReadOptions, diagnose, read, read_bytes};
use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

/// Returns the time of the fastest of five runs \[s\], which is the least disturbed one.
fn seconds<T>(mut work: impl FnMut() -> T) -> f64 {
    let once = |_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64()
    };
    (0..5).map(once).fold(f64::INFINITY, f64::min)
}

/// Returns a recording as CSV with `digits` significant digits.
fn text(samples: u32, digits: usize) -> String {
    let mut text = String::from("time_s,voltage_V,current_A,speed_rad_s\n");
    for n in 0..samples {
        let t = f64::from(n) * 1e-3;
        let (i, w) = (1.2 + (7.0 * t).sin(), 128.0 + 30.0 * (3.0 * t).cos());
        let v = if n % 2000 < 1000 { 10.5 } else { 0.0 };
        let _ = writeln!(text, "{t:.3},{v},{i:.*},{w:.*}", digits - 1, digits - 3);
    }
    text
}

/// Prints the reading rate of a file, the size of its signals and the peak memory.
fn file(path: &str) {
    let megabytes = std::fs::metadata(path).unwrap().len() as f64 / 1e6;
    let start = Instant::now();
    let record = read(path.as_ref(), &ReadOptions::default()).unwrap().pop().unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let signals = 2 + record.measured().iter().flatten().count();
    let kept = (record.len() * signals * 8) as f64 / 1e6;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("not available").trim();
    println!(
        "{megabytes:.0} MB in {seconds:.2} s: {:.0} MB/s; signals {kept:.0} MB, peak memory {peak}",
        megabytes / seconds
    );
}

fn main() {
    if let Some(path) = std::env::args().skip(1).find(|arg| !arg.starts_with('-')) {
        return file(&path);
    }
    println!("{:<28}{:>9}{:>12}{:>12}{:>12}", "CSV", "MB", "read MB/s", "hash MB/s", "numbers MB/s");
    for (name, digits) in [("short numbers (5 digits)", 5), ("long numbers (17 digits)", 17)] {
        let text = text(1_000_000, digits);
        let bytes = text.as_bytes();
        let megabytes = bytes.len() as f64 / 1e6;
        let read = seconds(|| read_bytes(bytes, None, &ReadOptions::default()).unwrap());
        let hash = seconds(|| Sha256::digest(bytes));
        let numbers = seconds(|| {
            let cells = text.lines().skip(1).flat_map(|line| line.split(','));
            cells.map(|cell| cell.parse::<f64>().unwrap()).sum::<f64>()
        });
        let rate = |seconds: f64| megabytes / seconds;
        println!("{name:<28}{megabytes:>9.0}{:>12.0}{:>12.0}{:>12.0}", rate(read), rate(hash), rate(numbers));
    }
    println!("\n{:<28}{:>9}{:>12}", "diagnostics", "samples", "ms");
    for samples in [501, 3001, 10_001] {
        let record = read_bytes(text(samples, 7).as_bytes(), None, &ReadOptions::default()).unwrap().pop().unwrap();
        println!("{:<28}{samples:>9}{:>12.2}", "two channels", 1e3 * seconds(|| diagnose(&record)));
    }
}
