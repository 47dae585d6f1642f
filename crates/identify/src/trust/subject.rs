//! The subject of a level of trust: the parameters and combinations that the recordings identify. Parameters that need a channel that was
//! not recorded are no reason against it, unless they were asked for.

use crate::estimates::ParameterEstimate;
use crate::machine::Machine;
use crate::result::Identification;
use crate::trust_level::TrustLevel::{self, Check};
use motorfit_core::setting::Text;

/// The parameters and combinations to which the level of trust in a result applies.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Subject {
    /// Names of the identified parameters and combinations.
    pub of: Vec<String>,
    /// Names of the parameters that the recordings do not identify.
    pub open: Vec<String>,
    /// Channel that would identify these.
    pub needs: Option<String>,
    /// True if parameters were asked for: others are fixed.
    pub is_asked: bool,
}

impl Subject {
    /// Returns the subject of a result; `is_asked` if parameters are fixed so that others become identifiable.
    pub fn new<M: Machine>(found: &Identification<M>, is_asked: bool) -> Self {
        let unknown = |e: &&ParameterEstimate| e.value.is_none() && !e.fixed;
        let known = |e: &&ParameterEstimate| e.value.is_some() && e.std_error.is_some();
        let name = |e: &ParameterEstimate| e.name.clone();
        let mut open: Vec<String> = found.estimates.iter().filter(unknown).map(name).collect();
        let combinations = found.machine.combinations().iter().filter(|_| !open.is_empty());
        let mut of: Vec<String> = combinations.map(|of| of.name.clone()).collect();
        of.extend(found.estimates.iter().filter(known).map(name));
        of.dedup();
        open.dedup();
        let needs = M::missing_channel(found).filter(|_| !open.is_empty());
        Self { of, open, needs, is_asked }
    }

    /// Returns true if the open parameters need a channel and were not asked for, while others are identified.
    pub fn is_excused(&self) -> bool {
        self.needs.is_some() && !self.is_asked && !self.of.is_empty()
    }

    /// Returns the reason that parameters are not identified, if a missing channel is its cause, or nothing is identified.
    pub fn reason(&self) -> Option<(TrustLevel, &'static str, Text)> {
        match &self.needs {
            _ if self.of.is_empty() => Some((Check, "not_identifiable", "no parameter is identified".into())),
            Some(_) if self.is_asked => {
                Some((Check, "not_identifiable", "not all that was asked for is identifiable".into()))
            }
            _ => None,
        }
    }
}
