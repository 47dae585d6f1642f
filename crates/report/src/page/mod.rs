//! Self-contained HTML pages: no external resources, light and dark, for screen and print. A page is complete without its
//! script, which adds values under the pointer, zoom, and tables that can be sorted.

mod figure;
mod html;
mod parts;

pub(super) use html::part;
pub use parts::{Card, Item, Page, Part, Section, Trust};

/// Returns a text with its first letter in upper case.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
