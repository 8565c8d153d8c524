//! Logs that are copies, broken, swapped or from somewhere else: matched by what they hold, or named.

use std::fs;

use insta::assert_snapshot;

use crate::cli::support::{Bench, Ended, SHORT};

/// What is said about logs: the lists below the tables, and standard error without times.
fn said(ended: &Ended) -> String {
    let lists = [
        "  Notes on drones",
        "  Drones without a result",
        "  Logs not used",
        "  Logs partly used",
        "  Cautions",
    ];
    let from = lists.iter().filter_map(|list| ended.out.find(list)).min();
    let out = from.and_then(|from| ended.out.get(from..)).unwrap_or_default();
    let mut err = String::new();
    for line in ended.err.lines() {
        err.push_str(line.split(" in ").next().unwrap_or_default());
        err.push('\n');
    }
    format!("{out}-- err\n{err}")
}

impl Bench {
    fn analyze(&self, code: i32) -> Ended {
        self.expect(code, &["analyze", "campaign", "--no-report"])
    }

    fn log(&self, name: &str) -> Vec<u8> {
        fs::read(self.path("campaign/simulated").join(name)).unwrap()
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path("campaign/simulated").join(name), bytes).unwrap();
    }

    /// The slots of the analysed drones by file.
    fn matched(&self, code: i32) -> Vec<(String, u64)> {
        let args = ["analyze", "campaign", "--no-report", "--json", "--quiet"];
        let value = self.expect(code, &args).json("updraft.analyze/1");
        let drones = value["analysis"]["flights"][0]["drones"].as_array().unwrap().clone();
        let one = |drone: &serde_json::Value| {
            (drone["source"].as_str().unwrap().to_owned(), drone["slot"].as_u64().unwrap())
        };
        drones.iter().map(one).collect()
    }
}

fn pairs(list: [(&str, u64); 2]) -> Vec<(String, u64)> {
    list.iter().map(|(name, slot)| ((*name).to_owned(), *slot)).collect()
}

#[test]
fn a_log_from_somewhere_else_is_refused() {
    let bench = Bench::new();
    bench.fly();
    let away = ["plan", "calibration", "--grid", "1x2", "-o", "away", "--origin", "47.48,19.07"];
    bench.expect(0, &[&away[..], SHORT].concat());
    bench.expect(0, &["simulate", "away", "--seed", "2"]);
    fs::copy(bench.path("away/simulated/02.BIN"), bench.path("campaign/simulated/02.BIN")).unwrap();
    assert_snapshot!(said(&bench.analyze(3)));

    // None is from here.
    fs::copy(bench.path("away/simulated/01.BIN"), bench.path("campaign/simulated/01.BIN")).unwrap();
    assert_snapshot!(said(&bench.analyze(5)));
}

#[test]
fn a_log_of_another_grid_is_refused_where_it_stands_on_no_slot() {
    let bench = Bench::new();
    bench.fly();
    let wide = ["plan", "calibration", "--grid", "1x2", "--spacing", "40", "-o", "wide"];
    bench.expect(0, &[&wide[..], SHORT].concat());
    bench.expect(0, &["simulate", "wide"]);
    fs::copy(bench.path("wide/simulated/01.BIN"), bench.path("campaign/simulated/01.BIN")).unwrap();
    let analysed = bench.analyze(3);
    assert!(analysed.out.contains("its home is 16.5 m from that of slot 1"), "{analysed}");
}

#[test]
fn the_same_bytes_twice_are_one_log() {
    let bench = Bench::new();
    bench.fly();
    // The copy bears the name of slot 1, the original that of slot 2.
    bench.put("01.BIN", &bench.log("02.BIN"));
    assert_snapshot!(said(&bench.analyze(3)));
    assert_eq!(bench.matched(3), [("simulated/02.BIN".to_owned(), 2)]);
    // Without a plan these legs are too short for a law.
    let unplanned = bench.expect(5, &["analyze", "campaign/simulated", "--no-report"]);
    assert!(unplanned.out.contains("a copy of 01.BIN (the same bytes)"), "{unplanned}");
    assert!(unplanned.err.contains("Analysed 1 of 2 logs in "), "{unplanned}");
}

