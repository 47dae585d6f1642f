//! `Svg`: figures.

use crate::answers::{Reduced, reduced};
use motorfit::report::Figure;
use pyo3::prelude::*;

/// Figure as SVG: `str(figure)` is the SVG text, `save(path)` writes it to a file, notebooks display it. It can be pickled.
#[pyclass(frozen, module = "motorfit")]
pub struct Svg {
    svg: String,
    /// Caption of the figure.
    #[pyo3(get)]
    caption: String,
}

#[pymethods]
impl Svg {
    fn _repr_svg_(&self) -> &str {
        &self.svg
    }

    fn __str__(&self) -> &str {
        &self.svg
    }

    fn __repr__(&self) -> String {
        format!("<Svg {}>", self.caption)
    }

    /// Returns the object itself, which is immutable.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Returns the object itself, which is immutable.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, (String, String)> {
        reduced(slf, (slf.get().svg.clone(), slf.get().caption.clone()))
    }

    #[staticmethod]
    fn _restore(parts: (String, String)) -> Self {
        let (svg, caption) = parts;
        Self { svg, caption }
    }

    /// Writes the SVG text to a file.
    ///
    /// Parameters
    /// ----------
    /// path : str or PathLike
    ///     File to write; an existing file is replaced.
    fn save(&self, path: std::path::PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, &self.svg)?)
    }
}

impl From<Figure> for Svg {
    fn from(figure: Figure) -> Self {
        Self { svg: figure.scaled("style=\"max-width:100%;height:auto\""), caption: figure.caption }
    }
}
