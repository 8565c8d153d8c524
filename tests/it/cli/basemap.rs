//! `--basemap`: what is wrong with a picture is said before anything is flown or read.

use std::fs;

use insta::assert_snapshot;

use crate::cli::support::{Bench, SHORT};

/// A file that begins and ends as a PNG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n...\0\0\0\0IEND\xae\x42\x60\x82";

/// What `run` says about a picture of this content, with these further arguments.
fn refused(content: &[u8], more: &[&str]) -> String {
    let bench = Bench::new();
    fs::write(bench.path("field.png"), content).unwrap();
    let args =
        [&["run", "--grid", "1x2", "--basemap", "field.png", "-o", "flown"][..], SHORT, more]
            .concat();
    let ended = bench.expect(2, &args);
    assert!(!bench.path("flown").exists(), "nothing is flown\n{ended}");
    ended.err
}

const THERE: [&str; 2] = ["--basemap-corners", "47.472,19.060 47.475,19.065"];

#[test]
fn a_picture_in_no_known_format() {
    assert_snapshot!(refused(b"GIF89a...", &THERE));
}

#[test]
fn a_picture_that_is_cut_off() {
    assert_snapshot!(refused(&PNG[..20], &THERE));
}

#[test]
fn a_picture_that_is_too_large() {
    assert_snapshot!(refused(&[PNG, &vec![0; 1_500_000]].concat(), &THERE));
}

#[test]
fn a_picture_without_corners() {
    assert_snapshot!(refused(PNG, &[]));
}

#[test]
fn corners_that_are_nonsense() {
    assert_snapshot!(refused(PNG, &["--basemap-corners", "47.475,19.060 47.472,19.065"]));
}

#[test]
fn a_picture_of_another_place() {
    // Longitude first.
    assert_snapshot!(refused(PNG, &["--basemap-corners", "19.060,47.472 19.065,47.475"]));
}

#[test]
fn a_file_of_corners_with_a_mistake() {
    let bench = Bench::new();
    fs::write(bench.path("field.png"), PNG).unwrap();
    fs::write(bench.path("field.png.json"), "{\"south_west\": [47.472, 19.060]}").unwrap();
    let args =
        [&["run", "--grid", "1x2", "--basemap", "field.png", "-o", "flown"][..], SHORT].concat();
    assert_snapshot!(bench.expect(2, &args).err);
}
