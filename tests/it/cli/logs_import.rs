//! Several starts of one flight: which logs are imported, and that those of another start are refused.

use std::fs;
use std::path::{Path, PathBuf};

use updraft::base::time::GpsTime;
use updraft::flight::Identity;

use crate::cli::analyze_inputs::campaign;
use crate::cli::support::{Bench, Ended};
#[cfg(unix)]
use crate::cli::terminal::on_a_terminal;

/// The campaign of the other tests, with its logs as if real drones had flown it.
fn flown() -> Bench {
    let bench = campaign();
    for flight in ["calibration", "hover"] {
        let folder = bench.path("campaign").join(flight);
        let logs = folder.join("logs");
        fs::create_dir_all(&logs).unwrap();
        for log in ["01.BIN", "02.BIN"] {
            let simulated = folder.join("simulated").join(log);
            if simulated.is_file() {
                fs::rename(simulated, logs.join(log)).unwrap();
            }
        }
    }
    bench
}

fn start_of(log: &Path) -> GpsTime {
    Identity::open(log).unwrap().shows().next().unwrap().start
}

fn write_start(folder: &Path, start: GpsTime) {
    let record = serde_json::json!({
        "schema": "updraft.start/2", "made_by": "test", "start": start, "number": 1,
    });
    fs::write(folder.join("logs/start.json"), record.to_string()).unwrap();
}

/// The bytes of a log whose satellites say another time.
fn shifted(log: &Path, by_ms: i64) -> Vec<u8> {
    let mut bytes = fs::read(log).unwrap();
    let is_format = |at: usize, bytes: &[u8]| {
        bytes[at..].starts_with(&[0xA3, 0x95, 0x80]) && bytes[at + 5..].starts_with(b"GPS\0")
    };
    let at = (0..bytes.len() - 9).find(|at| is_format(*at, &bytes)).unwrap();
    let (id, length) = (bytes[at + 3], usize::from(bytes[at + 4]));
    // TimeUS, I, Status, GMS: eight bytes and two before it.
    let field = 3 + 10;
    let mut position = 0;
    while position + length <= bytes.len() {
        if bytes[position..].starts_with(&[0xA3, 0x95, id]) {
            let value = &mut bytes[position + field..position + field + 4];
            let now = u32::from_le_bytes(value.try_into().unwrap());
            let then = u32::try_from(i64::from(now) + by_ms).unwrap();
            value.copy_from_slice(&then.to_le_bytes());
            position += length;
        } else {
            position += 1;
        }
    }
    bytes
}

fn shift(log: &Path, by_ms: i64) {
    fs::write(log, shifted(log, by_ms)).unwrap();
}

