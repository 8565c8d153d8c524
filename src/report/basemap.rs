//! A picture of the ground below the map of the air.

use std::str::FromStr;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;
use thiserror::Error;

use crate::base::frame::{Geodetic, ShowFrame, metres_per_degree};

/// Largest picture, bytes: it goes into the page, a third longer.
pub const MOST_BASEMAP_BYTES: usize = 1_500_000;
/// Largest side, m; beyond it a picture is no plane.
const MOST_SIDE_M: f64 = 50_000.0;
/// How corners are written.
const FORM: &str = "write the south-west and the north-east corner as \"LAT,LON LAT,LON\", for example \
                    \"47.4721,19.0603 47.4745,19.0640\"";

/// A picture cannot be the ground below a map; a sentence that goes on after the file's name.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BasemapError {
    /// The file is too large for the page.
    #[error(
        "has {bytes} bytes, and a picture in the page may have {MOST_BASEMAP_BYTES}: save it smaller, or as JPEG or WebP"
    )]
    TooLarge {
        /// Size of the file, bytes.
        bytes: usize,
    },
    /// The file is in no format that browsers show.
    #[error("is neither PNG nor JPEG nor WebP")]
    Format,
    /// The picture ends too early.
    #[error("is not whole: the end of the {0} picture is missing")]
    CutOff(&'static str),
    /// The corners do not span a picture.
    #[error("{0}")]
    Corners(String),
    /// No drone stands in the picture.
    #[error(
        "does not show the grid: its nearest edge is {} from the nearest drone. Check the corners: latitude first, then \
         longitude",
        far(*away_m)
    )]
    Elsewhere {
        /// Distance to the nearest drone, m.
        away_m: f64,
    },
}

/// A distance of metres or kilometres.
fn far(away_m: f64) -> String {
    if away_m < 10_000.0 { format!("{away_m:.0} m") } else { format!("{:.0} km", away_m / 1000.0) }
}

/// The south-west and the north-east corner of a picture whose upper edge is north: latitude and longitude,
/// degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corners {
    south_west_deg: [f64; 2],
    north_east_deg: [f64; 2],
}

impl Corners {
    /// Corners that span a picture.
    ///
    /// # Errors
    /// [`BasemapError::Corners`] for places that are none, a first corner that does not lie south and west of the
    /// second, and sides of more than 50 km.
    pub fn new(south_west_deg: [f64; 2], north_east_deg: [f64; 2]) -> Result<Self, BasemapError> {
        let refuse = |reason: String| Err(BasemapError::Corners(reason));
        for [lat, lon] in [south_west_deg, north_east_deg] {
            let on_globe = (-89.0..=89.0).contains(&lat) && (-180.0..=180.0).contains(&lon);
            if !on_globe {
                return refuse(format!("{lat},{lon} is no latitude and longitude: {FORM}"));
            }
        }
        let [south, west] = south_west_deg;
        let [north, east] = north_east_deg;
        if south >= north || west >= east {
            return refuse(format!(
                "the corner {south},{west} does not lie south and west of {north},{east}: {FORM}"
            ));
        }
        let (lat_m, lon_m) = metres_per_degree(f64::midpoint(south, north));
        let [tall, wide] = [(north - south) * lat_m, (east - west) * lon_m];
        if tall.max(wide) > MOST_SIDE_M {
            return refuse(format!(
                "a picture of {:.0} km by {:.0} km is too large for a map of drones: {FORM}",
                wide / 1000.0,
                tall / 1000.0
            ));
        }
        Ok(Self { south_west_deg, north_east_deg })
    }
}

impl FromStr for Corners {
    type Err = BasemapError;

    fn from_str(text: &str) -> Result<Self, BasemapError> {
        let corner = |text: &str| {
            let (lat, lon) = text.split_once(',')?;
            Some([lat.trim().parse().ok()?, lon.trim().parse().ok()?])
        };
        let corners: Option<Vec<[f64; 2]>> = text.split_whitespace().map(corner).collect();
        match corners.as_deref() {
            Some([south_west, north_east]) => Self::new(*south_west, *north_east),
            _ => Err(BasemapError::Corners(format!("these are no corners: {FORM}"))),
        }
    }
}

