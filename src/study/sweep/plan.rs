//! From a study to a folder with its manifest.

use super::manifest::{Manifest, PinnedDevice};
use super::runs::Runs;
use super::store::{unreadable, unwritable};
use super::study::Study;
use super::{Sweep, replace};
use crate::device::{BatchSearchEvaluator, DeviceSpec, PrecisionSpec, ThroughputProfile};
use crate::identify::{IdentifySpec, Polish, PreparedSearch};
use crate::setting::text;
use crate::text::{hexadecimal, printable};
use crate::{Error, ErrorKind, Result};
use sha2::{Digest as _, Sha256};
use std::io::Write as _;
use std::path::Path;

/// The name of the manifest.
const NAME: &str = "manifest.json";
/// A study of more bytes is none.
pub(super) const BYTES_MAX: u64 = 16 << 20;

impl Sweep {
    /// Plans a study in a folder: a new or empty one, or one that the same study was planned in. Tells whether it was
    /// planned before. `paces`: what was measured of this machine, for the device `auto`.
    ///
    /// # Errors
    /// `Usage` for a study that cannot be, or a folder with another one; `Data` for recordings that are not there or have
    /// changed since, and a folder that cannot be written; `Device` for a device that is not there.
    pub fn plan(path: &Path, folder: &Path, paces: Option<ThroughputProfile>) -> Result<(Self, bool)> {
        let text = read(path, BYTES_MAX)?;
        let study = Study::parse(&text, path)?;
        let mut manifest = Manifest::of(&study, &text, path)?;
        let known = folder.join(NAME).exists().then(|| Self::open(folder)).transpose()?;
        if known.is_none() {
            check_empty(folder)?;
        }
        // A planned device is not looked for again: this machine may be another.
        manifest.device = match &known {
            Some(known) if known.manifest.study == manifest.study => known.manifest.device.clone(),
            _ => pinned(&study, &manifest, paces)?,
        };
        if let Some(known) = known {
            if known.manifest.is_same(&manifest) {
                // The study may lie elsewhere by now; its recordings are the same.
                let manifest = Manifest { folder: manifest.folder, ..known.manifest };
                return Ok((Self { manifest, ..known }, true));
            }
            let difference = known.manifest.difference(&manifest);
            let remedy = text!(
                "Give a new folder with " [Out] "; or go on with what was planned: " [Command::RunSweep] "."
            );
            let message = format!("holds another sweep: {difference}");
            return Err(Error::data(message, remedy).in_file(folder));
        }
        std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
        let failed = |e| Error::data(format!("the manifest cannot be made: {e}"), "Check the names.");
        // The same sweep always gives the same text.
        let text = serde_json::to_string_pretty(&manifest).map_err(failed)? + "\n";
        place(&folder.join(NAME), &text)?;
        Ok((Self::open(folder)?, false))
    }

    /// Opens a planned sweep.
    ///
    /// # Errors
    /// `Data` when the folder holds none, or a manifest that cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        if !path.exists() {
            let message = "holds no sweep: there is no manifest.json";
            return Err(Error::data(message, text!("Plan one: " [Command::PlanSweep] ".")).in_file(folder));
        }
        let text = read(&path, u64::MAX)?;
        let broken = |what: String| {
            Error::data(what, "It must not be changed: plan the study again in a new folder.").in_file(&path)
        };
        let manifest: Manifest = serde_json::from_str(&text)
            .map_err(|e| broken(format!("is no manifest: {}", printable(&e.to_string()))))?;
        if manifest.format != super::manifest::FORMAT {
            let remedy = "Use that version, or plan the study again in a new folder.";
            let message = format!("is of motorfit {}, which plans otherwise", printable(&manifest.motorfit));
            return Err(Error::data(message, remedy).in_file(&path));
        }
        let study = Study::parse(&manifest.study, &path).map_err(|e| broken(e.message().to_string()))?;
        let runs = Runs::new(study, manifest.motors.len());
        if runs.count() != manifest.runs || manifest.runs == 0 {
            return Err(broken(format!("says {} runs, its study makes {}", manifest.runs, runs.count())));
        }
        Ok(Self { folder: folder.to_path_buf(), digest: hexadecimal(&Sha256::digest(&text)), manifest, runs })
    }

    /// The spec's part that says what evaluates.
    pub(super) fn device(&self) -> Result<IdentifySpec> {
        let PinnedDevice { select, precision, .. } = &self.manifest.device;
        let precision = if precision == "f32" { PrecisionSpec::F32 } else { PrecisionSpec::F64 };
        let device: DeviceSpec = select.parse()?;
        // The CPU has no other.
        let precision = if device == DeviceSpec::Cpu { PrecisionSpec::Auto } else { precision };
        Ok(IdentifySpec { device, precision, ..self.study().spec.clone() })
    }

    /// The device and numbers that are pinned.
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

