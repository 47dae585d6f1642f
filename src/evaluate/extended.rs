//! The kernel for motors with extensions: `L` candidates side by side. Where inputs come on time and sensors show what
//! there is, from stretch to stretch of constant inputs, like the linear motor's; else some samples at a time: first what
//! drives each candidate over them, then its steps, then what its sensors show, then the errors.

use super::kernel::{Block, LANES, LANES_AVX512, SUM_BLOCK};
use super::late::LateInputs;
use super::reaction::{Lanes, Pair, Samples, Step};
use super::sensor::Sensor;
use super::terminal::{Terminals, gain};
use super::{Problem, Signals, Span};
use crate::motor::{Extended, Parameter};
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

/// One recording on its way.
struct Run<'a, const L: usize> {
    problem: &'a Problem,
    signals: &'a Signals,
    steps: Vec<Step<L>>,
    terminals: Terminals<L>,
    lanes: Lanes<L>,
    /// Samples whose errors are in the sums of `lanes`, not yet in `totals`.
    summed: usize,
    totals: Pair<L>,
    /// Sensors that average.
    sensors: [Option<Sensor<L>>; 2],
}

impl<'a, const L: usize> Run<'a, L> {
    #[inline(always)]
    fn new(problem: &'a Problem, signals: &'a Signals, motors: &[Extended; L]) -> Self {
        let (extent, method) = (problem.extent(), problem.method());
        let steps: Vec<_> = signals.step_s.iter().map(|&h| Step::new(motors, h, extent, method)).collect();
        let sensors = [(Parameter::CurrentAverage, 0), (Parameter::SpeedAverage, 1)].map(|(of, channel)| {
            let windows = std::array::from_fn(|lane| motors[lane].get(of));
            extent.has(of).then(|| Sensor::new(windows, signals.initial[channel]))
        });
        let mut totals = [[0.0; L]; 2];
        // A map without numbers has no trajectory, even where nothing drives the motor.
        for lane in 0..L {
            totals[0][lane] = 0.0 * steps[0].maps.d.iter().map(|d| d[lane]).sum::<f64>();
        }
        let lanes = Lanes { x: signals.initial.map(|x| [x; L]), sums: [[0.0; L]; 2] };
        Self { problem, signals, steps, terminals: Terminals::new(motors), lanes, summed: 0, totals, sensors }
    }

    /// Weighted sums of errors per channel over the active samples.
    #[inline(always)]
    fn sums<const FMA: bool>(mut self, motors: &[Extended; L]) -> Pair<L> {
        if self.problem.extent().is_delayed() {
            self.run_late::<FMA>(motors);
        } else {
            self.run_on_time::<FMA>();
        }
        self.flush();
        self.totals
    }

    /// Stretch by stretch; short ones together.
    #[inline(always)]
    fn run_on_time<const FMA: bool>(&mut self) {
        let most = if self.problem.extent().is_averaged() { CHUNK } else { SUM_BLOCK };
        let mut gains = [[[0.0; L]; 2]; CHUNK];
        // How many samples of short stretches wait, all under the map `step`.
        let (mut waiting, mut step) = (0, 0);
        for span in self.problem.spans(self.signals).map(Some).chain([None]) {
            let start = span.map_or(self.signals.len(), |span| span.start);
            let joins =
                |span: &&Span| usize::from(span.step) == step && waiting + (span.end - span.start) <= gains.len();
            if waiting > 0 && !span.as_ref().is_some_and(joins) {
                self.advance::<FMA>(step, [start - waiting, start], gains[..waiting].iter());
                waiting = 0;
            }
            let Some(span) = span else { break };
            step = usize::from(span.step);
            let voltage = span.voltage.map(|voltage| self.terminals.of(voltage));
            let gain = gain::<L, FMA>(&self.steps[step].maps, &voltage, &self.terminals.torque(span.torque));
            if span.end - start < CHUNK {
                gains[waiting..waiting + span.end - start].fill(gain);
                waiting += span.end - start;
                continue;
            }
            let mut start = start;
            while start < span.end {
                let end = span.end.min(start + most);
                self.advance::<FMA>(step, [start, end], std::iter::repeat(&gain));
                start = end;
            }
        }
    }

