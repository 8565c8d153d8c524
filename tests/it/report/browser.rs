//! The report in a real browser: the film moves, a cell of the fleet opens its drone, nothing is
//! fetched, nothing is wrong in the console.
//!
//! Needs Chromium or Chrome: `chromium` on the path, or the program that `UPDRAFT_BROWSER` names.
//! Without one the test says so and passes. Screenshots stay in `target/tmp/report-browser/`.
#![cfg(unix)]

use std::path::{Path, PathBuf};

use crate::report::chromium::{Browser, Key, Tab};
use crate::report::synthetic::{posterior, provenance, whole_campaign};
use updraft::report::{render, render_gap, write};

/// Writes the synthetic campaign's report; the page's address and the folder of screenshots.
fn report(name: &str) -> (String, PathBuf) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-browser").join(name);
    let made = render(&whole_campaign(), &provenance()).expect("a report");
    write(&made, &folder).expect("written");
    (format!("file://{}", folder.join("index.html").display()), folder)
}

/// Number of the shown frame of the film.
fn frame(tab: &mut Tab<'_>) -> i64 {
    tab.number("Number(document.querySelector('.film').dataset.frame)") as i64
}

#[test]
fn the_report_works_in_a_browser() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, folder) = report("campaign");
    let mut tab = browser.open(&address, [1280, 900]);

    // The film: slider, keys, play and pause.
    tab.run(
        "document.querySelector('.film').scrollIntoView({ block: 'center', behavior: 'instant' })",
    );
    assert_eq!(frame(&mut tab), 0);
    let early = tab.text("document.querySelector('.film canvas').toDataURL()");
    let [x, y, width, _] = tab.place(".film input[type=range]");
    tab.click([x + 0.75 * width, y + 8.0]);
    let there = frame(&mut tab);
    assert!((380..=500).contains(&there), "the slider at three quarters shows frame {there}");
    assert!(
        tab.text("document.querySelector('.film canvas').toDataURL()") != early,
        "the picture has not changed"
    );
    let clock = tab.text("document.querySelector('.film .clock').textContent");
    assert_eq!(clock, format!("{} s", 95 + there), "the clock tells show seconds");
    tab.run("document.querySelector('.film').focus()");
    tab.press(Key::Right);
    assert_eq!(frame(&mut tab), there + 1, "the right arrow steps");
    tab.press(Key::Home);
    assert_eq!(frame(&mut tab), 0, "Home jumps to the start");
    tab.click_on(".film .play");
    tab.wait_for("Number(document.querySelector('.film').dataset.frame) >= 3");
    tab.press_on(".film", Key::Space);
    tab.wait_for("document.querySelector('.film').dataset.playing === 'no'");
    let stopped = frame(&mut tab);
    tab.sleep_ms(300);
    assert_eq!(frame(&mut tab), stopped, "paused is paused");
    tab.screenshot(&folder.join("film.png"));

    // The fleet: a click opens a drone, Enter too.
    let chosen = "document.querySelector('.gallery select').value";
    let title = "document.querySelector('.gallery figure svg title').textContent";
    tab.click_on("a[data-drone$='drone-17']");
    assert!(tab.text(chosen).ends_with("-drone-17"), "{}", tab.text(chosen));
    assert_eq!(tab.text(title), "Calibration of Drone 17 (paper's Fig. 3)");
    tab.run("document.querySelector(\"a[data-drone$='drone-30']\").focus()");
    tab.press(Key::Enter);
    tab.wait_for("document.querySelector('.gallery select').value.endsWith('-drone-30')");
    assert_eq!(tab.text(title), "Calibration of Drone 30 (paper's Fig. 3)");
    // The page scrolls there, smoothly.
    let top = "document.querySelector('.gallery').getBoundingClientRect().top";
    tab.wait_for(&format!("{top} > -5 && {top} < 400"));
    tab.screenshot(&folder.join("drone.png"));
    let address_now = tab.text("location.href.split('#')[0]");
    assert_eq!(address_now, address, "the page did not leave");

    tab.whole_page(&folder.join("page.png"));
    tab.finish();
}

