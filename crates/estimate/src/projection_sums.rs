//! Sums of variable projection, with several grid points simulated side by side through one recording.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use motorfit_evaluate::{Level, Signals, at_level};
use motorfit_motor::{Discretization, StepMaps, multiply_add, step_maps};

/// Points of one call: two vectors of AVX-512, which hide the latency between dependent steps.
pub(super) const LANES: usize = 16;
/// Points that are evaluated side by side without AVX-512, whose sums fit in the registers.
const HALF: usize = LANES / 2;
/// Number of sums of a point: φ₁², φ₁φ₀, φ₀², iφ₁ and iφ₀ over the unmasked samples of the current, then ωφ₀ and φ₀² over those
/// of the speed.
pub(super) const SUMS: usize = 7;

pub(super) type Motors<const L: usize = LANES> = [[f64; L]; 5];
type Sums<const L: usize = LANES> = [[f64; L]; SUMS];

/// Returns the sums of a recording, a lane for each point.
pub(super) fn sums(signals: &Signals, motors: &Motors, method: Discretization) -> Sums {
    match Level::best() {
        Level::Avx512 => avx512(signals, motors, method),
        Level::Avx2 => avx2(signals, motors, method),
        Level::Portable => portable(signals, motors, method),
    }
}

at_level! {
    fn avx512(signals: &Signals, motors: &Motors, method: Discretization) -> Sums = avx512 {
        simulate::<LANES, true>(signals, motors, method)
    } else avx2
}

at_level! {
    fn avx2(signals: &Signals, motors: &Motors, method: Discretization) -> Sums = avx2 {
        by_halves::<true>(signals, motors, method)
    } else portable
}

fn portable(signals: &Signals, motors: &Motors, method: Discretization) -> Sums {
    by_halves::<false>(signals, motors, method)
}

/// Simulates one half of the points after the other.
#[inline(always)]
fn by_halves<const FMA: bool>(signals: &Signals, motors: &Motors, method: Discretization) -> Sums {
    let mut sums = [[0.0; LANES]; SUMS];
    for first in [0, HALF] {
        let mut half = [[0.0; HALF]; 5];
        for p in 0..5 {
            half[p].copy_from_slice(&motors[p][first..first + HALF]);
        }
        let own = simulate::<HALF, FMA>(signals, &half, method);
        for n in 0..SUMS {
            sums[n][first..first + HALF].copy_from_slice(&own[n]);
        }
    }
    sums
}

#[inline(always)]
fn simulate<const L: usize, const FMA: bool>(signals: &Signals, motors: &Motors<L>, method: Discretization) -> Sums<L> {
    let table = table(&signals.step_s, motors, method);
    let is_weighted = !signals.weight.is_empty();
    let mut sums = match (table.len() == 1, is_weighted, method.uses_next_input()) {
        (true, false, _) => by_runs::<L, FMA, false>(signals, &table[0]),
        (true, true, _) => by_runs::<L, FMA, true>(signals, &table[0]),
        (false, false, false) => by_samples::<L, FMA, false, false>(signals, &table),
        (false, false, true) => by_samples::<L, FMA, false, true>(signals, &table),
        (false, true, false) => by_samples::<L, FMA, true, false>(signals, &table),
        (false, true, true) => by_samples::<L, FMA, true, true>(signals, &table),
    };
    if !is_weighted {
        sums[6] = sums[2];
    }
    sums
}

/// Returns the map of each distinct step length. The lengths ascend and mostly differ by the same time. A map is then
/// composed of the previous map and that of the difference, which takes a tenth of the time of a new one.
#[inline(always)]
fn table<const L: usize>(steps_s: &[f64], motors: &Motors<L>, method: Discretization) -> Vec<StepMaps<L>> {
    let mut table: Vec<StepMaps<L>> = Vec::with_capacity(steps_s.len());
    let mut more: Option<(f64, StepMaps<L>)> = None;
    // A loop, because iterator adapters would not be compiled for the target features of this function.
    for (n, &h) in steps_s.iter().enumerate() {
        let maps = match (table.last(), &more) {
            (Some(last), Some((unit_s, unit))) if (h - steps_s[n - 1] - unit_s).abs() < 1e-6 * unit_s => {
                last.then(unit, if method.uses_next_input() { Some(steps_s[n - 1] / h) } else { None })
            }
            _ => step_maps(motors, h, method),
        };
        if n == 1 && h > steps_s[0] {
            more = Some((h - steps_s[0], step_maps(motors, h - steps_s[0], method)));
        }
        table.push(maps);
    }
    table
}

