//! Series as short text for the page's scripts: whole steps, differences between neighbours, seven bits a byte,
//! base64. `templates/report/shared.js` reads them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

/// Largest number of steps from zero; beyond it a value is cut.
const MOST_STEPS: f64 = 1e9;

/// Rows of values in one text. Each row is coded by itself.
#[derive(Default)]
pub(super) struct Packed {
    bytes: Vec<u8>,
}

impl Packed {
    /// Adds a row of values, in whole steps of this size.
    pub(super) fn row(&mut self, values: impl IntoIterator<Item = Option<f64>>, step: f64) {
        let mut before = 0_i64;
        for value in values {
            let Some(steps) = value.filter(|value| value.is_finite()).map(|value| value / step)
            else {
                self.bytes.push(0);
                continue;
            };
            let steps = steps.round().clamp(-MOST_STEPS, MOST_STEPS) as i64;
            let change = steps - before;
            before = steps;
            // Small changes of either sign are small numbers; zero stands for no value.
            let mut code = ((change << 1) ^ (change >> 63)).cast_unsigned() + 1;
            while code >= 0x80 {
                self.bytes.push((code & 0x7f) as u8 | 0x80);
                code >>= 7;
            }
            self.bytes.push(code as u8);
        }
    }

    /// All rows as base64.
    pub(super) fn finish(&self) -> String {
        STANDARD.encode(&self.bytes)
    }
}

/// Rows of values as text.
pub(super) fn packed<R>(rows: impl IntoIterator<Item = R>, step: f64) -> String
where
    R: IntoIterator<Item = Option<f64>>,
{
    let mut packed = Packed::default();
    for row in rows {
        packed.row(row, step);
    }
    packed.finish()
}

/// What the page's script makes of it: rows of `length` values.
#[cfg(test)]
pub(super) fn unpacked(text: &str, length: usize, step: f64) -> Vec<Vec<Option<f64>>> {
    let bytes = STANDARD.decode(text).unwrap();
    let mut codes = Vec::new();
    let (mut code, mut shift) = (0_u64, 0);
    for byte in bytes {
        code |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            codes.push(code);
            (code, shift) = (0, 0);
        }
    }
    let row = |codes: &[u64]| {
        let mut steps = 0_i64;
        let one = |code: &u64| {
            let zigzag = code.checked_sub(1)?;
            steps += (zigzag >> 1).cast_signed() ^ -(zigzag & 1).cast_signed();
            Some(steps as f64 * step)
        };
        codes.iter().map(one).collect()
    };
    codes.chunks(length.max(1)).map(row).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_is_read_is_what_was_written_to_half_a_step(
            rows in prop::collection::vec(
                prop::collection::vec(prop::option::weighted(0.9, -1e5..1e5_f64), 7), 0..9),
            step in prop::sample::select(vec![0.001, 0.01, 0.1, 1.0]),
        ) {
            let text = packed(rows.iter().cloned(), step);
            let back = unpacked(&text, 7, step);
            prop_assert_eq!(back.len(), rows.len());
            for (written, read) in rows.iter().flatten().zip(back.iter().flatten()) {
                prop_assert_eq!(written.is_some(), read.is_some());
                let error = written.zip(*read).map_or(0.0, |(written, read)| (written - read).abs());
                prop_assert!(error <= 0.5 * step * (1.0 + 1e-6), "{:?} became {:?}", written, read);
            }
        }
    }

    #[test]
    fn nonsense_is_no_value_and_the_huge_is_cut() {
        let text = packed([[Some(f64::NAN), Some(f64::INFINITY), Some(1e300), Some(1.0)]], 0.01);
        let back = unpacked(&text, 4, 0.01).remove(0);
        assert_eq!(back, [None, None, Some(1e9 * 0.01), Some(1.0)]);
    }

    #[test]
    fn what_stands_still_takes_a_byte_a_value() {
        let text = packed([vec![Some(99.87); 600]], 0.01);
        assert!(text.len() <= 4 * 602 / 3 + 4, "{}", text.len());
    }
}
