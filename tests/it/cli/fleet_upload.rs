//! An upload by real processes over a bad link, killed twice while drones reboot.

use std::process::Stdio;
use std::time::Duration;

use crate::cli::fleet::free_port;
use crate::cli::support::Bench;
use crate::fleet::loaded::{assert_loaded, bad};

#[test]
fn a_killed_upload_is_run_again_and_every_drone_is_loaded_whole() {
    let bench = Bench::with_shared_clock();
    bench.planned("2x3", "campaign");
    let mut drones = bench.drones();
    drones.faults = bad();
    for (index, after_s) in [(0, 16), (1, 24)] {
        drones.setups[index].reboot_at = Some(after_s * 1_000_000);
    }
    let station = free_port();
    let link = format!("udpin:{station}");
    let upload = ["fleet", "upload", "campaign", "--connect", &link, "--wait", "30"];
    let changes = bench.path("campaign/fleet-changes.json");
    let last = drones.fly(
        station.parse().unwrap(),
        || {
            // In the midst of the first upload, and of the second.
            for after_s in [3, 8] {
                let mut killed = bench.command(&upload);
                let mut killed = bench.start(killed.stdout(Stdio::null()).stderr(Stdio::null()));
                // The old values are on the disk before anything is set.
                let there = bench.wait_for(60, || changes.exists().then_some(()));
                assert!(there.is_some(), "it does not get to the upload");
                bench.clock().pause(Duration::from_secs(after_s));
                assert!(killed.try_wait().unwrap().is_none(), "it ended before it was killed");
                killed.kill().unwrap();
                assert_eq!(killed.wait().unwrap().code(), None, "killed, not ended");
            }
            bench.expect(0, &upload)
        },
        |vehicles| {
            for (slot, vehicle) in (1..).zip(vehicles) {
                assert_loaded(vehicle, &drones.load(slot));
            }
        },
    );
    assert!(last.err.contains("Loaded 6 of 6 drones"), "{last}");
    let changes = std::fs::read_to_string(changes).unwrap();
    assert_eq!(changes.matches("\"FENCE_ENABLE\"").count(), 6, "{changes}");
}
