//! Coordinates in which a search moves its candidates. The problem remains the same: a method that depends on the origin, the
//! direction or the scale of an axis finds something else in other coordinates.

use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::fmt;
use std::str::FromStr;

/// Coordinates x′ of a search, axis by axis, with bounds lo and hi of the parameter x.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Coordinates {
    /// `x′ = x`.
    #[default]
    None,
    /// `x′ = lo + hi − x`.
    Mirror,
    /// `x′ = x + s (hi − lo)`.
    Shift(f64),
    /// `x′ = ln x`; an axis whose lower bound is not positive keeps its values.
    Log,
}

impl Coordinates {
    /// Returns the coordinate of a value on an axis.
    #[must_use]
    pub fn coordinate(self, value: f64, (min, max): (f64, f64)) -> f64 {
        match self {
            Self::None => value,
            Self::Mirror => min + max - value,
            Self::Shift(share) => value + share * (max - min),
            Self::Log if min > 0.0 => libm::log(value),
            Self::Log => value,
        }
    }

    /// Returns the value of a coordinate on an axis, clamped to its bounds.
    #[must_use]
    pub fn value(self, coordinate: f64, (min, max): (f64, f64)) -> f64 {
        let value = match self {
            Self::None => coordinate,
            Self::Mirror => min + max - coordinate,
            Self::Shift(share) => coordinate - share * (max - min),
            Self::Log if min > 0.0 => libm::exp(coordinate),
            Self::Log => coordinate,
        };
        value.max(min).min(max)
    }

    /// Returns the bounds of the coordinates of a box.
    pub(super) fn bounds(self, bounds: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let ends = |axis: &(f64, f64)| {
            let (a, b) = (self.coordinate(axis.0, *axis), self.coordinate(axis.1, *axis));
            (a.min(b), a.max(b))
        };
        bounds.iter().map(ends).collect()
    }
}

impl fmt::Display for Coordinates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("none"),
            Self::Mirror => f.write_str("mirror"),
            Self::Shift(share) => write!(f, "shift:{share}"),
            Self::Log => f.write_str("log"),
        }
    }
}

impl FromStr for Coordinates {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let shift = |share: &str| share.parse().ok().filter(|share: &f64| share.abs() <= 1e6).map(Self::Shift);
        let found = match text.trim() {
            "none" => Some(Self::None),
            "mirror" => Some(Self::Mirror),
            "log" => Some(Self::Log),
            other => other.strip_prefix("shift:").and_then(shift),
        };
        found.ok_or_else(|| {
            let message = text!([Transform](" \"{}\" is not known", excerpt(text)));
            Error::usage(message, "Write none, mirror, log or shift:SHARE, as in shift:0.1 for a tenth of the range.")
        })
    }
}

/// Bounds of axes for tests.
#[cfg(test)]
pub(super) const BOUNDS: [(f64, f64); 3] = [(0.5, 8.0), (2.0, 3.0), (-1.0, 4.0)];
/// Coordinates for tests.
#[cfg(test)]
pub(super) const ALL: [Coordinates; 5] =
    [Coordinates::None, Coordinates::Mirror, Coordinates::Shift(0.1), Coordinates::Shift(-3.0), Coordinates::Log];

#[allow(clippy::float_cmp, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_coordinates_are_inverse_and_written_as_they_are_read() {
        for coordinates in ALL {
            assert_eq!(coordinates.to_string().parse::<Coordinates>().unwrap(), coordinates);
            for axis in BOUNDS {
                for value in [axis.0, 0.3 * axis.0 + 0.7 * axis.1, axis.1] {
                    let back = coordinates.value(coordinates.coordinate(value, axis), axis);
                    assert!((back - value).abs() < 1e-14 * 4.0, "{coordinates}: {back} {value}");
                }
            }
        }
        // By hand.
        assert_eq!(Coordinates::Mirror.coordinate(1.0, (0.5, 8.0)), 7.5);
        assert_eq!(Coordinates::Shift(0.5).coordinate(1.0, (0.5, 8.5)), 5.0);
        assert_eq!(Coordinates::Log.coordinate(1.0, (0.5, 8.0)), 0.0);
        assert_eq!(Coordinates::Log.coordinate(1.0, (0.0, 8.0)), 1.0, "an axis from zero keeps its values");
        for wrong in ["", "mirrored", "shift", "shift:", "shift:x", "shift:inf", "shift:nan", "log:2"] {
            assert!(wrong.parse::<Coordinates>().unwrap_err().to_string().contains("is not known"), "{wrong}");
        }
    }
}
