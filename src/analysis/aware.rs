//! The map's values with their errors: from the fleet's calibration law ([`super::zero`]) and a
//! drone's hover.
//!
//! Errors are made up where they are normal, in microseconds, and carried to metres per second
//! through the inverse of the law by quantiles, not by its slope: the signed quadratic has none at
//! hover, and the ends of an interval stay what they are under any rising function.

use super::battery::{self, Pack, Sag, Slow};
use super::budget::{BatteryCorrection, CommonError, ErrorBudget, Quality, QualityFlag};
use super::cause::Cause;
use super::corrections::{BATTERY, Corrections, DENSITY, DOUBTS, DRIFT, Raw, Referred, WINDS};
use super::hover::{Hover, Second};
use super::kriging::Value;
use super::law::LawKind;
use super::measured::Measured;
use super::reference::same_drone;
use super::result::{DroneAnalysis, FlightAnalysis, WindowStats};
use super::shape::{PARAMETERS, Shape};
use super::split::WindowPoint;
use super::stats::mean_sd;
use super::track_lean;
use super::zero::{DroneLaw, Fleet, Zero};
use crate::flight::Flight;
use crate::numeric::{least, mean};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// Seconds in a running mean, as in the paper.
const RUNNING: f64 = 10.0;
/// Slope of the pulse where nothing better is known, us/(m/s): the paper's A' of 26.4.
pub(super) const TYPICAL_SLOPE: f64 = 26.0;
/// Beyond this the inverse is not searched, m/s: far outside any ladder. Convention.
const FASTEST_MPS: f64 = 12.0;
/// Least slope of a line's bend as a share of its slope in hover: keeps the inverse unique where bends
/// extrapolate. Chosen.
const LEAST_SLOPE: f64 = 0.2;
/// A signed quadratic must be this much more probable than a line (logarithm of the evidence: odds of
/// seven to one). Chosen in favour of the line, because the inverse of the quadratic is useless in hover
/// (docs/physics.md, 1.2).
const CLEARLY: f64 = 2.0;
/// Why a law that was not chosen here is the map's.
pub(super) const ASKED_FOR: &str = "as asked for";
/// Rounds in which the vertical speed through the air is found together with the effect of the wind at it. 3
/// before scans, whose wind doubles the slope; chosen.
const CLIMB_ROUNDS: usize = 10;
/// Part of the way that is gone in each: with all of it, the rounds swing around the answer where wind
/// doubles the pulse's slope.
const CLIMB_STEP: f64 = 0.6;
/// Wind changes the pulse's slope by a factor between this and [`MOST_STEEPER`]: more is not believed. Pixel
/// has 1.5 at 7 m/s (docs/errors.md); chosen around that.
const LEAST_STEEPER: f64 = 0.7;
/// See [`LEAST_STEEPER`].
const MOST_STEEPER: f64 = 2.0;
/// Below this air velocity the slope of a signed quadratic is too flat to carry errors; this velocity's slope stands
/// in, m/s. Chosen: gusts of a drone on a calm day.
const STEEP_MPS: f64 = 0.15;
/// Relative standard error of the pulse's slope for each m/s by which the wind, by the lean, differs from the calibration's,
/// beside what the vehicle's file doubts. Measured: in eight foreign worlds the slope of a law from still air is 25 to 60 %
/// off in a wind that their lean reads as 1.4 m/s.
const SLOPE_PER_WIND: f64 = 0.25;
/// A slope is not taken for worse known than by this share of it. Numerical.
const MOST_SLOPE_SHARE: f64 = 0.5;
/// Air further out than the ladder by this is marked, m/s: one rung.
const BEYOND_MPS: f64 = 0.5;

/// A calibration ready for the map.
pub(super) struct Aware<'a> {
    reference: &'a FlightAnalysis,
    corrections: Corrections<'a>,
    pub(super) zero: Zero,
    pub(super) battery: Option<BatteryCorrection>,
    /// Indicator per vertical air speed of the drones' lines.
    slope: f64,
    /// Logarithms of the evidence for a line and for a signed quadratic, where they were compared.
    evidence: Option<[f64; 2]>,
}

/// Whether a drone's windows count for the fleet.
fn counts(reference: &FlightAnalysis, drone: &DroneAnalysis) -> bool {
    drone.laws.is_some() && (drone.partial_ladder.is_none() || reference.flock.is_none())
}

