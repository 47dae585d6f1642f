//! Results that leave their process: they take what they answer with them, not what they compute it from.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::{IntoPyObjectExt as _, exceptions::PyValueError};

/// An answer of any kind.
pub type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// What a result of type `T` answers, by name.
pub type Table<T> = &'static [(&'static str, for<'py> fn(&T, Python<'py>) -> Any<'py>)];

/// A result that was found here, or the answers of one that was found in another process.
pub enum Result<T: 'static> {
    Here(T),
    Sent(Py<PyDict>),
}

impl<T> Result<T> {
    /// The answer by that name. What was sent is copied, so that nobody changes it.
    pub fn answer<'py>(&self, py: Python<'py>, table: Table<T>, name: &str) -> Any<'py> {
        let answer = match self {
            Self::Here(found) => {
                table.iter().find(|(known, _)| *known == name).map(|(_, answer)| answer(found, py)).transpose()?
            }
            Self::Sent(answers) => {
                let copied = |answer| py.import("copy")?.call_method1("deepcopy", (answer,));
                answers.bind(py).get_item(name)?.map(copied).transpose()?
            }
        };
        let missing = || PyValueError::new_err(format!("another version of motorfit pickled this, without {name}"));
        answer.ok_or_else(missing)
    }

    /// All answers: what is pickled.
    pub fn answers<'py>(&self, py: Python<'py>, table: Table<T>) -> PyResult<Bound<'py, PyDict>> {
        let answers = PyDict::new(py);
        for (name, _) in table {
            answers.set_item(name, self.answer(py, table, name)?)?;
        }
        Ok(answers)
    }
}

/// An answer for Python.
pub fn given<'py>(py: Python<'py>, answer: impl IntoPyObject<'py>) -> Any<'py> {
    answer.into_bound_py_any(py)
}

/// What pickle makes an object of again: a function, and what it is called with.
pub type Reduced<'py, S> = PyResult<(Bound<'py, PyAny>, (S,))>;

/// How pickle makes an object again: by `_restore(state)` of its class.
pub fn reduced<'py, T, S>(of: &Bound<'py, T>, state: S) -> Reduced<'py, S> {
    Ok((of.as_any().get_type().getattr("_restore")?, (state,)))
}
