//! A drawing of a fixed size.

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
