//! Threads that stay awake between the batches of one search.
//!
//! A generation of 100 candidates takes some 0.05 ms, as long as waking a thread that went to sleep after the one before. While a
//! search runs, other threads of its pool look for its work without sleeping. They do any other work of the pool as well, and the
//! search returns once that is done too.

use rayon::Yield;
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of candidate-steps of a batch for each thread that stays awake, some 0.01 ms.
const SHARE: usize = 25_000;

/// True while threads stay awake for a search. Only one search at a time has such threads: with more they would wait for each other.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Number of searches that run on this thread. It must not wait for another one while they do.
    static OWN: Cell<usize> = const { Cell::new(0) };
}

/// Calls the function when it is dropped, also if a search panics.
struct Finally<F: Fn()>(F);

impl<F: Fn()> Drop for Finally<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// Runs `search`, whose batches have `steps` candidate-steps, while other threads of the current pool stay awake for them. Results do
/// not depend on it.
pub(crate) fn with_threads_awake<T>(steps: usize, search: impl FnOnce() -> T) -> T {
    OWN.set(OWN.get() + 1);
    let _own = Finally(|| OWN.set(OWN.get() - 1));
    let others = rayon::current_num_threads().saturating_sub(1).min(steps / SHARE);
    let is_inside = rayon::current_thread_index().is_some();
    if others == 0 || !is_inside || IS_TAKEN.swap(true, Ordering::AcqRel) {
        return search();
    }
    let _free = Finally(|| IS_TAKEN.store(false, Ordering::Release));
    let is_done = AtomicBool::new(false);
    rayon::in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| stay_awake(&is_done));
        }
        let _done = Finally(|| is_done.store(true, Ordering::Release));
        search()
    })
}

/// Does the work of the pool until the search is done. On a thread with a search of its own, which would not go on, it returns at once.
fn stay_awake(is_done: &AtomicBool) {
    while OWN.get() == 0 && !is_done.load(Ordering::Acquire) {
        if rayon::yield_now() != Some(Yield::Executed) {
            // Other programs may need the core.
            std::thread::yield_now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    fn sum() -> u64 {
        (0..1000_u32).into_par_iter().with_max_len(50).map(|n| u64::from(n) * u64::from(n)).sum()
    }

    #[test]
    fn a_search_ends_with_any_number_of_threads_and_after_a_panic() {
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                for _ in 0..100 {
                    assert_eq!(with_threads_awake(usize::MAX, sum), 332_833_500);
                }
                // One within another, and several at once.
                let both = || with_threads_awake(usize::MAX, || with_threads_awake(usize::MAX, sum));
                assert!((0..20).into_par_iter().all(|_| both() == 332_833_500));
                let panicked = || with_threads_awake(usize::MAX, || -> u64 { panic!("in a search") });
                assert!(catch_unwind(AssertUnwindSafe(panicked)).is_err());
                assert_eq!(with_threads_awake(usize::MAX, sum), 332_833_500);
            });
            assert!(!IS_TAKEN.load(Ordering::Acquire));
        }
        assert_eq!(with_threads_awake(usize::MAX, sum), 332_833_500, "outside of a pool");
    }
}
