//! Files that are written, and the folder of `--out`: a page, the document and tables.

use super::folder;
use super::output::Style;
use super::signals::FileUnderWay;
use motorfit::file::replace_if;
use motorfit::report::Reproduced;
use motorfit::text::{Shortest, shell_quoted};
use motorfit::{Error, Result};
use std::io::Write as _;
use std::path::{Path, PathBuf};

pub(super) struct Out {
    folder: PathBuf,
    is_new: bool,
}

impl Drop for Out {
    fn drop(&mut self) {
        if self.is_new {
            // Only if nothing came to lie in it.
            let _ = std::fs::remove_dir(&self.folder);
        }
    }
}

impl Out {
    /// Takes a folder. What is in it stays as it is, but for the report of an earlier run, which is then replaced.
    pub(super) fn take(path: &Path) -> Result<Self> {
        let failed = |what: String| Error::data(what, "Name a new folder with --out.").in_file(path);
        let unusable = |e: std::io::Error| failed(format!("cannot be used: {e}"));
        let is_new = !path.exists();
        if is_new {
            std::fs::create_dir_all(path).map_err(unusable)?;
        }
        let out = Self { folder: path.to_path_buf(), is_new };
        // Better now than after the work.
        folder::recover(path).map_err(unusable)?;
        tempfile::tempfile_in(path).map_err(unusable)?;
        for name in ["report.html", "result.json"].into_iter().filter(|name| path.join(name).exists()) {
            if !folder::is_ours(path, name) {
                return Err(failed(format!("holds a {name} that is not of this program: it is left as it is")));
            }
        }
        Ok(out)
    }

    /// Replaces the report by files by name. Where one of another maker has the name of a table, the whole report goes to a
    /// new folder beside: it is not lost after the work.
    pub(super) fn write(&self, list: &[(String, String)], style: &Style) -> Result<()> {
        let is_foreign = |name: &str| self.folder.join(name).exists() && !folder::is_ours(&self.folder, name);
        let foreign = list.iter().map(|(name, _)| name).find(|name| is_foreign(name));
        let beside = foreign.map(|name| {
            let found = self.folder.join(name).display().to_string();
            style
                .note(&format!("{found} is not of this program and left as it is: the report goes to a folder beside"));
            self.beside()
        });
        let target = beside.as_ref().unwrap_or(&self.folder);
        std::fs::create_dir_all(target)
            .map_err(|e| Error::data(format!("cannot be made: {e}"), "Name another folder.").in_file(target))?;
        let _under_way = FileUnderWay::begin();
        folder::replace_all(target, list)?;
        style.note(&format!("wrote {}", target.join("report.html").display()));
        Ok(())
    }

    /// The first folder beside this one that is not there yet: its name with a number.
    fn beside(&self) -> PathBuf {
        let name = self.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let numbered = |n: u32| self.folder.with_file_name(format!("{name}-{n}"));
        (2..).map(numbered).find(|path| !path.exists()).unwrap_or_else(|| numbered(0))
    }
}

fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    let remedy = "Choose a folder that exists and may be written to.";
    Error::data(format!("cannot be written: {error}"), remedy).in_file(path)
}

/// Returns the path of one of several drawings: with a number behind the name.
pub(super) fn numbered(path: &Path, number: Option<usize>) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    number.map_or_else(|| path.to_path_buf(), |number| path.with_file_name(format!("{stem}-{number}.svg")))
}

/// Writes a text to a file that is whole or not there.
pub(super) fn write_file(path: &Path, text: &str) -> Result<()> {
    write_parts(path, &mut |write| write(text).map(Some)).map(|_: Option<()>| ())
}

/// Takes a part of the text of a file.
pub(super) type WritePart<'a> = dyn FnMut(&str) -> Result<()> + 'a;

/// Writes what `fill` hands on, part by part: beside the file, synced, renamed, so that the file is whole or not there. Where
/// `fill` returns `None` there is none.
pub(super) fn write_parts<T>(
    path: &Path,
    fill: &mut dyn FnMut(&mut WritePart<'_>) -> Result<Option<T>>,
) -> Result<Option<T>> {
    let failed = |error: std::io::Error| unwritable(path, &error);
    if path.is_dir() {
        return Err(Error::data("is a folder, expected a file to write", "Name a file in it.").in_file(path));
    }
    // A link is written through, a device or pipe written to, a protected file left alone.
    let resolved = path.canonicalize();
    let path = resolved.as_deref().unwrap_or(path);
    match path.metadata() {
        Ok(metadata) if !metadata.is_file() => {
            let mut device = std::fs::File::create(path).map_err(failed)?;
            return fill(&mut |text| device.write_all(text.as_bytes()).map_err(failed));
        }
        Ok(metadata) if metadata.permissions().readonly() => {
            return Err(
                Error::data("is protected against writing", "Choose another file, or allow writing it.").in_file(path)
            );
        }
        _ => {}
    }
    let _under_way = FileUnderWay::begin();
    replace_if(path, |file| fill(&mut |text| file.write_all(text.as_bytes()).map_err(failed)))
}

/// Returns the command line that reproduces this run, with all options.
pub(super) fn reproduced(options: Vec<(&str, String)>) -> Reproduced {
    let words = std::env::args_os().skip(1).map(|word| shell_quoted(&word.to_string_lossy()));
    let command = std::iter::once("motorfit".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    let options = options.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    Reproduced { command, options }
}

/// Lines of CSV: a heading, then rows of numbers, empty where there is none.
pub(super) fn curves(heads: &[String], columns: &[Vec<f64>]) -> String {
    let mut text = heads.join(",") + "\n";
    for row in 0..columns.iter().map(Vec::len).max().unwrap_or(0) {
        for (n, column) in columns.iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            let value =
                column.get(row).filter(|v| v.is_finite()).map_or_else(String::new, |v| Shortest(*v).to_string());
            text.extend([comma, &value]);
        }
        text.push('\n');
    }
    text
}
