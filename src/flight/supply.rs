//! Battery voltage at rest, by one resistance for a whole flight.
//!
//! The autopilot estimates the resistance of the pack while it flies, and begins with a guess. What it logs as the
//! voltage at rest (`BAT.VoltR`) is the voltage at the terminals plus the drop over that resistance, and moves with the
//! estimate even where the pack does not: in ArduPilot's own simulator, whose pack has no resistance, by two percent
//! within one flight. Voltage and current of the log tell the resistance better.

use super::Series;
use crate::numeric::upper_median;

/// An estimate that moves by less than this share of itself is no estimate: somebody knows the pack. Chosen.
const KNOWN: f64 = 0.05;
/// A difference in the voltage at rest that does not matter, as a share: 2 us on a show drone (docs/physics.md,
/// 5.4). Chosen.
const SMALL: f64 = 0.003;
/// Voltage and current are taken less their means over this time to each side, s: the pack empties in minutes.
const SMOOTH_S: f64 = 10.0;
/// Current and voltage of one row are no further apart, s.
const SAME_ROW_S: f64 = 0.05;
/// Share of the rows at either end of the estimates that is left out when they are held against each other.
const ENDS: f64 = 0.1;

/// What a log has of its battery, over board time.
pub(super) struct Logged<'a> {
    pub(super) voltage_v: Option<&'a Series>,
    pub(super) current_a: Option<&'a Series>,
    /// The autopilot's estimates.
    pub(super) resting_v: Option<Series>,
    pub(super) resistance_ohm: Option<&'a Series>,
}

impl Logged<'_> {
    /// Voltage at rest and resistance of the pack; `flight` is from when to when it flew. The autopilot's own unless
    /// its estimate of the resistance moves and voltage and current tell it better.
    pub(super) fn at_rest(self, flight: (f64, f64)) -> (Option<Series>, Option<f64>) {
        let better = self.by_one_resistance(flight);
        let Self { resting_v, resistance_ohm, .. } = self;
        match better {
            Some((resting_v, ohm)) => (Some(resting_v), Some(ohm)),
            None => (resting_v, resistance_ohm.and_then(|ohm| upper_median(ohm.value.clone()))),
        }
    }

    fn by_one_resistance(&self, (start_s, end_s): (f64, f64)) -> Option<(Series, f64)> {
        self.resting_v.as_ref()?;
        let (volts, amps) = (self.voltage_v?, self.current_a?);
        let usual_v = upper_median(volts.between(start_s, end_s).to_vec())?;
        let usual_a = upper_median(amps.between(start_s, end_s).to_vec())?;
        let small_ohm = SMALL * usual_v / usual_a;
        let (low_ohm, high_ohm) = between_ends(self.resistance_ohm?.between(start_s, end_s))?;
        let is_known = high_ohm - low_ohm < KNOWN * high_ohm;
        let (ohm, se_ohm) = slope(volts, amps, (start_s, end_s))?;
        let apart_ohm = (ohm - low_ohm).abs().max((ohm - high_ohm).abs());
        let is_better = se_ohm < small_ohm && apart_ohm > small_ohm;
        if is_known || !is_better {
            return None;
        }
        let ohm = ohm.max(0.0);
        let rows = volts.time_s.iter().zip(&volts.value);
        let (time_s, value) = rows
            .filter_map(|(time_s, volts)| {
                Some((*time_s, volts + ohm * amps.at(*time_s, SAME_ROW_S)?))
            })
            .unzip();
        Some((Series { time_s, value }, ohm))
    }
}

/// Nearly the least and nearly the largest value.
fn between_ends(values: &[f64]) -> Option<(f64, f64)> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let end = (ENDS * values.len() as f64) as usize;
    Some((*values.get(end)?, *values.get(values.len().checked_sub(end + 1)?)?))
}

