//! Masts whose values are means over tens of seconds or minutes.

use std::fmt::Write as _;
use std::fs;

use super::{analysed, compared, number, values};
use crate::cli::support::Bench;

/// Means of the mast, s.
const MEAN_S: f64 = 30.0;
/// Variance that the mast says of w within each, (m/s)².
const VARIANCE: f64 = 0.2;

/// A slow mast that says what the drone says, scaled and shifted; each mean has the time of its end.
fn slow(bench: &Bench) -> String {
    let values = values(bench);
    let first_s = (values[0].0 / MEAN_S).floor() * MEAN_S;
    let mut table = "utc,w,w_sd\n".to_owned();
    // Long before and after the flight, too, as a tower goes on.
    for k in -10..25 {
        let from_s = first_s + MEAN_S * f64::from(k);
        let within: Vec<f64> = values
            .iter()
            .filter(|(time_s, _)| (from_s..from_s + MEAN_S).contains(time_s))
            .map(|(_, w)| *w)
            .collect();
        let mean = within.iter().sum::<f64>() / within.len().max(1) as f64;
        let (end_s, sd) = (from_s + MEAN_S, VARIANCE.sqrt());
        writeln!(table, "{end_s:.0},{},{sd}", 0.1 + 0.8 * mean).unwrap();
    }
    table
}

#[test]
fn a_slow_mast_is_compared_mean_by_mean() {
    let bench = analysed();
    fs::write(bench.path("tower.csv"), slow(&bench)).unwrap();
    let found = compared(&bench, "tower.csv");
    assert_eq!(number(&found["mast_mean_s"]), MEAN_S);
    let flight = &found["flights"][0];
    let fleet = &flight["fleet"];
    assert!((7..=10).contains(&fleet["count"].as_u64().unwrap()), "{fleet:#}");
    assert!((number(&fleet["slope"]) - 1.0 / 0.8).abs() < 0.05, "{fleet:#}");
    let mean = number(&fleet["mast_mean_mps"]);
    assert!((number(&fleet["bias_mps"]) - ((mean - 0.1) / 0.8 - mean)).abs() < 0.02, "{fleet:#}");
    // Of the same seconds, and of no others.
    assert!(number(&fleet["correlation"]) > 0.995, "{fleet:#}");
    assert_eq!(number(&flight["best_shift"][0]), 0.0, "{:#}", flight["best_shift"]);
    for nothing in ["mast_spectrum", "drone_spectrum", "coherence"] {
        assert_eq!(flight[nothing].as_array().unwrap().len(), 0, "{nothing}");
    }
    assert_eq!(number(&flight["averages"][0]["length_s"]), 60.0, "{:#}", flight["averages"]);
    let within = &flight["period_variance"];
    assert!((number(&within["mast"]) - VARIANCE).abs() < 1e-9, "{within:#}");
    assert!((0.02..0.5).contains(&number(&within["drones"])), "{within:#}");
    let notes = found["notes"].to_string();
    assert!(notes.contains("means over the 30 s that end at their times"), "{notes}");
    assert!(notes.contains("spectra, coherence and gusts are not compared"), "{notes}");
    let text = bench.expect(0, &["compare", "out", "--mast", "tower.csv", "-o", "beside"]).out;
    assert!(text.contains("common means over 30 s"), "{text}");
    assert!(text.contains("Variance of w within means over 30 s"), "{text}");
    let page = fs::read_to_string(bench.path("beside/report/index.html")).unwrap();
    assert!(page.contains("Means over 30 s") && page.contains("mast-time-hover.svg"));
    assert!(!page.contains("mast-spectra-hover.svg") && !page.contains("NaN"));
}

/// Times that mark the wrong end show in the shift.
#[test]
fn wrong_ends_of_means_show() {
    let bench = analysed();
    fs::write(bench.path("tower.csv"), slow(&bench)).unwrap();
    let mapping = |stamp: &str| {
        format!(
            "schema = \"updraft.mast/1\"\nname = \"tower\"\nfile = \"tower.csv\"\nstamp = \"{stamp}\"\n[time]\n\
             column = \"utc\"\nformat = \"s\"\n[w]\ncolumns = [\"w\"]\n"
        )
    };
    for (stamp, shift_s) in [("end", 0.0), ("middle", -15.0), ("start", -30.0)] {
        fs::write(bench.path("mast.toml"), mapping(stamp)).unwrap();
        let found = compared(&bench, "mast.toml");
        let shift = &found["flights"][0]["best_shift"];
        assert_eq!(number(&shift[0]), shift_s, "{stamp}: {shift}");
        assert!(!found["notes"].to_string().contains("end at their times"), "{stamp}");
        assert!(found["notes"].to_string().contains("nor variances"), "{stamp}");
        assert!(found["flights"][0].get("period_variance").is_none(), "{stamp}");
    }
}
