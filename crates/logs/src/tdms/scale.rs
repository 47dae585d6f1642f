//! Scaling of raw values by the properties `NI_Scale[…]` of TDMS files.

use super::object::Properties;
use motorfit_core::text::quoted;

/// Largest number of scales of a channel.
const SCALES_MAX: usize = 32;
/// Largest number of coefficients of a polynomial.
const COEFFICIENTS_MAX: usize = 32;
/// Input source of a scale that is applied to the raw values.
const RAW: f64 = 4_294_967_295.0;

/// Polynomial that is applied to each value.
#[derive(Debug, Clone, PartialEq)]
enum Scale {
    /// Slope and intercept.
    Linear(f64, f64),
    /// Coefficients from the constant one upwards.
    Polynomial(Vec<f64>),
}

/// Scales of a channel in the order of their application.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Scales(Vec<Scale>);

impl Scales {
    /// Returns the scales that the properties of a channel state, or else those of its group or of the file; none if the values
    /// are already scaled.
    ///
    /// # Errors
    /// Returns the reason if a scale is of an unsupported type or incomplete.
    pub(super) fn of<'p>(properties: impl IntoIterator<Item = &'p Properties>) -> Result<Self, String> {
        for properties in properties {
            if properties.text("NI_Scaling_Status") == Some("scaled") {
                return Ok(Self::default());
            }
            let count = match properties.number("NI_Number_Of_Scales") {
                Some(number) => index(number).ok_or("has a number of scales that is impossible")?,
                None => (0..SCALES_MAX).filter(|n| properties.text(&scale_type(*n)).is_some()).count(),
            };
            if count > SCALES_MAX {
                return Err(format!("has {count} scales, expected at most {SCALES_MAX}"));
            }
            if let Some(last) = count.checked_sub(1) {
                return chain(properties, last);
            }
        }
        Ok(Self::default())
    }

    /// Replaces raw values by scaled ones.
    pub(super) fn apply(&self, values: &mut [f64]) {
        for scale in &self.0 {
            for value in values.iter_mut() {
                *value = match scale {
                    Scale::Linear(slope, intercept) => *value * slope + intercept,
                    Scale::Polynomial(coefficients) => coefficients.iter().rev().fold(0.0, |sum, c| sum * *value + c),
                };
            }
        }
    }
}

/// Returns the name of the property with the type of a scale.
fn scale_type(number: usize) -> String {
    format!("NI_Scale[{number}]_Scale_Type")
}

/// Returns a number as an index.
fn index(number: f64) -> Option<usize> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "is a small whole number")]
    (number.fract() == 0.0 && (0.0..1e6).contains(&number)).then_some(number as usize)
}