/// Resistance by which the voltage falls when the current rises, with its standard error, ohm.
fn slope(volts: &Series, amps: &Series, (start_s, end_s): (f64, f64)) -> Option<(f64, f64)> {
    let mut rows = Vec::new();
    for (time_s, volts) in
        volts.times_between(start_s, end_s).iter().zip(volts.between(start_s, end_s))
    {
        if let Some(amps) = amps.at(*time_s, SAME_ROW_S) {
            rows.push([*time_s, *volts, amps]);
        }
    }
    // Sums up to each row, for means over some of them.
    let mut sums = vec![[0.0; 2]];
    for [_, volts, amps] in &rows {
        let [v, a] = sums.last().copied().unwrap_or_default();
        sums.push([v + volts, a + amps]);
    }
    let (mut from, mut to) = (0, 0);
    let mut apart = Vec::with_capacity(rows.len());
    for [time_s, volts, amps] in &rows {
        while rows[from][0] < time_s - SMOOTH_S {
            from += 1;
        }
        while to < rows.len() && rows[to][0] <= time_s + SMOOTH_S {
            to += 1;
        }
        let count = (to - from) as f64;
        let mean = [0, 1].map(|which: usize| (sums[to][which] - sums[from][which]) / count);
        apart.push([volts - mean[0], amps - mean[1]]);
    }
    let product = |of: &dyn Fn(&[f64; 2]) -> f64| apart.iter().map(of).sum::<f64>();
    let squares = product(&|[_, amps]| amps * amps);
    let ohm = -product(&|[volts, amps]| volts * amps) / squares;
    let left = product(&|[volts, amps]| (volts + ohm * amps).powi(2));
    let se_ohm = (left / (apart.len() as f64 - 2.0) / squares).sqrt();
    (apart.len() > 2 && ohm.is_finite()).then_some((ohm, se_ohm))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLIGHT: (f64, f64) = (0.0, 300.0);

    fn series(of: impl Fn(f64) -> f64) -> Series {
        let time_s: Vec<f64> = (0..3000).map(|row| 0.1 * f64::from(row)).collect();
        let value = time_s.iter().map(|time_s| of(*time_s)).collect();
        Series { time_s, value }
    }

    /// A pack of some resistance that loses half a volt, under rungs of a ladder, and what the autopilot says of it.
    fn told(ohm: f64, estimate_ohm: impl Fn(f64) -> f64) -> (Series, f64) {
        let amps = |time_s: f64| 25.0 + 3.0 * (time_s / 10.0).floor().rem_euclid(3.0);
        let volts = |time_s: f64| 12.6 - 0.5 * time_s / 300.0 - ohm * amps(time_s);
        let voltage_v = series(volts);
        let current_a = series(amps);
        let resistance_ohm = series(&estimate_ohm);
        let logged = Logged {
            voltage_v: Some(&voltage_v),
            current_a: Some(&current_a),
            resting_v: Some(series(|time_s| volts(time_s) + estimate_ohm(time_s) * amps(time_s))),
            resistance_ohm: Some(&resistance_ohm),
        };
        let (resting_v, ohm) = logged.at_rest(FLIGHT);
        (resting_v.unwrap(), ohm.unwrap())
    }

    #[test]
    fn an_estimate_that_wanders_does_not_move_the_voltage_at_rest() {
        for ohm in [0.0, 0.02] {
            let (resting_v, found_ohm) = told(ohm, |time_s| 0.01 * (-time_s / 100.0).exp());
            assert!((found_ohm - ohm).abs() < 2e-4, "{found_ohm} for {ohm}");
            for time_s in [10.0, 150.0, 290.0] {
                let wanted_v = 12.6 - 0.5 * time_s / 300.0;
                let found_v = resting_v.at(time_s, 1.0).unwrap();
                assert!((found_v - wanted_v).abs() < 0.01, "{time_s}: {found_v} for {wanted_v}");
            }
        }
    }

    #[test]
    fn a_resistance_that_is_known_is_the_autopilots() {
        // It may know more than the log: 0.03 ohm where voltage and current say 0.02.
        let (resting_v, ohm) = told(0.02, |_| 0.03);
        assert_eq!(ohm, 0.03);
        assert!((resting_v.value[0] - (12.6 + 0.01 * 25.0)).abs() < 1e-9);
    }
}
