//! The report from a synthetic campaign: whole, self-contained, safe, repeatable.

use std::path::Path;

use crate::report::synthetic::{
    calibration, campaign, posterior, provenance, updraft_series, whole_campaign,
};
use updraft::analysis::law::Symbol;
use updraft::analysis::result::{Analysis, TableRow};
use updraft::analysis::table::{Quantity, TableLaw};
use updraft::analysis::{Cause, Warning};
use updraft::base::estimate::Estimate;
use updraft::report::{Report, render, terminal_summary, write};

fn made(analysis: &Analysis) -> Report {
    let report = render(analysis, &provenance()).expect("a report");
    for (name, svg) in &report.figures {
        assert_well_formed(name, svg);
    }
    report
}

fn empty() -> Analysis {
    Analysis { flights: Vec::new(), warnings: Vec::new(), ..campaign() }
}

/// A small XML check: tags nest, attributes are quoted, text has no bare `<` or `&`.
fn assert_well_formed(name: &str, xml: &str) {
    assert!(xml.starts_with("<svg "), "{name} does not start with <svg");
    let mut open: Vec<&str> = Vec::new();
    let mut rest = xml;
    while let Some(at) = rest.find('<') {
        assert_entities(name, &rest[..at]);
        rest = &rest[at + 1..];
        if let Some(comment) = rest.strip_prefix("!--") {
            rest = &comment[comment.find("-->").expect("a comment ends") + 3..];
            continue;
        }
        let end = rest.find('>').unwrap_or_else(|| panic!("{name}: a tag does not end"));
        let tag = &rest[..end];
        rest = &rest[end + 1..];
        assert!(!tag.contains('<'), "{name}: < in the tag {tag:?}");
        assert_eq!(tag.matches('"').count() % 2, 0, "{name}: open quote in {tag:?}");
        assert_entities(name, tag);
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closed), "{name}: wrong end");
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().expect("a name"));
        }
    }
    assert!(open.is_empty(), "{name}: {open:?} not closed");
    assert!(
        !xml.chars().any(|c| c.is_control() && !c.is_whitespace()),
        "{name}: control character"
    );
    // Pictures are base64, which may spell anything.
    let drawn: String = xml
        .split("base64,")
        .map(|part| part.split_once('"').map_or(part, |(_, rest)| rest))
        .collect();
    for nonsense in ["NaN", "\"inf", "\"-inf"] {
        assert!(!drawn.contains(nonsense), "{name} contains {nonsense}");
    }
}

fn assert_entities(name: &str, text: &str) {
    for after in text.split('&').skip(1) {
        let entity = after.split(';').next().expect("a part");
        let known = ["amp", "lt", "gt", "quot", "apos", "#39"];
        assert!(known.contains(&entity), "{name}: bare & before {after:.20}");
    }
}

#[test]
fn is_written_with_all_figures() {
    for (name, analysis) in [("campaign", campaign()), ("series", updraft_series())] {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report").join(name);
        let report = made(&analysis);
        write(&report, &folder).unwrap();
        assert!(std::fs::read_to_string(folder.join("index.html")).unwrap() == report.html);
        let mut names: Vec<&String> = report.figures.iter().map(|(name, _)| name).collect();
        for (name, svg) in &report.figures {
            let path = folder.join("figures").join(format!("{name}.svg"));
            assert!(&std::fs::read_to_string(&path).unwrap() == svg, "{path:?} is another figure");
        }
        names.sort();
        names.dedup();
        assert_eq!(names.len(), report.figures.len(), "figures share a name");
    }
}

#[test]
fn the_campaign_has_every_figure_and_number() {
    let report = made(&campaign());
    let names: Vec<&str> = report.figures.iter().map(|(name, _)| name.as_str()).collect();
    for name in ["fig2-laws", "map-hover", "fig4-calibration", "fig5-hover", "air-hover"] {
        assert!(names.contains(&name), "{name} is missing in {names:?}");
    }
    assert_eq!(names.iter().filter(|name| name.starts_with("fig3-calibration-")).count(), 45);
    let page = report.html.replace("&#x2f;", "/");
    for text in [
        "8.207 ± 0.020",
        "45/49",
        "the log ends 41 s before take-off",
        "02020202",
        "--seed 2024",
        "2026-11-20 12:00 UTC",
        "+0.699",
    ] {
        assert!(page.contains(text), "the page lacks {text:?}");
    }
    assert!(report.html.len() < 4_000_000, "{} bytes", report.html.len());
}

