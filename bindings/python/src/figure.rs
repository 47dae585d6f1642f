//! Drawings.

use crate::answers::{Reduced, reduced};
use motorfit::report::Figure;
use pyo3::prelude::*;

/// A drawing: `str(drawing)` is its SVG, `save(path)` writes it, a notebook shows it. It pickles.
#[pyclass(frozen, module = "motorfit")]
pub struct Svg {
    svg: String,
    /// The title.
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

    /// The same: nothing can change it.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// The same: nothing can change it.
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

    /// Writes the SVG to a file.
    fn save(&self, path: std::path::PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, &self.svg)?)
    }
}

impl From<Figure> for Svg {
    fn from(figure: Figure) -> Self {
        Self { svg: figure.scaled("style=\"max-width:100%;height:auto\""), caption: figure.caption }
    }
}
