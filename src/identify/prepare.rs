//! Stage 1, prepare: recordings, their signals and the two problems of an identification, made once.

use super::current_driven::current_driven;
use super::missing_channel::single_channel;
use super::normalized::NormalizedModel;
use super::spec::IdentifySpec;
use crate::Result;
use crate::estimate::{fit_problem, signal_deviations};
use crate::evaluate::Problem;
use crate::motor::{Extension, Parameter, Space, With};
use crate::record::Record;
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::OnceLock;

/// Recordings and spec, ready for every later stage.
pub(super) struct Prepared<'a> {
    pub records: &'a [Record],
    /// The spec; where a channel is missing, its space is that of the normalized model.
    pub spec: Cow<'a, IdentifySpec>,
    /// The representative of all motors consistent with recordings that lack a channel.
    pub normalized: Option<NormalizedModel>,
    /// The problem of a search, in the criterion of the spec.
    searched: Problem,
    /// The problem of a fit: errors have unit weights until they are divided by σ.
    fitted: Problem,
    deviations: OnceLock<Vec<[f64; 2]>>,
}

impl<'a> Prepared<'a> {
    /// Prepares recordings for a spec.
    ///
    /// # Errors
    /// As for a problem, and `Usage` for a spec that asks recordings without a voltage for what acts on one.
    pub(super) fn new(records: &'a [Record], spec: Cow<'a, IdentifySpec>) -> Result<Self> {
        let normalized = match current_driven(records, &spec)? {
            Some(model) => Some(model),
            None => single_channel(records, &spec)?,
        };
        let spec = match &normalized {
            Some(model) => Cow::Owned(IdentifySpec { space: model.space.clone(), ..spec.into_owned() }),
            None => spec,
        };
        Self::with(records, spec, normalized)
    }

    /// Prepares recordings for a spec as it is, whatever channels they lack.
    pub(super) fn as_given(records: &'a [Record], spec: &'a IdentifySpec) -> Result<Self> {
        Self::with(records, Cow::Borrowed(spec), None)
    }

    /// Takes the problem of a search and that of a fit as they were made of the recordings before.
    pub(super) fn given(records: &'a [Record], spec: &'a IdentifySpec, searched: &Problem, fitted: &Problem) -> Self {
        let (searched, fitted) = (searched.clone(), fitted.clone());
        let spec = Cow::Borrowed(spec);
        Self { records, spec, normalized: None, searched, fitted, deviations: OnceLock::new() }
    }

    /// Prepares some of the recordings alike.
    pub(super) fn of<'b>(&'b self, records: &'b [Record]) -> Result<Prepared<'b>> {
        Prepared::with(records, Cow::Borrowed(self.spec.as_ref()), None)
    }

    fn with(records: &'a [Record], spec: Cow<'a, IdentifySpec>, normalized: Option<NormalizedModel>) -> Result<Self> {
        let searched = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
        let fitted = fit_problem(records, &spec.space, spec.model)?;
        Ok(Self { records, spec, normalized, searched, fitted, deviations: OnceLock::new() })
    }

    /// Returns the problem of a search in a space.
    pub(super) fn searched(&self, space: Space) -> Arc<Problem> {
        Arc::new(self.searched.with_space(space))
    }

    /// Returns the problem of a fit in a space.
    pub(super) fn fitted(&self, space: &Space) -> Problem {
        self.fitted.with_space(space.clone())
    }

    /// Returns the problem of a fit in the space of the spec.
    pub(super) fn plain(&self) -> &Problem {
        &self.fitted
    }

    /// Returns the standard deviation of each signal, by recording and channel.
    pub(super) fn deviations(&self) -> &[[f64; 2]] {
        self.deviations.get_or_init(|| signal_deviations(self.records))
    }

    /// Returns whether the linear motor with both channels is asked for: one estimate starts it.
    pub(super) fn is_linear(&self) -> bool {
        self.normalized.is_none() && !self.spec.is_extended()
    }

    /// Returns the extensions that the spec names, and `None` where they are to be selected.
    pub(super) fn named(&self) -> Option<&[Extension]> {
        if let With::These(list) = &self.spec.with { Some(list) } else { None }
    }

    /// Returns the parameters that recordings without a channel leave open.
    pub(super) fn open(&self) -> &[Parameter] {
        self.normalized.as_ref().map_or(&[], |model| &model.unknown)
    }
}
