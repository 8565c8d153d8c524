//! A synthetic campaign that knows where and when it was, and Python.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use updraft::analysis::result::{Analysis, DronePlace, DroneWindSeries};
use updraft::base::time::GpsTime;
use updraft::flight::{Alignment, PlaceBy};
use updraft::products::Origin;

use crate::report::synthetic::{campaign, posterior};

/// Show time 0, by the clock of the show: 2026-06-01 12:00:00 UTC.
pub(crate) const START_UNIX_MS: i64 = 1_780_315_200_000;
/// What receivers' time is late by in the logs, ms.
const LATE_MS: i64 = 130;
/// The drone whose clock is off, and by how much, ms.
pub(crate) const OFF: (u16, i64) = (2, 5000);
/// Place of the first drone by its own log, degrees, and the height of its home, m.
pub(crate) const OWN: ([f64; 2], f64) = ([47.473_051_2, 19.062_198_3], 188.5);

/// The synthetic campaign with a posterior, the clocks of its logs, and a drone whose log has all that logs may have.
pub(crate) fn placed() -> Analysis {
    let mut analysis = posterior(campaign());
    let flight = &mut analysis.flights[1];
    for drone in &mut flight.drones {
        let off_ms = if drone.slot == Some(OFF.0) { OFF.1 } else { 0 };
        drone.clock.start = GpsTime::from_unix_ms(START_UNIX_MS - LATE_MS + off_ms);
        assert_eq!(drone.clock.method, Alignment::ShowRows);
    }
    let map = flight.map.as_mut().unwrap();
    let seconds = map.time_s.len();
    let first = &mut map.drones[0];
    first.interval_mps = vec![Some([-0.4, 0.384]); seconds];
    first.place = Some(DronePlace {
        by: PlaceBy::Filter,
        lat_lon_deg: vec![Some(OWN.0); seconds],
        height_m: vec![Some(99.5); seconds],
        home_lat_lon_deg: Some(OWN.0),
        home_amsl_m: Some(OWN.1),
    });
    first.wind = Some(DroneWindSeries {
        east_north_mps: vec![Some([3.25, -1.5]); seconds],
        se_mps: vec![Some([1.0, 0.5]); seconds],
    });
    analysis
}

pub(crate) fn origin() -> Origin {
    Origin {
        program: "updraft 0.1.0".to_owned(),
        command: "updraft analyze my-campaign".to_owned(),
        institution: "Department of \"Air\" & <Weather>".to_owned(),
        inputs: vec![
            ("hover/plan.json".to_owned(), "ab".repeat(32)),
            ("hover/logs/01.BIN".to_owned(), "cd".repeat(32)),
        ],
        analysis_sha256: Some("ef".repeat(32)),
    }
}

/// Whether Python has all of the modules; says so if not.
pub(crate) fn can_run(modules: &str) -> bool {
    let mut command = Command::new("python3");
    command.args(["-c", &format!("import {modules}")]).stdout(Stdio::null()).stderr(Stdio::null());
    let can = command.status().is_ok_and(|status| status.success());
    if !can {
        // Written directly: the harness swallows what a passing test prints.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: Python lacks one of {modules} for tests/it/products; pip install it"
        );
    }
    can
}

/// Runs a script in a folder; what it prints.
pub(crate) fn python(folder: &Path, script: &str) -> String {
    let output = Command::new("python3")
        .args(["-W", "ignore", "-c", script])
        .current_dir(folder)
        .output()
        .unwrap();
    let (said, wrong) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}{wrong}");
    said.into_owned()
}
