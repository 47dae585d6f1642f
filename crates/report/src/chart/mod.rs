//! Charts: panels with curves, dots, bars or boxes over common or own axes, drawn for pages, where they follow the width and the
//! colour scheme and a script can zoom them, and as SVG files. Heat maps and correlation matrices.

mod boxes;
mod drawing;
mod figure;
mod file;
mod heat;
mod histogram;
mod panels;
mod path;
mod scale;

pub(super) use boxes::boxes;
pub(super) use drawing::html;
pub use figure::Figure;
pub(super) use file::{DARK, LIGHT, scoped};
pub(super) use heat::correlation;
pub use heat::{Map, heat_map};
pub(super) use histogram::Histogram;
pub use panels::{Band, Chart, Form, Mark, Panel, Series};
pub use scale::AxisScale;

impl Chart {
    /// Returns the chart as a drawing of a fixed size.
    #[must_use]
    pub fn figure(&self) -> Figure {
        figure(std::slice::from_ref(self))
    }
}

/// Returns charts, one below the other, as a drawing of a fixed size with the identifier, the alternative text and the legend of
/// the first.
pub(super) fn figure(charts: &[Chart]) -> Figure {
    let first = charts.first().cloned().unwrap_or_default();
    let captions: Vec<&str> =
        charts.iter().map(|chart| chart.caption.as_str()).filter(|text| !text.is_empty()).collect();
    Figure {
        id: first.id,
        map: false,
        svg: file::svg(charts),
        alternative: first.alternative,
        caption: captions.join(" "),
    }
}
