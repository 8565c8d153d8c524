//! The air of a flight and how sure it is, in sentences; of a calibration, its laws.

use crate::analysis::LawKind;
use crate::analysis::law::Symbol;
use crate::analysis::result::{FlightAnalysis, UpdraftMap};
use crate::analysis::statistics::result::TiltWind;
use crate::analysis::statistics::tilt_wind::DRAG_SHARE;
use crate::analysis::thermal::Thermal;
use crate::base::estimate::Estimate;
use crate::report::figures::air::{mean, mean_truth};
use crate::report::fleet_air::fleet_air;
use crate::report::law;
use crate::report::page::capitalised;
use crate::report::text::{
    clean, count, decimal_places, estimate, fixed, signed, signed_estimate, unit, usable,
};
use crate::report::{headline, posterior};

use super::extremes::{Extremes, moment};
use super::place::{duration, when};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// Wind below this is none to speak of, m/s.
const LEAST_WIND_MPS: f64 = 0.1;
/// The compass, clockwise from north.
const WINDS: [&str; 8] =
    ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];

/// The fleet's mean with all of its error, m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mean {
    pub(super) value: f64,
    pub(super) se: f64,
    /// 95 % interval; absent: not known.
    pub(super) interval: Option<[f64; 2]>,
}

impl Mean {
    /// The posterior's where there is one, else that of the drones' own means.
    pub(super) fn of(map: &UpdraftMap) -> Option<Self> {
        if let Some(Estimate { value, se }) = posterior::fleet(map) {
            let interval = Some([value - NORMAL * se, value + NORMAL * se]);
            return Some(Self { value, se, interval });
        }
        let air = fleet_air(map)?;
        let interval = air.error.half_width.map(|half| [air.mean - half, air.mean + half]);
        Some(Self { value: air.mean, se: air.error.se, interval })
    }

    /// Whether the interval leaves zero out.
    pub(super) fn is_told_from_zero(self) -> bool {
        let [low, high] =
            self.interval.unwrap_or([self.value - NORMAL * self.se, self.value + NORMAL * self.se]);
        low > 0.0 || high < 0.0
    }

    /// `+2.83 ± 0.23 m/s (95 %: +2.4 to +3.3 m/s)`
    fn words(self) -> String {
        let of = Estimate::new(self.value, self.se);
        let decimals = decimal_places(of);
        let interval = match self.interval.filter(|ends| ends.iter().all(|end| usable(*end))) {
            Some([low, high]) => {
                format!("95 %: {} to {} m/s", signed(low, decimals), signed(high, decimals))
            }
            None => "standard error; no 95 % interval is known".to_owned(),
        };
        format!("{} m/s ({interval})", signed_estimate(of))
    }
}

/// The air of a flight.
pub(super) fn air_sentences(flight: &FlightAnalysis, several: bool) -> Vec<String> {
    let Some(map) = &flight.map else { return Vec::new() };
    let mut said = Vec::new();
    let name =
        if several { format!("{}: ", capitalised(&clean(&flight.name))) } else { String::new() };
    let extremes = Extremes::of(flight, map);
    let over =
        when(flight).map_or_else(String::new, |when| format!(" and {}", duration(when.length_s())));
    if let Some(mean) = Mean::of(map) {
        let drones = map.drones.iter().filter(|drone| usable(drone.mean.value)).count();
        let whole = match (map.is_scan(), drones) {
            (true, n) => format!("the tracks of {}", count(n, "drone")),
            (false, 1) => "one place".to_owned(),
            (false, n) => format!("{n} places"),
        };
        said.push(if mean.is_told_from_zero() {
            let verb = if mean.value > 0.0 { "rose" } else { "sank" };
            format!(
                "{name}In the mean over {whole}{over} the air {verb}: its vertical speed was {}. That is not zero, \
                 by more than its error.",
                mean.words(),
            )
        } else {
            let so = if extremes.varies || !map.thermals.is_empty() {
                "This mean cannot be told from zero, though the air did rise and sink, in places and at times"
            } else {
                "That cannot be told from zero: the air may have risen, sunk or rested"
            };
            format!(
                "{name}In the mean over {whole}{over} the vertical speed of the air was {}. {so}.",
                mean.words(),
            )
        });
        said.extend(levelled_sentence(map));
        said.extend(truth_sentence(flight, map, mean));
    } else {
        said.push(format!("{name}No mean of the vertical air speed can be told."));
    }
    said.extend(extremes.sentences());
    said.extend(map.thermals.first().map(|thermal| {
        let n = map.thermals.len();
        let them = if n == 1 { "A thermal was".to_owned() } else { format!("{n} thermals were") };
        let which = if n == 1 { "" } else { ", the most certain one" };
        let peak = Thermal::size(&thermal.peak_mps).map_or_else(
            || "its strength is not determined".to_owned(),
            |peak| format!("{} m/s more in the core than around it", estimate(peak)),
        );
        let radius = Thermal::size(&thermal.radius_m).map_or_else(
            || "its radius is not determined".to_owned(),
            |radius| format!("{} m in radius", estimate(radius)),
        );
        format!(
            "{them} found{which}{} at {}: {peak}, {radius} (± is the half width of a 95 % interval).",
            of_core(flight, thermal),
            moment(when(flight), thermal.time_s),
        )
    }));
    said.push(wind_sentence(flight.statistics.as_ref().and_then(|found| found.wind.as_ref())));
    said
}