    /// Some samples at a time.
    #[inline(always)]
    fn run_late<const FMA: bool>(&mut self, motors: &[Extended; L]) {
        let mut inputs = LateInputs::new(self.problem, self.signals, (motors, &self.steps));
        let mut gains = [[[0.0; L]; 2]; CHUNK];
        let (mut start, last) = (self.problem.first_active(self.signals), self.signals.len());
        while start < last {
            let end = last.min(start + CHUNK);
            inputs.fill::<FMA>((motors, &self.terminals), &self.steps, [start, end], &mut gains);
            let mut from = start;
            while from < end {
                let index = self.signals.step_of(from);
                let same = (from..end).take_while(|&n| self.signals.step_of(n) == index).count();
                let to = from + same;
                self.advance::<FMA>(usize::from(index), [from, to], gains[from - start..to - start].iter());
                from = to;
            }
            start = end;
        }
    }

    /// Steps under the same map.
    #[inline(always)]
    fn advance<'g, const FMA: bool>(
        &mut self,
        step: usize,
        range: [usize; 2],
        gains: impl Iterator<Item = &'g Pair<L>>,
    ) {
        if self.problem.extent().has(Parameter::BrushDrop) {
            self.advance_with::<FMA, true>(step, range, gains);
        } else {
            self.advance_with::<FMA, false>(step, range, gains);
        }
        self.summed += range[1] - range[0];
        if self.summed >= SUM_BLOCK {
            self.flush();
        }
    }

    #[inline(always)]
    fn advance_with<'g, const FMA: bool, const BRUSHES: bool>(
        &mut self,
        step: usize,
        [start, end]: [usize; 2],
        gains: impl Iterator<Item = &'g Pair<L>>,
    ) {
        let Self { problem, signals, steps, lanes, sensors, .. } = self;
        let step = &steps[step];
        let samples = Samples {
            measured: &signals.measured[start..end],
            weight: signals.weight.get(start..end).unwrap_or_default(),
        };
        let kind = (problem.criterion().is_absolute(), !signals.weight.is_empty());
        if sensors.iter().all(Option::is_none) {
            return match kind {
                (false, false) => lanes.follow::<FMA, BRUSHES, false, false>(step, samples, gains),
                (false, true) => lanes.follow::<FMA, BRUSHES, false, true>(step, samples, gains),
                (true, false) => lanes.follow::<FMA, BRUSHES, true, false>(step, samples, gains),
                (true, true) => lanes.follow::<FMA, BRUSHES, true, true>(step, samples, gains),
            };
        }
        let mut seen = [[[0.0; L]; 2]; CHUNK];
        let seen = &mut seen[..end - start];
        lanes.watch::<FMA, BRUSHES>(step, gains, seen);
        for (channel, sensor) in sensors.iter_mut().enumerate() {
            if let Some(sensor) = sensor {
                sensor.show(start, channel, seen);
            }
        }
        match kind {
            (false, false) => lanes.lose::<FMA, false, false>(samples, seen),
            (false, true) => lanes.lose::<FMA, false, true>(samples, seen),
            (true, false) => lanes.lose::<FMA, true, false>(samples, seen),
            (true, true) => lanes.lose::<FMA, true, true>(samples, seen),
        }
    }

    /// Moves the sums of a block to the totals: rounding then grows with the length of a block, not of the recording.
    #[inline(always)]
    fn flush(&mut self) {
        for channel in 0..2 {
            for lane in 0..L {
                self.totals[channel][lane] += self.lanes.sums[channel][lane];
            }
        }
        self.lanes.sums = [[0.0; L]; 2];
        self.summed = 0;
    }
}
