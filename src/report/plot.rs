//! Plots as SVG: units on every axis, colours that the colour-blind tell apart, and dashes for print in grey. All that
//! knows the plotting library is here.

use kuva::backend::svg::SvgBackend;
use kuva::plot::line::LinePlot;
use kuva::plot::scatter::ScatterPlot;
use kuva::plot::{ColorMap, Heatmap};
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::render_multiple;

/// M. Okabe and K. Ito's colours, the yellow left out: it is lost on white.
const COLORS: [&str; 7] = ["#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"];

/// A line of a plot.
pub struct Line {
    /// Its name in the legend.
    pub name: String,
    /// Its points.
    pub points: Vec<(f64, f64)>,
}

/// Lines over logarithmic axes.
#[must_use]
pub fn log_log(title: &str, [x, y]: [&str; 2], lines: Vec<Line>) -> String {
    let line = |(n, line): (usize, Line)| {
        let plot = LinePlot::new()
            .with_data(line.points)
            .with_color(COLORS[n % COLORS.len()])
            .with_stroke_width(2.0)
            .with_legend(line.name);
        Plot::Line(match n % 4 {
            0 => plot,
            1 => plot.with_dashed(),
            2 => plot.with_dashdot(),
            _ => plot.with_dotted(),
        })
    };
    let plots: Vec<Plot> = lines.into_iter().enumerate().map(line).collect();
    let layout = Layout::auto_from_plots(&plots)
        .with_title(title)
        .with_x_label(x)
        .with_y_label(y)
        .with_log_scale()
        .with_width(1000.0)
        .with_height(560.0);
    svg(plots, layout)
}

/// A map of a quantity over two axes.
pub struct Map<'a> {
    /// What the colours show, with its unit.
    pub title: &'a str,
    /// The axes, with units.
    pub labels: [&'a str; 2],
    /// From where to where the axes go.
    pub ranges: [[f64; 2]; 2],
    /// Row by row, the second axis from its low end up.
    pub values: Vec<Vec<f64>>,
    /// A point that is marked.
    pub mark: [f64; 2],
    /// A closed curve, such as an ellipse of confidence.
    pub curve: Vec<(f64, f64)>,
}

/// A heat map with its mark and curve.
#[must_use]
pub fn heat_map(map: Map<'_>) -> String {
    let [[x0, x1], [y0, y1]] = map.ranges;
    let heat = Heatmap::new()
        .with_data(map.values)
        .with_color_map(ColorMap::Viridis)
        .with_x_range(x0, x1)
        .with_y_range(y0, y1)
        .with_cell_size(1.0);
    let inside = |(x, y): &(f64, f64)| (x0..=x1).contains(x) && (y0..=y1).contains(y);
    let curve: Vec<(f64, f64)> = map.curve.into_iter().filter(inside).collect();
    let mut plots = vec![Plot::Heatmap(heat)];
    if !curve.is_empty() {
        plots.push(Plot::Line(LinePlot::new().with_data(curve).with_color("#ffffff").with_stroke_width(2.0)));
    }
    let mark = vec![(map.mark[0], map.mark[1])];
    plots.push(Plot::Scatter(ScatterPlot::new().with_data(mark).with_color("#ffffff")));
    let layout = Layout::auto_from_plots(&plots)
        .with_title(map.title)
        .with_x_label(map.labels[0])
        .with_y_label(map.labels[1])
        .with_width(780.0)
        .with_height(600.0);
    svg(plots, layout)
}

fn svg(plots: Vec<Plot>, layout: Layout) -> String {
    SvgBackend::default().render_scene(&render_multiple(plots, layout))
}