/// ` 40 m north-east of the show's origin`; nothing where directions are not known.
fn of_core(flight: &FlightAnalysis, thermal: &Thermal) -> String {
    let [x, y] = thermal.core_m.map(|of| of.value);
    let known = flight.orientation_deg.filter(|deg| usable(*deg) && usable(x + y));
    known.map_or_else(String::new, |forward_deg| {
        let bearing = forward_deg - y.atan2(x).to_degrees();
        format!(" {} m {} of the show's origin", fixed(x.hypot(y), 0), compass(bearing))
    })
}

/// Of a map whose zero is none of a calibration's.
fn levelled_sentence(map: &UpdraftMap) -> Option<String> {
    let [from, to] = map.levelled.as_ref()?.zero_s?;
    Some(format!(
        "The zero is the flight's own: the mean of the air from {} to {} s of show time is taken for none.",
        fixed(from, 0),
        fixed(to, 0)
    ))
}

/// Against the air of the simulator, or what an instrument beside the drones read.
fn truth_sentence(flight: &FlightAnalysis, map: &UpdraftMap, found: Mean) -> Option<String> {
    let truth = mean(map.drones.iter().filter_map(mean_truth))?;
    let inside = found.interval.map(|[low, high]| (low..=high).contains(&truth));
    let decimals = decimal_places(Estimate::new(truth, found.se));
    let where_it_lies = match inside {
        Some(true) => ", inside that interval",
        Some(false) => ", outside that interval",
        None => "",
    };
    let truth = signed(truth, decimals);
    Some(if flight.simulated {
        format!("The true mean of the simulated air was {truth} m/s{where_it_lies}.")
    } else {
        format!("The mean that was measured beside the drones was {truth} m/s{where_it_lies}.")
    })
}

/// `The wind was 2.9 ± 1.0 m/s from 270° (west), by the lean of the drones.`
fn wind_sentence(wind: Option<&TiltWind>) -> String {
    let unknown = "How strong the wind was cannot be told from this flight.";
    let Some(wind) = wind else { return unknown.to_owned() };
    let from = wind.from_deg.filter(|deg| usable(*deg)).map_or_else(
        || " from a direction that the logs do not tell".to_owned(),
        |deg| format!(" from {}° ({})", fixed(deg.rem_euclid(360.0), 0), compass(deg)),
    );
    let Some(speed) = wind.speed_mps.filter(|speed| usable(speed.value)) else {
        return format!(
            "The drones leaned by {}° into a wind{from}; its speed is not known, as the vehicle's drag is not.",
            fixed(wind.lean_deg, 1)
        );
    };
    let trim = wind.trim_se_mps.filter(|trim| usable(*trim)).unwrap_or(0.0);
    if speed.value < LEAST_WIND_MPS.max(trim) {
        let below = fixed(LEAST_WIND_MPS.max(2.0 * trim), 1);
        return format!(
            "There was no wind to speak of: below {below} m/s, as far as the lean of the drones can tell."
        );
    }
    // A box's drag is the simulator's own.
    let share = if wind.drag_speed_mps.is_some() { 0.0 } else { DRAG_SHARE };
    let se = speed.se.hypot(share * speed.value).hypot(trim);
    let with_drag = Estimate::new(speed.value, se);
    let of = if share > 0.0 { ", whose drag is known to a third or so" } else { "" };
    format!("The wind was {} m/s{from}, by the lean of the drones{of}.", estimate(with_drag))
}

