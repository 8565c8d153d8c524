//! The world that the vehicles of a fleet share: the place, the air, the time.

use std::sync::OnceLock;

use crate::base::frame::ShowFrame;
use crate::base::time::GpsTime;
use crate::link::clock::Micros;
use crate::show::Trajectory;
use crate::sim::Atmosphere;
use crate::vehicle::Vehicle;

/// The world in which vehicles stand and fly. It outlives them.
pub struct World<'w> {
    /// The airframe and its autopilot's settings.
    pub vehicle: &'w Vehicle,
    /// Motion of the air.
    pub atmosphere: &'w dyn Atmosphere,
    /// Exact position and orientation of the show frame; the wire rounds it.
    pub frame: ShowFrame,
    /// Seed of the fleet.
    pub seed: u64,
    /// Whether logs hold the firmware's whole default set of messages.
    pub full_logs: bool,
    /// Whether board time in logs counts from an instant that the seed determines, as in simulated
    /// flights without a link, rather than from when a vehicle is switched on.
    pub boots_by_seed: bool,
    /// GPS time at link time 0.
    pub gps_at_0: GpsTime,
    shows: Shelf<LoadedShow>,
}

impl<'w> World<'w> {
    /// A world whose link time 0 is at this GPS time.
    pub fn new(
        vehicle: &'w Vehicle,
        atmosphere: &'w dyn Atmosphere,
        frame: ShowFrame,
        seed: u64,
        gps_at_0: GpsTime,
    ) -> Self {
        Self {
            vehicle,
            atmosphere,
            frame,
            seed,
            full_logs: false,
            boots_by_seed: false,
            gps_at_0,
            shows: Shelf::default(),
        }
    }

    /// GPS time at a link time, us since the GPS epoch.
    pub fn gps_us(&self, now: Micros) -> i64 {
        self.gps_at_0.total_ms() * 1000 + now as i64
    }

    /// Keeps a show for as long as the world lasts: a flight borrows it.
    pub(super) fn keep(&self, show: LoadedShow) -> &LoadedShow {
        self.shows.keep(show)
    }
}

/// A show file as a vehicle has read it.
#[derive(Clone, Debug, Default)]
pub struct LoadedShow {
    /// Trajectory to fly, show frame.
    pub trajectory: Trajectory,
    /// Light program, as Skybrush bytecode.
    pub lights: Vec<u8>,
    /// Take-off time, show time, s.
    pub takeoff_s: f64,
}

/// Things that are only ever added, and stay where they are.
struct Shelf<T> {
    first: OnceLock<Box<Kept<T>>>,
}

struct Kept<T> {
    value: T,
    rest: Shelf<T>,
}

impl<T> Default for Shelf<T> {
    fn default() -> Self {
        Self { first: OnceLock::new() }
    }
}

impl<T> Shelf<T> {
    fn keep(&self, value: T) -> &T {
        let mut kept = Box::new(Kept { value, rest: Self::default() });
        let mut at = self;
        loop {
            match at.first.set(kept) {
                Ok(()) => {}
                Err(back) => {
                    kept = back;
                    match at.first.get() {
                        Some(taken) => at = &taken.rest,
                        // A set that is refused has a value.
                        None => std::hint::spin_loop(),
                    }
                    continue;
                }
            }
            loop {
                // It has just been set.
                if let Some(kept) = at.first.get() {
                    return &kept.value;
                }
            }
        }
    }
}

impl<T> Drop for Shelf<T> {
    fn drop(&mut self) {
        // One by one: a long chain that drops itself would need a long stack.
        let mut next = self.first.take();
        while let Some(mut kept) = next {
            next = kept.rest.first.take();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Shelf;

    #[test]
    fn what_is_kept_stays() {
        let shelf = Shelf::default();
        let kept: Vec<&String> = (0..1000).map(|number| shelf.keep(number.to_string())).collect();
        assert!(kept.iter().enumerate().all(|(number, text)| **text == number.to_string()));
    }
}
