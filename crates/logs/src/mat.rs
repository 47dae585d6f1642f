//! MAT-files of level 5, as MATLAB's `save` writes them with `-v6` and `-v7`.

use super::cells::{COLUMNS_MAX, Cells, number, shortened, unpacked_limits};
use super::mat_element::Elements;
use super::mat_file::{Contents, Variable, contents};
use motorfit_core::text::{excerpt, printable};
use motorfit_core::{Error, Result};
use std::collections::BTreeMap;

const SAVE_V7: &str = "Save it in MATLAB with save('file.mat','-v7'), or as CSV.";
/// Largest number of notes of one kind.
const NOTES_MAX: usize = 20;

/// Reads the vectors of a MAT-file as the columns of a table.
///
/// A vector gives one column; a matrix of at most 64 columns gives several, `name(:,1)` and so on. Fields of structures are
/// named `structure.field`, those of arrays of structures `structure(2).field`. The table has the columns of the most frequent
/// length; notes name all other variables. Sample `n`, counted from 0, has the row number `n + 2`.
///
/// # Errors
/// Returns a `Data` error if the file is damaged, of another level, too large, or has no vectors.
pub fn mat(bytes: &[u8]) -> Result<Cells> {
    let (unpacked_max, cells_max) = unpacked_limits(bytes);
    read(bytes, unpacked_max, cells_max)
}

fn read(bytes: &[u8], unpacked_max: u64, cells_max: usize) -> Result<Cells> {
    let big_endian = big_endian(bytes)?;
    let contents = contents(bytes.get(128..).unwrap_or_default(), big_endian, (unpacked_max, cells_max))?;
    let mut counts = BTreeMap::new();
    for variable in contents.variables.iter().filter(|v| v.len() >= 2) {
        *counts.entry(variable.len()).or_insert(0) += variable.columns.len();
    }
    // `max_by_key` returns the last maximum: of equally frequent lengths the longest one.
    let Some((&length, &width)) = counts.iter().max_by_key(|(_, columns)| **columns) else {
        return Err(no_vectors(&contents));
    };
    if width > COLUMNS_MAX || width.saturating_mul(length) > cells_max {
        let message = format!(
            "found {width} columns of {length} values, expected at most {COLUMNS_MAX} columns and {cells_max} values"
        );
        return Err(Error::data(message, "Save the vectors of one recording alone."));
    }
    Ok(table(contents, length))
}

/// Returns true if the header of level 5 declares big-endian byte order.
///
/// # Errors
/// Returns a `Data` error if the file is not a MAT-file of level 5.
fn big_endian(bytes: &[u8]) -> Result<bool> {
    const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
    let other_level = |level: &str| Error::data(format!("is a MAT-file of {level}, expected level 5"), SAVE_V7);
    if bytes.starts_with(HDF5) || bytes.get(512..).is_some_and(|rest| rest.starts_with(HDF5)) {
        return Err(other_level("level 7.3"));
    }
    match bytes.get(124..128) {
        Some([0, 1, b'I', b'M']) => Ok(false),
        Some([1, 0, b'M', b'I']) => Ok(true),
        Some([0, 2, b'I', b'M'] | [2, 0, b'M', b'I']) => Err(other_level("level 7.3")),
        Some([_, _, b'I', b'M'] | [_, _, b'M', b'I']) => Err(other_level("an unknown level")),
        _ => {
            // The header of level 4 has a type in decimal digits (byte order, 0, number format, kind of matrix), rows,
            // columns, a flag for complex numbers, and the length of the name with its final zero.
            let is_level_4 = |big_endian: bool| {
                let word = |at| Elements { bytes, big_endian }.word(at);
                let kind = word(0).filter(|n| n / 1000 < 5 && n / 100 % 10 == 0 && n / 10 % 10 < 6 && n % 10 < 3);
                kind.is_some() && word(12).is_some_and(|n| n < 2) && word(16).is_some_and(|n| (2..=256).contains(&n))
            };
            Err(if is_level_4(false) || is_level_4(true) {
                other_level("level 4")
            } else {
                Error::data("is not a MAT-file: found no header of level 5", SAVE_V7)
            })
        }
    }
}

