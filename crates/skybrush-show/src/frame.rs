//! Coordinate frames: the show frame, local north-east-up metres, and latitude and longitude.
//!
//! The **show frame** is Skybrush's: right-handed, x along the show's orientation, y to the left of
//! x, z up from the ground at the origin. With the orientation `o` (degrees clockwise from north to
//! x), `north = cos(o) x + sin(o) y` and `east = sin(o) x - cos(o) y`.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Semi-major axis of the WGS84 ellipsoid, m.
pub const WGS84_A_M: f64 = 6_378_137.0;
/// First eccentricity squared of the WGS84 ellipsoid.
pub const WGS84_E2: f64 = 6.694_379_990_141_317e-3;

/// A place on the globe: geodetic degrees and metres above mean sea level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Geodetic {
    /// Latitude, degrees, north positive.
    pub lat_deg: f64,
    /// Longitude, degrees, east positive.
    pub lon_deg: f64,
    /// Altitude above mean sea level, m.
    pub amsl_m: f64,
}

/// The show frame's place on the globe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShowFrame {
    /// Position of the show's origin; its altitude is that of show z = 0.
    pub origin: Geodetic,
    /// Degrees clockwise from north to the show's x axis.
    pub orientation_deg: f64,
}

impl ShowFrame {
    /// Converts show coordinates (x forward, y left, z up) to (north, east, up) metres from the
    /// origin.
    pub fn to_neu(&self, show_m: Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = self.orientation_deg.to_radians().sin_cos();
        Vector3::new(cos * show_m.x + sin * show_m.y, sin * show_m.x - cos * show_m.y, show_m.z)
    }

    /// Converts north-east-up metres to show coordinates, m; the inverse of [`ShowFrame::to_neu`].
    pub fn from_neu(&self, neu_m: Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = self.orientation_deg.to_radians().sin_cos();
        Vector3::new(cos * neu_m.x + sin * neu_m.y, sin * neu_m.x - cos * neu_m.y, neu_m.z)
    }

    /// Converts show coordinates to latitude, longitude and altitude, on the local tangent plane;
    /// arrays are hundreds of metres wide, where its error is below a millimetre.
    pub fn to_geodetic(&self, show_m: Vector3<f64>) -> Geodetic {
        let neu = self.to_neu(show_m);
        let (north_m_per_deg, east_m_per_deg) = metres_per_degree(self.origin.lat_deg);
        Geodetic {
            lat_deg: self.origin.lat_deg + neu.x / north_m_per_deg,
            lon_deg: self.origin.lon_deg + neu.y / east_m_per_deg,
            amsl_m: self.origin.amsl_m + neu.z,
        }
    }

    /// Converts latitude, longitude and altitude to show coordinates; the inverse of
    /// [`ShowFrame::to_geodetic`].
    pub fn from_geodetic(&self, place: Geodetic) -> Vector3<f64> {
        let (north_m_per_deg, east_m_per_deg) = metres_per_degree(self.origin.lat_deg);
        self.from_neu(Vector3::new(
            (place.lat_deg - self.origin.lat_deg) * north_m_per_deg,
            (place.lon_deg - self.origin.lon_deg) * east_m_per_deg,
            place.amsl_m - self.origin.amsl_m,
        ))
    }
}

/// Metres per degree of latitude and of longitude at a latitude, on the WGS84 ellipsoid.
///
/// From the radii of curvature in the meridian and in the prime vertical (Snyder, *Map Projections*,
/// USGS PP 1395, eqs. 4-18 and 4-20).
pub fn metres_per_degree(lat_deg: f64) -> (f64, f64) {
    let (sin, cos) = lat_deg.to_radians().sin_cos();
    let w2 = 1.0 - WGS84_E2 * sin * sin;
    let meridian_m = WGS84_A_M * (1.0 - WGS84_E2) / w2.powf(1.5);
    let vertical_m = WGS84_A_M / w2.sqrt();
    (meridian_m.to_radians(), (vertical_m * cos).to_radians())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(orientation_deg: f64) -> ShowFrame {
        let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 150.0 };
        ShowFrame { origin, orientation_deg }
    }

    #[test]
    fn x_points_along_the_orientation_and_y_to_its_left() {
        let east = frame(90.0);
        let x = east.to_neu(Vector3::new(1.0, 0.0, 0.0));
        let y = east.to_neu(Vector3::new(0.0, 1.0, 0.0));
        assert!((x - Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-12, "x points east: {x}");
        assert!((y - Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-12, "y points north: {y}");
    }

    #[test]
    fn goes_to_the_globe_and_back() {
        let frame = frame(59.0);
        let show = Vector3::new(123.4, -56.7, 89.0);
        let back = frame.from_geodetic(frame.to_geodetic(show));
        assert!((back - show).norm() < 1e-6, "{back}");
    }

    #[test]
    fn degrees_have_their_published_length() {
        // WGS84 at 45 degrees: 111 131.745 m and 78 846.806 m (NGA TR8350.2 tables).
        let (north, east) = metres_per_degree(45.0);
        assert!((north - 111_131.75).abs() < 0.1, "{north}");
        assert!((east - 78_846.81).abs() < 0.1, "{east}");
    }
}
