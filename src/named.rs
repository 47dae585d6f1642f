//! Tables of things that are chosen by name: each variant is a row with its name and its text.

use crate::text::{alternatives, excerpt, nearest};
use crate::{Error, Result};

/// Something that is chosen by its name.
pub trait Named: Clone + PartialEq {
    /// Returns every row, in the order in which they are listed.
    fn all() -> Vec<Self>;

    /// Returns the name in settings and results.
    fn name(&self) -> &'static str;

    /// Returns the text of the row, without a full stop.
    fn text(&self) -> &'static str;

    /// Returns the names of all rows.
    #[must_use]
    fn names() -> Vec<&'static str> {
        Self::all().iter().map(Self::name).collect()
    }

    /// Returns the row of this name.
    ///
    /// # Errors
    /// `Usage` with the nearest name, or all of them, where there is none; `setting` names what the row is chosen for.
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

/// Defines an enum as a table: each variant with its text, which is its documentation, and its name. Rows may hold more:
/// `enum Thing: Facts { … Variant = "name" => FACTS, … }` has `row(self) -> Facts`.
macro_rules! named {
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
            /// Returns what else the row holds.
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
            /// Every row, in the order in which they are listed.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Returns the name in settings and results.
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
pub(crate) use named;
