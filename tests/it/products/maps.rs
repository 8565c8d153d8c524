//! KML and GeoJSON: their shape, and what is in them.

use serde_json::Value;
use updraft::analysis::result::Analysis;
use updraft::products::{geojson, kml};

use crate::products::support::{can_run, placed, python};
use crate::report::synthetic::traced;

const HOSTILE: &str = "Drone <1> & \"co\"\u{202e}";

fn on_map() -> Analysis {
    let mut analysis = traced(placed());
    HOSTILE.clone_into(&mut analysis.flights[1].map.as_mut().unwrap().drones[0].name);
    analysis
}

/// Longitude and latitude of a position that RFC 7946 allows, and its height.
fn position(value: &Value) -> Vec<f64> {
    let numbers: Vec<f64> =
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect();
    assert!((2..=3).contains(&numbers.len()), "{value}");
    assert!(numbers[0].abs() <= 180.0 && numbers[1].abs() <= 90.0, "{value}");
    numbers
}

#[test]
fn geojson_has_a_point_and_a_way_for_each_drone() {
    let analysis = on_map();
    let drones = analysis.flights[1].map.as_ref().unwrap().drones.len();
    let text = geojson::geojson(&analysis).unwrap();
    let collection: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(collection["type"], "FeatureCollection");
    let bbox: Vec<f64> =
        collection["bbox"].as_array().unwrap().iter().map(|end| end.as_f64().unwrap()).collect();
    let (mut points, mut lines) = (Vec::new(), 0);
    for feature in collection["features"].as_array().unwrap() {
        assert_eq!(feature["type"], "Feature");
        assert!(feature["properties"].is_object());
        let geometry = &feature["geometry"];
        let positions: Vec<Vec<f64>> = match geometry["type"].as_str().unwrap() {
            "Point" => {
                points.push(feature);
                vec![position(&geometry["coordinates"])]
            }
            "LineString" => {
                lines += 1;
                geometry["coordinates"].as_array().unwrap().iter().map(position).collect()
            }
            other => panic!("{other}"),
        };
        for at in &positions {
            assert!((bbox[0]..=bbox[2]).contains(&at[0]), "{at:?} {bbox:?}");
            assert!((bbox[1]..=bbox[3]).contains(&at[1]), "{at:?} {bbox:?}");
        }
        assert!(geometry["type"] == "Point" || positions.len() > 1);
    }
    assert_eq!(points.len(), drones);
    assert!(lines > 0);
    let first = &points[0]["properties"];
    let drone = &analysis.flights[1].map.as_ref().unwrap().drones[0];
    assert!((first["w_mps"].as_f64().unwrap() - drone.mean.value).abs() < 1e-4);
    assert!((first["w_se_mps"].as_f64().unwrap() - drone.mean.se).abs() < 1e-4);
    assert_eq!(
        points[0]["geometry"]["coordinates"],
        serde_json::json!([19.062_198_3, 47.473_051_2, 289.5])
    );
    assert_eq!(first["u_mps"], 3.25);
    assert_eq!(first["utc_start"], "2026-06-01T12:01:35.000Z");
    assert_eq!(first["drone"], "Drone <1> & \"co\"\u{fffd}", "text of others is plain");
}

#[test]
fn without_a_place_there_is_no_map() {
    let mut analysis = on_map();
    let flight = &mut analysis.flights[1];
    flight.site = None;
    flight.map.as_mut().unwrap().drones[0].place = None;
    assert_eq!((geojson::geojson(&analysis), kml::kml(&analysis)), (None, None));
}

#[test]
fn kml_is_well_formed_and_has_all_drones_at_their_heights() {
    let analysis = on_map();
    let text = kml::kml(&analysis).unwrap();
    assert!(text.contains("<name>Drone &lt;1&gt; &amp; &quot;co&quot;"), "text is escaped");
    assert!(!text.contains("http://maps") && !text.contains("https:"), "nothing is fetched");
    if !can_run("xml.dom.minidom") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.kml"), &text).unwrap();
    let script = r##"
import xml.dom.minidom, json
root = xml.dom.minidom.parse("a.kml").documentElement
assert (root.tagName, root.namespaceURI) == ("kml", "http://www.opengis.net/kml/2.2")
styles = {"#" + one.getAttribute("id") for one in root.getElementsByTagName("Style")}
points, lines = 0, 0
for mark in root.getElementsByTagName("Placemark"):
    assert mark.getElementsByTagName("styleUrl")[0].firstChild.data in styles
    assert mark.getElementsByTagName("altitudeMode")[0].firstChild.data == "absolute"
    places = mark.getElementsByTagName("coordinates")[0].firstChild.data.split(" ")
    for place in places:
        lon, lat, height = map(float, place.split(","))
        assert 19.05 < lon < 19.07 and 47.47 < lat < 47.48 and 180 < height < 300, place
    points += len(mark.getElementsByTagName("Point"))
    lines += len(mark.getElementsByTagName("LineString"))
print(points, lines)
"##;
    let counts = python(folder.path(), script);
    let drones = analysis.flights[1].map.as_ref().unwrap().drones.len();
    assert!(counts.starts_with(&format!("{drones} ")), "{counts}");
}

#[test]
fn heights_above_an_unknown_ground_are_above_the_ground() {
    let mut analysis = on_map();
    let flight = &mut analysis.flights[1];
    flight.site.as_mut().unwrap().ground_amsl_m = None;
    flight.map.as_mut().unwrap().drones[0].place = None;
    let text = kml::kml(&analysis).unwrap();
    assert!(text.contains("relativeToGround") && !text.contains("absolute"));
    let collection: Value = serde_json::from_str(&geojson::geojson(&analysis).unwrap()).unwrap();
    assert_eq!(position(&collection["features"][0]["geometry"]["coordinates"]).len(), 2);
}
