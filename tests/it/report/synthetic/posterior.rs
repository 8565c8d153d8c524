//! A posterior map for the synthetic campaign.

use updraft::analysis::result::Analysis;

/// A campaign with a posterior: one lost drone, and a grid of which one cell is not known.
pub(crate) fn posterior(mut analysis: Analysis) -> Analysis {
    let map = analysis.flights[1].map.as_mut().unwrap();
    let seconds = map.time_s.len();
    for drone in &mut map.drones {
        drone.posterior_mps = vec![Some(-0.12345); seconds];
        drone.posterior_sd_mps = vec![Some(0.05); seconds];
    }
    map.posterior = serde_json::from_value(serde_json::json!({
        "fleet": { "value": -0.1, "se": 0.02 },
        "filled": [{
            "slot": 48, "position_m": [21.0, 14.0],
            "posterior_mps": vec![0.25; seconds], "posterior_sd_mps": vec![0.1; seconds],
        }],
        "grid": {
            "time_s": [100.0], "x_m": [-3.5, 3.5], "y_m": [0.0, 7.0], "height_m": 100.0,
            "updraft_mps": [[[0.1, -0.2], [null, 0.4]]], "sd_mps": [[[0.05, 0.06], [null, 0.08]]],
        },
        "zero_shift_mps": 0.0, "uniform_probability": 0.2,
    }))
    .unwrap();
    analysis
}
