//! The interactive parts of the page in a real browser: what is picked in one is picked in all, the chart zooms, the
//! replay moves and has the colours of the values, and the keyboard does all of it.
#![cfg(unix)]

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::report::chromium::{Browser, Key, Tab};
use crate::report::synthetic::{crowd, provenance, traced, whole_campaign};
use updraft::analysis::result::{Analysis, FlightSite};
use updraft::report::{Basemap, Beside, Corners, draw, render, write};

/// Writes a report; the page's address and the folder of screenshots.
fn report(name: &str, analysis: &Analysis) -> (String, PathBuf) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-explorer").join(name);
    let made = render(analysis, &provenance()).expect("a report");
    write(&made, &folder).expect("written");
    (format!("file://{}", folder.join("index.html").display()), folder)
}

const HOVER: &str = "#explorer-hover";

/// Brings a part into the window and waits until it has begun.
fn begun(tab: &mut Tab<'_>, part: &str) {
    tab.run(&format!(
        "document.querySelector('{part}').scrollIntoView({{ block: 'center', behavior: 'instant' }})"
    ));
    tab.wait_for(&format!("document.querySelector('{part}').dataset.ready === 'yes'"));
}

/// Both parts of the hover.
fn both_begun(tab: &mut Tab<'_>) {
    for part in ["series", "replay"] {
        begun(tab, &format!("{HOVER} .{part}"));
    }
}

/// The drone that each part shows as picked: list, chart, replay, map, fleet, Figure 3.
fn picked(tab: &mut Tab<'_>) -> Vec<String> {
    let parts = [
        format!("document.querySelector('{HOVER} .pick').value"),
        format!("document.querySelector('{HOVER} .series').dataset.picked"),
        format!("document.querySelector('{HOVER} .replay').dataset.picked"),
        "document.querySelector('#air-1 figure .drawing g.picked')?.dataset.pick ?? ''".to_owned(),
        "document.querySelector('.drawing a.picked')?.dataset.pick ?? ''".to_owned(),
        "document.querySelector('.gallery select').selectedOptions[0].dataset.pick".to_owned(),
    ];
    parts.iter().map(|part| tab.text(part)).collect()
}

fn everywhere(slot: u16) -> Vec<String> {
    let (pick, name) = (slot.to_string(), format!("Drone {slot}"));
    vec![pick.clone(), name.clone(), name, pick.clone(), pick.clone(), pick]
}

/// The times between which the chart shows.
fn view(tab: &mut Tab<'_>) -> [f64; 2] {
    // It draws in the next moment.
    tab.sleep_ms(50);
    ["from", "to"].map(|end| {
        tab.number(&format!("Number(document.querySelector('{HOVER} .series').dataset.{end})"))
    })
}

fn film_frame(tab: &mut Tab<'_>) -> f64 {
    tab.number("Number(document.querySelector('.film').dataset.frame)")
}

fn replay_time(tab: &mut Tab<'_>) -> f64 {
    tab.number(&format!("Number(document.querySelector('{HOVER} .replay').dataset.time)"))
}

