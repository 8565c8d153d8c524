//! A flight seen, started and ended in a real browser, with the real program and virtual drones.
//!
//! Needs Chromium, as the tests of the report do; without one they say so and pass. Screenshots stay in
//! `target/tmp/live/`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::cli::fleet::free_port;
use crate::cli::guided::{Flight, stage_on};
use crate::cli::support::Bench;
use crate::report::chromium::{Browser, Key, Tab};

fn pictures() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("live");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Address behind these words of the station.
fn address(said: &str, words: &str) -> String {
    let line = said.lines().find(|line| line.contains(words)).unwrap_or_else(|| panic!("{said}"));
    line.rsplit(' ').next().unwrap().to_owned()
}

/// The station, which asks on its page alone.
fn flown<'a>(link: &'a str, live: &'a str, lead: &'a str) -> Vec<&'a str> {
    let args = ["fly", "campaign", "--connect", link, "--set-params", "--no-logs", "--wait", "20"];
    [&args[..], &["--live", live, "--live-orders", "--lead", lead]].concat()
}

fn text(tab: &mut Tab<'_>, id: &str) -> String {
    tab.text(&format!("document.getElementById('{id}').textContent"))
}

#[test]
fn a_flight_is_started_and_ended_on_its_page() {
    let Some(mut browser) = Browser::start() else { return };
    let (bench, _fleet, link) = stage_on(Bench::new(), &["--speed", "5"]);
    let live = free_port();
    // Half a minute on the wall: a busy machine opens two pages in it.
    let mut flight = Flight::of(&bench, &flown(&link, &live, "150"));
    flight.hear("Live page, to give orders");
    let (look, order) = {
        let said = flight.said();
        (address(&said, "to look"), address(&said, "to give orders"))
    };

    // Who may look sees the question, and cannot answer it.
    let mut tab = browser.open(&look, [1280, 900]);
    tab.wait_for("!document.getElementById('question').hidden");
    assert_eq!(text(&mut tab, "question-text"), "Authorize the start?");
    assert_eq!(
        tab.number("document.querySelectorAll('#question-answers button:disabled').length"),
        2.0
    );
    assert_eq!(tab.text("location.hash"), "", "the secret left the address bar");
    let sum = text(&mut tab, "preflight-sum");
    assert_eq!(sum, "Go: all 2 drones are ready");
    tab.finish();

    // The operator starts with the keyboard alone: twice, as one press may be a slip.
    let mut tab = browser.open(&order, [1280, 900]);
    tab.wait_for("!document.getElementById('question').hidden");
    tab.whole_page(&pictures().join("question.png"));
    tab.press_on("#question-answers button", Key::Enter);
    tab.sleep_ms(100);
    assert!(!flight.said().contains("Authorized."), "one press starts nothing");
    tab.press(Key::Enter);
    flight.hear("Authorized.");
    tab.wait_for("document.getElementById('step').textContent === 'flying'");
    tab.wait_for(
        "state.drones.length === 2 && state.drones.every((d) => d.place_m && d.place_m[2] > 3)",
    );
    tab.wait_for("document.querySelectorAll('#rows tr').length === 2");
    tab.screenshot(&pictures().join("flying.png"));

    // Only the one that is chosen lands.
    tab.click_on("#rows input[aria-label='slot 2']");
    tab.click_on("#order-land");
    tab.wait_for("!document.getElementById('confirm').hidden");
    tab.click_on("#confirm-yes");
    flight.hear("Ordered on the page: land");
    tab.wait_for("state.drones[1].order.startsWith('land: ')");
    assert_eq!(tab.text("state.drones[0].order"), "", "it was not chosen");
    tab.click_on("#choose-none");

    // A second, deliberate step brings them down; Escape takes the first one back.
    tab.press_on("#order-land", Key::Enter);
    tab.wait_for("!document.getElementById('confirm').hidden");
    assert_eq!(
        tab.text("document.activeElement.id"),
        "confirm-no",
        "the safe answer has the focus"
    );
    tab.press(Key::Escape);
    tab.wait_for("document.getElementById('confirm').hidden");
    assert_eq!(tab.text("document.activeElement.id"), "order-land");
    tab.click_on("#order-return");
    tab.wait_for("!document.getElementById('confirm').hidden");
    tab.screenshot(&pictures().join("confirm.png"));
    assert!(!flight.said().contains("page: abort"), "nothing is ordered yet");
    tab.press(Key::Tab);
    assert_eq!(tab.text("document.activeElement.id"), "confirm-yes");
    tab.press(Key::Enter);
    flight.hear("Ordered on the page: abort");
    tab.wait_for("state.drones[0].order === 'return: returns'");
    tab.dark();
    tab.screenshot(&pictures().join("ordered-dark.png"));
    let troubles = tab.troubles();
    assert!(troubles.is_empty(), "{troubles:#?}");
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
    // The page is told that it is over, and that is no loss of the connection.
    tab.wait_for("state.frame.step === 'over'");
    tab.wait_for("document.getElementById('connection').textContent === 'station ended'");
    drop(tab);
    let journal = fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap();
    assert!(journal.contains("ordered on the page"), "{journal}");
}

