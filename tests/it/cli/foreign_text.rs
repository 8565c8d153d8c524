//! What others wrote stays text: escape sequences, carriage returns, new lines and marks of direction
//! go in through every input, and none comes out at the terminal.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;

use nalgebra::Vector3;
use updraft::base::plain::{STYLES, acts};
use updraft::log::{LogWriter, Value, catalog};
use updraft::show::{Cue, Segment, Show, ShowDrone, Trajectory, skyc};

use crate::cli::support::{Bench, Ended, SHORT};

/// Moves the cursor, clears the line, and says something in our name; twice by a new line.
const HOSTILE: &str = "Evil\u{1b}[2K\u{1b}[1A\rSafe: forged\nSafe: forged\r\n\u{1b}[32mGO\u{1b}[0m\
    \u{9b}2J\u{85}\u{202e}\u{2066}\u{200f}\u{2028}\u{7f}\u{8}end";

/// The same within TOML's and JSON's quotes.
fn quoted() -> String {
    let mut text = String::new();
    for c in HOSTILE.chars() {
        match c {
            ' '..='~' => text.push(c),
            _ => drop(write!(text, "\\u{:04x}", u32::from(c))),
        }
    }
    text
}

/// Nothing acts, no line is forged, and the text did come by.
fn assert_tame(ended: &Ended) {
    let mut met = false;
    for stream in [&ended.out, &ended.err] {
        let mut text = stream.clone();
        assert!(!text.contains("\u{1b}[32mGO"), "{ended}");
        for style in STYLES {
            text = text.replace(style, "");
        }
        assert!(!text.contains(|c| !matches!(c, '\n' | '\t') && acts(c)), "{ended}\n{text:?}");
        for line in text.lines() {
            let line = line.trim_start();
            assert!(!line.starts_with("Safe:") && !line.starts_with("GO"), "{line}\n{ended}");
        }
        met |= text.contains("Evil");
    }
    assert!(met, "the text was not printed\n{ended}");
}

/// Runs it as people do, in colours, and for programs; what ends up in JSON is JSON.
fn tame(bench: &Bench, args: &[&str]) -> Ended {
    let json = bench.run(&[args, &["--json"]].concat());
    assert_tame_json(&json);
    assert_tame(&bench.run(&[args, &["--color", "always"]].concat()));
    let ended = bench.run(args);
    assert_tame(&ended);
    ended
}

fn assert_tame_json(ended: &Ended) {
    for text in [&ended.out, &ended.err] {
        assert!(!text.contains(|c| c != '\n' && acts(c)), "{ended}");
    }
    if ended.out.is_empty() {
        let last = ended.err.lines().last().unwrap();
        assert!(serde_json::from_str::<serde_json::Value>(last).is_ok(), "{ended}");
    } else {
        assert!(serde_json::from_str::<serde_json::Value>(&ended.out).is_ok(), "{ended}");
    }
}

/// Two drones in one place, far too fast: a show with errors to be hidden.
fn show() -> Show {
    let mut trajectory = Trajectory::starting_at(Vector3::zeros());
    let to = updraft::show::SegmentPath::Line(Vector3::new(0.0, 0.0, 200.0));
    trajectory.segments.push(Segment { duration_ms: 2_000, path: to });
    let drone = |number: u32| ShowDrone {
        name: format!("{HOSTILE}{number}"),
        home_m: Some(Vector3::zeros()),
        trajectory: trajectory.clone(),
        ..ShowDrone::default()
    };
    Show {
        title: Some(HOSTILE.to_owned()),
        cues: vec![Cue { time_s: 1.0, name: HOSTILE.to_owned() }],
        drones: vec![drone(1), drone(2)],
        ..Show::default()
    }
}

#[test]
fn a_show_cannot_print_over_its_own_errors() {
    let bench = Bench::new();
    fs::write(bench.path("show.skyc"), skyc::write(&show()).unwrap()).unwrap();
    let checked = tame(&bench, &["check", "show.skyc"]);
    assert_eq!(checked.code, Some(4), "{checked}");
    tame(&bench, &["inspect", "show.skyc"]);
}

