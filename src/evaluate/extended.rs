//! The kernel for motors with extensions: `L` candidates side by side, some samples at a time. First what drives each
//! candidate over these samples, then its steps, then what its sensors show, then the errors.
//!
//! Limit of a step with friction: to the linear motor's 8 operations come five (what it takes to stop, its two limits,
//! and what it adds to both states).

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::kernel::{Block, LANES, LANES_AVX512, add_loss, multiply_add, phi};
use super::late::Inputs;
use super::{Problem, Signals};
use crate::motor::{Extended, Parameter, StepMaps, step_maps};
use multiversion::multiversion;

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
pub(super) fn avx512(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES_AVX512, true>(block, costs);
}

#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) fn avx2(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES, true>(block, costs);
}

pub(super) fn portable(block: &Block<'_>, costs: &mut [f64]) {
    run::<LANES, false>(block, costs);
}

/// Samples that are done at a time.
pub(super) const CHUNK: usize = 64;

/// The longest average, in samples.
pub(super) const WINDOW_MAX: f64 = 1e6;

/// A pair of numbers (current, speed) of each candidate.
pub(super) type Pair<const L: usize> = [[f64; L]; 2];

#[inline(always)]
fn run<const L: usize, const FMA: bool>(block: &Block<'_>, costs: &mut [f64]) {
    let Block { problem, candidates, width } = *block;
    let mut totals = [0.0; L];
    for (recording, signals) in problem.signals().iter().enumerate() {
        let motors: [Extended; L] = std::array::from_fn(|lane| {
            let row = lane.min(costs.len() - 1) * width;
            let values = &candidates[row..row + width];
            Extended::new(&problem.parameters(values, recording), &problem.extensions(values, recording))
        });
        let sums = Run::<L>::new(problem, signals, &motors).sums::<FMA>(&motors);
        for lane in 0..L {
            totals[lane] += problem.scaled(signals, [sums[0][lane], sums[1][lane]]);
        }
    }
    for (cost, total) in costs.iter_mut().zip(totals) {
        *cost = problem.cost(total);
    }
}

/// The step of a block of candidates.
struct Step<const L: usize> {
    maps: StepMaps<L>,
    phi: [[f64; L]; 4],
    /// Reactions that end current and speed at zero, per unit of them; and what one unit of each adds to both.
    needed: Pair<L>,
    adds: [Pair<L>; 2],
}

impl<const L: usize> Step<L> {
    #[inline(always)]
    fn new(motors: &[Extended; L], h: f64, method: crate::motor::Discretization) -> Self {
        let parameters: [[f64; L]; 5] = std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].motor[p]));
        let maps = step_maps(&parameters, h, method);
        let mut held = [[0.0; L]; 2];
        for axis in 0..2 {
            for lane in 0..L {
                held[axis][lane] = -(maps.taps[0][axis][lane] + maps.taps[1][axis][lane]);
            }
        }
        let adds = [held, maps.torque];
        let mut needed = [[0.0; L]; 2];
        for axis in 0..2 {
            for lane in 0..L {
                needed[axis][lane] = -1.0 / adds[axis][axis][lane];
            }
        }
        Self { phi: phi(&maps), maps, needed, adds }
    }
}

/// One recording on its way.
struct Run<'a, const L: usize> {
    problem: &'a Problem,
    signals: &'a Signals,
    steps: Vec<Step<L>>,
    /// The limits of the reactions: brush drop, Coulomb friction.
    limits: Pair<L>,
    has_brushes: bool,
    x: Pair<L>,
}

impl<'a, const L: usize> Run<'a, L> {
    #[inline(always)]
    fn new(problem: &'a Problem, signals: &'a Signals, motors: &[Extended; L]) -> Self {
        let extent = problem.extent();
        let method = extent.method(problem.model().discretization);
        let of = |parameter| std::array::from_fn(|lane| motors[lane].get(parameter));
        Self {
            problem,
            signals,
            steps: signals.step_s.iter().map(|&h| Step::new(motors, h, method)).collect(),
            limits: [of(Parameter::BrushDrop), of(Parameter::Coulomb)],
            has_brushes: extent.has(Parameter::BrushDrop),
            x: signals.initial.map(|x| [x; L]),
        }
    }

