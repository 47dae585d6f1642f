//! Writes WPILib data logs for tests, after the specification of the format (version 1.0).

/// A log in memory.
pub struct Log {
    pub bytes: Vec<u8>,
    entries: u32,
}

impl Log {
    /// Begins a log.
    pub fn new() -> Self {
        let mut bytes = b"WPILOG".to_vec();
        bytes.extend([0, 1, 0, 0, 0, 0]);
        Self { bytes, entries: 0 }
    }

    /// Adds a record; lengths are written in full.
    pub fn record(&mut self, entry: u32, time_us: u64, payload: &[u8]) {
        self.bytes.push(3 | 3 << 2 | 7 << 4);
        self.bytes.extend(entry.to_le_bytes());
        self.bytes.extend(u32::try_from(payload.len()).unwrap_or(u32::MAX).to_le_bytes());
        self.bytes.extend(time_us.to_le_bytes());
        self.bytes.extend(payload);
    }

    /// Declares an entry and returns its number.
    pub fn start(&mut self, name: &str, kind: &str, metadata: &str) -> u32 {
        self.entries += 1;
        let mut payload = vec![0];
        payload.extend(self.entries.to_le_bytes());
        for text in [name, kind, metadata] {
            payload.extend(u32::try_from(text.len()).unwrap_or(u32::MAX).to_le_bytes());
            payload.extend(text.as_bytes());
        }
        self.record(0, 0, &payload);
        self.entries
    }

    pub fn double(&mut self, entry: u32, time_us: u64, value: f64) {
        self.record(entry, time_us, &value.to_le_bytes());
    }

    pub fn text(&mut self, entry: u32, time_us: u64, text: &str) {
        self.record(entry, time_us, text.as_bytes());
    }
}

/// A mechanism by its characteristics, per radian or metre.
#[derive(Clone, Copy)]
pub struct Mechanism {
    pub ks: f64,
    pub kv: f64,
    pub ka: f64,
    pub kg: f64,
    /// Angle above the horizontal where the measured angle is 0; `None` for a constant weight.
    pub offset: Option<f64>,
    /// Standard deviation of the noise of the velocity; that of the position is a twentieth of it, in its unit.
    pub noise: f64,
}

/// Samples of a test: time \[s\], voltage, position and velocity.
pub type Rows = Vec<[f64; 4]>;

/// Simulates a test: `volts` for each period, on top of what balances gravity at the start. The velocity is exact over steps of a
/// twentieth of a period, during which gravity is constant; friction can stop the mechanism but not reverse it.
pub fn simulated(of: &Mechanism, start: f64, volts: &[f64], period: f64, noise: &mut dyn FnMut() -> f64) -> Rows {
    let gravity = |position: f64| of.kg * of.offset.map_or(1.0, |offset| (position + offset).cos());
    let base = gravity(start);
    let (mut position, mut velocity, mut rows) = (start, 0.0_f64, Vec::new());
    let h = period / 20.0;
    let decay = (-of.kv / of.ka * h).exp();
    for (n, volts) in volts.iter().enumerate() {
        let volts = base + volts;
        let time = period * f64::from(u32::try_from(n).unwrap_or(0));
        rows.push([time, volts, position + 0.05 * of.noise * noise(), velocity + of.noise * noise()]);
        for _ in 0..20 {
            let drive = volts - gravity(position);
            let rests = velocity.abs() < 1e-300;
            if rests && drive.abs() <= of.ks {
                continue;
            }
            let direction = if rests { drive.signum() } else { velocity.signum() };
            let steady = (drive - of.ks * direction) / of.kv;
            let next = steady + (velocity - steady) * decay;
            position += steady * h + (velocity - steady) * (1.0 - decay) * of.ka / of.kv;
            velocity = if !rests && next * velocity < 0.0 { 0.0 } else { next };
        }
    }
    rows
}

/// Names of the tests of SysId.
pub const TESTS: [&str; 4] = ["quasistatic-forward", "quasistatic-reverse", "dynamic-forward", "dynamic-reverse"];

/// Returns the voltages of a test beyond gravity: a ramp of 1 V/s for 2.5 s, or a step of 3 V for 1 s, with 50 Hz.
pub fn volts(test: &str) -> Vec<f64> {
    let sign = if test.ends_with("forward") { 1.0 } else { -1.0 };
    match test.starts_with("quasi") {
        true => (0..125).map(|n| sign * f64::from(n) * 0.02).collect(),
        false => vec![sign * 3.0; 50],
    }
}

/// Changes to a log of a routine.
pub struct Routine<'a> {
    pub mechanism: &'a str,
    pub tests: &'a [&'a str],
    pub units: [&'a str; 2],
    /// Factors of position and velocity, for wrong units and signs.
    pub factors: [f64; 2],
    /// True if the entry of the velocity is declared but has no records.
    pub is_empty: bool,
    /// True if each record is written twice.
    pub is_doubled: bool,
}

impl Default for Routine<'_> {
    fn default() -> Self {
        let units = ["Radian", "Radian per Second"];
        Self { mechanism: "arm", tests: &TESTS, units, factors: [1.0; 2], is_empty: false, is_doubled: false }
    }
}

/// Writes the tests of a routine into a log, from a time on \[µs\]; returns the time of the end.
pub fn write(log: &mut Log, routine: &Routine<'_>, rows: &dyn Fn(&str) -> Rows, from_us: u64) -> u64 {
    let Routine { mechanism, tests, units, factors, is_empty, is_doubled } = routine;
    let state = log.start(&format!("sysid-test-state-{mechanism}"), "string", "");
    let voltage = log.start(&format!("voltage-main-{mechanism}"), "double", "Volt");
    let position = log.start(&format!("position-main-{mechanism}"), "double", units[0]);
    let velocity = log.start(&format!("velocity-main-{mechanism}"), "double", units[1]);
    let mut now = from_us;
    for test in *tests {
        for [_, volts, at, speed] in rows(test) {
            for _ in 0..if *is_doubled { 2 } else { 1 } {
                // As on a robot: the values first, each a little later, then the state.
                log.double(voltage, now, volts);
                log.double(position, now + 100, at * factors[0]);
                if !is_empty {
                    log.double(velocity, now + 200, speed * factors[1]);
                }
                log.text(state, now + 300, test);
            }
            now += 20_000;
        }
        log.text(state, now, "none");
        now += 500_000;
    }
    now
}
