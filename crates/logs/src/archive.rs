//! Validation of the ZIP archive of a workbook before the spreadsheet library unpacks it.
//!
//! The library trusts declarations in the file, such as the number of strings and the positions of cells, and copies names for
//! every cell style and every sheet. A file for which it would need more memory than the size of the unpacked file, or overflow
//! a position, is refused here. Sizes are counted during decompression, not taken from the headers of the archive.

use super::cells::CELLS_MAX;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use quick_xml::events::{BytesStart, Event};
use std::io::{BufReader, Cursor, Read};
use zip::ZipArchive;

/// Largest number of files of an archive.
pub(crate) const ENTRIES_MAX: usize = 10_000;
/// Length of the longest tag, and of the longest run without `<` in any file of the archive \[bytes\].
const RUN_MAX: usize = 16 << 20;
/// Largest memory for copies of names for styles and sheets \[bytes\].
const COPIES_MAX: usize = 256 << 20;
pub(crate) const SAVE_AGAIN: &str = "Open it in a spreadsheet program and save it again as .xlsx, or as CSV.";

/// Counts from which the memory follows that the library would allocate for an archive.
#[derive(Default)]
struct Tally {
    /// Number of elements for which the library copies names.
    copies: usize,
    /// Length of the longest tag that can hold a copied name \[bytes\].
    longest: usize,
    /// Number of shared strings.
    strings: usize,
}

/// Checks an archive, whose files may unpack to `unpacked_max` bytes in total.
///
/// # Errors
/// Returns a `Data` error if the bytes are not a ZIP archive, or the archive is damaged, encrypted or too large.
pub(crate) fn check(bytes: &[u8], unpacked_max: u64) -> Result<()> {
    if bytes.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") {
        let remedy = "Save it without a password as .xlsx, or as CSV.";
        return Err(Error::data("is a workbook with a password or of the old .xls format, expected .xlsx", remedy));
    }
    if !bytes.starts_with(b"PK") {
        return Err(Error::data("is not an .xlsx workbook: found no ZIP archive", SAVE_AGAIN));
    }
    let broken = |what: String| Error::data(format!("the workbook is damaged: {what}"), SAVE_AGAIN);
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(e.to_string()))?;
    if archive.len() > ENTRIES_MAX {
        return Err(broken(format!("found {} files in it, expected at most {ENTRIES_MAX}", archive.len())));
    }
    let mut left = unpacked_max;
    let mut tally = Tally::default();
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(|e| broken(e.to_string()))?;
        let name = entry.name().map_err(|e| broken(e.to_string()))?.to_lowercase();
        let mut counted = Counted { inner: &mut entry, left: Some(left), run: 0 };
        let checked = check_xml(&mut counted, &name, &mut tally);
        let drained = std::io::copy(&mut counted, &mut std::io::sink());
        let in_part = |what: &str| broken(format!("{} {what}", excerpt(&name)));
        left = match (counted.left, checked, drained) {
            (None, ..) => {
                let message =
                    format!("the workbook, of {} bytes, unpacks to more than {unpacked_max} bytes", bytes.len());
                return Err(Error::data(message, "Cut the recording, or save only its sheet as .xlsx or CSV."));
            }
            (_, Err(what), _) => return Err(in_part(&what)),
            (_, _, Err(error)) => return Err(in_part(&error.to_string())),
            (Some(left), Ok(()), Ok(_)) => left,
        };
    }
    if tally.copies.saturating_mul(tally.longest) > COPIES_MAX {
        let message = format!("holds {} styles and sheets with names of {} bytes", tally.copies, tally.longest);
        return Err(broken(message));
    }
    Ok(())
}

/// Reader that counts bytes and returns an error beyond the limits.
struct Counted<R> {
    inner: R,
    /// Remaining number of bytes; `None` after the limit is exceeded.
    left: Option<u64>,
    /// Bytes since the last `<`.
    run: usize,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.left = self.left.and_then(|left| left.checked_sub(count as u64));
        self.run = match buffer[..count].iter().rposition(|&b| b == b'<') {
            Some(at) => count - at,
            None => self.run + count,
        };
        if self.left.is_none() || self.run > RUN_MAX {
            return Err(std::io::Error::other("unpacks to more than is allowed"));
        }
        Ok(count)
    }
}

/// Checks the tags of a file of the archive with the parser and the settings of the library, up to its end or the first
/// syntax error.
///
/// # Errors
/// Returns a message if a declaration is impossible or a size exceeds its limit.
fn check_xml(part: impl Read, name: &str, tally: &mut Tally) -> std::result::Result<(), String> {
    let mut xml = quick_xml::Reader::from_reader(BufReader::new(part));
    let config = xml.config_mut();
    config.check_end_names = false;
    config.trim_text(false);
    config.check_comments = false;
    config.expand_empty_elements = true;
    let names = name.ends_with(".rels") || name.ends_with("styles.xml");
    let mut buffer = Vec::new();
    let mut inside = false;
    loop {
        buffer.clear();
        match xml.read_event_into(&mut buffer) {
            Ok(Event::Start(tag)) => {
                inside = true;
                check_tag(&tag, names, tally)?;
            }
            Ok(Event::Eof) | Err(_) => return Ok(()),
            Ok(_) => (),
        }
        if inside && buffer.len() > RUN_MAX {
            return Err(format!("holds a text of {} bytes, expected at most {RUN_MAX}", buffer.len()));
        }
    }
}