fn pack_of(drone: &DroneAnalysis, battery: Option<BatteryCorrection>) -> Option<Pack> {
    Pack::of(&battery::of_hovers(&drone.windows), battery?)
}

impl<'a> Aware<'a> {
    /// The law of the map.
    pub(super) fn law(&self) -> LawKind {
        match self.zero.shape {
            Shape::Line => LawKind::Linear,
            Shape::SignedQuadratic => LawKind::SignedQuadratic,
        }
    }

    /// Pulse per vertical air speed of the drones' lines, us/(m/s).
    pub(super) fn slope(&self) -> f64 {
        self.slope / self.corrections.per_us()
    }

    /// Places of the calibration's drones on the level, show frame, m.
    pub(super) fn homes_m(&self) -> Vec<[f64; 2]> {
        let counted = self.reference.drones.iter().filter(|drone| counts(self.reference, drone));
        counted.filter_map(|drone| drone.home_m).collect()
    }

    /// Constants of the drones' own laws with these places, us and m.
    pub(super) fn constants_us(&self) -> Vec<([f64; 2], f64)> {
        let all = self.reference.drones.iter().zip(&self.zero.drones);
        let counted = all.filter(|(drone, _)| counts(self.reference, drone));
        counted.filter_map(|(drone, law)| Some((drone.home_m?, law.as_ref()?.law[0]))).collect()
    }

    /// Where a drone of a slot hovered in the calibration, show frame, m; `None` if it has no law of its own.
    pub(super) fn home_m(&self, slot: u16) -> Option<[f64; 2]> {
        let drone = self.reference.drones.iter().find(|drone| drone.slot == Some(slot))?;
        drone.home_m.filter(|_| counts(self.reference, drone))
    }

    /// Why that law, in one phrase.
    pub(super) fn law_reason(&self) -> String {
        let Some([line, square]) = self.evidence else { return ASKED_FOR.to_owned() };
        let taken = match self.zero.shape {
            Shape::Line => {
                "a line that may bend, as the calibration's windows do not make the signed \
                quadratic clearly more probable"
            }
            Shape::SignedQuadratic => {
                "the signed quadratic, as the calibration's windows make it \
                clearly more probable than a line that may bend"
            }
        };
        format!(
            "{taken} (logarithms of the evidence: line {line:.1}, signed quadratic {square:.1}, which \
             must be {CLEARLY} higher); the chi2 of the tables is for a line without a bend"
        )
    }

    /// Fits the calibration for the map, with the law that the windows speak for unless one is
    /// given; `None` if they do not allow a fit.
    pub(super) fn new(
        reference: &'a FlightAnalysis,
        corrections: Corrections<'a>,
        sag: Option<Sag>,
        law: Option<LawKind>,
    ) -> Option<Self> {
        let windows = || reference.drones.iter().map(|drone| drone.windows.as_slice());
        let battery = sag.and_then(|sag| battery::correction(windows(), sag));
        let unknown_share =
            battery.map_or(0.0, |battery| battery::unknown_share(windows(), battery));
        let warm_up_us = sag.map(|sag| sag.warm_up_us);
        let corrections = Corrections { warm_up_us, unknown_share, ..corrections };
        let slopes: Vec<f64> = reference
            .drones
            .iter()
            .filter_map(|drone| Some(drone.laws.as_ref()?.linear.as_ref()?.parameters[0].estimate))
            .map(|slope| slope.value)
            .collect();
        let slope = if slopes.is_empty() { TYPICAL_SLOPE } else { mean_sd(&slopes).0 };
        // Priors and doubts are written for pulses: what another indicator says counts in us of a usual pulse.
        let indicator = reference.indicator;
        let unit = (!indicator.is_pulse() && slope > 0.0).then(|| slope / TYPICAL_SLOPE);
        let corrections = Corrections { indicator, unit, ..corrections };
        let mut packs = reference.drones.iter().filter_map(|drone| pack_of(drone, battery));
        let sigmas = corrections.sigmas(packs.next().as_ref());
        let points_of = |hovers| points(reference, &corrections, battery, slope, hovers);
        let mut compared = None;
        let shape = match law {
            Some(LawKind::Linear) => Shape::Line,
            Some(LawKind::SignedQuadratic) => Shape::SignedQuadratic,
            // Compared on the windows that both take: in hover the signed quadratic says nothing
            // about its parameters.
            None => {
                let legs = points_of(false);
                let evidence = |shape: Shape| {
                    Fleet::new(&legs, reference.drones.len(), shape, &sigmas)
                        .map_or(f64::NEG_INFINITY, |fleet| fleet.evidence())
                };
                let (line, square) = (evidence(Shape::Line), evidence(Shape::SignedQuadratic));
                compared = Some([line, square]);
                if square > line + CLEARLY { Shape::SignedQuadratic } else { Shape::Line }
            }
        };
        let points = points_of(shape == Shape::Line);
        let zero = Fleet::new(&points, reference.drones.len(), shape, &sigmas)?.laws();
        Some(Self { reference, corrections, zero, battery, slope, evidence: compared })
    }

