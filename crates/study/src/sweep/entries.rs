//! Entries of the lists of a study: recordings, noise levels and seeds.

use motorfit_evaluate::criterion::Noise;

/// Level of the noise that is added to recordings.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AddedNoise {
    pub name: String,
    pub noise: Option<Noise>,
}

/// Entry of the list of recordings.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Entry {
    /// A path or a pattern (`*`, `?`, `[…]`, `**`), each file of which is a motor.
    Files(String),
    /// One motor with several files, which are fitted jointly.
    Motor {
        name: String,
        files: Vec<String>,
        /// Held-out files; those of the study if empty.
        validate: Vec<String>,
    },
}

/// Seeds of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Seeds {
    /// All integers from the first to the last, both included.
    Range(u64, u64),
    List(Vec<u64>),
}

impl Seeds {
    pub(super) fn count(&self) -> u64 {
        match self {
            Self::Range(first, last) => (last - first).saturating_add(1),
            Self::List(list) => list.len() as u64,
        }
    }

    /// Returns the seed at an index.
    pub(super) fn at(&self, index: u64) -> u64 {
        match self {
            Self::Range(first, _) => first + index,
            Self::List(list) => usize::try_from(index).ok().and_then(|index| list.get(index)).copied().unwrap_or(0),
        }
    }
}
