//! Planning: from a study to a folder with its manifest.

use super::lines::Origin;
use super::machine::ModelTexts;
use super::manifest::{Manifest, PinnedDevice};
use super::planned::Sweep;
use super::results::files;
use super::runs::Runs;
use super::search::CANDIDATES;
use super::study::Study;
use motorfit_core::file::{create, remove_leftovers, replace, unreadable, unwritable};
use motorfit_core::setting::text;
use motorfit_core::text::{hexadecimal, printable};
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_evaluate::criterion::{Criterion, Norm};
use motorfit_identify::device::{
    BatchSearchEvaluator, DeviceSpec, DeviceUsed, EvaluatorSpec, PrecisionSpec, ThroughputProfile,
};
use motorfit_identify::{IdentifySpec, Polish, PreparedSearch};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

/// File name of the manifest.
const NAME: &str = "manifest.json";
/// Largest size of a study \[bytes\].
pub(super) const BYTES_MAX: u64 = 16 << 20;

impl Sweep {
    /// Plans a study in a folder that is new, empty or has a sweep of the same study. Returns the sweep, and true if it
    /// had been planned before. `throughput_profile` is the throughput measured on this machine, for the device `auto`.
    ///
    /// # Errors
    /// Returns a `Usage` error for an invalid study, a `Data` error if the folder has another sweep or cannot be
    /// written or recordings are missing, and a `Device` error if the device is not available.
    pub fn plan(path: &Path, folder: &Path, throughput_profile: Option<ThroughputProfile>) -> Result<(Self, bool)> {
        let text = read(path, BYTES_MAX)?;
        let study = Study::parse(&text, path, ModelTexts::Folder(path.parent().unwrap_or(Path::new(""))))?;
        let mut manifest = Manifest::of(&study, &text, path)?;
        remove_leftovers(&folder.join(NAME));
        let known = if folder.join(NAME).exists() {
            match Self::open(folder) {
                Err(error) => return repaired(&study, &manifest, folder, throughput_profile).unwrap_or(Err(error)),
                known => Some(known?),
            }
        } else {
            check_empty(folder)?;
            None
        };
        // The device is not selected again, because this may be another machine.
        manifest.device = match &known {
            Some(known) if known.manifest.study == manifest.study => known.manifest.device.clone(),
            _ => pinned(&study, &manifest, throughput_profile)?,
        };
        if let Some(known) = known {
            if known.manifest.is_same(&manifest) {
                // The study may have been moved; its recordings are the same.
                let manifest = Manifest { folder: manifest.folder, ..known.manifest };
                return Ok((Self { manifest, ..known }, true));
            }
            let difference = known.manifest.difference(&manifest);
            let remedy = text!(
                "Give a new folder with " [Out] ", or continue the planned sweep as it was: " [Command::RunSweep]
                ". Other limits need no new runs: give them when the results are merged."
            );
            let message = format!("holds another sweep: {difference}");
            return Err(Error::data(message, remedy).in_file(folder));
        }
        std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
        place(&folder.join(NAME), &manifest.text()?)?;
        Ok((Self::open(folder)?, false))
    }

