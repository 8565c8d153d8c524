//! `--paper-figures`: what is written, and what is refused before anything is flown.

use std::fs;

use crate::cli::support::{Bench, SHORT};

#[test]
fn figures_are_written_for_each_width_and_nothing_else_is_touched() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("print/83mm")).unwrap();
    fs::write(bench.path("print/83mm/mine.tex"), "mine").unwrap();
    let args = [
        &["run", "--grid", "1x2", "--no-study", "-o", "flown", "--paper-figures", "print"][..],
        SHORT,
    ];
    let done = bench.expect(0, &args.concat());
    assert!(done.err.contains("83 mm wide, as SVG and PDF -> print/83mm"), "{done}");
    let figures = |folder: &str, ending: &str| -> Vec<String> {
        let entries = fs::read_dir(bench.path(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> =
            names.filter_map(|name| Some(name.strip_suffix(ending)?.to_owned())).collect();
        names.sort();
        names
    };
    let of_report = figures("flown/report/figures", ".svg");
    assert!(of_report.len() > 4, "{of_report:?}");
    assert_eq!(figures("print/171mm", ".svg"), of_report);
    assert_eq!(figures("print/171mm", ".pdf"), of_report);
    assert_eq!(figures("print/83mm", ".svg"), figures("print/83mm", ".pdf"));
    assert_eq!(fs::read(bench.path("print/83mm/mine.tex")).unwrap(), b"mine");
    let again = ["analyze", "flown", "--paper-figures", "print", "--paper-widths", "90"];
    bench.expect(0, &again);
    assert!(bench.path("print/90mm/fig2-laws.pdf").exists());
}

#[test]
fn what_is_no_folder_and_what_is_no_width_is_refused_before_anything_is_flown() {
    let bench = Bench::new();
    fs::write(bench.path("taken"), "mine").unwrap();
    let run = |more: &[&str]| {
        let args = [&["run", "--grid", "1x2", "-o", "flown"][..], SHORT, more].concat();
        let ended = bench.expect(2, &args);
        assert!(!bench.path("flown").exists(), "nothing is flown\n{ended}");
        ended.err
    };
    let taken = run(&["--paper-figures", "taken"]);
    assert!(taken.contains("cannot be written to taken: it is not a folder"), "{taken}");
    let below = run(&["--paper-figures", "taken/below"]);
    assert!(below.contains("cannot be written to taken/below"), "{below}");
    let narrow = run(&["--paper-figures", "print", "--paper-widths", "83,5"]);
    assert!(narrow.contains("a width from 60 to 300 mm"), "{narrow}");
    let alone = run(&["--paper-widths", "83"]);
    assert!(alone.contains("--paper-figures"), "{alone}");
    assert_eq!(fs::read(bench.path("taken")).unwrap(), b"mine");
}
