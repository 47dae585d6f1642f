//! Stage 1, prepare: makes the two problems of an identification, that of the search and that of the fit, once for all stages.

use super::current_driven::current_driven;
use super::missing_channel::single_channel;
use super::normalized::NormalizedModel;
use super::spec::IdentifySpec;
use motorfit_core::Result;
use motorfit_estimate::{fit_problem, signal_deviations};
use motorfit_evaluate::Problem;
use motorfit_motor::{Extension, Parameter, Space, With};
use motorfit_record::Record;
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::OnceLock;

/// Recordings and spec as all later stages use them.
pub(super) struct Prepared<'a> {
    pub records: &'a [Record],
    /// The spec; if a channel is missing, with the space of the normalized model.
    pub spec: Cow<'a, IdentifySpec>,
    /// Representative of all motors consistent with recordings that lack a channel; `None` if no channel is missing.
    pub normalized: Option<NormalizedModel>,
    /// Problem of the search, with the criterion of the spec.
    searched: Problem,
    /// Problem of the fit, with unit weights until the errors are divided by σ.
    fitted: Problem,
    /// Standard deviations of the signals, computed on first use.
    deviations: OnceLock<Vec<Vec<f64>>>,
}

impl<'a> Prepared<'a> {
    /// Prepares recordings for a spec. If a channel is missing, a normalized model replaces the space of the spec.
    ///
    /// # Errors
    /// Propagates the errors of [`Problem::new`], and returns `Usage` if recordings without a voltage are to be fitted with a
    /// method or an extension that needs one.
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

    /// Prepares recordings for a spec without a normalized model, also if a channel is missing.
    pub(super) fn as_given(records: &'a [Record], spec: &'a IdentifySpec) -> Result<Self> {
        Self::with(records, Cow::Borrowed(spec), None)
    }

    /// Reuses the problems `searched` and `fitted` that were made of these recordings before.
    pub(super) fn given(records: &'a [Record], spec: &'a IdentifySpec, searched: &Problem, fitted: &Problem) -> Self {
        let (searched, fitted) = (searched.clone(), fitted.clone());
        let spec = Cow::Borrowed(spec);
        Self { records, spec, normalized: None, searched, fitted, deviations: OnceLock::new() }
    }

    /// Prepares other recordings under the same spec.
    pub(super) fn of<'b>(&'b self, records: &'b [Record]) -> Result<Prepared<'b>> {
        Prepared::with(records, Cow::Borrowed(self.spec.as_ref()), None)
    }

    fn with(records: &'a [Record], spec: Cow<'a, IdentifySpec>, normalized: Option<NormalizedModel>) -> Result<Self> {
        let searched = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
        let fitted = fit_problem(records, &spec.space, spec.model)?;
        Ok(Self { records, spec, normalized, searched, fitted, deviations: OnceLock::new() })
    }

    /// Returns the problem of the search in `space`.
    pub(super) fn searched(&self, space: Space) -> Arc<Problem> {
        Arc::new(self.searched.with_space(space))
    }

    /// Returns the problem of the fit in `space`.
    pub(super) fn fitted(&self, space: &Space) -> Problem {
        self.fitted.with_space(space.clone())
    }

    /// Returns the problem of the fit in the space of the spec.
    pub(super) fn plain(&self) -> &Problem {
        &self.fitted
    }

    /// Returns the standard deviations of current \[A\] and speed \[rad/s\] of each recording.
    pub(super) fn deviations(&self) -> &[Vec<f64>] {
        self.deviations.get_or_init(|| signal_deviations(self.records))
    }

    /// Returns true if the model is the linear motor and no channel is missing, so that one estimate suffices as a start.
    pub(super) fn is_linear(&self) -> bool {
        self.normalized.is_none() && !self.spec.is_extended()
    }

    /// Returns the extensions that the spec names; `None` if they are to be selected.
    pub(super) fn named(&self) -> Option<&[Extension]> {
        if let With::These(list) = &self.spec.with { Some(list) } else { None }
    }

    /// Returns the parameters that are not identifiable because a channel is missing.
    pub(super) fn open(&self) -> &[Parameter] {
        self.normalized.as_ref().map_or(&[], |model| &model.unknown)
    }
}
