//! Proves: limits of counts are quantiles of the binomial distribution, as computed in fractions by Python.

use crate::support::rates::{fewest, most};

/// Number of cases, rate, and the smallest and largest number of hits that are not improbable (5e-4).
const LIMITS: [(usize, f64, usize, usize); 10] = [
    (0, 0.5, 0, 0),
    (20, 0.97, 16, 20),
    (40, 0.8, 23, 39),
    (100, 0.005, 0, 4),
    (150, 0.95, 132, 149),
    (240, 0.01, 0, 9),
    (500, 0.005, 0, 9),
    (600, 0.95, 551, 586),
    (600, 1.0 / 60.0, 2, 22),
    (1000, 0.95, 926, 971),
];

#[test]
fn limits_are_quantiles_of_the_binomial_distribution() {
    for (count, rate, least, largest) in LIMITS {
        assert_eq!((fewest(count, rate), most(count, rate)), (least, largest), "{count} of {rate}");
    }
}
