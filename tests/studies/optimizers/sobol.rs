//! The Sobol' sequence against that of scipy.

use motorfit::optimize::{SOBOL_AXES_MAX, Sample, Sampling};

#[test]
fn points_of_the_sobol_sequence_are_those_of_scipy() {
    let sample = Sample::new(Sampling::Sobol, 1 << 40, vec![(0.0, 1.0); SOBOL_AXES_MAX], 7).unwrap();
    let digits = |index: u64| -> Vec<u64> {
        let mut values = vec![0.0; SOBOL_AXES_MAX];
        sample.fill(index, &mut values);
        // Coordinates are multiples of 2⁻⁵³.
        values.iter().map(|value| (value * 2f64.powi(53)) as u64).collect()
    };
    // The first point of the sequence is zero, which leaves the shift.
    let shift = digits(0);
    let mut rows = 0;
    for line in include_str!("../../golden/sobol.csv").lines() {
        let numbers: Vec<u64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        let found: Vec<u64> = digits(numbers[0]).iter().zip(&shift).map(|(a, b)| a ^ b).collect();
        assert_eq!(found, numbers[1..], "point {}", numbers[0]);
        rows += 1;
    }
    assert_eq!(rows, 7);
}
