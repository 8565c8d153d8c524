//! Errors that a measurement will have, for people who plan it.

use std::fmt::Write as _;

use crate::analysis::expected::{ExpectedErrors, OneAndFleet};

/// A table of the errors, with what was assumed.
pub(super) fn expected_words(of: &ExpectedErrors, drones: usize) -> String {
    let mut text = String::from("Errors to expect of w (docs/products.md says how):\n");
    let place = match (of.heights, of.speed_mps > 0.05) {
        (1, false) => format!("{:.0} s at {:.0} m", of.measured_s, of.height_m),
        (1, true) => {
            format!("{:.0} s at {:.1} m/s, {:.0} m high", of.measured_s, of.speed_mps, of.height_m)
        }
        (heights, _) => format!("{:.0} s at each of {heights} heights", of.measured_s),
    };
    let _ = writeln!(text, "  measured  {place}");
    let _ = writeln!(
        text,
        "  assumed   integral time {:.0} s ({}), sd {:.2} m/s ({})",
        of.integral_s,
        if of.integral_is_given {
            "--integral-scale".to_owned()
        } else {
            format!("convective eddies of {:.0} m, 3 m/s of wind", of.length_m)
        },
        of.sd_mps,
        if of.sd_is_given { "--air-sd" } else { "w* = 1 m/s" }
    );
    let fleet = format!("all {drones}");
    let _ = writeln!(text, "  {:<34}{:>11}{:>11}", "", "one drone", fleet);
    let mut row = |name: &str, of: OneAndFleet, show: &dyn Fn(f64) -> String| {
        let _ = writeln!(text, "  {name:<34}{:>11}{:>11}", show(of.drone), show(of.fleet));
    };
    let mps = |value: f64| format!("{value:.2} m/s");
    let percent = |value: f64| format!("{:.0} %", 100.0 * value);
    row("mean of w, as sampled", of.mean_mps, &mps);
    if let Some(zero_mps) = of.zero_mps {
        row("its zero, by air alone, at least", zero_mps, &mps);
    }
    row("var(w)", of.variance, &percent);
    row("var(w) to 10 % takes", of.variance_to_tenth_s, &duration);
    for pair in &of.covariances {
        let _ = writeln!(
            text,
            "  covariance of two, {:<15}{:>11} of var(w)",
            format!("{:.0} m apart", pair.distance_m),
            format!("{:.2} ± {:.2}", pair.share, pair.error)
        );
    }
    text
}

/// A duration with as many digits as it deserves.
fn duration(seconds: f64) -> String {
    if seconds < 600.0 {
        format!("{seconds:.0} s")
    } else if seconds < 36_000.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.0} h", seconds / 3600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::expected::{AssumedAir, expected_errors};
    use crate::mission::resolve::resolve;

    #[test]
    fn a_planner_reads_what_the_flight_will_tell() {
        let mission = resolve("campaign", &[]).unwrap();
        let [calibration, hover] = &mission.flights[..] else { panic!("two flights") };
        let found =
            expected_errors(&hover.plan, Some(&calibration.plan), AssumedAir::default()).unwrap();
        insta::assert_snapshot!(expected_words(&found, 49));
    }
}
