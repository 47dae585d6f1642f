//! Classical Runge–Kutta steps of systems whose equations are smooth within a mode. A change of the mode is located by bisection.
//! Inputs are constant from sample to sample; delayed inputs divide the steps where they change.

pub type State = [f64; 4];
pub type Inputs = [f64; 3];
/// Up to two signs, directions of motion or sides of a contact; 0 at rest.
pub type Mode = [i8; 2];

/// A machine with its true parameters. States and inputs that it does not have are 0.
pub trait System {
    fn rate(&self, x: &State, u: &Inputs, mode: Mode) -> State;

    fn outputs(&self, x: &State, u: &Inputs) -> Vec<f64>;

    /// Returns the delay from the inputs to the equations.
    fn delay_s(&self) -> f64 {
        0.0
    }

    /// Returns quantities that are negative where the mode has ended.
    fn guards(&self, _: &State, _: &Inputs, _: Mode) -> [f64; 2] {
        [f64::INFINITY; 2]
    }

    /// Returns the state and the mode after the end of a mode, where one of its guards is negative.
    fn switch(&self, x: &State, _: &Inputs, mode: Mode, _: [f64; 2]) -> (State, Mode) {
        (*x, mode)
    }

    /// Returns the mode after a change of the inputs.
    fn enter(&self, _: &State, _: &Inputs, mode: Mode) -> Mode {
        mode
    }

    /// Returns the mode of the initial state.
    fn start(&self, _: &State, _: &Inputs) -> Mode {
        [0; 2]
    }
}

pub fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

fn step(system: &dyn System, x: &State, u: &Inputs, mode: Mode, h: f64) -> State {
    let moved = |by: f64, rate: &State| -> State { std::array::from_fn(|n| x[n] + by * rate[n]) };
    let first = system.rate(x, u, mode);
    let second = system.rate(&moved(0.5 * h, &first), u, mode);
    let third = system.rate(&moved(0.5 * h, &second), u, mode);
    let last = system.rate(&moved(h, &third), u, mode);
    std::array::from_fn(|n| x[n] + h / 6.0 * (first[n] + 2.0 * (second[n] + third[n]) + last[n]))
}

/// Integrates over a duration with constant inputs, through all ends of modes.
fn substep(system: &dyn System, (mut x, mut mode): (State, Mode), u: &Inputs, duration: f64) -> (State, Mode) {
    let is_over = |guards: [f64; 2]| guards[0] < 0.0 || guards[1] < 0.0;
    let mut left = duration;
    for _ in 0..200 {
        let end = step(system, &x, u, mode, left);
        if !is_over(system.guards(&end, u, mode)) {
            return (end, mode);
        }
        // The mode lasts at `low` and has ended at `high`.
        let (mut low, mut high) = (0.0, left);
        while high - low > 1e-13 * duration {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if is_over(system.guards(&step(system, &x, u, mode, middle), u, mode)) {
                high = middle;
            } else {
                low = middle;
            }
        }
        x = step(system, &x, u, mode, high);
        (x, mode) = system.switch(&x, u, mode, system.guards(&x, u, mode));
        left -= high;
        if left <= 0.0 {
            return (x, mode);
        }
    }
    panic!("200 changes of the mode within {duration} s");
}

fn advance(system: &dyn System, start: (State, Mode), u: &Inputs, duration: f64, longest: f64) -> (State, Mode) {
    let substeps = (duration / longest - 1e-9).ceil().max(1.0);
    let mut at = (start.0, system.enter(&start.0, u, start.1));
    let mut done = 0.0;
    while done < substeps {
        at = substep(system, at, u, duration / substeps);
        done += 1.0;
    }
    at
}

/// Returns the outputs at the samples, shape `[outputs][samples]`, with a number of substeps in each sampling period. Before the first
/// sample the inputs have their first values.
pub fn simulated(
    system: &dyn System,
    initial: &State,
    inputs: &[Inputs],
    (period_s, substeps): (f64, f64),
) -> Vec<Vec<f64>> {
    let delay = system.delay_s() / period_s;
    let whole = (delay + 1e-9).floor();
    // The inputs of a sample act from `part` after the sample that is `whole` periods later.
    let part = if delay - whole > 1e-9 { (delay - whole) * period_s } else { 0.0 };
    let shift = motorfit::numeric::whole(whole);
    let longest = period_s / substeps;
    let mut at = (*initial, system.start(initial, &inputs[0]));
    let mut outputs = vec![Vec::new(); system.outputs(initial, &inputs[0]).len()];
    for n in 0..inputs.len() {
        let acting = &inputs[n.saturating_sub(shift)];
        for (all, value) in outputs.iter_mut().zip(system.outputs(&at.0, acting)) {
            all.push(value);
        }
        if part > 0.0 {
            at = advance(system, at, &inputs[n.saturating_sub(shift + 1)], part, longest);
        }
        at = advance(system, at, acting, period_s - part, longest);
    }
    outputs
}
