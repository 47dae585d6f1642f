//! Proves: mutations of a corpus of recordings, studies, column requests and models are read with all invariants, or rejected with a
//! remedy; none panics, and the memory of the process stays below 1 GB. The targets are those of cargo-fuzz (`fuzz/`).
//! Does not prove: the same for inputs that these mutations do not reach.
//!
//! MOTORFIT_FUZZ_BYTES sets the number of bytes over all targets, MOTORFIT_FUZZ_SEED the seed of the mutations, and
//! MOTORFIT_FUZZ_TARGET a single target. If the bytes are given, a call of over 1 s fails, and figures are printed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout, reason = "a test may stop and print")]

#[path = "../fuzz/src/lib.rs"]
mod targets;

use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};
use targets::{TARGETS, Target};

/// Default number of bytes, which takes some seconds.
const BYTES: u64 = 10_000_000;
/// Largest mutation of each target \[bytes\].
const LARGEST: [usize; 4] = [10_000_000, 10_000_000, 8192, 100_000];
/// Largest input that is mutated again \[bytes\], so that most calls stay short.
const KEPT: usize = 16 << 10;
/// Number of accepted mutations that are mutated again.
const POOL: usize = 256;
/// Time limit of a call.
const LONGEST: Duration = Duration::from_secs(1);
/// Memory limit of the process \[kB\].
const MEMORY_KB: u64 = 1_000_000;

fn number(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is {text}, no number")))
}

/// Returns the contents of the files of a folder, by name.
fn files(folder: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

struct Mutator {
    numbers: Xoshiro256PlusPlus,
    corpus: Vec<Vec<u8>>,
    /// Latest accepted mutations.
    pool: Vec<Vec<u8>>,
    words: &'static [&'static str],
    /// Largest mutation \[bytes\].
    largest: usize,
    /// True if one mutation of some thousands has the largest length.
    is_long: bool,
}

impl Mutator {
    fn below(&mut self, count: usize) -> usize {
        self.numbers.random_range(0..count.max(1))
    }

    fn seed(&mut self) -> Vec<u8> {
        let (fixed, all) = (self.corpus.len(), self.corpus.len() + self.pool.len());
        let at = self.below(all);
        if at < fixed { self.corpus[at].clone() } else { self.pool[at - fixed].clone() }
    }

    fn next(&mut self) -> Vec<u8> {
        let mut bytes = self.seed();
        for _ in 0..=self.below(4) {
            self.mutate(&mut bytes);
        }
        bytes.truncate(self.largest);
        bytes
    }

    fn mutate(&mut self, bytes: &mut Vec<u8>) {
        let from = self.below(bytes.len() + 1);
        let longest = [4, 40, 4000][self.below(3)].min(bytes.len() - from);
        let to = from + self.below(longest + 1);
        match self.below(10) {
            0 | 1 if from < bytes.len() => bytes[from] ^= 1 << self.below(8),
            2 if from < bytes.len() => bytes[from] = self.numbers.random(),
            3 => drop(bytes.drain(from..to)),
            4 => {
                let most = if self.is_long && self.below(500) == 0 { self.largest / (to - from + 1) } else { 20 };
                let repeated = bytes[from..to].repeat(self.below(most));
                bytes.splice(from..from, repeated);
            }
            5 => {
                let other = self.seed();
                let begin = self.below(other.len() + 1);
                let end = begin + self.below(other.len() - begin + 1);
                bytes.splice(from..to, other[begin..end].iter().copied());
            }
            6 | 7 => {
                let word = self.words[self.below(self.words.len())];
                bytes.splice(from..to, word.bytes());
            }
            8 if self.below(8) == 0 => bytes.truncate(from),
            // Replaces a number.
            _ => {
                let begin = from + bytes[from..].iter().position(u8::is_ascii_digit).unwrap_or(bytes.len() - from);
                let length = bytes[begin..].iter().take_while(|b| b.is_ascii_digit()).count();
                let digits = [1, 1, 2, 5, 20][self.below(5)];
                let digits: Vec<u8> = (0..digits).map(|_| self.numbers.random_range(b'0'..=b'9')).collect();
                bytes.splice(begin..begin + length, digits);
            }
        }
    }

    fn keep(&mut self, bytes: Vec<u8>) {
        if bytes.len() > KEPT {
            return;
        }
        if self.pool.len() < POOL {
            return self.pool.push(bytes);
        }
        let at = self.below(POOL);
        self.pool[at] = bytes;
    }
}

