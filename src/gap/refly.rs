//! The simulator re-flies what was commanded: the model's side of the comparison.

use std::io;

use super::bins::{Bin, BinValues};
use super::measure::{FOLLOW_MPS, LIMIT_MARGIN_DEG, LIMITED_SHARE};
use super::memory::{Digest, Memory};
use crate::base::time::GpsTime;
use crate::effects::{Role, find};
use crate::mission::plan::{Plan, Slot};
use crate::sim::autopilot::params::ANGLE_MAX_DEG;
use crate::sim::recorder::{Moment, Recorder, STEPS_10_HZ};
use crate::sim::{FlightSetup, Hooks, SimError, Uniform, fly_with};
use crate::vehicle::Vehicle;

/// Bins of flights that were flown: those of one flight's searches, some megabytes.
static FLOWN: Memory<Vec<Option<BinValues>>> = Memory::of(1_000);

/// A lean from which the autopilot holds a drone back, degrees.
const LIMIT_DEG: f64 = ANGLE_MAX_DEG - LIMIT_MARGIN_DEG;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// The fleet's mean drone: what makes drones differ is off.
pub(super) fn mean_drone(vehicle: &Vehicle) -> Vehicle {
    let mut mean = vehicle.clone();
    for (name, table) in &mut mean.effects {
        let Some(effect) = find(name) else { continue };
        let parameters = effect.definition().parameters.iter();
        for spread in parameters.filter(|one| one.role.is_some_and(Role::is_spread)) {
            table.parameters.insert(spread.name.to_owned(), 0.0);
        }
    }
    mean
}

/// A vehicle without what shakes its thrust: one flight of a model shows its mean.
fn without_jitter(vehicle: &Vehicle) -> Vehicle {
    let mut calm = vehicle.clone();
    for (name, table) in &mut calm.effects {
        let parameters = find(name).into_iter().flat_map(|effect| effect.definition().parameters);
        for jitter in parameters.filter(|one| one.role == Some(Role::Scatter)) {
            table.parameters.insert(jitter.name.to_owned(), 0.0);
        }
    }
    calm
}

/// Flies one slot of a plan in uniform air (show frame, z up, m/s) and gives its bins.
///
/// # Errors
/// The flight failed: a vehicle that cannot fly, or effects that are not valid.
pub(super) fn refly(
    vehicle: &Vehicle,
    plan: &Plan,
    slot: &Slot,
    bins: &[Bin],
    air_mps: [f64; 3],
    thrust_exponent: f64,
) -> Result<Vec<Option<BinValues>>, SimError> {
    let trajectory = plan.trajectory(slot);
    let vehicle = &without_jitter(vehicle);
    let mut digest = Digest::new();
    digest.add_debug(&(vehicle, &trajectory, slot.slot, slot.home_m, &plan.site, bins));
    digest.add_all(&air_mps);
    digest.add_all([&thrust_exponent]);
    if let Some(values) = FLOWN.get(digest) {
        return Ok(values);
    }
    let air = Uniform(air_mps.into());
    let setup = FlightSetup {
        vehicle,
        trajectory: &trajectory,
        home_m: slot.home_m.into(),
        frame: plan.site.frame(),
        atmosphere: &air,
        seed: 1,
        drone: slot.slot,
        start: GpsTime { week: 2400, tow_ms: 0 },
        lights: &[],
        full_logs: false,
        hooks: Hooks::default(),
    };
    let mut recorder = BinRecorder::new(bins, slot.home_m[2]);
    fly_with(&setup, &mut recorder)?;
    let values = recorder.values(thrust_exponent);
    FLOWN.keep(digest, values.clone());
    Ok(values)
}

struct Sums {
    count: f64,
    pulse_us: f64,
    climb_mps: f64,
    height_m: f64,
    lean_rad: [f64; 2],
    resting_v: f64,
    /// Moments at which it leaned as far as the autopilot lets it.
    at_limit: f64,
    /// First and last moment.
    ends: Option<[End; 2]>,
}

/// Where a drone is in level directions at the first or the last moment of a bin, and how fast.
#[derive(Clone, Copy)]
struct End {
    time_s: f64,
    place_m: [f64; 2],
    velocity_mps: [f64; 2],
}

struct BinRecorder<'a> {
    bins: &'a [Bin],
    sums: Vec<Sums>,
    home_z_m: f64,
    at: usize,
}

impl<'a> BinRecorder<'a> {
    fn new(bins: &'a [Bin], home_z_m: f64) -> Self {
        let empty = || Sums {
            count: 0.0,
            pulse_us: 0.0,
            climb_mps: 0.0,
            height_m: 0.0,
            lean_rad: [0.0; 2],
            resting_v: 0.0,
            at_limit: 0.0,
            ends: None,
        };
        Self { bins, sums: bins.iter().map(|_| empty()).collect(), home_z_m, at: 0 }
    }

