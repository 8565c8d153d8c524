//! What the page and the terminal say of a verdict.

use crate::report::verdicts::{class, named, nothing, provenance, sensor, unknown};
use updraft::gap::verdict::{Drones, Finding, Gap, SensorChannel};
use updraft::gap::{Dependence, LeftOut, Verdict, Warning};
use updraft::report::{gap_summary, render_gap};

fn all() -> [Verdict; 5] {
    [nothing(), named(), class(), unknown(), sensor()]
}

fn page(verdict: &Verdict) -> String {
    render_gap(verdict, &provenance()).expect("a page").html
}

/// A section of the page without its figures.
fn section(html: &str, id: &str) -> String {
    let start = html.find(&format!("<section id=\"{id}\"")).expect(id);
    let rest = &html[start..];
    let end = rest.find("</section>").expect("its end");
    let mut text = rest[..end].replace("&#x2f;", "/");
    while let (Some(from), Some(to)) = (text.find("<svg"), text.find("</svg>")) {
        text.replace_range(from..to + "</svg>".len(), "");
    }
    text
}

#[test]
fn the_terminal_says_that_nothing_is_missing() {
    insta::assert_snapshot!(gap_summary(&nothing(), 100, false));
}

#[test]
fn the_terminal_names_an_effect() {
    insta::assert_snapshot!(gap_summary(&named(), 100, false));
}

#[test]
fn the_terminal_names_a_class() {
    insta::assert_snapshot!(gap_summary(&class(), 100, false));
}

#[test]
fn the_terminal_shows_what_is_unknown() {
    insta::assert_snapshot!(gap_summary(&unknown(), 100, false));
}

#[test]
fn the_terminal_names_the_sensor() {
    insta::assert_snapshot!(gap_summary(&sensor(), 100, false));
}

#[test]
fn the_terminal_tells_the_updraft_that_was_found() {
    let mut verdict = named();
    verdict.noise.updraft_mps = -0.98;
    let told = gap_summary(&verdict, 100, false);
    assert!(told.contains("uniform updraft of −0.98 m/s"), "{told}");
    verdict.noise.updraft_mps = 0.0;
    assert!(!gap_summary(&verdict, 100, false).contains("uniform updraft"));
}

#[test]
fn no_line_is_wider_than_the_terminal() {
    for verdict in all() {
        for width in [40, 64, 80, 100, 140] {
            for line in gap_summary(&verdict, width, false).lines() {
                assert!(line.chars().count() <= width, "{width}: {line}");
            }
        }
    }
}

#[test]
fn colour_only_adds_escapes() {
    let plain = gap_summary(&class(), 100, false);
    let coloured = gap_summary(&class(), 100, true);
    assert!(!plain.contains('\u{1b}') && coloured.contains('\u{1b}'));
    let mut bare = coloured;
    for escape in ["\u{1b}[1m", "\u{1b}[2m", "\u{1b}[33m", "\u{1b}[0m"] {
        bare = bare.replace(escape, "");
    }
    assert_eq!(bare, plain);
}

#[test]
fn the_page_has_its_sections_and_figures() {
    for verdict in all() {
        let made = render_gap(&verdict, &provenance()).expect("a page");
        for id in [
            "map",
            "ladder",
            "steps",
            "gap",
            "sensor",
            "undetectable",
            "drones",
            "noise",
            "method",
            "provenance",
        ] {
            assert!(made.html.contains(&format!("<section id=\"{id}\">")), "{id}");
            assert!(made.html.contains(&format!("href=\"#{id}\"")), "no way to {id}");
        }
        let names: Vec<&str> = made.figures.iter().map(|(name, _)| name.as_str()).collect();
        let mut expected = vec!["gap-map".to_owned(), "gap-ladder".to_owned()];
        expected.extend((1..=verdict.steps.len()).map(|step| format!("gap-step-{step}")));
        if !verdict.drones.each.is_empty() {
            expected.push("gap-drones".to_owned());
        }
        assert_eq!(names, expected);
        assert!(
            made.figures.iter().all(|(_, svg)| svg.starts_with("<svg") && !svg.contains("NaN"))
        );
    }
}

#[test]
fn equal_verdicts_make_equal_pages() {
    for verdict in all() {
        let twice = [(); 2].map(|()| render_gap(&verdict, &provenance()).expect("a page"));
        assert!(twice[0] == twice[1]);
    }
}