/// Call of a target.
struct Call<'a> {
    name: &'a str,
    target: Target,
    folder: &'a Path,
}

impl Call<'_> {
    /// Runs an input; returns true if it was accepted, and the elapsed time.
    fn run(&self, input: &[u8], case: u64) -> (bool, Duration) {
        let start = Instant::now();
        let answer = catch_unwind(AssertUnwindSafe(|| (self.target)(input, self.folder)));
        let took = start.elapsed();
        (answer.unwrap_or_else(|_| self.fail(input, case, "panics")), took)
    }

    fn fail(&self, input: &[u8], case: u64, what: &str) -> ! {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{}-{}", self.name, std::process::id()));
        std::fs::write(&path, input).unwrap();
        panic!("{}, case {case}: {what}; the {} bytes are in {}", self.name, input.len(), path.display());
    }
}

/// Runs a target on mutations of `budget` bytes in total.
fn run((name, target): (&str, Target), mutator: &mut Mutator, budget: u64, is_timed: bool) {
    let folder = tempfile::tempdir().unwrap();
    let call = Call { name, target, folder: folder.path() };
    let (began, mut bytes, mut cases, mut accepted, mut longest) = (Instant::now(), 0, 0, 0, Duration::ZERO);
    for seed in &mutator.corpus {
        call.run(seed, 0);
    }
    while bytes < budget {
        let input = mutator.next();
        let (is_accepted, mut took) = call.run(&input, cases);
        if is_timed && took > LONGEST {
            // The delay may come from other programs, so the call is repeated by processor time.
            let before = processor_time();
            let (_, again) = call.run(&input, cases);
            let spent = processor_time().zip(before).map(|(after, before)| after.saturating_sub(before));
            took = took.min(spent.filter(|spent| !spent.is_zero()).unwrap_or(again));
        }
        if is_timed && took > LONGEST {
            call.fail(&input, cases, &format!("takes {took:?}"));
        }
        (bytes, cases, longest) = (bytes + input.len() as u64, cases + 1, longest.max(took));
        accepted += u64::from(is_accepted);
        if is_accepted {
            mutator.keep(input);
        }
    }
    if is_timed {
        let (rate, refused) = (cases / began.elapsed().as_secs().max(1), cases - accepted);
        println!(
            "{name}: {bytes} bytes, {cases} cases, {rate} a second, {accepted} accepted, {refused} refused, longest {longest:?}"
        );
    }
    // Both outcomes occur, so mutations reach the code behind the first checks.
    assert!(accepted > cases / 100 && accepted < cases, "{name}: {accepted} of {cases} accepted");
}

/// Returns the processor time of this thread; `None` if the system does not report it.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

/// Returns the peak memory of this process \[kB\]; `None` if the system does not report it.
fn memory_kb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.trim().strip_suffix("kB")?.trim().parse().ok()
}

#[test]
fn mutations_are_read_completely_or_rejected() {
    let (given, seed) = (number("MOTORFIT_FUZZ_BYTES"), number("MOTORFIT_FUZZ_SEED").unwrap_or(24));
    let (budget, only) = (given.unwrap_or(BYTES), std::env::var("MOTORFIT_FUZZ_TARGET").ok());
    for (index, (name, target, words)) in TARGETS.into_iter().enumerate() {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let folder = if name == "model" { "crates/model/src/library" } else { &format!("fuzz/corpus/{name}") };
        let mut corpus = files(folder);
        if name == "recording" {
            corpus.extend(files("tests/golden/formats").into_iter().map(|bytes| [&bytes[..], &[0]].concat()));
        }
        let numbers = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(3).wrapping_add(index as u64));
        let mut mutator =
            Mutator { numbers, corpus, pool: Vec::new(), words, largest: LARGEST[index], is_long: given.is_some() };
        // Recordings get most, because a short study, request or model takes as long as a recording of thousands of bytes.
        let share = if only.is_some() { budget } else { budget / 20 * [17, 1, 1, 1][index] };
        run((name, target), &mut mutator, share, given.is_some());
    }
    let memory = memory_kb();
    if given.is_some() {
        println!("seed {seed}, memory {memory:?} kB");
    }
    assert!(memory.is_none_or(|kb| kb < MEMORY_KB), "{memory:?} kB");
}
