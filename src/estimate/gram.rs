//! Gram matrices `XᵀX` of the columns of a matrix, accumulated in blocks of rows.
//!
//! Cost: a pair of panels takes 64 multiply-adds a row, eight instructions of AVX-512. Symmetry saves half of the pairs.

use crate::evaluate::{Level, at_level};
use crate::motor::multiply_add;
use crate::numeric::count;
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

/// Returns the Gram matrix `XᵀX` of the columns, each centred on its mean over `rows`, which must ascend; shape
/// `[columns, columns]`.
pub(crate) fn products_about_means(columns: &[&[f64]], rows: &[usize]) -> DMatrix<f64> {
    products_at(Level::best(), columns, rows)
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
    let sum = |a: usize, b: usize| product(&sums, a, b);
    let count = count(rows.len().max(1));
    DMatrix::from_fn(ones, ones, |a, b| sum(a, b) - sum(ones, a) * sum(ones, b) / count)
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
                    let mean = kept.iter().sum::<f64>() / crate::numeric::count(kept.len());
                    kept.iter().map(|v| v - mean).collect::<Vec<f64>>()
                };
                for level in Level::available() {
                    let found = products_at(level, &columns, &rows);
                    for (a, own) in columns.iter().enumerate() {
                        for (b, other) in columns.iter().enumerate() {
                            let expected: f64 = centred(own).iter().zip(centred(other)).map(|(x, y)| x * y).sum();
                            let error = (found[(a, b)] - expected).abs();
                            assert!(error < 1e-12 * crate::numeric::count(size), "{level:?} {a} {b}: {error}");
                        }
                    }
                }
            }
        }
    }
}
