//! Field letters: how a value lies in the bytes and what it stands for.
//!
//! Scaled letters are divided by 100 or 1e7, not multiplied by the inverse: the quotient is the
//! double nearest to the decimal value, and other parsers do the same.

use super::writer::Value;
use untrusted_io::plain::plain_string;

/// A field's storage, one variant per letter that differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Letter {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
    /// Signed 16-bit, hundredths: `c`.
    CentiI16,
    /// Unsigned 16-bit, hundredths: `C`.
    CentiU16,
    /// Signed 32-bit, hundredths: `e`.
    CentiI32,
    /// Unsigned 32-bit, hundredths: `E`.
    CentiU32,
    /// Degrees in units of 1e-7: `L`.
    Degrees,
    Text4,
    Text16,
    Text64,
    /// 32 signed 16-bit samples: `a`.
    Samples,
}

impl Letter {
    pub(super) fn from_byte(letter: u8) -> Option<Self> {
        Some(match letter {
            b'b' => Self::I8,
            b'B' | b'M' => Self::U8,
            b'h' => Self::I16,
            b'H' => Self::U16,
            b'i' => Self::I32,
            b'I' => Self::U32,
            b'q' => Self::I64,
            b'Q' => Self::U64,
            b'g' => Self::F16,
            b'f' => Self::F32,
            b'd' => Self::F64,
            b'c' => Self::CentiI16,
            b'C' => Self::CentiU16,
            b'e' => Self::CentiI32,
            b'E' => Self::CentiU32,
            b'L' => Self::Degrees,
            b'n' => Self::Text4,
            b'N' => Self::Text16,
            b'Z' => Self::Text64,
            b'a' => Self::Samples,
            _ => return None,
        })
    }

    /// Bytes that a field takes.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 | Self::CentiI16 | Self::CentiU16 => 2,
            Self::I32
            | Self::U32
            | Self::F32
            | Self::CentiI32
            | Self::CentiU32
            | Self::Degrees
            | Self::Text4 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
            Self::Text16 => 16,
            Self::Text64 | Self::Samples => 64,
        }
    }

    pub(super) const fn is_text(self) -> bool {
        matches!(self, Self::Text4 | Self::Text16 | Self::Text64)
    }

    /// The number at the start of `bytes`, in engineering units; NaN for a text, an array or too
    /// few bytes. 64-bit integers beyond 2^53 lose their last digits.
    pub(super) fn number(self, bytes: &[u8]) -> f64 {
        self.decode(One { bytes })
    }

    /// Appends the numbers at `offset` of the messages that start at `starts`, as
    /// [`Letter::number`] gives them.
    pub(super) fn column(self, bytes: &[u8], starts: &[usize], offset: usize, out: &mut Vec<f64>) {
        self.decode(Many { bytes, starts, offset, out });
    }

    /// Hands the letter's conversion to `sink`, which thus is compiled for each letter apart.
    fn decode<S: Sink>(self, sink: S) -> S::Output {
        match self {
            Self::I8 => sink.numbers(|b| f64::from(i8::from_le_bytes(b))),
            Self::U8 => sink.numbers(|b| f64::from(u8::from_le_bytes(b))),
            Self::I16 => sink.numbers(|b| f64::from(i16::from_le_bytes(b))),
            Self::U16 => sink.numbers(|b| f64::from(u16::from_le_bytes(b))),
            Self::I32 => sink.numbers(|b| f64::from(i32::from_le_bytes(b))),
            Self::U32 => sink.numbers(|b| f64::from(u32::from_le_bytes(b))),
            Self::I64 => sink.numbers(|b| i64::from_le_bytes(b) as f64),
            Self::U64 => sink.numbers(|b| u64::from_le_bytes(b) as f64),
            Self::F16 => sink.numbers(|b| half(u16::from_le_bytes(b))),
            Self::F32 => sink.numbers(|b| f64::from(f32::from_le_bytes(b))),
            Self::F64 => sink.numbers(f64::from_le_bytes),
            Self::CentiI16 => sink.numbers(|b| f64::from(i16::from_le_bytes(b)) / 100.0),
            Self::CentiU16 => sink.numbers(|b| f64::from(u16::from_le_bytes(b)) / 100.0),
            Self::CentiI32 => sink.numbers(|b| f64::from(i32::from_le_bytes(b)) / 100.0),
            Self::CentiU32 => sink.numbers(|b| f64::from(u32::from_le_bytes(b)) / 100.0),
            Self::Degrees => sink.numbers(|b| f64::from(i32::from_le_bytes(b)) / 1e7),
            Self::Text4 | Self::Text16 | Self::Text64 | Self::Samples => {
                sink.numbers(|_: [u8; 0]| f64::NAN)
            }
        }
    }

    /// Appends a value; false (and nothing appended) if the letter cannot hold that kind of value.
    #[inline]
    pub(super) fn encode(self, value: Value<'_>, out: &mut Vec<u8>) -> bool {
        // Float-to-integer `as` saturates and takes NaN to 0.
        let whole = |scale: f64| match value {
            Value::Int(whole) => Some(whole as f64 * scale),
            Value::Float(float) => Some((float * scale).round()),
            Value::Text(_) => None,
        };
        let integer = || match value {
            Value::Int(whole) => Some(whole),
            Value::Float(float) => Some(float.round() as i64),
            Value::Text(_) => None,
        };
        macro_rules! put {
            ($number:expr, $convert:expr) => {
                match $number {
                    Some(number) => {
                        out.extend_from_slice(&$convert(number).to_le_bytes());
                        true
                    }
                    None => false,
                }
            };
        }
        macro_rules! clamp {
            ($kind:ty) => {
                |number: i64| number.clamp(<$kind>::MIN as i64, <$kind>::MAX as i64) as $kind
            };
        }
        match self {
            Self::I8 => put!(integer(), clamp!(i8)),
            Self::U8 => put!(integer(), clamp!(u8)),
            Self::I16 => put!(integer(), clamp!(i16)),
            Self::U16 => put!(integer(), clamp!(u16)),
            Self::I32 => put!(integer(), clamp!(i32)),
            Self::U32 => put!(integer(), clamp!(u32)),
            Self::I64 => put!(integer(), |number: i64| number),
            Self::U64 => match value {
                // A float may exceed what the signed route can carry.
                Value::Float(float) => put!(Some(float.round()), |number: f64| number as u64),
                _ => put!(integer(), |number: i64| number.max(0) as u64),
            },
            Self::F32 => put!(float(value), single),
            Self::F64 => put!(float(value), |number: f64| number),
            Self::CentiI16 => put!(whole(100.0), |number: f64| number as i16),
            Self::CentiU16 => put!(whole(100.0), |number: f64| number as u16),
            Self::CentiI32 => put!(whole(100.0), |number: f64| number as i32),
            Self::CentiU32 => put!(whole(100.0), |number: f64| number as u32),
            Self::Degrees => put!(whole(1e7), |number: f64| number as i32),
            Self::Text4 => text::<4>(value, out),
            Self::Text16 => text::<16>(value, out),
            Self::Text64 => text::<64>(value, out),
            Self::F16 | Self::Samples => false,
        }
    }
}

