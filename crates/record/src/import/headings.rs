//! Headings of a table.

use crate::heading::{Quantity, understand, unit_in};
use motorfit_core::text::quoted;

/// A heading with the unit from the row of units below it, if there is one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Heading {
    pub name: String,
    pub unit: Option<String>,
    /// Text in which the quantity is recognized in place of the name; empty if the column is used on request alone.
    pub alias: Option<String>,
}

impl Heading {
    /// Returns the units of the heading and of the row below it if they differ.
    pub(super) fn contradiction(&self) -> Option<(String, String)> {
        let (quantity, unit) = understand(&self.name)?;
        let (own, below) = (unit?, self.unit.clone()?);
        let factors = [quantity.factor(&own)?, quantity.factor(&below)?];
        ((factors[0] / factors[1] - 1.0).abs() > 1e-9).then_some((own, below))
    }

    /// Returns the unit that is named, in the row of units or in the heading, whatever the quantity.
    pub(super) fn named_unit(&self) -> Option<&str> {
        self.unit.as_deref().or_else(|| unit_in(&self.name))
    }

    /// Returns the unit if it is one of a quantity.
    pub(super) fn unit_of(&self, quantity: Quantity) -> Option<&str> {
        self.named_unit().filter(|unit| quantity.factor(unit).is_some())
    }

    /// Returns the quantity that the heading names, and the unit; the row of units takes precedence over the heading.
    pub(super) fn understood(&self) -> Option<(Quantity, Option<String>)> {
        let (quantity, unit) = understand(self.alias.as_ref().unwrap_or(&self.name))?;
        Some((quantity, self.unit.clone().or(unit)))
    }
}

/// Largest number of headings that a message lists.
const LISTED_MAX: usize = 60;

/// Returns the headings in quotation marks; of many the first ones and their number.
pub(super) fn listed(headings: &[Heading]) -> String {
    let mut all: Vec<String> = headings.iter().take(LISTED_MAX).map(|heading| quoted(&heading.name)).collect();
    if headings.len() > LISTED_MAX {
        all.push(format!("… ({} in all)", headings.len()));
    }
    all.join(", ")
}
