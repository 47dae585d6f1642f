//! Division of a batch into submissions of bounded size.

use super::layout::bytes;
use super::variant::{LANES, Variant};
use motorfit_evaluate::{Batch, Group};

/// The candidates `first..first + count` of a group. Their costs begin at index `at` of the costs of the batch.
#[derive(Clone, Copy)]
pub(crate) struct Part {
    pub group: usize,
    pub first: usize,
    pub count: usize,
    pub at: usize,
}

impl Part {
    pub(crate) fn of<'a>(&self, batch: &Batch<'a>) -> Group<'a> {
        let group = batch.groups[self.group];
        Group { candidates: group.candidates.rows(self.first, self.first + self.count), ..group }
    }
}

/// Divides a batch into submissions. All parts of a submission use the same shader; their step maps, the past values of their
/// sensors and their samples each fit in `budget` bytes. A single recording that is larger is not divided. Groups without a
/// shader are left out.
pub(crate) fn split(
    batch: &Batch<'_>,
    budget: usize,
    variant: impl Fn(&Group<'_>) -> Option<Variant>,
) -> Vec<Vec<Part>> {
    let mut pieces: Vec<Vec<Part>> = Vec::new();
    let (mut maps_room, mut samples_room, mut shader, mut next) = (0, 0, None, 0);
    for (group, of) in batch.groups.iter().enumerate() {
        let (mut first, count) = (0, of.candidates.count());
        next += count;
        let Some(variant) = variant(of) else { continue };
        let (each, samples) = bytes(of.problem, variant);
        while first < count {
            if shader != Some(variant) || maps_room < each * LANES || samples_room < samples {
                pieces.push(Vec::new());
                (maps_room, samples_room, shader) = (budget, budget.max(samples), Some(variant));
            }
            let fits = (maps_room / each).max(LANES).min(count - first);
            // Blocks of candidates are not divided.
            maps_room = maps_room.saturating_sub(fits.next_multiple_of(LANES) * each);
            samples_room -= samples;
            if let Some(piece) = pieces.last_mut() {
                piece.push(Part { group, first, count: fits, at: next - count + first });
            }
            first += fits;
        }
    }
    pieces
}