    /// The air over one drone's hover. `Err`: why there is not one value.
    pub(super) fn measure(
        &self,
        flight: &Flight,
        hover: &Hover,
        slot: Option<u16>,
        name: &str,
    ) -> Result<Measured, Cause> {
        let (own, law, pack) = self.law_of(slot, name);
        let slow = Slow::of(flight);
        let pack = pack.filter(|_| slow.is_some());
        let values = Values { shape: self.zero.shape, law, zero: &self.zero };
        let track_table = self.corrections.track_table.filter(|_| hover.moves);
        let on_track =
            track_table.map(|table| Corrections { lean_table: Some(table), ..self.corrections });
        let refer = |second: &Second| {
            let resting_v = slow.as_ref().and_then(|slow| slow.at(second.time_s));
            let on_track = on_track.as_ref().filter(|_| track_lean::is_level(second));
            let corrections = on_track.unwrap_or(&self.corrections);
            self.refer(corrections, second, resting_v, pack.as_ref(), &values)
        };
        let all = |seconds: &[Option<Second>]| -> Vec<Option<(Referred, Raw)>> {
            seconds.iter().map(|second| second.as_ref().map(refer)).collect()
        };
        let mut referred = all(&hover.seconds);
        if on_track.is_some() {
            let climb_mps =
                |one: &Option<(Referred, Raw)>| values.air_mps(one.as_ref()?.0.pulse_us);
            let climbs_mps: Vec<Option<f64>> = referred.iter().map(climb_mps).collect();
            referred = all(&track_lean::at_level_leans(&hover.seconds, &climbs_mps));
        }
        let sigmas = self.corrections.sigmas(pack.as_ref());
        let mut measured = Measured { first_s: hover.first_s, is_own: own, ..Measured::default() };
        let known = self.seconds(&mut measured, &referred, &values, hover, &sigmas);
        if known.is_empty() {
            return Err(hover.nothing());
        }
        self.mean(&mut measured, &known, &values, hover, &sigmas);
        measured.quality.clone_from(&hover.quality);
        measured.quality.extend(self.doubtful(hover, &known, &referred, pack.as_ref()));
        Ok(measured)
    }

    /// Whether a drone has a law of its own, the law that speaks for it, and its battery in the calibration.
    fn law_of(&self, slot: Option<u16>, name: &str) -> (bool, &DroneLaw, Option<Pack>) {
        let found = same_drone(self.reference, slot, name);
        let index = found
            .and_then(|found| self.reference.drones.iter().position(|d| std::ptr::eq(d, found)));
        let own = index.and_then(|index| self.zero.drones.get(index)?.as_ref());
        let law = own.unwrap_or(&self.zero.flock);
        let pack = found.and_then(|drone| pack_of(drone, self.battery)).or_else(|| {
            self.reference.drones.iter().find_map(|drone| pack_of(drone, self.battery))
        });
        (own.is_some(), law, pack)
    }

    /// Vertical air speed, m/s, by other means of a log than those of the map's seconds, with the slope of small motions around
    /// hover ([`Shape::near_hover`]); and the relative standard error
    /// of its scale from what wind does to the pulse's slope.
    pub(super) fn values_of(
        &self,
        flight: &Flight,
        means: &[Option<Second>],
        slot: Option<u16>,
        name: &str,
    ) -> (Vec<Option<f64>>, f64) {
        let (_, law, pack) = self.law_of(slot, name);
        let slow = Slow::of(flight);
        let pack = pack.filter(|_| slow.is_some());
        let values = Values { shape: self.zero.shape, law, zero: &self.zero };
        let value = |second: &Second| {
            let resting_v = slow.as_ref().and_then(|slow| slow.at(second.time_s));
            let (one, _) = self.refer(&self.corrections, second, resting_v, pack.as_ref(), &values);
            Some(one.velocity_mps - values.near_hover(values.air_mps(one.pulse_us)?))
        };
        let found = means.iter().map(|second| second.as_ref().and_then(value)).collect();
        (found, self.doubted_slope(means, &values))
    }

