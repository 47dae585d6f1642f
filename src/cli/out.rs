//! Output files, and the folder of `--out` with the report page, the JSON document and tables.

use super::folder;
use super::output::Style;
use super::signals::FileUnderWay;
use super::stdio::is_stdio;
use motorfit::file::replace_if;
use motorfit::report::Reproduced;
use motorfit::text::shell_quoted;
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
            // This fails, as it should, if the folder is not empty.
            let _ = std::fs::remove_dir(&self.folder);
        }
    }
}

impl Out {
    /// Checks that a folder can take a report, and creates it if needed. Existing files stay, except for the report of an
    /// earlier run, which `write` replaces.
    pub(super) fn take(path: &Path) -> Result<Self> {
        let failed = |what: String| Error::data(what, "Name a new folder with --out.").in_file(path);
        let unusable = |e: std::io::Error| failed(format!("cannot be used: {e}"));
        let is_new = !path.exists();
        if is_new {
            std::fs::create_dir_all(path).map_err(unusable)?;
        }
        let out = Self { folder: path.to_path_buf(), is_new };
        // A folder that cannot be written to is reported before the computation, not after it.
        folder::recover(path).map_err(unusable)?;
        tempfile::tempfile_in(path).map_err(unusable)?;
        for name in ["report.html", "result.json"].into_iter().filter(|name| path.join(name).exists()) {
            if !folder::is_ours(path, name) {
                return Err(failed(format!("contains a {name} that this program did not write; it is left unchanged")));
            }
        }
        Ok(out)
    }

    /// Replaces the report by the (name, text) pairs of `list`. If a file that this program did not write has one of the names,
    /// the complete report goes to a new folder beside this one, so that the result is not lost.
    pub(super) fn write(&self, list: &[(String, String)], style: &Style) -> Result<()> {
        let is_foreign = |name: &str| self.folder.join(name).exists() && !folder::is_ours(&self.folder, name);
        let foreign = list.iter().map(|(name, _)| name).find(|name| is_foreign(name));
        let beside = foreign.map(|name| {
            let found = self.folder.join(name).display().to_string();
            style.note(&format!(
                "{found} was not written by this program and is kept: the report goes to another folder"
            ));
            self.beside()
        });
        let target = beside.as_ref().unwrap_or(&self.folder);
        std::fs::create_dir_all(target)
            .map_err(|e| Error::data(format!("cannot be created: {e}"), "Name another folder.").in_file(target))?;
        let _under_way = FileUnderWay::begin();
        folder::replace_all(target, list)?;
        let first = list.first().map_or("", |(name, _)| name);
        style.note(&format!("wrote {}", target.join(first).display()));
        Ok(())
    }

    /// Returns the first path beside this folder, its name with a number, that does not exist yet.
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

/// Returns the path of one of several drawings, with the number after the file's stem.
pub(super) fn numbered(path: &Path, number: Option<usize>) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    number.map_or_else(|| path.to_path_buf(), |number| path.with_file_name(format!("{stem}-{number}.svg")))
}

/// Checks that stdout takes the drawing of `--svg -`: it must be the only one, and there must be no other document.
pub(super) fn check_drawings(path: Option<&Path>, has_others: bool) -> Result<()> {
    if path.is_some_and(is_stdio) && has_others {
        let message = "--svg - writes one drawing to stdout, which has another document or several drawings here";
        return Err(Error::usage(message, "Name a file with --svg."));
    }
    Ok(())
}

/// Writes drawings, one for each recording; several have numbers after the file's stem.
pub(super) fn drawings(path: &Path, drawings: &[String], style: &Style) -> Result<()> {
    for (n, drawing) in (1..).zip(drawings) {
        let file = numbered(path, (drawings.len() > 1).then_some(n));
        write_file(&file, drawing)?;
        if !is_stdio(&file) {
            style.note(&format!("wrote {}", file.display()));
        }
    }
    Ok(())
}

/// Writes a text to a file, which is then complete or, on an error, not replaced; `-` is stdout.
pub(super) fn write_file(path: &Path, text: &str) -> Result<()> {
    if is_stdio(path) {
        return super::output::data(text);
    }
    write_parts(path, &mut |write| write(text).map(Some)).map(|_: Option<()>| ())
}

/// A function that appends a piece of text to a file.
pub(super) type WritePart<'a> = dyn FnMut(&str) -> Result<()> + 'a;

/// Writes the pieces of text that `fill` produces to a temporary file beside `path`, syncs it and renames it, so that the file
/// is never incomplete. If `fill` returns `None`, no file is written.
pub(super) fn write_parts<T>(
    path: &Path,
    fill: &mut dyn FnMut(&mut WritePart<'_>) -> Result<Option<T>>,
) -> Result<Option<T>> {
    let failed = |error: std::io::Error| unwritable(path, &error);
    if path.is_dir() {
        return Err(Error::data("is a folder, expected a file to write", "Name a file in it.").in_file(path));
    }
    // Links are followed, devices and pipes are written to directly, and read-only files are not replaced.
    let resolved = path.canonicalize();
    let path = resolved.as_deref().unwrap_or(path);
    match path.metadata() {
        Ok(metadata) if !metadata.is_file() => {
            let mut device = std::fs::File::create(path).map_err(failed)?;
            return fill(&mut |text| device.write_all(text.as_bytes()).map_err(failed));
        }
        Ok(metadata) if metadata.permissions().readonly() => {
            return Err(Error::data("is read-only", "Choose another file, or make it writable.").in_file(path));
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
