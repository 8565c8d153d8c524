//! Figures for papers: what other programs get of them, and whether they can be read at their size.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;
use std::sync::{LazyLock, Mutex, PoisonError};

use usvg::{Group, Node, Options, Rect, Tree};

use crate::report::synthetic::{posterior, provenance, updraft_series, whole_campaign};
use crate::report::verdicts::{class, named};
use updraft::analysis::result::Analysis;
use updraft::report::paper::{Drawn, PaperFigure, of_analysis, of_verdict};
use updraft::report::{Beside, render};

const WIDTHS_MM: [f64; 3] = [83.0, 130.0, 171.0];
/// Least size of text that journals ask for, points.
const LEAST_PT: f64 = 6.5;
/// Points in a millimetre.
const PT: f64 = 72.0 / 25.4;

type Finished = Vec<(String, PaperFigure)>;

/// Every figure of every kind of page at a width; of the figures of single drones the first of each flight.
fn drawn(width_mm: f64) -> Vec<Drawn> {
    let campaigns = [posterior(whole_campaign()), updraft_series()];
    let of = |analysis: &Analysis| of_analysis(analysis, Beside::default(), width_mm);
    let verdicts = [named(), class()];
    let gaps = verdicts.iter().flat_map(|verdict| of_verdict(verdict, width_mm));
    let mut drawn: Vec<Drawn> = campaigns.iter().flat_map(of).chain(gaps).collect();
    drawn.retain(|one| !one.name.starts_with("fig3") || one.name.contains("-1-"));
    drawn
}

fn finish(width_mm: f64) -> Finished {
    let finish = |drawn: Drawn| Some((drawn.name.clone(), drawn.finish().expect("a figure")?));
    drawn(width_mm).into_iter().filter_map(finish).collect()
}

/// The same, made once.
fn finished(width_mm: f64) -> Finished {
    static MADE: LazyLock<Mutex<BTreeMap<u64, Finished>>> = LazyLock::new(Mutex::default);
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(width_mm.to_bits()).or_insert_with(|| finish(width_mm)).clone()
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let (_, rest) = tag.split_once(&format!(" {name}=\"")).expect(name);
    rest.split('"').next().expect("a value")
}

fn tree(svg: &str) -> Tree {
    let mut options =
        Options { dpi: 72.0, font_family: "Noto Sans".to_owned(), ..Options::default() };
    let fonts = options.fontdb_mut();
    for weight in ["Regular", "Bold"] {
        let path =
            format!("{}/templates/report/vendor/NotoSans/{weight}.ttf", env!("CARGO_MANIFEST_DIR"));
        fonts.load_font_file(path).expect("the font");
    }
    Tree::from_str(svg, &options).expect("SVG")
}

/// The outlines of all texts, with the text.
fn texts(group: &Group, into: &mut Vec<(String, Rect)>) {
    for node in group.children() {
        match node {
            Node::Group(group) => texts(group, into),
            Node::Text(text) => {
                let words = text.chunks().iter().map(|chunk| chunk.text()).collect();
                into.push((words, text.flattened().abs_bounding_box()));
            }
            _ => {}
        }
    }
}

#[test]
fn they_are_the_figures_of_the_report() {
    let analysis = posterior(whole_campaign());
    let report = render(&analysis, &provenance()).expect("a report");
    let names = |names: Vec<&String>| names.into_iter().cloned().collect::<Vec<_>>();
    let printed = of_analysis(&analysis, Beside::default(), 171.0);
    assert_eq!(
        names(printed.iter().map(|drawn| &drawn.name).collect()),
        names(report.figures.iter().map(|(name, _)| name).collect())
    );
}

#[test]
fn an_svg_is_plain_and_has_its_width_and_its_font() {
    for width_mm in WIDTHS_MM {
        for (name, figure) in finished(width_mm) {
            let svg = &figure.svg;
            let head = svg.split('>').next().expect("a head");
            assert_eq!(attribute(head, "width"), format!("{width_mm}mm"), "{name}");
            assert!(attribute(head, "height").ends_with("mm"), "{name}");
            assert!(
                svg.contains("@font-face") && svg.contains("data:font/woff2;base64,"),
                "{name}"
            );
            for foreign in [
                "var(--",
                "<script",
                "class=",
                "data-",
                "<a ",
                "aria-",
                "prefers-color",
                "transparent",
            ] {
                let beyond = svg.replace("data:", "").replace("data-uri", "");
                assert!(!beyond.contains(foreign), "{name}: {foreign}");
            }
            tree(svg);
        }
    }
}

