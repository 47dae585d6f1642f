//! Charts as SVG of a fixed size. Drawings have classes instead of colours; a file adds the style.

use super::drawing::{ROW, axes, curves, key, mark_labels};
use super::panels::{Chart, Panel};
use super::path::{Frame, write};
use maud::html;
use motorfit_core::numeric::count;
use motorfit_core::text::printable;

/// Style of drawings on a light background.
pub(crate) const LIGHT: &str = concat!(include_str!("curves.css"), include_str!("file.css"));
/// Changes of the style on a dark background.
pub(crate) const DARK: &str = concat!(include_str!("curves-dark.css"), include_str!("file-dark.css"));

/// Returns rules of a style sheet for elements inside those of a selector only. The rules are neither nested nor commented.
pub(crate) fn scoped(rules: &str, selector: &str) -> String {
    let one = |rule: &str| {
        let (selectors, body) = rule.split_once('{')?;
        let selectors: Vec<String> = selectors.split(',').map(|own| format!("{selector} {}", own.trim())).collect();
        Some(format!("{} {{{body}}}\n", selectors.join(", ")))
    };
    rules.split('}').filter_map(one).collect()
}

/// Width of a drawing, and the space to the left and to the right of its panels \[pixels\].
const WIDTH: f64 = 960.0;
const SIDES: [f64; 2] = [72.0, 18.0];
/// Height of a panel in one column, and that of its heading \[pixels\].
const HEIGHT: f64 = 150.0;
const HEADING: f64 = 30.0;
/// Space for the labels below a panel with an axis \[pixels\].
const AXIS: f64 = 46.0;

/// Draws charts, one below the other. The legend is that of the first.
pub(super) fn svg(charts: &[Chart]) -> String {
    let mut body = String::new();
    let mut height = charts.first().map_or(4.0, |chart| legend(chart, &mut body));
    for chart in charts {
        height = group(chart, height, &mut body);
    }
    if charts.iter().all(|chart| chart.drawn().next().is_none()) {
        height += 60.0;
        write(&mut body, format_args!("<text x=\"20\" y=\"{}\">no data</text>", height - 25.0));
    }
    document([WIDTH, height], &body)
}

/// Returns a drawing of a width and a height \[pixels\] on the background of the page.
pub(super) fn document([width, height]: [f64; 2], body: &str) -> String {
    let size = format!("width=\"{width}\" height=\"{height}\"");
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" {size}><rect class=\"page\" {size}/>{body}</svg>")
}

/// Draws the panels of a chart below `top` and returns the lower end.
fn group(chart: &Chart, top: f64, body: &mut String) -> f64 {
    let drawn: Vec<&Panel> = chart.drawn().collect();
    let columns = if chart.is_grid { drawn.len().clamp(1, 2) } else { 1 };
    let (slot, common) = (WIDTH / count(columns), chart.range());
    let mut height = top;
    for (row, panels) in drawn.chunks(columns).enumerate() {
        let is_last = (row + 1) * columns >= drawn.len();
        let mut end = height;
        for (column, panel) in panels.iter().enumerate() {
            let axis = panel.axis.as_ref().or_else(|| (chart.is_grid || is_last).then_some(&chart.axis));
            let [left, width] = [slot * count(column) + SIDES[0], slot - SIDES[0] - SIDES[1]];
            let [own, second] = panel.ranges();
            let ranges = [if panel.axis.is_some() { own } else { common }, second];
            let at = height + HEADING;
            let tall = panel.rows().map_or(HEIGHT, |rows| ROW * count(rows));
            one(panel, ranges, [left, at, width, tall], axis, body);
            end = end.max(at + tall + if axis.is_some() { AXIS } else { 6.0 });
        }
        height = end;
    }
    height
}

/// Draws a panel at a place and of a size `[x, y, width, height]`, with the label of its first axis.
pub(super) fn one(
    panel: &Panel,
    ranges: [[f64; 2]; 2],
    [left, at, width, height]: [f64; 4],
    axis: Option<&String>,
    body: &mut String,
) {
    let most = [if width > 500.0 { 8 } else { 5 }, 6];
    let label = html! { (printable(&panel.label)) }.into_string();
    write(body, format_args!("<text class=\"quantity\" x=\"{left}\" y=\"{}\">{label}</text>", at - 10.0));
    let axes = axes(panel, ranges, most) + &mark_labels(panel, ranges[0]);
    let inner = curves(panel, &Frame { scales: &panel.scales, ranges, size: [width, height] });
    let size = format!("width=\"{width}\" height=\"{height}\"");
    let class = if axis.is_some() { "trace" } else { "trace inner" };
    write(body, format_args!("<svg class=\"{class}\" x=\"{left}\" y=\"{at}\" {size} overflow=\"visible\">"));
    write(body, format_args!("{axes}<svg {size}>{inner}</svg></svg>"));
    if let Some(axis) = axis {
        let axis = html! { (printable(axis)) }.into_string();
        let (x, y) = (left + width / 2.0, at + height + AXIS - 8.0);
        write(body, format_args!("<text class=\"axis\" x=\"{x}\" y=\"{y}\">{axis}</text>"));
    }
}

/// Draws the legend in a row and returns its height.
fn legend(chart: &Chart, body: &mut String) -> f64 {
    let names = chart.legend();
    if names.len() < 2 {
        return 4.0;
    }
    let (mut x, mut y) = (SIDES[0], 14.0);
    for (name, color, form) in names {
        // Eight pixels a letter are enough for this size of text.
        let width = 44.0 + 8.0 * count(name.chars().count());
        if x > SIDES[0] && x + width > WIDTH {
            (x, y) = (SIDES[0], y + 20.0);
        }
        let text = html! { (printable(name)) }.into_string();
        write(
            body,
            format_args!("<svg x=\"{x}\" y=\"{}\" width=\"28\" height=\"12\">{}</svg>", y - 6.0, key(color, form)),
        );
        write(body, format_args!("<text x=\"{}\" y=\"{y}\" dy=\".35em\">{text}</text>", x + 34.0));
        x += width;
    }
    y + 8.0
}