/// A picture of the ground, north up, for the map of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Basemap {
    /// Name of its file, for people.
    name: String,
    /// Whose picture it is.
    credit: Option<String>,
    media: &'static str,
    bytes: Vec<u8>,
    corners: Corners,
}

impl Basemap {
    /// A picture from the bytes of its file.
    ///
    /// # Errors
    /// [`BasemapError::TooLarge`], [`BasemapError::Format`] or [`BasemapError::CutOff`].
    pub fn new(
        name: &str,
        bytes: Vec<u8>,
        corners: Corners,
        credit: Option<String>,
    ) -> Result<Self, BasemapError> {
        if bytes.len() > MOST_BASEMAP_BYTES {
            return Err(BasemapError::TooLarge { bytes: bytes.len() });
        }
        let media = media(&bytes)?;
        Ok(Self { name: name.to_owned(), credit, media, bytes, corners })
    }

    /// Tells whether a drone stands in it. `homes_m` are places in the show frame, x forward and y left.
    ///
    /// # Errors
    /// [`BasemapError::Elsewhere`] if none does.
    pub fn shows(
        &self,
        frame: &ShowFrame,
        homes_m: impl IntoIterator<Item = [f64; 2]>,
    ) -> Result<(), BasemapError> {
        let [south, west] = self.corners.south_west_deg;
        let [north, east] = self.corners.north_east_deg;
        let (lat_m, lon_m) = metres_per_degree(frame.origin.lat_deg);
        let away = homes_m.into_iter().map(|[x, y]| {
            let place = frame.to_geodetic(Vector3::new(x, y, 0.0));
            let beyond = |low: f64, v: f64, high: f64| (low - v).max(v - high).max(0.0);
            let lat = beyond(south, place.lat_deg, north) * lat_m;
            lat.hypot(beyond(west, place.lon_deg, east) * lon_m)
        });
        match away.reduce(f64::min) {
            Some(away_m) if away_m > 0.0 => Err(BasemapError::Elsewhere { away_m }),
            _ => Ok(()),
        }
    }

    /// Its corners in the show frame, m: north-west, north-east, south-west.
    pub(super) fn corners_m(&self, frame: &ShowFrame) -> [[f64; 2]; 3] {
        let [south, west] = self.corners.south_west_deg;
        let [north, east] = self.corners.north_east_deg;
        [[north, west], [north, east], [south, west]].map(|[lat_deg, lon_deg]| {
            let amsl_m = frame.origin.amsl_m;
            let place = frame.from_geodetic(Geodetic { lat_deg, lon_deg, amsl_m });
            [place.x, place.y]
        })
    }

    /// The picture as an address that holds it.
    pub(super) fn address(&self) -> String {
        format!("data:{};base64,{}", self.media, STANDARD.encode(&self.bytes))
    }

    /// Its file and whose it is: `field.jpg, (c) the surveyor`.
    pub(super) fn words(&self) -> String {
        match &self.credit {
            Some(credit) => format!("{}, {credit}", self.name),
            None => self.name.clone(),
        }
    }
}