    /// Opens a planned sweep.
    ///
    /// # Errors
    /// Returns a `Data` error if the folder has no manifest, or one that is damaged or of another version.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        if !path.exists() {
            let message = "holds no sweep: there is no manifest.json";
            return Err(Error::data(message, text!("Plan one: " [Command::PlanSweep] ".")).in_file(folder));
        }
        let text = read(&path, u64::MAX)?;
        let broken = |what: String| {
            let remedy = "Do not edit it. Plan the same study again in this folder, which repairs it, or in a new one.";
            Error::data(what, remedy).in_file(&path)
        };
        let (manifest, is_intact) = Manifest::of_text(&text)
            .map_err(|e| broken(format!("is not a manifest: {}", printable(&e.to_string()))))?;
        if !is_intact {
            return Err(broken("is not as it was planned".to_owned()));
        }
        if manifest.format != super::manifest::FORMAT {
            let remedy = "Use that version, or plan the study again in a new folder.";
            let message = format!("is of motorfit {}, which uses another format", printable(&manifest.motorfit));
            return Err(Error::data(message, remedy).in_file(&path));
        }
        let texts = ModelTexts::Known(&manifest.models);
        let study = Study::parse(&manifest.study, &path, texts).map_err(|e| broken(e.message().to_string()))?;
        let runs = Runs::new(study, manifest.motors.len());
        if runs.count() != manifest.runs || manifest.runs == 0 {
            return Err(broken(format!("has {} runs, but its study has {}", manifest.runs, runs.count())));
        }
        Ok(Self { folder: folder.to_path_buf(), digest: hexadecimal(&Sha256::digest(&text)), manifest, runs })
    }

    /// Returns the settings with the pinned device and precision.
    pub(super) fn device(&self) -> Result<IdentifySpec> {
        let PinnedDevice { select, precision, .. } = &self.manifest.device;
        let precision = if precision == "f32" { PrecisionSpec::F32 } else { PrecisionSpec::F64 };
        let device: DeviceSpec = select.parse()?;
        // The CPU has a single precision, which must not be requested.
        let precision = if device == DeviceSpec::Cpu { PrecisionSpec::Auto } else { precision };
        let evaluator = match &self.manifest.device {
            PinnedDevice { tables: true, .. } => EvaluatorSpec::Tables,
            PinnedDevice { kind, .. } if kind == "cpu" => EvaluatorSpec::Kernel,
            PinnedDevice { .. } => EvaluatorSpec::Auto,
        };
        Ok(IdentifySpec { device, precision, evaluator, ..self.study().spec.clone() })
    }

    /// Returns the pinned device kind and precision.
    pub(super) fn pinned(&self) -> [&'static str; 2] {
        let PinnedDevice { kind, precision, .. } = &self.manifest.device;
        [if kind == "gpu" { "gpu" } else { "cpu" }, if precision == "f32" { "f32" } else { "f64" }]
    }
}

fn read(path: &Path, most: u64) -> Result<String> {
    let failed = |error: std::io::Error| unreadable(path, &error);
    let size = std::fs::metadata(path).map_err(failed)?.len();
    if size > most {
        let message = format!("is {size} bytes long, expected a study");
        return Err(Error::data(message, "Give a study in TOML.").in_file(path));
    }
    std::fs::read_to_string(path).map_err(failed)
}

/// Writes a new manifest. Of two concurrent plans only one succeeds.
fn place(path: &Path, text: &str) -> Result<()> {
    create(path, text.as_bytes())?.map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            let message = "holds a sweep that was planned at the same time";
            Error::data(message, "Run the command again, or name another folder.").in_file(path)
        }
        _ => unwritable(path, &error),
    })
}

/// Replaces a damaged manifest by that of the same study if at least half of the lines agree and the results belong to
/// it; `None` otherwise.
fn repaired(
    study: &Study,
    manifest: &Manifest,
    folder: &Path,
    throughput_profile: Option<ThroughputProfile>,
) -> Option<Result<(Sweep, bool)>> {
    let path = folder.join(NAME);
    let found = std::fs::read(&path).ok()?;
    let found = String::from_utf8_lossy(&found);
    if Manifest::of_text(&found).is_ok_and(|(_, is_intact)| is_intact) {
        return None;
    }
    let device = pinned(study, manifest, throughput_profile).ok()?;
    let text = Manifest { device, ..manifest.clone() }.text().ok()?;
    let found_lines: BTreeSet<&str> = found.lines().collect();
    let (same, all) = (text.lines().filter(|line| found_lines.contains(line)).count(), text.lines().count());
    let digest = hexadecimal(&Sha256::digest(&text));
    let origin = Origin { folder, manifest: &digest, is_of: Box::new(|_| false) };
    if 2 * same < all || files(&origin).is_err() {
        return None;
    }
    let written = replace(&path, |file| file.write_all(text.as_bytes()).map_err(|error| unwritable(&path, &error)));
    Some(written.and_then(|()| Ok((Sweep::open(folder)?, true))))
}

