//! Adapters and devices: what is there, opening one, and turning what goes wrong into errors.

use super::variant::{Fetch, UNIFORM_BYTES};
use crate::setting::{Text, text};
use crate::text::printable;
use crate::{Error, ErrorKind, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// An adapter as `devices` lists it.
#[derive(Debug, Clone, PartialEq)]
pub struct AdapterFacts {
    /// Its place in the list, as `gpu:INDEX` names it.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// discrete, integrated, virtual, software or other.
    pub kind: &'static str,
    /// The interface it is reached through.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// True if it computes in f64.
    pub f64: bool,
    /// Largest buffer that a shader can see \[bytes\].
    pub binding_bytes_max: u64,
    /// Most workgroups in one dimension of a dispatch.
    pub workgroups_max: u32,
}

/// Which adapter is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Selector {
    /// The best there is; a software one when there is nothing else.
    #[default]
    Best,
    /// By its place in the list.
    Index(usize),
    /// By a part of its name, whatever the case.
    Name(String),
}

/// The time after which a submission counts as hung: this, and its work at a rate that the slowest
/// software adapter reaches.
const PATIENCE: Duration = Duration::from_secs(60);
const SLOWEST_STEPS_PER_SECOND: u64 = 20_000_000;
/// Candidate-steps below which a submission is waited for awake, and for how long at most.
const SPIN_STEPS: u64 = 1_000_000;
const SPIN: Duration = Duration::from_micros(300);

/// Makes the error of a device.
pub(super) fn error(message: impl Into<Text>, remedy: impl Into<Text>) -> Error {
    Error::new(ErrorKind::Device, message, remedy)
}

/// The hint after a fault that may pass.
pub(super) fn again() -> Text {
    text!("Run again; if it stays, update the driver or use " [Device = "cpu"] ".")
}

fn adapters() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    descriptor.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
    adapters
}

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn facts((index, adapter): (usize, &wgpu::Adapter)) -> AdapterFacts {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    AdapterFacts {
        index,
        name: printable(&info.name),
        kind: ["discrete", "integrated", "virtual", "other", "software"][usize::from(rank(info.device_type))],
        backend: format!("{:?}", info.backend),
        driver: printable(format!("{} {}", info.driver, info.driver_info).trim()),
        f64: adapter.features().contains(wgpu::Features::SHADER_F64),
        binding_bytes_max: limits.max_storage_buffer_binding_size,
        workgroups_max: limits.max_compute_workgroups_per_dimension,
    }
}

/// Every adapter of this machine, the best first.
#[must_use]
pub fn list() -> Vec<AdapterFacts> {
    adapters().iter().enumerate().map(facts).collect()
}

/// An open device. Errors that nobody waits for are kept and reported with the next result.
pub(super) struct Device {
    pub facts: AdapterFacts,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// The way in which samples reach the invocations: software adapters share them in subgroups, if these are of at least
    /// eight.
    pub fetch: Fetch,
    /// True where samples may lie in a uniform buffer of [`UNIFORM_BYTES`].
    pub uniform: bool,
    fault: Arc<Mutex<Option<String>>>,
    /// The longest time that a submission may take.
    pub patience: Duration,
    /// True if submissions are timed by the device's clock.
    pub timed: bool,
}

impl Device {
    pub(super) fn open(selector: &Selector, f64: bool) -> Result<Self> {
        let mut adapters = adapters();
        let list: Vec<AdapterFacts> = adapters.iter().enumerate().map(facts).collect();
        let index = choose(&list, selector, f64)?;
        let (adapter, facts) = (adapters.swap_remove(index), list[index].clone());
        let wanted = wgpu::Features::SHADER_F64 | wgpu::Features::SUBGROUP | wgpu::Features::TIMESTAMP_QUERY;
        let features = adapter.features() & wanted;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("motorfit"),
            required_features: features,
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
            let hint = text!("Update its driver, or use " [Device = "cpu"] ".");
            error(format!("{} cannot be opened: {e}", facts.name), hint)
        })?;
        let fault = Arc::new(Mutex::new(None));
        let keep = |fault: &Arc<Mutex<Option<String>>>, text: String| {
            fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
        };
        let (uncaptured, lost) = (fault.clone(), fault.clone());
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep(&uncaptured, e.to_string())));
        device.set_device_lost_callback(move |reason, text| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep(&lost, format!("the device was lost: {text}"));
            }
        });
        let shares = facts.kind == "software"
            && device.features().contains(wgpu::Features::SUBGROUP)
            && adapter.get_info().subgroup_min_size >= 8;
        let fetch = if shares { Fetch::Subgroup } else { Fetch::Direct };
        let uniform = device.limits().max_uniform_buffer_binding_size >= UNIFORM_BYTES as u64;
        Ok(Self { facts, device, queue, fetch, uniform, fault, patience: PATIENCE, timed: false })
    }

    /// The first error since the last check, if any.
    pub(super) fn check(&self) -> Result<()> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner).take();
        fault.map_or(Ok(()), |text| {
            Err(error(format!("{}: {}", self.facts.name, text.lines().collect::<Vec<_>>().join(" ")), again()))
        })
    }

    /// Waits until a submission of so many candidate-steps is done and its results have `arrived`.
    pub(super) fn wait(&self, submission: wgpu::SubmissionIndex, steps: u64, arrived: &AtomicBool) -> Result<()> {
        // Sleeping and being woken takes longer than short work itself.
        let spin = Instant::now();
        while steps < SPIN_STEPS && spin.elapsed() < SPIN && !arrived.load(Ordering::Acquire) {
            // What it may report is reported by the wait below.
            let _ = self.device.poll(wgpu::PollType::Poll);
            std::hint::spin_loop();
        }
        if arrived.load(Ordering::Acquire) {
            return self.check();
        }
        let patience = self.patience + Duration::from_secs(steps / SLOWEST_STEPS_PER_SECOND);
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(patience) };
        let polled = self.device.poll(wait);
        self.check()?;
        polled.map(|_| ()).map_err(|e| {
            // Dropping a device waits for its work, which a hung one never ends: it is left to the system.
            std::mem::forget((self.device.clone(), self.queue.clone()));
            error(
                format!("{} did not finish within {} s: {e}", self.facts.name, patience.as_secs()),
                text!("The device hangs or is far too slow: use " [Device = "cpu"] ", or restart its driver."),
            )
        })
    }
}

/// The adapter that is asked for; the best there is in f64 where that is asked for too.
fn choose(list: &[AdapterFacts], selector: &Selector, f64: bool) -> Result<usize> {
    if list.is_empty() {
        return Err(error(
            "no GPU adapter answers on this machine",
            text!(
                "Install a Vulkan driver and its loader (Debian: libvulkan1 with mesa-vulkan-drivers or the vendor's \
                 driver), or use " [Device = "cpu"] "."
            ),
        ));
    }
    let (found, wanted) = match selector {
        Selector::Best => (list.iter().position(|a| a.f64 || !f64).or(Some(0)), "at all".to_owned()),
        Selector::Index(index) => ((*index < list.len()).then_some(*index), format!("number {index}")),
        Selector::Name(name) => {
            let part = name.to_lowercase();
            let found = list.iter().position(|a| a.name.to_lowercase().contains(&part));
            (found, format!("named \"{}\"", crate::text::excerpt(name)))
        }
    };
    found.ok_or_else(|| {
        let known: Vec<String> = list.iter().map(|a| format!("gpu:{} {}", a.index, a.name)).collect();
        let hint = text!([Command::Devices] " lists what is there.");
        error(format!("no adapter {wanted}; there is {}", known.join(", ")), hint)
    })
}
