//! Heat maps of a quantity over two axes.

use super::{DRAWN_MAX, nothing, svg};
use kuva::plot::line::LinePlot;
use kuva::plot::scatter::ScatterPlot;
use kuva::plot::{ColorMap, Heatmap};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use std::sync::Arc;

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

/// Draws a correlation matrix with its values.
pub(in crate::report) fn correlation(names: &[String], values: Vec<Vec<f64>>) -> String {
    let all = || values.iter().flatten().copied().filter(|v| v.is_finite());
    let (low, high) = (all().fold(1.0, f64::min), all().fold(-1.0, f64::max));
    // Dark text is legible on these colours: blue above 0, orange below, white at 0.
    let shade = move |share: f64| {
        let value = (low + share * (high - low)).clamp(-1.0, 1.0);
        let full = if value > 0.0 { [86.0, 180.0, 233.0] } else { [240.0, 150.0, 80.0] };
        let [r, g, b] = full.map(|c: f64| (255.0 + (c - 255.0) * value.abs()).round());
        format!("rgb({r},{g},{b})")
    };
    let heat = Heatmap::new()
        .with_data(values)
        .with_labels(names.to_vec(), names.to_vec())
        .with_color_map(ColorMap::Custom(Arc::new(shade)))
        .with_values();
    let plots = vec![Plot::Heatmap(heat)];
    let layout = Layout::auto_from_plots(&plots)
        .with_title("Correlation of the estimates [1]")
        .with_x_categories(names.to_vec())
        .with_y_categories(names.to_vec())
        .with_width(520.0)
        .with_height(440.0);
    svg(plots, layout)
}
