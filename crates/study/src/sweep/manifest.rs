//! Manifest of a sweep: the text of the study, the recordings with their digests, and the device. It is immutable.

use super::entries::Entry;
use super::machine::ModelFile;
use super::pattern::matched;
use super::runs::Runs;
use super::study::Study;
use motorfit_core::text::{excerpt, hexadecimal};
use motorfit_core::{Error, Result};
use motorfit_record::Reading;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeSet;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Version of the format of manifest and results.
pub(super) const FORMAT: u32 = 1;
/// Size of the blocks in which a file is read \[bytes\].
const PIECE: u64 = 64 << 10;
/// Largest number of runs of a sweep.
pub(super) const RUNS_MAX: u64 = 100_000_000;

/// Recording of a motor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Path relative to the folder of the study.
    pub path: String,
    /// SHA-256 digest of the bytes, or of the joined digests of several files joined by `+`; `None` if it could not be
    /// read.
    pub sha256: Option<String>,
    /// Size \[bytes\].
    pub bytes: u64,
}

/// A motor with its recordings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Name of the motor.
    pub motor: String,
    /// Recordings that are fitted, several jointly.
    pub files: Vec<File>,
    /// Held-out recordings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validate: Vec<File>,
}

impl Motor {
    /// Returns all recordings, the fitted before the held-out ones.
    pub fn all_files(&self) -> impl Iterator<Item = &File> {
        self.files.iter().chain(&self.validate)
    }
}

/// Device that evaluates.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PinnedDevice {
    /// Device kind, `cpu` or `gpu`.
    pub kind: String,
    /// Device as named by the study, with `auto` resolved.
    pub select: String,
    /// Precision, `f32` or `f64`.
    pub precision: String,
    /// True if tables of poles evaluate on the CPU.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tables: bool,
}

/// Manifest of a sweep.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the program that planned the sweep.
    pub motorfit: String,
    /// Version of the format.
    pub format: u32,
    /// Name of the study.
    pub name: String,
    /// Number of runs.
    pub runs: u64,
    /// Device that evaluates.
    pub device: PinnedDevice,
    /// Path of the study as given.
    pub path: String,
    /// Folder to which the paths of the recordings are relative.
    pub folder: String,
    /// Text of the study.
    pub study: String,
    /// Models that the study names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<ModelFile>,
    /// Motors in the order of their runs.
    pub motors: Vec<Motor>,
    /// SHA-256 digest of the file with an empty text here; earlier versions wrote none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

