//! Drawings of a page, scaled to its width, and as files.

use crate::chart::{DARK, Figure, LIGHT, scoped};
use maud::html;
use motorfit_core::text::printable;

impl Figure {
    /// Returns the SVG without a style, scaled to the available width, up to its own, with its alternative text; `attributes` are
    /// added to the `svg` element.
    #[must_use]
    pub fn scaled(&self, attributes: &str) -> String {
        let Some((head, rest)) = self.svg.split_once('>') else { return String::new() };
        let size = |name: &str| {
            let (_, after) = head.split_once(&format!(" {name}=\""))?;
            after.split_once('"').map(|(value, _)| value.to_owned())
        };
        let (width, height) = (size("width").unwrap_or_default(), size("height").unwrap_or_default());
        let name = html! { title { (printable(&self.alternative)) } }.into_string();
        let head =
            head.replacen("<svg ", &format!("<svg {attributes} role=\"img\" viewBox=\"0 0 {width} {height}\" "), 1);
        format!("{head}>{name}{rest}")
    }

    /// Returns the SVG with its style, as a file that is legible on its own: in the reader's light or dark colour scheme, or in
    /// the light one if `is_light`.
    #[must_use]
    pub fn file(&self, attributes: &str, is_light: bool) -> String {
        let svg = self.scaled(&format!("class=\"motorfit-figure\" {attributes}"));
        let Some((head, rest)) = svg.split_once('>') else { return svg };
        // Rules of drawings inside of a document apply to all of it.
        let [light, dark] = [LIGHT, DARK].map(|rules| scoped(rules, ".motorfit-figure"));
        let dark =
            if is_light { String::new() } else { format!("@media screen and (prefers-color-scheme: dark) {{{dark}}}") };
        format!("{head}><style>{light}{dark}</style>{rest}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_style_and_a_page_does_not() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"10\" height=\"20\"><path/></svg>".to_owned();
        let (id, alternative, caption) = (String::new(), "<b>".to_owned(), String::new());
        let figure = Figure { id, svg, alternative, caption, map: false };
        let on_page = figure.scaled("class=\"plot\"");
        assert!(on_page.starts_with("<svg class=\"plot\" role=\"img\" viewBox=\"0 0 10 20\" "), "{on_page}");
        assert!(on_page.contains("<title>&lt;b&gt;</title><path/>") && !on_page.contains("<style>"));
        assert!(figure.file("", false).contains("prefers-color-scheme"));
        assert!(figure.file("", true).contains("<style>") && !figure.file("", true).contains("prefers-color-scheme"));
    }
}
