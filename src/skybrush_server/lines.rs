//! Lines of text that arrive in pieces.

/// Takes bytes, gives lines; a line is bounded.
#[derive(Debug)]
pub(super) struct Lines {
    bytes: Vec<u8>,
    /// How much of `bytes` is known to hold no line's end.
    searched: usize,
    most: usize,
}

/// The line is longer than allowed.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct TooLong;

impl Lines {
    pub(super) fn new(most: usize) -> Self {
        Self { bytes: Vec::new(), searched: 0, most }
    }

    pub(super) fn push(&mut self, bytes: &[u8]) -> Result<(), TooLong> {
        self.bytes.extend_from_slice(bytes);
        let begun = self.bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        if self.bytes.len() - begun > self.most { Err(TooLong) } else { Ok(()) }
    }

    /// The next whole line, without its end.
    pub(super) fn next(&mut self) -> Option<Vec<u8>> {
        let found = self.bytes[self.searched..].iter().position(|byte| *byte == b'\n');
        let Some(found) = found else {
            self.searched = self.bytes.len();
            return None;
        };
        let rest = self.bytes.split_off(self.searched + found + 1);
        let mut line = std::mem::replace(&mut self.bytes, rest);
        self.searched = 0;
        line.pop();
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_out_whole_however_they_arrive() {
        let mut lines = Lines::new(10);
        for piece in [&b"on"[..], b"e\ntw", b"o\n\nth"] {
            lines.push(piece).unwrap();
        }
        let mut found = Vec::new();
        while let Some(line) = lines.next() {
            found.push(String::from_utf8(line).unwrap());
        }
        assert_eq!(found, ["one", "two", ""]);
        assert_eq!(lines.push(b"012345678"), Err(TooLong));
    }
}
