//! The folder of `--out`: a page, the document and tables.

use super::files;
use super::output::Style;
use motorfit::report::Reproduced;
use motorfit::text::printable;
use motorfit::{Error, Result};
use std::path::{Path, PathBuf};

/// A folder for results.
pub(super) struct Out(PathBuf);

impl Out {
    /// Takes a folder: a new or an empty one, or one of results of ours, which are then replaced.
    pub(super) fn take(path: &Path) -> Result<Self> {
        let failed = |what: String| Error::data(what, "Name a new folder with --out.").in_file(path);
        let unreadable = |e: std::io::Error| failed(format!("cannot be used: {e}"));
        if path.exists() {
            let mut entries = std::fs::read_dir(path).map_err(unreadable)?;
            let ours = || {
                let text = std::fs::read_to_string(path.join("result.json")).ok()?;
                serde_json::from_str::<serde_json::Value>(&text).ok()?.get("motorfit")?.as_str().map(str::to_owned)
            };
            if entries.next().is_some() && ours().is_none() {
                return Err(failed("holds something else than results: it is left as it is".to_owned()));
            }
        } else {
            std::fs::create_dir_all(path).map_err(unreadable)?;
        }
        Ok(Self(path.to_path_buf()))
    }

    /// Writes files by name; the document last, as a sign that all are there.
    pub(super) fn write(&self, mut list: Vec<(String, String)>, style: &Style) -> Result<()> {
        list.sort_by_key(|(name, _)| name == "result.json");
        for (name, text) in &list {
            files::write(&self.0.join(name), text)?;
        }
        style.note(&format!("wrote {}", self.0.join("report.html").display()));
        Ok(())
    }
}

/// How this run can be made again: its command line, with all options.
pub(super) fn reproduced(options: Vec<(&str, String)>) -> Reproduced {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    let quoted = |word: String| {
        let word = printable(&word);
        if !word.is_empty() && word.chars().all(plain) { word } else { format!("'{}'", word.replace('\'', "'\\''")) }
    };
    let words = std::env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    let command = std::iter::once("motorfit".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    let options = options.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    Reproduced { command, options }
}

/// Lines of CSV: a heading, then rows of numbers, empty where there is none.
pub(super) fn curves(heads: &[String], columns: &[Vec<f64>]) -> String {
    use std::fmt::Write as _;
    let mut text = heads.join(",") + "\n";
    for row in 0..columns.iter().map(Vec::len).max().unwrap_or(0) {
        for (n, column) in columns.iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            let _ = match column.get(row).filter(|v| v.is_finite()) {
                Some(value) => write!(text, "{comma}{value}"),
                None => write!(text, "{comma}"),
            };
        }
        text.push('\n');
    }
    text
}
