//! Rule on magnitudes that are implausible for a motor but plausible in another unit.

use super::finding::{Finding, Severity};
use super::regression::{Row, Sums};
use super::view::{Channel, View};
use crate::assumed::agreeing_units;
use crate::heading::Quantity;
use crate::position::{cause, position_disagrees};
use motorfit_core::numeric::{count, upper_median};
use motorfit_core::setting::text;
use motorfit_core::text::{engineering, significant};

/// Shortest period \[s\] at which times look like milliseconds: 1 ms read as seconds is 1 s; slow loggers have 0.1 s.
const PERIOD_S: f64 = 0.9;
/// Peak speeds \[rad/s\] above which a speed in whole numbers, or any speed, looks like revolutions per minute. They are 2,900
/// and 38,000 revolutions per minute.
const SPEEDS: [f64; 2] = [300.0, 4000.0];
/// Peak speed \[rad/s\] in whole numbers above which even a named unit is doubted: 15,000 revolutions per minute.
const SPEED_DOUBTED: f64 = 1600.0;
/// Smallest plausible ratio of peak voltage to peak speed \[V s/rad\]: 12 V at 76,000 revolutions per minute.
const VOLTS_PER_SPEED: f64 = 0.0015;
/// Range of plausible resistances \[ohm\]: a bus bar is below it, a measuring instrument above.
const OHMS: [f64; 2] = [0.02, 50_000.0];
/// Largest plausible resistance \[ohm\] if it is estimated with the back-EMF.
const OHMS_MOST: f64 = 3_000.0;
/// Peak current \[A\] in whole numbers above which it looks like mA, if the resistance is below 0.2 Ω.
const AMPERES: f64 = 20.0;
/// Peak current \[A\] above which even a named unit is doubted, if the resistance is below [`OHMS_SURE`].
const AMPERES_SURE: f64 = 300.0;
/// Resistance \[ohm\] that belongs to [`AMPERES_SURE`].
const OHMS_SURE: f64 = 0.02;

pub(super) fn units(view: &View<'_>, findings: &mut Vec<Finding>) {
    findings.extend(time(view));
    findings.extend(beside_position(view));
    findings.extend(view.speed.as_ref().and_then(|speed| speed_unit(view, speed)));
    let measured = view.current.as_ref().filter(|_| !view.by_current());
    findings.extend(measured.and_then(|current| current_unit(view, current)));
}

/// Creates a finding with the unit that is more plausible; only a remark if the file names its unit.
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
        // Reported in spite of a named unit: with such a period a motor is not identifiable.
        let found = finding(view, Quantity::Time, what, "ms").figure("period_s", period);
        Finding { severity: Severity::Report, ..found }
    })
}

/// Compares the speed with the position beside it.
fn beside_position(view: &View<'_>) -> Option<Finding> {
    let ratio = view.position_ratio()?;
    let message = position_disagrees(ratio, "speed")?;
    let is_of_units = cause(ratio).is_some();
    let (code, remedy) = match agreeing_units(view.record) {
        Some(units) => ("units_disagree", text!("If they are others, name them: ").and(units).and(".")),
        None if is_of_units => {
            ("units_disagree", text!("Name both units: " [Columns = "speed=HEADING:UNIT,position=HEADING:UNIT"] "."))
        }
        None => {
            let what = "If the position is that of another shaft, leave it out: ";
            ("position_ratio", text!("{what}" [Columns = "position=-"] "."))
        }
    };
    Some(Finding::new(code, Quantity::Speed, message, remedy).figure("ratio", ratio))
}

fn speed_unit(view: &View<'_>, speed: &Channel<'_>) -> Option<Finding> {
    let whole = is_whole(speed);
    let weak = !view.by_current() && view.input.peak / speed.peak < VOLTS_PER_SPEED;
    let too_fast = speed.peak > SPEEDS[1] || speed.peak > SPEEDS[0] && weak;
    let is_driven = view.by_current() || view.input.peak > 0.0;
    if !(too_fast && is_driven || whole && speed.peak > SPEEDS[0]) {
        return None;
    }
    let is_converted = view.column(Quantity::Speed).is_some_and(|column| column.unit_named && column.unit != "rad/s");
    if is_converted {
        return None;
    }
    let peak = significant(speed.peak, 3);
    let how = if whole { "in whole numbers" } else { "taken as rad/s" };
    let what = format!("the speed, {how} and up to {peak}, looks like revolutions per minute");
    let found = finding(view, Quantity::Speed, what, "rpm").mention_if(!whole && speed.peak < SPEEDS[1]);
    // Extreme speeds are reported in spite of a named unit.
    let is_sure = speed.peak > if whole { SPEED_DOUBTED } else { SPEEDS[1] };
    Some(found.report_if(is_sure && is_driven).figure("peak", speed.peak))
}

fn current_unit(view: &View<'_>, current: &Channel<'_>) -> Option<Finding> {
    if current.peak == 0.0 || view.input.peak == 0.0 {
        return None;
    }
    let resistance = resistance(view, current);
    // A current that is almost only noise is inconclusive; one under a fast binary voltage looks the same.
    if resistance.is_none() && current.floor() > 0.3 * current.peak {
        return None;
    }
    let ohms = view.input.peak / current.peak;
    // Under a slow voltage, which is mostly back-EMF, the ratio of the peaks exceeds the resistance.
    let least = resistance.map_or(ohms, |resistance| resistance.min(ohms));
    let whole = is_whole(current);
    let what = |ohms: f64, unit: &str| {
        let shown = engineering(ohms, "Ω", 2);
        format!("voltage over current is {shown}, implausible for a motor: the current looks like {unit}")
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

/// Estimates the resistance \[ohm\] by least squares of v = R i + K ω; `None` without a speed, or if the fit is poor.
fn resistance(view: &View<'_>, current: &Channel<'_>) -> Option<f64> {
    let speed = view.speed.as_ref().filter(|speed| speed.peak > 0.0)?;
    let (v, i, w) = (view.input.values, current.values, speed.values);
    let mut sums = Sums::default();
    // A voltage acts from its sample on, so its response is in the next sample.
    let rows = || {
        (1..v.len())
            .map(|n| (Row::from([i[n] / current.peak, w[n] / speed.peak, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), v[n - 1]))
    };
    rows().for_each(|(row, volts)| sums.add(&row, volts));
    let solution = sums.solve();
    let [r, k] = [solution.coefficients[0] / current.peak, solution.coefficients[1] / speed.peak];
    let sse: f64 = rows().map(|(row, volts)| (volts - solution.predicted(&row)).powi(2)).sum();
    let all: f64 = v.iter().map(|v| v * v).sum();
    (r > 0.0 && k > 0.0 && sse < 0.05 * all).then_some(r)
}

/// Returns true if nearly all nonzero values are whole numbers, with a median beyond ±1.
fn is_whole(channel: &Channel<'_>) -> bool {
    let values = channel.values;
    let mut moving: Vec<f64> = values.iter().copied().filter(|v| *v != 0.0).collect();
    let (size, whole) = (moving.len(), moving.iter().filter(|v| v.fract() == 0.0).count());
    moving.truncate(2000);
    size >= 10 && count(whole) > 0.98 * count(size) && upper_median(&mut moving).abs() > 1.0
}
