//! Heat maps of a quantity over two axes.

use super::{COLORS, DRAWN_MAX, nothing, svg};
use crate::text::decimals;
use kuva::plot::line::LinePlot;
use kuva::plot::scatter::ScatterPlot;
use kuva::plot::{ColorMap, Heatmap};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;

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

/// Draws a heat map with its mark and curve. The drawing is a text if there are no values, rows differ in length, or a
/// range is empty.
#[must_use]
pub fn heat_map(map: Map<'_>) -> String {
    let [[x0, x1], [y0, y1]] = map.ranges;
    let width = map.values.first().map_or(0, Vec::len);
    let is_range = |[low, high]: &[f64; 2]| {
        let size = low.abs().max(high.abs());
        size <= DRAWN_MAX && high - low > 1e-12 * size && high - low > 1.0 / DRAWN_MAX
    };
    if width == 0 || map.values.iter().any(|row| row.len() != width) || !map.ranges.iter().all(is_range) {
        return nothing(map.title);
    }
    let values = map.values.iter().map(|row| row.iter().map(|v| v.clamp(-DRAWN_MAX, DRAWN_MAX)).collect::<Vec<_>>());
    let heat = Heatmap::new()
        .with_data(values)
        .with_color_map(ColorMap::Viridis)
        .with_x_range(x0, x1)
        .with_y_range(y0, y1)
        .with_cell_size(1.0);
    let inside = |(x, y): &(f64, f64)| (x0..=x1).contains(x) && (y0..=y1).contains(y);
    let mut plots = vec![Plot::Heatmap(heat)];
    // The curve is clipped to the map; its parts are not joined where it leaves the map.
    for part in map.curve.split(|point| !inside(point)).filter(|part| part.len() > 1) {
        plots.push(Plot::Line(LinePlot::new().with_data(part.to_vec()).with_color("#ffffff").with_stroke_width(2.0)));
    }
    let mark = vec![(map.mark[0], map.mark[1])];
    if inside(&mark[0]) {
        plots.push(Plot::Scatter(ScatterPlot::new().with_data(mark).with_color("#ffffff")));
    }
    let layout = Layout::auto_from_plots(&plots)
        .with_title(map.title)
        .with_x_label(map.labels[0])
        .with_y_label(map.labels[1])
        .with_width(780.0)
        .with_height(600.0);
    svg(plots, layout)
}

/// Side of a cell of a matrix, and the space for the names \[pixels\].
const CELL: usize = 52;
const NAMES: usize = 46;

/// Draws a correlation matrix with its values: blue above 0, orange below, more opaque the larger the magnitude, so that the
/// text is legible on a light and on a dark background.
pub(in crate::report) fn correlation(names: &[String], values: &[Vec<f64>]) -> String {
    let side = NAMES + CELL * names.len() + 2;
    let mut svg = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{side}\" height=\"{side}\">");
    let at = |n: usize| NAMES + CELL * n;
    for (row, values) in values.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            let color = if *value > 0.0 { COLORS[1] } else { COLORS[2] };
            let opacity = if value.is_finite() { 0.55 * value.abs().min(1.0) } else { 0.0 };
            let (x, y, size) = (at(column) + 1, at(row) + 1, CELL - 2);
            svg += &format!(
                "<rect x=\"{x}\" y=\"{y}\" width=\"{size}\" height=\"{size}\" rx=\"3\" fill=\"{color}\" fill-opacity=\"{opacity:.2}\"/>"
            );
        }
    }
    let mut text = |x: usize, y: usize, text: &str, anchor: &str| {
        let text = maud::html! { (text) }.into_string();
        svg += &format!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" font-size=\"14\">{text}</text>"
        );
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
    svg + "</svg>"
}