    /// Relative standard error of the pulse's slope from what wind does to it: a wind's change of the pulse depends on the
    /// climb as well. What the calibration was flown in itself is in its law.
    fn doubted_slope(&self, means: &[Option<Second>], values: &Values<'_>) -> f64 {
        let over =
            |of: fn(&Second) -> f64| mean(means.iter().flatten().map(of)).unwrap_or_default();
        let lean_deg = over(|second| second.lean_deg);
        let raw = |climb_mps: f64| Raw {
            time_s: over(|second| second.time_s),
            pulse_us: over(|second| second.pulse_us),
            velocity_mps: climb_mps,
            climb_mps,
            lean_deg,
            height_m: over(|second| second.height_m),
            resting_v: None,
        };
        let doubts =
            |climb_mps: f64| self.corrections.refer(&raw(climb_mps), None, self.slope).doubts_us;
        let (up, down) = (doubts(0.5), doubts(-0.5));
        let sigmas = self.corrections.sigmas(None);
        // The second parameter of a line is its slope.
        let in_law = |doubt: usize| match values.shape {
            Shape::Line => values.law.answers[doubt][1],
            Shape::SignedQuadratic => 0.0,
        };
        let of = |doubt: usize| sigmas[doubt] * (up[doubt] - down[doubt] - in_law(doubt));
        let slope = values.slope(STEEP_MPS);
        let change = WINDS.into_iter().fold(0.0, |sum: f64, wind| sum.hypot(of(wind)));
        let by_file = if slope > 0.0 { change / slope } else { 0.0 };
        let other_wind =
            SLOPE_PER_WIND * (self.wind_mps(lean_deg) - self.calibrated_in_mps()).abs();
        by_file.hypot(other_wind).min(MOST_SLOPE_SHARE)
    }

    /// Wind that a lean is held against, m/s; where the vehicle's drag is not known, a degree for each m/s.
    fn wind_mps(&self, lean_deg: f64) -> f64 {
        let table = self.corrections.lean_table.and_then(|table| table.wind_at(lean_deg));
        table.unwrap_or(lean_deg)
    }

    /// Mean wind by the lean in the calibration's hovers, m/s.
    fn calibrated_in_mps(&self) -> f64 {
        let windows = self.reference.drones.iter().flat_map(|drone| &drone.windows);
        let leans = windows.filter(|window| window.kind.is_hover()).map(|window| window.lean_deg);
        self.wind_mps(mean(leans).unwrap_or_default())
    }

    /// A second with what is known besides the vertical air speed taken away, and as it was logged.
    fn refer(
        &self,
        corrections: &Corrections<'_>,
        second: &Second,
        resting_v: Option<f64>,
        pack: Option<&Pack>,
        values: &Values<'_>,
    ) -> (Referred, Raw) {
        let mut raw = Raw {
            time_s: second.time_s,
            pulse_us: second.pulse_us,
            velocity_mps: second.velocity_mps,
            climb_mps: second.velocity_mps,
            lean_deg: second.lean_deg,
            height_m: second.height_m,
            resting_v,
        };
        if corrections.lean_table.is_some() {
            // What wind does depends on the air that is looked for: at 7 m/s the pulse answers
            // climbs half as strongly again as in still air, or more.
            for _ in 0..CLIMB_ROUNDS {
                let pulse = corrections.pulse(&raw, pack);
                let Some(air_mps) = values.air_mps(pulse) else { break };
                raw.climb_mps += CLIMB_STEP * (air_mps - raw.climb_mps);
            }
        }
        (corrections.refer(&raw, pack, self.slope), raw)
    }

    /// Noise of a mean over one second, us; `slope`: pulse per vertical speed, us/(m/s).
    fn noise_us(&self, hover: &Hover, slope: f64) -> f64 {
        let per_us = self.corrections.per_us();
        hover.noise_us(slope * per_us) / per_us
    }

