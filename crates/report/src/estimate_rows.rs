//! Rows of estimates for tables of any front end: identified combinations first where parameters are not identified, then the parameters;
//! those that are not identified are one row at the end.

use motorfit_identify::{Combination, Identification, Machine, ParameterEstimate};

/// A row of a table of estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct EstimateRow {
    /// Estimate of a parameter or a combination. Several parameters that are not identified have their names, separated by commas, and no
    /// unit.
    pub estimate: ParameterEstimate,
    /// Reason for which there is no standard error, or the kind of row; empty for an estimated parameter.
    pub remark: String,
}

impl EstimateRow {
    fn of_parameter(estimate: &ParameterEstimate) -> Self {
        Self { estimate: estimate.clone(), remark: estimate.remark().to_owned() }
    }

    fn of_combination(c: &Combination) -> Self {
        let (std_error, ci95) = (Some(c.std_error), Some(c.ci95));
        let named = ParameterEstimate::named(&c.name.replace('_', " "), &c.unit);
        let estimate = ParameterEstimate { value: Some(c.value), std_error, ci95, ..named };
        Self { estimate, remark: "identified combination".to_owned() }
    }

    /// Returns true if the row is of several parameters that are not identified.
    #[must_use]
    pub fn is_list(&self) -> bool {
        self.estimate.value.is_none() && self.estimate.unit.is_empty()
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
    let mut rows: Vec<EstimateRow> = combinations.chain(known.into_iter().map(EstimateRow::of_parameter)).collect();
    let needs = M::missing_channel(found).map_or_else(String::new, |needs| format!(" without {needs}"));
    let mut names: Vec<&str> = open.iter().map(|e| e.name.as_str()).collect();
    names.dedup();
    let estimate = ParameterEstimate::named(&names.join(", "), "");
    rows.push(EstimateRow { estimate, remark: format!("not identifiable{needs}") });
    rows
}
