//! Units that give no motor.

use super::regression::{Row, Sums};
use super::{Channel, Finding, Quantity, Severity, View, text};
use crate::numeric::{count, upper_median};
use crate::text::{engineering, significant};

/// A period from which on time looks like milliseconds: 1 ms read as seconds is 1 s; slow loggers take 0.1 s.
const PERIOD_S: f64 = 0.9;
/// A speed in whole numbers above this is revolutions a minute; one above the second is, whatever its digits
/// (19,000 and 38,000 revolutions a minute as rad/s).
const SPEEDS: [f64; 2] = [300.0, 4000.0];
/// A speed above this is doubted even where its unit is named (15,000 revolutions a minute as rad/s).
const SPEED_DOUBTED: f64 = 1600.0;
/// Volts per rad/s below which a motor is none: 12 V at 76,000 revolutions a minute.
const VOLTS_PER_SPEED: f64 = 0.0015;
/// Ohms from the largest voltage and current below which it is no motor but a bus bar, and above which it is a meter.
const OHMS: [f64; 2] = [0.02, 50_000.0];
/// A resistance above which a current is doubted where the speed shows how much of the voltage is back-EMF.
const OHMS_MOST: f64 = 3_000.0;
/// A current in whole numbers above this is in mA, if the resistance is below 0.2 Ω.
const AMPERES: f64 = 20.0;
/// More than this, whatever its digits and its heading, at less than so many ohms, flows in no motor that is recorded so.
const AMPERES_SURE: f64 = 300.0;
const OHMS_SURE: f64 = 0.02;

pub(super) fn units(view: &View<'_>, findings: &mut Vec<Finding>) {
    findings.extend(time(view));
    findings.extend(view.speed.as_ref().and_then(|speed| speed_unit(view, speed)));
    let measured = view.current.as_ref().filter(|_| !view.by_current());
    findings.extend(measured.and_then(|current| current_unit(view, current)));
}

fn finding(view: &View<'_>, quantity: Quantity, what: String, unit: &str) -> Finding {
    let column = view.column(quantity);
    let heading = column.map_or("HEADING", |column| column.heading.as_str());
    let remedy = text!("If it is, name the unit: " [Columns = "{}={heading}:{unit}", quantity.key()]);
    Finding::new("units", quantity, what, remedy).mention_if(column.is_some_and(|column| column.unit_named))
}

fn time(view: &View<'_>) -> Option<Finding> {
    let period = view.period();
    (period >= PERIOD_S).then(|| {
        let what = format!("{} s between samples: the time looks like milliseconds", significant(period, 3));
        // Whatever the heading says: at such a period nothing is seen of a motor.
        let found = finding(view, Quantity::Time, what, "ms").figure("period_s", period);
        Finding { severity: Severity::Report, ..found }
    })
}

fn speed_unit(view: &View<'_>, speed: &Channel<'_>) -> Option<Finding> {
    let whole = is_whole(speed);
    let weak = !view.by_current() && view.input.peak / speed.peak < VOLTS_PER_SPEED;
    let too_fast = speed.peak > SPEEDS[1] || speed.peak > SPEEDS[0] && weak;
    let is_driven = view.by_current() || view.input.peak > 0.0;
    if !(too_fast && is_driven || whole && speed.peak > SPEEDS[0]) {
        return None;
    }
    let peak = significant(speed.peak, 3);
    let how = if whole { "in whole numbers" } else { "taken as rad/s" };
    let what = format!("the speed, {how} and up to {peak}, looks like revolutions a minute");
    let found = finding(view, Quantity::Speed, what, "rpm").mention_if(!whole && speed.peak < SPEEDS[1]);
    // Whatever the heading says.
    let is_sure = speed.peak > if whole { SPEED_DOUBTED } else { SPEEDS[1] };
    Some(found.report_if(is_sure && is_driven).figure("peak", speed.peak))
}

fn current_unit(view: &View<'_>, current: &Channel<'_>) -> Option<Finding> {
    if current.peak == 0.0 || view.input.peak == 0.0 {
        return None;
    }
    let resistance = resistance(view, current);
    // A current that is next to nothing but noise; that of a fast binary voltage looks the same.
    if resistance.is_none() && current.floor() > 0.3 * current.peak {
        return None;
    }
    let ohms = view.input.peak / current.peak;
    // Under a slow voltage most of it is back-EMF: the peaks say more ohms than there are.
    let least = resistance.map_or(ohms, |resistance| resistance.min(ohms));
    let whole = is_whole(current);
    let what = |ohms: f64, unit: &str| {
        let shown = engineering(ohms, "Ω", 2);
        format!("voltage over current is {shown}, which is no motor's: the current looks like {unit}")
    };
    if least < OHMS[0] || whole && current.peak > AMPERES && least < 0.2 {
        let found = finding(view, Quantity::Current, what(least, "mA taken as A"), "mA");
        let is_sure = whole && current.peak > AMPERES || least < OHMS_SURE && current.peak > AMPERES_SURE;
        return Some(found.mention_if(!whole).report_if(is_sure).figure("ohms", least));
    }
    let most = resistance.unwrap_or(ohms);
    if most > OHMS[1] || resistance.is_some_and(|ohms| ohms > OHMS_MOST) {
        let found = finding(view, Quantity::Current, what(most, "A taken as mA or µA"), "A");
        return Some(found.mention_if(true).report_if(resistance.is_some()).figure("ohms", most));
    }
    None
}

/// The resistance by v = R i + K ω, where speed and current are known and explain the voltage.
fn resistance(view: &View<'_>, current: &Channel<'_>) -> Option<f64> {
    let speed = view.speed.as_ref().filter(|speed| speed.peak > 0.0)?;
    let (v, i, w) = (view.input.values, current.values, speed.values);
    let mut sums = Sums::default();
    // A voltage acts from its sample on: the mean of two samples has answered it.
    let rows = || {
        (1..v.len())
            .map(|n| (Row::from([i[n] / current.peak, w[n] / speed.peak, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), v[n - 1]))
    };
    rows().for_each(|(row, volts)| sums.add(&row, volts));
    let solution = sums.solve();
    let [r, k] = [solution.coefficients[0] / current.peak, solution.coefficients[1] / speed.peak];
    let left: f64 = rows().map(|(row, volts)| (volts - solution.predicted(&row)).powi(2)).sum();
    let all: f64 = v.iter().map(|v| v * v).sum();
    (r > 0.0 && k > 0.0 && left < 0.05 * all).then_some(r)
}

/// Returns whether the values are whole numbers, and more than a few different ones.
fn is_whole(channel: &Channel<'_>) -> bool {
    let values = channel.values;
    let mut moving: Vec<f64> = values.iter().copied().filter(|v| *v != 0.0).collect();
    let (size, whole) = (moving.len(), moving.iter().filter(|v| v.fract() == 0.0).count());
    moving.truncate(2000);
    size >= 10 && count(whole) > 0.98 * count(size) && upper_median(&mut moving).abs() > 1.0
}
