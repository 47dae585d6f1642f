//! Plots as SVG, with units on every axis, colours that are distinguishable with colour vision deficiency, and dashes
//! for print in grey. Only this module uses the plotting library.

mod heat;
mod histogram;
mod rows;
mod themed;

pub(super) use heat::correlation;
pub use heat::{Map, heat_map};
pub(super) use histogram::{Histogram, histograms};
pub(super) use rows::box_rows;
pub use themed::themed;

use kuva::backend::svg::SvgBackend;
use kuva::plot::BoxPlot;
use kuva::plot::line::LinePlot;
use kuva::render::figure::Figure;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::render_multiple;
use maud::html;

/// Palette by Okabe and Ito (2008) without the yellow, which has too little contrast on white.
const COLORS: [&str; 7] = ["#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"];
/// Largest number of points of a line; more are not visible.
const POINTS: usize = 1600;

/// Largest magnitude that is drawn, and the inverse of the smallest on a logarithmic axis. Beyond it the plotting
/// library would not stop to place ticks.
const DRAWN_MAX: f64 = 1e300;

/// A curve of a chart.
#[derive(Debug, Clone, Default)]
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// Points `(x, y)`.
    pub points: Vec<(f64, f64)>,
    /// Lower and upper limit of a band around the curve at each point.
    pub band: Option<(Vec<f64>, Vec<f64>)>,
    /// True if the curve is a step function.
    pub steps: bool,
}

/// Curves over two axes.
#[derive(Debug, Clone, Default)]
pub(in crate::report) struct Chart {
    /// Title.
    pub title: String,
    /// Labels of the axes, with units.
    pub labels: [String; 2],
    /// True for each axis that is logarithmic.
    pub log: [bool; 2],
    /// Curves.
    pub lines: Vec<Line>,
}

impl Chart {
    /// Creates a chart without curves.
    pub(in crate::report) fn new(title: impl Into<String>, labels: [&str; 2]) -> Self {
        Self { title: title.into(), labels: labels.map(str::to_owned), ..Self::default() }
    }

    /// Returns the chart with logarithmic axes where `log` is true.
    pub(in crate::report) fn log(self, log: [bool; 2]) -> Self {
        Self { log, ..self }
    }

    fn plots(&self, with_legend: bool) -> Vec<Plot> {
        let line = |(n, line): (usize, &Line)| plot(n, line, self.log, with_legend);
        self.lines.iter().enumerate().filter_map(line).collect()
    }

    fn layout(&self, plots: &[Plot]) -> Layout {
        let mut layout = Layout::auto_from_plots(plots)
            .with_title(self.title.clone())
            .with_x_label(self.labels[0].clone())
            .with_y_label(self.labels[1].clone());
        if self.log[0] {
            layout = layout.with_log_x();
        }
        if self.log[1] {
            layout = layout.with_log_y();
        }
        layout
    }
}

/// Returns curve `n` in its colour and dashes; `None` without points that can be drawn.
fn plot(n: usize, line: &Line, log: [bool; 2], with_legend: bool) -> Option<Plot> {
    let shown = |v: f64, axis: usize| v.abs() <= DRAWN_MAX && (!log[axis] || v >= 1.0 / DRAWN_MAX);
    let kept: Vec<usize> = (0..line.points.len())
        .filter(|&k| shown(line.points[k].0, 0) && shown(line.points[k].1, 1))
        .filter(|&k| {
            line.band
                .as_ref()
                .is_none_or(|(low, high)| [low, high].into_iter().all(|side| side.get(k).is_some_and(|v| shown(*v, 1))))
        })
        .collect();
    let kept = thinned(&kept, &line.points);
    if kept.is_empty() {
        return None;
    }
    let mut plot = LinePlot::new()
        .with_data(kept.iter().map(|&k| line.points[k]).collect::<Vec<_>>())
        .with_color(COLORS[n % COLORS.len()])
        .with_stroke_width(2.0);
    if let Some((low, high)) = &line.band {
        let side = |values: &[f64]| kept.iter().map(|&k| values[k]).collect::<Vec<_>>();
        plot = plot.with_band(side(low), side(high));
    }
    if with_legend {
        plot = plot.with_legend(line.name.clone());
    }
    if line.steps {
        plot = plot.with_step();
    }
    Some(Plot::Line(match n % 4 {
        0 => plot,
        1 => plot.with_dashed(),
        2 => plot.with_dashdot(),
        _ => plot.with_dotted(),
    }))
}

/// Reduces a long curve to the indices of the lowest and the highest point of each segment, which look the same.
fn thinned(kept: &[usize], points: &[(f64, f64)]) -> Vec<usize> {
    if kept.len() <= POINTS {
        return kept.to_vec();
    }
    let length = kept.len().div_ceil(POINTS / 2);
    let ends = |segment: &[usize]| {
        let of = |k: &&usize| points[**k].1;
        let low = segment.iter().min_by(|a, b| of(a).total_cmp(&of(b))).copied();
        let high = segment.iter().max_by(|a, b| of(a).total_cmp(&of(b))).copied();
        let mut ends: Vec<usize> = low.into_iter().chain(high).collect();
        ends.sort_unstable();
        ends.dedup();
        ends
    };
    kept.chunks(length).flat_map(ends).collect()
}

