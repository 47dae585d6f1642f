//! Reading of the results files of a folder, line by line.

use super::head::Head;
use super::lines::{LineLocation, Origin, scan_lines};
use super::shard::Shard;
use motorfit_core::file::unreadable;
use motorfit_core::{Error, Result};
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

/// Returns an error if a path exists but is not a regular file; opening a pipe would block.
pub(super) fn check_regular(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(facts) if !facts.is_file() => {
            let message = "is not a regular file, expected a results file";
            Err(Error::data(message, "Move it away; its runs will be repeated.").in_file(path))
        }
        _ => Ok(()),
    }
}

/// Returns the offset of the end of the last complete line of a file \[bytes\].
pub(super) fn complete_lines_end(mut file: &File) -> std::io::Result<u64> {
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut piece = vec![0; 64 << 10];
    while end > 0 {
        let start = end.saturating_sub(piece.len() as u64);
        let length = usize::try_from(end - start).unwrap_or(0);
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut piece[..length])?;
        if let Some(at) = memchr::memrchr(b'\n', &piece[..length]) {
            return Ok(start + at as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

/// A results file found in a folder.
pub(super) struct ResultsFile<'a> {
    pub path: PathBuf,
    pub shard: Shard,
    pub head: Head,
    /// Sweep to which each line must belong, if the head is damaged.
    proof: Option<&'a Origin<'a>>,
}

/// Returns the results files of a folder, sorted by number of shards and shard.
pub(super) fn files<'a>(origin: &'a Origin<'a>) -> Result<Vec<ResultsFile<'a>>> {
    let folder = origin.folder;
    let entries = std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut found = Vec::new();
    for entry in entries.flatten() {
        let Some(shard) = entry.file_name().to_str().and_then(Shard::of_file) else { continue };
        let path = entry.path();
        check_regular(&path)?;
        // A file that was just created has no head yet.
        let end =
            File::open(&path).and_then(|file| complete_lines_end(&file)).map_err(|error| unreadable(&path, &error))?;
        if end > 0 {
            let (head, is_intact) = Head::read(&path, origin, shard)?;
            found.push(ResultsFile { head, path, shard, proof: (!is_intact).then_some(origin) });
        }
    }
    found.sort_by_key(|found| (found.shard.count, found.shard.index));
    Ok(found)
}

impl ResultsFile<'_> {
    /// Visits every complete line; returns the number of damaged lines, the head included.
    pub(super) fn scan(&self, mut see: impl FnMut(LineLocation)) -> Result<u64> {
        self.scan_lines(|place, _| see(place))
    }

    /// Visits every complete line with its bytes; returns the number of damaged lines, the head included.
    pub(super) fn scan_lines(&self, see: impl FnMut(LineLocation, &[u8])) -> Result<u64> {
        Ok(scan_lines(&self.path, self.proof, see)? + u64::from(self.proof.is_some()))
    }
}
