//! A part of the runs of a sweep, and the name of its results file.

use crate::setting::text;
use crate::text::excerpt;
use crate::{Error, Result};

/// The most shards of a sweep.
pub(super) const SHARDS_MAX: u64 = 1_000_000;

/// A shard of a sweep: the first is 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Shard {
    /// Which.
    pub index: u64,
    /// Of how many.
    pub count: u64,
}

impl Shard {
    /// The whole sweep.
    pub const ALL: Self = Self { index: 1, count: 1 };

    pub(super) fn file(self) -> String {
        format!("results-{}-of-{}.jsonl", self.index, self.count)
    }

    /// One of so many, counted from 1; `None` where there is no such shard.
    #[must_use]
    pub fn new(index: u64, count: u64) -> Option<Self> {
        (index >= 1 && index <= count && count <= SHARDS_MAX).then_some(Self { index, count })
    }

    /// Refuses numbers that are no shard.
    pub(super) fn checked(self) -> Result<Self> {
        let Self { index, count } = self;
        Self::new(index, count).ok_or_else(|| {
            let message = format!("found shard {index} of {count}, expected one from 1 on of at most {SHARDS_MAX}");
            Error::usage(message, "Count shards from 1.")
        })
    }

    /// The shard that a results file is of.
    pub(super) fn of_file(name: &str) -> Option<Self> {
        let (index, count) = name.strip_prefix("results-")?.strip_suffix(".jsonl")?.split_once("-of-")?;
        Some(Self { index: index.parse().ok()?, count: count.parse().ok()? })
    }
}

impl std::str::FromStr for Shard {
    type Err = Error;

    /// Reads `I/N`.
    fn from_str(text: &str) -> Result<Self> {
        let pair = text.split_once('/').map(|(a, b)| (a.trim().parse(), b.trim().parse()));
        let shard = match pair {
            Some((Ok(index), Ok(count))) => Self::new(index, count),
            _ => None,
        };
        shard.ok_or_else(|| {
            let message = text!([Shard](": \"{}\" is no shard", excerpt(text)));
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
