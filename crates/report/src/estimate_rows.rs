//! Rows of estimates for tables of any front end: identified combinations first where a parameter is not identified, then the parameters;
//! those that are not identified are one row at the end.

use motorfit_identify::{Combination, Identification, Machine, ParameterEstimate};

/// A row of a table of estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateRow {
    /// Name, as `R`; several, separated by commas, of parameters that are not identified.
    pub name: String,
    /// Description; empty for none.
    pub description: String,
    /// Index of the recording that the parameter belongs to; `None` if all recordings share it.
    pub recording: Option<usize>,
    /// Value; `None` if it is not identified.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// Standard error in the same unit.
    pub std_error: Option<f64>,
    /// 95 % confidence interval.
    pub ci95: Option<[f64; 2]>,
    /// Bounds of a free parameter.
    pub bounds: Option<[f64; 2]>,
    /// Bound at which the value is, `min` or `max`.
    pub at_bound: Option<&'static str>,
    /// Reason for which there is no standard error, or the kind of row; empty for an estimated parameter.
    pub remark: String,
}

impl EstimateRow {
    fn of_parameter(e: &ParameterEstimate) -> Self {
        Self {
            name: e.name.clone(),
            description: e.description.clone(),
            recording: e.recording,
            value: e.value,
            unit: e.unit.clone(),
            std_error: e.std_error,
            ci95: e.ci95,
            bounds: e.bounds,
            at_bound: e.at_bound,
            remark: e.remark().to_owned(),
        }
    }

    fn of_combination(c: &Combination) -> Self {
        Self {
            name: c.name.replace('_', " "),
            value: Some(c.value),
            unit: c.unit.clone(),
            std_error: Some(c.std_error),
            ci95: Some(c.ci95),
            ..Self::named(String::new(), "identified combination".to_owned())
        }
    }

    fn named(name: String, remark: String) -> Self {
        let (description, unit) = (String::new(), String::new());
        let (recording, value, std_error, ci95, bounds, at_bound) = (None, None, None, None, None, None);
        Self { name, description, recording, value, unit, std_error, ci95, bounds, at_bound, remark }
    }
}

/// Returns the rows of the estimates of a result.
#[must_use]
pub fn estimate_rows<M: Machine>(found: &Identification<M>) -> Vec<EstimateRow> {
    let combinations = found.machine.combinations().iter().map(EstimateRow::of_combination);
    let is_open = |e: &&ParameterEstimate| e.value.is_none() && !e.fixed;
    let (open, known): (Vec<&ParameterEstimate>, Vec<_>) = found.estimates.iter().partition(is_open);
    if open.len() < 2 {
        return found.estimates.iter().map(EstimateRow::of_parameter).chain(combinations).collect();
    }
    let mut rows: Vec<EstimateRow> = combinations.collect();
    rows.extend(known.into_iter().map(EstimateRow::of_parameter));
    let needs = M::missing_channel(found).map_or_else(String::new, |needs| format!(" without {needs}"));
    let mut names: Vec<&str> = open.iter().map(|e| e.name.as_str()).collect();
    names.dedup();
    rows.push(EstimateRow::named(names.join(", "), format!("not identifiable{needs}")));
    rows
}
