//! A calibration referred to the air density at the ground, for use at another height.

use super::calibrate::{self, FitOptions};
use super::density::Density;
use super::result::{FlightAnalysis, SampleStats, WindowStats};

fn refer_window(density: Density, window: &WindowStats) -> WindowStats {
    let factor = density.factor(window.height_m);
    let refer = |pulse_us: f64| density.refer_us(pulse_us, window.height_m);
    let stats = &window.pulse_phi_us;
    WindowStats {
        pulse_phi_us: SampleStats {
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

/// A calibration with its laws refitted to pulses referred to the ground.
pub(super) fn refer_calibration(
    density: Density,
    calibration: &FlightAnalysis,
    options: &FitOptions,
) -> FlightAnalysis {
    let mut referred = calibration.clone();
    for drone in &mut referred.drones {
        drone.windows = drone.windows.iter().map(|window| refer_window(density, window)).collect();
        if drone.laws.is_some() {
            drone.laws = calibrate::calibrate(&drone.windows, options).ok();
        }
    }
    referred.flock = calibrate::flock(&referred.drones, options).ok();
    referred
}
