//! Small pictures inside SVG: coloured pixels as a PNG in a data URI.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::colour::{diverging_rgb, sequential_rgb};

/// Palette entries for values; one more is transparent.
const COLOURS: u8 = 254;
/// Pixel without a value.
const EMPTY: u8 = 255;
/// Pixel that is drawn in grey: the hatching of doubtful values.
const HATCH: u8 = 254;

/// A pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pixel {
    /// Nothing is known: what lies behind shows.
    Empty,
    /// Position on the diverging scale, -1..1.
    At(f64),
    /// A grey pixel of a hatched area, which marks doubtful values.
    Hatch,
}

/// The picture as an SVG element over the box [x, y, width, height]; `smooth` lets the viewer blend
/// pixels. Empty if there is nothing to draw.
pub(super) fn image(
    pixels: &[Pixel],
    size: (usize, usize),
    place: [f64; 4],
    smooth: bool,
) -> String {
    coloured(pixels, size, place, smooth, diverging_rgb)
}

/// [`image`] of sizes: a pixel's position, 0..1, is one on the sequential scale.
pub(super) fn image_of_sizes(pixels: &[Pixel], size: (usize, usize), place: [f64; 4]) -> String {
    coloured(pixels, size, place, true, |place| sequential_rgb(place.max(0.0)))
}

fn coloured(
    pixels: &[Pixel],
    (columns, rows): (usize, usize),
    [x, y, w, h]: [f64; 4],
    smooth: bool,
    colour: fn(f64) -> [u8; 3],
) -> String {
    let Some(bytes) = png(pixels, columns, rows, colour) else { return String::new() };
    let rendering = if smooth { "auto" } else { "pixelated" };
    format!(
        "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" \
         preserveAspectRatio=\"none\" style=\"image-rendering:{rendering}\" \
         href=\"data:image/png;base64,{}\"/>",
        STANDARD.encode(bytes),
    )
}

fn png(
    pixels: &[Pixel],
    columns: usize,
    rows: usize,
    colour: fn(f64) -> [u8; 3],
) -> Option<Vec<u8>> {
    if pixels.is_empty() || pixels.len() != columns * rows {
        return None;
    }
    let indices: Vec<u8> = pixels
        .iter()
        .map(|pixel| match pixel {
            Pixel::Empty => EMPTY,
            Pixel::Hatch => HATCH,
            Pixel::At(place) if place.is_nan() => EMPTY,
            Pixel::At(place) => {
                let fraction = f64::midpoint(place.clamp(-1.0, 1.0), 1.0);
                (fraction * f64::from(COLOURS - 1)).round() as u8
            }
        })
        .collect();
    let palette: Vec<u8> = (0..COLOURS)
        .flat_map(|i| colour(2.0 * f64::from(i) / f64::from(COLOURS - 1) - 1.0))
        .chain([0x9f, 0xa8, 0xb1, 255, 255, 255])
        .collect();
    let mut opaque = vec![255_u8; usize::from(EMPTY)];
    opaque.push(0);
    let mut bytes = Vec::new();
    let mut encoder =
        png::Encoder::new(&mut bytes, u32::try_from(columns).ok()?, u32::try_from(rows).ok()?);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_palette(palette);
    encoder.set_trns(opaque);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(&indices).ok()?;
    writer.finish().ok()?;
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_come_back() {
        let pixels = [
            Pixel::At(0.0),
            Pixel::At(-1.0),
            Pixel::At(7.0),
            Pixel::Empty,
            Pixel::Hatch,
            Pixel::At(f64::NAN),
        ];
        let bytes = png(&pixels, 3, 2, diverging_rgb).unwrap();
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut rgba = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgba).unwrap();
        assert!(rgba[..3].iter().all(|c| *c > 244), "zero is white: {rgba:?}");
        assert_eq!(rgba[4..8], [5, 48, 97, 255], "the lower end is blue");
        assert_eq!(rgba[8..12], [103, 0, 31, 255], "beyond the upper end is its red");
        assert_eq!((rgba[15], rgba[23]), (0, 0), "no value is transparent");
    }

    #[test]
    fn nothing_is_no_picture() {
        assert_eq!(image(&[], (0, 0), [0.0; 4], true), "");
        assert_eq!(image(&[Pixel::Empty], (3, 3), [0.0; 4], true), "");
    }
}