    fn values(self, thrust_exponent: f64) -> Vec<Option<BinValues>> {
        let value = |(sums, bin): (Sums, &Bin)| {
            let mean = |sum: f64| sum / sums.count;
            let rate = |of: fn(&End) -> [f64; 2]| {
                sums.ends.map_or([0.0; 2], |[first, last]| {
                    let apart_s = (last.time_s - first.time_s).max(0.1);
                    [0, 1].map(|axis| (of(&last)[axis] - of(&first)[axis]) / apart_s)
                })
            };
            let accelerated = rate(|end| end.velocity_mps).map(|mps2| mps2 / GRAVITY);
            let [x_mps, y_mps] = rate(|end| end.place_m);
            let beside_mps = (x_mps - bin.velocity_mps[0]).hypot(y_mps - bin.velocity_mps[1]);
            let lean_rad = [0, 1].map(|axis| mean(sums.lean_rad[axis]) - accelerated[axis]);
            let cos = lean_rad[0].hypot(lean_rad[1]).cos();
            (sums.count > 0.0).then(|| BinValues {
                pulse_us: 1000.0 + (mean(sums.pulse_us) - 1000.0) * cos.powf(thrust_exponent),
                climb_mps: mean(sums.climb_mps),
                height_m: mean(sums.height_m),
                lean_rad,
                resting_v: mean(sums.resting_v),
                loaded_v: f64::NAN,
                power_w: f64::NAN,
                carried_away: beside_mps > FOLLOW_MPS || mean(sums.at_limit) > LIMITED_SHARE,
            })
        };
        self.sums.into_iter().zip(self.bins).map(value).collect()
    }
}

impl Recorder for BinRecorder<'_> {
    fn record(&mut self, moment: &Moment<'_>) -> io::Result<()> {
        // When a log has its rows: a show's target moves ten times a second, too, and the pulse follows in
        // a ripple of the same period, of which a log always shows the same place.
        if !moment.step.is_multiple_of(STEPS_10_HZ) {
            return Ok(());
        }
        let time_s = moment.time_us as f64 * 1e-6;
        while self.bins.get(self.at).is_some_and(|bin| time_s >= bin.end_s) {
            self.at += 1;
        }
        let (Some(bin), Some(sums)) = (self.bins.get(self.at), self.sums.get_mut(self.at)) else {
            return Ok(());
        };
        if time_s < bin.start_s {
            return Ok(());
        }
        let pulses = moment.pilot.motors.pulses_us;
        sums.count += 1.0;
        sums.pulse_us +=
            pulses.iter().map(|pulse| f64::from(*pulse)).sum::<f64>() / pulses.len() as f64;
        sums.climb_mps += moment.estimate.velocity_mps.z;
        sums.height_m += moment.estimate.position_m.z - self.home_z_m;
        let up = moment.plant.motion().rotation.column(2).into_owned();
        let (place, velocity) = (moment.estimate.position_m, moment.estimate.velocity_mps);
        let now =
            End { time_s, place_m: [place.x, place.y], velocity_mps: [velocity.x, velocity.y] };
        let first = sums.ends.map_or(now, |[first, _]| first);
        sums.ends = Some([first, now]);
        sums.at_limit += f64::from(up.z < LIMIT_DEG.to_radians().cos());
        sums.lean_rad[0] += up.x;
        sums.lean_rad[1] += up.y;
        sums.resting_v += moment.plant.battery().map_or(f64::NAN, |battery| battery.resting_v);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::bins::of_segments;
    use crate::mission::resolve::resolve;
    use crate::vehicle::library::builtin;

    #[test]
    fn a_drone_that_the_wind_carries_away_is_known() {
        let vehicle = builtin("arducopter-sitl").unwrap();
        let plan = resolve("calibration-counterphase", &[]).unwrap().flights.remove(0).plan;
        let bins = of_segments(&plan.groups[0].segments);
        let carried = |wind_mps: f64| {
            let air_mps = [0.0, -wind_mps, 0.0];
            let values = refly(&vehicle, &plan, &plan.slots[0], &bins, air_mps, 1.0).unwrap();
            let carried = values.iter().map(|values| values.unwrap().carried_away);
            carried
                .zip(&bins)
                .filter(|(carried, _)| *carried)
                .map(|(_, bin)| bin.clone())
                .collect::<Vec<Bin>>()
        };
        assert_eq!(carried(0.0), []);
        let lost = carried(9.0);
        let against = |bin: &Bin| bin.velocity_mps[1] > 1.0;
        assert!(lost.iter().any(against), "a leg against the wind");
        assert!(lost.iter().any(|bin| bin.kind.is_hover()), "the way back from it: {lost:?}");
        assert!(lost.len() < bins.len() / 2, "{} of {}", lost.len(), bins.len());
    }
}
