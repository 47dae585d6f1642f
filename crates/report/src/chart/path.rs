//! Paths of curves in the coordinates of a drawing.

use super::panels::{Band, Form, Series};
use super::scale::AxisScale;
use motorfit_core::numeric::{count, whole};
use std::fmt::Write as _;

/// Number of columns of a drawing of more than twice as many samples; those in one column are drawn as their lowest and highest
/// value.
const COLUMNS: f64 = 2500.0;
/// Largest coordinate whose hundredths are counted exactly.
const EXACT_MAX: f64 = 1e12;

/// A map from values on two axes to a drawing of a width and a height.
pub(super) struct Frame<'a> {
    /// Scales of the axes.
    pub scales: &'a [AxisScale; 2],
    /// Ranges of the axes, as places on their scales.
    pub ranges: [[f64; 2]; 2],
    /// Width and height of the drawing.
    pub size: [f64; 2],
}

/// Points of a side of a band, in the coordinates of the drawing.
type Outline = Vec<(f64, f64)>;

/// Samples in one column: the position of the first, and the lowest and highest value.
struct Column {
    x: f64,
    ends: [f64; 2],
    /// True if the lowest value comes before the highest.
    is_rising: bool,
}

impl Frame<'_> {
    pub(super) fn x(&self, x: f64) -> f64 {
        let [low, high] = self.ranges[0];
        (self.scales[0].place(x) - low) / (high - low) * self.size[0]
    }

    pub(super) fn y(&self, y: f64) -> f64 {
        let [low, high] = self.ranges[1];
        (high - self.scales[1].place(y)) / (high - low) * self.size[1]
    }

    /// Returns the path of a series; empty if nothing of it can be drawn.
    pub(super) fn path(&self, series: &Series) -> String {
        let mut path = String::new();
        match series.form {
            Form::Stems => {
                let zero = self.zero();
                self.each(&series.points, |x, y| write(&mut path, format_args!("M{} {zero}V{}", number(x), number(y))));
            }
            // A line without a length and with round ends is a dot.
            Form::Marks => {
                self.each(&series.points, |x, y| write(&mut path, format_args!("M{} {1}V{1}", number(x), number(y))))
            }
            Form::Dots => {
                for column in self.columns(series.points.iter().copied()).into_iter().flatten() {
                    let [low, high] = column.ends.map(number);
                    write(&mut path, format_args!("M{} {low}V{high}", number(column.x)));
                }
            }
            Form::Bars => {
                let zero = self.zero();
                for bar in series.points.windows(2).filter(|bar| bar[0].1 > 0.0) {
                    let ends = [self.x(bar[0].0), self.x(bar[1].0), self.y(bar[0].1)];
                    if ends.iter().all(|end| end.is_finite()) {
                        let [from, to, top] = ends.map(number);
                        write(&mut path, format_args!("M{from} {zero}V{top}H{to}V{zero}"));
                    }
                }
            }
            Form::Box => self.boxed(&mut path, &series.points),
            Form::Line | Form::Steps => self.line(&mut path, series),
        }
        path
    }

    /// Returns the ordinate of the value 0; on a logarithmic axis that of the lower end.
    fn zero(&self) -> String {
        let zero = self.y(0.0);
        number(if zero.is_finite() { zero } else { self.size[1] })
    }

    /// Draws a box below the middle of its row, above which its name is.
    fn boxed(&self, path: &mut String, points: &[(f64, f64)]) {
        let [(_, row), ..] = points else { return };
        let [top, bottom, middle] = [-0.02, -0.38, -0.2].map(|part| number(self.y(row + part)));
        let [low, first, median, third, high] =
            [0, 1, 2, 3, 4].map(|n| points.get(n).map_or(f64::NAN, |point| self.x(point.0)));
        if [low, first, median, third, high, self.y(*row)].iter().all(|x| x.is_finite()) {
            let [low, first, median, third, high] = [low, first, median, third, high].map(number);
            write(path, format_args!("M{low} {middle}H{first}M{first} {top}H{third}V{bottom}H{first}Z"));
            write(path, format_args!("M{median} {top}V{bottom}M{third} {middle}H{high}"));
        }
    }

    /// Returns the outline of the band around a curve; empty without one.
    pub(super) fn band(&self, series: &Series) -> String {
        let (upper, lower): (Outline, Outline) = match &series.band {
            Band::None => return String::new(),
            Band::Half(half) => {
                if !(*half > 0.0 && half.is_finite()) {
                    return String::new();
                }
                // The band follows the lowest and the highest value of each column.
                let [above, below] =
                    [*half, -*half].map(|by| self.columns(series.points.iter().map(|(x, y)| (*x, y + by))));
                let placed = above.into_iter().flatten().zip(below.into_iter().flatten());
                placed.map(|(above, below)| ((above.x, above.ends[1]), (below.x, below.ends[0]))).unzip()
            }
            Band::Between(ends) => {
                let placed = series.points.iter().zip(ends).map(|((x, _), [low, high])| [*x, *low, *high]);
                let placed = placed.map(|[x, low, high]| ((self.x(x), self.y(high)), (self.x(x), self.y(low))));
                placed.filter(|((x, high), (_, low))| x.is_finite() && high.is_finite() && low.is_finite()).unzip()
            }
        };
        let mut path = String::new();
        for (n, (x, y)) in upper.iter().chain(lower.iter().rev()).enumerate() {
            write(&mut path, format_args!("{}{} {}", if n == 0 { "M" } else { "L" }, number(*x), number(*y)));
        }
        if path.is_empty() { path } else { path + "Z" }
    }

    fn line(&self, path: &mut String, series: &Series) {
        let mut is_begun = false;
        let columns = self.columns(series.points.iter().copied());
        for (n, column) in columns.iter().enumerate() {
            let Some(Column { x, ends: [low, high], is_rising }) = column else {
                is_begun = false;
                continue;
            };
            let [first, second] = if *is_rising { [*low, *high] } else { [*high, *low] };
            let x = number(*x);
            match (is_begun, series.form) {
                (false, _) => write(path, format_args!("M{x} {}", number(first))),
                (true, Form::Steps) => write(path, format_args!("H{x}V{}", number(first))),
                (true, _) => write(path, format_args!("L{x} {}", number(first))),
            }
            let is_alone = !is_begun && columns.get(n + 1).is_none_or(Option::is_none);
            // A lone point is a line without a length, whose round ends are a dot.
            if number(first) != number(second) || is_alone {
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
    fn columns(&self, points: impl ExactSizeIterator<Item = (f64, f64)>) -> Vec<Option<Column>> {
        let is_dense = count(points.len()) > 2.0 * COLUMNS;
        let column_of = |x: f64| whole(x / self.size[0] * COLUMNS);
        let mut columns: Vec<Option<Column>> = Vec::new();
        for (x, y) in points.map(|(x, y)| (self.x(x), self.y(y))) {
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
    // Whole hundredths take a third of the time of decimals.
    if !value.is_finite() || value.abs() >= EXACT_MAX {
        return format!("{value:.2}");
    }
    #[expect(clippy::cast_possible_truncation, reason = "below EXACT_MAX")]
    let hundredths = (100.0 * value).round() as i64;
    let sign = if hundredths < 0 { "-" } else { "" };
    let (whole, rest) = (hundredths.unsigned_abs() / 100, hundredths.unsigned_abs() % 100);
    match rest {
        0 => format!("{sign}{whole}"),
        rest if rest % 10 == 0 => format!("{sign}{whole}.{}", rest / 10),
        rest => format!("{sign}{whole}.{rest:02}"),
    }
}

/// Appends to a text.
pub(super) fn write(text: &mut String, parts: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = text.write_fmt(parts);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame<'static> {
        Frame {
            scales: &[AxisScale::Linear, AxisScale::Linear],
            ranges: [[0.0, 10.0], [-1.0, 1.0]],
            size: [100.0, 20.0],
        }
    }

    #[test]
    fn coordinates_have_two_decimals_at_most() {
        let numbers = [0.0, -0.001, 12.0, -12.5, 2.345_67, 1000.009, 0.05, -0.25, 1e13, f64::NAN].map(number);
        assert_eq!(numbers, ["0", "0", "12", "-12.5", "2.35", "1000.01", "0.05", "-0.25", "10000000000000.00", "NaN"]);
    }

    fn path(form: Form, points: &[(f64, f64)]) -> String {
        frame().path(&Series::new("", 0, form, points.to_vec()))
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
        assert_eq!(path(Form::Line, &[(0.0, 0.0), (1.0, f64::NAN), (2.0, 0.0), (3.0, 1.0)]), "M0 10V10M20 10L30 0");
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
        let series = Series::new("", 1, Form::Line, vec![(0.0, 0.0), (10.0, 0.5)]).with_band(Band::Half(0.2));
        assert_eq!(frame().band(&series), "M0 8L100 3L100 7L0 12Z");
        let series = series.with_band(Band::Between(vec![[-0.2, 0.2], [0.3, 1.0]]));
        assert_eq!(frame().band(&series), "M0 8L100 0L100 7L0 12Z");
        assert_eq!(frame().band(&series.with_band(Band::None)), "");
    }

    #[test]
    fn bars_boxes_and_logarithms_are_where_their_values_are() {
        // A bar of the height 0 is not drawn.
        assert_eq!(
            path(Form::Bars, &[(0.0, 0.5), (5.0, 0.0), (6.0, 1.0), (10.0, 0.0)]),
            "M0 10V5H50V10M60 10V0H100V10"
        );
        let rows = [AxisScale::Linear, AxisScale::Rows(vec!["a".to_owned(), "b".to_owned()])];
        let frame = Frame { scales: &rows, ranges: [[0.0, 10.0], [-1.5, 0.5]], size: [100.0, 200.0] };
        let five = [0.0, 2.0, 3.0, 5.0, 10.0].map(|x| (x, -1.0));
        let drawn = frame.path(&Series::new("", 1, Form::Box, five.to_vec()));
        assert_eq!(drawn, "M0 170H20M20 152H50V188H20ZM30 152V188M50 170H100");
        let scales = [AxisScale::Log, AxisScale::Log];
        let frame = Frame { scales: &scales, ranges: [[-1.0, 1.0], [0.0, 2.0]], size: [100.0, 20.0] };
        let points = vec![(0.1, 1.0), (1.0, 0.0), (1.0, 10.0), (10.0, 100.0)];
        assert_eq!(frame.path(&Series::new("", 1, Form::Line, points)), "M0 20V20M50 10L100 0");
    }
}
