//! Heat maps of a quantity over two axes, and correlation matrices.

use super::figure::Figure;
use super::file::{document, one};
use super::panels::{Form, Panel, Series};
use super::path::{Frame, number, write};
use super::scale;
use super::scale::AxisScale;
use maud::html;
use motorfit_core::numeric::{count, whole};
use motorfit_core::text::{decimals, printable};

/// A heat map of a quantity over two axes.
pub struct Map<'a> {
    /// Title of the colour scale, with the unit.
    pub title: &'a str,
    /// Labels of the axes, with units.
    pub labels: [&'a str; 2],
    /// Ranges `[min, max]` of the axes.
    pub ranges: [[f64; 2]; 2],
    /// Values by rows, which run along the first axis; the second axis increases from row to row.
    pub values: Vec<Vec<f64>>,
    /// Point that is marked.
    pub mark: [f64; 2],
    /// Closed curve, such as a confidence ellipse.
    pub curve: Vec<(f64, f64)>,
}

/// Colours from the lowest to the highest value: nine of the map viridis by van der Walt and Smith (2015), between which they are
/// interpolated.
const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 45.0, 123.0],
    [59.0, 82.0, 139.0],
    [44.0, 114.0, 142.0],
    [33.0, 145.0, 140.0],
    [40.0, 174.0, 128.0],
    [94.0, 201.0, 98.0],
    [173.0, 220.0, 48.0],
    [253.0, 231.0, 37.0],
];
/// Number of different colours.
const SHADES: f64 = 96.0;
/// Overlap of neighbouring cells \[pixels\].
const OVERLAP: f64 = 0.5;
/// Size of the map, and its place in the drawing \[pixels\].
const MAP: [f64; 2] = [600.0, 460.0];
const AT: [f64; 2] = [112.0, 40.0];

/// Returns the colour of a fraction of the range.
fn color(fraction: f64) -> String {
    let place = fraction.clamp(0.0, 1.0) * 8.0;
    let n = whole(place).min(7);
    let part = |k: usize| VIRIDIS[n][k] + (place - count(n)) * (VIRIDIS[n + 1][k] - VIRIDIS[n][k]);
    format!("#{:02x}{:02x}{:02x}", whole(part(0).round()), whole(part(1).round()), whole(part(2).round()))
}

/// Draws a heat map with its mark and curve as a figure. The drawing is a text if there are no values, rows differ in length, or a
/// range is empty.
#[must_use]
pub fn heat_map(map: &Map<'_>) -> Figure {
    let [[x0, x1], [y0, y1]] = map.ranges;
    let width = map.values.first().map_or(0, Vec::len);
    let is_range = |[low, high]: &[f64; 2]| {
        let size = low.abs().max(high.abs());
        AxisScale::Linear.place(size).is_finite() && high - low > 1e-12 * size && (high - low).recip().is_finite()
    };
    let is_drawn = width > 0 && map.values.iter().all(|row| row.len() == width) && map.ranges.iter().all(is_range);
    let svg = if is_drawn { drawn(map) } else { document([600.0, 60.0], "<text x=\"10\" y=\"35\">no data</text>") };
    let alternative = format!(
        "Map of {} over {} and {}, from {x0} to {x1} and {y0} to {y1}",
        map.title, map.labels[0], map.labels[1]
    );
    Figure { id: "map".to_owned(), map: false, svg, alternative, caption: map.title.to_owned() }
}

fn drawn(map: &Map<'_>) -> String {
    let values = map.values.iter().flatten().copied().filter(|value| AxisScale::Linear.place(*value).is_finite());
    let range = scale::range(&AxisScale::Linear, values);
    let frame = Frame { scales: &[AxisScale::Linear, AxisScale::Linear], ranges: map.ranges, size: MAP };
    // The cells cover the grid lines.
    let mut body = String::new();
    let panel = Panel::new(map.title, Vec::new());
    one(&panel, map.ranges, [AT[0], AT[1], MAP[0], MAP[1]], Some(&map.labels[0].to_owned()), &mut body);
    write(&mut body, format_args!("<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">", AT[0], AT[1], MAP[0], MAP[1]));
    cells(map, range, &mut body);
    let path = frame.path(&Series::new("", 0, Form::Line, map.curve.clone()));
    let (x, y) = (frame.x(map.mark[0]), frame.y(map.mark[1]));
    write(&mut body, format_args!("<path d=\"{path}\" fill=\"none\" stroke=\"#ffffff\" stroke-width=\"2\"/>"));
    if x.is_finite() && y.is_finite() {
        let (x, y) = (number(x), number(y));
        write(&mut body, format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"4\" fill=\"#ffffff\" stroke=\"#1a1a1a\"/>"));
    }
    body += "</svg>";
    let (x, y) = (AT[0] - 88.0, AT[1] + MAP[1] / 2.0);
    let label = html! { (printable(map.labels[1])) }.into_string();
    write(
        &mut body,
        format_args!("<text class=\"axis\" x=\"{x}\" y=\"{y}\" transform=\"rotate(-90 {x} {y})\">{label}</text>"),
    );
    legend(range, &mut body);
    document([AT[0] + MAP[0] + 110.0, AT[1] + MAP[1] + 54.0], &body)
}

/// Draws the cells of a map; `range` is that of its values.
fn cells(map: &Map<'_>, range: [f64; 2], body: &mut String) {
    // Values that cannot be drawn have no shade, and so no neighbour with the same one that can.
    let shade = |value: f64| {
        let is_drawn = AxisScale::Linear.place(value).is_finite();
        let part = (value - range[0]) / (range[1] - range[0]);
        if is_drawn { (part * SHADES).floor().min(SHADES - 1.0) } else { -1.0 }
    };
    let rows = count(map.values.len());
    for (n, row) in map.values.iter().enumerate() {
        let (top, height) = (MAP[1] * (1.0 - count(n + 1) / rows), MAP[1] / rows);
        let column = MAP[0] / count(row.len());
        // Equal neighbours are one rectangle.
        let mut at = 0;
        for run in row.chunk_by(|a, b| shade(*a).total_cmp(&shade(*b)).is_eq()) {
            // Neighbours overlap, so that no line shows between them.
            let (x, width) = (number(column * count(at)), number(column * count(run.len()) + OVERLAP));
            at += run.len();
            if shade(run[0]) >= 0.0 {
                let fill = color((shade(run[0]) + 0.5) / SHADES);
                let (y, height) = (number(top - OVERLAP), number(height + OVERLAP));
                write(
                    body,
                    format_args!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{fill}\"/>"),
                );
            }
        }
    }
}

