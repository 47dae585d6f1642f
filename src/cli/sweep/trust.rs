//! Levels of trust of a sweep as text, and the outcome that follows from them.

use super::args::Strict;
use crate::cli::outcome::Outcome;
use motorfit::study::sweep::LevelCounts;

/// Returns the outcome of a command with complete results: untrusted if `--strict` is given and a level is not good.
pub(super) fn trusted(levels: &LevelCounts, Strict { strict }: Strict) -> Outcome {
    if strict && levels.not_good() > 0 { Outcome::Untrusted } else { Outcome::Done }
}

/// Returns the number of results of each level: `190 good, 8 check, 2 poor`.
pub(super) fn level_text(levels: &LevelCounts) -> String {
    let LevelCounts { good, check, poor, unknown } = *levels;
    let all = [(good, "good"), (check, "check"), (poor, "poor"), (unknown, "unknown")];
    let shown = all.into_iter().filter(|(runs, _)| *runs > 0).map(|(runs, level)| format!("{runs} {level}"));
    shown.collect::<Vec<_>>().join(", ")
}
