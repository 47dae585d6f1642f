#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;

/// Returns J and K, which share an unknown scale, with a standard error of the logarithm of their ratio.
fn open(error: f64) -> Open {
    let member = |(axis, (name, exponent)): (usize, (&str, f64))| Member {
        name: name.to_owned(),
        unit: "1".to_owned(),
        value: 2.0,
        rate: 1.0,
        axis,
        exponents: vec![exponent],
    };
    let members = [("J", 1.0), ("K", 1.0)].into_iter().enumerate().map(member).collect();
    Open { members, fixed: vec![1], covariance: vec![vec![error * error, 0.0], vec![0.0, 0.0]], quantile: 1.96 }
}

#[test]
fn only_combinations_that_are_known_within_a_decade_are_named() {
    // 3.92 standard errors are a decade, 2.303, for an error of 0.587.
    let known = open(0.58);
    let found = known.identified();
    assert_eq!(found[0].name, "J/K");
    assert!((found[0].ci95[1] / found[0].ci95[0]).log10() > 0.98, "{found:?}");
    assert!(known.sentences()[0].ends_with("only the ratio J/K is identified"));
    let unknown = open(0.6);
    assert_eq!(unknown.identified(), []);
    assert_eq!(unknown.sentences(), ["J and K cannot be told apart"]);
}
