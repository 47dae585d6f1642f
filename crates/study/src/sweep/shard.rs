//! Shards: disjoint subsets of the runs of a sweep, each with a results file.

use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};

/// Largest number of shards of a sweep.
pub(super) const SHARDS_MAX: u64 = 1_000_000;

/// A shard of a sweep, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Shard {
    /// Number of the shard, from 1.
    pub index: u64,
    /// Number of shards.
    pub count: u64,
}

impl Shard {
    /// The complete sweep as a single shard.
    pub const ALL: Self = Self { index: 1, count: 1 };

    pub(super) fn file(self) -> String {
        format!("results-{}-of-{}.jsonl", self.index, self.count)
    }

    /// Creates shard `index` of `count`; `None` if `index` is not within 1 to `count` or there are too many shards.
    #[must_use]
    pub fn new(index: u64, count: u64) -> Option<Self> {
        (index >= 1 && index <= count && count <= SHARDS_MAX).then_some(Self { index, count })
    }

    /// Returns the shard, or a `Usage` error if its numbers are invalid.
    pub(super) fn checked(self) -> Result<Self> {
        let Self { index, count } = self;
        Self::new(index, count).ok_or_else(|| {
            let message = format!(
                "found shard {index} of {count}, expected a number from 1 to the number of shards, at most {SHARDS_MAX}"
            );
            Error::usage(message, "Count shards from 1.")
        })
    }

    /// Returns the shard of a results file by the name of the file.
    pub(super) fn of_file(name: &str) -> Option<Self> {
        let (index, count) = name.strip_prefix("results-")?.strip_suffix(".jsonl")?.split_once("-of-")?;
        Some(Self { index: index.parse().ok()?, count: count.parse().ok()? })
    }
}

impl std::str::FromStr for Shard {
    type Err = Error;

    /// Parses `I/N`.
    fn from_str(text: &str) -> Result<Self> {
        let pair = text.split_once('/').map(|(a, b)| (a.trim().parse(), b.trim().parse()));
        let shard = match pair {
            Some((Ok(index), Ok(count))) => Self::new(index, count),
            _ => None,
        };
        shard.ok_or_else(|| {
            let message = text!([Shard](": \"{}\" is not a shard", excerpt(text)));
            Error::usage(
                message,
                text!("Write I/N with I from 1 to N and N at most {SHARDS_MAX}, as in " [Shard = "2/7"] "."),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_named() {
        assert_eq!("2/7".parse::<Shard>().unwrap(), Shard { index: 2, count: 7 });
        for wrong in ["0/7", "8/7", "x", "1/", "1/0", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
        assert_eq!(Shard::of_file(&Shard { index: 2, count: 7 }.file()), Some(Shard { index: 2, count: 7 }));
        assert_eq!(Shard::of_file("results.jsonl"), None);
    }
}
