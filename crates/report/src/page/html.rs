//! Rendering of a page.

use super::parts::{Card, Item, Page, Part, Section, Trust};
use crate::chart;
use crate::table::Table;
use base64::Engine as _;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use motorfit_core::text::printable;
use sha2::{Digest as _, Sha256};

/// Style of all pages; the curves have the style of the drawings in files.
const STYLE: &str = concat!(
    include_str!("page.css"),
    include_str!("../chart/curves.css"),
    "@media screen and (prefers-color-scheme: dark) {",
    include_str!("../chart/curves-dark.css"),
    "}"
);
/// Script of all pages.
const SCRIPT: &str = include_str!("page.js");
/// Number of sections from which a page has contents.
const CONTENTS: usize = 4;

impl Page {
    /// Renders the page as HTML, with its script if `has_script`. The content security policy allows this style and this script
    /// by their digests, and nothing else.
    #[must_use]
    pub fn html(&self, has_script: bool) -> String {
        let digest = |text: &str| base64::engine::general_purpose::STANDARD.encode(Sha256::digest(text));
        let script = if has_script { format!("script-src 'sha256-{}'; ", digest(SCRIPT)) } else { String::new() };
        let style = format!("style-src 'sha256-{}'", digest(STYLE));
        let policy = format!("default-src 'none'; {style}; {script}base-uri 'none'; form-action 'none'");
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(policy);
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content={ "motorfit " (env!("CARGO_PKG_VERSION")) };
                    title { (printable(&self.title)) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    main {
                        h1 { (printable(&self.title)) }
                        @if let Some(trust) = &self.trust { (self::trust(trust)) }
                        @if !self.cards.is_empty() { (cards(&self.cards)) }
                        @if !self.answer.is_empty() { p.answer { (printable(&self.answer)) } }
                        @if self.sections.len() >= CONTENTS { (contents(&self.sections)) }
                        @for (n, section) in self.sections.iter().enumerate() { (self::section(n, section)) }
                    }
                    footer { p { "Made by motorfit " (env!("CARGO_PKG_VERSION")) "." } }
                    @if has_script { script { (PreEscaped(SCRIPT)) } }
                }
            }
        };
        page.into_string()
    }
}

fn trust(trust: &Trust) -> Markup {
    html! { p class={ "trust " (trust.level) } { strong { "Trust: " (trust.level) } " " (printable(&trust.text)) } }
}

fn cards(cards: &[Card]) -> Markup {
    html! {
        ul.cards {
            @for card in cards {
                li {
                    span.what { b { (printable(&card.symbol)) } " " (printable(&card.name)) }
                    span.value { (printable(&card.value)) " " span.unit { (printable(&card.unit)) } }
                    @if !card.remark.is_empty() { span.remark { (printable(&card.remark)) } }
                }
            }
        }
    }
}

fn contents(sections: &[Section]) -> Markup {
    html! {
        nav aria-label="Contents" {
            ol {
                @for (n, section) in sections.iter().enumerate() {
                    li { a href={ "#section-" (n + 1) } { (printable(&section.heading)) } }
                }
            }
        }
    }
}

fn section(n: usize, section: &Section) -> Markup {
    let parts = html! { @for part in &section.parts { (self::part(part)) } };
    html! {
        section id={ "section-" (n + 1) } {
            @if section.is_folded {
                details { summary { h2 { (printable(&section.heading)) } } (parts) }
            } @else {
                h2 { (printable(&section.heading)) }
                (parts)
            }
        }
    }
}

