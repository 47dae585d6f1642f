//! Conversion of array-likes to `f64` and of results to numpy arrays.
//!
//! Arrays are copied while the interpreter's lock is held, so that no other thread writes to them meanwhile. Arrays that are
//! unaligned, not in C order, or of another real type are first converted by numpy.

use numpy::{
    IntoPyArray as _, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Largest number of elements for which a strided array is copied element by element instead of by numpy.
const SMALL: usize = 8192;

/// Array in C order.
pub struct Table {
    /// Elements in C order.
    pub values: Vec<f64>,
    /// Lengths of the axes.
    pub shape: Vec<usize>,
}

/// Copies an array-like of real numbers; `what` names it in errors.
pub fn table(numbers: &Bound<'_, PyAny>, what: &str) -> PyResult<Table> {
    let mut table = Table { values: Vec::new(), shape: Vec::new() };
    table.shape = read(numbers, what, &mut table.values)?;
    Ok(table)
}

/// Copies a one-dimensional array-like.
pub fn signal(numbers: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<f64>> {
    let Table { values, shape } = table(numbers, what)?;
    match shape.as_slice() {
        [_] => Ok(values),
        _ => Err(PyValueError::new_err(format!(
            "{what} has the shape {shape:?}; give one dimension, a value per sample"
        ))),
    }
}

/// Copies an array-like of real numbers into `values`, in C order, and returns its shape.
///
/// # Errors
/// Returns `TypeError` for another dtype, `ValueError` for masked values.
pub fn read(numbers: &Bound<'_, PyAny>, what: &str, values: &mut Vec<f64>) -> PyResult<Vec<usize>> {
    values.clear();
    if numbers.is_exact_instance_of::<PyUntypedArray>()
        && let Ok(array) = numbers.cast::<PyArrayDyn<f64>>()
        && is_aligned(array)
    {
        if array.is_c_contiguous() {
            values.extend_from_slice(array.readonly().as_slice()?);
            return Ok(array.shape().to_vec());
        }
        // Above this size numpy is faster.
        if array.len() <= SMALL {
            values.extend(array.readonly().as_array().iter());
            return Ok(array.shape().to_vec());
        }
    }
    let array = converted(numbers, what)?;
    let readable = array.readonly();
    values.extend_from_slice(readable.as_slice()?);
    Ok(array.shape().to_vec())
}

/// Returns true if all elements are aligned to `f64`.
fn is_aligned(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    let size = size_of::<f64>().cast_signed();
    array.data().align_offset(align_of::<f64>()) == 0 && array.strides().iter().all(|stride| stride % size == 0)
}

/// Converts an array-like by numpy to aligned `f64` in C order.
fn converted<'py>(numbers: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let numpy = numbers.py().import("numpy")?;
    if numpy.getattr("ma")?.call_method1("is_masked", (numbers,))?.is_truthy()? {
        return Err(PyValueError::new_err(format!("{what} has masked values; fill them or leave their rows out")));
    }
    let array = numpy.call_method1("asarray", (numbers,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !matches!(kind.as_str(), "f" | "i" | "u") {
        let dtype = array.getattr("dtype")?.str()?;
        return Err(PyTypeError::new_err(format!("{what} is of dtype {dtype}; give real numbers")));
    }
    let options = PyDict::new(numbers.py());
    options.set_item("dtype", "float64")?;
    options.set_item("requirements", ["C", "A"])?;
    let array = numpy.call_method("require", (array,), Some(&options))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

/// Returns a one-dimensional numpy array.
pub fn array<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyArray1<f64>> {
    values.into_pyarray(py)
}

/// Returns a numpy array of shape (rows, `columns`).
pub fn rows<'py>(py: Python<'py>, values: Vec<f64>, columns: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = values.len().checked_div(columns).unwrap_or(0);
    values.into_pyarray(py).reshape([count, columns])
}
