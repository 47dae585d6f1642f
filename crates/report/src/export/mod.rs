//! Files for simulators with the parameters of an identified machine.

mod contents;
mod json;
mod mjcf;
mod modelica;
mod of_model;
mod of_motor;
mod urdf;

pub use contents::{Exported, ExportedParameter};
pub use of_model::exported_model;
pub use of_motor::exported_motor;

use motorfit_core::Result;
use motorfit_core::named::named;

named! {
    /// Format of a file for simulators.
    #[non_exhaustive]
    pub enum ExportFormat: &'static str {
        /// MuJoCo 3.7 or later (MJCF): joint and DC motor with its winding.
        Mjcf = "mjcf" => "xml",
        /// Robot description (URDF): inertia and friction of the joint; it has no place for a winding.
        Urdf = "urdf" => "urdf",
        /// Modelica 3: the equations with their parameters, without a library.
        Modelica = "modelica" => "mo",
        /// JSON: all parameters with units and errors, and their roles.
        Json = "json" => "json",
    }
}

impl ExportFormat {
    /// Returns the extension of a file in this format.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        self.row()
    }

    /// Returns the text of a file.
    ///
    /// # Errors
    /// Returns a `Usage` error if the machine names no value for what the format needs, such as an inertia, and `NotIdentified` if that
    /// value is not identifiable.
    pub fn write(self, of: &Exported) -> Result<String> {
        match self {
            Self::Mjcf => mjcf::text(of),
            Self::Urdf => urdf::text(of),
            Self::Modelica => modelica::text(of),
            Self::Json => Ok(json::text(of)),
        }
    }
}