/// Returns a scale and those that its input comes from, in the order of their application.
fn chain(properties: &Properties, last: usize) -> Result<Scales, String> {
    let mut scales = Vec::new();
    let mut at = last;
    // A scale takes its input from another one; more steps than scales are a loop.
    for _ in 0..SCALES_MAX {
        let kind = properties.text(&scale_type(at)).unwrap_or("DAQmx");
        let name = |field: &str| format!("NI_Scale[{at}]_{kind}_{field}");
        let number = |field: &str| {
            properties.number(&name(field)).ok_or_else(|| format!("has a scale without {}", quoted(&name(field))))
        };
        match kind {
            "Linear" => scales.push(Scale::Linear(number("Slope")?, number("Y_Intercept")?)),
            "Polynomial" => {
                let size = properties.number(&name("Coefficients_Size")).map_or(Some(4), index);
                let size = size.filter(|size| *size <= COEFFICIENTS_MAX);
                let size = size.ok_or("has a polynomial with an impossible number of coefficients")?;
                let coefficients = (0..size).map(|n| number(&format!("Coefficients[{n}]")));
                scales.push(Scale::Polynomial(coefficients.collect::<Result<_, _>>()?));
            }
            // The scale of this type only names its input.
            "AdvancedAPI" => (),
            other => return Err(format!("has a scale of type {}, expected Linear or Polynomial", quoted(other))),
        }
        let source = properties.number(&name("Input_Source")).unwrap_or(RAW);
        if source.total_cmp(&RAW).is_eq() {
            scales.reverse();
            return Ok(Scales(scales));
        }
        at = index(source).filter(|source| *source < SCALES_MAX).ok_or("has a scale with an impossible input")?;
    }
    Err("has scales that are their own input".to_owned())
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "exact equality is meant")]
    use super::super::source::Value;
    use super::*;

    fn properties(entries: &[(&str, Value)]) -> Properties {
        let mut properties = Properties::default();
        for (name, value) in entries {
            properties.insert((*name).to_owned(), value.clone());
        }
        properties
    }

    fn text(value: &str) -> Value {
        Value::Text(value.to_owned())
    }

    #[test]
    fn chains_of_scales() {
        let mut entries = vec![
            ("NI_Number_Of_Scales", Value::Number(3.0)),
            ("NI_Scale[0]_Scale_Type", text("Linear")),
            ("NI_Scale[0]_Linear_Slope", Value::Number(2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", Value::Number(-1.0)),
            ("NI_Scale[0]_Linear_Input_Source", Value::Number(RAW)),
            ("NI_Scale[1]_Scale_Type", text("AdvancedAPI")),
            ("NI_Scale[1]_AdvancedAPI_Input_Source", Value::Number(0.0)),
            ("NI_Scale[2]_Scale_Type", text("Polynomial")),
            ("NI_Scale[2]_Polynomial_Coefficients_Size", Value::Number(3.0)),
            ("NI_Scale[2]_Polynomial_Coefficients[0]", Value::Number(0.5)),
            ("NI_Scale[2]_Polynomial_Coefficients[1]", Value::Number(0.0)),
            ("NI_Scale[2]_Polynomial_Coefficients[2]", Value::Number(3.0)),
            ("NI_Scale[2]_Polynomial_Input_Source", Value::Number(1.0)),
        ];
        let mut values = [0.0, 1.0, 2.0];
        Scales::of([&properties(&entries)]).unwrap().apply(&mut values);
        assert_eq!(values, [3.5, 3.5, 27.5]);

        entries.pop();
        entries.push(("NI_Scale[2]_Polynomial_Input_Source", Value::Number(2.0)));
        assert!(Scales::of([&properties(&entries)]).unwrap_err().contains("their own input"));
        entries.pop();
        entries.push(("NI_Scale[2]_Polynomial_Input_Source", Value::Number(0.5)));
        assert!(Scales::of([&properties(&entries)]).unwrap_err().contains("impossible input"));
        entries.push(("NI_Scaling_Status", text("scaled")));
        let linear = properties(&entries[..5]);
        assert_eq!(Scales::of([&properties(&entries), &linear]), Ok(Scales::default()));
    }

    #[test]
    fn scales_of_groups_and_incomplete_scales() {
        let linear = [
            ("NI_Scale[0]_Scale_Type", text("Linear")),
            ("NI_Scale[0]_Linear_Slope", Value::Number(2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", Value::Number(1.0)),
        ];
        let scales = Scales::of([&Properties::default(), &properties(&linear)]).unwrap();
        assert_eq!(scales, Scales(vec![Scale::Linear(2.0, 1.0)]));
        let message = Scales::of([&properties(&linear[..2])]).unwrap_err();
        assert_eq!(message, "has a scale without \"NI_Scale[0]_Linear_Y_Intercept\"");
        let table = [("NI_Scale[0]_Scale_Type", text("Table"))];
        assert_eq!(
            Scales::of([&properties(&table)]).unwrap_err(),
            "has a scale of type \"Table\", expected Linear or Polynomial"
        );
        for count in [0.5, -1.0, f64::NAN, 33.0] {
            let message = Scales::of([&properties(&[("NI_Number_Of_Scales", Value::Number(count))])]).unwrap_err();
            assert!(message.contains("impossible") || message == "has 33 scales, expected at most 32");
        }
    }
}
