//! Parameters that are computed from the exponentials of matrices.

use super::phi::{Lane, Matrices, phi_functions};
use crate::graph::Id;

/// Matrices of the affine part, and the layout of the parameters that are computed from their exponentials.
#[derive(Debug, Clone)]
pub struct Extras {
    /// A row by row, then the columns of each source, as nodes of parameters alone.
    pub roots: Vec<Id>,
    pub(super) step_s: f64,
    pub(super) states: usize,
    /// The source of each column: an input, the constant, a reaction.
    pub(super) sources: Vec<Source>,
    pub(super) is_first_order_hold: bool,
    /// Rows with nonlinear terms.
    pub(super) rows: Vec<usize>,
    /// Rows on which reactions act by factors that depend on inputs or states.
    pub(super) acted: Vec<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Input(usize),
    Constant,
    Reaction(usize),
}

/// Blocks of the parameters that are computed from exponentials. Those of half a step are there for nonlinear equations only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Block {
    /// `φ₀ − 1` of a step, row by row.
    Change,
    /// Column of a source for the value at the start of the step.
    Start(usize),
    /// Column of an input for the value at the end of the step.
    End(usize),
    /// Column of a row on which reactions act by factors that vary.
    Acted(usize),
    HalfChange,
    HalfStart(usize),
    HalfEnd(usize),
    /// Column of a nonlinear row at the first stages.
    HalfStage(usize),
    /// Columns of a nonlinear row with the weights of the first, the middle and the last stage.
    Weight(usize, usize),
}

impl Extras {
    /// Returns true for a source that is constant over a step.
    pub(super) fn is_held(&self, source: usize) -> bool {
        !self.is_first_order_hold || !matches!(self.sources[source], Source::Input(_))
    }

    /// Returns the blocks in the order of their parameters.
    fn blocks(&self) -> Vec<Block> {
        let columns = |start: fn(usize) -> Block, end: fn(usize) -> Block, has_reactions: bool| {
            let used = (0..self.sources.len())
                .filter(move |n| has_reactions || !matches!(self.sources[*n], Source::Reaction(_)));
            used.flat_map(move |n| std::iter::once(start(n)).chain((!self.is_held(n)).then(|| end(n))))
        };
        let mut blocks = vec![Block::Change];
        blocks.extend(columns(Block::Start, Block::End, true));
        blocks.extend((0..self.acted.len()).map(Block::Acted));
        if !self.rows.is_empty() {
            blocks.push(Block::HalfChange);
            blocks.extend(columns(Block::HalfStart, Block::HalfEnd, false));
            for row in 0..self.rows.len() {
                blocks.push(Block::HalfStage(row));
                blocks.extend((0..3).map(|weight| Block::Weight(row, weight)));
            }
        }
        blocks
    }

    pub(super) fn length(&self, block: Block) -> usize {
        let is_matrix = matches!(block, Block::Change | Block::HalfChange);
        if is_matrix { self.states * self.states } else { self.states }
    }

    /// Returns true if there are no nonlinear terms, and reactions act by factors of parameters alone.
    pub(super) fn is_affine(&self) -> bool {
        self.rows.is_empty() && self.acted.is_empty()
    }

    /// Returns the number of parameters.
    pub fn count(&self) -> usize {
        self.blocks().into_iter().map(|block| self.length(block)).sum()
    }

    /// Returns the place of a block among the parameters.
    pub(super) fn place(&self, wanted: Block) -> usize {
        self.blocks().into_iter().take_while(|block| *block != wanted).map(|block| self.length(block)).sum()
    }

    /// Computes the parameters from the values of [`Self::roots`] and calls `set` with the number and value of each.
    pub fn compute<T: Lane>(&self, roots: &[T], mut set: impl FnMut(usize, T)) {
        let n = self.states;
        let (matrix, columns) = roots.split_at(n * n);
        let full = phi_functions(matrix, n, self.step_s);
        let half = (!self.rows.is_empty()).then(|| phi_functions(matrix, n, 0.5 * self.step_s));
        let mut at = 0;
        let mut put = |values: Vec<T>| {
            for value in values {
                set(at, value);
                at += 1;
            }
        };
        for block in self.blocks() {
            let half = || half.as_ref().unwrap_or(&full);
            let of_source = |phi: &Matrices<T>, source: usize, weights: [f64; 3], h: f64| {
                phi.apply(weights.map(|weight| h * weight), &columns[source * n..(source + 1) * n])
            };
            let h = self.step_s;
            let start = |source: usize| if self.is_held(source) { [1.0, 0.0, 0.0] } else { [1.0, -1.0, 0.0] };
            let unit = |phi: &Matrices<T>, row: usize, weights: [f64; 3], h: f64| {
                phi.column(weights.map(|weight| h * weight), row)
            };
            put(match block {
                Block::Change => full.change.clone(),
                Block::HalfChange => half().change.clone(),
                Block::Start(source) => of_source(&full, source, start(source), h),
                Block::End(source) => of_source(&full, source, [0.0, 1.0, 0.0], h),
                Block::HalfStart(source) => of_source(half(), source, start(source), 0.5 * h),
                Block::HalfEnd(source) => of_source(half(), source, [0.0, 1.0, 0.0], 0.5 * h),
                Block::Acted(place) => unit(&full, self.acted[place], [1.0, 0.0, 0.0], h),
                Block::HalfStage(row) => unit(half(), self.rows[row], [1.0, 0.0, 0.0], 0.5 * h),
                Block::Weight(row, 0) => unit(&full, self.rows[row], [1.0, -3.0, 4.0], h),
                Block::Weight(row, 1) => unit(&full, self.rows[row], [0.0, 2.0, -4.0], h),
                Block::Weight(row, _) => unit(&full, self.rows[row], [0.0, -1.0, 4.0], h),
            });
        }
    }
}
