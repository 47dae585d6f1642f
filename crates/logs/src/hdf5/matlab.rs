//! Classes of the variables of a MAT-file of level 7.3.
//!
//! MATLAB writes structures as groups, arrays with the dimensions reversed, and logical values, text and objects as integers.
//! Attributes tell what a dataset is: `MATLAB_class` has the class, `MATLAB_empty` marks the dimensions of an empty array,
//! `MATLAB_object_decode` the number of an object, and `MATLAB_sparse` the parts of a sparse matrix. The values of an array of
//! structures are references without a class.

use super::variable::text;
use hdf5_reader::{Attribute, Datatype};
use motorfit_core::text::excerpt;

/// Kind of a dataset.
pub(super) enum Class {
    Numeric,
    /// References to the values of a field of an array of structures.
    Elements,
    /// Data of another kind, with its description.
    Other(&'static str),
    /// An object of MATLAB, with its description.
    Object(String),
}

/// Returns the kind of a dataset from its attributes and its type.
pub(super) fn class(attributes: &[Attribute], datatype: &Datatype) -> Class {
    let has = |name: &str| attributes.iter().any(|attribute| attribute.name == name);
    let is_true = |attribute: &Attribute| attribute.raw_data.iter().any(|&byte| byte != 0);
    if attributes.iter().any(|attribute| attribute.name == "MATLAB_empty" && is_true(attribute)) {
        return Class::Other("empty");
    }
    let class = text(attributes, "MATLAB_class");
    match class.as_deref() {
        Some("cell") => Class::Other("a cell array"),
        Some("char") => Class::Other("text"),
        Some("function_handle") => Class::Other("a function"),
        Some("struct") => Class::Other("an empty structure"),
        Some(class) if has("MATLAB_object_decode") => Class::Object(format!("an object of class {}", excerpt(class))),
        Some("double" | "single" | "logical") => Class::Numeric,
        Some(class) if class.trim_start_matches('u').starts_with("int") => Class::Numeric,
        Some(class) => Class::Object(format!("an object of class {}", excerpt(class))),
        None if matches!(datatype, Datatype::Reference { .. }) => Class::Elements,
        None => Class::Numeric,
    }
}

/// Returns true for the attributes of a sparse matrix.
pub(super) fn is_sparse(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| attribute.name == "MATLAB_sparse")
}