/// Returns the sums on an even clock; the contribution of the voltage to a step is computed once for each run of equal
/// inputs.
#[inline(always)]
fn by_runs<const L: usize, const FMA: bool, const WEIGHTED: bool>(signals: &Signals, maps: &StepMaps<L>) -> Sums<L> {
    let mut sums = [[0.0; L]; SUMS];
    let mut x = [[0.0; L]; 2];
    for run in signals.active_runs() {
        let [v, v_next] = run.voltage;
        let mut gain = [[0.0; L]; 2];
        for axis in 0..2 {
            for lane in 0..L {
                gain[axis][lane] = maps.taps[0][axis][lane] * v + maps.taps[1][axis][lane] * v_next;
            }
        }
        for n in run.start..run.end {
            add::<L, FMA, WEIGHTED>(&mut sums, &x, signals, n);
            advance::<L, FMA>(&mut x, maps, &gain);
        }
    }
    sums
}

/// Returns the sums on an irregular clock, where each sample has its own step length and mostly its own run of inputs.
#[inline(always)]
fn by_samples<const L: usize, const FMA: bool, const WEIGHTED: bool, const FIRST_ORDER_HOLD: bool>(
    signals: &Signals,
    table: &[StepMaps<L>],
) -> Sums<L> {
    let mut sums = [[0.0; L]; SUMS];
    let mut x = [[0.0; L]; 2];
    for n in signals.first_active..signals.len() {
        let maps = &table[usize::from(signals.step_of(n))];
        let [v, v_next, _] = signals.inputs(n);
        let mut gain = [[0.0; L]; 2];
        for axis in 0..2 {
            for lane in 0..L {
                gain[axis][lane] = maps.taps[0][axis][lane] * v;
                if FIRST_ORDER_HOLD {
                    gain[axis][lane] = multiply_add::<FMA>(maps.taps[1][axis][lane], v_next, gain[axis][lane]);
                }
            }
        }
        add::<L, FMA, WEIGHTED>(&mut sums, &x, signals, n);
        advance::<L, FMA>(&mut x, maps, &gain);
    }
    sums
}

/// Adds the products of a sample. The sum of φ₀² of the speed is omitted if all samples count, because it equals that of
/// the current.
#[inline(always)]
fn add<const L: usize, const FMA: bool, const WEIGHTED: bool>(
    sums: &mut Sums<L>,
    x: &[[f64; L]; 2],
    signals: &Signals,
    n: usize,
) {
    let [current, speed] = signals.measured[n];
    let [of_current, of_speed] = if WEIGHTED { signals.weight[n] } else { [1.0; 2] };
    for lane in 0..L {
        let (one, zero) = (x[0][lane], x[1][lane]);
        let [one_i, zero_i, zero_w] =
            if WEIGHTED { [of_current * one, of_current * zero, of_speed * zero] } else { [one, zero, zero] };
        sums[0][lane] = multiply_add::<FMA>(one_i, one, sums[0][lane]);
        sums[1][lane] = multiply_add::<FMA>(one_i, zero, sums[1][lane]);
        sums[2][lane] = multiply_add::<FMA>(zero_i, zero, sums[2][lane]);
        sums[3][lane] = multiply_add::<FMA>(current, one_i, sums[3][lane]);
        sums[4][lane] = multiply_add::<FMA>(current, zero_i, sums[4][lane]);
        sums[5][lane] = multiply_add::<FMA>(speed, zero_w, sums[5][lane]);
        if WEIGHTED {
            sums[6][lane] = multiply_add::<FMA>(zero_w, zero, sums[6][lane]);
        }
    }
}

/// Advances the states of all points by one step.
#[inline(always)]
fn advance<const L: usize, const FMA: bool>(x: &mut [[f64; L]; 2], maps: &StepMaps<L>, gain: &[[f64; L]; 2]) {
    for lane in 0..L {
        let (one, zero) = (x[0][lane], x[1][lane]);
        let step = |axis: usize| {
            let far = multiply_add::<FMA>(maps.d[2 * axis + 1][lane], zero, gain[axis][lane]);
            x[axis][lane] + multiply_add::<FMA>(maps.d[2 * axis][lane], one, far)
        };
        let next = [step(0), step(1)];
        (x[0][lane], x[1][lane]) = (next[0], next[1]);
    }
}
