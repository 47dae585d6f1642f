//! Models from files and by name.

use super::BuiltIn;
use super::definition::Model;
use motorfit_core::named::Named;
use motorfit_core::text::{listed, nearest};
use motorfit_core::{Error, Result};
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

impl Model {
    /// Reads a model from a file, or takes the built-in one with this name if there is no such file.
    ///
    /// # Errors
    /// Returns `Data` if the file cannot be read, and the errors of [`Model::parse`] with the file.
    pub fn open(path: &Path) -> Result<Self> {
        let located = |error: Error| error.in_file(path);
        let name = path.to_str().unwrap_or_default();
        if !path.exists() {
            if let Some(own) = BuiltIn::ALL.into_iter().find(|own| own.name() == name) {
                return own.model();
            }
            let names = BuiltIn::names();
            let hint = match nearest(name, &names) {
                Some(near) => format!("Did you mean the built-in model \"{near}\"?"),
                None => format!("Give a file, or a built-in model: {}.", listed(&names, "or")),
            };
            return Err(Error::data("there is neither a file nor a built-in model of this name", hint).in_file(path));
        }
        let file = File::open(path).map_err(|error| motorfit_core::file::unreadable(path, &error))?;
        if file.metadata().is_ok_and(|of| of.is_dir()) {
            return Err(located(Error::data("is a folder, expected a model", "Give the path of a model in it.")));
        }
        let mut bytes = Vec::new();
        let most = super::definition::TEXT_MAX as u64 + 1;
        file.take(most).read_to_end(&mut bytes).map_err(|error| motorfit_core::file::unreadable(path, &error))?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            located(Error::data(format!("byte {at} is not UTF-8"), "Save the model as UTF-8."))
        })?;
        Self::parse(&text).map_err(located)
    }
}