#[test]
fn a_zipped_show_cannot_either() {
    let bench = Bench::new();
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    zip.start_file("Evil\u{202e}1.csv", zip::write::SimpleFileOptions::default()).unwrap();
    zip.write_all(b"Time [msec],x [m],y [m],z [m]\n0,0,0,0\n1000,0,0,100\n").unwrap();
    fs::write(bench.path("show.zip"), zip.finish().unwrap().into_inner()).unwrap();
    // Names in the archive are refused or shown plainly.
    for args in [["check", "show.zip"], ["inspect", "show.zip"]] {
        let ended = bench.run(&args);
        let all = format!("{}{}", ended.out, ended.err);
        assert!(all.contains("Evil") && !all.contains('\u{202e}'), "{ended}");
    }
}

#[cfg(unix)]
#[test]
fn names_of_files_are_one_line() {
    let bench = Bench::new();
    let name = format!("{HOSTILE}.skyc");
    fs::write(bench.path(&name), b"no show").unwrap();
    tame(&bench, &["check", &name]);
    tame(&bench, &["inspect", &name]);
    tame(&bench, &["check", &format!("{HOSTILE}-not-there.skyc")]);
    tame(&bench, &["analyze", &name]);
    tame(&bench, &["plan", &format!("{HOSTILE}.toml")]);
    tame(&bench, &["plan", "calibration", "--vehicle", &name, "-o", "campaign"]);
    tame(&bench, &["simulate", HOSTILE]);
    bench.plan();
    fs::create_dir_all(bench.path("card")).unwrap();
    fs::write(bench.path(&format!("card/{HOSTILE}.BIN")), b"no log").unwrap();
    tame(&bench, &["logs", "import", "campaign", "card"]);
    fs::create_dir_all(bench.path("campaign/logs")).unwrap();
    fs::write(bench.path(&format!("campaign/logs/{HOSTILE}.BIN")), b"no log").unwrap();
    tame(&bench, &["analyze", "campaign"]);
}

#[test]
fn arguments_are_quoted_plainly() {
    let bench = Bench::new();
    tame(&bench, &["check", "x", &format!("--{HOSTILE}")]);
    tame(&bench, &["check", HOSTILE]);
    tame(&bench, &["fly", "x", "--lead", HOSTILE]);
    bench.plan();
    tame(&bench, &["fleet", "status", "campaign", "--connect", HOSTILE]);
    tame(&bench, &["plan", "calibration", "--set", &format!("{HOSTILE}=1"), "-o", "campaign"]);
}

#[test]
fn titles_of_templates_are_text() {
    let bench = Bench::new();
    let template = fs::read_to_string("templates/calibration.toml").unwrap();
    let title = template.lines().find(|line| line.starts_with("title = ")).unwrap();
    let hostile = template.replace(title, &format!("title = \"{}\"", quoted()));
    fs::write(bench.path("hostile.toml"), &hostile).unwrap();
    let plan = ["plan", "hostile.toml", "--grid", "1x2", "-o", "campaign"];
    let planned = bench.expect(0, &[&plan[..], SHORT].concat());
    assert!(!planned.out.contains(|c| c != '\n' && acts(c)), "{planned}");
    tame(&bench, &["inspect", "campaign"]);
    // A key that nobody knows is quoted with its line.
    fs::write(bench.path("wrong.toml"), hostile.replace("title", &format!("\"{}\"", quoted())))
        .unwrap();
    tame(&bench, &["plan", "wrong.toml", "-o", "other"]);
}

#[test]
fn errors_about_json_and_toml_are_text() {
    let bench = Bench::new();
    bench.plan();
    let plan = fs::read_to_string(bench.path("campaign/plan.json")).unwrap();
    let wrong = plan.replacen("\"schema\"", &format!("\"{}\"", quoted()), 1);
    fs::write(bench.path("campaign/plan.json"), wrong).unwrap();
    tame(&bench, &["check", "campaign"]);
    tame(&bench, &["inspect", "campaign"]);
    let wrong = plan.replacen("updraft.plan/", &quoted(), 1);
    fs::write(bench.path("campaign/plan.json"), wrong).unwrap();
    tame(&bench, &["inspect", "campaign"]);
    fs::write(bench.path("campaign/plan.json"), plan).unwrap();
    fs::write(bench.path("air.toml"), format!("schema = \"{}\"\nair = []\n", quoted())).unwrap();
    tame(&bench, &["simulate", "campaign", "--air", "air.toml"]);
    fs::write(bench.path("v.toml"), format!("schema = \"{}\"\n# \u{1b}[2J\n", quoted())).unwrap();
    let ended = bench.run(&["plan", "calibration", "--vehicle", "v.toml", "-o", "other"]);
    assert!(!ended.err.contains(|c| c != '\n' && acts(c)), "{ended}");
}