#[test]
fn a_field_campaign_has_the_papers_figures_with_honest_errors() {
    let report = made(&whole_campaign());
    let names: Vec<&str> = report.figures.iter().map(|(name, _)| name.as_str()).collect();
    for name in ["fig4-calibration", "fig5-hover", "fig6-hover", "averaging-hover"] {
        assert!(names.contains(&name), "{name} is missing in {names:?}");
    }
    let page = report.html.replace("&#x2f;", "/");
    for text in [
        // The scale with the paper's error, the honest interval, the bias and the paper's value.
        "<td class=\"n strong\">98.2</td><td class=\"n\">± 2.95</td><td class=\"n strong\">39.3 to 403</td>\
         <td>54.0 (19.6 to 157) where 98.2 is true</td><td class=\"n paper\">145.4 ± 3.0</td>",
        "A grid of 42 m reads half of a true length of 145 m.",
        "95.3 % of the true values lie inside their 95 % intervals",
        "known to ± 0.27 m/s (95 %)",
        "6.61 V, below 3.35 V for each cell",
        "<td>kept</td>",
    ] {
        assert!(page.contains(text), "the page lacks {text:?}");
    }
    let fleet = &report.figures.iter().find(|(name, _)| name == "fig4-calibration").unwrap().1;
    assert_eq!(fleet.matches("<a href=\"fig3-calibration-").count(), 45, "each drone is a link");
    assert_eq!(fleet.matches("no log</text>").count(), 4);
    assert!(report.html.contains("<a href=\"figures/fig3-calibration-1-drone-1.svg\""));
}

#[test]
fn beside_the_scales_of_a_posterior_there_are_no_others() {
    let mut analysis = posterior(whole_campaign());
    let told = |analysis: &Analysis| {
        let terminal = terminal_summary(analysis, 200, false);
        (made(analysis).html.replace("&#x2f;", "/"), terminal)
    };
    // As of the values alone: 98.2 m (95 %: 39.3 to 403 m), and how they differ by direction.
    let (page, terminal) = told(&analysis);
    assert!(page.contains("39.3 to 403") && page.contains("along x and y differ"));
    assert!(terminal.contains("correlation length λ 98.2 m (95 %: 39.3 to 403 m"), "{terminal}");
    let found = analysis.flights[1].map.as_mut().unwrap().posterior.as_mut().unwrap();
    found.no_scales = Some("a passing thermal has no correlation length".to_owned());
    let (page, terminal) = told(&analysis);
    for said in [&page, &terminal] {
        assert!(said.contains("a passing thermal has no correlation length"), "{said}");
        for other in ["39.3 to 403", "along x and y differ", "made by the length"] {
            assert!(!said.contains(other), "{other} beside the posterior's scales");
        }
        assert!(said.contains("analysis.json"), "where the others are");
    }
    assert!(!terminal.contains("correlation length λ"), "{terminal}");
    let figure = made(&analysis);
    let figure = figure.figures.iter().find(|(name, _)| name == "fig6-hover").unwrap();
    assert!(figure.1.contains("curve fit for λx"), "the curves are still drawn");
    // What is no scale of the air stays.
    assert!(page.contains("2.4 ± 0.2 m/s from 240°"), "the wind");
}

#[test]
fn what_a_posterior_shows_is_not_called_an_estimate_of_single_drones() {
    let report = made(&posterior(whole_campaign()));
    let page = report.html.replace("&#x2f;", "/");
    assert!(page.contains("estimated − true W (m/s)") && page.contains("Posterior W − W"));
    assert!(!page.contains(">W* − W (m/s)<") && !page.contains(">W* and W (m/s, up positive)<"));
    // The lost drone's square has its error, and is counted as what it is.
    let (_, figure) = report.figures.iter().find(|(name, _)| name == "posterior-hover").unwrap();
    assert!(figure.contains("0.25 ± 0.10") && figure.contains("by its neighbours"));
    assert!(!figure.contains(">no log<"), "the error of a filled square stands there");
    assert!(page.contains("drones and each of 1 place without a log: the mean"), "its caption");
    // Each drone alone is as it was.
    let page = made(&whole_campaign()).html.replace("&#x2f;", "/");
    assert!(page.contains(">W* − W (m/s)<") && page.contains(">W* and W (m/s, up positive)<"));
}

