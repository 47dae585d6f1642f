//! Charts as parts of a page: the text keeps its size at every width, and the curves are stretched.

use super::panels::{Chart, Form, Mark, Panel};
use super::path::{Frame, number, write};
use super::scale::AxisScale;
use maud::{Markup, PreEscaped, html};
use motorfit_core::numeric::count;
use motorfit_core::text::printable;

/// Coordinates of the curves of a panel, which are stretched to its size.
const STRETCHED: [f64; 2] = [1000.0, 200.0];
/// Height of a row of a box with its name \[pixels\].
pub(super) const ROW: f64 = 46.0;

/// Returns the chart as a figure of a page.
pub(crate) fn html(chart: &Chart) -> Markup {
    let range = chart.range();
    let count = chart.drawn().count();
    html! {
        figure.traces.grid[chart.is_grid] id=(chart.id) {
            (legend(chart))
            div.panels {
                @for (n, panel) in chart.drawn().enumerate() {
                    @let axis = panel.axis.as_ref().or_else(|| (chart.is_grid || n + 1 == count).then_some(&chart.axis));
                    div.panel.last[axis.is_some()] {
                        p.quantity { (printable(&panel.label)) }
                        (PreEscaped(drawn(panel, range, chart)))
                        @if let Some(axis) = axis { p.axis { (printable(axis)) } }
                    }
                }
            }
            @if count == 0 { p.note { "No data." } }
            figcaption { (printable(&chart.caption)) }
        }
    }
}

fn legend(chart: &Chart) -> Markup {
    let names = chart.legend();
    html! {
        @if names.len() > 1 {
            ul.legend {
                @for (name, color, form) in names {
                    li data-name=(printable(name)) {
                        (PreEscaped(format!("<svg width=\"28\" height=\"12\" aria-hidden=\"true\">{}</svg>", key(color, form))))
                        (printable(name))
                    }
                }
            }
        }
    }
}

/// Draws the sample of a curve in a legend of 28 × 12 pixels.
pub(super) fn key(color: usize, form: Form) -> String {
    let path = match form {
        Form::Dots | Form::Marks => "M4 6h0M11 6h0M18 6h0M25 6h0",
        Form::Line | Form::Steps | Form::Stems => "M2 6h24",
        Form::Bars | Form::Box => "M2 1H26V11H2Z",
    };
    format!("<path class=\"{}\" d=\"{path}\"/>", class(color, form))
}

/// Returns the classes of a curve, on which its colour, width and dashes depend.
fn class(color: usize, form: Form) -> String {
    let form = match form {
        Form::Line | Form::Steps => "line",
        Form::Dots => "dots",
        Form::Marks => "marks",
        Form::Stems => "stems",
        Form::Bars => return format!("bars c{}", shade(color)),
        Form::Box => return format!("box c{}", shade(color)),
    };
    let repeated = if color > SHADES { " repeated" } else { "" };
    format!("curve {form} c{}{repeated}", shade(color))
}

/// Number of colours. Lines beyond them have other dashes.
const SHADES: usize = 7;

/// Returns the number of a colour in the style: 0, or 1 to 7 in turn.
fn shade(color: usize) -> usize {
    if color == 0 { 0 } else { (color - 1) % SHADES + 1 }
}

fn drawn(panel: &Panel, common: [f64; 2], chart: &Chart) -> String {
    let [own, second] = panel.ranges();
    let ranges = [if panel.axis.is_some() { own } else { common }, second];
    let [[x0, x1], [y0, y1]] = ranges;
    let name = html! { title { (printable(&panel.label)) ": " (printable(&chart.alternative)) } }.into_string();
    let mut svg = format!("<svg class=\"trace\" role=\"img\" data-x=\"{x0} {x1}\" data-y=\"{y0} {y1}\"");
    for (name, scale) in ["x", "y"].into_iter().zip(&panel.scales) {
        if *scale == AxisScale::Log {
            write(&mut svg, format_args!(" data-log-{name}=\"\""));
        }
    }
    if panel.axis.is_some() {
        svg += " data-own=\"\"";
    }
    if let Some(rows) = panel.rows() {
        write(&mut svg, format_args!(" data-rows=\"\" height=\"{}\"", ROW * count(rows)));
    }
    svg += &format!(
        ">{name}{}{}",
        axes(panel, ranges, [if chart.is_grid { 5 } else { 8 }, 6]),
        mark_labels(panel, ranges[0])
    );
    let [width, height] = STRETCHED;
    let sizes = format!("viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\" width=\"100%\" height=\"100%\"");
    let frame = Frame { scales: &panel.scales, ranges, size: STRETCHED };
    svg += &format!("<svg class=\"curves\" {sizes}>{}</svg></svg>", curves(panel, &frame));
    svg
}

