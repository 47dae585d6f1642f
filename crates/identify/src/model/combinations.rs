//! Parameters that recordings cannot distinguish: groups in words, and the combinations that are identified nevertheless.
//!
//! Along an unidentifiable direction the logarithms of the parameters of a group change in fixed ratios. Elimination names the
//! fewest parameters whose values determine the others, and the exponents of the others: with `d ln J = 1 d ln K` the ratio J/K is
//! identified. The result does not depend on the coordinates of the parameters, nor on the basis of the directions.

use crate::estimates::Combination;
use motorfit_core::coordinate::Coordinate;
use motorfit_core::text::listed;
use motorfit_estimate::{Uncertainty, student95};
use motorfit_evaluate::model::{ModelAxis, ModelProblem};

/// Exponent below which a parameter does not change with another: rounding of a direction.
const APART: f64 = 1e-5;
/// Relative difference of exponents that are equal in words.
const PART: f64 = 0.02;
/// Difference of an exponent from a simple number up to which it is that number: directions of exact groups agree far better.
const SIMPLE: f64 = 1e-3;
/// Ratio of components from which they are equal but for rounding.
const EQUAL: f64 = 0.999;
/// Width of the 95 % interval of the logarithm of a product of powers above which it is not known: a decade.
const KNOWN: f64 = std::f64::consts::LN_10;
/// Smallest component from which an elimination goes on.
const PIVOT: f64 = 1e-6;

/// A parameter that takes part in an unidentifiable direction.
#[derive(Debug, Clone)]
struct Member {
    name: String,
    unit: String,
    value: f64,
    /// Derivative of the logarithm of the value with respect to the coordinate.
    rate: f64,
    /// Number among the free parameters.
    axis: usize,
    /// Exponents with respect to the parameters to fix.
    exponents: Vec<f64>,
}

/// The parameters that take part in unidentifiable directions.
#[derive(Debug, Clone, Default)]
pub(super) struct Open {
    members: Vec<Member>,
    /// Numbers of the members to fix, one for each direction.
    fixed: Vec<usize>,
    covariance: Vec<Vec<f64>>,
    quantile: f64,
}

impl Open {
    pub fn new(problem: &ModelProblem, values: &[f64], uncertainty: &Uncertainty) -> Self {
        let axes = &problem.space().free;
        let names = problem.space().names(problem.model());
        let member = |axis: usize| {
            let own: &ModelAxis = &axes[axis];
            let range: Coordinate = own.range();
            let value = values[axis];
            // A value of zero has no logarithm; its own range takes the place of its magnitude.
            let rate = if value == 0.0 { 1.0 } else { range.slope(value) / value };
            let unit = problem.model().parameters()[own.parameter].unit.text.clone();
            Member { name: names[axis].clone(), unit, value, rate, axis, exponents: Vec::new() }
        };
        let mut members: Vec<Member> = (0..axes.len()).filter(|n| uncertainty.open[*n]).map(member).collect();
        let weights: Vec<f64> = members.iter().map(|of| of.rate.abs().recip()).collect();
        let row = |direction: &Vec<f64>| members.iter().map(|of| direction[of.axis] * of.rate).collect();
        let mut rows: Vec<Vec<f64>> = uncertainty.unidentifiable.iter().map(row).collect();
        let mut fixed = eliminated(&mut rows, &weights);
        if let ([row], [pivot]) = (&mut rows[..], &mut fixed[..]) {
            *pivot = of_most(row, *pivot);
            let divisor = row[*pivot];
            row.iter_mut().for_each(|value| *value /= divisor);
        }
        for (n, member) in members.iter_mut().enumerate() {
            member.exponents = rows[..fixed.len()].iter().map(|row| row[n]).collect();
        }
        let quantile = student95(problem.counted().saturating_sub(axes.len()));
        Self { members, fixed, covariance: uncertainty.covariance.clone(), quantile }
    }

