//! `updraft inspect`.

use std::fmt::Write as _;
use std::io::Read as _;
use std::process::Stdio;

use crate::cli::support::Bench;

#[test]
fn every_kind_of_file_is_described() {
    let bench = Bench::new();
    bench.fly();
    let mut all = String::new();
    for file in ["plan.json", "show.skyc", "show.csv.zip", "skyb/02.skyb"] {
        let path = format!("campaign/{file}");
        let ended = bench.expect(0, &["inspect", &path]);
        assert!(ended.err.is_empty(), "{ended}");
        let _ = writeln!(all, "$ updraft inspect {path}\n{}", ended.out);
        bench.expect(0, &["inspect", "--json", &path]).json("updraft.inspect/1");
    }
    insta::assert_snapshot!(all);
    let path = "campaign/simulated/01.BIN";
    let log = bench.expect(0, &["inspect", path]);
    assert!(log.out.starts_with("campaign/simulated/01.BIN: 0."), "{log}");
    assert!(log.out.contains("\nRCOU ") && log.out.ends_with("\nno damage found\n"), "{log}");
    let value = bench.expect(0, &["inspect", "--json", path]).json("updraft.inspect/1");
    assert!(value["log"]["messages"].is_array());
    let folder = bench.expect(0, &["inspect", "campaign"]);
    let plan = bench.expect(0, &["inspect", "campaign/plan.json"]);
    assert_eq!(folder.out, plan.out);
}

#[test]
fn broken_files_say_why() {
    let bench = Bench::new();
    let write = |name: &str, bytes: &[u8]| std::fs::write(bench.path(name), bytes).unwrap();
    write("a.skyb", b"skyb\x02\x01\0\0\0\0\x01");
    write("a.skyc", b"not a zip");
    write("a.zip", b"PK\x05\x06");
    write("a.json", b"{\"schema\": \"something\"}");
    for name in ["a.skyb", "a.skyc", "a.zip", "a.json"] {
        let ended = bench.expect(2, &["inspect", name]);
        assert!(ended.err.starts_with("error: "), "{ended}");
        assert!(ended.err.contains(name), "{ended}");
        assert_eq!(ended.err.matches("error: ").count(), 1, "{ended}");
    }
    let missing = bench.run(&["inspect", "not-there.skyc"]);
    assert_eq!(missing.code, Some(1), "{missing}");
    assert!(missing.err.contains("because: "), "{missing}");
}

#[test]
fn a_reader_that_stops_early_is_fine() {
    let bench = Bench::new();
    bench.plan();
    let mut child = bench
        .command(&["inspect", "campaign", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut err = String::new();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    assert_eq!((child.wait().unwrap().code(), err.as_str()), (Some(0), ""));
}
