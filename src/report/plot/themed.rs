//! Drawings for files, whose colours follow the reader's light or dark colour scheme.

/// Colours of the dark scheme. The plotting library writes black and white as names or numbers, and text without a
/// colour.
const STYLE: &str = "<style>@media (prefers-color-scheme: dark) {\
    rect[fill=\"white\" i], rect[fill=\"#ffffff\" i] { fill: #16181b }\
    text:not([fill]), text[fill=\"#000000\"], text[fill=\"black\"] { fill: #e8e8e8 }\
    [stroke=\"#cccccc\" i] { stroke: #44484d }\
    [stroke=\"#000000\"], [stroke=\"black\"] { stroke: #e8e8e8 }\
    [fill=\"#000000\"]:not(text), [fill=\"black\"]:not(text) { fill: #e8e8e8 }\
    [stroke=\"#0072b2\" i] { stroke: #4f9fd6 } [fill=\"#0072b2\" i] { fill: #4f9fd6 }\
    }</style>";

/// Returns a drawing that is legible on a light and on a dark background.
#[must_use]
pub fn themed(svg: &str) -> String {
    match svg.split_once('>') {
        Some((head, rest)) => [head, ">", STYLE, rest].concat(),
        None => svg.to_owned(),
    }
}
