//! Tests of the sources, documents and dependencies of the project.

mod dependencies;
mod documents;
mod hostile;
mod layering;
mod packaging;
mod programs;
mod reference;
#[path = "../support/mod.rs"]
mod support;