#[test]
fn what_is_picked_in_one_part_is_picked_in_all() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, folder) = report("picks", &traced(whole_campaign()));
    let page = std::fs::metadata(folder.join("index.html")).unwrap().len();
    assert!(page < 3_000_000, "the page of 49 drones has {page} bytes");
    let mut tab = browser.open(&address, [1280, 900]);
    both_begun(&mut tab);
    let film = "document.querySelector('.film canvas').toDataURL()";
    let unpicked = tab.text(film);

    tab.click_on("#air-1 figure .drawing g[data-pick='17']");
    assert_eq!(picked(&mut tab), everywhere(17), "from the map");
    assert!(tab.text(film) != unpicked, "the film does not show the picked drone");

    // From the fleet, which also opens the drone, and back from Figure 3.
    tab.click_on("a[data-pick='30']");
    assert_eq!(picked(&mut tab), everywhere(30), "from the fleet");
    tab.click_on(".gallery button[data-step='1']");
    assert_eq!(picked(&mut tab), everywhere(31), "from Figure 3");

    // From the film: the middle drone stands in its middle.
    tab.run(
        "document.querySelector('.film').scrollIntoView({ block: 'center', behavior: 'instant' })",
    );
    let [x, y, width, _] = tab.place(".film canvas");
    // The frame of the axes: 34 on the left, 6 on the right and above.
    let middle = (width - 40.0) / 2.0;
    tab.click([x + 34.0 + middle, y + 6.0 + middle]);
    assert_eq!(picked(&mut tab), everywhere(25), "from the film");

    // From the replay, where a drone is drawn.
    begun(&mut tab, ".replay");
    let [x, y, ..] = tab.place(&format!("{HOVER} .replay canvas"));
    let marker = |tab: &mut Tab<'_>, part: usize| {
        tab.number(&format!(
            "document.querySelector('{HOVER} .replay').markers().find((one) => \
             updraft.flight('hover').names[one.i] === 'Drone 2').at[{part}]"
        ))
    };
    let at = [x + marker(&mut tab, 0), y + marker(&mut tab, 1)];
    tab.click(at);
    assert_eq!(picked(&mut tab), everywhere(2), "from the replay");

    // From the chart: the line below the pointer.
    begun(&mut tab, &format!("{HOVER} .series"));
    let [x, y, width, height] = tab.place(&format!("{HOVER} .series .u-over"));
    tab.click([x + width / 2.0, y + height / 2.0]);
    let hovered = tab.text(&format!("document.querySelector('{HOVER} .series').dataset.hovered"));
    let name = tab.text(&format!("document.querySelector('{HOVER} .series').dataset.picked"));
    assert_eq!(hovered, name, "the line that is pointed at");
    let reading =
        tab.text(&format!("document.querySelector('{HOVER} .series .reading').textContent"));
    assert!(reading.contains(&format!("{name}: ")) && reading.contains("(95 %: "), "{reading}");
    tab.screenshot(&folder.join("series.png"));
    tab.finish();
}

#[test]
fn the_chart_zooms_by_drag_wheel_and_double_click_and_moves_all_parts_in_time() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, folder) = report("zoom", &traced(whole_campaign()));
    let mut tab = browser.open(&address, [1280, 900]);
    both_begun(&mut tab);
    begun(&mut tab, &format!("{HOVER} .series"));
    let whole = view(&mut tab);
    assert_eq!(whole, [95.0, 684.0], "all of the map's times");
    let [x, y, width, height] = tab.place(&format!("{HOVER} .series .u-over"));
    let middle = y + height / 2.0;

    tab.drag([x + 0.25 * width, middle], [x + 0.75 * width, middle]);
    let dragged = view(&mut tab);
    let span = whole[1] - whole[0];
    for (end, share) in dragged.into_iter().zip([0.25, 0.75]) {
        assert!((end - whole[0] - share * span).abs() < 0.02 * span, "{dragged:?}");
    }
    tab.wheel([x + width / 2.0, middle], -400.0);
    let wheeled = view(&mut tab);
    assert!(wheeled[1] - wheeled[0] < 0.8 * (dragged[1] - dragged[0]), "{wheeled:?}");
    tab.double_click([x + width / 2.0, middle]);
    assert_eq!(view(&mut tab), whole, "a double click shows all");

    // The time that is clicked is that of film and replay.
    tab.click([x + width / 2.0, middle]);
    let replay = replay_time(&mut tab);
    assert!((replay - 389.0).abs() <= 2.0, "the middle of the chart is {replay} s");
    assert_eq!(film_frame(&mut tab), replay - 95.0);
    // And that of the film is the chart's and the replay's.
    tab.press_on(".film", Key::Home);
    assert_eq!(replay_time(&mut tab), 95.0);
    let reading =
        tab.text(&format!("document.querySelector('{HOVER} .series .reading').textContent"));
    assert!(reading.starts_with("95 s: "), "{reading}");
    tab.screenshot(&folder.join("whole.png"));
    tab.finish();
}

