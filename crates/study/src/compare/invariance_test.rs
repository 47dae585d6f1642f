//! The test of a method in other coordinates.

use motorfit_core::named::named;

named! {
    /// Verdict on a method in other coordinates.
    pub enum Invariance {
        /// The costs do not differ significantly.
        Unchanged = "unchanged",
        /// The costs differ although the coordinates are only mirrored or shifted.
        Biased = "biased",
        /// The costs differ in coordinates of another scale, which change the problem for the method.
        Changed = "changed",
        /// There are too few runs for a test at the 5 % level.
        Few = "too_few_runs",
    }
}

/// Comparison of a method in other coordinates with itself in those of the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InvarianceTest {
    /// Index of the block in the coordinates of the parameters and of that in the others.
    pub blocks: [usize; 2],
    /// Index of the method in both blocks.
    pub method: usize,
    /// Median excess of the final costs over the lowest known cost in both coordinates.
    pub excess: [f64; 2],
    /// Ratio of the second median to the first.
    pub ratio: f64,
    /// 95 % bootstrap confidence interval of the ratio; NaN below [`FEW`](super::FEW) runs.
    pub ratio_interval: [f64; 2],
    /// Probability that a run in the other coordinates ends higher than one in those of the parameters, ties as half.
    pub higher: f64,
    /// 95 % bootstrap confidence interval of this probability; NaN below [`FEW`](super::FEW) runs.
    pub higher_interval: [f64; 2],
    /// p-value of Wilcoxon's signed-rank test on the logarithms of the excesses, paired by run number.
    pub p_value: f64,
    /// p-value after Holm's correction for all methods and coordinates under the setting.
    pub p_holm: f64,
    /// The verdict at the 5 % level.
    pub verdict: Invariance,
}
