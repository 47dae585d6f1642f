//! Small statistics of signals.

/// A count as a number.
#[expect(clippy::cast_precision_loss, reason = "a count of samples is far below 2^53")]
pub(super) fn number(count: usize) -> f64 {
    count as f64
}

/// Arithmetic mean; 0 of nothing.
pub(super) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / number(values.len()) }
}

/// Population standard deviation; 0 of nothing.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / number(values.len().max(1))).sqrt()
}

/// The largest |value|.
pub(super) fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |peak: f64, v| peak.max(v.abs()))
}

/// The value below which `share` of the values lie; 0 of nothing. Reorders the values.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and the length")]
    let at = ((number(values.len() - 1) * share).round() as usize).min(values.len() - 1);
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// The median; 0 of nothing. Reorders the values.
pub(super) fn median(values: &mut [f64]) -> f64 {
    quantile(values, 0.5)
}

/// Standard deviation of white noise on a smooth signal, from the median of |third difference|, as in
/// `criterion::noise_sigma`, which stands after this module.
pub(in crate::record) fn noise(values: &[f64]) -> f64 {
    let mut thirds: Vec<f64> = values.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    median(&mut thirds) / (0.674_489_750_196_081_7 * 20.0_f64.sqrt())
}

/// The runs of samples for which `test` holds.
pub(super) fn runs(count: usize, test: impl Fn(usize) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for n in 0..=count {
        if n < count && test(n) {
            start.get_or_insert(n);
        } else if let Some(start) = start.take() {
            runs.push(start..n);
        }
    }
    runs
}

/// The slope of y over x by least squares; 0 where x stands still.
pub(super) fn slope(points: &[(f64, f64)]) -> f64 {
    let count = number(points.len().max(1));
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / count, y + p.1 / count));
    let (xx, xy) =
        points.iter().fold((0.0, 0.0), |(xx, xy), p| (xx + (p.0 - x) * (p.0 - x), xy + (p.0 - x) * (p.1 - y)));
    if xx > 0.0 { xy / xx } else { 0.0 }
}
