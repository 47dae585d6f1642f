//! Points that fill a cube evenly.

use super::conversion::count;

/// Returns the coordinates of point `n` of an additive recurrence that fills the unit cube evenly: multiples of the powers of 1/x with the
/// root of `xᵈ⁺¹ = x + 1` for `d` dimensions (M. Roberts, 2018).
pub fn spread(n: usize, dimensions: usize) -> impl Iterator<Item = f64> {
    let root = (0..50).fold(2.0_f64, |x, _| (1.0 + x).powf(1.0 / (count(dimensions) + 1.0)));
    let mut step = 1.0;
    (0..dimensions).map(move |_| {
        step /= root;
        (0.5 + step * (count(n) + 1.0)).fract()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_a_line_and_a_square_evenly() {
        // Multiples of the golden section leave gaps of at most its square over 55 points, a Fibonacci number.
        let mut line: Vec<f64> = (0..55).flat_map(|n| spread(n, 1)).collect();
        line.sort_by(f64::total_cmp);
        let widest = line.windows(2).map(|of| of[1] - of[0]).fold(0.0, f64::max);
        assert!(widest < 1.7 / 55.0, "{widest}");
        // Each of 25 equal squares has its share of 250 points, 10, give or take 4; of random points some square has less than 4.
        let mut shares = [0; 25];
        for n in 0..250 {
            let [x, y] = spread(n, 2).map(|x| super::super::whole(5.0 * x)).collect::<Vec<_>>()[..] else { panic!() };
            shares[5 * x + y] += 1;
        }
        assert!(shares.iter().all(|share| (6..=14).contains(share)), "{shares:?}");
    }
}
