//! Rule on a periodic ripple of the speed in the steady state, found as a line of its spectrum.

use super::finding::Finding;
use super::spectrum::{POINTS, power};
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, mean, peak, slope};
use motorfit_core::text::{engineering, significant};
use std::ops::Range;

/// Fewest samples of steady state.
const SAMPLES_MIN: usize = 200;
/// Smallest ratio of a line to its surroundings in the spectrum. In white noise the largest of 2000 bins has a ratio of 8, and
/// one exceeds 30 with a probability of 2e-10.
const TIMES: f64 = 30.0;
/// Smallest amplitudes, relative to the speed, that are mentioned and reported.
const PARTS: [f64; 2] = [0.005, 0.03];

pub(super) fn speed_ripple(view: &View<'_>, findings: &mut Vec<Finding>) {
    let Some(speed) = view.speed.as_ref().filter(|speed| speed.range > 0.0) else { return };
    let driven = view.constant_inputs.iter().filter(|s| s.volts.abs() > 0.02 * view.input.peak);
    let Some(longest) = driven.max_by_key(|s| s.samples.len()) else { return };
    // The first half may contain the transient.
    let (end, count) = (longest.samples.end, longest.samples.len() / 2);
    if count >= SAMPLES_MIN {
        findings.extend(ripple(view, speed, end - count..end));
    }
}

/// Examines the spectrum of the detrended speed.
fn ripple(view: &View<'_>, speed: &Channel<'_>, samples: Range<usize>) -> Option<Finding> {
    let values = &speed.values[samples.clone()];
    let line: Vec<(f64, f64)> = (0..).map(|n: u32| f64::from(n)).zip(values.iter().copied()).collect();
    let (slope, level, middle) = (slope(&line), mean(values), 0.5 * count(values.len() - 1));
    let flat: Vec<f64> = line.iter().map(|(n, w)| w - level - slope * (n - middle)).collect();
    if level.abs() < 0.05 * speed.peak || peak(&flat) == 0.0 {
        return None;
    }
    let (power, segments) = power(&flat);
    let length = values.len().min(POINTS);
    // Half the width of a line, the main lobe of the window. Fewer than ten periods in a segment look like drift.
    let lobe = 2 * POINTS.div_ceil(length);
    let at = (5 * lobe..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let around = |k: usize| (at / 2 + 2 * lobe..2 * at + 8 * lobe).contains(&k) && k.abs_diff(at) > lobe;
    let others: Vec<f64> = power.iter().enumerate().filter(|(k, _)| around(*k)).map(|(_, p)| *p).collect();
    if others.len() < 4 * lobe || power[at] < TIMES * mean(&others) {
        return None;
    }
    // A sine of amplitude A under a Hann window of N samples has a transform of magnitude A N/4.
    let amplitude = 4.0 * (power[at] / count(segments)).sqrt() / count(length);
    let (hertz, part) = (count(at) / count(POINTS) / view.period(), amplitude / level.abs());
    // Flicker of a quantized speed by one step has an amplitude of at most 0.64 steps.
    if part < PARTS[0] || !speed.is_fine() && amplitude < speed.quantum {
        return None;
    }
    let per_turn = hertz * std::f64::consts::TAU / level.abs();
    let [percent, turns] = [significant(100.0 * part, 2), significant(per_turn, 3)];
    let at = engineering(hertz, "Hz", 3);
    let message = format!("the speed ripples by ±{percent} % at {at} in the steady state, {turns} times per turn");
    let remedy = "Check the coupling, the encoder disc and the load. The model has no ripple, so that its confidence \
                  intervals are too narrow.";
    let finding = Finding::new("speed_ripple", Quantity::Speed, message, remedy).mention_if(part < PARTS[1]);
    let finding = finding.at(Some(samples)).figure("hertz", hertz);
    Some(finding.figure("part", part).figure("per_turn", per_turn))
}
