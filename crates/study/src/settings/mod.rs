//! Settings that the command line, studies and Python share: one table of their value types, defaults and help texts, and one
//! reader that converts them to the library's types.
//!
//! A front end parses each argument into a [`Value`] by the [`Kind`] of its row and collects the values in [`Given`].

mod given;
mod model;
pub mod parse;
mod read;
mod table;

pub use given::{Fault, Given, Value};
pub use model::{model_reading, model_spec, signal_reading};
pub use read::{device, identify, method, problem, reading, with_intersample_of};
pub use table::{DEVICE, Kind, PROBLEM, READING, Row, SEARCH, row};