#[test]
fn the_film_holds_every_value_and_stays_small() {
    let analysis = campaign();
    let map = analysis.flights[1].map.as_ref().unwrap();
    let data = |html: &str| -> serde_json::Value {
        let from = html.find("<script type=\"application/json\">").expect("a film") + 32;
        let text = html[from..].split("</script>").next().unwrap();
        serde_json::from_str(text).unwrap()
    };
    let film = data(&made(&analysis).html);
    let times: Vec<f64> = serde_json::from_value(film["times"].clone()).unwrap();
    assert_eq!(times, map.time_s);
    let bytes = base64::engine::Engine::decode(
        &base64::engine::general_purpose::STANDARD,
        film["estimate"].as_str().unwrap(),
    )
    .unwrap();
    assert_eq!(bytes.len(), 2 * map.drones.len() * map.time_s.len());
    for (time, drone) in [(0, 0), (17, 3), (400, 16), (589, 41)] {
        let at = 2 * (time * map.drones.len() + drone);
        let found = i16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let expected = map.drones[drone].updraft_mps[time].map(|mps| (1000.0 * mps).round() as i16);
        assert_eq!(found, expected.unwrap_or(i16::MIN), "time {time}, drone {drone}");
    }

    // A thousand drones: thinned in time, not in drones.
    let mut big = analysis.clone();
    let few = map.drones.clone();
    big.flights[1].map.as_mut().unwrap().drones = (0..1000_u16)
        .map(|i| {
            let mut drone = few[usize::from(i) % few.len()].clone();
            drone.slot = Some(i + 1);
            drone.position_m = Some([f64::from(i / 32) * 7.0, f64::from(i % 32) * 7.0]);
            drone
        })
        .collect();
    let html = made(&big).html;
    let film = data(&html);
    assert_eq!(film["places"].as_array().unwrap().len(), 1000);
    assert!((100..=200).contains(&film["times"].as_array().unwrap().len()));
    assert!(film.to_string().len() < 1_300_000, "{} bytes", film.to_string().len());
}

#[test]
fn the_page_loads_nothing_from_anywhere() {
    let report = made(&whole_campaign());
    let others = report.figures.iter().map(|(_, svg)| svg).chain([&report.html]);
    for text in others {
        let text = text.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        for load in ["http:", "https:", "@import", "<iframe", "<img", "<link rel=\"style", "src="] {
            assert!(!text.contains(load), "{load} in the report");
        }
    }
}

#[test]
fn is_the_same_on_repeat_and_in_other_threads() {
    let first = made(&campaign());
    let others: Vec<Report> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..3).map(|_| scope.spawn(|| made(&campaign()))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for other in others {
        assert!(other == first, "a repeat differs");
    }
}

#[test]
fn hostile_text_stays_text() {
    const EVIL: &str = "\"><script>alert(1)</script>&'$x^2$ \u{1b}[31m\0</title>";
    let mut analysis = campaign();
    analysis.title = EVIL.to_owned();
    analysis.made_by = EVIL.to_owned();
    analysis.warnings.push(Warning::Said(EVIL.to_owned()));
    for flight in &mut analysis.flights {
        flight.name = EVIL.to_owned();
        flight.missing[0].reason = Cause::Said(EVIL.to_owned());
        for drone in &mut flight.drones {
            drone.name = EVIL.to_owned();
            drone.warnings.push(Warning::Said(EVIL.to_owned()));
        }
        for row in &mut flight.table {
            row.unit = EVIL.to_owned();
        }
        if let Some(map) = &mut flight.map {
            for drone in &mut map.drones {
                drone.name = EVIL.to_owned();
            }
        }
    }
    let mut origin = provenance();
    origin.command = EVIL.to_owned();
    origin.inputs[0].path = EVIL.to_owned();
    let report = render(&analysis, &origin).unwrap();
    assert_eq!(report.html.matches("<script>").count(), 1, "only our own script");
    for (name, svg) in &report.figures {
        assert_well_formed(name, svg);
        assert!(!svg.contains("<script"), "{name}");
        assert!(
            name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-'),
            "{name} is no plain file name"
        );
    }
    let summary = terminal_summary(&analysis, 100, false);
    assert!(!summary.contains('\u{1b}') && !summary.contains('\0'));
}

