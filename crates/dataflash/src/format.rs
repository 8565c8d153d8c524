//! Message formats as a log itself defines them.

use super::letter::{Letter, field_text};

/// Type byte of the message that defines the others, the only one that is fixed.
pub(super) const FMT_ID: u8 = 128;

/// Bytes of an FMT row without its header.
const FMT_BODY: usize = 86;

/// One message type of a log.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Format {
    pub(super) name: String,
    pub(super) fields: Vec<Field>,
    /// Bytes of a message, header included.
    pub(super) length: u8,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    /// Empty if the labels were cut before this field.
    pub(super) label: String,
    pub(super) byte: u8,
    pub(super) letter: Letter,
    /// From the start of the message, header included.
    pub(super) offset: usize,
}

impl Format {
    /// The format that every log starts with.
    pub(super) fn of_fmt() -> Self {
        let letters = b"BBnNZ";
        let labels = "Type,Length,Name,Format,Columns";
        Self::new("FMT".into(), letters, labels, 89).unwrap_or_else(|| Self {
            name: String::new(),
            fields: Vec::new(),
            length: 89,
        })
    }

    /// The type byte and format in an FMT row (header included); `None` if its length is not that
    /// of its letters, so that it cannot be trusted to find the next message.
    pub(super) fn from_row(row: &[u8]) -> Option<(u8, Self)> {
        let body = row.get(3..)?.first_chunk::<FMT_BODY>()?;
        let (&[id, length], rest) = body.split_first_chunk::<2>()?;
        let (name, rest) = rest.split_first_chunk::<4>()?;
        let (letters, labels) = rest.split_first_chunk::<16>()?;
        let end = letters.iter().position(|&byte| byte == 0).unwrap_or(letters.len());
        let format = Self::new(field_text(name), letters.get(..end)?, &field_text(labels), length)?;
        if id == FMT_ID && format.length != 89 {
            return None;
        }
        Some((id, format))
    }

    fn new(name: String, letters: &[u8], labels: &str, length: u8) -> Option<Self> {
        let mut labels = labels.split(',');
        let mut offset = 3;
        let mut fields = Vec::with_capacity(letters.len());
        for &byte in letters {
            let letter = Letter::from_byte(byte)?;
            let label = labels.next().unwrap_or_default().to_owned();
            fields.push(Field { label, byte, letter, offset });
            offset += letter.size();
        }
        (offset == usize::from(length)).then_some(Self { name, fields, length })
    }

    pub(super) fn field(&self, label: &str) -> Option<(usize, &Field)> {
        self.fields.iter().enumerate().find(|(_, field)| field.label == label)
    }

    /// Whether a message starts with its time in microseconds.
    pub(super) fn is_timed(&self) -> bool {
        self.fields.first().is_some_and(|field| field.label == "TimeUS" && field.byte == b'Q')
    }

    /// The number in the field `label` of `message`.
    pub(super) fn number(&self, message: &[u8], label: &str) -> Option<f64> {
        let (_, field) = self.field(label)?;
        Some(field.letter.number(message.get(field.offset..)?))
    }

    /// The bytes of the field `label` of `message`.
    pub(super) fn bytes<'m>(&self, message: &'m [u8], label: &str) -> Option<&'m [u8]> {
        let (_, field) = self.field(label)?;
        message.get(field.offset..field.offset + field.letter.size())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(id: u8, length: u8, name: &[u8], letters: &[u8], labels: &[u8]) -> Vec<u8> {
        let mut row = vec![0xA3, 0x95, FMT_ID, id, length];
        for (text, size) in [(name, 4), (letters, 16), (labels, 64)] {
            let end = row.len() + size;
            row.extend_from_slice(text);
            row.resize(end, 0);
        }
        row
    }

    #[test]
    fn offsets_follow_the_letters() {
        let (id, format) =
            Format::from_row(&row(7, 3 + 8 + 2 + 16, b"ABCD", b"QcN", b"TimeUS,A,B")).unwrap();
        assert_eq!((id, format.name.as_str(), format.is_timed()), (7, "ABCD", true));
        let offsets: Vec<_> = format.fields.iter().map(|f| (f.label.as_str(), f.offset)).collect();
        assert_eq!(offsets, [("TimeUS", 3), ("A", 11), ("B", 13)]);
    }

    #[test]
    fn formats_whose_length_lies_are_refused() {
        for bad in [
            row(7, 12, b"LIE", b"Q", b"TimeUS"),
            row(7, 0, b"ZERO", b"", b""),
            row(7, 2, b"TWO", b"", b""),
            row(7, 255, b"MAX", b"ZZZZ", b"A,B,C,D"),
            row(7, 4, b"LETT", b"?", b"A"),
            row(FMT_ID, 4, b"FMT", b"B", b"Type"),
        ] {
            assert_eq!(Format::from_row(&bad), None);
        }
        assert_eq!(Format::from_row(&row(7, 4, b"OK", b"B", b"A")[..88]), None);
    }

    #[test]
    fn missing_labels_and_names_are_tolerated() {
        let (_, format) = Format::from_row(&row(7, 6, b"", b"BBB", b"A")).unwrap();
        assert_eq!(format.name, "");
        assert_eq!(format.fields[2].label, "");
    }
}