    /// Values of the seconds with their errors; the referred seconds that have one, with their air
    /// speed, m/s.
    fn seconds(
        &self,
        measured: &mut Measured,
        referred: &[Option<(Referred, Raw)>],
        values: &Values<'_>,
        hover: &Hover,
        sigmas: &[f64; DOUBTS],
    ) -> Vec<(Referred, f64)> {
        let mut known: Vec<(Referred, f64)> = Vec::new();
        let airs = referred.iter().flatten().filter_map(|(one, _)| values.air_mps(one.pulse_us));
        // Errors of the law at one speed: a slope that followed the values would shrink them until they looked calm.
        let middle_mps = mean(airs).unwrap_or_default();
        [measured.slope_share, measured.own_slope_share] = values.slope_shares(middle_mps);
        // What wind does beyond its correction is told by no flutter of the lean, which a drone's inertia delays: its
        // doubt is one constant.
        let steady = |doubt: usize| {
            mean(referred.iter().flatten().map(|(one, _)| one.doubts_us[doubt])).unwrap_or_default()
        };
        let steady_us = [WINDS[0], WINDS[1], DENSITY].map(|doubt| (doubt, steady(doubt)));
        for one in referred {
            let found = one.and_then(|(one, _)| Some((one, values.air_mps(one.pulse_us)?)));
            let Some((one, air_mps)) = found else {
                measured.updraft_mps.push(None);
                measured.sd_mps.push(None);
                measured.interval_mps.push(None);
                measured.modelled.push(None);
                continue;
            };
            known.push((one, air_mps));
            let noise_us = self.noise_us(hover, values.slope(air_mps)) / RUNNING.sqrt();
            let error = values.error(&one.doubts_us, air_mps, sigmas);
            let half_us = error.half_us(self.zero.width, noise_us);
            let interval = values.interval(&one, values.level_us(&one, air_mps, half_us));
            let noise = values.interval(&one, values.level_us(&one, air_mps, NORMAL * noise_us));
            let mut doubts_us = one.doubts_us;
            for (doubt, value) in steady_us {
                doubts_us[doubt] = value;
            }
            let middle = values.error(&doubts_us, middle_mps, sigmas);
            let per_mps = values.steep(&one, middle_mps);
            measured.modelled.push(Some(Value {
                updraft_mps: one.velocity_mps - air_mps,
                law: middle.basis.map(|basis| -basis / per_mps),
                doubts_mps: middle.doubts_us.map(|doubt| -doubt / per_mps),
                own_mps: middle.own_us2.sqrt() / per_mps,
                noise_mps: noise_us / values.steep(&one, air_mps),
            }));
            measured.updraft_mps.push(Some(one.velocity_mps - air_mps));
            measured.interval_mps.push(interval);
            measured.sd_mps.push(noise.map(|[low, high]| (high - low) / (2.0 * NORMAL)));
        }
        known
    }

    /// What is doubtful about the whole hover: air beyond the ladder, the battery, a drift.
    fn doubtful(
        &self,
        hover: &Hover,
        known: &[(Referred, f64)],
        referred: &[Option<(Referred, Raw)>],
        pack: Option<&Pack>,
    ) -> Vec<QualityFlag> {
        let mut quality = Vec::new();
        let mut flag = |flag: Quality, reason: String| {
            quality.push(QualityFlag { flag, start_s: hover.start_s, end_s: hover.end_s, reason });
        };
        let [low, high] = self.zero.speeds_mps;
        let beyond =
            |(_, air): &&(Referred, f64)| *air < low - BEYOND_MPS || *air > high + BEYOND_MPS;
        let count = known.iter().filter(beyond).count();
        if count > 0 {
            flag(
                Quality::BeyondLadder,
                format!("{count} s of faster air than the ladder's {low:+.1} to {high:+.1} m/s"),
            );
        }
        let without = |one: &&(Referred, Raw)| pack.is_none() || one.1.resting_v.is_none();
        let uncorrected = referred.iter().flatten().filter(without).count();
        if self.corrections.warm_up_us.is_some() && uncorrected > 0 {
            flag(
                Quality::NoVoltage,
                match (self.battery, uncorrected < known.len()) {
                    (None, _) => {
                        "no battery voltage in the calibration's logs: not corrected".to_owned()
                    }
                    (_, true) => {
                        format!("no battery voltage in {uncorrected} s: these are not corrected")
                    }
                    (_, false) => "no battery voltage in the log: not corrected".to_owned(),
                },
            );
        }
        if let Some(pack) = pack {
            let volts = referred.iter().flatten().filter_map(|(_, raw)| raw.resting_v);
            let least = least(volts).unwrap_or(f64::INFINITY);
            let share = pack.volts(least) / pack.correction.reference_v;
            if share < battery::LOW_SHARE {
                flag(
                    Quality::LowBattery,
                    format!("{least:.2} V at rest, {:.0} % of the calibration's", 100.0 * share),
                );
            }
        }
        // Along a track the air changes as well: only a hover's trend is a drift.
        let trend = Hover::trend_us_per_min(&known_times(referred));
        if let Some(per_minute) = trend.filter(|_| !hover.moves) {
            flag(Quality::Drift, format!("the pulse drifts by {per_minute:+.0} us per minute"));
        }
        quality
    }

