//! The pulse that hover needs wanders slowly.

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Effect, InFlight, Now, Reference, Settled, Signals, Start};
use crate::vehicle::Airframe;

const SD: usize = 0;
const TIME: usize = 1;

/// Noise of the pulse with memory.
#[derive(Debug)]
pub(super) struct PulseNoise;

/// The motors of one drone.
#[derive(Clone, Debug)]
struct Motors {
    /// What the pulse must be more now, us.
    now_us: f64,
    /// What is left of it after a step.
    decay: f64,
    /// Standard deviation of what a step adds, us.
    kick_us: f64,
    rng: Pcg64,
}

impl Effect for PulseNoise {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "pulse-noise",
            title: "Noise of the pulse with memory",
            what: "the pulse that a drone needs wanders by some us over seconds",
            explanation: "Controllers, propellers and the autopilot's own filters make the pulse of a \
                steady drone wander for some seconds, each drone for itself and whatever it flies. \
                It averages out slowly: a window of 10 s has little more than one value of it. Who \
                takes it for white noise believes too much in small differences.",
            formula: "du(t): mean 0, standard deviation s, correlation exp(-|t - t'|/tau)",
            source: "field logs: white noise and one with a memory of about 5 s; Ornstein and \
                Uhlenbeck 1930",
            class: Class::TimeDrift,
            signals: &[Signal::Time],
            parameters: &[
                Parameter {
                    name: "sd_us",
                    unit: "us",
                    what: "standard deviation (s)",
                    low: 0.0,
                    high: 50.0,
                    default: |_| 4.0,
                    role: Some(Role::Scatter),
                },
                Parameter {
                    name: "time_s",
                    unit: "s",
                    what: "time scale (tau)",
                    low: 0.05,
                    high: 600.0,
                    default: |_| 5.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::Time, 0.0, 600.0),
            sought: Sought::No("noise: it has no mean, and its size is that of the scatter"),
        }
    }

    fn pulse_us(&self, _at: &Reference, _values: &Values, _signals: &Signals) -> f64 {
        0.0
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let decay = (-start.dt_s / start.values[TIME]).exp();
        let sd_us = start.values[SD];
        let mut rng = start.rng.clone();
        let draw: f64 = StandardNormal.sample(&mut rng);
        // It is as large at the start as ever.
        let now_us = sd_us * draw;
        let kick_us = sd_us * (1.0 - decay * decay).sqrt();
        Some(Box::new(Motors { now_us, decay, kick_us, rng }))
    }
}

impl InFlight for Motors {
    fn follow(&mut self, _now: &Now) {
        let draw: f64 = StandardNormal.sample(&mut self.rng);
        self.now_us = self.now_us * self.decay + self.kick_us * draw;
    }

    fn command(&self, command: f64) -> f64 {
        // Motors that are off stay off.
        if self.now_us == 0.0 || command <= 0.0 {
            return command;
        }
        (command - self.now_us * 1e-3).clamp(0.0, 1.0)
    }

    fn settle(&mut self, _at: &Settled) {
        (self.now_us, self.kick_us) = (0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Active;
    use crate::vehicle::library::builtin;

    #[test]
    fn motors_that_are_off_stay_off_and_a_settled_one_is_still() {
        let mut vehicle = builtin("pixel").unwrap();
        vehicle.effects.clear();
        crate::effects::select::choose(&mut vehicle, "pulse-noise.sd_us=50").unwrap();
        let home_m = nalgebra::Vector3::zeros();
        let (mut active, _) = Active::start(&vehicle, 1, 2, home_m, 0.0025).unwrap();
        assert_eq!(active.command(0.0), 0.0);
        assert_ne!(active.command(0.5), 0.5);
        let supply = crate::effects::Supply::Used(0.0);
        active.settle(&Settled { time_s: 0.0, supply, neighbours: None });
        assert_eq!(active.command(1.2), 1.2);
    }
}