/// Receiver of decoded numbers.
trait Sink {
    type Output;

    /// `value` turns the stored bytes into the number.
    fn numbers<const N: usize>(self, value: impl Fn([u8; N]) -> f64) -> Self::Output;
}

struct One<'a> {
    bytes: &'a [u8],
}

impl Sink for One<'_> {
    type Output = f64;

    fn numbers<const N: usize>(self, value: impl Fn([u8; N]) -> f64) -> f64 {
        self.bytes.first_chunk().map_or(f64::NAN, |chunk| value(*chunk))
    }
}

struct Many<'a> {
    bytes: &'a [u8],
    starts: &'a [usize],
    offset: usize,
    out: &'a mut Vec<f64>,
}

impl Sink for Many<'_> {
    type Output = ();

    fn numbers<const N: usize>(self, value: impl Fn([u8; N]) -> f64) {
        self.out.extend(self.starts.iter().map(|start| {
            let field = self.bytes.get(start + self.offset..).and_then(<[u8]>::first_chunk);
            field.map_or(f64::NAN, |chunk| value(*chunk))
        }));
    }
}

/// The text in a fixed-size field: up to the first NUL, bytes that are no UTF-8 replaced,
/// and made plain: whoever wrote the log wrote it.
pub(super) fn field_text(field: &[u8]) -> String {
    let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
    plain_string(String::from_utf8_lossy(&field[..end]).into_owned())
}

fn float(value: Value<'_>) -> Option<f64> {
    match value {
        Value::Int(whole) => Some(whole as f64),
        Value::Float(float) => Some(float),
        Value::Text(_) => None,
    }
}

/// Finite values beyond the range of `f32` become its largest, not infinity.
fn single(number: f64) -> f32 {
    if number.is_finite() {
        number.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
    } else {
        number as f32
    }
}

fn text<const N: usize>(value: Value<'_>, out: &mut Vec<u8>) -> bool {
    let Value::Text(text) = value else { return false };
    let cut = &text.as_bytes()[..text.floor_char_boundary(N)];
    out.extend_from_slice(cut);
    out.resize(out.len() + N - cut.len(), 0);
    true
}

/// IEEE 754 half precision.
fn half(bits: u16) -> f64 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x3ff);
    match (bits >> 10) & 0x1f {
        0 => sign * fraction * 2f64.powi(-24),
        0x1f if fraction == 0.0 => sign * f64::INFINITY,
        0x1f => f64::NAN,
        exponent => sign * (1.0 + fraction / 1024.0) * 2f64.powi(i32::from(exponent) - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(letter: u8, value: Value<'_>) -> Vec<u8> {
        let mut out = Vec::new();
        assert!(Letter::from_byte(letter).unwrap().encode(value, &mut out));
        out
    }

    #[test]
    fn values_saturate_at_the_ends_of_their_field() {
        assert_eq!(stored(b'B', Value::Int(300)), [255]);
        assert_eq!(stored(b'B', Value::Int(-1)), [0]);
        assert_eq!(stored(b'c', Value::Float(1e9)), i16::MAX.to_le_bytes());
        assert_eq!(stored(b'C', Value::Float(-0.01)), [0, 0]);
        assert_eq!(stored(b'f', Value::Float(1e300)), f32::MAX.to_le_bytes());
        assert_eq!(stored(b'Q', Value::Int(-5)), [0; 8]);
        assert_eq!(stored(b'h', Value::Float(f64::NAN)), [0, 0]);
        assert_eq!(stored(b'L', Value::Float(-35.363261)), (-353632610i32).to_le_bytes());
    }

    #[test]
    fn texts_are_cut_between_characters() {
        assert_eq!(stored(b'n', Value::Text("abcdef")), *b"abcd");
        assert_eq!(stored(b'n', Value::Text("abc\u{e9}")), *b"abc\0");
    }

    #[test]
    fn halves_decode() {
        let cases =
            [(0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (0x0001, 5.960464477539063e-8)];
        for (bits, value) in cases {
            assert_eq!(half(bits), value);
        }
        assert_eq!(half(0xfc00), f64::NEG_INFINITY);
        assert!(half(0x7e00).is_nan());
    }
}