    fn mean(
        &self,
        measured: &mut Measured,
        known: &[(Referred, f64)],
        values: &Values<'_>,
        hover: &Hover,
        sigmas: &[f64; DOUBTS],
    ) {
        let n = known.len() as f64;
        let over = |value: &dyn Fn(&(Referred, f64)) -> f64| {
            mean(known.iter().map(value)).unwrap_or(f64::NAN)
        };
        let air_mps = over(&|(_, air)| *air);
        measured.mean_mps = over(&|(one, air)| one.velocity_mps - air);
        let doubts_us: [f64; DOUBTS] =
            std::array::from_fn(|doubt| over(&|(one, _)| one.doubts_us[doubt]));
        let mut error = values.error(&doubts_us, air_mps, sigmas);
        // The mean of the derivatives, not the derivatives at the mean.
        error.basis =
            std::array::from_fn(|column| over(&|(_, air)| values.shape.basis(*air)[column]));
        error.common_us2 = values.common_us2(&error.basis);
        let slope = values.slope(air_mps);
        let noise_us = self.noise_us(hover, slope) / n.sqrt();
        let half_us = error.half_us(self.zero.width, noise_us);
        let end = |offset: f64| {
            over(&|(one, air)| {
                let offset = values.level_us(one, *air, offset);
                let moved = values.air_mps(one.pulse_us + offset).unwrap_or(*air);
                one.velocity_mps - moved
            })
        };
        let bias = hover.velocity_bias_mps;
        let (low, high) = (end(half_us), end(-half_us));
        let per_mps = if high > low { 2.0 * half_us / (high - low) } else { slope };
        let wider = |side: f64| measured.mean_mps + side.signum() * side.hypot(NORMAL * bias);
        measured.mean_interval_mps =
            [wider(low - measured.mean_mps), wider(high - measured.mean_mps)];
        let doubt = |index: usize| (error.doubts_us[index] / per_mps).abs();
        let zero_us2 = self.zero.common[(0, 0)].max(0.0);
        let rest_us2 = (error.common_us2 - zero_us2).max(0.0);
        let zero_us2 = error.common_us2 - rest_us2;
        let errors = ErrorBudget {
            window_mps: noise_us / per_mps,
            law_mps: (error.own_us2 + rest_us2).sqrt() / per_mps,
            zero_mps: zero_us2.sqrt() / per_mps,
            battery_mps: doubt(BATTERY).hypot(doubt(DRIFT)),
            wind_mps: doubt(WINDS[0]).hypot(doubt(WINDS[1])),
            density_mps: doubt(DENSITY),
            velocity_mps: bias,
            total_mps: 0.0,
        };
        let total_mps = [
            errors.window_mps,
            errors.law_mps,
            errors.zero_mps,
            errors.battery_mps,
            errors.wind_mps,
            errors.density_mps,
            errors.velocity_mps,
        ]
        .into_iter()
        .fold(0.0, f64::hypot);
        measured.errors = ErrorBudget { total_mps, ..errors };
        measured.basis = error.basis.map(|value| value / per_mps);
        measured.doubts_mps = error.doubts_us.map(|value| value / per_mps);
    }

    /// The error that these drones share.
    pub(super) fn common(&self, drones: &[&Measured]) -> CommonError {
        let over =
            |value: &dyn Fn(&&Measured) -> f64| mean(drones.iter().map(value)).unwrap_or_default();
        let basis: [f64; PARAMETERS] =
            std::array::from_fn(|column| over(&|drone| drone.basis[column]));
        let values = Values { shape: self.zero.shape, law: &self.zero.flock, zero: &self.zero };
        let shared2 = values.common_us2(&basis);
        let zero2 = (self.zero.common[(0, 0)].max(0.0) * basis[0] * basis[0]).min(shared2);
        let doubt = |index: usize| over(&|drone| drone.doubts_mps[index]).abs();
        let battery_mps = doubt(BATTERY).hypot(doubt(DRIFT));
        let wind_mps = doubt(WINDS[0]).hypot(doubt(WINDS[1]));
        let rest = battery_mps.hypot(wind_mps).hypot(doubt(DENSITY));
        CommonError {
            se_mps: shared2.sqrt().hypot(rest),
            half_width_mps: (self.zero.width * shared2.sqrt()).hypot(NORMAL * rest),
            zero_mps: zero2.sqrt(),
            battery_mps,
            wind_mps,
            density_mps: doubt(DENSITY),
            law_mps: (shared2 - zero2).max(0.0).sqrt(),
        }
    }
}

