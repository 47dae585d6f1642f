//! The parts of a page.

use crate::chart::{Chart, Figure};
use crate::table::Table;

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