impl Manifest {
    /// Creates the manifest of a study: finds its recordings and computes their digests.
    ///
    /// # Errors
    /// Returns a `Usage` error if the study has too many runs or names a recording or motor twice, and a `Data` error
    /// if recordings are missing.
    pub(super) fn of(study: &Study, text: &str, path: &Path) -> Result<Self> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let motors = motors(study, &folder, path)?;
        let runs = Runs::new(study.clone(), motors.len()).count();
        if runs > RUNS_MAX {
            let remedy = format!("Give fewer seeds or levels: at most {RUNS_MAX} runs.");
            return Err(Error::usage(format!("the study has {runs} runs"), remedy).in_file(path));
        }
        Ok(Self {
            motorfit: env!("CARGO_PKG_VERSION").to_owned(),
            format: FORMAT,
            name: study.name.clone(),
            runs,
            device: PinnedDevice {
                kind: "cpu".to_owned(),
                select: "cpu".to_owned(),
                precision: "f64".to_owned(),
                tables: false,
            },
            path: path.display().to_string(),
            folder: folder.to_string_lossy().into_owned(),
            study: text.to_owned(),
            models: study.models.clone(),
            motors,
            sha256: None,
        })
    }

    /// Returns the text of the file; the same sweep always gives the same text.
    pub(super) fn text(&self) -> Result<String> {
        let failed = |e| Error::data(format!("cannot write the manifest: {e}"), "Check the names.");
        let blank = Self { sha256: Some(String::new()), ..self.clone() };
        let mut text = serde_json::to_string_pretty(&blank).map_err(failed)? + "\n";
        // The digest is the last value, so it is inserted before its closing quote, the end of the line and the closing
        // brace.
        text.insert_str(text.len() - "\"\n}\n".len(), &hexadecimal(&Sha256::digest(&text)));
        Ok(text)
    }

    /// Parses a text; returns the manifest and true if its digest matches.
    pub(super) fn of_text(text: &str) -> serde_json::Result<(Self, bool)> {
        let manifest: Self = serde_json::from_str(text)?;
        let is_intact = manifest.sha256.as_ref().is_none_or(|own| {
            let blank = text.rfind(own.as_str()).map(|at| [&text[..at], &text[at + own.len()..]].concat());
            blank.is_some_and(|blank| hexadecimal(&Sha256::digest(blank)) == *own)
        });
        Ok((manifest, is_intact))
    }

    /// Returns true if two manifests are of the same sweep, whatever the version of the program and the location of the
    /// files.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.study == other.study
            && self.models == other.models
            && self.motors == other.motors
            && self.device == other.device
    }

    /// Describes the difference to another manifest.
    pub(super) fn difference(&self, other: &Self) -> String {
        if self.study != other.study {
            return "the study's text has changed".to_owned();
        }
        if let Some((old, _)) = self.models.iter().zip(&other.models).find(|(a, b)| a != b) {
            return format!("the model {} has changed", excerpt(&old.name));
        }
        let names = |manifest: &Self| manifest.motors.iter().map(|m| m.motor.clone()).collect::<BTreeSet<String>>();
        let (old, new) = (names(self), names(other));
        if let Some(name) = old.symmetric_difference(&new).next() {
            let word = if old.contains(name) { "gone" } else { "new" };
            return format!("the motor {} is {word}", excerpt(name));
        }
        if let Some((old, _)) = self.motors.iter().zip(&other.motors).find(|(a, b)| a != b) {
            return format!("the recording of {} has changed", excerpt(&old.motor));
        }
        let [new, old] = [other, self].map(|of| {
            let tables = if of.device.tables { " with tables" } else { "" };
            format!("{} {}{tables}", of.device.kind, of.device.precision)
        });
        format!("the device is {new} instead of {old}")
    }

    /// Returns the path of a recording relative to the current folder, or absolute.
    pub(super) fn file(&self, file: &File) -> PathBuf {
        // Each file of a joined recording has a path of its own.
        let folder = Path::new(&self.folder);
        let parts = parts(folder, &file.path).into_iter().map(|part| folder.join(part).to_string_lossy().into_owned());
        PathBuf::from(parts.collect::<Vec<_>>().join("+"))
    }
}

/// Files of a motor: its name if the study gives one, the fitted and the held-out recordings.
type MotorFiles = (Option<String>, Vec<String>, Vec<String>);

/// Finds the motors of a study and computes the digests of their recordings.
fn motors(study: &Study, folder: &Path, path: &Path) -> Result<Vec<Motor>> {
    let all = |patterns: &[String]| -> Result<Vec<String>> {
        let found: Vec<Vec<String>> = patterns.iter().map(|p| files(p, folder, path)).collect::<Result<_>>()?;
        Ok(found.concat())
    };
    let held_out = all(&study.validate)?;
    let mut found: Vec<MotorFiles> = Vec::new();
    for entry in &study.recordings {
        match entry {
            Entry::Files(pattern) => {
                let files = files(pattern, folder, path)?.into_iter();
                found.extend(files.map(|file| (None, vec![file], held_out.clone())));
            }
            Entry::Motor { name, files, validate } => {
                let files = all(files)?;
                let validate = if validate.is_empty() { held_out.clone() } else { all(validate)? };
                found.push((Some(name.clone()), files, validate));
            }
        }
    }
    let mut seen = BTreeSet::new();
    for file in found.iter().flat_map(|(_, files, _)| files) {
        let full = folder.join(file);
        if !seen.insert(full.canonicalize().unwrap_or(full)) {
            let message = format!("recordings: {} is named twice", excerpt(file));
            return Err(Error::usage(message, "Name each recording once.").in_file(path));
        }
    }
    let names = names(&found);
    let mut unique = BTreeSet::new();
    if let Some(twice) = names.iter().find(|name| !unique.insert(name.as_str())) {
        let message = format!("recordings: there are two motors {}", excerpt(twice));
        return Err(Error::usage(message, "Give each motor a name of its own.").in_file(path));
    }
    let pinned = |files: &[String]| files.iter().map(|file| pinned(folder, file)).collect();
    let motor = |(motor, (_, files, validate)): (String, &MotorFiles)| {
        let (files, validate) = (pinned(files), pinned(validate));
        Motor { motor, files, validate }
    };
    Ok(names.into_par_iter().zip(&found).map(motor).collect())
}

