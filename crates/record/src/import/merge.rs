//! Channels with clocks of their own on the times of all of them.
//!
//! An output counts at the times of its own samples only: values between them, such as those of a linear interpolation, are not
//! measured, and would bias parameters by many standard errors. An input holds its last value.

use super::table_rows::rows;
use super::track::{GAP, Merged, Role, Track, Wanted};
use motorfit_core::numeric::count;
use motorfit_core::text::{counted, engineering, listed};
use motorfit_logs::Series;

/// Distance between the times of two channels, relative to the shorter period, up to which their samples are simultaneous. The
/// second is for logs of changes: a robot logs the values of a period one after the other.
const SKEW: [f64; 2] = [0.002, 0.02];
/// Number of samples of an input, relative to those of an output, below which it was logged when it changed.
const CHANGES: f64 = 0.5;
/// Distance between the times of two channels, relative to the period, up to which they are of one period of a control loop.
const SAME_PERIOD: f64 = 0.2;
/// Number of samples outside of the other channels that is not worth a note.
const EDGE: usize = 2;

/// Brings the wanted columns of several series to the times of all of them.
///
/// `holds` is true for logs of changes: there an output whose samples are uneven holds its value, and counts at the times of the clock:
/// those of the input with the most samples, or of the output with the most if the input was logged when it changed.
pub(super) fn merged(mut series: Vec<Series>, wanted: &[Wanted], holds: bool) -> Merged {
    if series.iter().all(|series| series.time_s.is_empty()) {
        return rows(series, wanted);
    }
    let mut notes = Vec::new();
    for (n, series) in series.iter_mut().enumerate() {
        let repeats = without_repeats(series);
        if repeats > 0 {
            let name = wanted.iter().find(|wanted| wanted.at.0 == n).map_or("", |wanted| &wanted.name);
            notes.push(format!("{} of {name} that repeat the one before left out", counted(repeats, "sample")));
        }
    }
    let tracks: Vec<Track<'_>> = wanted.iter().map(|w| Track::new(&series[w.at.0], w, holds)).collect();
    for track in tracks.iter().filter(|track| track.left_out > 0) {
        notes.push(format!("{} of {} without a number left out", counted(track.left_out, "sample"), track.name));
    }
    let Some(first) = tracks.first() else { return Merged { notes, ..Merged::default() } };
    if tracks.iter().all(|track| track.time_s == first.time_s) {
        let time_s = first.time_s.to_vec();
        let columns = tracks.iter().map(|track| track.values.to_vec()).collect();
        return Merged { time_s, columns, measured: vec![Vec::new(); tracks.len()], notes };
    }
    debug_assert!(tracks.iter().all(|track| track.role != Role::Time), "channels with times have no other");
    let Some(clock) = clock(&tracks, holds) else { return Merged { notes, ..Merged::default() } };
    let [from, to] = range(&tracks, clock, holds);
    let inside =
        |track: &Track<'_>| track.time_s.iter().copied().filter(|t| (from..=to).contains(t)).collect::<Vec<f64>>();
    let own = inside(&tracks[clock]);
    let mut time_s = own.clone();
    // A robot logs the values of a period one after the other: they act in it.
    let early = if holds { SAME_PERIOD * tracks[clock].step_s } else { 0.0 };
    let skew = |track: &Track<'_>| SKEW[usize::from(holds)] * track.step_s.min(tracks[clock].step_s);
    for track in tracks.iter().filter(|track| !track.is_held) {
        let early = if track.role == Role::Input { early } else { 0.0 };
        time_s = with_more(&time_s, &inside(track), [early, skew(track)]);
    }
    let mut merged = Merged { notes, ..Merged::default() };
    for track in &tracks {
        let (values, measured) = match track.role {
            Role::Input => (track.held(&time_s, early.max(skew(track))), Vec::new()),
            _ if track.is_held => track.held_at(&time_s, &own, early),
            _ => track.at(&time_s, skew(track)),
        };
        merged.columns.push(values);
        merged.measured.push(if measured.contains(&false) { measured } else { Vec::new() });
    }
    if !merged.measured.iter().all(Vec::is_empty) {
        merged.notes.push(note_on(&tracks));
    }
    let outside = tracks[clock].time_s.len() - own.len();
    if outside > EDGE {
        merged.notes.push(format!("{} before or after those of other channels left out", counted(outside, "sample")));
    }
    merged.time_s = time_s;
    merged
}