/// The usable windows of the drones that count.
fn points(
    reference: &FlightAnalysis,
    corrections: &Corrections<'_>,
    battery: Option<BatteryCorrection>,
    slope: f64,
    hovers: bool,
) -> Vec<WindowPoint> {
    let mut points = Vec::new();
    for (index, drone) in reference.drones.iter().enumerate() {
        if !counts(reference, drone) {
            continue;
        }
        let pack = pack_of(drone, battery);
        if battery.is_some() && pack.is_none() {
            continue;
        }
        let mut seen = std::collections::BTreeMap::<String, usize>::new();
        for window in &drone.windows {
            let command = (window.commanded_mps * 1000.0).round();
            let key = format!("{:?} {command}", window.kind);
            let count = seen.entry(key.clone()).or_default();
            let number = *count;
            *count += 1;
            let is_used = window.kind.is_leg() || hovers && window.kind.is_hover();
            if window.rejected.is_empty() && is_used {
                let referred = corrections.refer(&Raw::of(window), pack.as_ref(), slope);
                points.push(point(
                    index,
                    (key, number),
                    window,
                    &referred,
                    [slope, corrections.per_us()],
                ));
            }
        }
    }
    points
}

fn point(
    drone: usize,
    key: (String, usize),
    window: &WindowStats,
    referred: &Referred,
    [slope, per_us]: [f64; 2],
) -> WindowPoint {
    WindowPoint {
        drone,
        key,
        time_s: f64::midpoint(window.start_s, window.end_s),
        span_s: window.end_s - window.start_s,
        height_m: window.height_m,
        velocity_mps: referred.velocity_mps,
        pulse_us: referred.pulse_us,
        noise_us: window.effort_phi.se.hypot(slope * window.velocity_mps.se) / per_us,
        doubts_us: referred.doubts_us,
    }
}

fn known_times(referred: &[Option<(Referred, Raw)>]) -> Vec<(f64, f64)> {
    referred.iter().flatten().map(|(one, raw)| (raw.time_s, one.pulse_us)).collect()
}

/// One drone's law with its errors.
struct Values<'a> {
    shape: Shape,
    law: &'a DroneLaw,
    zero: &'a Zero,
}

/// Errors of a pulse against the law, us.
struct PulseError {
    basis: [f64; PARAMETERS],
    common_us2: f64,
    own_us2: f64,
    doubts_us: [f64; DOUBTS],
}

impl PulseError {
    /// Half width of the 95 % interval, us.
    fn half_us(&self, width: f64, noise_us: f64) -> f64 {
        let doubts: f64 = self.doubts_us.iter().map(|doubt| doubt * doubt).sum();
        let rest = self.own_us2 + doubts + noise_us * noise_us;
        (width * width * self.common_us2 + NORMAL * NORMAL * rest).sqrt()
    }
}

