//! Acceptance limits of the parameters of a production line.

use crate::settings::parse;
use motorfit_core::setting::{Setting, text};
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};

/// Acceptance limits of the parameters of a motor, by symbol.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Limits(Vec<(String, f64, f64)>);

impl Limits {
    /// Creates limits from a list of symbols with their lower and upper limits.
    ///
    /// # Errors
    /// Returns a `Usage` error if a limit is NaN or a lower limit is not below the upper one.
    pub fn new(list: Vec<(String, f64, f64)>) -> Result<Self> {
        match list.iter().find(|(_, low, high)| low.is_nan() || high.is_nan() || low >= high) {
            Some((symbol, low, high)) => {
                let message = text!([Limits](": {}={low}:{high} is empty", excerpt(symbol)));
                Err(Error::usage(message, text!("Write " [Limits = "R=0.8:1.0"] ", the lower limit first.")))
            }
            None => Ok(Self(list)),
        }
    }

    /// Parses limits, `R=0.8:1.0`, ….
    ///
    /// # Errors
    /// Returns a usage error if an item is not `PARAMETER=MIN:MAX` or repeats a parameter, and the errors of [`Self::new`].
    pub fn parse(items: &[String]) -> Result<Self> {
        parse::named_ranges(items, Setting::Limits).and_then(Self::new)
    }

    /// Returns the symbols that have limits.
    pub fn symbols(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(symbol, _, _)| symbol.as_str())
    }

    /// Returns the lower and upper limit of a parameter, if it has any.
    #[must_use]
    pub fn of(&self, symbol: &str) -> Option<[f64; 2]> {
        self.0.iter().find(|(of, _, _)| of == symbol).map(|(_, low, high)| [*low, *high])
    }

    /// Returns true if a value of a parameter is within its limits, or the parameter has none.
    #[must_use]
    #[doc(hidden)]
    pub fn permit(&self, symbol: &str, value: f64) -> bool {
        self.of(symbol).is_none_or(|[low, high]| (low..=high).contains(&value))
    }

    /// Returns true if no parameter has limits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