/// Returns the note on channels with clocks of their own.
fn note_on(tracks: &[Track<'_>]) -> String {
    let shown = |holds: bool| {
        let of = tracks.iter().filter(|track| (track.role == Role::Input || track.is_held) == holds);
        let named = |track: &Track<'_>| match track.step_s {
            step if step.is_finite() => format!("{} ({})", track.name, engineering(1.0 / step, "Hz", 4)),
            _ => track.name.to_owned(),
        };
        of.map(named).collect::<Vec<String>>()
    };
    let said = |names: Vec<String>, [one, several]: [&str; 2]| {
        let verb = if names.len() == 1 { one } else { several };
        let names = listed(&names.iter().map(String::as_str).collect::<Vec<_>>(), "and");
        (!names.is_empty()).then(|| format!("{names} {verb}"))
    };
    let held = said(shown(true), ["has a zero-order hold", "have a zero-order hold"]);
    let own = said(shown(false), ["counts only at its own samples", "count only at their own samples"]);
    let both: Vec<String> = held.into_iter().chain(own).collect();
    format!("the channels are sampled at different times: {}", both.join(", "))
}

/// Returns the index of the column whose times are those of the clock.
fn clock(tracks: &[Track<'_>], holds: bool) -> Option<usize> {
    let most =
        |role: Role| (0..tracks.len()).filter(|n| tracks[*n].role == role).max_by_key(|n| tracks[*n].time_s.len());
    let (input, output) = (most(Role::Input), most(Role::Output));
    let changes = input.zip(output).is_some_and(|(input, output)| is_sparse(&tracks[input], &tracks[output]));
    if changes && holds { output } else { input.or(output) }
}

/// Returns the range of times in which every column has values.
fn range(tracks: &[Track<'_>], clock: usize, holds: bool) -> [f64; 2] {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    let most =
        tracks.iter().filter(|track| track.role == Role::Output).map(|track| track.time_s.len()).max().unwrap_or(0);
    for (n, track) in tracks.iter().enumerate() {
        let Some((first, last)) = track.time_s.first().zip(track.time_s.last()) else { return [f64::INFINITY; 2] };
        // A skew between channels must not cost the first and the last sample.
        let margin = if n == clock { 0.0 } else { SAME_PERIOD * tracks[clock].step_s };
        from = from.max(first - margin);
        let is_sparse = count(track.time_s.len()) < CHANGES * count(most);
        to = match track.role {
            _ if track.is_held => to,
            Role::Input if holds || is_sparse => to,
            Role::Input => to.min(last + track.step_s),
            _ => to.min(last + margin),
        };
    }
    if to.is_infinite() {
        to = tracks[clock].time_s.last().copied().unwrap_or(to);
    }
    [from, to]
}

/// Returns times with more of them, unless one is at most `early` after, or `skew` from, one that is there.
fn with_more(time_s: &[f64], more: &[f64], [early, skew]: [f64; 2]) -> Vec<f64> {
    let mut all = Vec::with_capacity(time_s.len());
    let mut at = 0;
    for &t in more {
        while time_s.get(at).is_some_and(|own| *own <= t + skew) {
            all.push(time_s[at]);
            at += 1;
        }
        if all.last().is_none_or(|last| t - last > early.max(skew)) {
            all.push(t);
        }
    }
    all.extend(&time_s[at..]);
    all
}

/// Returns true if an input was logged when it changed: it has far fewer samples than an output, or a longer gap within them.
fn is_sparse(input: &Track<'_>, output: &Track<'_>) -> bool {
    let gap = GAP * output.step_s;
    let has_gap = || input.time_s.windows(2).any(|pair| pair[1] - pair[0] > gap);
    let ends_early = || output.time_s.last().zip(input.time_s.last()).is_some_and(|(last, own)| last - own > gap);
    count(input.time_s.len()) < CHANGES * count(output.time_s.len()) || has_gap() || ends_early()
}

/// Removes the samples that repeat the time and the values of the one before; returns their number.
fn without_repeats(series: &mut Series) -> usize {
    let count = series.columns.first().map_or(0, Vec::len);
    let is_repeated = |values: &Vec<f64>, n: usize| n > 0 && values[n].to_bits() == values[n - 1].to_bits();
    let is_good = |n: &usize| {
        series.time_s.is_empty()
            || !is_repeated(&series.time_s, *n)
            || !series.columns.iter().all(|of| is_repeated(of, *n))
    };
    let good: Vec<usize> = (0..count).filter(is_good).collect();
    if good.len() < count {
        let kept = |values: &Vec<f64>| good.iter().filter_map(|n| values.get(*n).copied()).collect();
        series.columns = series.columns.iter().map(kept).collect();
        series.time_s = kept(&series.time_s);
    }
    count - good.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(time_s: &[f64], values: &[f64]) -> Series {
        Series { time_s: time_s.to_vec(), columns: vec![values.to_vec()] }
    }

    fn wanted() -> [Wanted; 2] {
        let of = |n: usize, name: &str, role| Wanted { at: (n, 0), name: name.to_owned(), role };
        [of(0, "voltage", Role::Input), of(1, "speed", Role::Output)]
    }

    /// Returns the times and values at which a column counts.
    fn counted(merged: &Merged, column: usize) -> Vec<(f64, f64)> {
        let counts = |n: &usize| merged.measured[column].get(*n).copied().unwrap_or(true);
        (0..merged.time_s.len()).filter(counts).map(|n| (merged.time_s[n], merged.columns[column][n])).collect()
    }

    #[test]
    fn outputs_count_at_their_own_samples_and_inputs_hold() {
        let input = series(&[0.0, 1.0, 2.0, 3.0, 4.0], &[1.0, 1.0, 2.0, 2.0, 2.0]);
        let output = series(&[0.5, 1.5, 2.5, 3.5], &[5.0, 15.0, 25.0, 35.0]);
        let merged = merged(vec![input, output], &wanted(), false);
        assert_eq!(merged.time_s, [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]);
        assert_eq!(merged.columns[0], [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]);
        assert_eq!(counted(&merged, 1), [(0.5, 5.0), (1.5, 15.0), (2.5, 25.0), (3.5, 35.0)]);
        assert!(merged.columns[1].iter().zip(&merged.time_s).all(|(value, t)| (value - 10.0 * t).abs() < 1e-12));
        assert!(merged.notes[0].contains("voltage (1.000 Hz) has a zero-order hold"), "{:?}", merged.notes);
    }

    #[test]
    fn a_slower_output_on_the_clock_of_the_input_adds_no_times() {
        let times: Vec<f64> = (0..101).map(f64::from).collect();
        let slow: Vec<f64> = (0..26).map(|n| 4.0 * f64::from(n)).collect();
        let merged = merged(vec![series(&times, &times), series(&slow, &slow)], &wanted(), false);
        assert_eq!(merged.time_s, times);
        assert_eq!(counted(&merged, 1), slow.iter().map(|t| (*t, *t)).collect::<Vec<_>>());
    }

    #[test]
    fn simultaneous_samples_share_a_time_without_a_note() {
        let (first, second) =
            (series(&[0.0, 1.0, 2.0], &[1.0, 2.0, 3.0]), series(&[0.0, 0.999, 2.002], &[4.0, 5.0, 6.0]));
        let merged = merged(vec![first, second], &wanted(), false);
        assert_eq!((&merged.time_s[..], counted(&merged, 1).len(), merged.notes.len()), (&[0.0, 1.0, 2.0][..], 3, 0));
    }

    #[test]
    fn an_input_that_is_logged_when_it_changes_holds_on_the_clock_of_the_output() {
        let input = series(&[0.0, 2.5], &[0.0, 7.0]);
        let output = series(&[0.0, 1.0, 2.0, 3.0, 4.0], &[0.0, 0.0, 0.0, 1.0, 2.0]);
        for holds in [true, false] {
            let merged = merged(vec![input.clone(), output.clone()], &wanted(), holds);
            assert_eq!(merged.time_s, [0.0, 1.0, 2.0, 2.5, 3.0, 4.0], "the input changes between two samples");
            assert_eq!(merged.columns[0], [0.0, 0.0, 0.0, 7.0, 7.0, 7.0]);
            assert_eq!(counted(&merged, 1).len(), 5);
        }
    }

    #[test]
    fn an_input_that_stops_ends_the_recording() {
        let times: Vec<f64> = (0..9).map(f64::from).collect();
        let merged = merged(vec![series(&times[..6], &[1.0; 6]), series(&times, &times)], &wanted(), false);
        assert_eq!(merged.time_s.last(), Some(&6.0));
    }

    #[test]
    fn uneven_outputs_hold_in_logs_of_changes_and_count_alone_otherwise() {
        let times: Vec<f64> = (0..9).map(f64::from).collect();
        let input = series(&times, &times);
        let output = series(&[0.0, 1.0, 2.0, 7.0, 8.0], &[0.0, 0.5, 1.7, 3.0, 4.2]);
        let held = merged(vec![input.clone(), output.clone()], &wanted(), true);
        let values: Vec<f64> = counted(&held, 1).iter().map(|(_, value)| *value).collect();
        assert_eq!(values, [0.0, 0.5, 1.7, 1.7, 1.7, 1.7, 1.7, 3.0, 4.2]);
        let own = merged(vec![input, output], &wanted(), false);
        assert_eq!((own.time_s.len(), counted(&own, 1).len()), (9, 5));
    }

    #[test]
    fn coarsely_quantized_outputs_hold_in_logs_of_changes() {
        let times: Vec<f64> = (0..16).map(f64::from).collect();
        // Changes every three periods, by one step.
        let output = series(&[0.0, 3.0, 6.0, 9.0, 12.0, 15.0], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let held = merged(vec![series(&times, &times), output], &wanted(), true);
        assert_eq!(counted(&held, 1).len(), 16);
        assert_eq!(held.columns[1][..7], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
    }

    #[test]
    fn a_coarse_output_of_a_slower_clock_counts_at_its_own_samples() {
        // Its values repeat, so that they were not logged when they changed.
        let times: Vec<f64> = (0..61).map(f64::from).collect();
        let slow: Vec<f64> = (0..16).map(|n| 4.0 * f64::from(n)).collect();
        let coarse: Vec<f64> = (0..16).map(|n| f64::from(n / 3)).collect();
        let merged = merged(vec![series(&times, &times), series(&slow, &coarse)], &wanted(), true);
        assert_eq!(counted(&merged, 1).len(), 16);
    }

    #[test]
    fn an_input_that_is_logged_late_in_a_period_acts_in_it() {
        // Both have gaps, as in logs of changes; the voltage is written 1 ms after the speed.
        let speed = series(&[0.0, 0.02, 0.04, 0.06, 0.08, 0.1], &[0.0, 0.0, 1.0, 2.0, 3.0, 4.0]);
        let input = series(&[0.001, 0.041], &[0.0, 7.0]);
        let merged = merged(vec![input, speed], &wanted(), true);
        assert_eq!(merged.columns[0], [0.0, 0.0, 7.0, 7.0, 7.0, 7.0]);
    }

    #[test]
    fn numbers_that_are_missing_do_not_cost_those_of_other_columns() {
        let times = [0.0, 1.0, 2.0, 3.0];
        let input = series(&times, &[1.0, 2.0, 3.0, 4.0]);
        let merged = merged(vec![input, series(&times, &[5.0, f64::NAN, 7.0, 8.0])], &wanted(), false);
        assert_eq!(merged.columns[0], [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(counted(&merged, 1), [(0.0, 5.0), (2.0, 7.0), (3.0, 8.0)]);
        assert!(merged.notes[0].contains("1 sample of speed without a number"), "{:?}", merged.notes);
    }

    #[test]
    fn a_sample_before_a_test_has_the_voltage_before_it() {
        let (input, output) = (series(&[1.0, 2.0, 3.0], &[7.0; 3]), series(&[1.0, 2.0, 3.0], &[0.0, 1.0, 2.0]));
        let mut merged = merged(vec![input, output], &wanted(), true);
        merged.begin_with(&[Some(0.5), None], &wanted());
        assert_eq!(merged.columns, [[0.5, 7.0, 7.0, 7.0], [0.0, 0.0, 1.0, 2.0]]);
        assert!((merged.time_s[0] - 0.998).abs() < 1e-12);
        assert_eq!(merged.measured[1], [false, true, true, true]);
    }

    #[test]
    fn equal_times_are_not_touched() {
        let (input, output) = (series(&[0.0, 0.1], &[1.0, 2.0]), series(&[0.0, 0.1], &[3.0, 4.0]));
        let merged = merged(vec![input, output], &wanted(), false);
        assert_eq!((merged.columns, merged.notes.len()), (vec![vec![1.0, 2.0], vec![3.0, 4.0]], 0));
    }
}
