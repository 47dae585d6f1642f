//! Plots in the terminal: measured samples as dots, the model as a line of braille characters, and the residuals below. They need
//! no colour.

use motorfit::text::significant;

/// Rows of a panel of signals and of one of residuals \[characters\].
const ROWS: [usize; 2] = [9, 4];
/// Columns left of a panel: the numbers of its axis and the axis itself \[characters\].
const MARGIN: usize = 11;
/// Distance of the measured samples that are marked \[characters\].
const SPACING: usize = 3;
/// Mark of a measured sample.
const MEASURED: char = 'o';

/// A signal over time: the measured one and its model.
pub(super) struct Signal<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub time_s: &'a [f64],
    pub measured: &'a [f64],
    pub model: &'a [f64],
}

/// Draws a signal with its residuals in at most `width` columns; empty without finite values.
pub(super) fn drawn(signal: &Signal<'_>, width: usize) -> String {
    let Signal { name, unit, time_s, measured, model } = *signal;
    let residuals: Vec<f64> = measured.iter().zip(model).map(|(measured, model)| measured - model).collect();
    let columns = width.saturating_sub(MARGIN).max(10);
    let (Some(time), Some(both), Some(left)) =
        (range([time_s]), range([measured, model]), range([residuals.as_slice(), &[0.0]]))
    else {
        return String::new();
    };
    let mut upper = Canvas::new(columns, ROWS[0], time, both);
    upper.line(time_s, model);
    upper.marks(time_s, measured);
    let mut lower = Canvas::new(columns, ROWS[1], time, left);
    lower.dots(time_s, &residuals);
    let [from, to] = time.map(|seconds| significant(seconds, 3));
    let gap = columns.saturating_sub(from.chars().count() + to.chars().count() + 2);
    let time_axis = format!("{}{from}{}{to} s\n", " ".repeat(MARGIN), " ".repeat(gap));
    format!(
        "{name} [{unit}]: {MEASURED} measured, line: model\n{}residual [{unit}]\n{}{time_axis}",
        upper.text(),
        lower.text()
    )
}