#[test]
fn every_log_and_every_drone_is_accounted_for_once() {
    let bench = Bench::new();
    let six = ["plan", "calibration", "--grid", "2x3", "-o", "campaign"];
    bench.expect(0, &[&six[..], SHORT].concat());
    bench.expect(0, &["simulate", "campaign"]);
    // 2 is a copy, 3 is unusable, 4 is cut, 5 is not there, 6 is overwritten in the middle.
    bench.put("02.BIN", &bench.log("01.BIN"));
    bench.put("03.BIN", b"");
    let four = bench.log("04.BIN");
    bench.put("04.BIN", &four[..four.len() * 2 / 3]);
    fs::remove_file(bench.path("campaign/simulated/05.BIN")).unwrap();
    let mut six = bench.log("06.BIN");
    let middle = six.len() / 2;
    six[middle..middle + 5000].fill(0xA5);
    bench.put("06.BIN", &six);
    let analysed = bench.analyze(3);
    assert!(analysed.out.contains("  3 of 5 logs used, windows from the plan"), "{analysed}");
    assert_snapshot!(said(&analysed));

    let args = ["analyze", "campaign", "--json", "--quiet"];
    let value = bench.expect(3, &args).json("updraft.analyze/1");
    let flight = &value["analysis"]["flights"][0];
    let numbers = |list: &str, key: &str| -> Vec<u64> {
        flight[list].as_array().unwrap().iter().map(|one| one[key].as_u64().unwrap()).collect()
    };
    assert_eq!(flight["logs"], 5);
    assert_eq!(numbers("drones", "slot"), [1, 4, 6]);
    assert_eq!(numbers("missing", "slot"), [2, 3, 5]);
    assert_eq!(numbers("unused", "slot"), [2, 3]);
    assert_eq!(numbers("partly_used", "slot"), [4, 6]);
    let skipped = numbers("partly_used", "skipped_bytes");
    assert!(skipped[0] == 0 && (4900..5200).contains(&skipped[1]), "{skipped:?}");
    let page = fs::read_to_string(bench.path("campaign/report/index.html")).unwrap();
    for part in ["3 of 5 logs used", "Drones without a result (3)", "Logs not used (2)"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.contains("Logs partly used (2)") && !page.contains("Lost logs"));
}

#[test]
fn swapped_logs_go_where_they_stood() {
    let bench = Bench::new();
    bench.fly();
    let (one, two) = (bench.log("01.BIN"), bench.log("02.BIN"));
    bench.put("01.BIN", &two);
    bench.put("02.BIN", &one);
    assert_eq!(bench.matched(0), pairs([("simulated/02.BIN", 1), ("simulated/01.BIN", 2)]));
    fs::remove_file(bench.path("campaign/simulated/flight.json")).unwrap();
    assert_snapshot!(said(&bench.analyze(0)));
}

#[test]
fn the_record_does_not_hide_logs() {
    let bench = Bench::new();
    bench.fly();
    let logs = bench.path("campaign/simulated");
    fs::rename(logs.join("01.BIN"), logs.join("left.BIN")).unwrap();
    fs::rename(logs.join("02.BIN"), logs.join("00000009.BIN")).unwrap();
    assert_eq!(bench.matched(0), pairs([("simulated/left.BIN", 1), ("simulated/00000009.BIN", 2)]));

    // A record that names other slots than the logs do.
    fs::rename(logs.join("left.BIN"), logs.join("01.BIN")).unwrap();
    fs::rename(logs.join("00000009.BIN"), logs.join("02.BIN")).unwrap();
    let path = logs.join("flight.json");
    let mut record: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    record["logs"][0]["slot"] = 2.into();
    record["logs"][1]["slot"] = 1.into();
    fs::write(&path, record.to_string()).unwrap();
    assert_eq!(bench.matched(0), pairs([("simulated/01.BIN", 1), ("simulated/02.BIN", 2)]));

    // An extra log that belongs to no slot.
    bench.put("notes.BIN", b"no log at all");
    let mut more = bench.log("02.BIN");
    more.extend_from_slice(b"tail");
    bench.put("again.BIN", &more);
    assert_snapshot!(said(&bench.analyze(3)));
}

#[test]
fn without_a_plan_every_unusable_log_is_named() {
    let bench = Bench::new();
    bench.fly();
    let whole = bench.log("01.BIN");
    fs::create_dir(bench.path("field")).unwrap();
    let put = |name: &str, bytes: &[u8]| fs::write(bench.path("field").join(name), bytes).unwrap();
    put("whole.BIN", &whole);
    put("copy.BIN", &whole);
    put("empty.BIN", b"");
    put("early.BIN", &whole[..whole.len() / 100]);
    put("text.BIN", b"these are notes and not a log");
    put("cut.BIN", &bench.log("02.BIN")[..whole.len() * 2 / 3]);
    // 5 and not 3, as without a plan these legs are too short for a law.
    let analysed = bench.expect(5, &["analyze", "field", "--no-report"]);
    assert_snapshot!(said(&analysed));
    bench.expect(5, &["analyze", "field", "-o", "out"]);
    let text = fs::read_to_string(bench.path("out/analysis.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let flight = &value["flights"][0];
    let count = |list: &str| flight[list].as_array().unwrap().len();
    assert_eq!((count("drones"), count("unused"), count("partly_used")), (2, 4, 1));
    let page = fs::read_to_string(bench.path("out/report/index.html")).unwrap();
    assert!(page.contains("Logs not used (4)") && page.contains("it is empty"));
    assert!(page.contains("Logs partly used (1)"));
}

#[test]
fn a_log_without_take_off_is_no_flight() {
    let bench = Bench::new();
    bench.fly();
    // Only the seconds on the ground: armed, with its motors started.
    let whole = bench.log("01.BIN");
    let lift_off = (1..100).map(|percent| whole.len() / 100 * percent);
    let mut reasons = Vec::new();
    for end in lift_off {
        fs::write(bench.path("ground.BIN"), &whole[..end]).unwrap();
        let ended = bench.run(&["analyze", "ground.BIN", "--no-report"]);
        if ended.code != Some(5) {
            break;
        }
        let reason = ended.err.lines().last().unwrap_or_default().trim().to_owned();
        if !reasons.contains(&reason) {
            reasons.push(reason);
        }
    }
    assert!(reasons.iter().any(|reason| reason.contains("no flight in this log")), "{reasons:?}");
}