#[test]
fn nothing_is_said_to_be_nothing() {
    let report = made(&empty());
    assert!(report.figures.is_empty());
    assert!(report.html.contains("There is no flight in this analysis."));

    let mut flight = calibration("calibration", 1, 0.0, &[]);
    flight.drones.clear();
    flight.flock = None;
    let report = made(&Analysis { flights: vec![flight], ..empty() });
    assert!(report.html.contains("No drone of this flight could be analysed."));
    assert!(report.html.contains("no law is shown"));
}

#[test]
fn one_drone_without_a_fit_is_drawn() {
    let mut flight = calibration("single", 1, 0.0, &[]);
    flight.planned = false;
    flight.true_updraft_mps = None;
    flight.drones[0].laws = None;
    flight.drones[0].slot = None;
    let report = made(&Analysis { flights: vec![flight], ..empty() });
    let names: Vec<&str> = report.figures.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["fig2-laws", "fig3-single-1-drone-1"]);
    assert!(report.html.contains("windows taken from the log itself"));
}

#[test]
fn numbers_that_are_none_do_no_harm() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e-300] {
        let mut analysis = campaign();
        for flight in &mut analysis.flights {
            flight.true_updraft_mps = Some(bad);
            flight.table.push(TableRow {
                law: TableLaw::Linear,
                parameter: Quantity::Parameter(Symbol::Slope),
                unit: String::new(),
                mean: bad,
                sd: bad,
                mean_se: bad,
                n: 3,
                paper: Some(Estimate::new(bad, bad)),
                not_compared: None,
            });
            for (index, drone) in flight.drones.iter_mut().enumerate() {
                for window in &mut drone.windows {
                    window.velocity_mps.sd = bad;
                    if index % 2 == 0 {
                        window.effort_phi.median = bad;
                        window.start_s = bad;
                        window.offset_us = Some(bad);
                    }
                }
                for fit in drone.laws.iter_mut().flat_map(|laws| &mut laws.signed_quadratic) {
                    fit.chi2_reduced = Some(bad);
                    fit.parameters[index % 3].estimate = Estimate::new(bad, bad);
                }
                for height in drone.trace.height_m.iter_mut().step_by(7) {
                    *height = bad;
                }
                drone.trace.velocity_mps.truncate(13);
                drone.home_m = Some([bad, bad]);
            }
            if let Some(map) = &mut flight.map {
                map.time_s[17] = bad;
                for (index, drone) in map.drones.iter_mut().enumerate() {
                    drone.updraft_mps[5] = Some(bad);
                    match index % 4 {
                        0 => drone.mean = Estimate::new(bad, 0.1),
                        1 => drone.mean.se = bad,
                        2 => drone.position_m = Some([bad, 0.0]),
                        _ => drone.truth_mps = Some(vec![Some(bad); 3]),
                    }
                }
            }
        }
        let report = made(&analysis);
        assert!(report.figures.len() > 40, "{bad}: {}", report.figures.len());
        for width in [0, 40, 200] {
            assert!(!terminal_summary(&analysis, width, true).is_empty());
        }
    }
}

#[test]
fn a_big_fleet_stays_readable_for_a_browser() {
    let mut analysis = campaign();
    let drones = analysis.flights[0].drones.clone();
    for copy in 1..4 {
        analysis.flights[0].drones.extend(drones.iter().cloned().map(|mut drone| {
            drone.slot = drone.slot.map(|slot| slot + 100 * copy);
            drone
        }));
    }
    let report = made(&analysis);
    assert!(report.html.len() < 4_000_000, "{} bytes", report.html.len());
    assert!(report.html.contains("more are only in the folder"));
    let drawn = report.figures.iter().filter(|(name, _)| name.starts_with("fig3-")).count();
    assert_eq!(drawn, 180);
}

#[test]
fn dollars_in_names_are_no_mathematics() {
    let flights = ["$x^2$ a", "$x^2$ b"].map(|name| {
        let mut flight = calibration(name, 1, 0.0, &[]);
        flight.true_updraft_mps = None;
        flight
    });
    let report = made(&Analysis { flights: flights.into(), ..empty() });
    let (_, laws) = &report.figures[0];
    assert!(laws.contains(">$x^2$ a</text>"), "the legend changed the name");
}