/// Returns the smallest and largest finite value, at least a little apart; `None` without any.
fn range<const N: usize>(lists: [&[f64]; N]) -> Option<[f64; 2]> {
    let finite = || lists.iter().flat_map(|list| list.iter().copied()).filter(|value| value.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let apart = (high - low).max(1e-9 * low.abs().max(high.abs())).max(f64::MIN_POSITIVE);
    (low <= high && apart.is_finite()).then_some([low, low + apart])
}

/// A grid of characters, each with two by four dots.
struct Canvas {
    columns: usize,
    dots: Vec<Vec<bool>>,
    marks: Vec<Vec<bool>>,
    x: [f64; 2],
    y: [f64; 2],
}

impl Canvas {
    fn new(columns: usize, rows: usize, x: [f64; 2], y: [f64; 2]) -> Self {
        let grid = |columns, rows| vec![vec![false; columns]; rows];
        Self { columns, dots: grid(2 * columns, 4 * rows), marks: grid(columns, rows), x, y }
    }

    /// Returns the index of a value among `count` equal parts of a range; `None` outside.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the share is between 0 and 1")]
    #[expect(clippy::cast_precision_loss, reason = "a canvas is small")]
    fn place(value: f64, [low, high]: [f64; 2], count: usize) -> Option<usize> {
        let share = (value - low) / (high - low);
        (0.0..=1.0).contains(&share).then(|| ((share * count as f64) as usize).min(count - 1))
    }

    /// Returns the dot of a point, counted from the upper left.
    fn dot(&self, x: f64, y: f64) -> Option<[usize; 2]> {
        let height = self.dots.len();
        Some([Self::place(x, self.x, 2 * self.columns)?, height - 1 - Self::place(y, self.y, height)?])
    }

    fn dots(&mut self, x: &[f64], y: &[f64]) {
        for (x, y) in x.iter().zip(y) {
            if let Some([column, row]) = self.dot(*x, *y) {
                self.dots[row][column] = true;
            }
        }
    }

    /// Draws a line through points; between two points all dots of the column between their rows are set.
    fn line(&mut self, x: &[f64], y: &[f64]) {
        let mut before: Option<[usize; 2]> = None;
        for (x, y) in x.iter().zip(y) {
            let Some([column, row]) = self.dot(*x, *y) else {
                before = None;
                continue;
            };
            let [first, from] = before.unwrap_or([column, row]);
            let steps = column.saturating_sub(first).max(1);
            for step in 0..=column.saturating_sub(first) {
                let at = |step: usize| (from * (steps - step.min(steps)) + row * step.min(steps)) / steps;
                let ends = [at(step), if first == column { row } else { at(step) }];
                let next = if step > 0 { at(step - 1) } else { ends[0] };
                for row in ends[0].min(ends[1]).min(next)..=ends[0].max(ends[1]).max(next) {
                    self.dots[row][first + step] = true;
                }
            }
            before = Some([column, row]);
        }
    }

    /// Marks the measured value nearest to the centre of every few columns.
    fn marks(&mut self, x: &[f64], y: &[f64]) {
        let mut last = None;
        for (x, y) in x.iter().zip(y) {
            let Some([column, row]) = self.dot(*x, *y) else { continue };
            let (column, row) = (column / 2, row / 4);
            if column % SPACING == 0 && last != Some(column) {
                self.marks[row][column] = true;
                last = Some(column);
            }
        }
    }

    /// Returns the lines of the canvas, with the ends of the second axis at the left.
    fn text(&self) -> String {
        let rows = self.marks.len();
        let line = |row: usize| {
            let label = match row {
                0 => significant(self.y[1], 3),
                _ if row + 1 == rows => significant(self.y[0], 3),
                _ => String::new(),
            };
            let cells: String = (0..self.columns).map(|column| self.cell(row, column)).collect();
            format!("{label:>width$} │{}\n", cells.trim_end(), width = MARGIN - 2)
        };
        (0..rows).map(line).collect()
    }

    fn cell(&self, row: usize, column: usize) -> char {
        if self.marks[row][column] {
            return MEASURED;
        }
        // Bits of the dots of a braille character, left column first.
        const BITS: [[u32; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
        let bit = |(x, y): (usize, usize)| if self.dots[4 * row + y][2 * column + x] { BITS[x][y] } else { 0 };
        let bits: u32 = (0..2).flat_map(|x| (0..4).map(move |y| (x, y))).map(bit).sum();
        if bits == 0 { ' ' } else { char::from_u32(0x2800 + bits).unwrap_or(' ') }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of<'a>(time_s: &'a [f64], measured: &'a [f64], model: &'a [f64]) -> Signal<'a> {
        Signal { name: "current", unit: "A", time_s, measured, model }
    }

    #[test]
    fn a_ramp_rises_from_the_lower_left_to_the_upper_right() {
        let ramp: Vec<f64> = (0..200).map(f64::from).collect();
        for width in [20, 50, 80, 200] {
            let text = drawn(&of(&ramp, &ramp, &ramp), width);
            assert!(text.lines().skip(1).all(|line| line.chars().count() <= width.max(21)), "{text}");
            let rows: Vec<&str> = text.lines().skip(1).take(ROWS[0]).collect();
            let first = |row: &str| row.chars().skip(MARGIN).position(|c| c != ' ').unwrap();
            let starts: Vec<usize> = rows.iter().map(|row| first(row)).collect();
            assert!(starts.is_sorted_by(|a, b| a > b) && starts[ROWS[0] - 1] == 0, "{starts:?}\n{text}");
            assert!(rows[0].starts_with("      199 │") && rows[ROWS[0] - 1].starts_with("        0 │"), "{text}");
        }
    }

    #[test]
    fn measured_samples_and_the_model_are_different_characters() {
        let time: Vec<f64> = (0..100).map(f64::from).collect();
        let (low, high) = (vec![0.0; 100], vec![1.0; 100]);
        let text = drawn(&of(&time, &high, &low), 60);
        let rows: Vec<&str> = text.lines().skip(1).take(ROWS[0]).collect();
        assert!(rows[0].contains(MEASURED) && !rows[ROWS[0] - 1].contains(MEASURED), "{text}");
        let braille = |row: &str| row.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c));
        assert!(braille(rows[ROWS[0] - 1]) && !braille(rows[0]), "{text}");
    }

    #[test]
    fn what_cannot_be_drawn_is_empty() {
        for values in [&[][..], &[f64::NAN; 3], &[f64::INFINITY; 3], &[f64::MAX, f64::MIN]] {
            drawn(&of(&[0.0, 1.0, 2.0], values, values), 60);
        }
        assert_eq!(drawn(&of(&[0.0, 1.0], &[f64::NAN; 2], &[f64::NAN; 2]), 60), "");
        assert!(drawn(&of(&[0.0, 1.0], &[5.0; 2], &[5.0; 2]), 60).contains("current [A]"));
    }
}
