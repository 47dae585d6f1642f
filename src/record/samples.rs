//! The signals of a recording.

use super::Quantity;
use crate::text::counted;
use crate::{Error, Result};

/// The signals of a recording, all of one length, SI units; the parts of a [`Record`](super::Record).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// Time \[s\], increasing.
    pub time_s: Vec<f64>,
    /// Voltage \[V\]; empty where it was not recorded, and the current is the input.
    pub voltage: Vec<f64>,
    /// Load torque \[N·m\].
    pub torque: Option<Vec<f64>>,
    /// Current \[A\].
    pub current: Option<Vec<f64>>,
    /// Speed \[rad/s\].
    pub speed: Option<Vec<f64>>,
}

/// The signals of a recording but time.
const SIGNALS: [Quantity; 4] = [Quantity::Voltage, Quantity::Torque, Quantity::Current, Quantity::Speed];

impl Samples {
    pub(super) fn driver(&self) -> Quantity {
        if self.voltage.is_empty() { Quantity::Current } else { Quantity::Voltage }
    }

    pub(super) fn input(&self) -> &[f64] {
        match self.driver() {
            Quantity::Current => self.current.as_deref().unwrap_or_default(),
            _ => &self.voltage,
        }
    }

    /// The same with another input.
    pub(super) fn with_input(self, input: Vec<f64>) -> Self {
        match self.driver() {
            Quantity::Current => Self { current: Some(input), ..self },
            _ => Self { voltage: input, ..self },
        }
    }

    /// Returns the samples of a range.
    ///
    /// # Panics
    /// When the range is not among the samples, as slices do.
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

    /// A signal, if it is there; none for what a recording does not hold.
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

    /// Returns the signals present, time left out, in the order voltage, load torque, current, speed.
    pub fn signals(&self) -> impl Iterator<Item = (Quantity, &[f64])> {
        SIGNALS.into_iter().filter_map(|quantity| Some((quantity, self.signal(quantity)?)))
    }

    /// Changes the signals present, time left out.
    pub(super) fn change(&mut self, change: impl Fn(Quantity, &mut Vec<f64>)) {
        let voltage = Some(&mut self.voltage).filter(|voltage| !voltage.is_empty());
        let signals = [voltage, self.torque.as_mut(), self.current.as_mut(), self.speed.as_mut()];
        for (quantity, signal) in SIGNALS.into_iter().zip(signals) {
            if let Some(signal) = signal {
                change(quantity, signal);
            }
        }
    }

    /// Returns whether there are samples, of one length, of an input and an output.
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
                "Record at least one of them; all five parameters need both.",
            ),
            (false, Some(_), None) => (
                "the current alone was recorded: nothing tells what it answers or drives",
                "Record the voltage beside it, which gives R and L, or the speed, which gives the mechanical side.",
            ),
            (false, None, Some(_)) => (
                "the speed alone was recorded: nothing tells what drives it",
                "Record the voltage or the current beside it.",
            ),
            (false, None, None) => {
                ("neither voltage, current nor speed was recorded", "Record voltage, current and speed.")
            }
            _ => return Ok(()),
        };
        Err(Error::data(message, remedy))
    }
}