/// The nearest of eight winds.
pub(super) fn compass(deg: f64) -> &'static str {
    let eighth = (deg.rem_euclid(360.0) / 45.0).round() as usize % WINDS.len();
    WINDS.get(eighth).copied().unwrap_or("north")
}

/// The laws of a flight in a campaign without a map.
pub(super) fn law_sentences(flight: &FlightAnalysis, several: bool) -> Vec<String> {
    let fitted = flight.drones.iter().filter(|drone| drone.laws.is_some()).count();
    if fitted == 0 {
        return Vec::new();
    }
    let name =
        if several { format!("{}: ", capitalised(&clean(&flight.name))) } else { String::new() };
    let of = count(flight.drones.len(), "drone");
    let mut said = vec![format!(
        "{name}The law of rotor effort against vertical speed was fitted for {fitted} of {of}."
    )];
    said.extend(slope_sentence(flight));
    if let Some((w, [low, high])) =
        headline::held(flight).and_then(|held| held.updraft.zip(held.interval_mps))
    {
        let mean = Mean { value: w.value, se: w.se, interval: Some([low, high]) };
        let told = if mean.is_told_from_zero() {
            "which is told from zero"
        } else {
            "which cannot be told from zero"
        };
        said.push(format!(
            "Against the calibration, the air's vertical speed was {}, {told}.",
            mean.words()
        ));
    } else {
        said.extend(fitted_w(flight));
    }
    said
}

/// How strongly effort follows vertical speed in hover.
fn slope_sentence(flight: &FlightAnalysis) -> Option<String> {
    let effort = unit(flight.indicator.unit());
    if let Some(line) = headline::bent_line(flight) {
        return Some(format!(
            "In hover, the effort changes by {} {effort} for each m/s of vertical speed through the air.",
            estimate(line.slope)
        ));
    }
    let laws = law::flight_laws(flight)?;
    let kind = headline::preferred(flight).or_else(|| crate::analysis::prefer::better_of(laws))?;
    let fit = law::fit_of(laws, kind).filter(|fit| fit.w_beyond_mps.is_none())?;
    match kind {
        LawKind::Linear => Some(format!(
            "The effort changes by {} {effort} for each m/s of vertical speed through the air.",
            estimate(fit.parameter(Symbol::Slope)?.estimate)
        )),
        LawKind::SignedQuadratic => Some(format!(
            "The effort changes with the square of the vertical speed through the air: by {} {effort} at 1 m/s, \
             four times that at 2 m/s.",
            estimate(fit.parameter(Symbol::A)?.estimate)
        )),
    }
}

/// The fits' own W*, where it is an air speed.
fn fitted_w(flight: &FlightAnalysis) -> Option<String> {
    let laws = law::flight_laws(flight)?;
    let kind = headline::preferred(flight).or_else(|| crate::analysis::prefer::better_of(laws))?;
    if kind == LawKind::Linear || law::vertex_mps(flight).is_some() {
        return None;
    }
    let fit = law::signed_quadratic(laws).filter(|fit| fit.w_beyond_mps.is_none())?;
    let w = fit.parameter(Symbol::W)?.estimate;
    let truth = flight.true_updraft_mps.filter(|w| usable(*w));
    let truth = truth
        .map_or_else(String::new, |truth| format!("; the true one was {} m/s", signed(truth, 2)));
    usable(w.value).then(|| {
        format!(
            "By the shape of that law alone, W* was {} m/s{truth}. The error is that of the fit: a shape that \
             is not quite the drones' own moves W* by several times as much, so that it is no measurement of the air.",
            signed_estimate(w)
        )
    })
}
