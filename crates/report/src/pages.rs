//! Sections that several pages have.

use super::page::{Part, Section};
use motorfit_core::setting::Spelling;
use motorfit_core::text::engineering;
use motorfit_record::warning::Warning;
use motorfit_record::{Record, Severity};

/// Command and settings that reproduce a result.
#[derive(Debug, Clone)]
pub struct Reproduced {
    /// Command line.
    pub command: String,
    /// Names and values of all options.
    pub options: Vec<(String, String)>,
}

pub(super) fn section(heading: &str, parts: Vec<Part>) -> Section {
    Section { heading: heading.to_owned(), parts, is_folded: false }
}

/// Returns a section that is closed until the reader opens it.
pub(super) fn folded(heading: &str, parts: Vec<Part>) -> Section {
    Section { is_folded: true, ..section(heading, parts) }
}

/// Returns the warnings that are reported, as a front end spells them.
pub(super) fn warnings(list: &[Warning], spelling: Spelling) -> Vec<Part> {
    list.iter().filter(|w| w.severity == Severity::Report).map(|w| Part::Warning(w.spelled(spelling))).collect()
}

/// Returns the section with the command, settings, device and recordings that reproduce a result.
pub(super) fn reproduce<'a>(
    records: impl IntoIterator<Item = &'a Record>,
    how: &Reproduced,
    device: Option<String>,
) -> Section {
    let mut list = vec![("version".to_owned(), format!("motorfit {}", env!("CARGO_PKG_VERSION")))];
    list.extend(device.map(|device| ("device".to_owned(), device)));
    for record in records {
        let source = record.source();
        let path = source.path.as_ref().map_or("simulated".to_owned(), |path| path.display().to_string());
        let digest = source.sha256.as_ref().map_or(String::new(), |digest| format!(", sha256 {digest}"));
        let period = format!(" every {}", engineering(record.period_s(), "s", 6));
        list.push(("recording".to_owned(), format!("{path}: {} samples{period}{digest}", record.len())));
    }
    list.extend(how.options.iter().cloned());
    folded("Reproduction", vec![Part::Typed(how.command.clone()), Part::List(list)])
}
