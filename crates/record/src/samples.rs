//! Signals of a recording, all of one length, in SI units.

use super::heading::Quantity;
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};

/// Largest number of samples of a recording.
pub const SAMPLES_MAX: usize = 100_000_000;

/// Largest absolute value of a signal in SI units; sums of squares over a recording remain finite.
pub const VALUE_MAX: f64 = 1e9;

/// Signals of a [`Record`](super::Record): all of one length, in SI units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// Time \[s\], increasing.
    pub time_s: Vec<f64>,
    /// Voltage \[V\]; empty if it was not recorded and the current is the input.
    pub voltage: Vec<f64>,
    /// Load torque \[N·m\], if it was recorded.
    pub torque: Option<Vec<f64>>,
    /// Current \[A\], if it was recorded.
    pub current: Option<Vec<f64>>,
    /// Speed \[rad/s\], if it was recorded.
    pub speed: Option<Vec<f64>>,
    /// Signals of a user's model, in the units of the model; empty for a recording of a DC motor.
    pub named: Vec<NamedSignal>,
}

/// A signal of a user's model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NamedSignal {
    /// Number of the signal in the requests of the import: inputs, then outputs, in the order of the model.
    pub number: usize,
    /// True for an input, which acts on the model over each step; false for a measured output.
    pub is_input: bool,
    /// Values at the samples.
    pub values: Vec<f64>,
}

impl NamedSignal {
    /// Returns the signal with other values.
    pub(super) fn with(&self, values: Vec<f64>) -> Self {
        Self { values, ..*self }
    }
}

/// Signals of a recording without the time, in their fixed order.
const SIGNALS: [Quantity; 4] = [Quantity::Voltage, Quantity::Torque, Quantity::Current, Quantity::Speed];

/// Returns the quantity of a signal of a model.
fn quantity(signal: &NamedSignal) -> Quantity {
    Quantity::Signal(u8::try_from(signal.number).unwrap_or(u8::MAX))
}

impl Samples {
    /// Returns the input quantity: the voltage, or the current if no voltage was recorded.
    pub(super) fn driver(&self) -> Quantity {
        if self.voltage.is_empty() { Quantity::Current } else { Quantity::Voltage }
    }

    /// Returns the samples of the input, in V or A.
    pub(super) fn input(&self) -> &[f64] {
        match self.driver() {
            Quantity::Current => self.current.as_deref().unwrap_or_default(),
            _ => &self.voltage,
        }
    }

    /// Returns the signals with another input.
    pub(super) fn with_input(self, input: Vec<f64>) -> Self {
        match self.driver() {
            // A recording of a model has its inputs among the named signals.
            _ if !self.named.is_empty() => self,
            Quantity::Current => Self { current: Some(input), ..self },
            _ => Self { voltage: input, ..self },
        }
    }

    /// Returns the samples of a range.
    ///
    /// # Panics
    /// Panics if the range exceeds the samples.
    #[must_use]
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let some = |signal: &Option<Vec<f64>>| signal.as_ref().map(|signal| signal[range.clone()].to_vec());
        Self {
            time_s: self.time_s[range.clone()].to_vec(),
            voltage: self.voltage.get(range.clone()).unwrap_or_default().to_vec(),
            torque: some(&self.torque),
            current: some(&self.current),
            speed: some(&self.speed),
            named: self.named.iter().map(|signal| signal.with(signal.values[range.clone()].to_vec())).collect(),
        }
    }

    /// Returns a signal; `None` if it was not recorded.
    pub(super) fn signal(&self, quantity: Quantity) -> Option<&[f64]> {
        match quantity {
            Quantity::Time => Some(&self.time_s),
            Quantity::Voltage => Some(self.voltage.as_slice()).filter(|voltage| !voltage.is_empty()),
            Quantity::Torque => self.torque.as_deref(),
            Quantity::Current => self.current.as_deref(),
            Quantity::Speed => self.speed.as_deref(),
            Quantity::Position => None,
            Quantity::Signal(number) => {
                let own = self.named.iter().find(|signal| signal.number == usize::from(number));
                own.map(|signal| signal.values.as_slice())
            }
        }
    }

    /// Returns the recorded signals without the time, in the order voltage, load torque, current, speed, signals of a model.
    pub fn signals(&self) -> impl Iterator<Item = (Quantity, &[f64])> {
        let named = self.named.iter().map(|signal| (quantity(signal), signal.values.as_slice()));
        SIGNALS.into_iter().filter_map(|quantity| Some((quantity, self.signal(quantity)?))).chain(named)
    }

    /// Applies a function to each recorded signal except the time.
    pub(super) fn change(&mut self, change: impl Fn(Quantity, &mut Vec<f64>)) {
        let voltage = Some(&mut self.voltage).filter(|voltage| !voltage.is_empty());
        let signals = [voltage, self.torque.as_mut(), self.current.as_mut(), self.speed.as_mut()];
        for (quantity, signal) in SIGNALS.into_iter().zip(signals) {
            if let Some(signal) = signal {
                change(quantity, signal);
            }
        }
        for signal in &mut self.named {
            change(quantity(signal), &mut signal.values);
        }
    }

    /// Checks that there are at least two samples, equally many in each signal, of an input and an output.
    pub(super) fn check_shape(&self) -> Result<()> {
        let count = self.time_s.len();
        if count < 2 {
            let message = format!("found {} of samples, expected at least 2", counted(count, "row"));
            let hint = "Record the motor while its voltage changes, a few hundred samples or more.";
            return Err(Error::data(message, hint));
        }
        if let Some((quantity, signal)) = self.signals().find(|(_, signal)| signal.len() != count) {
            let message = format!("{count} samples of time but {} of {quantity}", signal.len());
            return Err(Error::data(message, "Give every signal one value per sample."));
        }
        if !self.named.is_empty() {
            return Ok(());
        }
        let (message, remedy) = match (!self.voltage.is_empty(), &self.current, &self.speed) {
            (true, None, None) => (
                "neither current nor speed was recorded",
                "Record at least one of them; identifying all five parameters takes both.",
            ),
            (false, Some(_), None) => (
                "only the current was recorded: neither its cause nor its effect is known",
                "Record the voltage too, which identifies R and L, or the speed, which identifies the mechanical side.",
            ),
            (false, None, Some(_)) => {
                ("only the speed was recorded: the input is not known", "Record the voltage or the current too.")
            }
            (false, None, None) => {
                ("neither voltage, current nor speed was recorded", "Record voltage, current and speed.")
            }
            _ => return Ok(()),
        };
        Err(Error::data(message, remedy))
    }
}
