//! First line of a results file: its sweep and shard, with a digest of the line.

use super::lines::{Origin, no_results, scan_lines};
use super::manifest::FORMAT;
use super::shard::Shard;
use motorfit_core::file::unreadable;
use motorfit_core::text::hexadecimal;
use motorfit_core::{Error, Result};
use motorfit_evaluate::Level;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;

/// Largest length of the first line \[bytes\].
const LONGEST: u64 = 1 << 16;

/// Head of a results file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Head {
    pub motorfit: String,
    pub format: u32,
    /// Digest of the manifest of the sweep.
    pub manifest: String,
    /// Number of the shard and number of shards.
    pub shard: [u64; 2],
    /// Instruction-set class, on which rounding depends; empty if the head is damaged.
    pub instructions: String,
    /// Digest of the other fields; earlier versions wrote none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    check: Option<String>,
}

impl Head {
    /// Creates the head of the results that this machine writes.
    pub(super) fn new(manifest: &str, shard: Shard) -> Self {
        Self {
            motorfit: env!("CARGO_PKG_VERSION").to_owned(),
            format: FORMAT,
            manifest: manifest.to_owned(),
            shard: [shard.index, shard.count],
            instructions: Level::best().name().to_owned(),
            check: None,
        }
    }

    /// Returns the line with its digest.
    pub(super) fn line(&self) -> String {
        let with_digest = Self { check: Some(self.digest()), ..self.clone() };
        serde_json::to_string(&with_digest).unwrap_or_default() + "\n"
    }

    fn digest(&self) -> String {
        let text = serde_json::to_string(&Self { check: None, ..self.clone() }).unwrap_or_default();
        hexadecimal(&Sha256::digest(text).as_slice()[..8])
    }

    /// Parses a line; `None` if it is damaged.
    pub(super) fn of_line(line: &[u8]) -> Option<Self> {
        let head: Self = serde_json::from_slice(line).ok()?;
        head.check.as_ref().is_none_or(|check| *check == head.digest()).then_some(head)
    }

    /// Reads the head of a results file and checks that it belongs to the sweep. Returns true with it if it is intact;
    /// a damaged head is accepted if the lines of the file belong to the sweep.
    pub(super) fn read(path: &Path, origin: &Origin<'_>, shard: Shard) -> Result<(Self, bool)> {
        let wrong = |message: &str, remedy: &str| Err(Error::data(message, remedy).in_file(path).at_line(1));
        let mut line = Vec::new();
        let file = File::open(path).map_err(|error| unreadable(path, &error))?;
        BufReader::new(file).take(LONGEST).read_until(b'\n', &mut line).map_err(|error| unreadable(path, &error))?;
        match Self::of_line(&line) {
            Some(head) if head.manifest == origin.manifest && head.format == FORMAT => Ok((head, true)),
            Some(head) if head.format != FORMAT => wrong(
                "is of another version of this program",
                "Use that version, or plan the study again in a new folder.",
            ),
            Some(_) => wrong("holds results of another study", "Move it away, or run the study that it belongs to."),
            None if is_proven(path, &line, origin)? => {
                Ok((Self { instructions: String::new(), ..Self::new(origin.manifest, shard) }, false))
            }
            None => Err(no_results(path)),
        }
    }
}

/// Returns true if a file with a damaged head belongs to a sweep: the head has the sweep's digest, or a line is of one
/// of its runs, or nothing follows a head that still parses.
fn is_proven(path: &Path, head: &[u8], origin: &Origin<'_>) -> Result<bool> {
    let mut proven = memchr::memmem::find(head, origin.manifest.as_bytes()).is_some();
    let mut lines = 0_u64;
    let damaged = scan_lines(path, Some(origin), |_, _| lines += 1)?;
    proven |= lines > 0;
    Ok(proven || (damaged == 0 && serde_json::from_slice::<Head>(head).is_ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_other_byte_of_a_head_is_noticed() {
        let head = Head::new("4f", Shard::ALL);
        let line = head.line().into_bytes();
        assert_eq!(Head::of_line(&line).map(|read| read.line()), Some(head.line()));
        for at in 0..line.len() - 1 {
            for bit in 0..8 {
                let mut bytes = line.clone();
                bytes[at] ^= 1 << bit;
                // A head whose key of the digest is damaged parses as one of an earlier version, with the same content.
                let other = Head::of_line(&bytes).filter(|other| other.digest() != head.digest());
                assert_eq!(other, None, "{}", String::from_utf8_lossy(&bytes));
            }
        }
    }
}