/// Draws one chart.
pub(in crate::report) fn chart(chart: &Chart) -> String {
    let plots = chart.plots(true);
    if plots.is_empty() {
        return nothing(&chart.title);
    }
    let layout = chart.layout(&plots).with_width(1000.0).with_height(560.0);
    svg(plots, layout)
}

/// Draws curves over two logarithmic axes.
#[must_use]
pub fn log_log(title: &str, labels: [&str; 2], lines: Vec<Line>) -> String {
    chart(&Chart { lines, ..Chart::new(title, labels).log([true; 2]) })
}

/// Draws charts in a grid with the given number of columns and a common legend.
pub(in crate::report) fn panels(charts: &[Chart], columns: usize, [width, height]: [f64; 2]) -> String {
    let charts: Vec<&Chart> = charts.iter().filter(|chart| !chart.plots(false).is_empty()).collect();
    if charts.is_empty() {
        return nothing("");
    }
    // The legend is that of the first chart with the most curves.
    let most = charts.iter().map(|chart| chart.plots(false).len()).max().unwrap_or(0);
    let named = charts.iter().position(|chart| chart.plots(false).len() == most).unwrap_or(0);
    // Charts with a single curve need no legend beside their titles and axes.
    let legend = most > 1;
    let plots: Vec<Vec<Plot>> = charts.iter().enumerate().map(|(n, chart)| chart.plots(legend && n == named)).collect();
    let layouts = charts.iter().zip(&plots).map(|(chart, plots)| small(chart.layout(plots))).collect();
    let figure = grid(plots, layouts, columns, [width, height]);
    let figure = if legend { figure.with_shared_legend_bottom() } else { figure };
    SvgBackend::default().render_scene(&figure.render())
}

/// Arranges panels in a grid with the given number of columns.
fn grid(plots: Vec<Vec<Plot>>, layouts: Vec<Layout>, columns: usize, [width, height]: [f64; 2]) -> Figure {
    let figure = Figure::new(plots.len().div_ceil(columns), columns);
    figure.with_plots(plots).with_layouts(layouts).with_cell_size(width, height)
}

/// Sets font sizes that remain legible if a panel is narrower than the page.
fn small(layout: Layout) -> Layout {
    layout.with_title_size(19).with_label_size(17).with_tick_size(15)
}

/// Named groups of values, a box each.
pub(in crate::report) type Groups = Vec<(String, Vec<f64>)>;

/// Draws box plots (quartiles, Tukey's whiskers) of groups of values, in panels side by side.
pub(in crate::report) fn boxes(panels: Vec<(&str, Groups)>, label: &str) -> String {
    let (mut plots, mut layouts) = (Vec::new(), Vec::new());
    for (title, groups) in panels {
        let finite = groups.into_iter().map(|(name, mut values)| {
            values.retain(|v| v.is_finite());
            (name, values)
        });
        let groups: Groups = finite.filter(|(_, values)| !values.is_empty()).collect();
        if !groups.is_empty() {
            let plot = grouped(groups).with_color(COLORS[5]).with_width(0.6);
            let panel = vec![Plot::Box(plot)];
            let layout = Layout::auto_from_plots(&panel).with_title(title);
            layouts.push(small(if plots.is_empty() { layout.with_y_label(label) } else { layout }));
            plots.push(panel);
        }
    }
    if plots.is_empty() {
        return nothing(label);
    }
    let columns = plots.len();
    SvgBackend::default().render_scene(&grid(plots, layouts, columns, [230.0, 360.0]).render())
}

fn grouped(groups: Groups) -> BoxPlot {
    groups.into_iter().fold(BoxPlot::new(), |plot, (name, values)| plot.with_group(name, values))
}

/// Returns a drawing with the text that there is no data.
fn nothing(title: &str) -> String {
    let text = format!("{title}: no data");
    let text = html! { (text.trim_start_matches(": ")) }.into_string();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"600\" height=\"60\"><text x=\"10\" y=\"35\" \
         font-family=\"sans-serif\" font-size=\"16\">{text}</text></svg>"
    )
}

fn svg(plots: Vec<Plot>, layout: Layout) -> String {
    SvgBackend::default().render_scene(&render_multiple(plots, layout))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_keep_their_ends() {
        let points: Vec<(f64, f64)> =
            (0..100_000).map(|n| (f64::from(n), if n == 51_234 { 9.0 } else { 0.0 })).collect();
        let kept = thinned(&(0..points.len()).collect::<Vec<_>>(), &points);
        assert!(kept.len() <= POINTS && kept.contains(&51_234), "{}", kept.len());
        assert!(kept.is_sorted());
    }

    #[test]
    fn points_that_cannot_be_drawn_are_left_out() {
        let line = |points: Vec<(f64, f64)>| Line { name: "<b>&".to_owned(), points, ..Line::default() };
        let mut chart = Chart::new("a < b", ["x [s]", "y [1]"]).log([false, true]);
        chart.lines = vec![line(vec![(0.0, f64::NAN), (1.0, 0.0), (2.0, 1.0), (3.0, f64::INFINITY), (4.0, 2.0)])];
        let svg = self::chart(&chart);
        assert!(svg.contains("a &lt; b") && svg.contains("&lt;b&gt;&amp;") && !svg.contains("NaN"), "{svg}");
        assert!(svg.contains("x [s]") && svg.contains("y [1]"));
        chart.lines.clear();
        assert!(self::chart(&chart).starts_with("<svg"), "an empty chart is one too");
    }
}
