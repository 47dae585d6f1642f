//! Parts of reports outside of pages: as HTML that follows the colours of a notebook, and as text for a terminal.

use super::chart::{LIGHT, scoped};
use super::page::{Part, part};
use super::table::folded;
use maud::{PreEscaped, html};

const STYLE: &str = include_str!("notebook.css");

/// Returns a chart as a drawing of a fixed size; other parts stay as they are.
fn drawing(one: &Part) -> Part {
    if let Part::Chart(chart) = one { Part::Figure(chart.figure()) } else { one.clone() }
}

/// Renders parts as an HTML fragment that is well-formed XML. Its text, lines and figures take the colour of the text around it,
/// so that they are legible in light and dark notebooks.
#[must_use]
pub fn html_fragment(parts: &[Part]) -> String {
    let fragment = html! {
        div.motorfit {
            style { (PreEscaped(scoped(LIGHT, ".motorfit .plot"))) (PreEscaped(STYLE)) }
            @for one in parts { (part(&drawing(one))) }
        }
    };
    fragment.into_string()
}

/// Formats texts, warnings and tables for a terminal of `width` characters. Parts of other kinds are left out.
#[must_use]
pub fn plain_text(parts: &[Part], width: usize) -> String {
    let one = |part: &Part| match part {
        Part::Text(text) => Some(folded(text, width)),
        Part::Warning(text) => Some(folded(&format!("Warning: {text}"), width)),
        Part::Table(table) => Some(table.text(width)),
        Part::Figure(_) | Part::Chart(_) | Part::List(_) | Part::Typed(_) | Part::Items(_) | Part::Math { .. } => None,
    };
    parts.iter().filter_map(one).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Table;

    #[test]
    fn text_is_escaped_in_html_and_printable_in_text() {
        let evil = "<script>\u{1b}[2J&";
        let mut table = Table::new("t", evil, &[evil, "b"]);
        table.row([evil.to_owned(), "1".to_owned()]);
        let parts = [Part::Text(evil.to_owned()), Part::Warning(evil.to_owned()), Part::Table(table)];
        let (html, text) = (html_fragment(&parts), plain_text(&parts, 40));
        assert!(!html.contains("<script") && html.contains("&lt;script&gt;") && html.starts_with("<div"), "{html}");
        for shown in [&html, &text] {
            assert!(!shown.contains('\u{1b}'), "{shown}");
        }
        assert!(text.contains("Warning: <script>"), "{text}");
    }

    #[test]
    fn the_style_is_scoped_and_sets_no_page_colours() {
        let style = scoped(LIGHT, ".motorfit .plot") + STYLE;
        let rules = style.split('}').filter(|rule| !rule.trim().is_empty());
        for selector in rules.flat_map(|rule| rule.split('{').next().unwrap_or_default().split(',')) {
            assert!(selector.trim().starts_with(".motorfit"), "{selector}");
        }
        assert!(!style.contains("prefers-color-scheme") && style.contains("currentColor"));
    }
}
