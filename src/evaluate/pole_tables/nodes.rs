//! Power series of a recording at points: `Σ c[k] λᵏ` of four sequences at once.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use crate::evaluate::at_level::at_level;
use crate::evaluate::cpu::Level;
use crate::motor::multiply_add;
use crate::numeric::count;

/// Number of sequences that are summed together.
pub(super) const SEQUENCES: usize = 4;
/// Coefficients of four sequences, one row for each power.
pub(super) type Rows = [[f64; SEQUENCES]];
/// Values of four functions at a point: real parts, then imaginary parts.
pub(super) type PointValues = [f64; 2 * SEQUENCES];

/// Powers between two exact ones, and those between two products of an exact one with that of so many steps. The errors of the others
/// grow with the root of their number.
const RESTART: [usize; 2] = [4096, 64];
/// Exponent at which a power no longer counts: e⁻⁴⁰ is 4e-18.
const NEGLIGIBLE: f64 = 40.0;

/// Returns the number of rows that count where no λ decays more slowly than `e^{−decay}` per step.
pub(super) fn rows_that_count(rows: &Rows, decay: f64) -> usize {
    if decay <= 0.0 {
        return rows.len();
    }
    // The power 0 always counts.
    crate::numeric::whole((1.0 + NEGLIGIBLE / decay).ceil().min(count(rows.len())))
}

/// Returns the sums at points `λ = exp(x + iy)`, given by x and y.
pub(super) fn values(rows: &Rows, points: &[[f64; 2]], level: Level) -> Vec<PointValues> {
    let mut values = vec![[0.0; 2 * SEQUENCES]; points.len()];
    match level {
        Level::Avx512 => avx512(rows, points, &mut values),
        Level::Avx2 => avx2(rows, points, &mut values),
        Level::Portable => portable(rows, points, &mut values),
    }
    values
}

at_level! {
    fn avx512(rows: &Rows, points: &[[f64; 2]], values: &mut [PointValues]) = avx512 { all::<16, true>(rows, points, values) } else avx2
}

at_level! {
    fn avx2(rows: &Rows, points: &[[f64; 2]], values: &mut [PointValues]) = avx2 { all::<4, true>(rows, points, values) } else portable
}

fn portable(rows: &Rows, points: &[[f64; 2]], values: &mut [PointValues]) {
    all::<4, false>(rows, points, values);
}

#[inline(always)]
fn all<const L: usize, const FMA: bool>(rows: &Rows, points: &[[f64; 2]], values: &mut [PointValues]) {
    for (points, values) in points.chunks(L).zip(values.chunks_mut(L)) {
        let own = |part: usize| std::array::from_fn(|lane| points[lane.min(points.len() - 1)][part]);
        let sums = sums_at::<L, FMA>(rows, &[own(0), own(1)]);
        for (lane, values) in values.iter_mut().enumerate() {
            *values = std::array::from_fn(|n| sums[n][lane]);
        }
    }
}

/// Powers of λ and the factor `λ − 1`, which is accurate for slow poles.
struct Powers<const L: usize> {
    power: [[f64; L]; 2],
    factor: [[f64; L]; 2],
}

#[inline(always)]
fn sums_at<const L: usize, const FMA: bool>(rows: &Rows, points: &[[f64; L]; 2]) -> [[f64; L]; 2 * SEQUENCES] {
    let mut powers = Powers { power: [[0.0; L]; 2], factor: [[0.0; L]; 2] };
    for lane in 0..L {
        let (x, y) = (points[0][lane], points[1][lane]);
        let sine = (0.5 * y).sin();
        powers.factor[0][lane] = x.exp_m1() * y.cos() - 2.0 * sine * sine;
        powers.factor[1][lane] = x.exp() * y.sin();
    }
    let mut sums = [[0.0; L]; 2 * SEQUENCES];
    let exact = |steps: usize, lane: usize| {
        let (size, angle) = ((count(steps) * points[0][lane]).exp(), count(steps) * points[1][lane]);
        [size * angle.cos(), size * angle.sin()]
    };
    let mut stride = [[0.0; L]; 2];
    for lane in 0..L {
        [stride[0][lane], stride[1][lane]] = exact(RESTART[1], lane);
    }
    for (block, rows) in rows.chunks(RESTART[0]).enumerate() {
        let mut first = [[0.0; L]; 2];
        for lane in 0..L {
            [first[0][lane], first[1][lane]] = exact(block * RESTART[0], lane);
        }
        for rows in rows.chunks(RESTART[1]) {
            powers.power = first;
            add::<L, FMA>(rows, &mut powers, &mut sums);
            for lane in 0..L {
                let (re, im) = (first[0][lane], first[1][lane]);
                first[0][lane] = re * stride[0][lane] - im * stride[1][lane];
                first[1][lane] = re * stride[1][lane] + im * stride[0][lane];
            }
        }
    }
    sums
}

#[inline(always)]
fn add<const L: usize, const FMA: bool>(rows: &Rows, powers: &mut Powers<L>, sums: &mut [[f64; L]; 2 * SEQUENCES]) {
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let powers = std::hint::black_box(powers);
    let Powers { power: [mut re, mut im], factor } = *powers;
    let mut own = [[0.0; L]; 2 * SEQUENCES];
    for row in rows {
        for n in 0..SEQUENCES {
            for lane in 0..L {
                own[n][lane] = multiply_add::<FMA>(row[n], re[lane], own[n][lane]);
                own[SEQUENCES + n][lane] = multiply_add::<FMA>(row[n], im[lane], own[SEQUENCES + n][lane]);
            }
        }
        for lane in 0..L {
            let (a, b) = (re[lane], im[lane]);
            re[lane] = multiply_add::<FMA>(-factor[1][lane], b, multiply_add::<FMA>(factor[0][lane], a, a));
            im[lane] = multiply_add::<FMA>(factor[0][lane], b, multiply_add::<FMA>(factor[1][lane], a, b));
        }
    }
    for (sum, own) in sums.iter_mut().zip(&own) {
        for lane in 0..L {
            sum[lane] += own[lane];
        }
    }
}
