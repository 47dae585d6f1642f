//! Arrays of a MAT-file of level 5.
//!
//! An array is an element that consists of further elements: flags, dimensions, name and data.

use super::mat_element::{COMPRESSED, Elements, MATRIX, damaged, text, unpacked};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::fmt::Display;

/// Largest depth of nested structures.
pub(crate) const DEPTH_MAX: usize = 4;
/// Largest number of columns of a matrix.
pub(crate) const MATRIX_MAX: usize = 64;

/// Largest number of arrays of a file, including fields of structures.
pub(crate) const ARRAYS_MAX: usize = 200_000;
/// Length of the longest name of a variable or field \[bytes\]; MATLAB's own limit is 63.
const NAME_MAX: usize = 255;

/// Contents of a file.
#[derive(Default)]
pub(crate) struct Contents {
    pub variables: Vec<Variable>,
    /// Notes on variables that were not read.
    pub ignored: Vec<String>,
    /// True if the file has objects.
    pub objects: bool,
    cells: usize,
    cells_max: usize,
    arrays: usize,
}

/// A numeric array as columns of equal length; a scalar is one column of length 1.
pub(crate) struct Variable {
    pub name: String,
    pub columns: Vec<Vec<f64>>,
}

impl Variable {
    /// Returns the length of the columns.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// Reads all variables of a file without its header. Compressed ones may decompress to `unpacked_max` bytes in total, and all
/// together may have `cells_max` numbers.
///
/// # Errors
/// Returns a `Data` error if the file is damaged or a limit is exceeded.
pub(crate) fn contents(bytes: &[u8], big_endian: bool, (unpacked_max, cells_max): (u64, usize)) -> Result<Contents> {
    let mut contents = Contents { cells_max, ..Contents::default() };
    let mut left = unpacked_max;
    let mut file = Elements { bytes, big_endian };
    while let Some((kind, data)) = file.next()? {
        let inside;
        let (kind, data) = if kind == COMPRESSED {
            inside = unpacked(data, &mut left, unpacked_max)?;
            let first = Elements { bytes: &inside, big_endian }.next()?;
            first.ok_or_else(|| damaged("a compressed variable is empty"))?
        } else {
            (kind, data)
        };
        if kind == MATRIX {
            contents.array(&mut Elements { bytes: data, big_endian }, "", 0)?;
        } else {
            contents.ignored.push(format!("an element of type {kind}, expected a variable"));
        }
    }
    Ok(contents)
}

impl Contents {
    /// Reads an array. `path` is its name inside a structure, else empty; `depth` is the number of enclosing structures.
    fn array(&mut self, parts: &mut Elements<'_>, path: &str, depth: usize) -> Result<()> {
        self.arrays += 1;
        if self.arrays > ARRAYS_MAX {
            let message = format!("more than {ARRAYS_MAX} variables and fields");
            return Err(Error::data(message, "Save the vectors of the recording alone."));
        }
        let Some((_, flags)) = parts.next()? else {
            return if path.is_empty() { Ok(()) } else { self.skip(path, "empty") };
        };
        let flags = Elements { bytes: flags, ..*parts }.word(0).ok_or_else(|| damaged("an array has no flags"))?;
        let (class, complex) = (flags & 0xff, flags & 0x800 != 0);
        let dimensions = if class == 17 { Vec::new() } else { self::dimensions(parts, path)? };
        let (_, own) = parts.part(path, "name")?;
        if own.len() > NAME_MAX {
            return Err(damaged(format!("a name has {} bytes, expected at most {NAME_MAX}", own.len())));
        }
        let own = text(own);
        let name = if path.is_empty() { own.as_str() } else { path };
        if name.is_empty() {
            // MATLAB stores internal data of its objects in arrays without a name.
            return Ok(());
        }
        match class {
            2 => self.structure(parts, name, &dimensions, depth),
            6..=15 if complex => self.skip(name, "complex numbers"),
            6..=15 => self.numeric(parts, name, &dimensions),
            1 => self.skip(name, "a cell array"),
            4 => self.skip(name, "text"),
            5 => self.skip(name, "a sparse matrix"),
            3 | 16 | 17 => {
                self.objects = true;
                // The name of the class follows that of the object system.
                if class == 17 {
                    let _ = parts.next()?;
                }
                let of_class = if class == 16 { None } else { parts.next()?.map(|(_, class)| text(class)) };
                let of_class = of_class.filter(|class| !class.is_empty() && class.len() < 64);
                self.skip(name, of_class.map_or("an object".to_owned(), |class| format!("an object of class {class}")))
            }
            _ => self.skip(name, format!("an array of the unknown class {class}")),
        }
    }

