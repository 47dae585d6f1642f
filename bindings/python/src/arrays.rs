//! Numbers from Python: whatever numpy takes for real numbers, copied into plain tables.
//!
//! Copies are taken while the interpreter's lock is held, so that no other thread writes to what is read. An array that
//! is not aligned, not in C order, read-only or of another type gives the same numbers by way of numpy.

use numpy::{
    IntoPyArray as _, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Numbers that are copied one by one, in whatever order they lie.
const SMALL: usize = 8192;

/// Numbers with the shape that they had.
pub struct Table {
    /// Row by row.
    pub values: Vec<f64>,
    /// Lengths of the axes.
    pub shape: Vec<usize>,
}

/// Reads an array; `what` names it in errors.
pub fn table(numbers: &Bound<'_, PyAny>, what: &str) -> PyResult<Table> {
    let mut table = Table { values: Vec::new(), shape: Vec::new() };
    table.shape = read(numbers, what, &mut table.values)?;
    Ok(table)
}

/// Reads a signal: one axis.
pub fn signal(numbers: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<f64>> {
    let Table { values, shape } = table(numbers, what)?;
    match shape.as_slice() {
        [_] => Ok(values),
        _ => Err(PyValueError::new_err(format!("{what} has the shape {shape:?}; give one axis, a value per sample"))),
    }
}

/// Reads an array into `values`; gives its shape.
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
        // What is large is put in order by numpy, in less time.
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

/// Returns whether every number is where the processor reads it.
fn is_aligned(array: &Bound<'_, PyArrayDyn<f64>>) -> bool {
    let size = size_of::<f64>().cast_signed();
    array.data().align_offset(align_of::<f64>()) == 0 && array.strides().iter().all(|stride| stride % size == 0)
}

/// Converts it by numpy to real numbers, aligned and in C order.
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

/// Numbers as an array of one axis.
pub fn array<'py>(py: Python<'py>, values: Vec<f64>) -> Bound<'py, PyArray1<f64>> {
    values.into_pyarray(py)
}

/// Numbers as an array of shape (rows, columns).
pub fn rows<'py>(py: Python<'py>, values: Vec<f64>, columns: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = values.len().checked_div(columns).unwrap_or(0);
    values.into_pyarray(py).reshape([count, columns])
}