#[test]
fn text_is_large_enough_and_none_is_cut_off_or_over_another() {
    for width_mm in WIDTHS_MM {
        for (name, figure) in finished(width_mm) {
            let name = format!("{name} at {width_mm} mm");
            let head = figure.svg.split('>').next().expect("a head");
            let across: f64 =
                attribute(head, "viewBox").split(' ').nth(2).expect("a width").parse().expect("it");
            for tag in figure.svg.split('<').filter(|tag| tag.starts_with("text ")) {
                let size: f64 = attribute(tag, "font-size").parse().expect("a size");
                let points = size * width_mm * PT / across;
                assert!(points >= LEAST_PT, "{name}: {points:.2} points in {tag}");
            }
            let tree = tree(&figure.svg);
            let mut all = Vec::new();
            texts(tree.root(), &mut all);
            assert!(!all.is_empty(), "{name}");
            let (wide, high) = (tree.size().width(), tree.size().height());
            for (index, (words, at)) in all.iter().enumerate() {
                let inside = at.left() >= 0.0
                    && at.top() >= 0.0
                    && at.right() <= wide
                    && at.bottom() <= high;
                assert!(inside, "{name}: {words:?} is cut off: {at:?} of {wide} x {high}");
                for (other, beside) in all.iter().skip(index + 1) {
                    let over = at.left() < beside.right()
                        && beside.left() < at.right()
                        && at.top() < beside.bottom()
                        && beside.top() < at.bottom();
                    assert!(!over, "{name}: {words:?} and {other:?} are over each other");
                }
            }
        }
    }
}

#[test]
fn a_pdf_is_a_page_of_that_size_with_its_fonts() {
    for width_mm in WIDTHS_MM {
        for (name, figure) in finished(width_mm) {
            let text = String::from_utf8_lossy(&figure.pdf);
            let (_, media) = text.split_once("/MediaBox [").expect("a page");
            let sizes: Vec<f64> = media
                .split(']')
                .next()
                .expect("it")
                .split(' ')
                .map(|n| n.parse().expect(n))
                .collect();
            assert!((sizes[2] - width_mm * PT).abs() < 0.01, "{name}: {sizes:?}");
            assert!(text.contains("/CIDFontType2") && text.contains("/FontFile2"), "{name}");
            assert!(!text.contains("/Type3") && !text.contains("/CreationDate"), "{name}");
        }
    }
}

/// What `pdffonts` of the Poppler tools says; without it nothing is looked at.
#[test]
fn every_font_of_a_pdf_is_embedded() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, figure) in finished(83.0) {
        let path = folder.path().join("figure.pdf");
        fs::write(&path, &figure.pdf).expect("a file");
        let Ok(said) = Command::new("pdffonts").arg(&path).output() else {
            eprintln!("pdffonts is not installed: nothing was looked at");
            return;
        };
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        let fonts: Vec<&str> = said.lines().skip(2).collect();
        assert!(!fonts.is_empty(), "{name}");
        for font in fonts {
            assert!(font.contains("NotoSans") && font.contains("CID TrueType"), "{name}: {font}");
            assert!(font.contains("yes yes yes"), "{name}: {font}");
        }
    }
}

#[test]
fn the_same_figures_are_the_same_bytes() {
    for ((name, one), (_, other)) in finished(83.0).iter().zip(&finish(83.0)) {
        assert!(one.svg == other.svg, "the SVG of {name}");
        assert!(one.pdf == other.pdf, "the PDF of {name}");
    }
}

#[test]
fn what_cannot_be_read_in_one_column_is_not_made() {
    let names =
        |width_mm| finished(width_mm).into_iter().map(|(name, _)| name).collect::<BTreeSet<_>>();
    let (single, double) = (names(83.0), names(171.0));
    let lacking: Vec<&String> = double.difference(&single).collect();
    assert!(
        lacking.iter().all(|name| name.starts_with("fig5") || name.starts_with("gap-map")),
        "{lacking:?}"
    );
    assert!(lacking.iter().any(|name| name.starts_with("fig5")), "six maps beside each other");
    assert!(single.is_subset(&double));
}

#[test]
fn a_name_in_letters_that_the_font_lacks_is_no_failure() {
    let mut analysis = whole_campaign();
    for flight in &mut analysis.flights {
        for drone in &mut flight.drones {
            "山 1".clone_into(&mut drone.name);
        }
    }
    let figures = of_analysis(&analysis, Beside::default(), 83.0);
    let missing: BTreeSet<char> = figures
        .iter()
        .filter_map(|drawn| drawn.finish().expect("a figure"))
        .flat_map(|figure| figure.missing)
        .collect();
    assert_eq!(missing.into_iter().collect::<String>(), "山");
}
