//! The report's pages for everybody: read aloud, by keyboard, on a phone, in the dark, on paper.
//!
//! Needs a browser like `browser.rs`.
#![cfg(unix)]

use std::path::Path;

use crate::report::chromium::{Browser, Tab};
use crate::report::synthetic::{posterior, provenance, whole_campaign};
use updraft::analysis::result::Analysis;
use updraft::compare::{LawChoice, Side, compare};
use updraft::report::{
    ComparedFiles, PageLink, Provenance, Report, render, render_comparison, render_gap,
    render_study, write,
};

/// Headings that skip a level, as a list.
const HEADINGS: &str = "(() => { let last = 0; const bad = []; \
    for (const h of document.querySelectorAll('h1,h2,h3,h4,h5,h6')) { const level = Number(h.tagName[1]); \
    if (level > last + 1) bad.push(h.tagName + ' ' + h.textContent); last = level; } \
    return bad.join('; '); })()";

/// What can be focused within a picture, and what can be focused and has no name.
const FOCUS: &str = "(() => { const can = 'a[href],button,input,select,[tabindex]'; \
    const bad = [...document.querySelectorAll('[role=img]')].flatMap((i) => [...i.querySelectorAll(can)]) \
    .map((e) => 'in a picture: ' + e.outerHTML.slice(0, 90)); \
    for (const e of document.querySelectorAll(can)) { \
    const name = e.getAttribute('aria-label') || e.textContent.trim() || e.closest('label')?.textContent.trim(); \
    if (!name) bad.push('no name: ' + e.outerHTML.slice(0, 90)); } \
    return bad.join('; '); })()";

/// Text outside of figures whose colour is closer to its ground than 4.5 to 1.
const CONTRAST: &str = "(() => { \
    const rgba = (text) => { const n = text.match(/[\\d.]+/g).map(Number); return n.length < 4 ? [...n, 1] : n; }; \
    const over = (top, low) => top.slice(0, 3).map((c, i) => c * top[3] + low[i] * (1 - top[3])); \
    const light = (c) => { const [r, g, b] = c.map((v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4); \
    return 0.2126 * r + 0.7152 * g + 0.0722 * b; }; \
    const ground = (e) => { const layers = []; for (; e; e = e.parentElement) layers.push(rgba(getComputedStyle(e).backgroundColor)); \
    return layers.reverse().reduce((low, top) => over(top, low), [255, 255, 255]); }; \
    const bad = new Set(); const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT); \
    for (let t = texts.nextNode(); t; t = texts.nextNode()) { const e = t.parentElement; \
    if (!t.data.trim() || e.closest('svg,script,style,template,noscript') || !e.checkVisibility()) continue; \
    const low = ground(e); const [a, b] = [light(over(rgba(getComputedStyle(e).color), low)), light(low)]; \
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05); \
    if (ratio < 4.5) bad.add(ratio.toFixed(2) + ' ' + e.tagName + '.' + e.className + ' ' + t.data.trim().slice(0, 30)); } \
    return [...bad].join('; '); })()";

/// Elements that reach beyond the right edge of the window, but for what scrolls in a box of its own.
const TOO_WIDE: &str = "(() => { const wide = document.documentElement.clientWidth; \
    return [...document.body.querySelectorAll('*')].filter((e) => e.checkVisibility() && !e.closest('svg *, nav *') \
    && e.getBoundingClientRect().right > wide + 1 && !e.parentElement.closest('.scroll, .drawing')) \
    .map((e) => e.tagName + '.' + e.className).slice(0, 5).join('; '); })()";

/// Elements that are cut off or reach beyond the paper: on it nothing scrolls.
const OFF_PAPER: &str = "(() => { const wide = document.documentElement.clientWidth; \
    return [...document.body.querySelectorAll('*')].filter((e) => e.checkVisibility() && !e.closest('svg *') \
    && e.getBoundingClientRect().right > wide + 1) \
    .map((e) => e.tagName + '.' + e.className + ' ' + Math.round(e.getBoundingClientRect().right)).slice(0, 5).join('; '); })()";

fn linked(provenance: Provenance) -> Provenance {
    let links = vec![
        PageLink::there("All numbers of this page", "../analysis.json"),
        PageLink::made_by("The comparison", "../gap/report/index.html", "updraft gap my-campaign"),
    ];
    Provenance { links, analysis_sha256: Some("ab".repeat(32)), ..provenance }
}

/// Two campaigns side by side, the second with a weak drone.
fn comparison() -> Report {
    let side = |id: &str, analysis| Side {
        id: id.to_owned(),
        path: id.to_owned(),
        analysis,
        facts: Vec::new(),
    };
    let title = "The same fleet a day later".to_owned();
    let mut later = Analysis { title, ..whole_campaign() };
    let weak = later.flights[0].drones.get_mut(4).and_then(|drone| drone.laws.as_mut());
    let linear = weak.and_then(|laws| laws.linear.as_mut()).expect("a drone with a law");
    linear.parameters[1].estimate.value += 90.0;
    let sides = [side("monday", whole_campaign()), side("tuesday", later)];
    let found = compare(&sides, LawChoice::default(), "updraft").expect("a comparison");
    let files = ComparedFiles {
        links: vec![PageLink::there("Its report", "../../monday/report/index.html")],
        circumstances: vec!["calibration: 2026-06-01 12:00:00 UTC".to_owned()],
    };
    render_comparison(&found, &provenance(), &[files.clone(), files]).expect("a page")
}