/// Returns the error for a file without vectors, with its contents.
fn no_vectors(contents: &Contents) -> Error {
    let scalars = contents.variables.iter().map(|v| format!("{}: {} value", v.name, v.len()));
    let found: Vec<String> = scalars.chain(contents.ignored.iter().cloned()).map(|note| excerpt(&note)).collect();
    let found = if found.is_empty() { "nothing".to_owned() } else { shortened(found, 5).join("; ") };
    let remedy = if contents.objects {
        "Save the data of objects as vectors, for a timeseries ts: t = ts.Time; v = ts.Data; \
         save('file.mat','t','v','-v7'); for a timetable or table tt: v = tt.v, and so on."
    } else {
        "Save time, voltage, current and speed as vectors of equal length: save('file.mat','t','v','i','w','-v7')."
    };
    Error::data(format!("no vector of at least 2 numbers; found {found}"), remedy)
}

/// Returns the variables of one length as a table. Scalars become constants; they and all other variables are named in notes.
fn table(contents: Contents, length: usize) -> Cells {
    let (used, others): (Vec<Variable>, Vec<Variable>) =
        contents.variables.into_iter().partition(|variable| variable.len() == length);
    let width = used.iter().map(|variable| variable.columns.len()).sum();
    let mut rows: Vec<(u64, Vec<String>)> =
        (1..).take(length + 1).map(|number| (number, Vec::with_capacity(width))).collect();
    for variable in used {
        let single = variable.columns.len() == 1;
        for (at, column) in (1..).zip(variable.columns) {
            let heading = if single { variable.name.clone() } else { format!("{}(:,{at})", variable.name) };
            let texts = std::iter::once(heading).chain(column.into_iter().map(number));
            for ((_, row), text) in rows.iter_mut().zip(texts) {
                row.push(text);
            }
        }
    }
    let (scalars, others): (Vec<_>, Vec<_>) = others.into_iter().partition(|variable| variable.len() == 1);
    let value =
        |scalar: &Variable| scalar.columns.first().and_then(|column| column.first()).copied().unwrap_or(f64::NAN);
    let constants = scalars.iter().map(|scalar| (scalar.name.clone(), value(scalar))).collect();
    let scalars = scalars.iter().map(|scalar| format!("{}: 1 value, {}", scalar.name, number(value(scalar))));
    let others = others.into_iter().map(|other| {
        let columns = if other.columns.len() == 1 { String::new() } else { format!("{} × ", other.columns.len()) };
        format!("{}: {columns}{} values, others have {length}", other.name, other.len())
    });
    let mut notes = shortened(others.collect(), NOTES_MAX);
    notes.extend(shortened(scalars.collect(), NOTES_MAX));
    notes.extend(shortened(contents.ignored, NOTES_MAX));
    Cells { name: String::new(), rows, notes: notes.iter().map(|note| printable(note)).collect(), constants }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write as _;

    #[test]
    fn files_that_decompress_to_too_much_are_refused() {
        let mut bomb = include_bytes!("../../../tests/golden/formats/tiny.mat")[..128].to_vec();
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
        packed.write_all(&vec![0; 1 << 20]).unwrap();
        let packed = packed.finish().unwrap();
        for _ in 0..3 {
            bomb.extend(15_u32.to_le_bytes());
            bomb.extend(u32::try_from(packed.len()).unwrap().to_le_bytes());
            bomb.extend(&packed);
        }
        let message = read(&bomb, (3 << 20) - 1, 1 << 20).unwrap_err().to_string();
        assert_eq!(message, "the variables unpack to more than 3145727 bytes");
        assert!(read(&bomb, 3 << 20, 1 << 20).unwrap_err().to_string().contains("no vector"));
    }
}