    /// Weighted sums of errors per channel over the active samples.
    #[inline(always)]
    fn sums<const FMA: bool>(mut self, motors: &[Extended; L]) -> Pair<L> {
        let mut totals = [[0.0; L]; 2];
        // A map without numbers has no trajectory, even where nothing drives the motor.
        for lane in 0..L {
            totals[0][lane] = 0.0 * self.steps[0].maps.d.iter().map(|d| d[lane]).sum::<f64>();
        }
        let mut inputs = Inputs::new(self.problem, self.signals, motors);
        let mut sensors = [Parameter::CurrentAverage, Parameter::SpeedAverage].map(|of| {
            let channel = usize::from(of == Parameter::SpeedAverage);
            let windows = std::array::from_fn(|lane| motors[lane].get(of));
            self.problem.extent().has(of).then(|| Sensor::new(windows, self.signals.initial[channel]))
        });
        let mut gains = [[[0.0; L]; 2]; CHUNK];
        let mut seen = [[[0.0; L]; 2]; CHUNK];
        let (mut start, last) = (self.problem.first_active(self.signals), self.signals.len());
        while start < last {
            let end = last.min(start + CHUNK);
            inputs.fill::<FMA>(motors, [start, end], |n| &self.steps[self.index(n)].maps, &mut gains);
            self.advance::<FMA>(start, &gains[..end - start], &mut seen);
            for (channel, sensor) in sensors.iter_mut().enumerate() {
                if let Some(sensor) = sensor {
                    sensor.show(start, channel, &mut seen[..end - start]);
                }
            }
            self.lose::<FMA>(start, &seen[..end - start], &mut totals);
            start = end;
        }
        totals
    }

    #[inline(always)]
    fn index(&self, n: usize) -> usize {
        self.signals.step_index.get(n).map_or(0, |&index| usize::from(index))
    }

    /// Steps from sample `start` on; what is passed on the way goes to `seen`.
    #[inline(always)]
    fn advance<const FMA: bool>(&mut self, start: usize, gains: &[Pair<L>], seen: &mut [Pair<L>; CHUNK]) {
        let mut done = 0;
        while done < gains.len() {
            let index = self.index(start + done);
            let same = (done..gains.len()).take_while(|c| self.index(start + c) == index).count();
            let (gains, seen) = (&gains[done..done + same], &mut seen[done..done + same]);
            let step = &self.steps[index];
            if self.has_brushes {
                follow::<L, FMA, true>(&mut self.x, step, &self.limits, gains, seen);
            } else {
                follow::<L, FMA, false>(&mut self.x, step, &self.limits, gains, seen);
            }
            done += same;
        }
    }

    #[inline(always)]
    fn lose<const FMA: bool>(&self, start: usize, seen: &[Pair<L>], totals: &mut Pair<L>) {
        let measured = &self.signals.measured[start..start + seen.len()];
        let weight = self.signals.weight.get(start..start + seen.len());
        let sums = match (self.problem.criterion().is_absolute(), weight) {
            (false, None) => losses::<L, FMA, false, false>(measured, &[], seen),
            (false, Some(weight)) => losses::<L, FMA, false, true>(measured, weight, seen),
            (true, None) => losses::<L, FMA, true, false>(measured, &[], seen),
            (true, Some(weight)) => losses::<L, FMA, true, true>(measured, weight, seen),
        };
        for channel in 0..2 {
            for lane in 0..L {
                totals[channel][lane] += sums[channel][lane];
            }
        }
    }
}

/// Steps under the same map.
#[inline(always)]
fn follow<const L: usize, const FMA: bool, const BRUSHES: bool>(
    x: &mut Pair<L>,
    step: &Step<L>,
    limits: &Pair<L>,
    gains: &[Pair<L>],
    seen: &mut [Pair<L>],
) {
    let Step { phi, needed, adds, .. } = step;
    let [mut i, mut w] = *x;
    for (gain, seen) in gains.iter().zip(seen) {
        *seen = [i, w];
        for lane in 0..L {
            let current =
                multiply_add::<FMA>(phi[0][lane], i[lane], multiply_add::<FMA>(phi[1][lane], w[lane], gain[0][lane]));
            let speed =
                multiply_add::<FMA>(phi[2][lane], i[lane], multiply_add::<FMA>(phi[3][lane], w[lane], gain[1][lane]));
            (i[lane], w[lane]) = (current, speed);
            if BRUSHES {
                let reaction = within(needed[0][lane] * i[lane], limits[0][lane]);
                i[lane] = multiply_add::<FMA>(adds[0][0][lane], reaction, i[lane]);
                w[lane] = multiply_add::<FMA>(adds[0][1][lane], reaction, w[lane]);
            }
            let reaction = within(needed[1][lane] * w[lane], limits[1][lane]);
            i[lane] = multiply_add::<FMA>(adds[1][0][lane], reaction, i[lane]);
            w[lane] = multiply_add::<FMA>(adds[1][1][lane], reaction, w[lane]);
        }
    }
    *x = [i, w];
}

