//! Gram matrices `XᵀX` of the columns of a matrix, accumulated in blocks of rows.
//!
//! Cost: a pair of panels takes 64 multiply-adds a row, eight instructions of AVX-512. Symmetry saves half of the pairs.

use motorfit_core::numeric::dot;
use motorfit_evaluate::{Level, at_level};
use motorfit_motor::multiply_add;
use nalgebra::DMatrix;

/// Columns of a panel: one vector of AVX-512, two of AVX2.
const WIDE: usize = 8;
/// Rows summed in one block before they are added to the total: rounding grows with the length of a block, not with that of
/// the recording.
pub(super) const BLOCK: usize = 64;

/// Up to eight columns of a block of rows. The alignment of 64 bytes keeps each load of an AVX-512 vector within one cache
/// line.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Panel(pub(super) [[f64; WIDE]; BLOCK]);

impl Panel {
    pub(super) const EMPTY: Self = Self([[0.0; WIDE]; BLOCK]);
}

/// Sums of products of the columns of two panels, shape `[8, 8]`.
pub(super) type Square = [[f64; WIDE]; WIDE];

/// The Gram matrix of columns and a last column of ones, shape `[columns + 1, columns + 1]`.
#[derive(Debug, Clone)]
pub struct Products(DMatrix<f64>);

impl Products {
    /// Returns the products over `rows`, which must ascend.
    pub fn new(columns: &[&[f64]], rows: &[usize]) -> Self {
        Self::at(Level::best(), columns, rows)
    }

    /// Returns the Gram matrix `XᵀX` of the columns, each centred on its mean; shape `[columns, columns]`.
    pub fn about_means(&self) -> DMatrix<f64> {
        let ones = self.0.nrows() - 1;
        let count = self.0[(ones, ones)].max(1.0);
        DMatrix::from_fn(ones, ones, |a, b| self.0[(a, b)] - self.0[(ones, a)] * self.0[(ones, b)] / count)
    }

    /// Returns the products over these rows and those of `other`, of the same columns.
    pub fn and(&self, other: &Self) -> Self {
        Self(&self.0 + &other.0)
    }

    /// Returns the products of `columns`, which are those of `self`, and `more`; `self` must be over the rows `from..`.
    pub fn beside(&self, columns: &[&[f64]], more: &[&[f64]], from: usize) -> Self {
        let (ones, all) = (columns.len(), columns.len() + more.len());
        let ones_column = vec![1.0; columns.first().map_or(0, |column| column.len() - from)];
        let column = |n: usize| match n {
            n if n < ones => &columns[n][from..],
            n if n < all => &more[n - ones][from..],
            _ => &ones_column,
        };
        // The index in `self` of a column that it has.
        let known = |n: usize| if n == all { Some(ones) } else { Some(n).filter(|n| *n < ones) };
        let mut products = DMatrix::zeros(all + 1, all + 1);
        for a in 0..=all {
            for b in 0..=a {
                let product = match (known(a), known(b)) {
                    (Some(a), Some(b)) => self.0[(a, b)],
                    _ => dot(column(a), column(b)),
                };
                (products[(a, b)], products[(b, a)]) = (product, product);
            }
        }
        Self(products)
    }

    fn at(level: Level, columns: &[&[f64]], rows: &[usize]) -> Self {
        Self(products_at(level, columns, rows))
    }
}

fn products_at(level: Level, columns: &[&[f64]], rows: &[usize]) -> DMatrix<f64> {
    // A last column of ones gives the sums of the columns, from which the means follow.
    let ones = columns.len();
    let mut panels = vec![Panel::EMPTY; (ones + 1).div_ceil(WIDE)];
    let mut sums = squares(panels.len());
    panels[ones / WIDE].0.iter_mut().for_each(|row| row[ones % WIDE] = 1.0);
    for rows in rows.chunks(BLOCK) {
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        for (c, column) in columns.iter().enumerate() {
            let panel = panels[c / WIDE].0.iter_mut().map(|row| &mut row[c % WIDE]);
            match last - first < rows.len() {
                // Nearly all blocks have no gap and can be copied as slices.
                true => panel.zip(&column[first..=last]).for_each(|(entry, value)| *entry = *value),
                false => panel.zip(rows).for_each(|(entry, &row)| *entry = column[row]),
            }
        }
        match level {
            Level::Avx512 => avx512(&panels, rows.len(), &mut sums),
            Level::Avx2 => avx2(&panels, rows.len(), &mut sums),
            Level::Portable => portable(&panels, rows.len(), &mut sums),
        }
    }
    DMatrix::from_fn(ones + 1, ones + 1, |a, b| product(&sums, a, b))
}

/// Returns zero sums for each pair of panels: the lower triangle of pairs, row by row.
fn squares(panels: usize) -> Vec<Square> {
    vec![[[0.0; WIDE]; WIDE]; panels * (panels + 1) / 2]
}

