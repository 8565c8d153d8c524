//! Numbers and names of a verdict as people read them.

use crate::gap::Dependence;
use crate::gap::verdict::{Detectable, Finding, InField, Interval, MapGain, Regime, Rest};
use crate::gap::words::short;

use super::text::{NONE, clean, count, fixed, signed, unit, usable};

/// Foreign or generated text with `µs` where files say `us`.
pub(super) fn micro(text: &str) -> String {
    let text = clean(text);
    let mut out = String::with_capacity(text.len());
    let mut word = String::new();
    for c in text.chars().chain(std::iter::once('\0')) {
        if c.is_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        out.push_str(if word == "us" { "µs" } else { &word });
        word.clear();
        if c != '\0' {
            out.push(c);
        }
    }
    out
}

/// A true minus sign.
pub(super) fn minus(number: &str) -> String {
    number.replace('-', "−")
}

/// A number with three significant digits.
pub(super) fn number(value: f64) -> String {
    if usable(value) { minus(&short(value)) } else { fixed(value, 0) }
}

/// A value with its interval: `0.40 (0.39 to 0.41)`.
fn interval_to(interval: Interval, decimals: usize) -> String {
    format!("{} ({})", fixed(interval.value, decimals), range_to(interval, decimals))
}

/// Only the ends of an interval.
pub(super) fn range_to(interval: Interval, decimals: usize) -> String {
    format!("{} to {}", fixed(interval.low, decimals), fixed(interval.high, decimals))
}

/// Widest interval of a share that says anything.
const WIDEST: f64 = 2.0;

/// A share with its interval, per cent, to the digits that the interval supports.
pub(super) fn percent(Interval { value, low, high }: Interval) -> (String, String) {
    if !(low..=high).contains(&value) || high - low > WIDEST {
        // A gap that hardly stands above the floor has no share to speak of.
        return (NONE.to_owned(), "gap hardly above the floor".to_owned());
    }
    let of = |share: f64| fixed(100.0 * share, usize::from(high - low < 0.03));
    (format!("{} %", of(value)), format!("{} to {} %", of(low), of(high)))
}

/// What the findings do to the map of the air, where its truth is known.
pub(super) fn map_words(map: &MapGain) -> String {
    let signed = |value: f64| format!("{}{}", if value < 0.0 { "" } else { "+" }, fixed(value, 2));
    format!(
        "The map of the air of {} by this model (the report's is by the calibration's laws, and has other errors), against the truth ({}, running means of 10 s): \
         rms error {} m/s before, {} m/s after (answering zero: {}); the part common to all \
         drones: {} before, {} after (the air that both flights shared makes ±{} likely); the \
         rest: {} and {}",
        clean(&map.flight),
        count(map.drones, "drone"),
        fixed(map.before.rms_mps, 2),
        fixed(map.after.rms_mps, 2),
        fixed(map.zero_mps, 2),
        signed(map.before.bias_mps),
        signed(map.after.bias_mps),
        fixed(map.common_sd_mps, 2),
        fixed(map.before.without_bias_mps, 2),
        fixed(map.after.without_bias_mps, 2),
    )
}

/// Fisher z that is seen in every second flight.
const EVEN_Z: f64 = 4.0;

/// Why an effect of the usual size would not have been seen for sure.
pub(super) fn lost(one: &Detectable) -> &'static str {
    if one.usual_z.abs() >= EVEN_Z {
        "at its usual size it is seen in only some such flights"
    } else {
        "at its usual size it is lost in air and noise; larger ones are seen"
    }
}

/// The best candidate that was left, and why it is no finding.
pub(super) fn left_over(rest: &Rest) -> String {
    let gains = format!("{} would gain {:.1} nats", clean(&rest.candidate), rest.gain_nats);
    if rest.gain_nats < rest.threshold_nats {
        format!("{gains}, {:.1} are needed", rest.threshold_nats)
    } else {
        // Enough by its gain: then it moves the pulse by too little, or the air may do the same.
        format!("{gains}, but moves the pulse by too little, or as the air may")
    }
}