/// A reaction within ± its limit.
#[inline(always)]
fn within(reaction: f64, limit: f64) -> f64 {
    let low = if reaction > -limit { reaction } else { -limit };
    if low < limit { low } else { limit }
}

/// Weighted sums of the errors of some samples.
#[inline(always)]
fn losses<const L: usize, const FMA: bool, const ABSOLUTE: bool, const WEIGHTED: bool>(
    measured: &[[f64; 2]],
    weights: &[[f64; 2]],
    seen: &[Pair<L>],
) -> Pair<L> {
    let mut sums = [[0.0; L]; 2];
    for (n, (measured, seen)) in measured.iter().zip(seen).enumerate() {
        let weight = if WEIGHTED { weights[n] } else { [1.0; 2] };
        for channel in 0..2 {
            for lane in 0..L {
                let error = measured[channel] - seen[channel][lane];
                sums[channel][lane] = add_loss::<FMA, ABSOLUTE, WEIGHTED>(sums[channel][lane], error, weight[channel]);
            }
        }
    }
    sums
}

/// Sensors that show the mean of their last samples, the oldest in part.
struct Sensor<const L: usize> {
    whole: [usize; L],
    part: [f64; L],
    /// 1/window.
    share: [f64; L],
    sum: [f64; L],
    /// The last values, at their number modulo the length; before the first sample, what the motor began with.
    ring: Vec<[f64; L]>,
}

impl<const L: usize> Sensor<L> {
    fn new(windows: [f64; L], initial: f64) -> Self {
        // More than any recording has is as good as all.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and 1e9")]
        let whole = windows.map(|window| window.clamp(1.0, WINDOW_MAX) as usize);
        let longest = whole.iter().copied().max().unwrap_or(1);
        #[expect(clippy::cast_precision_loss, reason = "at most 1e6")]
        let counts = whole.map(|whole| whole as f64);
        Self {
            whole,
            part: std::array::from_fn(|lane| windows[lane] - counts[lane]),
            share: windows.map(|window| 1.0 / window),
            sum: counts.map(|count| count * initial),
            ring: vec![[initial; L]; (longest + 1).next_power_of_two()],
        }
    }

    /// Replaces what passed at the samples from `start` on by what is shown of it.
    #[inline(always)]
    fn show(&mut self, start: usize, channel: usize, seen: &mut [Pair<L>]) {
        let mask = self.ring.len() - 1;
        for (n, seen) in (start..).zip(seen) {
            let mut oldest = [0.0; L];
            for lane in 0..L {
                oldest[lane] = self.ring[n.wrapping_sub(self.whole[lane]) & mask][lane];
            }
            let values = seen[channel];
            self.ring[n & mask] = values;
            for lane in 0..L {
                self.sum[lane] += values[lane] - oldest[lane];
                seen[channel][lane] = (self.sum[lane] + self.part[lane] * oldest[lane]) * self.share[lane];
            }
        }
    }
}

/// What drives a block of candidates over a stretch of constant inputs.
#[inline(always)]
pub(super) fn gain<const L: usize, const FMA: bool>(
    maps: &StepMaps<L>,
    [start, end]: [&[f64; L]; 2],
    torque: &[f64; L],
) -> Pair<L> {
    let mut gain = [[0.0; L]; 2];
    for axis in 0..2 {
        for lane in 0..L {
            let held =
                multiply_add::<FMA>(maps.taps[0][axis][lane], start[lane], maps.torque[axis][lane] * torque[lane]);
            gain[axis][lane] = multiply_add::<FMA>(maps.taps[1][axis][lane], end[lane], held);
        }
    }
    gain
}
