//! Self-contained HTML pages: no scripts and no external resources, light and dark, for screen and print.

use super::Table;
use crate::text::{hexadecimal, printable};
use base64::Engine as _;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest as _, Sha256};

/// A figure of a page.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Identifier for files and links.
    pub id: String,
    /// Drawing from the `plot` module.
    pub svg: String,
    /// Alternative text for readers who cannot see the drawing.
    pub alternative: String,
    /// Caption.
    pub caption: String,
    /// True if the drawing is a map with text on its colours, which is shown small and on white, also in the dark
    /// scheme.
    pub map: bool,
}

/// Element of a section.
#[derive(Debug, Clone)]
pub enum Part {
    /// Paragraph.
    Text(String),
    /// Highlighted warning.
    Warning(String),
    /// Table.
    Table(Table),
    /// Figure.
    Figure(Figure),
    /// List of names and values.
    List(Vec<(String, String)>),
    /// Preformatted text, such as a command.
    Typed(String),
    /// List of findings.
    Items(Vec<Item>),
}

/// A finding.
#[derive(Debug, Clone)]
pub struct Item {
    /// Number and kind.
    pub name: String,
    /// True if the finding is highlighted.
    pub grave: bool,
    /// Description.
    pub text: String,
    /// Names and values, such as the location and the remedy.
    pub details: Vec<(String, String)>,
}

/// A section with a heading.
#[derive(Debug, Clone)]
pub struct Section {
    /// Heading.
    pub heading: String,
    /// Elements of the section.
    pub parts: Vec<Part>,
}

/// A page of a report.
#[derive(Debug, Clone)]
pub struct Page {
    /// Title.
    pub title: String,
    /// Result in one sentence.
    pub answer: String,
    /// Sections.
    pub sections: Vec<Section>,
}

const STYLE: &str = include_str!("page.css");

impl Page {
    /// Renders the page as HTML.
    #[must_use]
    pub fn html(&self) -> String {
        let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(STYLE));
        let policy = format!("default-src 'none'; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'");
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
                        p.answer { (printable(&self.answer)) }
                        @for section in &self.sections {
                            section {
                                h2 { (printable(&section.heading)) }
                                @for part in &section.parts { (self::part(part)) }
                            }
                        }
                    }
                    footer { p { "Made by motorfit " (env!("CARGO_PKG_VERSION")) "." } }
                }
            }
        };
        page.into_string()
    }
}

/// Returns a text with its first letter in upper case.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Renders an element of a section.
pub(super) fn part(part: &Part) -> Markup {
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
        Part::List(list) => named_values(list),
        Part::Items(items) => html! { @for item in items { (self::item(item)) } },
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

impl Figure {
    /// Returns the SVG scaled to the available width, up to its own, with its alternative text; `attributes` are added
    /// to the `svg` element.
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
        named(&format!("{head}>{name}{rest}"))
    }
}

/// Prefix of kuva's identifiers of clip paths, which is followed by a number that increases from drawing to drawing.
const CLIP: &str = "kuva-clip-";

/// Replaces the identifiers in a drawing by ones that depend on its content. Equal drawings are then equal texts, and
/// identifiers of different drawings on one page do not collide.
fn named(svg: &str) -> String {
    let mut known = Vec::new();
    let mut parts = svg.split(CLIP);
    let mut counted = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        let (number, rest) = part.split_at(end);
        let at = known.iter().position(|one| *one == number).unwrap_or(known.len());
        if at == known.len() {
            known.push(number);
        }
        counted += &format!("{CLIP}{at}{rest}");
    }
    let digest = hexadecimal(&Sha256::digest(&counted));
    counted.replace(CLIP, &format!("clip-{}-", &digest[..12]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_have_names_of_their_own() {
        let drawn = |first: u32, width: u32| {
            let (a, b) = (first, first + 1);
            named(&format!(
                "<svg><g id=\"kuva-clip-{a}\"/><g id=\"kuva-clip-{b}\" width=\"{width}\"/><p clip-path=\"url(#kuva-clip-{a})\"/></svg>"
            ))
        };
        // Identifiers do not depend on the running number, even if one number is a prefix of another.
        assert_eq!(drawn(0, 5), drawn(9, 5));
        let (here, other) = (drawn(0, 5), drawn(0, 6));
        let name = |svg: &str| svg.split('"').nth(1).unwrap().to_owned();
        assert_ne!(name(&here), name(&other));
        assert!(here.contains(&format!("url(#{})", name(&here))) && !here.contains("kuva"), "{here}");
        assert_eq!(named("<svg/>"), "<svg/>");
    }

    #[test]
    fn text_is_escaped_and_the_policy_matches_the_style() {
        let evil = "<script>alert(1)</script>\u{1b}[2J\u{202e}\"'&";
        let mut table = Table::new("t", evil, &[evil]);
        table.row(vec![evil.to_owned()]);
        table.note(evil);
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"10\" height=\"20\"><g id=\"kuva-clip-0\"/></svg>";
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
        let sections = vec![Section { heading: evil.to_owned(), parts }];
        let page = Page { title: evil.to_owned(), answer: evil.to_owned(), sections }.html();
        assert!(!page.contains("<script") && !page.contains('\u{1b}') && !page.contains('\u{202e}'), "{page}");
        assert!(page.contains("&lt;script&gt;"));
        assert!(page.contains("viewBox=\"0 0 10 20\"") && page.contains("<g id=\"clip-"));
        // The digest in the policy is that of the text between the tags.
        let (_, rest) = page.split_once("<style>").unwrap();
        let (style, _) = rest.split_once("</style>").unwrap();
        let digest = base64::engine::general_purpose::STANDARD.encode(Sha256::digest(style));
        assert!(page.contains(&format!("'sha256-{digest}'")));
        assert!(!page.contains("http://") || page.matches("http://").count() == 1, "only the name of SVG");
    }
}