#[test]
fn a_page_finds_its_station_again_and_fits_a_phone() {
    let Some(mut browser) = Browser::start() else { return };
    let (bench, _fleet, link) = stage_on(Bench::new(), &["--speed", "5"]);
    let live = free_port();
    let mut flight = Flight::of(&bench, &flown(&link, &live, "600"));
    flight.hear("Live page, to look");
    let look = address(&flight.said(), "to look");
    let mut tab = browser.open(&look, [390, 844]);
    tab.wait_for("document.body.dataset.connection === 'open' && state.drones.length === 2");
    tab.wait_for("!document.getElementById('question').hidden");
    let wide = tab.number("document.documentElement.scrollWidth");
    assert!(wide <= 391.0, "the page scrolls sideways: {wide} px");
    tab.whole_page(&pictures().join("phone.png"));
    flight.signal("-KILL");
    flight.end();
    tab.wait_for("document.body.dataset.connection === 'lost'");
    assert!(text(&mut tab, "gone").contains("what is shown is old"));
    // A station that lost its connection is no trouble of the page.
    let _ = tab.troubles();
    let mut again = Flight::of(&bench, &flown(&link, &live, "600"));
    again.hear("Live page, to look");
    tab.wait_for("document.body.dataset.connection === 'open'");
    tab.wait_for("document.getElementById('gone').hidden");
    tab.wait_for("document.getElementById('step').textContent === 'start'");
    again.signal("-INT");
    again.end();
}

#[test]
fn a_replay_plays_jumps_and_shows_the_air() {
    let Some(mut browser) = Browser::start() else { return };
    let bench = Bench::new();
    let run = ["run", "--grid", "2x2", "--duration", "60", "-o", "campaign", "-q"];
    bench.expect(0, &[&run[..], &["--air", "still", "--updraft", "0.6"]].concat());
    let live = free_port();
    let args = ["live", "campaign", "--flight", "hover", "--speed", "30", "--listen", &live];
    let mut flight = Flight::of(&bench, &args);
    flight.hear("Replay of hover with 4 drones");
    let mut tab = browser.open(&address(&flight.said(), "to look"), [1280, 900]);
    tab.wait_for("state.frame && state.frame.show_s > 20");
    assert_eq!(text(&mut tab, "kind"), "Replay");
    tab.click_on("#replay-play");
    tab.wait_for("!state.frame.replay.plays");
    // The slider jumps into the middle of the hover.
    let middle = "state.facts.duration_s / 2";
    tab.run(&format!(
        "(() => {{ const t = document.getElementById('replay-time'); t.value = {middle}; \
         t.dispatchEvent(new Event('input')); t.dispatchEvent(new Event('change')); }})()"
    ));
    tab.wait_for(&format!("Math.abs(state.frame.show_s - {middle}) < 1"));
    tab.wait_for("state.drones.every((d) => d.air_mps !== null)");
    let air =
        tab.number("state.drones.reduce((sum, d) => sum + d.air_mps, 0) / state.drones.length");
    assert!((air - 0.6).abs() < 0.2, "{air}");
    assert_eq!(text(&mut tab, "air-mark"), "final");
    assert_eq!(tab.number("document.querySelectorAll('#orders:not([hidden])').length"), 0.0);
    tab.screenshot(&pictures().join("replay.png"));
    tab.finish();
    flight.signal("-TERM");
    assert_eq!(flight.end(), Some(0), "{}", flight.said());
    let missing = bench.expect(2, &["live", "campaign", "--flight", "climb"]);
    assert!(missing.err.contains("no flight \"climb\", but calibration, hover"), "{missing}");
}
