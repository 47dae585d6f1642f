//! Columns of tables whose rows have no times of their own.

use super::track::{GAP, Merged, Role, Wanted};
use motorfit_core::numeric::{count, upper_median};
use motorfit_core::text::counted;
use motorfit_logs::Series;

/// Returns the columns of tables without times of their own. A row without a time is left out; an output counts where it is a number,
/// and an input holds over a step or two of its own.
pub(super) fn rows(all: Vec<Series>, wanted: &[Wanted]) -> Merged {
    let count = all.iter().flat_map(|series| &series.columns).map(Vec::len).min().unwrap_or(0);
    let of = |wanted: &Wanted| &all[wanted.at.0].columns[wanted.at.1];
    let has_outputs = wanted.iter().any(|wanted| wanted.role == Role::Output);
    let held: Vec<Vec<f64>> = wanted
        .iter()
        .map(|wanted| if wanted.role == Role::Input { held_over(of(wanted)) } else { Vec::new() })
        .collect();
    let is_kept = |n: &usize| {
        let mut has_output = !has_outputs;
        let known = wanted.iter().zip(&held).all(|(wanted, held)| match wanted.role {
            Role::Time => !of(wanted)[*n].is_nan(),
            Role::Input => !held[*n].is_nan(),
            Role::Output => {
                has_output |= !of(wanted)[*n].is_nan();
                true
            }
        });
        let changes = || wanted.iter().any(|wanted| wanted.role == Role::Input && !of(wanted)[*n].is_nan());
        known && (has_output || changes())
    };
    let kept: Vec<usize> = (0..count).filter(is_kept).collect();
    let mut merged = Merged::default();
    if kept.len() < count {
        merged.notes.push(format!("{} without a number left out", counted(count - kept.len(), "row")));
    }
    for (wanted, held) in wanted.iter().zip(&held) {
        let source = if wanted.role == Role::Input { held } else { of(wanted) };
        let mut values: Vec<f64> = kept.iter().map(|n| source[*n]).collect();
        let measured: Vec<bool> = values.iter().map(|value| !value.is_nan()).collect();
        let missing = measured.iter().filter(|is| !**is).count();
        if missing > 0 {
            merged.notes.push(format!(
                "{} has no number in {}, which do not count for it",
                wanted.name,
                counted(missing, "row")
            ));
            let mut last = values.iter().copied().find(|value| !value.is_nan()).unwrap_or(0.0);
            for value in &mut values {
                last = if value.is_nan() { last } else { *value };
                *value = last;
            }
        }
        let gaps = kept.iter().filter(|n| wanted.role == Role::Input && of(wanted)[**n].is_nan()).count();
        if gaps > 0 {
            merged.notes.push(format!(
                "{} has no number in {}, over which it holds its last value",
                wanted.name,
                counted(gaps, "row")
            ));
        }
        merged.columns.push(values);
        merged.measured.push(if missing > 0 { measured } else { Vec::new() });
    }
    merged
}

/// Returns an input with its last value in place of NaN, over at most [`GAP`] of its usual steps.
fn held_over(values: &[f64]) -> Vec<f64> {
    let own: Vec<usize> = (0..values.len()).filter(|n| !values[*n].is_nan()).collect();
    let mut steps: Vec<f64> = own.windows(2).map(|pair| count(pair[1] - pair[0])).collect();
    if own.len() == values.len() || steps.is_empty() {
        return values.to_vec();
    }
    let most = GAP * upper_median(&mut steps);
    let (mut held, mut last) = (values.to_vec(), None);
    for n in 0..held.len() {
        match held[n].is_nan() {
            false => last = Some(n),
            true if last.is_some_and(|from| count(n - from) < most) => held[n] = values[last.unwrap_or(n)],
            true => {}
        }
    }
    held
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f64 = f64::NAN;

    fn merged(columns: &[(Role, &[f64])]) -> Merged {
        let series =
            Series { time_s: Vec::new(), columns: columns.iter().map(|(_, values)| values.to_vec()).collect() };
        let wanted =
            |(n, (role, _)): (usize, &(Role, &[f64]))| Wanted { at: (0, n), name: format!("{role:?}"), role: *role };
        rows(vec![series], &columns.iter().enumerate().map(wanted).collect::<Vec<_>>())
    }

    #[test]
    fn an_output_counts_where_it_is_a_number() {
        let time = [0.0, 1.0, 2.0, 3.0, NAN];
        let found = merged(&[
            (Role::Time, &time),
            (Role::Input, &[1.0, 2.0, 3.0, 4.0, 5.0]),
            (Role::Output, &[5.0, NAN, 7.0, 8.0, 9.0]),
        ]);
        assert_eq!(found.columns, [vec![0.0, 1.0, 2.0, 3.0], vec![1.0, 2.0, 3.0, 4.0], vec![5.0, 5.0, 7.0, 8.0]]);
        assert_eq!(found.measured, [vec![], vec![], vec![true, false, true, true]]);
        assert_eq!(found.notes[0], "1 row without a number left out", "it has no time");
    }

    #[test]
    fn an_input_of_an_outer_join_holds_over_its_steps_and_not_over_a_gap() {
        let (time, outputs): (Vec<f64>, Vec<f64>) = ((0..18).map(f64::from).collect(), vec![0.0; 18]);
        let mut input = vec![NAN; 18];
        for (n, value) in [(0, 1.0), (2, 2.0), (4, 3.0), (6, 4.0), (17, 5.0)] {
            input[n] = value;
        }
        let found = merged(&[(Role::Time, &time), (Role::Input, &input), (Role::Output, &outputs)]);
        assert_eq!(found.columns[0], [&time[..11], &time[17..]].concat());
        assert_eq!(found.columns[1][..9], [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0]);
    }
}
