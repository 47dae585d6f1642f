//! `Svg`: figures.

use crate::answers::{Reduced, reduced};
use crate::errors::Raise as _;
use motorfit::Error;
use motorfit::file::replace;
use motorfit::report::{Chart, Figure, Part, html_fragment};
use pyo3::exceptions::PyImportError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::io::Write as _;
use std::path::PathBuf;

/// Figure as SVG: `str(figure)` is the SVG text, `save(path)` writes it to a file, notebooks display it in their own colours. It
/// can be pickled.
#[pyclass(frozen, module = "motorfit")]
pub struct Svg(Figure);

/// Fields of a figure, for pickle.
type Fields = (String, String, String, String, bool);

/// Attributes with which a figure fits a narrow page.
const FITTING: &str = "style=\"max-width:100%;height:auto\"";
/// Pixels per unit of length of a PNG.
const ZOOM: f64 = 2.0;

#[pymethods]
impl Svg {
    /// Caption of the figure.
    #[getter]
    fn caption(&self) -> &str {
        &self.0.caption
    }

    fn _repr_svg_(&self) -> String {
        self.0.file(FITTING, false)
    }

    fn _repr_html_(&self) -> String {
        self.html()
    }

    fn __str__(&self) -> String {
        self._repr_svg_()
    }

    fn __repr__(&self) -> String {
        format!("<Svg {}>", self.0.caption)
    }

    /// Returns the object itself, which is immutable.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Returns the object itself, which is immutable.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py, Fields> {
        let Figure { id, svg, alternative, caption, map } = slf.get().0.clone();
        reduced(slf, (id, svg, alternative, caption, map))
    }

    #[staticmethod]
    fn _restore(fields: Fields) -> Self {
        let (id, svg, alternative, caption, map) = fields;
        Self(Figure { id, svg, alternative, caption, map })
    }

    /// Writes the figure to a file, in the format of its suffix.
    ///
    /// Parameters
    /// ----------
    /// path : str or PathLike
    ///     File to write, with the suffix .svg, or .png on white; an existing file is replaced. PNG needs
    ///     `pip install motorfit[png]`.
    ///
    /// Raises
    /// ------
    /// UsageError
    ///     If the suffix is another one.
    /// DataError
    ///     If the file cannot be written; `MissingFileError` if its folder does not exist.
    /// ImportError
    ///     If a PNG is asked for without resvg_py.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_lowercase());
        let bytes = match suffix.as_deref() {
            Some("svg") => self._repr_svg_().into_bytes(),
            Some("png") => self.png(py, &path)?,
            _ => {
                let message = "the suffix names no format of figures";
                return Err(Error::usage(message, "Give a path that ends in .svg or .png.").in_file(&path)).raise(py);
            }
        };
        let unwritable = |error: std::io::Error| motorfit::file::unwritable(&path, &error);
        py.detach(|| replace(&path, |file| file.write_all(&bytes).map_err(unwritable))).raise(py)
    }
}

impl Svg {
    /// Returns the figure as HTML in the colours of the text around it.
    pub fn html(&self) -> String {
        html_fragment(&[Part::Figure(self.0.clone())])
    }

    fn png(&self, py: Python<'_>, path: &std::path::Path) -> PyResult<Vec<u8>> {
        let missing = |_| {
            let advice =
                "a PNG needs the package resvg_py: pip install motorfit[png], or give a path that ends in .svg";
            PyImportError::new_err(format!("{}: {advice}", path.display()))
        };
        let draw = py.import("resvg_py").map_err(missing)?.getattr("svg_to_bytes")?;
        let options = PyDict::new(py);
        options.set_item("svg_string", self.0.file(FITTING, true))?;
        options.set_item("background", "#ffffff")?;
        options.set_item("zoom", ZOOM)?;
        draw.call((), Some(&options))?.extract()
    }
}

impl From<Figure> for Svg {
    fn from(figure: Figure) -> Self {
        Self(figure)
    }
}

impl From<Chart> for Svg {
    fn from(chart: Chart) -> Self {
        Self(chart.figure())
    }
}
