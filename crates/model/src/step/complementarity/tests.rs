#![allow(clippy::float_cmp, reason = "exact equality is meant")]

use super::*;
use crate::graph::evaluate;

#[test]
fn reactions_fulfil_the_conditions_of_the_problem() {
    // The fractional parts of squares times an irrational number, which are spread over the interval and hardly repeat.
    let mut drawn = 0.0_f64;
    let mut draw = |most: f64| {
        drawn += 1.0;
        most * (2.0 * (drawn * drawn * 0.618_033_988_749_895).fract() - 1.0)
    };
    for case in 0..400 {
        let n = 1 + case % 6;
        let root: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| draw(1.0)).collect()).collect();
        let product = |a: usize, b: usize| (0..n).map(|k| root[a][k] * root[b][k]).sum::<f64>();
        let inverse = |a: usize, b: usize| product(a, b) + if a == b { 0.1 } else { 0.0 };
        // The inverse of a mass matrix, each reaction per unit of its own state.
        let matrix: Vec<Vec<f64>> = (0..n).map(|a| (0..n).map(|b| inverse(a, b) / inverse(b, b)).collect()).collect();
        let free: Vec<f64> = (0..n).map(|_| draw(2.0)).collect();
        let most: Vec<f64> = (0..n).map(|_| draw(1.0).abs()).collect();
        let mut graph = Graph::default();
        let mut ids = |values: &Vec<f64>| values.iter().map(|value| graph.constant(*value)).collect::<Vec<Id>>();
        let of_matrix: Vec<Vec<Id>> = matrix.iter().map(&mut ids).collect();
        let [of_free, of_most] = [&free, &most].map(&mut ids);
        let coupled = Coupled { before: &of_free, free: &of_free, matrix: &of_matrix, most: &of_most };
        let [taken, states] = coupled.constant(&mut graph);
        let of = |ids: &[Id]| evaluate(&graph, ids, &mut Vec::new(), &|_| 0.0);
        let (taken, states) = (of(&taken), of(&states));
        for k in 0..n {
            let expected = free[k] - (0..n).map(|j| matrix[k][j] * taken[j]).sum::<f64>();
            // Rounding, of matrices with condition numbers up to some hundred.
            assert!((states[k] - expected).abs() < 1e-10, "{case}: {states:?} {expected}");
            assert!(taken[k].abs() <= most[k], "{case}: {taken:?} {most:?}");
            let is_at_limit = taken[k].abs() == most[k];
            assert!(states[k] == 0.0 || (is_at_limit && states[k] * taken[k] >= 0.0), "{case}: {states:?} {taken:?}");
        }
    }
}
