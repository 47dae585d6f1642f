//! Levels of trust in the results of a sweep: of each run, and counted.

use motorfit_identify::{Trust, TrustLevel};
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;

/// Level of trust in the result of a run, as stored on its line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunTrust {
    /// Level of trust.
    pub level: TrustLevel,
    /// Codes of the reasons, the most severe first; empty if the level is good.
    pub reasons: Vec<String>,
}

impl From<&Trust> for RunTrust {
    fn from(trust: &Trust) -> Self {
        Self { level: trust.level, reasons: trust.reasons.iter().map(|reason| reason.code.to_owned()).collect() }
    }
}

/// Numbers of results by level of trust.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct LevelCounts {
    /// Number of results whose standard errors are reliable.
    pub good: u64,
    /// Number of results whose reasons should be checked before use.
    pub check: u64,
    /// Number of results whose standard errors are not reliable.
    pub poor: u64,
    /// Number of results without a level, written by earlier versions of the program.
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

    /// Returns the number of results whose level is not good or is unknown.
    #[must_use]
    pub fn not_good(&self) -> u64 {
        self.check.saturating_add(self.poor).saturating_add(self.unknown)
    }

    /// Returns true if any result has a level.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.good > 0 || self.check > 0 || self.poor > 0
    }
}

/// Numbers of results by level of trust and by reason.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct TrustCounts {
    /// Numbers of results by level.
    #[serde(flatten)]
    pub levels: LevelCounts,
    /// Numbers of results by code of the reason.
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

    /// Returns the codes of the reasons with the number of results that have them, the most frequent first.
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