/// Returns an error unless the folder is missing or has nothing but temporary files of an interrupted plan.
fn check_empty(folder: &Path) -> Result<()> {
    if !folder.exists() {
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    if names.any(|name| !name.trim_start_matches('.').starts_with(&format!("{NAME}."))) {
        let message = "is not empty and holds no sweep; it was not changed";
        return Err(Error::data(message, text!("Name a new folder with " [Out] ".")).in_file(folder));
    }
    Ok(())
}

/// Selects the device of a study, with `auto` resolved on this machine.
fn pinned(study: &Study, manifest: &Manifest, throughput_profile: Option<ThroughputProfile>) -> Result<PinnedDevice> {
    let cpu = manifest.device.clone();
    let spec = &study.spec;
    let searches = study.methods.iter().any(motorfit_identify::Method::is_search);
    // Steiglitz–McBride, the fits of `auto` and models run on the CPU.
    if !searches || !study.has_motor() {
        return Ok(cpu);
    }
    if spec.device == DeviceSpec::Cpu && spec.evaluator != EvaluatorSpec::Auto {
        return Ok(PinnedDevice { tables: spec.evaluator == EvaluatorSpec::Tables, ..cpu });
    }
    let Some(search) = first_search(study, manifest) else { return Ok(cpu) };
    let on_cpu = || Ok(PinnedDevice { tables: prefers_tables(study, &search)?, ..cpu.clone() });
    if spec.device == DeviceSpec::Cpu {
        return on_cpu();
    }
    let select = match &spec.device {
        DeviceSpec::GpuIndex(index) => format!("gpu:{index}"),
        DeviceSpec::GpuName(name) => format!("gpu:{name}"),
        _ => "gpu".to_owned(),
    };
    let (kind, precision) = match opened(study, manifest, &search, throughput_profile) {
        Ok(DeviceUsed { kind: "cpu", .. }) => return on_cpu(),
        Ok(DeviceUsed { kind, precision, .. }) => (kind, precision),
        // A sweep may be planned on a machine without a GPU for one that has one.
        Err(error) if error.kind() == ErrorKind::Device && spec.precision != PrecisionSpec::Auto => {
            ("gpu", spec.precision.name())
        }
        Err(error) if error.kind() == ErrorKind::Device => {
            let remedy = "Give precision = \"f32\" or \"f64\" to plan for another machine, or device = \"cpu\".";
            return Err(Error::new(ErrorKind::Device, error.to_string(), remedy));
        }
        Err(error) => return Err(error),
    };
    Ok(PinnedDevice { kind: kind.to_owned(), select, precision: precision.to_owned(), tables: false })
}

/// Prepares the first recording that can be searched.
fn first_search(study: &Study, manifest: &Manifest) -> Option<PreparedSearch> {
    let runs = Runs::new(study.clone(), manifest.motors.len());
    let sweep = Sweep { folder: Path::new("").to_path_buf(), manifest: manifest.clone(), digest: String::new(), runs };
    let spec = IdentifySpec { polish: Polish::None, ..study.spec.clone() };
    let prepared = |motor| PreparedSearch::new(&sweep.read_motor(motor).ok()?.fitted, &spec).ok();
    (0..manifest.motors.len()).find_map(prepared)
}

/// Opens the device of a study for a search.
fn opened(
    study: &Study,
    manifest: &Manifest,
    search: &PreparedSearch,
    throughput_profile: Option<ThroughputProfile>,
) -> Result<DeviceUsed> {
    let population = study.population.iter().max().copied().unwrap_or(1);
    let many = usize::try_from(manifest.runs).unwrap_or(usize::MAX).min(1 << 12);
    let spec = IdentifySpec {
        population: population.saturating_mul(many),
        generations: study.generations.iter().max().copied().unwrap_or(1),
        throughput_profile,
        ..study.spec.clone()
    };
    Ok(BatchSearchEvaluator::open(&spec, vec![search.problem().clone()])?.device())
}

/// Returns true if tables of poles are to evaluate on the CPU, which depends on the number of searches that share a recording.
fn prefers_tables(study: &Study, search: &PreparedSearch) -> Result<bool> {
    if study.spec.evaluator == EvaluatorSpec::Tables {
        return Ok(true);
    }
    let is_served =
        |&norm: &Norm| !norm.is_time_weighted() && !Criterion { norm, ..Criterion::default() }.is_absolute();
    if !study.criterion.iter().any(is_served) {
        return Ok(false);
    }
    // With noise each seed has a recording of its own.
    let has_noise = study.noise.iter().any(|noise| noise.noise.is_some());
    let seeds = if has_noise { 1 } else { usize::try_from(study.seeds.count()).unwrap_or(usize::MAX) };
    let methods = study.methods.iter().filter(|method| method.is_search()).count();
    let candidates = study.population.iter().sum::<usize>().saturating_mul(methods).saturating_mul(seeds);
    let population = candidates.min(CANDIDATES);
    let generations = study.generations.iter().max().copied().unwrap_or(1);
    let spec = IdentifySpec {
        device: DeviceSpec::Cpu,
        precision: PrecisionSpec::Auto,
        population,
        generations: generations.saturating_mul(candidates / population.max(1)),
        ..study.spec.clone()
    };
    Ok(BatchSearchEvaluator::open(&spec, vec![search.problem().clone()])?.device().evaluator == "tables")
}
