//! Sections of a page that results of the DC motor have beside those of all machines.

use super::held_out::held_out;
use super::identified::{noise_floor_text, with_error};
use super::identified_tables::{characteristics_table, transfer_functions};
use super::page::{Part, Section};
use super::pages::section;
use motorfit_identify::Identification;
use motorfit_identify::analysis::{Characteristics, Named};

/// Returns the dynamics, the model selection and the fit of held-out recordings.
pub(super) fn sections(found: &Identification) -> Vec<Section> {
    let dynamics = transfer_functions(found).map(Part::List).into_iter();
    let dynamics = dynamics.chain([Part::Table(characteristics_table(found))]).collect();
    let mut sections = vec![section("Dynamics", dynamics)];
    sections.extend(found.validation.as_ref().map(|held| section("Held-out recordings", held_out(found, held))));
    if let (Some(of), None) = (&found.noise_floor, &found.validation) {
        sections.push(section("Noise floor", vec![Part::Text(format!("{}.", noise_floor_text(of)))]));
    }
    sections
}

/// Returns the characteristics as a sentence if parameters are not identifiable; they are the result then.
pub(super) fn instead(found: &Identification) -> String {
    let shown = |(name, unit, c): &Named| Some(format!("{} = {} {unit}", name.replace('_', " "), with_error((*c)?)));
    if found.unidentified.is_empty() {
        return String::new();
    }
    let list: Vec<String> = Characteristics::named_of(found).iter().filter_map(shown).collect();
    if list.is_empty() { String::new() } else { format!("The recordings identify {}.", list.join(", ")) }
}
