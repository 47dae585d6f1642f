//! Tests of the invariance of searches: a method that is not biased towards a part of the box finds the same costs in mirrored and
//! in shifted coordinates (J. Kudela, arXiv:2301.01984, 2023). In logarithms every method but a local search moves differently.

use super::invariance_test::{Invariance, InvarianceTest};
use super::precision::{FEW, Precision, logarithm};
use super::result::{Block, Comparison, MethodResult};
use crate::statistics::{holm, paired_interval, superiority, wilcoxon};
use motorfit_core::numeric::{quantile, sorted};
use motorfit_optimize::Coordinates;

impl InvarianceTest {
    /// Returns the method in the coordinates of the parameters, and both blocks; `None` if the comparison does not have them.
    #[must_use]
    pub fn of<'a>(&self, comparison: &'a Comparison) -> Option<(&'a MethodResult, [&'a Block; 2])> {
        let [base, other] = self.blocks.map(|block| comparison.blocks.get(block));
        Some((base?.results.get(self.method)?, [base?, other?]))
    }
}

impl Comparison {
    /// Compares each block in other coordinates with the block in those of the parameters under the same setting.
    pub(super) fn invariance_tests(&self) -> Vec<InvarianceTest> {
        let mut all = Vec::new();
        for (base, block) in self.blocks.iter().enumerate() {
            if block.setting.coordinates != Coordinates::None {
                continue;
            }
            let same = |other: &Block| {
                let setting =
                    super::spec::ComparisonSetting { coordinates: Coordinates::None, ..other.setting.clone() };
                setting == block.setting && other.setting.coordinates != Coordinates::None
            };
            let others: Vec<usize> = (0..self.blocks.len()).filter(|n| same(&self.blocks[*n])).collect();
            all.extend(self.tests(base, &others));
        }
        all
    }

    fn tests(&self, base: usize, others: &[usize]) -> Vec<InvarianceTest> {
        let blocks = || std::iter::once(base).chain(others.iter().copied()).map(|n| &self.blocks[n]);
        let precision = Precision::of(blocks());
        let excess = |block: usize, method: usize| -> Vec<f64> {
            let of = |cost: f64| if cost.is_finite() { precision.excess(cost) } else { f64::INFINITY };
            self.blocks[block].results[method].costs().into_iter().map(of).collect()
        };
        let methods = |other: &usize| self.blocks[base].results.len().min(self.blocks[*other].results.len());
        let pairs = others.iter().flat_map(|other| (0..methods(other)).map(move |method| (*other, method)));
        let test = |(other, method): (usize, usize)| {
            let [before, after] = [base, other].map(|block| excess(block, method));
            self.test([base, other], method, [&before, &after], precision.smallest)
        };
        let mut tests: Vec<InvarianceTest> = pairs.map(test).collect();
        let p_holm = holm(&tests.iter().map(|test| test.p_value).collect::<Vec<_>>());
        for (test, p_holm) in tests.iter_mut().zip(p_holm) {
            test.p_holm = p_holm;
            let runs = self.blocks[base].results[test.method].runs.len();
            test.verdict = match self.blocks[test.blocks[1]].setting.coordinates {
                _ if runs < FEW => Invariance::Few,
                _ if p_holm >= 0.05 => Invariance::Unchanged,
                Coordinates::Log => Invariance::Changed,
                _ => Invariance::Biased,
            };
        }
        tests
    }

    /// Tests a method by its excesses in both coordinates; differences below `smallest` are ties.
    fn test(&self, blocks: [usize; 2], method: usize, [before, after]: [&[f64]; 2], smallest: f64) -> InvarianceTest {
        let median = |values: &[f64]| quantile(&sorted(values), 0.5);
        let difference = |(a, b): (&f64, &f64)| match (a - b).abs() < smallest {
            true => 0.0,
            false => logarithm(*b) - logarithm(*a),
        };
        let differences: Vec<f64> = before.iter().zip(after).map(difference).collect();
        let p_value = wilcoxon(&differences);
        let ratio = |before: &[f64], after: &[f64]| median(after) / median(before);
        let interval = |of: &dyn Fn(&[f64], &[f64]) -> f64| match before.len().min(after.len()) < FEW {
            true => [f64::NAN; 2],
            false => paired_interval(before, after, self.spec.seed, of),
        };
        InvarianceTest {
            blocks,
            method,
            excess: [median(before), median(after)],
            ratio: ratio(before, after),
            ratio_interval: interval(&ratio),
            higher: superiority(before, after),
            higher_interval: interval(&superiority),
            p_value,
            p_holm: p_value,
            verdict: Invariance::Few,
        }
    }
}
