//! The level of trust in the results of a sweep: on the line of a run, and counted.

use crate::identify::{Trust, TrustLevel};
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;

/// The level of trust in the result of a run, as its line has it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunTrust {
    /// The level.
    pub level: TrustLevel,
    /// The codes of the reasons, the gravest first; empty where the level is good.
    pub reasons: Vec<String>,
}

impl From<&Trust> for RunTrust {
    fn from(trust: &Trust) -> Self {
        Self { level: trust.level, reasons: trust.reasons.iter().map(|reason| reason.code.to_owned()).collect() }
    }
}

/// Results by their level of trust.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct LevelCounts {
    /// Results whose standard errors can be believed.
    pub good: u64,
    /// Results of which something is to be looked at first.
    pub check: u64,
    /// Results whose standard errors cannot be believed.
    pub poor: u64,
    /// Results without a level, which earlier versions of the program wrote.
    #[serde(skip_serializing_if = "is_zero")]
    pub unknown: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl LevelCounts {
    /// Counts a result.
    pub(super) fn add(&mut self, level: Option<TrustLevel>) {
        *match level {
            Some(TrustLevel::Good) => &mut self.good,
            Some(TrustLevel::Check) => &mut self.check,
            Some(TrustLevel::Poor) => &mut self.poor,
            None => &mut self.unknown,
        } += 1;
    }

    /// Returns the number of results that are not known to be good.
    #[must_use]
    pub fn not_good(&self) -> u64 {
        self.check.saturating_add(self.poor).saturating_add(self.unknown)
    }

    /// Returns whether any result has a level.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.good > 0 || self.check > 0 || self.poor > 0
    }
}

/// Results by their level of trust, and how often each reason was given.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct TrustCounts {
    /// Results by level.
    #[serde(flatten)]
    pub levels: LevelCounts,
    /// Results by the code of each of their reasons.
    #[serde(serialize_with = "commonest_first")]
    pub reasons: BTreeMap<String, u64>,
}

impl TrustCounts {
    /// Counts a result.
    pub(super) fn add(&mut self, trust: Option<&RunTrust>) {
        self.levels.add(trust.map(|trust| trust.level));
        for code in trust.iter().flat_map(|trust| &trust.reasons) {
            *self.reasons.entry(code.clone()).or_default() += 1;
        }
    }

    /// Returns the codes of the reasons with how many results have them, the commonest first.
    #[must_use]
    pub fn commonest(&self) -> Vec<(&str, u64)> {
        let mut all: Vec<(&str, u64)> = self.reasons.iter().map(|(code, runs)| (code.as_str(), *runs)).collect();
        all.sort_by_key(|(_, runs)| std::cmp::Reverse(*runs));
        all
    }
}

fn commonest_first<S: Serializer>(reasons: &BTreeMap<String, u64>, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Reason<'a> {
        code: &'a str,
        runs: u64,
    }
    let counts = TrustCounts { reasons: reasons.clone(), ..TrustCounts::default() };
    serializer.collect_seq(counts.commonest().into_iter().map(|(code, runs)| Reason { code, runs }))
}
