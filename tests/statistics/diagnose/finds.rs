//! Proves: findings name samples and values; the mask `auto` excludes outliers only in their channel, and a fit then finds the
//! motor; implausible units are reported even if a heading names them; findings precede the hint of a failed fit.

use super::{each, find, folder, only, steps};
use crate::support::changed;
use motorfit::identify::{IdentifySpec, identify};
use motorfit::motor::{Extension, Parameter, With};
use motorfit::record::{Mask, Preparation, Quantity, Record, Severity, can_cause_poor_fit, diagnose, read_recording};
use rand::RngExt as _;

/// Applies the mask `auto`.
fn masked(record: &Record) -> Record {
    Preparation { mask: vec![Mask::Auto], ..Preparation::default() }.apply(record).unwrap().remove(0)
}

#[test]
fn outliers_are_named_with_samples_and_values() {
    let spoiled = changed(&steps(), |s| {
        each(&mut s.speed, |n, w| if [700, 3200, 3201].contains(&n) { 400.0 } else { w });
    });
    let finding = only(&spoiled, "outliers");
    assert_eq!((finding.quantity, &finding.places), (Quantity::Speed, &vec![700..701, 3200..3202]));
    assert!(finding.message.to_string().contains("400.0 instead of"), "{}", finding.message);
    assert!(can_cause_poor_fit(finding.code) && finding.severity == Severity::Report);
    let of_voltage = changed(&steps(), |s| s.voltage[2300] = 20.0);
    let finding = only(&of_voltage, "outliers");
    let [place] = &finding.places[..] else { panic!("{finding:?}") };
    assert_eq!((finding.quantity, place), (Quantity::Voltage, &(2300..2301)));
    // Pulses of the drive voltage, steps, and peaks of the current are not outliers.
    assert_eq!(find(&super::steps_through(|_, v| v), "outliers"), None);
}

#[test]
fn masks_take_outliers_of_their_channel_alone() {
    let spoiled = changed(&steps(), |s| {
        each(&mut s.speed, |n, w| if n == 700 { 400.0 } else { w });
        s.voltage[2300] = 20.0;
    });
    let record = masked(&spoiled);
    let counting = record.counting();
    assert_eq!((counting[700], counting[699], counting[2300]), ([true, false], [true; 2], [true; 2]));
    assert!((record.samples().voltage[2300] - record.samples().voltage[2299]).abs() < 1e-9);
    assert!(record.source().notes.iter().any(|note| note.contains("replaced")), "{:?}", record.source().notes);
    assert_eq!(find(&record, "outliers").map(|finding| finding.quantity), Some(Quantity::Speed));
}

/// A segment of a wrong speed is not single outliers; masked by hand, it must not make the unit of the speed doubtful.
#[test]
fn masked_samples_have_no_part_in_magnitudes() {
    let spoiled =
        changed(&steps(), |s| each(&mut s.speed, |n, w| if (700..740).contains(&n) { 9e4 + n as f64 } else { w }));
    assert!(find(&spoiled, "units").is_some(), "{:?}", diagnose(&spoiled));
    let time = &spoiled.samples().time_s;
    let mask = Mask::Time { channels: [false, true], from: time[700], to: time[739] };
    let masked = Preparation { mask: vec![mask], ..Preparation::default() }.apply(&spoiled).unwrap().remove(0);
    assert_eq!(masked.counting().iter().filter(|counts| !counts[1]).count(), 40);
    assert_eq!(find(&masked, "units"), None);
}

#[test]
fn a_sensor_of_one_sign_is_found_without_a_speed_too() {
    for floor in [0.0, f64::NEG_INFINITY] {
        for has_speed in [true, false] {
            let spoiled = changed(&steps(), |s| {
                each(&mut s.current, |_, i| if floor == 0.0 { i.max(0.0) } else { i.abs() });
                if !has_speed {
                    s.speed = None;
                }
            });
            let finding = find(&spoiled, "current_clipped");
            assert!(finding.is_some(), "floor {floor}, speed {has_speed}");
            let record = masked(&spoiled);
            let left_out = record.counting().iter().filter(|counts| !counts[0]).count();
            assert!(left_out > 100, "{left_out}");
        }
    }
}

#[test]
fn a_motor_at_rest_under_a_constant_voltage_is_found() {
    let still = changed(&steps(), |s| {
        s.voltage.fill(6.0);
        s.current = None;
        let mut numbers = crate::support::varied::numbers(5);
        s.speed = Some((0..s.time_s.len()).map(|_| numbers.random_range(-0.5..0.5)).collect());
    });
    assert!(find(&still, "no_motion").is_some(), "{:?}", diagnose(&still));
}

#[test]
fn real_logs_of_newcomers() {
    let Some(folder) = folder() else { return };
    let read = |name: &str| read_recording(&folder.join("newcomer-logs").join(name), &[]).unwrap();
    let glitches = read("glitch.csv");
    let finding = diagnose(&glitches).remove(0);
    assert_eq!((finding.code, &finding.places), ("outliers", &vec![60..61, 150..151]));
    let spec = IdentifySpec { with: With::These(vec![Extension::Coulomb]), ..IdentifySpec::default() };
    let error = identify(std::slice::from_ref(&glitches), &spec).unwrap_err();
    assert!(error.hint().to_string().contains("99999 instead of"), "{}", error.hint());
    let found = identify(&[masked(&glitches)], &spec).unwrap();
    // The voltage is logged up to one sample late, which biases K by up to 3 %.
    let estimates = found.estimates;
    let k = estimates.iter().find(|e| e.name == Parameter::K.symbol()).and_then(|e| e.value).unwrap();
    assert!((k / 0.02 - 1.0).abs() < 0.03, "K {k}");
    let found: Vec<_> = diagnose(&read("i_wrongunit.csv")).into_iter().take(2).collect();
    assert!(found.iter().all(|finding| finding.code == "units" && finding.severity == Severity::Report), "{found:?}");
    let mut quantities: Vec<_> = found.iter().map(|finding| finding.quantity.to_string()).collect();
    quantities.sort();
    assert_eq!(quantities, ["current", "speed"]);
    assert_eq!(find(&read("k_good.csv"), "units"), None);
    assert_eq!(find(&read("k_good.csv"), "outliers"), None);
}
