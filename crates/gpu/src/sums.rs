//! Sums of errors as a device returns them, and the costs of candidates from them.

use super::constants::is_beyond;
use super::layout::Unit;
use super::variant::{LANES, Precision};
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_evaluate::{Evaluator, Group, Problem, Simd};
use rayon::prelude::*;

/// Number of candidates that a thread takes at a time, or fewer if there are few.
pub(crate) const TASK: usize = 4096;

/// The sums of a submission, as read from the device.
pub(crate) struct Sums<'a> {
    pub precision: Precision,
    pub bytes: &'a [u8],
}

impl Sums<'_> {
    /// Returns the number at index `at`.
    #[inline]
    fn get(&self, at: usize) -> f64 {
        number(self.bytes, at, self.precision.bytes())
    }
}

/// Returns the number at index `at` of numbers of 4 or 8 bytes.
#[inline]
pub(crate) fn number(bytes: &[u8], at: usize, size: usize) -> f64 {
    if size == 8 {
        bytemuck::pod_read_unaligned(&bytes[8 * at..8 * at + 8])
    } else {
        f64::from(bytemuck::pod_read_unaligned::<f32>(&bytes[4 * at..4 * at + 4]))
    }
}

/// Adds the sums of a (group, recording) to the totals of the group's candidates.
pub(crate) fn add(unit: &Unit, problem: &Problem, sums: &Sums<'_>, totals: &mut [f64]) {
    let scaling = problem.scaling(&problem.signals()[unit.recording]);
    totals.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(n, total)| {
        let at = 2 * LANES * (unit.first + n / LANES) + n % LANES;
        *total += scaling.total([sums.get(at), sums.get(at + LANES)]);
    });
}

/// Replaces the totals of a group by costs. Candidates that the device cannot evaluate are evaluated on the CPU.
pub(crate) fn finish_costs(group: &Group<'_>, costs: &mut [f64]) -> Result<()> {
    costs.par_iter_mut().enumerate().with_min_len(TASK).try_for_each(|(row, cost)| {
        let values = group.candidates.row(row);
        if values.iter().any(|v| v.is_nan()) {
            *cost = f64::INFINITY;
        } else if is_beyond(group.problem, values) {
            let one = Candidates::new(values, values.len());
            Simd::default().costs(group.problem, one, std::slice::from_mut(cost))?;
        } else {
            *cost = group.problem.cost(*cost);
        }
        Ok(())
    })
}
