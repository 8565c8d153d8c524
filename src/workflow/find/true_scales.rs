//! Scales of the air in which a simulated flight was flown, from its record.

use crate::analysis::statistics::result::{TrueAir, TrueField, TrueGusts};
use crate::sim::air::spec::AirSpec;

/// Gusts move at least at this speed, m/s (`multirotor-sim`'s, for Dryden's model).
const SLOWEST_MPS: f64 = 1.0;

/// Field and gusts among the record's components; `None` where none of them has a scale, or where
/// fields of several scales add up. `uniform_mps` is the air's uniform motion towards east, north and up, and `forward_deg`
/// the compass direction of the show frame's x.
pub(super) fn true_scales(
    components: &[String],
    uniform_mps: [f64; 3],
    forward_deg: f64,
) -> Option<TrueAir> {
    let specs: Vec<AirSpec> = components.iter().filter_map(|text| text.parse().ok()).collect();
    let of_kind = |name: &'static str| specs.iter().filter(move |spec| spec.kind().name == name);
    let mut fields = of_kind("field").map(|spec| TrueField {
        sd_mps: spec.value("sd"),
        lambda_m: spec.value("lambda"),
        lambda_y_m: spec.given("lambda_y").unwrap_or_else(|| spec.value("lambda")),
        tau_s: spec.value("tau"),
        wind_mps: spec.given("wind").unwrap_or(0.0),
        is_gaussian: false,
        drift_mps: None,
    });
    let field = fields.next();
    if fields.next().is_some() {
        return None;
    }
    let drift_mps = carried(&specs, uniform_mps, forward_deg);
    let gusts: Vec<TrueGusts> = [("von-karman", "von Karman"), ("dryden", "Dryden")]
        .into_iter()
        .flat_map(|(kind, spectrum)| {
            of_kind(kind).map(|spec| TrueGusts {
                spectrum: spectrum.to_owned(),
                sd_mps: spec.value("sd"),
                length_m: spec.value("length"),
                time_s: None,
                drift_mps: spec.given("wind").is_none().then_some(drift_mps).flatten(),
            })
        })
        .collect();
    let beside = beside(components, uniform_mps[2]);
    (field.is_some() || !gusts.is_empty()).then_some(TrueAir { field, gusts, beside })
}

/// Vertical motions of a record that have no scales, in words.
fn beside(components: &[String], up_mps: f64) -> Vec<String> {
    let words = |text: &String| -> Option<String> {
        let Ok(spec) = text.parse::<AirSpec>() else {
            return Some(format!("air that this version does not know ({text})"));
        };
        let words = match spec.kind().name {
            "still" | "wind" | "profile" | "field" | "dryden" | "von-karman" => return None,
            "uniform" if spec.value("up") == 0.0 => return None,
            "uniform" => "a steady updraft".to_owned(),
            "drone-constant" => "an updraft of each drone's own place".to_owned(),
            "lenschow" => "convective turbulence (Lenschow)".to_owned(),
            "les" => "a simulation of large eddies".to_owned(),
            other => other.to_owned(),
        };
        Some(words)
    };
    let mut found: Vec<String> = components.iter().filter_map(words).collect();
    if up_mps != 0.0 && !found.iter().any(|one| one == "a steady updraft") {
        found.push("a steady updraft".to_owned());
    }
    found
}

/// The wind that carries gusts, along x and y of the show frame, m/s; `None` without wind.
fn carried(
    specs: &[AirSpec],
    [mut east, mut north, _]: [f64; 3],
    forward_deg: f64,
) -> Option<[f64; 2]> {
    for spec in specs.iter().filter(|spec| spec.kind().name == "profile") {
        let (sin, cos) = spec.value("from").to_radians().sin_cos();
        east -= spec.value("speed") * sin;
        north -= spec.value("speed") * cos;
    }
    let speed_mps = east.hypot(north);
    let faster = (speed_mps > 0.0).then(|| (SLOWEST_MPS / speed_mps).max(1.0))?;
    let (sin, cos) = forward_deg.to_radians().sin_cos();
    Some([faster * (north * cos + east * sin), faster * (north * sin - east * cos)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scales(texts: &[&str]) -> Option<TrueAir> {
        let texts: Vec<String> = texts.iter().map(|text| (*text).to_owned()).collect();
        true_scales(&texts, [0.0; 3], 90.0)
    }

    #[test]
    fn field_and_gusts_of_a_record_are_the_truth() {
        let found = scales(&[
            "field:sd=0.6,lambda_y=90,tau=120,wind=0",
            "profile:speed=2,from=270",
            "von-karman:sd=0.2,length=30",
        ])
        .unwrap();
        let field = found.field.unwrap();
        assert_eq!((field.sd_mps, field.tau_s), (0.6, 120.0));
        assert_eq!((field.lambda_m, field.lambda_y_m), (145.0, 90.0), "145 m if not given");
        assert_eq!((found.gusts[0].sd_mps, found.gusts[0].length_m), (0.2, 30.0));
        // Towards east, which is forward.
        let [x, y] = found.gusts[0].drift_mps.unwrap();
        assert!((x - 2.0).abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
        let slow = scales(&["profile:speed=0.5,from=0", "dryden:sd=0.2,length=30"]).unwrap();
        let [x, y] = slow.gusts[0].drift_mps.unwrap();
        // Towards south, which is to the right of east, and no slower than 1 m/s.
        assert!(x.abs() < 1e-9 && (y + 1.0).abs() < 1e-9, "{x} {y}");
        let none: [&str; 0] = [];
        assert_eq!(slow.beside, none);
        let thermals = scales(&["dryden:sd=0.2,length=30", "thermals:w_star=2", "lenschow"]);
        assert_eq!(thermals.unwrap().beside, ["thermals", "convective turbulence (Lenschow)"]);
        let rising = true_scales(&["field:sd=0.5".to_owned()], [0.0, 0.0, 1.5], 0.0);
        assert_eq!(rising.unwrap().beside, ["a steady updraft"]);
        assert_eq!(scales(&["wind:speed=3"]), None);
        assert_eq!(scales(&["field:lambda=50", "field:lambda=200"]), None, "no one length");
        assert_eq!(scales(&["of a later version"]), None);
    }
}
