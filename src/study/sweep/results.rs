//! The results files of a folder, read back line by line.

use super::head::{Head, Origin};
use super::line::{Row, split};
use super::shard::Shard;
use crate::file::unreadable;
use crate::{Error, Result};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

/// Refuses what is there but no regular file: to open a pipe would wait for its other end.
pub(super) fn check_regular(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(facts) if !facts.is_file() => {
            let message = "is no regular file, expected one of results";
            Err(Error::data(message, "Move it away; its runs will be done again.").in_file(path))
        }
        _ => Ok(()),
    }
}

pub(super) fn no_results(path: &Path) -> Error {
    Error::data("is no results file", "Move it away; its runs will be done again.").in_file(path).at_line(1)
}

/// Where the last whole line of a file ends.
pub(super) fn whole_lines(mut file: &File) -> std::io::Result<u64> {
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

/// A results file as it was found.
pub(super) struct ResultsFile<'a> {
    pub path: PathBuf,
    pub shard: Shard,
    pub head: Head,
    /// The sweep that each line must be of, where the head is damaged.
    proof: Option<&'a Origin<'a>>,
}

/// The results files of a folder.
pub(super) fn files<'a>(origin: &'a Origin<'a>) -> Result<Vec<ResultsFile<'a>>> {
    let folder = origin.folder;
    let entries = std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut found = Vec::new();
    for entry in entries.flatten() {
        let Some(shard) = entry.file_name().to_str().and_then(Shard::of_file) else { continue };
        let path = entry.path();
        check_regular(&path)?;
        // One that was only just made has no head yet.
        let whole = File::open(&path).and_then(|file| whole_lines(&file)).map_err(|error| unreadable(&path, &error))?;
        if whole > 0 {
            let (head, is_whole) = Head::read(&path, origin, shard)?;
            found.push(ResultsFile { head, path, shard, proof: (!is_whole).then_some(origin) });
        }
    }
    found.sort_by_key(|found| (found.shard.count, found.shard.index));
    Ok(found)
}

impl ResultsFile<'_> {
    /// Visits every whole line; returns how many are damaged, the head included.
    pub(super) fn scan(&self, mut see: impl FnMut(Place)) -> Result<u64> {
        self.scan_lines(|place, _| see(place))
    }

    /// The same with the bytes of the line.
    pub(super) fn scan_lines(&self, see: impl FnMut(Place, &[u8])) -> Result<u64> {
        Ok(scan_lines(&self.path, self.proof, see)? + u64::from(self.proof.is_some()))
    }
}

/// A line of a results file: where it stands, and of which run it is.
pub(super) struct Place {
    pub offset: u64,
    pub length: u32,
    pub row: Row,
}

/// Visits every whole line but the head that is of a sweep, if one is given; returns how many are damaged or of another.
pub(super) fn scan_lines(path: &Path, proof: Option<&Origin<'_>>, mut see: impl FnMut(Place, &[u8])) -> Result<u64> {
    let failed = |error: std::io::Error| unreadable(path, &error);
    let mut reader = BufReader::with_capacity(1 << 18, File::open(path).map_err(failed)?);
    let (mut line, mut offset, mut damaged) = (Vec::new(), 0_u64, 0);
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(failed)?;
        if !line.ends_with(b"\n") {
            // The end, or a line that is being written or was torn.
            return Ok(damaged);
        }
        let is_proven = || proof.is_none_or(|origin| whole(&line).is_some_and(|line| (origin.is_of)(&line)));
        // The first line is a result only where the head is lost.
        if offset > 0 || proof.is_some() {
            match (row(&line), u32::try_from(length)) {
                (Some(row), Ok(length)) if is_proven() => see(Place { offset, length, row }, &line),
                _ => damaged += u64::from(offset > 0),
            }
        }
        offset += length as u64;
    }
}

/// The run that a line is of, unless the line is damaged.
pub(super) fn row(line: &[u8]) -> Option<Row> {
    whole(line)
}

/// A line without its time, unless it is damaged.
fn whole<T: for<'de> serde::Deserialize<'de>>(line: &[u8]) -> Option<T> {
    let (result, _) = split(std::str::from_utf8(line).ok()?.trim_end())?;
    serde_json::from_str(&result).ok()
}