/// Returns the sum of products of columns `a` and `b`.
fn product(sums: &[Square], a: usize, b: usize) -> f64 {
    let (a, b) = (a.max(b), a.min(b));
    let (row, column) = (a / WIDE, b / WIDE);
    let square = &sums[row * (row + 1) / 2 + column];
    // The product of a panel with itself has only its upper triangle filled.
    if row == column { square[b % WIDE][a % WIDE] } else { square[a % WIDE][b % WIDE] }
}

at_level! {
    fn avx512(panels: &[Panel], rows: usize, sums: &mut [Square]) = avx512 {
        panel_products::<WIDE, true>(panels, rows, sums);
    } else avx2
}

at_level! {
    fn avx2(panels: &[Panel], rows: usize, sums: &mut [Square]) = avx2 {
        panel_products::<HALF, true>(panels, rows, sums);
    } else portable
}

fn portable(panels: &[Panel], rows: usize, sums: &mut [Square]) {
    panel_products::<HALF, false>(panels, rows, sums);
}

#[inline(always)]
fn panel_products<const TILE: usize, const FMA: bool>(panels: &[Panel], rows: usize, sums: &mut [Square]) {
    let mut sums = sums.iter_mut();
    for (n, own) in panels.iter().enumerate() {
        for (other, sums) in panels[..n].iter().zip(&mut sums) {
            for first in (0..WIDE).step_by(TILE) {
                tile::<TILE, WIDE, FMA>([own, other], rows, [first, 0], sums);
            }
        }
        if let Some(sums) = sums.next() {
            own_products::<TILE, FMA>(own, rows, sums);
        }
    }
}

/// Half of the columns of a panel: the number whose sums fit in the registers of AVX2.
pub(super) const HALF: usize = WIDE / 2;

/// Adds the products of a panel with itself, except the lower left quarter when `TILE` is half a panel; symmetry gives that
/// quarter. `TILE` columns are taken at a time: all of a panel, or half.
#[inline(always)]
pub(super) fn own_products<const TILE: usize, const FMA: bool>(panel: &Panel, rows: usize, sums: &mut Square) {
    tile::<TILE, WIDE, FMA>([panel, panel], rows, [0, 0], sums);
    if TILE < WIDE {
        tile::<HALF, HALF, FMA>([panel, panel], rows, [HALF, HALF], sums);
    }
}

/// Adds the products of `A` columns of one panel with `B` columns of another; `first` holds the first column of each.
#[inline(always)]
fn tile<const A: usize, const B: usize, const FMA: bool>(
    [own, other]: [&Panel; 2],
    rows: usize,
    first: [usize; 2],
    sums: &mut Square,
) {
    let mut block = [[0.0; B]; A];
    for (own, other) in own.0[..rows].iter().zip(&other.0[..rows]) {
        for a in 0..A {
            for b in 0..B {
                block[a][b] = multiply_add::<FMA>(own[first[0] + a], other[first[1] + b], block[a][b]);
            }
        }
    }
    for a in 0..A {
        for b in 0..B {
            sums[first[0] + a][first[1] + b] += block[a][b];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    /// Compares all feature levels with sums of centred columns, with and without gaps, for numbers of columns that fill
    /// panels and that do not. The tolerance is a few ε times the number of rows.
    #[test]
    fn products_are_those_of_centred_columns() {
        let mut generator = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(7);
        for (count, size) in [(1, 3), (7, 64), (8, 65), (15, 200), (21, 333)] {
            let columns: Vec<Vec<f64>> =
                (0..count).map(|_| (0..size).map(|_| generator.random_range(-1.0..3.0)).collect()).collect();
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            for rows in [(0..size).collect::<Vec<usize>>(), (0..size).filter(|n| n % 7 != 3).collect()] {
                let centred = |column: &[f64]| {
                    let kept: Vec<f64> = rows.iter().map(|&n| column[n]).collect();
                    let mean = kept.iter().sum::<f64>() / motorfit_core::numeric::count(kept.len());
                    kept.iter().map(|v| v - mean).collect::<Vec<f64>>()
                };
                // Of two parts of the rows, and with the last columns added, they are the same.
                let split = size / 3;
                let [early, late] =
                    [0..split, split..size].map(|rows| Products::new(&columns, &rows.collect::<Vec<_>>()));
                let (some, last) = columns.split_at(count - count / 3);
                let rest = Products::new(some, &(split..size).collect::<Vec<_>>()).beside(some, last, split);
                let whole = Products::new(&columns, &(0..size).collect::<Vec<_>>());
                for (parts, one) in [(early.and(&late), whole), (rest, late)] {
                    assert!((parts.0 - one.0).amax() < 1e-12 * motorfit_core::numeric::count(size));
                }
                for level in Level::available() {
                    let products = Products::at(level, &columns, &rows);
                    let found = products.about_means();
                    for (a, own) in columns.iter().enumerate() {
                        for (b, other) in columns.iter().enumerate() {
                            let expected: f64 = centred(own).iter().zip(centred(other)).map(|(x, y)| x * y).sum();
                            let error = (found[(a, b)] - expected).abs();
                            assert!(error < 1e-12 * motorfit_core::numeric::count(size), "{level:?} {a} {b}: {error}");
                        }
                    }
                }
            }
        }
    }
}