/// Draws grid lines and labels of the axes, and the names of rows; positions are relative to the size of the panel.
pub(super) fn axes(panel: &Panel, [x, y]: [[f64; 2]; 2], most: [u32; 2]) -> String {
    let part = |value: f64, [low, high]: [f64; 2]| number(100.0 * (value - low) / (high - low));
    let (mut lines, mut labels) = (String::new(), String::new());
    for (value, label) in panel.scales[1].ticks(y, most[1]) {
        let at = number(100.0 - 100.0 * (value - y[0]) / (y[1] - y[0]));
        write(&mut lines, format_args!("<line x1=\"0\" x2=\"100%\" y1=\"{at}%\" y2=\"{at}%\"/>"));
        write(&mut labels, format_args!("<text class=\"y\" x=\"-8\" y=\"{at}%\" dy=\".35em\">{label}</text>"));
    }
    for (value, label) in panel.scales[0].ticks(x, most[0]) {
        let at = part(value, x);
        write(&mut lines, format_args!("<line x1=\"{at}%\" x2=\"{at}%\" y1=\"0\" y2=\"100%\"/>"));
        write(&mut labels, format_args!("<text class=\"x\" x=\"{at}%\" y=\"100%\" dy=\"1.35em\">{label}</text>"));
    }
    let mut names = String::new();
    if let AxisScale::Rows(rows) = &panel.scales[1] {
        for (n, name) in rows.iter().enumerate() {
            let (at, name) = (number(100.0 * count(n) / count(rows.len())), html! { (printable(name)) }.into_string());
            write(&mut names, format_args!("<text class=\"row\" x=\"6\" y=\"{at}%\" dy=\"1.25em\">{name}</text>"));
        }
    }
    format!("<g class=\"lines\">{lines}</g><g class=\"ticks\">{labels}</g>{names}")
}

/// Draws the labels of the marks above a panel; positions are relative to its size.
pub(super) fn mark_labels(panel: &Panel, [from, to]: [f64; 2]) -> String {
    let mut svg = String::new();
    for Mark { range, label } in panel.marks.iter().filter(|mark| !mark.label.is_empty()) {
        let (middle, label) = (0.5 * (range[0] + range[1]), html! { (printable(label)) }.into_string());
        let middle = panel.scales[0].place(middle);
        let at = 100.0 * (middle - from) / (to - from);
        if !at.is_finite() {
            continue;
        }
        let at = number(at);
        write(&mut svg, format_args!("<text class=\"mark\" data-at=\"{middle}\" x=\"{at}%\" y=\"13\">{label}</text>"));
    }
    svg
}

/// Draws the marks, bands, curves and limits of a panel.
pub(super) fn curves(panel: &Panel, frame: &Frame) -> String {
    let mut svg = String::new();
    for Mark { range, .. } in &panel.marks {
        let [from, to] = range.map(|x| frame.x(x));
        if !(from.is_finite() && to.is_finite()) {
            continue;
        }
        let wide = (to - from).max(0.003 * frame.size[0]);
        let (x, width, height) = (number(0.5 * (from + to - wide)), number(wide), frame.size[1]);
        write(&mut svg, format_args!("<rect class=\"mark\" x=\"{x}\" y=\"0\" width=\"{width}\" height=\"{height}\"/>"));
    }
    for series in &panel.series {
        let name = html! { (printable(&series.name)) }.into_string();
        let mut add = |class: &str, path: String| {
            if !path.is_empty() {
                write(&mut svg, format_args!("<path class=\"{class}\" data-name=\"{name}\" d=\"{path}\"/>"));
            }
        };
        add(&format!("band c{}", shade(series.color)), frame.band(series));
        add(&class(series.color, series.form), frame.path(series));
    }
    let [width, height] = frame.size;
    for x in panel.limits[0].iter().map(|limit| frame.x(*limit)).filter(|x| x.is_finite()) {
        write(&mut svg, format_args!("<path class=\"limit\" d=\"M{} 0V{height}\"/>", number(x)));
    }
    for y in panel.limits[1].iter().map(|limit| frame.y(*limit)).filter(|y| y.is_finite()) {
        write(&mut svg, format_args!("<path class=\"limit\" d=\"M0 {}H{width}\"/>", number(y)));
    }
    svg
}
