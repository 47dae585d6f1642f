//! Machines written by hand for `L` candidates side by side, with the Runge–Kutta method: what the interpreter of models is compared
//! with. Both compute the sum of squares of the errors at each sample under held inputs.

use multiversion::multiversion;

/// Candidates side by side, the fastest number for these machines (measured).
pub const LANES: usize = 16;
type Lane = [f64; LANES];

/// Right-hand sides of a machine with `N` states, `P` coefficients and `U` inputs for one candidate.
pub trait Twin<const N: usize, const P: usize, const U: usize> {
    fn coefficients(parameters: &[f64]) -> [f64; P];
    fn derivative(coefficients: &[f64; P], x: [f64; N], inputs: [f64; U]) -> [f64; N];
}

/// The DC motor; parameters R, L, K, B, J.
pub struct DcMotor;

impl Twin<2, 5, 1> for DcMotor {
    fn coefficients(p: &[f64]) -> [f64; 5] {
        [-p[0] / p[1], -p[2] / p[1], 1.0 / p[1], p[2] / p[4], -p[3] / p[4]]
    }

    #[inline(always)]
    fn derivative(c: &[f64; 5], [i, w]: [f64; 2], [v]: [f64; 1]) -> [f64; 2] {
        [c[2].mul_add(v, c[1].mul_add(w, c[0] * i)), c[3].mul_add(i, c[4] * w)]
    }
}

/// The synchronous machine with four pole pairs; parameters R, Ld, Lq, psi, B, J.
pub struct Pmsm;

impl Twin<3, 11, 2> for Pmsm {
    fn coefficients(q: &[f64]) -> [f64; 11] {
        let [r, d, l, psi, b, j] = [q[0], q[1], q[2], q[3], q[4], q[5]];
        let p = 4.0;
        [
            1.0 / d,
            -r / d,
            p * l / d,
            1.0 / l,
            -r / l,
            -p * d / l,
            -p * psi / l,
            1.5 * p * psi / j,
            1.5 * p * (d - l) / j,
            -b / j,
            0.0,
        ]
    }

    #[inline(always)]
    fn derivative(c: &[f64; 11], [d, q, w]: [f64; 3], [vd, vq]: [f64; 2]) -> [f64; 3] {
        [
            c[0].mul_add(vd, c[1].mul_add(d, c[2] * w * q)),
            c[3].mul_add(vq, c[4].mul_add(q, w * c[5].mul_add(d, c[6]))),
            q.mul_add(c[8].mul_add(d, c[7]), c[9] * w),
        ]
    }
}

/// A recording: inputs and measured states at each sample.
pub struct Recorded<const N: usize, const U: usize> {
    pub step_s: f64,
    pub inputs: Vec<[f64; U]>,
    pub measured: Vec<[f64; N]>,
}

#[inline(always)]
fn block<T: Twin<N, P, U>, const N: usize, const P: usize, const U: usize>(
    coefficients: &[Lane; P],
    of: &Recorded<N, U>,
) -> [Lane; N] {
    let h = of.step_s;
    let mut x = [[0.0; LANES]; N];
    let mut sums = [[0.0; LANES]; N];
    for (inputs, measured) in of.inputs.iter().zip(&of.measured) {
        for lane in 0..LANES {
            let own: [f64; P] = std::array::from_fn(|n| coefficients[n][lane]);
            let at: [f64; N] = std::array::from_fn(|n| x[n][lane]);
            let moved = |k: &[f64; N], by: f64| std::array::from_fn(|n| k[n].mul_add(by, at[n]));
            let one = T::derivative(&own, at, *inputs);
            let two = T::derivative(&own, moved(&one, 0.5 * h), *inputs);
            let three = T::derivative(&own, moved(&two, 0.5 * h), *inputs);
            let four = T::derivative(&own, moved(&three, h), *inputs);
            for n in 0..N {
                let error = measured[n] - at[n];
                sums[n][lane] = error.mul_add(error, sums[n][lane]);
                let middle = two[n] + three[n];
                x[n][lane] = (h / 6.0).mul_add(one[n] + four[n] + 2.0 * middle, at[n]);
            }
        }
    }
    sums
}

macro_rules! at_levels {
    ($name:ident $twin:ident $n:literal $p:literal $u:literal) => {
        #[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
        pub fn $name(candidates: &[f64], width: usize, of: &Recorded<$n, $u>) -> f64 {
            let mut total = 0.0;
            for chunk in candidates.chunks(width * LANES) {
                let mut coefficients = [[0.0; LANES]; $p];
                for lane in 0..LANES {
                    let at = lane.min(chunk.len() / width - 1) * width;
                    for (own, value) in coefficients.iter_mut().zip($twin::coefficients(&chunk[at..at + width])) {
                        own[lane] = value;
                    }
                }
                let sums = block::<$twin, $n, $p, $u>(&coefficients, of);
                total += sums.iter().flatten().filter(|sum| sum.is_finite()).sum::<f64>();
            }
            total
        }
    };
}

at_levels!(dc_motor DcMotor 2 5 1);
at_levels!(pmsm Pmsm 3 11 2);
