//! Scales of the air in which a simulated flight was flown, from its record.

use crate::analysis::statistics::result::{TrueAir, TrueField, TrueGusts};
use crate::sim::air::spec::AirSpec;

/// Field and gusts among the record's components; `None` where none of them has a scale, or where
/// fields of several scales add up.
pub(super) fn true_scales(components: &[String]) -> Option<TrueAir> {
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
    let gusts: Vec<TrueGusts> = [("von-karman", "von Karman"), ("dryden", "Dryden")]
        .into_iter()
        .flat_map(|(kind, spectrum)| {
            of_kind(kind).map(|spec| TrueGusts {
                spectrum: spectrum.to_owned(),
                sd_mps: spec.value("sd"),
                length_m: spec.value("length"),
                time_s: None,
            })
        })
        .collect();
    (field.is_some() || !gusts.is_empty()).then_some(TrueAir { field, gusts })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scales(texts: &[&str]) -> Option<TrueAir> {
        true_scales(&texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
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
        assert_eq!(scales(&["wind:speed=3"]), None);
        assert_eq!(scales(&["field:lambda=50", "field:lambda=200"]), None, "no one length");
        assert_eq!(scales(&["of a later version"]), None);
    }
}
