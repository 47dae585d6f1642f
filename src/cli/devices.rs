//! The command `devices`: the devices of this machine that can evaluate candidates.

use super::args::DevicesArgs;
use super::prelude::*;
use motorfit::evaluate::{Level, cpu_name};
use motorfit::report::devices_document;

pub(super) fn run(args: &DevicesArgs) -> Result<Outcome> {
    let threads = rayon::current_num_threads();
    if args.json {
        data(&json(&devices_document(threads)))?;
        return Ok(Outcome::Done);
    }
    let levels: Vec<&str> = Level::available().map(Level::name).collect();
    let mut text = String::new();
    let _ = writeln!(text, "{STRONG}cpu{STRONG:#}  {}", cpu_name());
    let _ =
        writeln!(text, "     {threads} threads, f64, SIMD {} (available: {})", Level::best().name(), levels.join(", "));
    gpus(&mut text);
    show(&text)?;
    Ok(Outcome::Done)
}

#[cfg(feature = "gpu")]
fn gpus(text: &mut String) {
    let adapters = motorfit::evaluate::gpu::list();
    for a in &adapters {
        let numbers = if a.f64 { "f32, f64" } else { "f32" };
        let _ = writeln!(text, "{STRONG}gpu:{}{STRONG:#}  {}", a.index, a.name);
        let _ = writeln!(text, "     {} adapter through {}, {numbers}", a.kind, a.backend);
        let megabytes = a.binding_bytes_max >> 20;
        let _ =
            writeln!(text, "     driver {}; bindings up to {megabytes} MiB, {} workgroups", a.driver, a.workgroups_max);
    }
    if adapters.is_empty() {
        text.push_str("gpu  no adapter found (a Vulkan driver needs its loader, on Debian libvulkan1; NVIDIA's also needs libegl1)\n");
    }
}

#[cfg(not(feature = "gpu"))]
fn gpus(text: &mut String) {
    text.push_str("gpu  this build has no GPU support\n");
}
