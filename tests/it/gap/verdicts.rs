//! A verdict on a flight, as tests need it.

#![expect(clippy::unwrap_used, reason = "a test that cannot write its folder fails")]

use std::fmt::Write as _;
use std::path::Path;

use updraft::base::digest::sha256;
use updraft::gap::Verdict;
use updraft::gap::verdict::{Finding, Fitted, Interval, Noise, Step, VERDICT_SCHEMA};

/// Share of the inflow that the verdicts found: some 20 us/(m/s) on AirSim's quad.
pub(crate) const INFLOW: f64 = 0.4;

/// A field day's noise (docs/physics.md, 4.1).
fn noise() -> Noise {
    Noise {
        shared_air_mps: 0.42,
        shared_air_s: 100.0,
        own_air_mps: 0.1,
        gusts_mps: 0.28,
        gusts_s: 8.0,
        white_us: 1.4,
        drones_us: 10.0,
        slopes: 0.05,
        least_response: 3.0,
        gradient_mps: 0.06,
        side_gusts_mps: 0.2,
        pulse_noise_us: 0.3,
        updraft_mps: 0.0,
        updraft_half_mps: None,
    }
}

pub(crate) fn fitted(name: &str, value: f64) -> Fitted {
    Fitted {
        name: name.to_owned(),
        unit: String::new(),
        value: Interval { value, low: 0.9 * value, high: 1.1 * value },
        before: None,
    }
}

/// A verdict that found this.
pub(crate) fn verdict(findings: Vec<Finding>) -> Verdict {
    let step = |finding| Step {
        finding,
        gain_nats: 50.0,
        threshold_nats: 8.0,
        alpha: 0.005,
        size_us: 20.0,
        rivals: Vec::new(),
        shape: None,
        in_field: None,
        form: None,
    };
    Verdict {
        schema: VERDICT_SCHEMA.to_owned(),
        made_by: "updraft".to_owned(),
        vehicle: "airsim-generic-quad".to_owned(),
        steps: findings.into_iter().map(step).collect(),
        noise: noise(),
        ..Verdict::default()
    }
}

/// The class of everything that bends with climb.
pub(crate) fn climb_class() -> Finding {
    let effects = ["rotor-inflow", "parasitic-drag", "thrust-curve"];
    Finding::Class {
        effects: effects.map(str::to_owned).to_vec(),
        parameters: vec![fitted("inflow_share", INFLOW)],
    }
}

/// Writes the hashes of verdict and model beside them, as `updraft gap` does.
pub(crate) fn prove(folder: &Path) {
    let mut text = String::new();
    for name in ["verdict.json", "model.toml"] {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        writeln!(text, "{}  {name}", sha256(&bytes)).unwrap();
    }
    std::fs::write(folder.join("SHA256"), text).unwrap();
}
