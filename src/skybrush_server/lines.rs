//! Lines of text that arrive in pieces.

/// Splitter of a stream of bytes into lines of bounded length.
#[derive(Debug)]
pub struct Lines {
    bytes: Vec<u8>,
    /// How much of `bytes` is known to hold no line's end.
    searched: usize,
    /// Where the last line, which has no end yet, begins.
    begun: usize,
    most: usize,
}

/// Error of a line that is longer than allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLong;

impl Lines {
    /// A splitter for lines of at most `most` bytes.
    pub fn new(most: usize) -> Self {
        Self { bytes: Vec::new(), searched: 0, begun: 0, most }
    }

    /// Takes bytes that have arrived. Each is examined once, however long its line becomes.
    ///
    /// # Errors
    /// When a line is too long; it is of no use to go on then.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(), TooLong> {
        let mut begun = self.begun;
        for (at, _) in bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n') {
            let end = self.bytes.len() + at;
            if end - begun > self.most {
                return Err(TooLong);
            }
            begun = end + 1;
        }
        if self.bytes.len() + bytes.len() - begun > self.most {
            return Err(TooLong);
        }
        self.begun = begun;
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    /// Takes the next whole line, without its end.
    pub fn next_line(&mut self) -> Option<Vec<u8>> {
        let found = self.bytes[self.searched..].iter().position(|byte| *byte == b'\n');
        let Some(found) = found else {
            self.searched = self.bytes.len();
            return None;
        };
        let end = self.searched + found + 1;
        let rest = self.bytes.split_off(end);
        let mut line = std::mem::replace(&mut self.bytes, rest);
        self.searched = 0;
        self.begun -= end;
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
        while let Some(line) = lines.next_line() {
            found.push(String::from_utf8(line).unwrap());
        }
        assert_eq!(found, ["one", "two", ""]);
        assert_eq!(lines.push(b"012345678"), Err(TooLong));
        lines.push(b"ree\n0123456789").unwrap();
        assert_eq!(lines.next_line().unwrap(), b"three");
        assert_eq!(lines.push(b"\n01234567890\n"), Err(TooLong), "though its end is there");
    }
}
