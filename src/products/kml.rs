//! Drones on a map as KML 2.2: points with the means of w, coloured, and lines with the ways of the drones.

use std::fmt::Write as _;

use super::on_map::{Place, Spot, spots};
use super::words::{self, iso};
use crate::analysis::result::Analysis;
use crate::base::markup::escape;

/// Colours of w from falling to rising air, as KML has them (opacity, blue, green, red): ColorBrewer's RdBu, reversed.
const COLOURS: [&str; 9] = [
    "ffac6621", "ffc39343", "ffdec592", "fff0e5d1", "fff7f7f7", "ffc7dbfd", "ff82a5f4", "ff4d60d6",
    "ff2b18b2",
];
/// Ends of the scale of colours, m/s.
const ENDS_MPS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 5.0, 10.0];
/// Colour of the tracks.
const TRACK: &str = "b4666666";

/// Height above sea level where it is known, else above take-off.
fn coordinates(place: &Place) -> String {
    let [lat, lon] = place.lat_lon_deg;
    format!("{lon:.7},{lat:.7},{:.2}", place.amsl_m.unwrap_or(place.height_m))
}

fn altitude_mode(place: &Place) -> &'static str {
    if place.amsl_m.is_some() { "absolute" } else { "relativeToGround" }
}

/// The colour's number of a speed on a scale to `end_mps`.
fn class(w_mps: f64, end_mps: f64) -> usize {
    let classes = COLOURS.len() as f64;
    let place = f64::midpoint(w_mps / end_mps, 1.0) * classes;
    place.floor().clamp(0.0, classes - 1.0) as usize
}

fn point(out: &mut String, spot: &Spot, end_mps: f64) {
    let error = spot.w_se_mps.map_or(String::new(), |se| format!(" \u{b1} {se:.2}"));
    let description = format!(
        "w {:+.2}{error} m/s, mean {}; {:.0} m above take-off",
        spot.w_mps,
        if spot.moved { "along a track" } else { "of a hover" },
        spot.place.height_m
    );
    let _ = write!(
        out,
        "<Placemark><name>{}</name><description>{}</description>",
        escape(&spot.drone),
        escape(&description)
    );
    if let Some([from, to]) = spot.utc_ms {
        let _ =
            write!(out, "<TimeSpan><begin>{}</begin><end>{}</end></TimeSpan>", iso(from), iso(to));
    }
    let _ = write!(out, "<styleUrl>#w{}</styleUrl><ExtendedData>", class(spot.w_mps, end_mps));
    let number = |value: Option<f64>| value.map(|value| format!("{value:.4}"));
    let data = [
        ("flight", Some(escape(&spot.flight))),
        ("slot", spot.slot.map(|slot| slot.to_string())),
        ("w_mps", number(Some(spot.w_mps))),
        ("w_se_mps", number(spot.w_se_mps)),
        ("low_mps", number(spot.interval_mps.map(|ends| ends[0]))),
        ("high_mps", number(spot.interval_mps.map(|ends| ends[1]))),
        ("posterior_mps", number(spot.posterior_mps.map(|found| found[0]))),
        ("posterior_sd_mps", number(spot.posterior_mps.map(|found| found[1]))),
        ("u_mps", number(spot.wind_mps.map(|wind| wind[0]))),
        ("v_mps", number(spot.wind_mps.map(|wind| wind[1]))),
        ("height_agl_m", Some(format!("{:.2}", spot.place.height_m))),
        ("altitude_amsl_m", spot.place.amsl_m.map(|m| format!("{m:.2}"))),
    ];
    for (name, value) in data {
        if let Some(value) = value {
            let _ = write!(out, "<Data name=\"{name}\"><value>{value}</value></Data>");
        }
    }
    let _ = writeln!(
        out,
        "</ExtendedData><Point><extrude>1</extrude><altitudeMode>{}</altitudeMode><coordinates>{}</coordinates></Point></Placemark>",
        altitude_mode(&spot.place),
        coordinates(&spot.place)
    );
}

fn line(out: &mut String, spot: &Spot) {
    let [Some(first), Some(_)] = [0, 1].map(|index| spot.track.get(index)) else { return };
    let places: Vec<String> = spot.track.iter().map(coordinates).collect();
    let _ = writeln!(
        out,
        "<Placemark><name>{}</name><styleUrl>#track</styleUrl><LineString><altitudeMode>{}</altitudeMode><coordinates>{}</coordinates></LineString></Placemark>",
        escape(&spot.drone),
        altitude_mode(first),
        places.join(" ")
    );
}

/// The file; `None`: no drone has values and a place.
pub fn kml(analysis: &Analysis) -> Option<String> {
    let spots = spots(analysis);
    let largest = spots.iter().map(|spot| spot.w_mps.abs()).reduce(f64::max)?;
    let end_mps = ENDS_MPS.into_iter().find(|end| largest <= *end).unwrap_or(largest);
    let mut out = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>\n",
    );
    let _ = writeln!(
        out,
        "<name>{}</name><description>{}. Colours of w: blue falls, red rises, from -{end_mps} to {end_mps} m/s.</description>",
        escape(&words::title(analysis)),
        escape(&words::source(analysis))
    );
    for (class, colour) in COLOURS.iter().enumerate() {
        let _ = writeln!(
            out,
            "<Style id=\"w{class}\"><IconStyle><color>{colour}</color><scale>1.1</scale></IconStyle><LineStyle><color>80ffffff</color></LineStyle></Style>"
        );
    }
    let _ = writeln!(
        out,
        "<Style id=\"track\"><LineStyle><color>{TRACK}</color><width>1.5</width></LineStyle></Style>"
    );
    let mut flights: Vec<&str> = spots.iter().map(|spot| spot.flight.as_str()).collect();
    flights.dedup();
    for flight in flights {
        let of_flight = || spots.iter().filter(|spot| spot.flight == flight);
        let _ =
            writeln!(out, "<Folder><name>{}</name>\n<Folder><name>Means</name>", escape(flight));
        of_flight().for_each(|spot| point(&mut out, spot, end_mps));
        out.push_str("</Folder>\n<Folder><name>Tracks</name>\n");
        of_flight().for_each(|spot| line(&mut out, spot));
        out.push_str("</Folder></Folder>\n");
    }
    out.push_str("</Document></kml>\n");
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::class;

    #[test]
    fn still_air_is_in_the_middle_and_the_ends_are_the_scales() {
        let classes = [-9.0, -1.0, -0.12, 0.0, 0.1, 0.99, 1.0, 7.0].map(|w| class(w, 1.0));
        assert_eq!(classes, [0, 0, 3, 4, 4, 8, 8, 8]);
    }
}