/// Puts a manifest where none is: two plans at once must not both think it theirs.
fn place(path: &Path, text: &str) -> Result<()> {
    let beside = super::beside(path);
    replace(&beside, |file| file.write_all(text.as_bytes()).map_err(|error| unwritable(&beside, &error)))?;
    let placed = match std::fs::hard_link(&beside, path) {
        // A file system without links.
        Err(error) if error.kind() != std::io::ErrorKind::AlreadyExists => std::fs::rename(&beside, path),
        placed => placed,
    };
    let _ = std::fs::remove_file(&beside);
    placed.map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            let message = "holds a sweep that was planned at the same time";
            Error::data(message, "Run the command again, or name another folder.").in_file(path)
        }
        _ => unwritable(path, &error),
    })
}

/// A folder that is there must be empty, but for what a plan left that was killed.
fn check_empty(folder: &Path) -> Result<()> {
    if !folder.exists() {
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    if names.any(|name| !name.trim_start_matches('.').starts_with(&format!("{NAME}."))) {
        let message = "holds something else than a sweep: it is left as it is";
        return Err(Error::data(message, text!("Name a new folder with " [Out] ".")).in_file(folder));
    }
    Ok(())
}

/// The device of a study, `auto` resolved on this machine.
fn pinned(study: &Study, manifest: &Manifest, paces: Option<ThroughputProfile>) -> Result<PinnedDevice> {
    let cpu = manifest.device.clone();
    let spec = &study.spec;
    let searches = study.methods.iter().any(crate::identify::Method::is_search);
    // Steiglitz–McBride and the fits of auto are done by the CPU.
    if !searches || spec.device == DeviceSpec::Cpu {
        return Ok(cpu);
    }
    let select = match &spec.device {
        DeviceSpec::GpuIndex(index) => format!("gpu:{index}"),
        DeviceSpec::GpuName(name) => format!("gpu:{name}"),
        _ => "gpu".to_owned(),
    };
    let (kind, precision) = match opened(study, manifest, paces) {
        Ok(("cpu", _)) => return Ok(cpu),
        Ok(device) => device,
        // Planned where there is no GPU, for machines that have one.
        Err(error) if error.kind() == ErrorKind::Device && spec.precision != PrecisionSpec::Auto => {
            ("gpu", spec.precision.name())
        }
        Err(error) if error.kind() == ErrorKind::Device => {
            let remedy = "Give precision = \"f32\" or \"f64\" to plan for another machine, or device = \"cpu\".";
            return Err(Error::new(ErrorKind::Device, error.to_string(), remedy));
        }
        Err(error) => return Err(error),
    };
    Ok(PinnedDevice { kind: kind.to_owned(), select, precision: precision.to_owned() })
}

/// Opens the device of a study, and tells its kind and numbers.
fn opened(
    study: &Study,
    manifest: &Manifest,
    paces: Option<ThroughputProfile>,
) -> Result<(&'static str, &'static str)> {
    let runs = Runs::new(study.clone(), manifest.motors.len());
    let sweep = Sweep { folder: Path::new("").to_path_buf(), manifest: manifest.clone(), digest: String::new(), runs };
    // By the first recording that can serve.
    let mut first = (0..manifest.motors.len()).filter_map(|motor| {
        let spec = IdentifySpec { polish: Polish::None, ..study.spec.clone() };
        PreparedSearch::new(&sweep.read(motor).ok()?.fitted, &spec).ok()
    });
    let Some(search) = first.next() else { return Ok(("cpu", "f64")) };
    let population = study.population.iter().max().copied().unwrap_or(1);
    let many = usize::try_from(manifest.runs).unwrap_or(usize::MAX).min(1 << 12);
    let spec = IdentifySpec {
        population: population.saturating_mul(many),
        generations: study.generations.iter().max().copied().unwrap_or(1),
        paces,
        ..study.spec.clone()
    };
    let (kind, _, precision) = BatchSearchEvaluator::open(&spec, vec![search.problem().clone()])?.device();
    Ok((kind, precision))
}
