//! Signals of a recording, all of one length, in SI units.

use super::Quantity;
use crate::text::counted;
use crate::{Error, Result};

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
}

/// Signals of a recording without the time, in their fixed order.
const SIGNALS: [Quantity; 4] = [Quantity::Voltage, Quantity::Torque, Quantity::Current, Quantity::Speed];

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
        }
    }

    /// Returns the recorded signals without the time, in the order voltage, load torque, current, speed.
    pub fn signals(&self) -> impl Iterator<Item = (Quantity, &[f64])> {
        SIGNALS.into_iter().filter_map(|quantity| Some((quantity, self.signal(quantity)?)))
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
