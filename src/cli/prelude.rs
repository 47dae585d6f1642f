//! Imports that every command uses.

pub(super) use super::out::{self, Out};
pub(super) use super::outcome::Outcome;
pub(super) use super::output::{DIM, STRONG, Style, data, show};
pub(super) use super::{cache, inputs, progress, signals, stdio, terminal};
pub(super) use motorfit::device::with_threads;
pub(super) use motorfit::report::json;
pub(super) use motorfit::setting::Setting;
pub(super) use motorfit::settings::{self, parse};
pub(super) use motorfit::text::{Shortest, engineering, excerpt, printable, significant};
pub(super) use motorfit::{Error, Result};
pub(super) use std::fmt::Write as _;
pub(super) use std::path::Path;
