//! Two processes never write into one campaign folder.

#![cfg(unix)]

use std::fs;
use std::process::{Command, Stdio};

use crate::cli::support::{Bench, contents};

fn signal(name: &str, id: u32) {
    assert!(Command::new("kill").args([name, &id.to_string()]).status().unwrap().success());
}

#[test]
fn a_second_writer_is_refused_until_the_first_is_gone() {
    let bench = Bench::new();
    let long = ["--leg", "60", "--speeds", "0.5,1,1.5", "--hover", "20"];
    let plan = ["plan", "calibration", "--grid", "3x4", "-o", "campaign"];
    bench.expect(0, &[&plan[..], &long].concat());
    let mut first = bench
        .command(&["simulate", "campaign", "--full-logs"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let record = bench.path("campaign/simulated/flight.json");
    while !record.exists() {
        std::thread::yield_now();
    }
    // Stopped, it still holds the folder.
    signal("-STOP", first.id());
    let mut before = contents(&bench.path("campaign"));
    // The signal takes its time to reach every thread.
    loop {
        std::thread::sleep(std::time::Duration::from_millis(100));
        let now = contents(&bench.path("campaign"));
        if now == before {
            break;
        }
        before = now;
    }
    let run = ["run", "calibration", "--grid", "3x4", "-o", "campaign"];
    let commands: [Vec<&str>; 4] = [
        vec!["simulate", "campaign", "--full-logs"],
        vec!["analyze", "campaign"],
        [&plan[..], &long].concat(),
        [&run[..], &long].concat(),
    ];
    for command in commands {
        let refused = bench.expect(6, &command);
        assert_eq!(
            refused.err.lines().last(),
            Some(
                "error: another updraft is writing into campaign; wait until it has finished, or \
                 choose another folder"
            ),
            "{refused}"
        );
    }
    assert!(contents(&bench.path("campaign")) == before, "nothing was touched");
    bench.expect(0, &["check", "campaign"]);

    signal("-KILL", first.id());
    first.wait().unwrap();
    bench.expect(0, &["simulate", "campaign", "--full-logs"]);
    let names: Vec<_> = fs::read_dir(bench.path("campaign"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with('.'))
        .collect();
    assert!(names.is_empty(), "{names:?}");
}

#[test]
fn what_a_killed_run_left_is_swept_in_every_folder() {
    let bench = Bench::new();
    bench.plan();
    let folders =
        ["", "logs", "logs/older", "skyb", "report/figures", "fields", "gap/report", "study"];
    let left = |folder: &str| bench.path("campaign").join(folder).join(".partial-x1y2z3");
    for folder in folders {
        fs::create_dir_all(left(folder).parent().unwrap()).unwrap();
        fs::write(left(folder), b"half").unwrap();
    }
    // One that another process is still writing.
    let living = bench.path("campaign/fields/.partial-living");
    let writer = fs::File::create(&living).unwrap();
    writer.lock().unwrap();
    bench.expect(0, &["simulate", "campaign"]);
    for folder in folders {
        assert!(!left(folder).exists(), "campaign/{folder}");
    }
    assert!(living.exists(), "it has a writer");
    drop(writer);
    bench.expect(0, &["analyze", "campaign"]);
    assert!(!living.exists());
}