#[test]
fn the_keyboard_alone_works() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, _) = report("keys", &traced(whole_campaign()));
    let mut tab = browser.open(&address, [1280, 900]);
    both_begun(&mut tab);
    let series = format!("{HOVER} .series");
    let whole = view(&mut tab);
    tab.press_on(&series, Key::Down);
    assert_eq!(picked(&mut tab)[..3], everywhere(1)[..3], "down picks the first drone");
    tab.press(Key::Down);
    assert_eq!(picked(&mut tab)[..3], everywhere(2)[..3]);
    tab.press(Key::Plus);
    let near = view(&mut tab);
    assert!(near[1] - near[0] < 0.8 * (whole[1] - whole[0]), "{near:?}");
    tab.press(Key::Escape);
    assert_eq!(view(&mut tab), whole);
    tab.press(Key::End);
    assert_eq!(film_frame(&mut tab), 589.0, "the last time of the map");
    tab.press(Key::Home);
    tab.press(Key::Right);
    assert_eq!(film_frame(&mut tab), 1.0);

    let replay = format!("{HOVER} .replay");
    let turned = format!("document.querySelector('{replay}').dataset.turned");
    let before = tab.text(&turned);
    tab.press_on(&replay, Key::Right);
    assert!(tab.text(&turned) != before, "an arrow key turns the view");
    let before = tab.text(&turned);
    tab.press(Key::Plus);
    assert!(tab.text(&turned) != before, "plus magnifies");
    tab.press(Key::Home);
    assert_eq!(replay_time(&mut tab), 0.0, "the flight's begin, before the map's");
    tab.press(Key::Space);
    tab.wait_for(&format!("Number(document.querySelector('{replay}').dataset.time) > 5"));
    tab.press(Key::Space);
    tab.wait_for(&format!("document.querySelector('{replay}').dataset.playing === 'no'"));
    let stopped = replay_time(&mut tab);
    tab.sleep_ms(300);
    assert_eq!(replay_time(&mut tab), stopped, "paused is paused");

    // The map: from drone to drone.
    let pick = |tab: &mut Tab<'_>| tab.text("updraft.picked");
    tab.run("updraft.pick('25')");
    tab.press_on("#air-1 figure .drawing", Key::Right);
    // Left is left and forward is up: to the right lies the slot before.
    assert_eq!(pick(&mut tab), "24");
    tab.press(Key::Down);
    assert_eq!(pick(&mut tab), "17", "7 slots a row");
    tab.finish();
}

#[test]
fn the_replay_has_the_colours_of_the_values() {
    let Some(mut browser) = Browser::start() else { return };
    let analysis = traced(whole_campaign());
    let (address, folder) = report("colours", &analysis);
    let mut tab = browser.open(&address, [1280, 900]);
    both_begun(&mut tab);
    tab.run("updraft.time('hover', 400, null)");
    assert_eq!(replay_time(&mut tab), 400.0);
    let map = analysis.flights[1].map.as_ref().unwrap();
    let time = map.time_s.iter().position(|time| *time == 400.0).unwrap();
    let mut seen = 0;
    for drone in &map.drones {
        let Some(value) = drone.updraft_mps[time] else { continue };
        // The pixel in the middle of its marker, and the colour that the scale has for the value.
        let found: Value = serde_json::from_str(&tab.text(&format!(
            "(() => {{ const replay = document.querySelector('{HOVER} .replay'); \
             const {{ names, colours, limit }} = updraft.flight('hover'); \
             const one = replay.markers().find((one) => names[one.i] === {}); \
             const near = replay.markers().some((other) => other !== one && \
             Math.hypot(other.at[0] - one.at[0], other.at[1] - one.at[1]) < 12); \
             const canvas = replay.querySelector('canvas'); \
             window.drawn ??= canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height); \
             const from = 4 * (Math.round(one.at[1]) * canvas.width + Math.round(one.at[0])); \
             const pixel = window.drawn.data.slice(from, from + 3); \
             return JSON.stringify({{ near, pixel: [...pixel], limit, colours }}); }})()",
            json!(drone.name)
        )))
        .unwrap();
        if found["near"] == json!(true) {
            continue;
        }
        let colours = found["colours"].as_array().unwrap();
        let place = (value / found["limit"].as_f64().unwrap()).clamp(-1.0, 1.0);
        let step = (f64::midpoint(place, 1.0) * (colours.len() - 1) as f64).round() as usize;
        let hex = colours[step].as_str().unwrap();
        for part in 0..3 {
            let expected = i64::from_str_radix(&hex[1 + 2 * part..3 + 2 * part], 16).unwrap();
            let pixel = found["pixel"][part].as_i64().unwrap();
            assert!(
                (pixel - expected).abs() <= 12,
                "{}: {value:+.3} m/s is {hex}, and drawn {}",
                drone.name,
                found["pixel"]
            );
        }
        seen += 1;
    }
    assert!(seen > 20, "{seen} markers stand alone");
    tab.screenshot(&folder.join("replay.png"));
    // The calibration, which measures no air, is coloured by its climb.
    begun(&mut tab, "#explorer-calibration .replay");
    let climb =
        tab.text("document.querySelector('#explorer-calibration .replay .reading').textContent");
    assert!(climb.contains("climb "), "{climb}");
    tab.finish();
}

