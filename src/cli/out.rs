//! Files that are written, and the folder of `--out`: a page, the document and tables.

use super::output::Style;
use super::signals::FileUnderWay;
use motorfit::report::Reproduced;
use motorfit::text::{Shortest, shell_quoted};
use motorfit::{Error, Result};
use std::io::Write as _;
use std::path::{Path, PathBuf};

pub(super) struct Out {
    folder: PathBuf,
    is_new: bool,
}

fn is_ours(name: &str) -> bool {
    let table = ["table", "block", "averages", "discussion", "curves"].iter().any(|start| name.starts_with(start));
    matches!(name, "report.html" | "result.json") || (table && name.ends_with(".csv"))
}

/// Whether a folder says that its results are ours: by its page, which is written first, or its document.
fn is_marked(folder: &Path) -> bool {
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
    let document = serde_json::from_str::<serde_json::Value>(&read("result.json")).unwrap_or_default();
    document["motorfit"].is_string() || read("report.html").contains("content=\"motorfit ")
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
    /// Takes a folder: a new or an empty one, or one of results of ours, which are then replaced.
    pub(super) fn take(path: &Path) -> Result<Self> {
        let failed = |what: String| Error::data(what, "Name a new folder with --out.").in_file(path);
        let unreadable = |e: std::io::Error| failed(format!("cannot be used: {e}"));
        let is_new = !path.exists();
        if is_new {
            std::fs::create_dir_all(path).map_err(unreadable)?;
        }
        let out = Self { folder: path.to_path_buf(), is_new };
        let mut is_empty = true;
        for entry in std::fs::read_dir(path).map_err(unreadable)? {
            is_empty = false;
            let entry = entry.map_err(unreadable)?;
            if !(entry.path().is_file() && is_ours(&entry.file_name().to_string_lossy())) {
                return Err(failed("holds something else than results: it is left as it is".to_owned()));
            }
        }
        if !is_empty && !is_marked(path) {
            return Err(failed("holds tables that are not of this program: they are left as they are".to_owned()));
        }
        // Better now than after the work.
        tempfile::tempfile_in(path).map_err(unreadable)?;
        Ok(out)
    }

    /// Writes files by name; the document last, as a sign that all are there.
    pub(super) fn write(&self, mut list: Vec<(String, String)>, style: &Style) -> Result<()> {
        list.sort_by_key(|(name, _)| name == "result.json");
        // What an earlier run left and this one does not write would be taken for its own.
        let left = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        for entry in left.filter(|entry| is_ours(&entry.file_name().to_string_lossy())) {
            let _ = std::fs::remove_file(entry.path());
        }
        for (name, text) in &list {
            write_file(&self.folder.join(name), text)?;
        }
        style.note(&format!("wrote {}", self.folder.join("report.html").display()));
        Ok(())
    }
}

fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    let remedy = "Choose a folder that exists and may be written to.";
    Error::data(format!("cannot be written: {error}"), remedy).in_file(path)
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
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut beside = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // Those of an ordinary new file; the system takes its mask off.
        use std::os::unix::fs::PermissionsExt as _;
        beside.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = beside.tempfile_in(folder).map_err(failed)?;
    let filled = fill(&mut |text| file.write_all(text.as_bytes()).map_err(failed))?;
    if filled.is_some() {
        file.as_file().sync_all().map_err(failed)?;
        file.persist(path).map_err(|error| failed(error.error))?;
    }
    Ok(filled)
}

/// How this run can be made again: its command line, with all options.
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
