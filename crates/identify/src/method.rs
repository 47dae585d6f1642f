//! Methods that find the first optimum, and refinements.

use motorfit_core::named::{Named, named};
use motorfit_core::setting::text;
use motorfit_core::text::{alternatives, excerpt, listed};
use motorfit_core::{Error, Result};
use motorfit_optimize::{
    ConfiguredSearch, Coordinates, Hyperparameter, MultistartOptions, Optimizer, SEARCHES, Search, SearchOptions,
    SearchSettings,
};
use std::fmt;

/// The method that finds the first optimum.
#[derive(Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Method {
    /// Steiglitz–McBride; a multistart of Levenberg–Marquardt in logarithms where it is not applicable.
    #[default]
    Auto,
    /// Steiglitz–McBride.
    SteiglitzMcBride,
    /// Population search with its settings.
    Search(ConfiguredSearch),
}

impl<O: SearchOptions> From<O> for Method {
    /// Makes the search to which these settings belong.
    fn from(options: O) -> Self {
        Self::Search(options.into())
    }
}

impl fmt::Debug for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Search(tuned) => tuned.fmt(f),
            _ => f.write_str(self.text()),
        }
    }
}

impl Named for Method {
    fn all() -> Vec<Self> {
        let searches = SEARCHES.into_iter().map(|search| Self::Search(search.into()));
        [Self::Auto, Self::SteiglitzMcBride].into_iter().chain(searches).collect()
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::SteiglitzMcBride => "sm",
            Self::Search(tuned) => tuned.search.name,
        }
    }

    fn text(&self) -> &'static str {
        match self {
            Self::Auto => "Steiglitz–McBride, or a multistart where it is not applicable",
            Self::SteiglitzMcBride => "Steiglitz–McBride",
            Self::Search(tuned) => tuned.search.text,
        }
    }
}

impl Method {
    /// Returns the name of the method in settings and results.
    #[must_use]
    pub fn name(&self) -> &'static str {
        Named::name(self)
    }

    /// Changes a setting of the search.
    ///
    /// # Errors
    /// Returns `Usage` if the method has no setting `key`, or if `value` is not valid for it.
    pub fn set(&mut self, key: &str, value: &str) -> Result<()> {
        let is_known = match self {
            Self::Search(tuned) => tuned.set(key, value)?,
            Self::Auto | Self::SteiglitzMcBride => false,
        };
        if is_known { Ok(()) } else { Err(unknown_setting(key, value)) }
    }

    /// Returns true if the method always searches with a population.
    #[must_use]
    pub fn is_search(&self) -> bool {
        matches!(self, Self::Search(_))
    }

    /// Returns the search of the method: for `Auto` the one that wins the suite `motors`, a multistart; `None` for Steiglitz–McBride.
    #[must_use]
    pub fn search(&self) -> Option<ConfiguredSearch> {
        match self {
            Self::Auto => Some(MultistartOptions::default().into()),
            Self::SteiglitzMcBride => None,
            Self::Search(tuned) => Some(*tuned),
        }
    }

    /// Returns the coordinates in which the search moves its candidates: logarithms for `Auto`, whose boxes span decades
    /// when no bounds are given; those of the parameters for a search that is named.
    #[must_use]
    pub fn coordinates(&self) -> Coordinates {
        if *self == Self::Auto { Coordinates::Log } else { Coordinates::None }
    }

    /// Begins a run of the population search.
    ///
    /// # Errors
    /// Returns `Usage` for invalid settings, and for Steiglitz–McBride, which has no population.
    pub fn optimizer(&self, setup: SearchSettings) -> Result<Box<dyn Optimizer>> {
        let none = || {
            let searches = SEARCHES.map(|search| search.name);
            Error::usage("Steiglitz–McBride has no population", format!("Choose {}.", alternatives(&searches)))
        };
        self.search().ok_or_else(none)?.begin(setup)
    }
}

named! {
    /// Refinements of the first optimum.
    pub enum Polish (default LevenbergMarquardt) {
        /// Levenberg–Marquardt, the maximum-likelihood estimate with standard errors.
        LevenbergMarquardt = "lm",
        /// No refinement.
        None = "none",
    }
}

/// Returns the error for a setting that the method does not have; the hint lists the settings of all searches.
fn unknown_setting(name: &str, value: &str) -> Error {
    let with_settings = SEARCHES.into_iter().filter(|search| !search.settings.is_empty());
    let one = |(n, search): (usize, &Search)| {
        let settings: Vec<String> = search.settings.iter().map(Hyperparameter::form).collect();
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        format!("{} {}{}", search.name, if n == 0 { "has " } else { "" }, listed(&settings, "and"))
    };
    let all = with_settings.enumerate().map(one).collect::<Vec<_>>().join("; ");
    let message = text!([Set](" \"{}={}\" is not a setting of this method", excerpt(name), excerpt(value)));
    Error::usage(message, format!("{all}."))
}
