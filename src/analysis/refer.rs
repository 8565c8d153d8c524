//! A calibration referred to level flight and to the air density at the ground, for use in another
//! wind and at another height.

use rayon::prelude::*;

use super::calibrate::{self, FitOptions};
use super::density::Density;
use super::offset::OffsetMap;
use super::result::{FlightAnalysis, SampleStats, WindowStats};
use super::wind::Leaning;

fn refer_window(density: Density, window: &WindowStats) -> WindowStats {
    let factor = density.factor(window.height_m);
    let refer = |pulse_us: f64| density.refer_us(pulse_us, window.height_m);
    let stats = &window.effort_phi;
    WindowStats {
        effort_phi: SampleStats {
            median: refer(stats.median),
            mean: refer(stats.mean),
            trimmed: refer(stats.trimmed),
            sd: stats.sd * factor,
            se: stats.se * factor,
            n: stats.n,
        },
        ..window.clone()
    }
}

/// A calibration with its laws refitted to windows brought to level flight, with pulses referred to
/// the ground.
pub(super) fn refer_calibration(
    density: Option<Density>,
    leaning: Option<Leaning>,
    calibration: &FlightAnalysis,
    options: &FitOptions,
) -> FlightAnalysis {
    let mut referred = calibration.clone();
    referred.drones.par_iter_mut().for_each(|drone| {
        for window in &mut drone.windows {
            if let Some(leaning) = leaning {
                *window = leaning.level_window(window);
            }
            if let Some(density) = density {
                *window = refer_window(density, window);
            }
        }
        if drone.offset.is_some() {
            drone.offset = OffsetMap::subtract(&mut drone.windows, options.location);
        }
        if drone.laws.is_some() {
            drone.laws = calibrate::calibrate(&drone.windows, options).ok();
        }
    });
    let whole = referred.drones.iter().filter(|drone| drone.partial_ladder.is_none());
    referred.flock = calibrate::flock(whole.map(|drone| drone.windows.as_slice()), options).ok();
    referred
}