#[test]
fn what_a_log_says_is_text() {
    let bench = Bench::new();
    let mut log = LogWriter::new(Vec::new(), &[&catalog::MSG, &catalog::PARM]).unwrap();
    for step in 0..5 {
        let text = format!("Evil\u{1b}[2J\rSafe: forged\nSafe: forged\u{202e}{step}");
        log.row(&catalog::MSG, &[Value::Int(step), Value::Text(&text)]).unwrap();
        let mut row = vec![Value::Int(step); catalog::PARM.format.len()];
        row[1] = Value::Text("EV\u{1b}[2J\rIL");
        row[2] = Value::Float(1.0);
        log.row(&catalog::PARM, &row).unwrap();
    }
    let firmware = "ArduCopter V4.4.4 (Evil\u{1b}[2J\r\nSafe: forged)";
    log.row(&catalog::MSG, &[Value::Int(9), Value::Text(firmware)]).unwrap();
    let mut bytes = log.finish().unwrap();
    // A message and a field with names that act.
    let name = b"MSG\0";
    let at = bytes.windows(4).position(|four| four == name).unwrap();
    fs::write(bench.path("a.BIN"), &bytes).unwrap();
    bytes[at..at + 3].copy_from_slice(b"\x1bM\r");
    fs::write(bench.path("b.BIN"), &bytes).unwrap();
    for file in ["a.BIN", "b.BIN"] {
        for args in [&["inspect", file][..], &["analyze", file], &["inspect", file, "--json"]] {
            let ended = bench.run(args);
            let all = format!("{}{}", ended.out, ended.err);
            assert!(!all.contains(|c| c != '\n' && acts(c)), "{all:?}");
            assert!(!all.lines().any(|line| line.trim_start().starts_with("Safe:")), "{all}");
        }
    }
}

#[test]
fn columns_of_tables_are_text() {
    let bench = Bench::new();
    let mapping = "schema = \"updraft.csv/1\"\ntitle = \"HOSTILE\"\nindicator = \"pulse\"\n\
        [time]\ncolumn = \"HOSTILE\"\nformat = \"s\"\n[effort]\ncolumns = [\"m\"]\n\
        [velocity_up]\ncolumns = [\"v\"]\n[height]\ncolumns = [\"h\"]\n[roll]\ncolumns = [\"r\"]\n\
        [pitch]\ncolumns = [\"p\"]\n[[flights]]\nname = \"HOSTILE\"\npurpose = \"calibration\"\n\
        files = [\"a.csv\"]\n"
        .replace("HOSTILE", &quoted());
    fs::write(bench.path("mapping.toml"), mapping).unwrap();
    let args = ["analyze", "--csv", "mapping.toml", "--no-report"];
    fs::write(bench.path("a.csv"), format!("\"{HOSTILE}!\",m,v,h,r,p\n1,1,1,1,1,1\n")).unwrap();
    tame(&bench, &args);
    let rows = format!("\"{HOSTILE}\",m,v,h,r,p\n\"{HOSTILE}\",\"{HOSTILE}\",1,1,1,1\n");
    fs::write(bench.path("a.csv"), rows).unwrap();
    tame(&bench, &args);
    let rows = format!("\"{HOSTILE}\",m,v,h,r,p\n1,\"{HOSTILE}\",1,1,1,1\n");
    fs::write(bench.path("a.csv"), rows).unwrap();
    tame(&bench, &args);
}

#[test]
fn reports_show_it_as_text() {
    let bench = Bench::new();
    let template = fs::read_to_string("templates/calibration.toml").unwrap();
    let title = template.lines().find(|line| line.starts_with("title = ")).unwrap();
    let markup = format!("title = \"{}<script>alert(1)</script>\"", quoted());
    fs::write(bench.path("hostile.toml"), template.replace(title, &markup)).unwrap();
    let plan = ["plan", "hostile.toml", "--grid", "1x2", "-o", "campaign"];
    bench.expect(0, &[&plan[..], SHORT].concat());
    bench.expect(0, &["simulate", "campaign"]);
    assert_tame(&bench.expect(0, &["analyze", "campaign", "--color", "always"]));
    let page = fs::read_to_string(bench.path("campaign/report/index.html")).unwrap();
    assert!(page.contains("Evil") && !page.contains("<script>alert"), "escaped");
    assert!(!page.contains(|c| !matches!(c, '\n' | '\t') && acts(c)));
}