fn words(ended: &Ended) -> String {
    let both = format!("{}\n{}", ended.out, ended.err);
    both.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_log_of_another_start_is_refused_by_name() {
    let bench = flown();
    let hover = bench.path("campaign/hover");
    let (one, two) = (hover.join("logs/01.BIN"), hover.join("logs/02.BIN"));
    let start = start_of(&one);
    write_start(&hover, start);
    bench.expect(0, &["analyze", "campaign", "--no-report"]);
    let right = fs::read(&two).unwrap();
    shift(&two, -1_204_000);
    let ended = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    let told = words(&ended);
    let refused = "02.BIN: its show began 1,204 s before this flight's start (start.json): it \
                   belongs to another flight; download this flight's from the drone with `updraft \
                   logs pull campaign --flight hover --slots 2`, or import it from its card with \
                   `updraft logs import campaign --flight hover CARD`";
    assert!(told.contains(refused), "{ended}");
    assert!(told.contains("hover 1 of 2 drones") || told.contains("slot 2"), "{ended}");
    // Where the right one was set aside, that is said instead.
    let kept = hover.join("logs/flight-1/02.BIN");
    fs::create_dir_all(kept.parent().unwrap()).unwrap();
    fs::write(&kept, right).unwrap();
    let ended = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    let place = "this flight's log is campaign/hover/logs/flight-1/02.BIN: put it in its place";
    assert!(words(&ended).contains(place), "{ended}");
    fs::remove_file(kept).unwrap();
    // Whoever names the other start means its logs.
    let other = (start.to_unix_ms() / 1000 - 1204).to_string();
    let ended = bench.run(&["analyze", "campaign", "--no-report", "--start", &other]);
    assert!(!words(&ended).contains("this flight's start"), "{ended}");
    // All of another start: nothing is left to analyse.
    shift(&one, -1_204_000);
    let ended = bench.expect(5, &["analyze", "campaign/hover", "--no-report"]);
    let told = words(&ended);
    for log in ["01.BIN", "02.BIN"] {
        assert!(told.contains(&format!("{log}: its show began 1,204 s before")), "{ended}");
    }
    assert!(told.contains("`updraft logs pull campaign/hover --flight hover"), "{ended}");
}

#[test]
fn gap_refuses_a_log_of_another_start() {
    let bench = flown();
    let calibration = bench.path("campaign/calibration");
    let logs = ["01.BIN", "02.BIN"].map(|log| calibration.join("logs").join(log));
    write_start(&calibration, start_of(&logs[0]));
    shift(&logs[1], 3_000_000);
    let gap = ["gap", "campaign", "--replicates", "20"];
    let ended = bench.expect(3, &gap);
    let refused = "02.BIN: its show began 3,000 s after this flight's start (start.json): it belongs \
                   to another flight";
    assert!(words(&ended).contains(refused), "{ended}");
    shift(&logs[0], 3_000_000);
    let ended = bench.expect(5, &gap);
    assert!(words(&ended).contains("01.BIN: its show began 3,000 s after"), "{ended}");
}

#[test]
fn of_a_log_with_two_starts_the_part_of_this_one_is_analysed() {
    let bench = flown();
    let hover = bench.path("campaign/hover");
    let one = hover.join("logs/01.BIN");
    let first = start_of(&one);
    let second = GpsTime { tow_ms: first.tow_ms + 3_600_000, ..first };
    // Both flew the plan: the start alone tells which is meant.
    let both = [fs::read(&one).unwrap(), shifted(&one, 3_600_000)].concat();
    fs::write(&one, both).unwrap();
    let two = hover.join("logs/02.BIN");
    for (start, which) in [(first, Some("the first")), (second, None)] {
        write_start(&hover, start);
        let args = ["analyze", "campaign", "--no-report", "--json", "--quiet"];
        let analysis = bench.expect(0, &args).json("updraft.analyze/1");
        let clock = &analysis["analysis"]["flights"][1]["drones"][0]["clock"];
        assert_eq!(clock["start"]["tow_ms"], start.tow_ms, "{clock}");
        let warnings = analysis["analysis"]["flights"][1]["drones"][0]["warnings"].to_string();
        if let Some(which) = which {
            let words = format!("the one that began at the flight's start is analysed: {which}");
            assert!(warnings.contains(&words), "{warnings}");
        }
        shift(&two, if which.is_some() { 3_600_000 } else { 0 });
    }
}

/// Cards as a crew takes them out: both flights, an earlier start of the hover, in swapped folders.
fn cards(bench: &Bench) -> PathBuf {
    let cards = bench.path("cards");
    for (log, folder) in [("01.BIN", "drone-2"), ("02.BIN", "drone-1")] {
        let of = |flight: &str| bench.path("campaign").join(flight).join("logs").join(log);
        let card = cards.join(folder);
        fs::create_dir_all(&card).unwrap();
        fs::copy(of("calibration"), card.join("00000007.BIN")).unwrap();
        fs::write(card.join("00000008.BIN"), shifted(&of("hover"), -900_000)).unwrap();
        fs::copy(of("hover"), card.join("00000009.BIN")).unwrap();
    }
    for flight in ["calibration", "hover"] {
        fs::remove_dir_all(bench.path("campaign").join(flight).join("logs")).unwrap();
    }
    cards
}

#[test]
fn cards_are_imported_into_the_flights_they_are_of() {
    let bench = flown();
    let hover = bench.path("campaign/hover");
    let start = start_of(&hover.join("logs/01.BIN"));
    cards(&bench);
    // The hover was flown twice, and nobody has written down when.
    let import = ["logs", "import", "campaign", "cards"];
    let ended = bench.expect(3, &import);
    let unix_s = (start.to_unix_ms() + 500) / 1000;
    let told = words(&ended);
    assert!(told.contains("warning: hover was flown several times:"), "{ended}");
    assert!(told.contains(&format!("(--start {unix_s}, 2 logs); none was imported")), "{ended}");
    assert!(told.contains("warning: no log of slots 1, 2 of hover"), "{ended}");
    let taken = "cards/drone-1/00000007.BIN -> drone 2 -> slot 2 -> calibration (02.BIN)";
    assert!(ended.out.lines().any(|line| line == taken), "{ended}");
    assert!(ended.err.contains("Imported 2 logs from cards"), "{ended}");
    // As it advised.
    let unix_s = unix_s.to_string();
    let named = [&import[..], &["--flight", "hover", "--start", &unix_s]].concat();
    let ended = bench.expect(0, &named);
    let taken = "cards/drone-2/00000009.BIN -> drone 1 -> slot 1 -> hover (01.BIN)";
    assert!(ended.out.lines().any(|line| line == taken), "{ended}");
    let left = "left cards/drone-1/00000008.BIN: its show began 900 s before hover's start";
    assert!(ended.err.lines().any(|line| line == left), "{ended}");
    let left = "left cards/drone-1/00000007.BIN: slot 2 of hover has another log, which flew more of its \
                plan";
    assert!(ended.err.lines().any(|line| line == left), "{ended}");
    bench.expect(0, &["logs", "verify", "campaign"]);
    bench.expect(0, &["analyze", "campaign", "--no-report"]);
    // Once more: they are home.
    for flight in ["calibration", "hover"] {
        write_start(&bench.path("campaign").join(flight), start);
    }
    let ended = bench.expect(0, &import);
    assert!(ended.err.contains("Imported 0 logs from cards (4 already here)"), "{ended}");
    let json = bench.expect(0, &[&import[..], &["--json"]].concat()).json("updraft.import/1");
    assert_eq!(json["there"].as_array().unwrap().len(), 4, "{json}");
    assert_eq!(json["flights"][1]["logs"][0]["card"], "cards/drone-2/00000009.BIN");
}

#[cfg(unix)]
#[test]
fn on_a_terminal_doubts_are_asked() {
    let bench = flown();
    let hover = bench.path("campaign/hover");
    let start = start_of(&hover.join("logs/01.BIN"));
    cards(&bench);
    let import = ["logs", "import", "campaign", "cards", "--color", "never"];
    // What is no answer is asked again; none leaves the doubt.
    let question = "When did hover begin?";
    let talk = [(question, ""), ("Type 1 to 2, or none:", "3\nnone\n")];
    let Some((code, told)) = on_a_terminal(&bench, &import, &talk) else { return };
    assert_eq!(told.matches("Type 1 to 2, or none:").count(), 2, "{told}");
    assert_eq!(code, 3, "{told}");
    assert!(told.contains("hover was flown several times"), "{told}");
    assert!(!hover.join("logs/01.BIN").exists());
    let (code, told) = on_a_terminal(&bench, &import, &[("or none:", "2\n")]).unwrap();
    assert!(told.contains(question) && told.contains("2: "), "{told}");
    assert_eq!(code, 0, "{told}");
    for log in ["01.BIN", "02.BIN"] {
        assert_eq!(start_of(&hover.join("logs").join(log)), start);
    }
    // Two logs of one drone and start: which is meant?
    fs::remove_file(hover.join("logs/01.BIN")).unwrap();
    let card = bench.path("cards/drone-2");
    let mut other = fs::read(card.join("00000009.BIN")).unwrap();
    *other.last_mut().unwrap() ^= 1;
    fs::write(card.join("00000010.BIN"), other).unwrap();
    let named = [&import[..], &["--flight", "hover"]].concat();
    let talk = [("or none:", "2\n"), ("to slot 1 of hover?", "1\n")];
    let (code, told) = on_a_terminal(&bench, &named, &talk).unwrap();
    assert!(told.contains("1: cards/drone-2/00000009.BIN, drone 1, from "), "{told}");
    assert_eq!(code, 0, "{told}");
    assert!(hover.join("logs/01.BIN").exists());
}

#[test]
fn logs_that_are_cut_or_damaged_are_taken_and_never_passed_over_in_silence() {
    let bench = flown();
    let hover = bench.path("campaign/hover/logs");
    let start = start_of(&hover.join("01.BIN"));
    let mut cut = fs::read(hover.join("01.BIN")).unwrap();
    cut.truncate(cut.len() * 2 / 3);
    let mut damaged = fs::read(hover.join("02.BIN")).unwrap();
    let middle = damaged.len() / 2;
    damaged[middle..middle + 3_000].fill(0);
    let card = bench.path("card");
    fs::create_dir(&card).unwrap();
    fs::write(card.join("1.BIN"), cut).unwrap();
    fs::write(card.join("2.BIN"), damaged).unwrap();
    fs::remove_dir_all(&hover).unwrap();
    fs::create_dir(&hover).unwrap();
    write_start(&bench.path("campaign/hover"), start);
    let import = ["logs", "import", "campaign", "card", "--flight", "hover"];
    for took in ["Imported 2 logs from cards", "Imported 0 logs from cards (2 already here)"] {
        let ended = bench.expect(3, &import);
        assert!(ended.err.contains(took), "{ended}");
        assert!(ended.err.contains("warning: 01.BIN may not be complete: it ends "), "{ended}");
        assert!(ended.err.contains("warning: 02.BIN may not be complete: "), "{ended}");
        assert!(ended.err.contains(" bytes of it are damaged"), "{ended}");
    }
    bench.expect(3, &["logs", "verify", "campaign"]);
}

#[test]
fn a_card_that_is_not_there_and_starts_that_contradict_are_refused() {
    let bench = flown();
    let hover = bench.path("campaign/hover");
    let ended = bench.expect(1, &["logs", "import", "campaign", "card-7"]);
    assert!(ended.err.contains("card-7"), "{ended}");
    let start = start_of(&hover.join("logs/01.BIN"));
    write_start(&hover, start);
    let other = (start.to_unix_ms() / 1000 + 60).to_string();
    fs::create_dir(bench.path("empty")).unwrap();
    let import = ["logs", "import", "campaign", "empty"];
    let ended = bench.expect(2, &[&import[..], &["--start", &other]].concat());
    assert!(ended.err.contains("--start is for one flight: say which with --flight"), "{ended}");
    let named = [&import[..], &["--flight", "hover", "--start", &other]].concat();
    let ended = bench.expect(2, &named);
    assert!(ended.err.contains("the logs of another start cannot be placed beside it"), "{ended}");
    let ended = bench.run(&import);
    assert!(ended.err.contains("warning: empty holds no log (.BIN)"), "{ended}");
}
