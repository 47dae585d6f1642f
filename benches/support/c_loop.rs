//! The Grey Wolf Optimizer in C, `benches/baseline/gwo.c`, compiled here if there is a compiler.

use motorfit::record::{Record, write_csv};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A compiled search in C on a recording, in a folder of its own.
pub struct CLoop(TempDir);

impl CLoop {
    /// Compiles the search for this processor; `None` without a compiler that knows OpenMP.
    pub fn new(record: &Record) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/baseline/gwo.c");
        let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
        let mut command = Command::new(compiler);
        command.args(["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fopenmp"]);
        // Compilers for other processors do not know this option.
        if cfg!(target_arch = "x86_64") {
            command.arg("-mprefer-vector-width=512");
        }
        let is_compiled = command.arg(source).arg("-o").arg(folder.path().join("gwo")).arg("-lm").status();
        std::fs::write(folder.path().join("record.csv"), write_csv(record)).unwrap();
        is_compiled.is_ok_and(|status| status.success()).then_some(Self(folder))
    }

    /// Returns the median time of a search over `runs` in a new process \[s\].
    pub fn seconds(&self, threads: usize, runs: usize) -> f64 {
        let mut command = Command::new(self.0.path().join("gwo"));
        command.arg(self.0.path().join("record.csv")).arg(runs.to_string()).env("OMP_NUM_THREADS", threads.to_string());
        let output = String::from_utf8(command.output().unwrap().stdout).unwrap();
        1e-3 * output.split(' ').next().unwrap().parse::<f64>().unwrap()
    }
}
