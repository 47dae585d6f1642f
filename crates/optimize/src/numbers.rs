//! Random numbers of searches.

use super::search_settings::SearchSettings;
use motorfit_core::numeric::count_u64;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of candidates that share a sequence of random numbers and move together. The pieces of a population move in parallel, and
/// where they move does not depend on the number of threads.
pub(super) const PIECE: usize = 128;

/// Random numbers of a piece of a population: xoshiro256++, whose state is drawn from `ChaCha8` with the seed as the key and the run
/// as the stream, so that the sequences of runs and of their pieces are independent.
#[derive(Debug, Clone)]
pub(super) struct Numbers(Xoshiro256PlusPlus);

const UNIT53: f64 = 1.0 / count_u64(1 << 53);

impl Numbers {
    /// Returns the sequences of the pieces of a population.
    pub(super) fn of_pieces(setup: &SearchSettings) -> Vec<Self> {
        let mut key = ChaCha8Rng::seed_from_u64(setup.seed);
        key.set_stream(setup.run);
        let next = |_| Self(Xoshiro256PlusPlus::from_rng(&mut key));
        (0..setup.population.div_ceil(PIECE)).map(next).collect()
    }

    /// Returns a uniform number in \[0, 1) with 53 bits.
    #[inline]
    pub(super) fn unit(&mut self) -> f64 {
        count_u64(self.0.next_u64() >> 11) * UNIT53
    }

    /// Returns 64 random bits.
    pub(super) fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a standard normal number.
    #[inline]
    pub(super) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Returns a standard Cauchy number, the ratio of the coordinates of a point uniform in the unit disc.
    #[inline]
    pub(super) fn cauchy(&mut self) -> f64 {
        loop {
            let (x, y) = (2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0);
            if x * x + y * y < 1.0 && x != 0.0 {
                return y / x;
            }
        }
    }

    /// Returns two uniform numbers in \[0, 1) of 32 bits each from one draw.
    #[inline]
    pub(super) fn pair(&mut self) -> (f64, f64) {
        split(self.0.next_u64())
    }

    /// Fills `draws` with random bits, which [`split`] converts to pairs of numbers.
    pub(super) fn fill(&mut self, draws: &mut [u64]) {
        draws.fill_with(|| self.0.next_u64());
    }

    /// Returns a uniform integer in 0..count.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the result is below count")]
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.0.next_u64()) * count as u128) >> 64) as usize
    }
}

/// Returns two uniform numbers in \[0, 1) of 32 bits each from one draw, enough for the random weights of a move. The bits
/// become the mantissa of a number in \[1, 2), which vectorizes where an integer conversion would not.
#[inline(always)]
pub(super) fn split(draw: u64) -> (f64, f64) {
    let unit = |bits: u64| f64::from_bits(0x3ff0_0000_0000_0000 | (bits << 20)) - 1.0;
    (unit(draw >> 32), unit(draw & 0xffff_ffff))
}
