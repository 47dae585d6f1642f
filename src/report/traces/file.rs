//! Panels as an SVG file of a fixed size, with its own style.

use super::drawing::{axes, curves, key, mark_labels};
use super::path::{Frame, write};
use super::{Panel, Traces};
use crate::numeric::count;
use crate::text::printable;
use maud::html;

/// Style of the curves, which pages use too.
const CURVES: &str = include_str!("curves.css");
/// Style of the text in a file.
const TEXT: &str = include_str!("file.css");

/// Width of a drawing, and the space to the left and to the right of its panels \[pixels\].
const WIDTH: f64 = 960.0;
const SIDES: [f64; 2] = [72.0, 18.0];
/// Height of a panel in one column, and that of its heading \[pixels\].
const HEIGHT: f64 = 150.0;
const HEADING: f64 = 30.0;
/// Space for the labels below a panel with an axis \[pixels\].
const AXIS: f64 = 46.0;

/// Draws groups of panels, one below the other, as an SVG file that is legible on a light and on a dark background. The legend
/// is that of the first group.
pub(in crate::report) fn svg(groups: &[Traces]) -> String {
    let mut body = String::new();
    let mut height = groups.first().map_or(4.0, |traces| legend(traces, &mut body));
    for traces in groups {
        height = group(traces, height, &mut body);
    }
    if groups.iter().all(|traces| traces.drawn().next().is_none()) {
        height += 60.0;
        write(&mut body, format_args!("<text x=\"20\" y=\"{}\">no data</text>", height - 25.0));
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\"><style>{CURVES}{TEXT}</style>\
         <rect class=\"page\" width=\"{WIDTH}\" height=\"{height}\"/>{body}</svg>"
    )
}

/// Draws a group of panels below `top` and returns the lower end.
fn group(traces: &Traces, top: f64, body: &mut String) -> f64 {
    let range = traces.range();
    let drawn: Vec<&Panel> = traces.drawn().collect();
    let columns = if traces.is_grid { drawn.len().clamp(1, 2) } else { 1 };
    let slot = WIDTH / count(columns);
    let width = slot - SIDES[0] - SIDES[1];
    let mut height = top;
    for (n, panel) in drawn.iter().enumerate() {
        let has_axis = traces.is_grid || n + 1 == drawn.len();
        let (left, at) = (slot * count(n % columns) + SIDES[0], height + HEADING);
        let label = html! { (printable(&panel.label)) }.into_string();
        write(body, format_args!("<text class=\"quantity\" x=\"{left}\" y=\"{}\">{label}</text>", at - 10.0));
        let ranges = [range, panel.ranges()[1]];
        let axes = axes(ranges, [if columns == 1 { 8 } else { 5 }, 6]) + &mark_labels(panel, range);
        let inner = curves(panel, &Frame { ranges, size: [width, HEIGHT] });
        let size = format!("width=\"{width}\" height=\"{HEIGHT}\"");
        let class = if has_axis { "trace" } else { "trace inner" };
        write(body, format_args!("<svg class=\"{class}\" x=\"{left}\" y=\"{at}\" {size} overflow=\"visible\">"));
        write(body, format_args!("{axes}<svg {size}>{inner}</svg></svg>"));
        if has_axis {
            let axis = html! { (printable(&traces.axis)) }.into_string();
            let (x, y) = (left + width / 2.0, at + HEIGHT + AXIS - 8.0);
            write(body, format_args!("<text class=\"axis\" x=\"{x}\" y=\"{y}\">{axis}</text>"));
        }
        if (n + 1) % columns == 0 || n + 1 == drawn.len() {
            height = at + HEIGHT + if has_axis { AXIS } else { 6.0 };
        }
    }
    height
}

/// Draws the legend in a row and returns its height.
fn legend(traces: &Traces, body: &mut String) -> f64 {
    let names = traces.legend();
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
