//! Pulses of hidden effects in steady flight: the regressors of Fisher's z.

use foreign_worlds::hidden::{self, HiddenEffect};
use foreign_worlds::{Condition, Trim, World};

use crate::blind::tables::FOREIGN_KINDS;
use crate::effects::{Signals, Sought, find};
use crate::gap::{SteadyPulse, There};

/// Hidden effects of a world, as the calculation of their Fisher z takes them. Those that the pulse of steady flight
/// does not show, or by which drones differ, are handed over without a form: their z is not known.
pub fn there(world: &World) -> Vec<There<'_>> {
    world.hidden.iter().map(|effect| one(world, effect)).collect()
}

fn one<'a>(world: &'a World, effect: &'a HiddenEffect) -> There<'a> {
    let is_steady = hidden::find(&effect.kind).is_some_and(|kind| kind.is_steady)
        && !is_told_elsewhere(&effect.kind);
    match effect.start().filter(|_| is_steady) {
        None => There::Effect { effect: "", size: "", change: 0.0 },
        Some(acting) => {
            // Where commands have their nominal meaning: sea level, as for any vehicle.
            let with = Trim::new(&world.plant, vec![acting], 1.0);
            let without = Trim::new(&world.plant, Vec::new(), 1.0);
            let pulse: SteadyPulse<'a> = Box::new(move |signals, heading_rad| {
                let at = condition(world, signals, heading_rad);
                let pulse = |trim: &Trim<'_>| trim.at(&at).map(|steady| steady.pulse_us);
                match (pulse(&with), pulse(&without)) {
                    (Some(with), Some(without)) => with - without,
                    _ => 0.0,
                }
            });
            There::Pulse(pulse)
        }
    }
}

/// Whether the library's effect of a kind is told by another channel than the pulse, the lean or the velocity: how well
/// depends on what is known of the wind.
fn is_told_elsewhere(kind: &str) -> bool {
    let kind = FOREIGN_KINDS.iter().find(|one| one.name == kind);
    let effect = kind.and_then(|kind| kind.like).and_then(find);
    effect.is_some_and(|effect| matches!(effect.definition().sought, Sought::No(_)))
}

/// The moment of a comparison in the plant's terms.
fn condition(world: &World, signals: &Signals, heading_rad: f64) -> Condition {
    let (sin, cos) = heading_rad.sin_cos();
    let across = signals.horizontal_mps;
    // The voltage falls with the share of the battery that hover has used.
    let battery = &world.battery;
    let used = signals.time_s.max(0.0) / ENDURANCE_S;
    let volts = battery.cells * foreign_worlds::battery::cell_v(1.0 - used)
        - battery.resistance_ohm * battery.capacity_ah * 3600.0 / ENDURANCE_S;
    Condition {
        relative_mps: [across * cos, across * sin, signals.climb_mps],
        density_ratio: signals.density_ratio,
        height_m: signals.height_m,
        time_s: signals.time_s,
        acceleration_mps2: 0.0,
        supply_ratio: volts / battery.reference_v,
        has_left: false,
    }
}

/// Time that a full battery lasts in hover, s: the middle of what is drawn.
const ENDURANCE_S: f64 = 1_800.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leans_and_velocities_tell_has_no_z_as_at_home() {
        let elsewhere = FOREIGN_KINDS.iter().filter(|kind| is_told_elsewhere(kind.name));
        let names: Vec<&str> = elsewhere.map(|kind| kind.name).collect();
        assert_eq!(names, ["hub-force", "log-lag", "log-bias", "loop-lag", "momentum-drag"]);
    }
}