#[test]
fn less_motion_dark_colours_and_a_phone_are_respected() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, folder) = report("phone", &traced(whole_campaign()));
    let mut tab = browser.open(&address, [390, 844]);
    both_begun(&mut tab);
    let wide = tab.number("document.documentElement.scrollWidth");
    assert!(wide <= 391.0, "the page scrolls sideways: {wide} px");
    tab.less_motion();
    let before = replay_time(&mut tab);
    tab.press_on(&format!("{HOVER} .replay"), Key::Space);
    tab.sleep_ms(400);
    assert_eq!(replay_time(&mut tab), before, "no movement within the first second");
    tab.wait_for(&format!(
        "Number(document.querySelector('{HOVER} .replay').dataset.time) > {before}"
    ));
    tab.screenshot(&folder.join("replay.png"));
    tab.dark();
    tab.screenshot(&folder.join("dark.png"));
    tab.finish();
}

#[test]
fn of_a_thousand_drones_the_picked_one_comes_from_a_file_beside_the_page() {
    let Some(mut browser) = Browser::start() else { return };
    let (address, folder) = report("crowd", &traced(crowd(whole_campaign(), 1000)));
    let page = std::fs::metadata(folder.join("index.html")).unwrap().len();
    assert!(page < 4_500_000, "the page has {page} bytes");
    let mut tab = browser.open(&address, [1280, 900]);
    both_begun(&mut tab);
    assert_eq!(tab.number("document.querySelectorAll('head script').length"), 0.0);
    let reading = format!("document.querySelector('{HOVER} .series .reading').textContent");
    tab.run("updraft.pick('523')");
    tab.wait_for(&format!("{reading}.includes('(95 %: ')"));
    // At a second that the page itself does not have.
    tab.run("updraft.time('hover', 301, null)");
    let shown = tab.text(&reading);
    assert!(shown.starts_with("301 s: Drone 523: "), "{shown}");
    let fine = tab.number("updraft.flight('hover').fine.get(522).air.times.length");
    assert_eq!(fine, 590.0, "every second of it");
    let coarse = tab.number("updraft.flight('hover').air.times.length");
    assert!(coarse <= 200.0, "{coarse} times of all drones");
    tab.screenshot(&folder.join("page.png"));
    tab.finish();
}

#[test]
fn a_picture_of_the_ground_turns_with_the_grid_and_shows_through() {
    let Some(mut browser) = Browser::start() else { return };
    let mut analysis = traced(whole_campaign());
    // North is 30 degrees left of forward in this show.
    analysis.flights[1].site =
        Some(FlightSite { lat_deg: 47.005, lon_deg: 19.01, ground_amsl_m: None, planned: true });
    // The upper half is red, the lower one blue.
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    let pixels = [255, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0, 255];
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    let corners = Corners::new([47.0045, 19.0092], [47.0055, 19.0108]).unwrap();
    let credit = Some("the surveyor's".to_owned());
    let picture = Basemap::new("field.png", bytes, corners, credit).unwrap();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-explorer").join("ground");
    let beside = Beside { study: None, basemap: Some(&picture) };
    let made = draw(&analysis, beside).page(&analysis, &provenance()).unwrap();
    assert_eq!(made.html.matches("class=\"basemap\"").count(), 1, "once in the page");
    assert!(made.html.contains("The ground is field.png, the surveyor&#x27;s."));
    write(&made, &folder).unwrap();
    let mut tab =
        browser.open(&format!("file://{}", folder.join("index.html").display()), [1280, 900]);
    // Its upper edge, as drawn, points 30 degrees to the left of the sheet's upper edge.
    let edge = "(() => { const m = document.querySelector('image.basemap').transform.baseVal[0].matrix; \
                return Math.atan2(-m.b, m.a) * 180 / Math.PI; })()";
    let turned = tab.number(edge);
    assert!((turned - 30.0).abs() < 0.5, "{turned} degrees");
    let opacity = "Number(getComputedStyle(document.querySelector('#air-1 .drawing g[data-pick] rect')).fillOpacity)";
    assert!((tab.number(opacity) - 0.7).abs() < 1e-6);
    tab.run("document.querySelector('.through input').focus()");
    tab.press(Key::Home);
    assert_eq!(tab.number(opacity), 0.0, "the ground alone");
    tab.screenshot(&folder.join("map.png"));
    begun(&mut tab, ".replay");
    tab.screenshot(&folder.join("replay.png"));
    tab.finish();
}
