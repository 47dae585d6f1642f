//! Picklable results. A result refers to the library's value in the process that computed it; after pickling it consists of
//! the values of its attributes and methods without arguments.

use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::types::PyDict;
use pyo3::{IntoPyObjectExt as _, prelude::*};

/// Columns of the text of `summary()`.
pub const TEXT_WIDTH: usize = 100;

/// Value of an attribute or method, as a Python object.
pub type Answer<'py> = PyResult<Bound<'py, PyAny>>;

/// Names of the attributes of a result of type `T`, each with the function that computes its value.
pub type Table<T> = &'static [(&'static str, for<'py> fn(&T, Python<'py>) -> Answer<'py>)];

/// Data of a result: the library's value, or the attribute values of an unpickled result.
pub enum ResultData<T: 'static> {
    Native(T),
    Unpickled(Py<PyDict>),
}

impl<T> ResultData<T> {
    /// Restores a result from the attribute values that [`Self::answers`] returned.
    ///
    /// # Errors
    /// Returns `ValueError` if an attribute of `table` is missing, as in a pickle of another version.
    pub fn unpickled(answers: &Bound<'_, PyDict>, table: Table<T>) -> PyResult<Self> {
        for (name, _) in table {
            if !answers.contains(name)? {
                let message = format!("this was pickled by another version of motorfit and lacks {name}");
                return Err(PyValueError::new_err(message));
            }
        }
        Ok(Self::Unpickled(answers.copy()?.unbind()))
    }

    /// Returns the value of the attribute `name`; that of an unpickled result is a copy, so that a caller cannot change it.
    pub fn answer<'py>(&self, py: Python<'py>, table: Table<T>, name: &str) -> Answer<'py> {
        let unknown = || PyAttributeError::new_err(name.to_owned());
        match self {
            Self::Native(found) => {
                let (_, answer) = table.iter().find(|(known, _)| *known == name).ok_or_else(unknown)?;
                answer(found, py)
            }
            Self::Unpickled(answers) => {
                let answer = answers.bind(py).get_item(name)?.ok_or_else(unknown)?;
                py.import("copy")?.call_method1("deepcopy", (answer,))
            }
        }
    }

    /// Returns the values of all attributes: the state for pickle.
    pub fn answers<'py>(&self, py: Python<'py>, table: Table<T>) -> PyResult<Bound<'py, PyDict>> {
        let answers = PyDict::new(py);
        for (name, _) in table {
            answers.set_item(name, self.answer(py, table, name)?)?;
        }
        Ok(answers)
    }
}

/// Converts a value to a Python object.
pub fn given<'py>(py: Python<'py>, answer: impl IntoPyObject<'py>) -> Answer<'py> {
    answer.into_bound_py_any(py)
}

/// Function and arguments from which pickle restores an object.
pub type Reduced<'py, S> = PyResult<(Bound<'py, PyAny>, (S,))>;

/// Returns the value of `__reduce__`: the static method `_restore` of the object's class and its argument `state`.
pub fn reduced<'py, T, S>(of: &Bound<'py, T>, state: S) -> Reduced<'py, S> {
    Ok((of.as_any().get_type().getattr("_restore")?, (state,)))
}

/// Defines an immutable, picklable Python class of results: properties and methods without arguments, each with the function
/// that computes its value from the library's type; properties that are parts of the document of `to_json`, each with its key;
/// `to_frame`, whose columns are those of `to_columns`; and further methods. `copy` and `deepcopy` return the object itself.
macro_rules! result {
    (
        $(#[$about:meta])*
        $class:ident of $found:ty;
        properties { $($(#[$of_property:meta])* $property:ident = $value:expr;)* }
        methods { $($(#[$of_method:meta])* $method:ident = $made:expr;)* }
        $(documented { $($(#[$of_part:meta])* $part:ident = $key:literal;)* })?
        $(framed { $(#[$of_frame:meta])+ })?
        own { $($own:tt)* }
    ) => {
        $(#[$about])*
        #[pyclass(frozen, module = "motorfit")]
        pub struct $class($crate::answers::ResultData<$found>);

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

            $(
            $($(#[$of_part])* #[getter] fn $part<'py>(&self, py: Python<'py>) -> $crate::answers::Answer<'py> {
                self.to_dict(py)?.call_method1("get", ($key,))
            })*

            /// Returns the complete result: the document of `to_json`, with its lists and mappings.
            fn to_dict<'py>(&self, py: Python<'py>) -> $crate::answers::Answer<'py> {
                py.import("json")?.call_method1("loads", (self.answer(py, "to_json")?,))
            }
            )?

            $(
            $(#[$of_frame])+
            ///
            /// Parameters
            /// ----------
            /// library : {"pandas", "polars"}, optional
            ///     Library of the frame; by default pandas, or polars if pandas is not installed.
            #[pyo3(signature = (library=None))]
            fn to_frame<'py>(&self, py: Python<'py>, library: Option<&str>) -> $crate::answers::Answer<'py> {
                $crate::frame::framed(&self.answer(py, "to_columns")?, library)
            }
            )?

            $($own)*

            /// Returns the object itself, which is immutable.
            fn __copy__(slf: Py<Self>) -> Py<Self> {
                slf
            }

            /// Returns the object itself, which is immutable.
            fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
                slf
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> $crate::answers::Reduced<'py, Bound<'py, PyDict>> {
                $crate::answers::reduced(slf, slf.get().0.answers(slf.py(), Self::ANSWERS)?)
            }

            #[staticmethod]
            fn _restore(answers: &Bound<'_, PyDict>) -> PyResult<Self> {
                $crate::answers::ResultData::unpickled(answers, Self::ANSWERS).map(Self)
            }
        }
    };
}
pub(crate) use result;