/// The size of an effect in units of the field, as half a sentence.
pub(super) fn in_field(size: &InField) -> String {
    let ranged = |of: Interval, decimals: usize, unit: &str| {
        format!("{} {unit} ({})", signed(of.value, decimals), range_to(of, decimals))
    };
    let mut parts = vec![ranged(size.response_us_per_mps, 1, "us/(m/s) in hover")];
    parts.extend(size.drag_m2.map(|area| ranged(area, 4, "m² of drag area")));
    let air = |mps: f64| format!("left out, it puts the air {} m/s off", fixed(mps, 2));
    parts.extend(size.air_mps.map(air));
    parts.join("; ")
}

/// A value with its unit.
pub(super) fn with_unit(value: f64, of: &str) -> String {
    let of = unit(of);
    if of.is_empty() { number(value) } else { format!("{} {of}", number(value)) }
}

/// One word for what a step found.
pub(super) fn kind(finding: &Finding) -> &'static str {
    match finding {
        Finding::Name { .. } => "named",
        Finding::Class { .. } => "class",
        Finding::Unknown { .. } => "unknown",
    }
}

/// What a regime is by.
pub(super) fn regime_title(by: Dependence) -> &'static str {
    match by {
        Dependence::Climb => "Climb speed",
        Dependence::Height => "Height",
        Dependence::Time => "Time",
        Dependence::Wind => "Horizontal speed",
        Dependence::Lean => "Lean",
        Dependence::Voltage => "Charge",
        Dependence::Place => "Place",
        Dependence::Drone => "Drone",
        other => other.name(),
    }
}

/// The axis of a regime, with unit.
pub(super) fn regime_axis(by: Dependence) -> &'static str {
    match by {
        Dependence::Climb => "commanded climb speed (m/s)",
        Dependence::Height => "height above ground (m)",
        Dependence::Time => "time since motor start (s)",
        Dependence::Wind => "horizontal speed relative to the air (m/s)",
        Dependence::Lean => "lean into the wind (°)",
        Dependence::Voltage => "charge of the battery (share)",
        Dependence::Place => "drones next to it in the array",
        Dependence::Drone => "slot",
        other => other.name(),
    }
}

/// The residual after as vertical air speed, by the response that `before` implies.
pub(super) fn after_mps(row: &Regime) -> f64 {
    let mps = row.after_us * row.before_mps / row.before_us.0;
    if mps.is_finite() { mps } else { 0.0 }
}

/// Root mean squares over classes by their bins: [before, after], each [us, m/s].
pub(super) fn of_regimes(rows: &[&Regime]) -> [[f64; 2]; 2] {
    let bins = rows.iter().map(|row| row.bins as f64).sum::<f64>().max(1.0);
    let rms = |of: &dyn Fn(&Regime) -> f64| {
        (rows.iter().map(|row| row.bins as f64 * of(row).powi(2)).sum::<f64>() / bins).sqrt()
    };
    [
        [rms(&|row| row.before_us.0), rms(&|row| row.before_mps)],
        [rms(&|row| row.after_us), rms(&after_mps)],
    ]
}

/// A chance as flights of a thousand.
pub(super) fn per_thousand(chance: f64) -> String {
    let flights = 1000.0 * chance;
    if (flights - flights.round()).abs() < 1e-6 { format!("{flights:.0}") } else { short(flights) }
}

/// An optional interval.
pub(super) fn or_none(of: Option<Interval>, decimals: usize) -> String {
    of.map_or_else(|| NONE.to_owned(), |of| interval_to(of, decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn microseconds_have_their_letter_and_words_stay() {
        assert_eq!(micro("from 52.1 to 5.1 us; thus"), "from 52.1 to 5.1 µs; thus");
        assert_eq!(micro("0.5 h us"), "0.5 h µs");
        assert_eq!(micro("us/(m/s) in use"), "µs/(m/s) in use");
        assert_eq!(micro("drift_us 17 us"), "drift_us 17 µs");
    }
}
