//! Numbers of cases of the long statistics, and limits of counts for these numbers.

/// Probability with which a count with the right rate exceeds a limit. The tolerance of a coverage of 95 % over 600 seeds is then 3 %.
const EXCEEDED: f64 = 5e-4;

/// Returns true if the long statistics take all their cases: `MOTORFIT_FULL=1`.
pub fn full() -> bool {
    std::env::var("MOTORFIT_FULL").is_ok_and(|text| text == "1")
}

/// Returns the number of cases: `all` with `MOTORFIT_FULL=1`.
pub fn cases<T>(fewer: T, all: T) -> T {
    if full() { all } else { fewer }
}

/// Returns the probabilities of 0 to `count` hits, each with probability `rate`, by the recurrence of the binomial distribution.
fn binomial(count: usize, rate: f64) -> impl Iterator<Item = f64> {
    let mut logarithm = count as f64 * (1.0 - rate).ln();
    (0..=count).map(move |hits| {
        let now = logarithm.exp();
        logarithm += ((count - hits) as f64 / (hits + 1) as f64 * rate / (1.0 - rate)).ln();
        now
    })
}

/// Returns the smallest number of hits that is not improbably small.
pub fn fewest(count: usize, rate: f64) -> usize {
    count - most(count, 1.0 - rate)
}

/// Returns the largest number of hits that is not improbably large.
pub fn most(count: usize, rate: f64) -> usize {
    let mut below = 0.0;
    let reached = |probability: f64| {
        below += probability;
        1.0 - below <= EXCEEDED
    };
    binomial(count, rate).map(reached).position(|reached| reached).unwrap_or(count)
}

/// Returns true if the share of hits reaches a rate: exactly with all cases; with fewer, counts that are probable for the rate do.
pub fn reaches(hits: usize, count: usize, rate: f64) -> bool {
    if full() { hits as f64 >= rate * count as f64 } else { hits >= fewest(count, rate) }
}

/// Returns true if the share of hits is at most a rate: exactly with all cases; with fewer, counts that are probable for the rate are.
pub fn is_rare(hits: usize, count: usize, rate: f64) -> bool {
    if full() { hits as f64 <= rate * count as f64 } else { hits <= most(count, rate) }
}

/// Returns true if 95 % intervals cover: with all cases a share within `limits`; with fewer, a count that is probable for 95 %.
pub fn covers(inside: usize, count: usize, [low, high]: [f64; 2]) -> bool {
    match full() {
        true => (low..=high).contains(&(inside as f64 / count as f64)),
        false => (fewest(count, 0.95)..=most(count, 0.95)).contains(&inside),
    }
}

/// Returns the limit of the root mean square of `count` errors in standard errors, three standard deviations above 1: 1.15 for 200.
pub fn rms_most(count: usize) -> f64 {
    1.0 + 3.0 / (2.0 * count as f64).sqrt()
}
