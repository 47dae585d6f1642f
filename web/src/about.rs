//! Tables of the library for the page: settings, quantities with their units, searches, extensions, models.

use crate::given::rows;
use crate::spelling::in_page;
use motorfit::model::BuiltIn;
use motorfit::motor::Extension;
use motorfit::named::Named;
use motorfit::optimize::SEARCHES;
use motorfit::record::Quantity;
use motorfit::settings::{Kind, Row};
use serde_json::{Value, json};
use wasm_bindgen::prelude::wasm_bindgen;

/// Returns the version of the library and its tables, as JSON.
#[wasm_bindgen]
#[must_use]
pub fn about() -> String {
    let quantity = |of: Quantity| json!({ "name": of.key(), "units": of.units().collect::<Vec<_>>() });
    let extension = |of: Extension| json!({ "name": of.name(), "text": of.text() });
    let model = |of: &BuiltIn| {
        let title = of.text().split('.').next().unwrap_or_default().to_owned();
        json!({ "name": of.name(), "title": title, "text": of.source() })
    };
    let document = json!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "settings": rows().iter().map(setting).collect::<Vec<_>>(),
        "quantities": Quantity::COLUMNS.map(quantity),
        "extensions": Extension::ALL.map(extension),
        "models": BuiltIn::ALL.iter().map(model).collect::<Vec<_>>(),
        "searches": SEARCHES.map(|search| json!({ "name": search.name, "text": search.text })),
    });
    document.to_string()
}

fn setting(row: &Row) -> Value {
    let (kind, choices) = match &row.kind {
        Kind::Switch => ("switch", Vec::new()),
        Kind::Number => ("number", Vec::new()),
        Kind::Count => ("count", Vec::new()),
        Kind::Word => ("word", Vec::new()),
        Kind::List => ("list", Vec::new()),
        Kind::Choice(list) => {
            ("choice", list.iter().map(|(name, text)| json!({ "name": name, "text": text })).collect())
        }
    };
    json!({
        "name": row.setting.name(),
        "topic": row.topic,
        "kind": kind,
        "choices": choices,
        "default": row.default,
        "example": row.example,
        "text": row.text.spelled(in_page),
    })
}