#[test]
fn the_film_shows_the_posterior_and_at_a_click_each_drone_alone() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-browser").join("posterior");
    let made = render(&posterior(whole_campaign()), &provenance()).expect("a report");
    write(&made, &folder).expect("written");
    let address = format!("file://{}", folder.join("index.html").display());
    let mut tab = browser.open(&address, [1280, 900]);
    let heading = "document.querySelector('.film h3').textContent";
    let reading = "document.querySelector('.film .reading').textContent";
    let picture = "document.querySelector('.film canvas').toDataURL()";
    assert_eq!(tab.text(heading), "Posterior W");
    assert!(tab.text(reading).contains("drones −0.12 m/s"), "{}", tab.text(reading));
    let together = tab.text(picture);
    tab.run(
        "document.querySelector('.film').scrollIntoView({ block: 'center', behavior: 'instant' })",
    );
    tab.screenshot(&folder.join("film.png"));
    tab.click_on(".film .alone");
    assert_eq!(tab.text(heading), "Estimated W*");
    assert!(tab.text(picture) != together, "the picture has not changed");
    tab.click_on(".film .alone");
    assert_eq!(tab.text(heading), "Posterior W");
    assert_eq!(tab.text(picture), together, "and back");
    tab.whole_page(&folder.join("page.png"));
    tab.finish();
}

#[test]
fn the_report_fits_a_phone_and_respects_less_motion() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, folder) = report("phone");
    let mut tab = browser.open(&address, [390, 844]);
    let wide = tab.number("document.documentElement.scrollWidth");
    assert!(wide <= 391.0, "the page scrolls sideways: {wide} px");
    tab.less_motion();
    tab.run(
        "document.querySelector('.film').scrollIntoView({ block: 'start', behavior: 'instant' })",
    );
    tab.click_on(".film .play");
    tab.sleep_ms(400);
    assert_eq!(frame(&mut tab), 0, "no movement within the first second");
    tab.wait_for("Number(document.querySelector('.film').dataset.frame) >= 1");
    tab.screenshot(&folder.join("film.png"));
    tab.whole_page(&folder.join("page.png"));
    tab.finish();
}

#[test]
fn the_page_of_a_verdict_loads_and_fits_a_phone() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-browser").join("gap");
    let made =
        render_gap(&crate::report::verdicts::class(), &crate::report::verdicts::provenance())
            .expect("a page");
    write(&made, &folder).expect("written");
    let address = format!("file://{}", folder.join("index.html").display());
    for (name, size) in [("desk", [1280, 900]), ("phone", [420, 844])] {
        let mut tab = browser.open(&address, size);
        let wide = tab.number("document.documentElement.scrollWidth");
        assert!(wide <= f64::from(size[0]) + 1.0, "{name}: the page scrolls sideways: {wide} px");
        let sections =
            tab.text("[...document.querySelectorAll('section')].map((s) => s.id).join()");
        let expected = "map,ladder,steps,gap,sensor,undetectable,drones,noise,method,provenance";
        assert_eq!(sections, expected);
        let lost = "[...document.querySelectorAll('nav a')].filter((a) => \
                    !document.querySelector(a.getAttribute('href'))).length";
        assert_eq!(tab.number(lost), 0.0, "{name}: a way leads nowhere");
        let flat = "[...document.querySelectorAll('figure svg')].filter((svg) => \
                    svg.getBoundingClientRect().height < 100).length";
        assert_eq!(tab.number(flat), 0.0, "{name}: a figure is empty");
        assert_eq!(tab.number("document.querySelectorAll('figure svg').length"), 5.0);
        let ids = "(() => { const ids = [...document.querySelectorAll('[id]')].map((e) => e.id); \
                   return ids.length - new Set(ids).size; })()";
        assert_eq!(tab.number(ids), 0.0, "{name}: an id is there twice");
        tab.whole_page(&folder.join(format!("{name}.png")));
        tab.finish();
    }
}

/// What the other tests rely on.
#[test]
fn a_page_that_errs_or_fetches_is_noticed() {
    let Some(mut browser) = Browser::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("index.html");
    let script = "console.error('loud'); fetch('https://updraft.invalid/x').catch(() => {}); \
                  setTimeout(() => { window.done = true; throw new Error('late'); })";
    std::fs::write(&page, format!("<title>x</title><script>{script}</script>")).unwrap();
    let mut tab = browser.open(&format!("file://{}", page.display()), [400, 300]);
    tab.wait_for("window.done === true");
    let troubles = tab.troubles().join("\n");
    for trouble in ["loud", "fetched https://updraft.invalid/x", "exception: "] {
        assert!(troubles.contains(trouble), "{trouble} was not noticed: {troubles}");
    }
}