/// Draws the scale of the colours to the right of the map.
fn legend(range: [f64; 2], body: &mut String) {
    let (x, height) = (AT[0] + MAP[0] + 24.0, MAP[1] / SHADES);
    for n in 0..whole(SHADES) {
        let (y, fill) = (number(AT[1] + MAP[1] - height * count(n + 1)), color((count(n) + 0.5) / SHADES));
        // Neighbours overlap, so that no line shows between them.
        write(
            body,
            format_args!(
                "<rect x=\"{x}\" y=\"{y}\" width=\"18\" height=\"{}\" fill=\"{fill}\"/>",
                number(height + OVERLAP)
            ),
        );
    }
    for (value, label) in AxisScale::Linear.ticks(range, 6) {
        let y = number(AT[1] + MAP[1] * (range[1] - value) / (range[1] - range[0]));
        write(body, format_args!("<text x=\"{}\" y=\"{y}\" dy=\".35em\">{label}</text>", x + 24.0));
    }
}

/// Side of a cell of a matrix, and the space for the names \[pixels\].
const CELL: usize = 52;
const NAMES: usize = 46;

/// Draws a correlation matrix with its values: blue above 0, orange below, more opaque the larger the magnitude, so that the
/// text is legible on a light and on a dark background.
pub(crate) fn correlation(names: &[String], values: &[Vec<f64>]) -> String {
    let side = NAMES + CELL * names.len() + 2;
    let mut svg = String::new();
    let at = |n: usize| NAMES + CELL * n;
    for (row, values) in values.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            let color = if *value > 0.0 { "c1" } else { "c2" };
            let opacity = if value.is_finite() { 0.55 * value.abs().min(1.0) } else { 0.0 };
            let (x, y, size) = (at(column) + 1, at(row) + 1, CELL - 2);
            svg += &format!(
                "<rect x=\"{x}\" y=\"{y}\" width=\"{size}\" height=\"{size}\" rx=\"3\" class=\"{color}\" fill=\"currentColor\" fill-opacity=\"{opacity:.2}\"/>"
            );
        }
    }
    let mut text = |x: usize, y: usize, text: &str, anchor: &str| {
        let text = html! { (text) }.into_string();
        write(&mut svg, format_args!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>"));
    };
    for (n, name) in names.iter().enumerate() {
        text(at(n) + CELL / 2, NAMES - 10, name, "middle");
        text(NAMES - 8, at(n) + CELL / 2 + 5, name, "end");
    }
    for (row, values) in values.iter().enumerate() {
        for (column, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            text(
                at(column) + CELL / 2,
                at(row) + CELL / 2 + 5,
                &decimals(*value, 2).replace('-', "\u{2212}"),
                "middle",
            );
        }
    }
    document([side, side].map(count), &svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(values: Vec<Vec<f64>>) -> Map<'static> {
        let ranges = [[0.0, 4.0], [0.0, 2.0]];
        Map { title: "a < b", labels: ["x [s]", "y [1]"], ranges, values, mark: [1.0, 0.5], curve: Vec::new() }
    }

    #[test]
    fn colours_go_from_the_first_to_the_last() {
        assert_eq!([color(0.0), color(0.5), color(1.0), color(7.0)], ["#440154", "#21918c", "#fde725", "#fde725"]);
    }

    #[test]
    fn cells_are_where_their_values_are_and_equal_neighbours_are_merged() {
        let svg = heat_map(&map(vec![vec![0.0, 0.0, 1.0, 1.0], vec![f64::NAN, 1.0, 1.0, 0.0]])).svg;
        let cells: Vec<&str> = svg
            .split("height=\"460\">")
            .last()
            .unwrap()
            .split("<path")
            .next()
            .unwrap()
            .split("<rect")
            .skip(1)
            .collect();
        let (low, high) = (color(0.5 / SHADES), color(1.0 - 0.5 / SHADES));
        let cell = |x: f64, y: f64, width: f64, fill: &str| {
            let (y, width) = (y - OVERLAP, width + OVERLAP);
            format!(" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"230.5\" fill=\"{fill}\"/>")
        };
        // The first row is at the bottom.
        let expected = [
            cell(0.0, 230.0, 300.0, &low),
            cell(300.0, 230.0, 300.0, &high),
            cell(150.0, 0.0, 300.0, &high),
            cell(450.0, 0.0, 150.0, &low),
        ];
        assert_eq!(cells, expected);
        assert!(svg.contains("a &lt; b") && svg.contains("cx=\"150\" cy=\"345\""), "{svg}");
    }

    #[test]
    fn what_cannot_be_drawn_is_a_text() {
        for values in [vec![], vec![vec![]], vec![vec![1.0], vec![1.0, 2.0]]] {
            assert!(heat_map(&map(values)).svg.contains("no data"));
        }
        assert!(heat_map(&Map { ranges: [[0.0, 0.0]; 2], ..map(vec![vec![1.0]]) }).svg.contains("no data"));
    }
}
