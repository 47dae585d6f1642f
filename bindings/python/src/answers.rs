//! Results that leave their process: they take what they answer with them, not what they compute it from.

use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::types::PyDict;
use pyo3::{IntoPyObjectExt as _, prelude::*};

/// An answer of any kind.
pub type Answer<'py> = PyResult<Bound<'py, PyAny>>;

/// The attributes of a result of type `T`, by name.
pub type Table<T> = &'static [(&'static str, for<'py> fn(&T, Python<'py>) -> Answer<'py>)];

/// A result that was found here, or the answers of one that was found in another process.
pub enum Held<T: 'static> {
    Here(T),
    Sent(Py<PyDict>),
}

impl<T> Held<T> {
    /// Of what [`Self::answers`] gave in another process.
    pub fn sent(answers: &Bound<'_, PyDict>, table: Table<T>) -> PyResult<Self> {
        for (name, _) in table {
            if !answers.contains(name)? {
                let message = format!("another version of motorfit pickled this, without {name}");
                return Err(PyValueError::new_err(message));
            }
        }
        Ok(Self::Sent(answers.copy()?.unbind()))
    }

    /// The answer by that name. What was sent is copied, so that nobody changes it.
    pub fn answer<'py>(&self, py: Python<'py>, table: Table<T>, name: &str) -> Answer<'py> {
        let unknown = || PyAttributeError::new_err(name.to_owned());
        match self {
            Self::Here(found) => {
                let (_, answer) = table.iter().find(|(known, _)| *known == name).ok_or_else(unknown)?;
                answer(found, py)
            }
            Self::Sent(answers) => {
                let answer = answers.bind(py).get_item(name)?.ok_or_else(unknown)?;
                py.import("copy")?.call_method1("deepcopy", (answer,))
            }
        }
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
pub fn given<'py>(py: Python<'py>, answer: impl IntoPyObject<'py>) -> Answer<'py> {
    answer.into_bound_py_any(py)
}

/// The function and arguments from which pickle restores an object.
pub type Reduced<'py, S> = PyResult<(Bound<'py, PyAny>, (S,))>;

/// Returns the way to restore an object: `_restore(state)` of its class.
pub fn reduced<'py, T, S>(of: &Bound<'py, T>, state: S) -> Reduced<'py, S> {
    Ok((of.as_any().get_type().getattr("_restore")?, (state,)))
}

/// A class of results: its properties and methods, each with what a result answers where it was found; and methods of its
/// own. It pickles, and is its own copy, because nothing can change it.
macro_rules! result {
    (
        $(#[$about:meta])*
        $class:ident of $found:ty;
        properties { $($(#[$of_property:meta])* $property:ident = $value:expr;)* }
        methods { $($(#[$of_method:meta])* $method:ident = $made:expr;)* }
        own { $($own:tt)* }
    ) => {
        $(#[$about])*
        #[pyclass(frozen, module = "motorfit")]
        pub struct $class($crate::answers::Held<$found>);

        impl $class {
            const ANSWERS: $crate::answers::Table<$found> =
                &[$((stringify!($property), $value),)* $((stringify!($method), $made),)*];

            fn answer<'py>(&self, py: Python<'py>, name: &str) -> $crate::answers::Answer<'py> {
                self.0.answer(py, Self::ANSWERS, name)
            }
        }

        #[pymethods]
        impl $class {
            $($(#[$of_property])* #[getter] fn $property<'py>(&self, py: Python<'py>) -> $crate::answers::Answer<'py> {
                self.answer(py, stringify!($property))
            })*

            $($(#[$of_method])* fn $method<'py>(&self, py: Python<'py>) -> $crate::answers::Answer<'py> {
                self.answer(py, stringify!($method))
            })*

            $($own)*

            /// The same: nothing can change it.
            fn __copy__(slf: Py<Self>) -> Py<Self> {
                slf
            }

            /// The same: nothing can change it.
            fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
                slf
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> $crate::answers::Reduced<'py, Bound<'py, PyDict>> {
                $crate::answers::reduced(slf, slf.get().0.answers(slf.py(), Self::ANSWERS)?)
            }

            #[staticmethod]
            fn _restore(answers: &Bound<'_, PyDict>) -> PyResult<Self> {
                $crate::answers::Held::sent(answers, Self::ANSWERS).map(Self)
            }
        }
    };
}
pub(crate) use result;
