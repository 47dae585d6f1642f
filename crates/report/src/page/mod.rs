//! Self-contained HTML pages: no external resources, light and dark, for screen and print. A page is complete without its
//! script, which adds values under the pointer, zoom, and tables that can be sorted.

mod figure;
mod html;

pub(super) use html::part;

use super::Table;
use super::chart::Chart;

/// A figure of a page.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Identifier for files and links.
    pub id: String,
    /// Drawing as SVG, with classes instead of colours.
    pub svg: String,
    /// Alternative text for readers who cannot see the drawing.
    pub alternative: String,
    /// Caption.
    pub caption: String,
    /// True if the drawing is shown small.
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
    /// Panels with curves, bars or boxes.
    Chart(Chart),
    /// List of names and values.
    List(Vec<(String, String)>),
    /// Preformatted text, such as a command.
    Typed(String),
    /// List of findings.
    Items(Vec<Item>),
    /// Equations in MathML, below a heading.
    Math {
        /// Heading.
        heading: String,
        /// Equations as MathML elements.
        equations: Vec<String>,
    },
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
    /// True if the section is closed until the reader opens it.
    pub is_folded: bool,
}

/// A value with its error in the unit that suits its size.
#[derive(Debug, Clone)]
pub struct Card {
    /// Symbol.
    pub symbol: String,
    /// Name of the quantity.
    pub name: String,
    /// Value with its standard error.
    pub value: String,
    /// Unit, with a prefix or a power of ten.
    pub unit: String,
    /// Remark, such as "fixed"; empty for none.
    pub remark: String,
}

/// The level of trust in a result.
#[derive(Debug, Clone)]
pub struct Trust {
    /// Name of the level: "good", "check" or "poor".
    pub level: &'static str,
    /// Reasons and the next step.
    pub text: String,
}

/// A page of a report.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// Title.
    pub title: String,
    /// Level of trust; `None` for a page without one.
    pub trust: Option<Trust>,
    /// Values that are the result.
    pub cards: Vec<Card>,
    /// Result in one sentence; empty if the values are the result.
    pub answer: String,
    /// Sections.
    pub sections: Vec<Section>,
}

/// Returns a text with its first letter in upper case.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
