//! The settings that the command line, studies and Python share: one table of their forms, defaults and texts, and one
//! reader that makes the library's types of them.
//!
//! A front end makes a [`Value`] of what it was given, by the [`Kind`] of the row, and keeps them in [`Given`].

mod given;
mod read;
mod table;
pub mod values;

pub use given::{Fault, Given, Value};
pub use read::{device, identify, method, problem, reading};
pub use table::{DEVICE, Kind, PROBLEM, READING, Row, SEARCH, row};
