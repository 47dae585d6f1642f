//! Paths of curves in the coordinates of a drawing.

use super::{Form, Trace};
use crate::numeric::{count, whole};
use std::fmt::Write as _;

/// Number of columns of a drawing of more than twice as many samples; those in one column are drawn as their lowest and highest
/// value.
const COLUMNS: f64 = 2500.0;

/// A linear map from the ranges of the axes to a drawing of a width and a height.
pub(super) struct Frame {
    /// Ranges of the axes.
    pub ranges: [[f64; 2]; 2],
    /// Width and height of the drawing.
    pub size: [f64; 2],
}

/// Samples in one column: the position of the first, and the lowest and highest value.
struct Column {
    x: f64,
    ends: [f64; 2],
    /// True if the lowest value comes before the highest.
    is_rising: bool,
}

impl Frame {
    pub(super) fn x(&self, x: f64) -> f64 {
        let [low, high] = self.ranges[0];
        (x - low) / (high - low) * self.size[0]
    }

    fn y(&self, y: f64) -> f64 {
        let [low, high] = self.ranges[1];
        (high - y) / (high - low) * self.size[1]
    }

    /// Returns the path of a curve; empty if nothing of it can be drawn.
    pub(super) fn path(&self, trace: &Trace) -> String {
        let mut path = String::new();
        match trace.form {
            Form::Stems => {
                let zero = number(self.y(0.0));
                self.each(&trace.points, |x, y| write(&mut path, format_args!("M{} {zero}V{}", number(x), number(y))));
            }
            Form::Dots => {
                for column in self.columns(&trace.points).into_iter().flatten() {
                    let [low, high] = column.ends.map(number);
                    // A line without a length and with round ends is a dot.
                    write(&mut path, format_args!("M{} {low}V{high}", number(column.x)));
                }
            }
            Form::Line | Form::Steps => self.line(&mut path, trace),
        }
        path
    }

    /// Returns the outline of the band around a curve; empty without one.
    pub(super) fn band(&self, trace: &Trace) -> String {
        let kept: Vec<Column> = self.columns(&trace.points).into_iter().flatten().collect();
        if !(trace.band > 0.0 && trace.band.is_finite()) || kept.is_empty() {
            return String::new();
        }
        let half = trace.band / (self.ranges[1][1] - self.ranges[1][0]) * self.size[1];
        let upper = kept.iter().map(|column| (column.x, column.ends[1] - half));
        let lower = kept.iter().rev().map(|column| (column.x, column.ends[0] + half));
        let mut path = String::new();
        for (n, (x, y)) in upper.chain(lower).enumerate() {
            write(&mut path, format_args!("{}{} {}", if n == 0 { "M" } else { "L" }, number(x), number(y)));
        }
        path + "Z"
    }

    fn line(&self, path: &mut String, trace: &Trace) {
        let mut is_begun = false;
        for column in self.columns(&trace.points) {
            let Some(Column { x, ends: [low, high], is_rising }) = column else {
                is_begun = false;
                continue;
            };
            let [first, second] = if is_rising { [low, high] } else { [high, low] };
            let x = number(x);
            match (is_begun, trace.form) {
                (false, _) => write(path, format_args!("M{x} {}", number(first))),
                (true, Form::Steps) => write(path, format_args!("H{x}V{}", number(first))),
                (true, _) => write(path, format_args!("L{x} {}", number(first))),
            }
            if number(first) != number(second) {
                write(path, format_args!("V{}", number(second)));
            }
            is_begun = true;
        }
    }

    /// Calls `draw` with the position of each point that can be drawn.
    fn each(&self, points: &[(f64, f64)], mut draw: impl FnMut(f64, f64)) {
        for (x, y) in points.iter().map(|(x, y)| (self.x(*x), self.y(*y))) {
            if x.is_finite() && y.is_finite() {
                draw(x, y);
            }
        }
    }

    /// Merges the points of each column; `None` where a point cannot be drawn. Few points stay as they are. Values have the
    /// direction of the drawing: downwards.
    fn columns(&self, points: &[(f64, f64)]) -> Vec<Option<Column>> {
        let is_dense = count(points.len()) > 2.0 * COLUMNS;
        let column_of = |x: f64| whole(x / self.size[0] * COLUMNS);
        let mut columns: Vec<Option<Column>> = Vec::new();
        for (x, y) in points.iter().map(|(x, y)| (self.x(*x), self.y(*y))) {
            if !(x.is_finite() && y.is_finite()) {
                columns.push(None);
                continue;
            }
            match columns.last_mut() {
                Some(Some(last)) if is_dense && column_of(last.x) == column_of(x) => {
                    // In the drawing, the highest value has the smallest ordinate.
                    let [low, high] = &mut last.ends;
                    if y > *low {
                        (*low, last.is_rising) = (y, false);
                    } else if y < *high {
                        (*high, last.is_rising) = (y, true);
                    }
                }
                _ => columns.push(Some(Column { x, ends: [y, y], is_rising: true })),
            }
        }
        columns
    }
}

/// Returns a coordinate with two decimals at most.
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Appends to a text.
pub(super) fn write(text: &mut String, parts: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = text.write_fmt(parts);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame {
        Frame { ranges: [[0.0, 10.0], [-1.0, 1.0]], size: [100.0, 20.0] }
    }

    fn path(form: Form, points: &[(f64, f64)]) -> String {
        frame().path(&Trace::new("", 0, form, points.to_vec()))
    }

    #[test]
    fn points_are_mapped_to_the_drawing() {
        let points = [(0.0, -1.0), (5.0, 0.5), (10.0, 1.0)];
        assert_eq!(path(Form::Line, &points), "M0 20L50 5L100 0");
        assert_eq!(path(Form::Steps, &points), "M0 20H50V5H100V0");
        assert_eq!(path(Form::Stems, &points), "M0 10V20M50 10V5M100 10V0");
        assert_eq!(path(Form::Dots, &points), "M0 20V20M50 5V5M100 0V0");
    }

    #[test]
    fn a_gap_interrupts_a_line() {
        assert_eq!(path(Form::Line, &[(0.0, 0.0), (1.0, f64::NAN), (2.0, 0.0), (3.0, 1.0)]), "M0 10M20 10L30 0");
    }

    #[test]
    fn dense_samples_keep_their_extremes() {
        let mut points: Vec<(f64, f64)> = (0..200_000).map(|n| (f64::from(n) * 5e-5, 0.0)).collect();
        points[51_234].1 = 0.9;
        points[151_234].1 = -0.9;
        for form in [Form::Line, Form::Dots] {
            let path = path(form, &points);
            let ends = |value: &str| [format!("V{value}M"), format!("V{value}L"), format!(" {value}V")];
            let has = |value: &str| ends(value).iter().any(|end| path.contains(end));
            assert!(has("1") && has("19"), "the highest and the lowest value");
            assert!(path.len() < 100_000, "{}", path.len());
        }
    }

    #[test]
    fn a_band_surrounds_its_curve() {
        let trace = Trace::new("", 1, Form::Line, vec![(0.0, 0.0), (10.0, 0.5)]).with_band(0.2);
        assert_eq!(frame().band(&trace), "M0 8L100 3L100 7L0 12Z");
        assert_eq!(frame().band(&Trace { band: 0.0, ..trace }), "");
    }
}
