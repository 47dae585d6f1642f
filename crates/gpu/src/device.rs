//! GPU adapters and devices: listing, selecting, opening, and conversion of faults to errors.

use super::variant::{Fetch, UNIFORM_BYTES};
use motorfit_core::setting::{Text, text};
use motorfit_core::text::printable;
use motorfit_core::{Error, ErrorKind, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Properties of an adapter.
#[derive(Debug, Clone, PartialEq)]
pub struct AdapterFacts {
    /// Index in the list of adapters, as in `gpu:INDEX`.
    pub index: usize,
    /// Name of the adapter.
    pub name: String,
    /// Kind of the adapter: discrete, integrated, virtual, software or other.
    pub kind: &'static str,
    /// Graphics interface, such as Vulkan.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// True if shaders can compute in f64.
    pub f64: bool,
    /// Largest size of a bound storage buffer \[bytes\].
    pub binding_bytes_max: u64,
    /// Largest number of workgroups in one dimension of a dispatch.
    pub workgroups_max: u32,
}

/// The requested adapter.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Selector {
    /// The best adapter, which may be a software adapter if there is no other.
    #[default]
    Best,
    /// The adapter with an index in the list of adapters.
    Index(usize),
    /// The first adapter whose name contains a text, ignoring case.
    Name(String),
}

/// Time after which a submission without work is considered to hang.
const PATIENCE: Duration = Duration::from_secs(60);
/// Rate of the slowest software adapter, at which the work of a submission extends [`PATIENCE`] \[candidate-steps/s\].
const SLOWEST_STEPS_PER_SECOND: u64 = 20_000_000;
/// Number of candidate-steps below which the thread spins instead of sleeping while it waits for a submission.
const SPIN_STEPS: u64 = 1_000_000;
/// Longest time of spinning.
const SPIN: Duration = Duration::from_micros(300);

/// Returns a device error.
pub(crate) fn error(message: impl Into<Text>, remedy: impl Into<Text>) -> Error {
    Error::new(ErrorKind::Device, message, remedy)
}

/// Returns the hint for a fault that may be temporary.
pub(crate) fn again() -> Text {
    text!("Run again; if the error persists, update the driver or use " [Device = "cpu"] ".")
}

/// The instance of this process, with the process's number.
static OWN: Mutex<Option<(u32, wgpu::Instance)>> = Mutex::new(None);

/// Returns the instance of this process: after some dozens of them a driver finds no adapter any more.
fn instance() -> wgpu::Instance {
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((_, instance)) = own.as_ref().filter(|(of, _)| *of == process) {
        return instance.clone();
    }
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    descriptor.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(descriptor);
    // After a fork the driver's state belongs to the parent process: its instance is neither used nor dropped.
    std::mem::forget(own.replace((process, instance.clone())));
    instance
}

fn adapters() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    if adapters.is_empty() {
        // A driver that is installed or started later is found by a new instance.
        OWN.lock().unwrap_or_else(PoisonError::into_inner).take();
    }
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

/// Returns the adapters of this machine, the best first.
#[must_use]
pub fn list() -> Vec<AdapterFacts> {
    adapters().iter().enumerate().map(facts).collect()
}

/// An open device. Asynchronous errors are stored and reported with the next result.
pub(crate) struct Device {
    pub facts: AdapterFacts,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// Access to samples: software adapters with subgroups of at least eight invocations broadcast them.
    pub fetch: Fetch,
    /// True if the device supports uniform buffers of [`UNIFORM_BYTES`].
    pub uniform: bool,
    fault: Arc<Mutex<Option<String>>>,
    /// Longest time of a submission, in addition to that of its work.
    pub patience: Duration,
    /// True if submissions are timed by the device's clock.
    pub timed: bool,
}

/// Runs `work` on a device and turns a panic into an error: wgpu panics if the driver reports a lost device during a wait.
pub(crate) fn caught<T>(facts: &AdapterFacts, work: impl FnOnce() -> Result<T>) -> Result<T> {
    let lost = |_| Err(error(format!("{} was lost during a computation", facts.name), again()));
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(lost)
}

impl Device {
    /// Opens an adapter, which must compute in f64 if `f64`.
    pub(crate) fn open(selector: &Selector, f64: bool) -> Result<Self> {
        let mut adapters = adapters();
        let list: Vec<AdapterFacts> = adapters.iter().enumerate().map(facts).collect();
        let index = choose(&list, selector, f64)?;
        let (adapter, facts) = (adapters.swap_remove(index), list[index].clone());
        if f64 && !facts.f64 {
            let message = format!("{} does not compute in f64", facts.name);
            return Err(error(message, text!("Use " [Precision = "f32"] ", or " [Device = "cpu"] ".")));
        }
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

    /// Returns the first error since the last check, if there was one.
    pub(crate) fn check(&self) -> Result<()> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner).take();
        fault.map_or(Ok(()), |text| {
            Err(error(format!("{}: {}", self.facts.name, text.lines().collect::<Vec<_>>().join(" ")), again()))
        })
    }

    /// Waits until a submission of `steps` candidate-steps is done and its results have `arrived`.
    pub(crate) fn wait(&self, submission: wgpu::SubmissionIndex, steps: u64, arrived: &AtomicBool) -> Result<()> {
        // Short work takes less time than waking a sleeping thread.
        let spin = Instant::now();
        while steps < SPIN_STEPS && spin.elapsed() < SPIN && !arrived.load(Ordering::Acquire) {
            // Errors are reported by the wait below.
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
            // Dropping a device waits for its work, which never ends on a hung device. So the device is leaked.
            std::mem::forget((self.device.clone(), self.queue.clone()));
            error(
                format!("{} did not finish within {} s: {e}", self.facts.name, patience.as_secs()),
                text!("The device hangs or is too slow: use " [Device = "cpu"] ", or restart its driver."),
            )
        })
    }
}

/// Returns the index of the requested adapter. For `Best` with f64, adapters that support f64 are preferred.
fn choose(list: &[AdapterFacts], selector: &Selector, f64: bool) -> Result<usize> {
    if list.is_empty() {
        return Err(error(
            "no GPU adapter was found on this machine",
            text!(
                "Install a Vulkan driver and its loader (Debian: libvulkan1 with mesa-vulkan-drivers or the vendor's \
                 driver; NVIDIA's also needs libegl1), or use " [Device = "cpu"] "."
            ),
        ));
    }
    let (found, wanted) = match selector {
        Selector::Best => (list.iter().position(|a| a.f64 || !f64).or(Some(0)), "at all".to_owned()),
        Selector::Index(index) => ((*index < list.len()).then_some(*index), format!("number {index}")),
        Selector::Name(name) => {
            let part = name.to_lowercase();
            let found = list.iter().position(|a| a.name.to_lowercase().contains(&part));
            (found, format!("named \"{}\"", motorfit_core::text::excerpt(name)))
        }
    };
    found.ok_or_else(|| {
        let known: Vec<String> = list.iter().map(|a| format!("gpu:{} {}", a.index, a.name)).collect();
        let hint = text!([Command::Devices] " lists the adapters of this machine.");
        error(format!("no adapter {wanted}; available: {}", known.join(", ")), hint)
    })
}