impl Values<'_> {
    fn slope(&self, air_mps: f64) -> f64 {
        self.shape.slope(&self.law.law, air_mps)
    }

    /// Inverse of the law, m/s; `None` where it has none.
    fn air_mps(&self, pulse_us: f64) -> Option<f64> {
        let law = &self.law.law;
        if self.shape == Shape::SignedQuadratic {
            let ratio = (pulse_us - law[0]) / law[1];
            let air = ratio.signum() * ratio.abs().sqrt();
            return (law[1] > 0.0 && air.abs() <= FASTEST_MPS).then_some(air);
        }
        let mut air = (pulse_us - law[0]) / law[1];
        for _ in 0..20 {
            let slope = self.slope(air);
            if !(slope >= LEAST_SLOPE * law[1] && air.abs() <= FASTEST_MPS) {
                return None;
            }
            let step = (self.shape.pulse_us(law, air) - pulse_us) / slope;
            air -= step;
            if step.abs() < 1e-9 {
                break;
            }
        }
        air.is_finite().then_some(air)
    }

    /// Air speed as [`Shape::near_hover`] has it, m/s.
    fn near_hover(&self, air_mps: f64) -> f64 {
        let [slowest, fastest] = self.zero.speeds_mps;
        self.shape.near_hover(&self.law.law, 0.5 * (fastest - slowest), air_mps)
    }

    fn common_us2(&self, basis: &[f64; PARAMETERS]) -> f64 {
        let p = self.zero.common.nrows();
        let mut sum = 0.0;
        for row in 0..p {
            for column in 0..p {
                sum += basis[row] * self.zero.common[(row, column)] * basis[column];
            }
        }
        sum.max(0.0)
    }

    fn error(&self, doubts_us: &[f64; DOUBTS], air_mps: f64, sigmas: &[f64; DOUBTS]) -> PulseError {
        let basis = self.shape.basis(air_mps);
        let mut own_us2 = 0.0;
        for row in 0..PARAMETERS {
            for column in 0..PARAMETERS {
                own_us2 += basis[row] * self.law.own[(row, column)] * basis[column];
            }
        }
        let doubts_us = std::array::from_fn(|doubt| {
            let answer: f64 = basis.iter().zip(&self.law.answers[doubt]).map(|(b, a)| b * a).sum();
            sigmas[doubt] * (doubts_us[doubt] - answer)
        });
        PulseError {
            basis,
            common_us2: self.common_us2(&basis),
            own_us2: own_us2.max(0.0),
            doubts_us,
        }
    }

    /// Standard errors of the slope by the fleet's law and by the drone's own part of it, as shares of it.
    fn slope_shares(&self, air_mps: f64) -> [f64; 2] {
        let by: [f64; PARAMETERS] = match self.shape {
            Shape::Line => [0.0, 1.0, 2.0 * air_mps, 2.0 * air_mps.abs()],
            Shape::SignedQuadratic => [0.0, 2.0 * air_mps.abs(), 0.0, 0.0],
        };
        let mut own = 0.0;
        for row in 0..PARAMETERS {
            for column in 0..PARAMETERS {
                own += by[row] * self.law.own[(row, column)] * by[column];
            }
        }
        let slope = self.slope(air_mps);
        [self.common_us2(&by), own.max(0.0)].map(|us2| {
            let share = us2.sqrt() / slope;
            if slope > 0.0 && share.is_finite() { share.min(MOST_SLOPE_SHARE) } else { 0.0 }
        })
    }

    /// Pulse per vertical air speed where a value was made, us/(m/s): never as flat as a signed quadratic
    /// is in hover, through which no error could be carried by its slope.
    fn steep(&self, one: &Referred, air_mps: f64) -> f64 {
        let steep = if self.shape == Shape::SignedQuadratic {
            air_mps.abs().max(STEEP_MPS)
        } else {
            air_mps
        };
        let slope = self.slope(steep);
        if slope <= 0.0 {
            return TYPICAL_SLOPE;
        }
        slope * (1.0 + one.steeper / slope).clamp(LEAST_STEEPER, MOST_STEEPER)
    }

    /// What a change of the pulse is at level flight without wind, us: where wind makes the pulse
    /// steeper in the vertical air speed, less.
    fn level_us(&self, one: &Referred, air_mps: f64, change_us: f64) -> f64 {
        let slope = self.slope(air_mps);
        if slope <= 0.0 {
            return change_us;
        }
        change_us / (1.0 + one.steeper / slope).clamp(LEAST_STEEPER, MOST_STEEPER)
    }

    fn interval(&self, one: &Referred, half_us: f64) -> Option<[f64; 2]> {
        let low = one.velocity_mps - self.air_mps(one.pulse_us + half_us)?;
        let high = one.velocity_mps - self.air_mps(one.pulse_us - half_us)?;
        Some([low, high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_errors_add_as_squares_and_the_common_one_has_its_own_width() {
        let mut doubts_us = [0.0; DOUBTS];
        doubts_us[0] = 2.0;
        doubts_us[DOUBTS - 1] = 3.0;
        let error =
            PulseError { basis: [0.0; PARAMETERS], common_us2: 5.0, own_us2: 7.0, doubts_us };
        let expected = (4.0 * 5.0 + NORMAL * NORMAL * (7.0 + 4.0 + 9.0 + 16.0)).sqrt();
        assert!((error.half_us(2.0, 4.0) - expected).abs() < 1e-12);
    }
}