/// Checks the declarations of a tag and adds it to the tally; `names` is true in files whose names are copied.
fn check_tag(tag: &BytesStart<'_>, names: bool, tally: &mut Tally) -> std::result::Result<(), String> {
    let raw = tag.attributes_raw();
    if names {
        tally.longest = tally.longest.max(raw.len());
    }
    let check = |name: &str, is_valid: &dyn Fn(&str) -> bool| {
        let wrong = attributes(raw).find(|(key, value)| *key == name && !is_valid(value));
        wrong.map_or(Ok(()), |(key, value)| Err(format!("has {key}=\"{}\", which is impossible", excerpt(value))))
    };
    match tag.local_name().as_ref() {
        "xf" | "sheet" => tally.copies += 1,
        "si" => tally.strings += 1,
        "sst" => check("uniqueCount", &|value| value.parse::<u64>().map_or(true, |n| n <= CELLS_MAX as u64))?,
        "c" | "row" => check("r", &fits)?,
        "dimension" => check("ref", &ordered)?,
        _ => (),
    }
    if tally.strings > CELLS_MAX {
        return Err(format!("holds more than {CELLS_MAX} strings"));
    }
    Ok(())
}

/// Returns the attributes of a tag, split like the spreadsheet library does.
fn attributes(raw: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut rest = raw;
    std::iter::from_fn(move || {
        let (key, after) = rest.split_once('=')?;
        let after = after.trim_ascii_start();
        let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let after = &after[1..];
        let end = after.find(quote).unwrap_or(after.len());
        rest = after.get(end + 1..).unwrap_or_default();
        Some((key.trim_ascii(), &after[..end]))
    })
}

/// Returns true if a position such as `XFD1048576` or `7` is short enough that its column and row do not overflow.
fn fits(position: &str) -> bool {
    let row = position.trim_start_matches(|c: char| c.is_ascii_alphabetic());
    position.len() - row.len() <= 3 && row.len() <= 7
}

/// Returns true if the last position of a range is not before the first one and both fit.
fn ordered(range: &str) -> bool {
    let place = |position: &str| {
        let row = position.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        let column = &position[..position.len() - row.len()];
        (row.parse::<u32>().unwrap_or(0), column.bytes().fold(0, |n, b| n * 26 + u32::from(b & 31)))
    };
    let fit = range.split(':').all(fits);
    fit && range.split_once(':').is_none_or(|(first, last)| {
        let ((row, column), (last_row, last_column)) = (place(first), place(last));
        row <= last_row && column <= last_column
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use zip::write::SimpleFileOptions;

    fn archive(files: usize, size: usize) -> Vec<u8> {
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for n in 0..files {
            zip.start_file(format!("{n}.xml"), SimpleFileOptions::default()).unwrap();
            zip.write_all(&vec![b' '; size]).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    fn refused(bytes: &[u8], unpacked_max: u64) -> String {
        check(bytes, unpacked_max).unwrap_err().to_string()
    }

    #[test]
    fn archives_that_decompress_to_too_much_are_refused() {
        let bomb = archive(4, 1 << 20);
        assert!(bomb.len() < 10_000);
        assert!(check(&bomb, 4 << 20).is_ok());
        assert!(refused(&bomb, (4 << 20) - 1).contains("unpacks to more than 4194303 bytes"));
        assert!(refused(&archive(1, (16 << 20) + 1), 1 << 30).contains("more than is allowed"));
        assert!(refused(&archive(ENTRIES_MAX + 1, 0), 1 << 30).contains("found 10001 files"));
    }

    #[test]
    fn sizes_in_headers_are_not_trusted() {
        let mut bomb = archive(1, 1 << 20);
        for at in 0..bomb.len() - 4 {
            if bomb[at..at + 4] == (1_u32 << 20).to_le_bytes() {
                bomb[at..at + 4].copy_from_slice(&10_u32.to_le_bytes());
            }
        }
        assert!(check(&bomb, 1 << 19).is_err());
    }

    #[test]
    fn positions() {
        assert!(["A1", "XFD1048576", "7", "", "A"].into_iter().all(fits));
        assert!(!["AAAA1", "A12345678"].into_iter().any(fits));
        assert!(["A1", "A1:A1", "A1:XFD1048576", "Z9:AA10"].into_iter().all(ordered));
        assert!(!["B1:A1", "A2:A1", "AA1:Z1", "A1:AAAA1"].into_iter().any(ordered));
        let found: Vec<_> = attributes(" r = \"A=1\" x:s='2\"'t=\"\" bad").collect();
        assert_eq!(found, [("r", "A=1"), ("x:s", "2\""), ("t", "")]);
    }
}
