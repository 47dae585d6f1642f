//! Throughput profile that `motorfit bench` measured on this machine; `device="auto"` chooses by it.

use etcetera::BaseStrategy as _;
use motorfit::device::ThroughputProfile;

/// Returns the stored profile, if it was measured on this processor by this version.
pub fn throughput_profile() -> Option<ThroughputProfile> {
    let folder = etcetera::choose_base_strategy().ok()?.cache_dir();
    let text = std::fs::read_to_string(folder.join("motorfit").join("bench.json")).ok()?;
    serde_json::from_str::<ThroughputProfile>(&text).ok().filter(ThroughputProfile::is_current)
}