/// A simulation study of a few flights.
fn study() -> Report {
    let folder = tempfile::tempdir().expect("a folder");
    let found = crate::study::support::result(&crate::study::support::small(), folder.path());
    render_study(&found, &linked(provenance())).expect("a page")
}

/// Every page that is looked at, with its name and its address.
fn pages() -> Vec<(&'static str, String)> {
    let made: [(&str, Report); 4] = [
        ("compare", comparison()),
        ("study", study()),
        ("report", render(&posterior(whole_campaign()), &linked(provenance())).expect("a report")),
        (
            "gap",
            render_gap(
                &crate::report::verdicts::class(),
                &linked(crate::report::verdicts::provenance()),
            )
            .expect("a page"),
        ),
    ];
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report-access");
    made.into_iter()
        .map(|(name, report)| {
            let folder = folder.join(name);
            write(&report, &folder).expect("written");
            (name, format!("file://{}", folder.join("index.html").display()))
        })
        .collect()
}

fn nothing(tab: &mut Tab<'_>, page: &str, what: &str, found_by: &str) {
    let found = tab.text(found_by);
    assert!(found.is_empty(), "{page}: {what}: {found}");
}

/// Unfolds all that is folded: what is hidden has no colours and no width.
const UNFOLD: &str = "document.querySelectorAll('details').forEach((d) => { d.open = true; })";

#[test]
fn headings_are_in_order_and_whatever_has_the_focus_has_a_name() {
    let Some(mut browser) = Browser::start() else { return };
    for (name, address) in pages() {
        let mut tab = browser.open(&address, [1280, 900]);
        nothing(&mut tab, name, "a heading skips a level", HEADINGS);
        nothing(&mut tab, name, "focus", FOCUS);
        tab.finish();
    }
}

#[test]
fn text_is_readable_in_light_and_dark() {
    let Some(mut browser) = Browser::start() else { return };
    for (name, address) in pages() {
        let mut tab = browser.open(&address, [1280, 900]);
        tab.run(UNFOLD);
        nothing(&mut tab, name, "too little contrast", CONTRAST);
        tab.dark();
        let ground = tab.text("getComputedStyle(document.body).backgroundColor");
        assert!(ground != "rgb(255, 255, 255)", "{name}: the dark page is white");
        nothing(&mut tab, name, "too little contrast in the dark", CONTRAST);
        tab.finish();
    }
}

#[test]
fn a_phone_scrolls_down_only() {
    let Some(mut browser) = Browser::start() else { return };
    for (name, address) in pages() {
        let mut tab = browser.open(&address, [390, 844]);
        tab.run(UNFOLD);
        let wide = tab.number("document.documentElement.scrollWidth");
        assert!(wide <= 391.0, "{name} scrolls sideways: {wide} px");
        nothing(&mut tab, name, "beyond the edge", TOO_WIDE);
        tab.finish();
    }
}

#[test]
fn paper_holds_everything() {
    let Some(mut browser) = Browser::start() else { return };
    for (name, address) in pages() {
        // Inside of the margins: Letter and A4 at 96 pixels an inch.
        for (paper, width) in [("Letter", 710), ("A4", 688)] {
            let mut tab = browser.open(&address, [width, 900]);
            tab.print_media();
            let page = format!("{name} on {paper}");
            nothing(&mut tab, &page, "beyond the paper", OFF_PAPER);
            let bars = "[...document.querySelectorAll('*')].filter((e) => e.checkVisibility() && \
                        ['sticky', 'fixed'].includes(getComputedStyle(e).position)).length";
            assert_eq!(tab.number(bars), 0.0, "{page}: a bar sticks");
            tab.finish();
        }
    }
}

#[test]
fn a_clicked_drone_is_not_under_the_bar() {
    let Some(mut browser) = Browser::start() else { return };
    let pages = pages();
    let (_, address) = pages.iter().find(|(name, _)| *name == "report").expect("a report");
    let mut tab = browser.open(address, [700, 900]);
    tab.less_motion();
    tab.click_on("a[data-drone$='drone-17']");
    tab.wait_for("document.querySelector('.gallery').getBoundingClientRect().top < 300");
    let gap = tab.number(
        "document.querySelector('.gallery').getBoundingClientRect().top - \
         document.querySelector('nav').getBoundingClientRect().bottom",
    );
    assert!(gap >= -1.0, "the drone begins {} px under the bar", -gap);
    let label = tab.text("document.querySelector('.gallery figcaption b').textContent");
    assert!(label.starts_with("Figure 3-calibration-16-drone-17. "), "{label}");
    // With the slider in hand, too, Page keys step by ten.
    tab.run("document.querySelector('.film input[type=range]').focus()");
    tab.press(crate::report::chromium::Key::PageDown);
    assert_eq!(tab.number("Number(document.querySelector('.film').dataset.frame)"), 10.0);
    tab.finish();
}
