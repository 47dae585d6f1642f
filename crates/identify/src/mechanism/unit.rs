//! Units of the position of a mechanism.

/// A unit of position: the characteristics are voltages per this unit.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PositionUnit {
    /// Symbol of the unit.
    pub symbol: &'static str,
    /// Radians or metres of one unit.
    pub factor: f64,
    /// True for a length.
    pub is_linear: bool,
}

/// The units with their factors; the first of each kind is that of SI.
const UNITS: [PositionUnit; 8] = [
    unit("rad", 1.0, false),
    unit("turn", std::f64::consts::TAU, false),
    unit("deg", std::f64::consts::PI / 180.0, false),
    unit("m", 1.0, true),
    unit("ft", 0.3048, true),
    unit("in", 0.0254, true),
    unit("cm", 0.01, true),
    unit("mm", 0.001, true),
];

const fn unit(symbol: &'static str, factor: f64, is_linear: bool) -> PositionUnit {
    PositionUnit { symbol, factor, is_linear }
}

impl PositionUnit {
    /// Returns the unit of position of a velocity, such as `turn` for `turn/s` and `rpm`; that of SI if it is not known.
    #[must_use]
    pub fn of_velocity(velocity: &str, is_linear: bool) -> Self {
        let name = velocity.split('/').next().unwrap_or_default().trim();
        let name = match name {
            "rpm" | "RPM" | "rev" | "turns" | "rps" => "turn",
            "°" => "deg",
            name => name,
        };
        let of_kind = || UNITS.iter().filter(|unit| unit.is_linear == is_linear);
        let found = of_kind().find(|unit| unit.symbol == name).or_else(|| of_kind().next());
        found.copied().unwrap_or(UNITS[0])
    }
}