/// The format, by the file's first bytes; its last ones tell whether all of it is there.
fn media(bytes: &[u8]) -> Result<&'static str, BasemapError> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        let end = b"\0\0\0\0IEND\xae\x42\x60\x82";
        return if bytes.ends_with(end) {
            Ok("image/png")
        } else {
            Err(BasemapError::CutOff("PNG"))
        };
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        // Some writers pad the file.
        let end = bytes.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
        let whole = bytes.get(..end).is_some_and(|bytes| bytes.ends_with(b"\xff\xd9"));
        return if whole { Ok("image/jpeg") } else { Err(BasemapError::CutOff("JPEG")) };
    }
    if let (Some(b"RIFF"), Some(size), Some(b"WEBP")) =
        (bytes.get(..4), bytes.get(4..8), bytes.get(8..12))
    {
        let size = size.iter().rev().fold(0_usize, |size, byte| (size << 8) | usize::from(*byte));
        let whole = bytes.len() >= size.saturating_add(8);
        return if whole { Ok("image/webp") } else { Err(BasemapError::CutOff("WebP")) };
    }
    Err(BasemapError::Format)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PNG: &[u8] = b"\x89PNG\r\n\x1a\n...\0\0\0\0IEND\xae\x42\x60\x82";

    fn corners() -> Corners {
        Corners::new([47.0, 19.0], [47.01, 19.02]).unwrap()
    }

    fn frame(orientation_deg: f64) -> ShowFrame {
        let origin = Geodetic { lat_deg: 47.005, lon_deg: 19.01, amsl_m: 100.0 };
        ShowFrame { origin, orientation_deg }
    }

    #[test]
    fn corners_are_read_and_nonsense_is_named() {
        assert_eq!("47,19 47.01,19.02".parse(), Ok(corners()));
        assert_eq!("47, 19  47.01, 19.02".parse::<Corners>().ok(), None, "a space parts corners");
        let said = |text: &str| text.parse::<Corners>().unwrap_err().to_string();
        for (text, words) in [
            ("", "these are no corners"),
            ("47,19", "these are no corners"),
            ("47,19 48,20 49,21", "these are no corners"),
            ("47,x 48,20", "these are no corners"),
            ("NaN,19 48,20", "no latitude and longitude"),
            ("97,19 98,20", "97,19 is no latitude and longitude"),
            ("47.01,19 47,19.02", "does not lie south and west"),
            ("47,19.02 47.01,19", "does not lie south and west"),
            ("47,19 48,20", "is too large for a map of drones"),
        ] {
            assert!(said(text).contains(words), "{text}: {}", said(text));
            assert!(said(text).contains("LAT,LON LAT,LON"), "{text}: {}", said(text));
        }
    }

    #[test]
    fn only_whole_pictures_of_known_formats_are_taken() {
        let of = |bytes: &[u8]| Basemap::new("x", bytes.to_vec(), corners(), None);
        let webp = b"RIFF\x08\0\0\0WEBPVP8 ";
        for (bytes, media) in [
            (PNG, "image/png"),
            (b"\xff\xd8\xff\xe0...\xff\xd9\0\0".as_slice(), "image/jpeg"),
            (webp.as_slice(), "image/webp"),
        ] {
            assert!(of(bytes).unwrap().address().starts_with(&format!("data:{media};base64,")));
        }
        assert_eq!(of(&PNG[..20]), Err(BasemapError::CutOff("PNG")));
        assert_eq!(of(b"\xff\xd8\xff\xe0..."), Err(BasemapError::CutOff("JPEG")));
        assert_eq!(of(&webp[..14]), Err(BasemapError::CutOff("WebP")));
        assert_eq!(of(b"GIF89a..."), Err(BasemapError::Format));
        assert_eq!(of(b""), Err(BasemapError::Format));
        let large = vec![0; MOST_BASEMAP_BYTES + 1];
        assert_eq!(of(&large), Err(BasemapError::TooLarge { bytes: large.len() }));
    }

    #[test]
    fn a_picture_turns_with_the_show() {
        let picture = Basemap::new("x", PNG.to_vec(), corners(), None).unwrap();
        // 0.01 degrees of latitude are 1112 m, 0.02 of longitude 1521 m at 47 degrees.
        let [north_west, north_east, south_west] = picture.corners_m(&frame(0.0));
        assert!((north_west[0] - 556.0).abs() < 1.0 && (north_west[1] - 760.0).abs() < 1.0);
        assert!((north_east[1] + 760.0).abs() < 1.0 && (south_west[0] + 556.0).abs() < 1.0);
        // A show that looks east has north on its left.
        let [north_west, north_east, _] = picture.corners_m(&frame(90.0));
        assert!((north_west[1] - 556.0).abs() < 1.0 && (north_west[0] + 760.0).abs() < 1.0);
        assert!((north_east[0] - 760.0).abs() < 1.0, "{north_east:?}");
    }

    #[test]
    fn a_picture_of_another_place_is_noticed() {
        let picture = Basemap::new("x", PNG.to_vec(), corners(), None).unwrap();
        assert_eq!(picture.shows(&frame(30.0), [[0.0, 0.0], [9000.0, 0.0]]), Ok(()));
        // 2000 m north of the middle, 1444 m beyond the upper edge.
        let away = picture.shows(&frame(0.0), [[2000.0, 0.0], [3000.0, 0.0]]).unwrap_err();
        assert!(away.to_string().contains("is 1444 m from the nearest drone"), "{away}");
    }
}