#[test]
fn steps_say_what_they_are() {
    let one = section(&page(&named()), "steps");
    for words in [
        "Step 1: Rotor inflow",
        "The model did not have this effect.",
        "<code>inflow_share</code>",
        "0.390 to 0.406",
        "not in the model",
        "Leishman",
        "would gain 2.3 nats, 8.0 are needed",
    ] {
        assert!(one.contains(words), "{words}: {one}");
    }
    let two = section(&page(&class()), "steps");
    for words in [
        "One of these 2 is missing",
        "(<code>thrust-curve</code>)",
        "(<code>parasitic-drag</code>)",
        "The model had this effect, with another size.",
    ] {
        assert!(two.contains(words), "{words}: {two}");
    }
    let three = section(&page(&unknown()), "steps");
    for words in [
        "Something unknown that depends on height",
        "It is about 4.00 sin(2 pi h/31.2 + 0.10) µs (h: the height in m).",
    ] {
        assert!(three.contains(words), "{words}: {three}");
    }
    let kept = "What is unknown is not in the model";
    assert!(page(&unknown()).contains(kept) && !page(&named()).contains(kept));
    assert!(section(&page(&nothing()), "steps").contains("Nothing. What the model leaves"));
    assert!(section(&page(&unknown()), "drones").contains("no offsets of single drones"));
}

#[test]
fn what_cannot_be_seen_comes_first() {
    let text = section(&page(&nothing()), "undetectable");
    let place = |words: &str| text.find(words).unwrap_or_else(|| panic!("{words}: {text}"));
    let order = [
        "<b>ground-effect</b>",
        "<b>blade-flapping</b>",
        "Would have been seen",
        "<td>rotor-inflow</td>",
        "<td>battery</td>",
        "Not searched for",
        "<dt>mass-spread</dt>",
    ];
    assert!(order.windows(2).all(|pair| place(pair[0]) < place(pair[1])), "{text}");
    assert!(text.contains("translational-lift") && text.contains("larger ones are seen"));
}

#[test]
fn the_velocity_is_named_where_it_is_off() {
    let off = section(&page(&sensor()), "sensor");
    for words in ["velocity-error", "0.1120 (0.1080 to 0.1160) m/s", "slot 3: −0.310 m/s"] {
        assert!(off.contains(words), "{words}: {off}");
    }
    assert!(section(&page(&nothing()), "sensor").contains("agrees with the rate of change"));
}

#[test]
fn hostile_words_and_numbers_do_no_harm() {
    let bad = "<script>alert(1)</script>\u{1b}[2J$x$";
    let mut verdict = unknown();
    verdict.vehicle = bad.to_owned();
    verdict.summary = bad.to_owned();
    verdict.cautions = vec![Warning::Said(bad.to_owned())];
    verdict.data.left_out = vec![LeftOut::Said(bad.to_owned())];
    verdict.data.groups = vec![(bad.to_owned(), 3)];
    verdict.rest.candidate = bad.to_owned();
    verdict.steps[0].finding =
        Finding::Unknown { depends_on: Dependence::Height, formula: Some(bad.to_owned()) };
    verdict.steps[0].rivals[0].name = bad.to_owned();
    verdict.steps[0].rivals[0].gain_nats = f64::NAN;
    verdict.steps[0].threshold_nats = f64::NAN;
    for one in &mut verdict.detectable {
        one.effect = bad.to_owned();
        one.usual = f64::NAN;
        one.usual_z = f64::INFINITY;
    }
    for regime in &mut verdict.regimes {
        regime.label = bad.to_owned();
        regime.before_us = (f64::NAN, f64::INFINITY);
        regime.x = if regime.x > 3.0 { f64::NAN } else { regime.x };
    }
    for rung in &mut verdict.ladder {
        rung.measured_us = f64::NAN;
    }
    let made = render_gap(&verdict, &provenance()).expect("a page");
    let svgs = made.figures.iter().map(|(_, svg)| svg);
    for text in std::iter::once(&made.html).chain(svgs) {
        assert!(!text.contains("<script") && !text.contains('\u{1b}'), "it got through");
        assert!(!text.contains("=\"NaN") && !text.contains("=\"inf"), "no number for a drawing");
    }
    assert!(!gap_summary(&verdict, 100, false).contains('\u{1b}'));
}

#[test]
fn an_empty_verdict_still_has_a_page() {
    let mut verdict = nothing();
    verdict.regimes.clear();
    verdict.ladder.clear();
    verdict.detectable.clear();
    verdict.drones = Drones::default();
    verdict.gap = Gap::default();
    verdict.sensor = SensorChannel::default();
    let html = page(&verdict);
    for words in [
        "no residuals by regime",
        "No steady climb",
        "Nothing could be held out",
        "could not be compared in these logs",
    ] {
        assert!(html.contains(words), "{words}");
    }
}