/// Renders an element of a section.
pub(crate) fn part(part: &Part) -> Markup {
    match part {
        Part::Text(text) => html! { p { (printable(text)) } },
        Part::Warning(text) => html! { p.warning role="note" { strong { "Warning: " } (printable(text)) } },
        Part::Table(table) => self::table(table),
        Part::Figure(figure) => html! {
            figure id=(figure.id) {
                (PreEscaped(figure.scaled(if figure.map { "class=\"plot map\"" } else { "class=\"plot\"" })))
                figcaption { (printable(&figure.caption)) }
            }
        },
        Part::Chart(chart) => chart::html(chart),
        Part::List(list) => named_values(list),
        Part::Items(items) => html! { @for item in items { (self::item(item)) } },
        Part::Math { heading, equations } => html! {
            div.math {
                h3 { (printable(heading)) }
                @for equation in equations { (PreEscaped(equation)) }
            }
        },
        Part::Typed(text) => html! { pre { code { (printable(text)) } } },
    }
}

fn named_values(list: &[(String, String)]) -> Markup {
    html! { dl { @for (name, value) in list { dt { (printable(name)) } dd { (printable(value)) } } } }
}

fn item(item: &Item) -> Markup {
    html! {
        div.item.grave[item.grave] role="note" {
            p { strong { (printable(&item.name)) } " " (printable(&item.text)) }
            (named_values(&item.details))
        }
    }
}

/// Returns true if a column of a table has words rather than numbers.
fn is_words(table: &Table, column: usize) -> bool {
    let number = |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || "+-−±–∞<>≤≥".contains(c));
    let cells = || table.rows.iter().filter_map(|row| row.get(column)).filter(|cell| !cell.is_empty());
    cells().count() > 0 && !cells().any(number)
}

fn table(table: &Table) -> Markup {
    let words: Vec<bool> = (0..table.heads.len()).map(|column| is_words(table, column)).collect();
    html! {
        div.table tabindex="0" role="region" aria-label=(printable(&table.title)) {
            table {
                caption { (printable(&table.title)) }
                thead {
                    tr {
                        @for (head, words) in table.heads.iter().zip(&words) {
                            th.words[*words] scope="col" { (printable(head)) }
                        }
                    }
                }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (n, cell) in row.iter().enumerate() {
                                @if n == 0 {
                                    th scope="row" { (printable(cell)) }
                                } @else {
                                    td.words[words.get(n) == Some(&true)] { (printable(cell)) }
                                }
                            }
                        }
                    }
                }
            }
        }
        @for note in &table.notes { p.note { (printable(note)) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Figure;

    #[test]
    fn text_is_escaped_and_the_policy_matches_the_style() {
        let evil = "<script>alert(1)</script>\u{1b}[2J\u{202e}\"'&";
        let mut table = Table::new("t", evil, &[evil]);
        table.row(vec![evil.to_owned()]);
        table.note(evil);
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"10\" height=\"20\"><g id=\"g\"/></svg>";
        let (id, alternative, caption) = ("f".to_owned(), evil.to_owned(), evil.to_owned());
        let figure = Figure { id, svg: svg.to_owned(), alternative, caption, map: false };
        let parts = vec![
            Part::Text(evil.to_owned()),
            Part::Warning(evil.to_owned()),
            Part::Table(table),
            Part::Figure(figure),
            Part::List(vec![(evil.to_owned(), evil.to_owned())]),
            Part::Typed(evil.to_owned()),
        ];
        let sections = vec![Section { heading: evil.to_owned(), parts, is_folded: false }];
        let page = Page { title: evil.to_owned(), answer: evil.to_owned(), sections, ..Page::default() };
        let page = page.html(false);
        assert!(!page.contains("<script") && !page.contains('\u{1b}') && !page.contains('\u{202e}'), "{page}");
        assert!(page.contains("&lt;script&gt;"));
        assert!(page.contains("viewBox=\"0 0 10 20\"") && page.contains("<g id=\"g\"/>"));
        // The digest in the policy is that of the text between the tags.
        let (_, rest) = page.split_once("<style>").unwrap();
        let (style, _) = rest.split_once("</style>").unwrap();
        let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(style));
        assert!(page.contains(&format!("'sha256-{digest}'")));
        assert!(!page.contains("http://") || page.matches("http://").count() == 1, "only the name of SVG");
    }
}