    /// Returns the groups: members that change together, as numbers, with the numbers of those to fix.
    fn groups(&self) -> Vec<(Vec<usize>, Vec<usize>)> {
        let mut groups: Vec<(Vec<usize>, Vec<usize>)> = Vec::new();
        for (place, pivot) in self.fixed.iter().enumerate() {
            let own = (0..self.members.len()).filter(|n| self.members[*n].exponents[place].abs() > APART);
            let (mut members, mut fixed): (Vec<usize>, Vec<usize>) = (own.collect(), vec![*pivot]);
            let shares = |group: &(Vec<usize>, Vec<usize>)| group.0.iter().any(|n| members.contains(n));
            let (joined, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(shares);
            joined.into_iter().for_each(|(others, more)| {
                members.extend(others);
                fixed.extend(more);
            });
            members.sort_unstable();
            members.dedup();
            groups = apart;
            groups.push((members, fixed));
        }
        groups
    }

    /// Returns a sentence on each group.
    pub fn sentences(&self) -> Vec<String> {
        self.groups().iter().map(|(members, fixed)| self.sentence(members, fixed)).collect()
    }

    fn sentence(&self, members: &[usize], fixed: &[usize]) -> String {
        let name = |n: &usize| self.members[*n].name.as_str();
        let names: Vec<&str> = members.iter().map(name).collect();
        let known = |n: &usize| self.combination(*n).map(|combination| combination.name);
        match (members, fixed) {
            ([only], _) => format!("{} has no effect on the outputs", name(only)),
            ([a, b], [pivot]) => {
                let other = if a == pivot { b } else { a };
                let rest = match known(other) {
                    Some(known) if known.contains('*') => format!(": only the product {known} is identified"),
                    Some(known) if known.contains('/') => format!(": only the ratio {known} is identified"),
                    Some(known) => format!(": only {known} is identified"),
                    None => String::new(),
                };
                format!("{} cannot be told apart{rest}", listed(&names, "and"))
            }
            (_, [pivot]) => {
                let is_scale = |n: &usize| (self.members[*n].exponents[0].abs() - 1.0).abs() < PART;
                let (scale, others): (Vec<usize>, Vec<usize>) =
                    members.iter().partition(|n| *n == pivot || is_scale(n));
                let scale: Vec<&str> = scale.iter().map(name).collect();
                let others: Vec<&str> = others.iter().map(name).collect();
                let rest = match others.len() {
                    0 => String::new(),
                    1 => format!(", and {} changes with it", others[0]),
                    _ => format!(", and {} change with it", listed(&others, "and")),
                };
                format!("{} share one unknown scale{rest}: fix one of them", listed(&scale, "and"))
            }
            _ => {
                let fixed: Vec<&str> = fixed.iter().map(name).collect();
                format!(
                    "{} cannot be told apart: fix {} of them, as {}",
                    listed(&names, "and"),
                    fixed.len(),
                    listed(&fixed, "and")
                )
            }
        }
    }

    /// Returns the combinations that are identified.
    pub fn identified(&self) -> Vec<Combination> {
        let others = (0..self.members.len()).filter(|n| !self.fixed.contains(n));
        others.filter_map(|n| self.combination(n)).collect()
    }

    /// Returns true if a member is a power of those to fix with simple exponents.
    fn is_power(&self, n: usize) -> bool {
        self.members[n].exponents.iter().all(|exponent| simple(*exponent).is_some())
    }

    /// Returns the combination of a member with those to fix that is identified; `None` if it has no simple form.
    fn combination(&self, n: usize) -> Option<Combination> {
        let own = &self.members[n];
        if self.is_power(n) {
            return self.power(n);
        }
        // Two parameters of the same unit whose sum or difference is known.
        let change = |of: &Member| of.value * of.exponents[0];
        let beside = |other: &&Member| {
            other.unit == own.unit
                && other.axis != own.axis
                && (change(own).abs() / change(other).abs() - 1.0).abs() < SIMPLE
        };
        let other = self.members.iter().filter(|_| self.fixed.len() == 1).find(beside)?;
        let (own, other) = if own.axis < other.axis { (own, other) } else { (other, own) };
        let sign = -(change(own) / change(other)).signum();
        let value = own.value + sign * other.value;
        let slopes = [(own, own.value * own.rate), (other, sign * other.value * other.rate)];
        let error = self.error(&slopes);
        let name = format!("{} {} {}", own.name, if sign > 0.0 { "+" } else { "−" }, other.name);
        let ci95 = [value - self.quantile * error, value + self.quantile * error];
        Some(Combination { name, value, unit: own.unit.clone(), std_error: error, ci95 }).filter(|_| error.is_finite())
    }

    /// Returns the product of powers of a member and those to fix that does not change along the directions.
    fn power(&self, n: usize) -> Option<Combination> {
        let own = &self.members[n];
        let exponents: Vec<f64> = own.exponents.iter().map(|exponent| simple(*exponent)).collect::<Option<_>>()?;
        // Whole exponents: those of halves are doubled.
        let factor = if exponents.iter().all(|exponent| exponent.fract() == 0.0) { 1.0 } else { 2.0 };
        let of_fixed =
            self.fixed.iter().zip(&exponents).map(|(pivot, exponent)| (&self.members[*pivot], -factor * exponent));
        let mut parts: Vec<(&Member, f64)> =
            std::iter::once((own, factor)).chain(of_fixed.filter(|(_, exponent)| *exponent != 0.0)).collect();
        parts.sort_by_key(|(of, _)| of.axis);
        let value = parts.iter().map(|(of, exponent)| of.value.powf(*exponent)).product::<f64>();
        let slopes: Vec<(&Member, f64)> = parts.iter().map(|(of, exponent)| (*of, exponent * of.rate)).collect();
        let relative = self.error(&slopes);
        if 2.0 * self.quantile * relative > KNOWN * factor {
            return None;
        }
        let ends = [-1.0, 1.0].map(|sign| value * (sign * self.quantile * relative).exp());
        let ci95 = if value > 0.0 { ends } else { [ends[1], ends[0]] };
        let named =
            |of: fn(&Member) -> &str| product(&parts.iter().map(|(part, e)| (of(part), *e)).collect::<Vec<_>>());
        let std_error = relative * value.abs();
        let [name, unit] = [named(|of| &of.name), named(|of| &of.unit)];
        Some(Combination { name, value, unit, std_error, ci95 })
            .filter(|of| of.value.is_finite() && of.std_error.is_finite())
    }

    /// Returns the standard error of a function of members from its derivatives with respect to their coordinates.
    fn error(&self, slopes: &[(&Member, f64)]) -> f64 {
        let pairs = slopes.iter().flat_map(|(a, x)| slopes.iter().map(move |(b, y)| (a.axis, b.axis, x * y)));
        pairs.map(|(a, b, product)| product * self.covariance[a][b]).sum::<f64>().max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests;

/// Brings rows to reduced echelon form; returns the columns of its pivots, those with the largest weighted component.
fn eliminated(rows: &mut Vec<Vec<f64>>, weights: &[f64]) -> Vec<usize> {
    let mut pivots = Vec::new();
    for done in 0..rows.len() {
        let size = |row: &[f64], n: usize| row[n].abs() * weights[n];
        let places: Vec<(usize, usize)> =
            (done..rows.len()).flat_map(|row| (0..weights.len()).map(move |n| (row, n))).collect();
        let largest = places.iter().map(|(row, n)| size(&rows[*row], *n)).fold(0.0, f64::max);
        // Of components that are equal but for rounding the last one, whatever the basis.
        let Some((row, pivot)) = places.into_iter().rev().find(|(row, n)| size(&rows[*row], *n) > EQUAL * largest)
        else {
            break;
        };
        if size(&rows[row], pivot) < PIVOT {
            break;
        }
        rows.swap(done, row);
        let divisor = rows[done][pivot];
        rows[done].iter_mut().for_each(|value| *value /= divisor);
        let own = rows[done].clone();
        for (_, other) in rows.iter_mut().enumerate().filter(|(n, _)| *n != done) {
            let factor = other[pivot];
            other.iter_mut().zip(&own).for_each(|(value, own)| *value -= factor * own);
        }
        pivots.push(pivot);
    }
    rows.truncate(pivots.len());
    pivots
}

/// Returns the member of a single direction whose exponent most others have too; the last of several.
fn of_most(row: &[f64], pivot: usize) -> usize {
    let alike = |n: usize| row.iter().filter(|other| ((*other / row[n]).abs() - 1.0).abs() < PART).count();
    (0..row.len()).filter(|n| row[*n].abs() > PART).max_by_key(|n| alike(*n)).unwrap_or(pivot)
}

/// Returns the multiple of a half that an exponent is, up to 3; `None` if it is none.
fn simple(exponent: f64) -> Option<f64> {
    let nearest = (2.0 * exponent).round() / 2.0;
    ((exponent - nearest).abs() < SIMPLE && nearest.abs() <= 3.0).then_some(nearest)
}

/// Returns a product of powers as text, as `J/K^2`.
fn product(parts: &[(&str, f64)]) -> String {
    let one = |(name, exponent): &(&str, f64)| {
        let is_compound = name.contains(['*', '/', '^']);
        // Exponents are whole numbers.
        match (exponent.abs() < 1.5, is_compound) {
            (true, false) => (*name).to_owned(),
            (true, true) => format!("({name})"),
            (false, false) => format!("{name}^{}", exponent.abs()),
            (false, true) => format!("({name})^{}", exponent.abs()),
        }
    };
    let of = |sign: f64| parts.iter().filter(|(_, e)| e * sign > 0.0).map(one).collect::<Vec<_>>();
    let (above, below) = (of(1.0).join("*"), of(-1.0));
    below.iter().fold(above, |text, part| format!("{text}/{part}"))
}