/// Returns the names of the motors: the given name, otherwise the file stem if all are unique, otherwise the path.
fn names(found: &[MotorFiles]) -> Vec<String> {
    let stem = |file: &str| Path::new(file).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let all = |of: &dyn Fn(&str) -> String| -> Vec<String> {
        found.iter().map(|(name, files, _)| name.clone().unwrap_or_else(|| of(&files[0]))).collect()
    };
    let stems = all(&stem);
    if stems.iter().collect::<BTreeSet<_>>().len() == stems.len() { stems } else { all(&str::to_owned) }
}

/// Returns the files of a pattern, sorted; for a plain path the path itself.
fn files(pattern: &str, folder: &Path, path: &Path) -> Result<Vec<String>> {
    let wrong = |message: String, remedy: &str| Error::data(message, remedy).in_file(path);
    let literal = folder.join(pattern);
    if literal.exists() {
        if !literal.is_file() {
            let message = format!("recordings: \"{}\" is not a file", excerpt(pattern));
            return Err(wrong(message, "Name files, as in \"line/*.csv\"."));
        }
        return Ok(vec![pattern.to_owned()]);
    }
    let joined = Reading::files(Path::new(pattern));
    if joined.len() > 1 && joined.iter().all(|part| folder.join(part).exists()) {
        return Ok(vec![pattern.to_owned()]);
    }
    let found = matched(pattern, folder).map_err(|error| error.in_file(path))?;
    let name = |found: &PathBuf| found.strip_prefix(folder).unwrap_or(found).to_string_lossy().into_owned();
    let mut files: Vec<String> = found.iter().map(name).collect();
    files.sort();
    check_names(folder, pattern, &files)?;
    if files.is_empty() {
        let message = format!("recordings: \"{}\" does not exist", excerpt(pattern));
        return Err(wrong(message, "Paths are relative to the study's folder."));
    }
    Ok(files)
}

/// Returns an error if a file name that is not UTF-8 would match a pattern. The pattern cannot find it, and it must not
/// be skipped silently.
fn check_names(folder: &Path, pattern: &str, files: &[String]) -> Result<()> {
    let parent = |file: &str| folder.join(file).parent().map(Path::to_path_buf);
    let folders: BTreeSet<PathBuf> = files.iter().filter_map(|file| parent(file)).chain(parent(pattern)).collect();
    let last = pattern.rsplit('/').next().and_then(|name| glob::Pattern::new(name).ok());
    for entry in folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten() {
        let name = entry.file_name();
        let shown = name.to_string_lossy();
        if name.to_str().is_none() && last.as_ref().is_some_and(|last| last.matches(&shown)) {
            let message = "has a name that is not UTF-8, so that no pattern finds it";
            return Err(Error::data(message, "Rename it.").in_file(&entry.path()));
        }
    }
    Ok(())
}

/// Returns the paths of a recording as in the study: its own, or those of the files that it joins.
pub(super) fn parts(folder: &Path, file: &str) -> Vec<PathBuf> {
    if folder.join(file).exists() { vec![PathBuf::from(file)] } else { Reading::files(Path::new(file)) }
}

/// Returns a recording with its digest.
fn pinned(folder: &Path, file: &str) -> File {
    let parts = parts(folder, file);
    let digests: Option<Vec<(String, u64)>> = parts.iter().map(|part| digest(&folder.join(part)).ok()).collect();
    let bytes = digests.iter().flatten().map(|(_, bytes)| bytes).sum();
    let sha256 = digests.map(|all| match &all[..] {
        [(one, _)] => one.clone(),
        all => hexadecimal(&Sha256::digest(all.iter().map(|(digest, _)| digest.as_str()).collect::<String>())),
    });
    File { path: file.to_owned(), sha256, bytes }
}

/// Returns the SHA-256 digest of a file and its size \[bytes\].
fn digest(path: &Path) -> std::io::Result<(String, u64)> {
    let (mut file, mut hasher, mut bytes) = (std::fs::File::open(path)?, Sha256::new(), 0);
    let mut piece = Vec::new();
    while file.by_ref().take(PIECE).read_to_end(&mut piece)? > 0 {
        hasher.update(&piece);
        bytes += piece.len() as u64;
        piece.clear();
    }
    Ok((hexadecimal(&hasher.finalize()), bytes))
}