    /// Notes a variable that is not read.
    fn skip(&mut self, name: &str, what: impl Display) -> Result<()> {
        self.ignored.push(format!("{name}: {what}"));
        Ok(())
    }

    /// Reads the fields of a structure or an array of structures.
    fn structure(&mut self, parts: &mut Elements<'_>, name: &str, dimensions: &[usize], depth: usize) -> Result<()> {
        if depth == DEPTH_MAX {
            return self.skip(name, format!("inside more than {DEPTH_MAX} structures"));
        }
        let (_, width) = parts.part(name, "length of field names")?;
        let width = Elements { bytes: width, ..*parts }.word(0).unwrap_or(0) as usize;
        let (_, names) = parts.part(name, "field names")?;
        if names.is_empty() {
            return self.skip(name, "a structure without fields");
        }
        if !(1..=NAME_MAX + 1).contains(&width) || !names.len().is_multiple_of(width) {
            return Err(damaged(format!("variable \"{}\" has field names of {width} bytes", excerpt(name))));
        }
        let fields: Vec<String> =
            names.chunks(width).map(|field| text(field.split(|&b| b == 0).next().unwrap_or_default())).collect();
        let count = product(dimensions);
        if count == 0 {
            return self.skip(name, "an empty structure");
        }
        for element in 1..=count {
            for field in &fields {
                let path = if count == 1 { format!("{name}.{field}") } else { format!("{name}({element}).{field}") };
                let (kind, data) = parts.part(&path, "value")?;
                if kind != MATRIX {
                    return Err(damaged(format!("\"{}\" is an element of type {kind}", excerpt(&path))));
                }
                self.array(&mut Elements { bytes: data, ..*parts }, &path, depth + 1)?;
            }
        }
        Ok(())
    }

    /// Reads a numeric array as columns.
    fn numeric(&mut self, parts: &mut Elements<'_>, name: &str, dimensions: &[usize]) -> Result<()> {
        let shape = dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ");
        let (kind, data) = parts.part(name, "numbers")?;
        // Dimensions of 1 are ignored: 1 × 1 × N values are a vector.
        let count = product(dimensions);
        let long: Vec<usize> = dimensions.iter().copied().filter(|&d| d > 1).collect();
        let columns = match long[..] {
            _ if count == 0 => return self.skip(name, "empty"),
            [] | [_] => 1,
            [_, columns] if columns <= MATRIX_MAX => columns,
            [_, _] => {
                let what = format!("{shape} values, expected at most {MATRIX_MAX} columns; transpose it to use it");
                return self.skip(name, what);
            }
            _ => return self.skip(name, format!("{shape} values, expected a vector or a matrix")),
        };
        self.cells = self.cells.saturating_add(data.len().min(count));
        if self.cells > self.cells_max {
            let message = format!("more than {} numbers", self.cells_max);
            return Err(Error::data(message, "Save fewer variables, or cut the recording.").in_column(name));
        }
        let values = parts.numbers(kind, data, count).ok_or_else(|| {
            let found = format!("found {} bytes of type {kind}", data.len());
            damaged(format!("{found}, expected {count} numbers ({shape})")).in_column(name)
        })?;
        let columns = values.chunks(count / columns).map(<[f64]>::to_vec).collect();
        self.variables.push(Variable { name: name.to_owned(), columns });
        Ok(())
    }
}

/// Returns the number of elements of an array.
fn product(dimensions: &[usize]) -> usize {
    dimensions.iter().try_fold(1, |n: usize, &d| n.checked_mul(d)).unwrap_or(usize::MAX)
}

/// Returns the dimensions of an array.
fn dimensions(parts: &mut Elements<'_>, path: &str) -> Result<Vec<usize>> {
    let (_, data) = parts.part(path, "dimensions")?;
    let mut dimensions = Elements { bytes: data, ..*parts };
    let mut found = Vec::new();
    while let Some(dimension) = dimensions.word(0) {
        let dimension = i32::try_from(dimension).map_err(|_| damaged("a dimension is negative"))?;
        found.push(dimension.unsigned_abs() as usize);
        dimensions.bytes = &dimensions.bytes[4..];
    }
    if found.len() < 2 || !dimensions.bytes.is_empty() {
        return Err(damaged(format!("found {} dimensions, expected at least 2", found.len())));
    }
    Ok(found)
}
