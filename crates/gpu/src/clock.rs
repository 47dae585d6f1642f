//! Time stamps of the device at the beginning and the end of a submission.

use super::device::Device;
use motorfit_core::numeric::count_u64;

/// Size of both time stamps \[bytes\].
pub(crate) const BYTES: usize = 16;

/// The queries and the buffer for the time stamps of a submission.
pub(crate) struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
}

impl Clock {
    /// Creates the queries and the buffer; `None` if the device has no clock.
    pub(crate) fn of(device: &Device) -> Option<Self> {
        let device = &device.device;
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let resolved = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: BYTES as u64,
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Some(Self { queries, resolved })
    }

    /// Returns the time stamps that a pass writes: the first pass at its beginning, the last at its end.
    pub(crate) fn stamps(&self, pass: u32, passes: u32) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let (first, last) = (pass == 0, pass + 1 == passes);
        (first || last).then_some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: first.then_some(0),
            end_of_pass_write_index: last.then_some(1),
        })
    }

    /// Copies the time stamps to `target` from byte `at` on.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, target: &wgpu::Buffer, at: u64) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, target, at, BYTES as u64);
    }
}

/// Computing time of the device over submissions that may overlap.
#[derive(Default)]
pub(crate) struct Kernel {
    until: u64,
    ticks: u64,
    stamps: usize,
}

impl Kernel {
    pub(crate) fn add(&mut self, [begin, end]: [u64; 2]) {
        self.ticks += end.saturating_sub(begin.max(self.until));
        self.until = self.until.max(end);
        self.stamps += 1;
    }

    /// Returns the computing time \[s\] for a clock period of `period_ns`; `None` without time stamps.
    pub(crate) fn seconds(&self, period_ns: f32) -> Option<f64> {
        (self.stamps > 0).then_some(count_u64(self.ticks) * f64::from(period_ns) * 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_submissions_are_counted_once() {
        let mut kernel = Kernel::default();
        assert_eq!(kernel.seconds(1.0), None);
        for stamps in [[100, 200], [150, 300], [250, 280], [400, 500]] {
            kernel.add(stamps);
        }
        assert!((kernel.seconds(2.0).unwrap() - 600e-9).abs() < 1e-15);
    }
}
