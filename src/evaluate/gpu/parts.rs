//! A batch cut into submissions.

use super::shader::{LANES, Precision, Variant};
use crate::candidates::Candidates;
use crate::evaluate::{Batch, Group};

/// Candidates `first..first + count` of a group.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub group: usize,
    pub first: usize,
    pub count: usize,
}

impl Part {
    pub(super) fn of<'a>(&self, batch: &Batch<'a>) -> Group<'a> {
        let group = batch.groups[self.group];
        let width = group.candidates.width();
        let values = &group.candidates.values()[self.first * width..(self.first + self.count) * width];
        Group { candidates: Candidates::new(values, width), ..group }
    }
}

/// Parts of one shader each and of bounded size: maps within `budget` bytes, samples within as many again (a recording
/// that alone is larger still goes in one part).
pub(super) fn split(
    batch: &Batch<'_>,
    precision: Precision,
    budget: usize,
    variant: impl Fn(&Group<'_>) -> Variant,
) -> Vec<Vec<Part>> {
    let entry = precision.fields() * precision.bytes();
    let mut pieces: Vec<Vec<Part>> = Vec::new();
    let (mut maps_room, mut samples_room, mut shader) = (0, 0, None);
    for (group, of) in batch.groups.iter().enumerate() {
        let variant = variant(of);
        let signals = of.problem.signals();
        let each = entry * signals.iter().map(|s| s.step_s.len()).sum::<usize>();
        let samples: usize = signals
            .iter()
            .map(|s| (s.len() - of.problem.first_active(s)) * precision.sample() * precision.bytes())
            .sum();
        let (mut first, count) = (0, of.candidates.count());
        while first < count {
            if shader != Some(variant) || maps_room < each * LANES || samples_room < samples {
                pieces.push(Vec::new());
                (maps_room, samples_room, shader) = (budget, budget.max(samples), Some(variant));
            }
            let fits = (maps_room / each).max(LANES).min(count - first);
            // Blocks are whole.
            maps_room = maps_room.saturating_sub(fits.next_multiple_of(LANES) * each);
            samples_room -= samples;
            if let Some(piece) = pieces.last_mut() {
                piece.push(Part { group, first, count: fits });
            }
            first += fits;
        }
    }
    pieces
}
