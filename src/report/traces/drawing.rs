//! Panels as parts of a page: the text keeps its size at every width, and the curves are stretched.

use super::path::{Frame, number, write};
use super::ticks::ticks;
use super::{Form, Mark, Panel, Trace, Traces};
use crate::text::printable;
use maud::{Markup, PreEscaped, html};

/// Coordinates of the curves of a panel, which are stretched to its size.
const STRETCHED: [f64; 2] = [1000.0, 200.0];

/// Returns the panels as a figure of a page.
pub(in crate::report) fn figure(traces: &Traces) -> Markup {
    let range = traces.range();
    let count = traces.drawn().count();
    html! {
        figure.traces.grid[traces.is_grid] id=(traces.id) {
            (legend(traces))
            div.panels {
                @for (n, panel) in traces.drawn().enumerate() {
                    @let shows_axis = traces.is_grid || n + 1 == count;
                    div.panel.last[shows_axis] {
                        p.quantity { (printable(&panel.label)) }
                        (PreEscaped(drawn(panel, range, &traces.alternative)))
                        @if shows_axis { p.axis { (printable(&traces.axis)) } }
                    }
                }
            }
            @if count == 0 { p.note { "No data." } }
            figcaption { (printable(&traces.caption)) }
        }
    }
}

fn legend(traces: &Traces) -> Markup {
    let names = traces.legend();
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
        Form::Dots => "M4 6h0M11 6h0M18 6h0M25 6h0",
        Form::Line | Form::Steps | Form::Stems => "M2 6h24",
    };
    format!("<path class=\"{}\" d=\"{path}\"/>", class(color, form))
}

/// Returns the classes of a curve, on which its colour, width and dashes depend.
fn class(color: usize, form: Form) -> String {
    let form = match form {
        Form::Line | Form::Steps => "line",
        Form::Dots => "dots",
        Form::Stems => "stems",
    };
    format!("curve {form} c{}", shade(color))
}

/// Returns the number of a colour in the style: 0, or 1 to 7 in turn.
fn shade(color: usize) -> usize {
    if color == 0 { 0 } else { (color - 1) % 7 + 1 }
}

fn drawn(panel: &Panel, range: [f64; 2], alternative: &str) -> String {
    let ranges = [range, panel.ranges()[1]];
    let [[x0, x1], [y0, y1]] = ranges;
    let name = html! { title { (printable(&panel.label)) ": " (printable(alternative)) } }.into_string();
    let mut svg = format!("<svg class=\"trace\" role=\"img\" data-x=\"{x0} {x1}\" data-y=\"{y0} {y1}\">{name}");
    svg += &axes(ranges, [8, 6]);
    svg += &mark_labels(panel, range);
    let [width, height] = STRETCHED;
    let sizes = format!("viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\" width=\"100%\" height=\"100%\"");
    svg += &format!("<svg class=\"curves\" {sizes}>{}</svg></svg>", curves(panel, &Frame { ranges, size: STRETCHED }));
    svg
}

/// Draws grid lines and labels of the axes; positions are relative to the size of the panel.
pub(super) fn axes([x, y]: [[f64; 2]; 2], most: [u32; 2]) -> String {
    let part = |value: f64, [low, high]: [f64; 2]| number(100.0 * (value - low) / (high - low));
    let (mut lines, mut labels) = (String::new(), String::new());
    for (value, label) in ticks(y, most[1]) {
        let at = number(100.0 - 100.0 * (value - y[0]) / (y[1] - y[0]));
        write(&mut lines, format_args!("<line x1=\"0\" x2=\"100%\" y1=\"{at}%\" y2=\"{at}%\"/>"));
        write(&mut labels, format_args!("<text class=\"y\" x=\"-8\" y=\"{at}%\" dy=\".35em\">{label}</text>"));
    }
    for (value, label) in ticks(x, most[0]) {
        let at = part(value, x);
        write(&mut lines, format_args!("<line x1=\"{at}%\" x2=\"{at}%\" y1=\"0\" y2=\"100%\"/>"));
        write(&mut labels, format_args!("<text class=\"x\" x=\"{at}%\" y=\"100%\" dy=\"1.35em\">{label}</text>"));
    }
    format!("<g class=\"lines\">{lines}</g><g class=\"ticks\">{labels}</g>")
}

/// Draws the labels of the marks above a panel; positions are relative to its size.
pub(super) fn mark_labels(panel: &Panel, [from, to]: [f64; 2]) -> String {
    let mut svg = String::new();
    for Mark { range, label } in panel.marks.iter().filter(|mark| !mark.label.is_empty()) {
        let (middle, label) = (0.5 * (range[0] + range[1]), html! { (printable(label)) }.into_string());
        let at = number(100.0 * (middle - from) / (to - from));
        write(&mut svg, format_args!("<text class=\"mark\" data-at=\"{middle}\" x=\"{at}%\" y=\"13\">{label}</text>"));
    }
    svg
}

/// Draws the marks, bands, curves and limits of a panel.
pub(super) fn curves(panel: &Panel, frame: &Frame) -> String {
    let mut svg = String::new();
    for Mark { range, .. } in &panel.marks {
        let [from, to] = range.map(|x| frame.x(x));
        let wide = (to - from).max(0.003 * frame.size[0]);
        let (x, width, height) = (number(0.5 * (from + to - wide)), number(wide), frame.size[1]);
        write(&mut svg, format_args!("<rect class=\"mark\" x=\"{x}\" y=\"0\" width=\"{width}\" height=\"{height}\"/>"));
    }
    for trace in &panel.traces {
        let name = html! { (printable(&trace.name)) }.into_string();
        let mut add = |class: &str, path: String| {
            if !path.is_empty() {
                write(&mut svg, format_args!("<path class=\"{class}\" data-name=\"{name}\" d=\"{path}\"/>"));
            }
        };
        add(&format!("band c{}", shade(trace.color)), frame.band(trace));
        add(&class(trace.color, trace.form), frame.path(trace));
    }
    for limit in panel.bound.into_iter().flat_map(|bound| [-bound, bound]) {
        let ends = frame.ranges[0].map(|x| (x, limit)).to_vec();
        let path = frame.path(&Trace::new("", 0, Form::Line, ends));
        write(&mut svg, format_args!("<path class=\"limit\" d=\"{path}\"/>"));
    }
    svg
}
