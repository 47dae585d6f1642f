//! Enums as tables: each variant is a row with a name, by which users choose it, and a description.

use crate::text::{alternatives, excerpt, nearest};
use crate::{Error, Result};

/// A row of a table that users choose by name.
pub trait Named: Clone + PartialEq {
    /// Returns all rows in the order of the table.
    fn all() -> Vec<Self>;

    /// Returns the name of the row in settings and results.
    fn name(&self) -> &'static str;

    /// Returns the description of the row, without a full stop.
    fn text(&self) -> &'static str;

    /// Returns the names of all rows.
    #[must_use]
    fn names() -> Vec<&'static str> {
        Self::all().iter().map(Self::name).collect()
    }

    /// Returns the row with a name.
    ///
    /// # Errors
    /// Returns a `Usage` error if no row has the name; the message begins with `setting`, and the hint has the most similar
    /// name or all names.
    fn named(setting: &str, name: &str) -> Result<Self> {
        Self::all().into_iter().find(|row| row.name() == name).ok_or_else(|| {
            let names = Self::names();
            let remedy = match nearest(name, &names) {
                Some(near) => format!("Did you mean \"{near}\"?"),
                None => format!("Give {}.", alternatives(&names)),
            };
            Error::usage(format!("{setting}: \"{}\" is unknown", excerpt(name)), remedy)
        })
    }
}

/// Defines an enum as a table: each variant has a name, and its doc comment is its description. Rows may hold further data:
/// `enum Thing: Facts { … Variant = "name" => FACTS, … }` defines `row(self) -> Facts`.
#[doc(hidden)]
#[macro_export]
macro_rules! __named {
    (
        $(#[$meta:meta])*
        $visibility:vis enum $type:ident (default $default:ident) {
            $($(#[doc = $text:literal])+ $variant:ident = $name:literal,)+
        }
    ) => {
        $crate::named::named!(@table $(#[$meta])* $visibility $type { $($(#[doc = $text])+ $variant = $name,)+ });

        impl Default for $type {
            fn default() -> Self {
                Self::$default
            }
        }
    };
    (
        $(#[$meta:meta])*
        $visibility:vis enum $type:ident {
            $($(#[doc = $text:literal])+ $variant:ident = $name:literal,)+
        }
    ) => {
        $crate::named::named!(@table $(#[$meta])* $visibility $type { $($(#[doc = $text])+ $variant = $name,)+ });
    };
    (
        $(#[$meta:meta])*
        $visibility:vis enum $type:ident: $row_type:ty {
            $($(#[doc = $text:literal])+ $variant:ident = $name:literal => $row:expr,)+
        }
    ) => {
        $crate::named::named!(@table $(#[$meta])* $visibility $type { $($(#[doc = $text])+ $variant = $name,)+ });

        impl $type {
            /// Returns the further data of the row.
            const fn row(self) -> $row_type {
                match self {
                    $(Self::$variant => $row,)+
                }
            }
        }
    };
    (
        @table $(#[$meta:meta])*
        $visibility:vis $type:ident { $($(#[doc = $text:literal])+ $variant:ident = $name:literal,)+ }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        $visibility enum $type {
            $($(#[doc = $text])+ $variant,)+
        }

        impl $type {
            /// All rows in the order of the table.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Returns the name of the row in settings and results.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }
        }

        impl $crate::named::Named for $type {
            fn all() -> Vec<Self> {
                Self::ALL.to_vec()
            }

            fn name(&self) -> &'static str {
                Self::name(*self)
            }

            fn text(&self) -> &'static str {
                match self {
                    $(Self::$variant => concat!($($text),+).trim().trim_end_matches('.'),)+
                }
            }
        }
    };
}
#[doc(hidden)]
pub use crate::__named as named;
