//! The levels of trust of a sweep in the terminal, and the exit code that follows from them.

use super::super::Outcome;
use super::super::args::Strict;
use motorfit::study::sweep::LevelCounts;

/// Returns how a command ends that has all results: with `--strict` all of them must be good.
pub(super) fn trusted(levels: &LevelCounts, Strict { strict }: Strict) -> Outcome {
    if strict && levels.not_good() > 0 { Outcome::Untrusted } else { Outcome::Done }
}

/// Returns the results of each level in words: `190 good, 8 check, 2 poor`.
pub(super) fn level_text(levels: &LevelCounts) -> String {
    let LevelCounts { good, check, poor, unknown } = *levels;
    let all = [(good, "good"), (check, "check"), (poor, "poor"), (unknown, "unknown")];
    let shown = all.into_iter().filter(|(runs, _)| *runs > 0).map(|(runs, level)| format!("{runs} {level}"));
    shown.collect::<Vec<_>>().join(", ")
}
