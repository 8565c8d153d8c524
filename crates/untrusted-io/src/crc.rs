//! Checksums by which files of vehicles and shows are told: the CRC-32 of ArduPilot (MAVFTP) and Skybrush
//! (`.skyb`), and that of ZIP files.

use std::path::Path;

use crate::file::{FileError, read_pieces};

/// CRC-32 with the reflected polynomial `0xEDB88320`, initial value 0 and no final XOR.
///
/// ```
/// assert_eq!(untrusted_io::crc::ap_crc32(b"123456789"), 0x2DFD_2D88);
/// assert_eq!(untrusted_io::crc::ap_crc32(b"hello-world"), 0xDA53_B3B7);
/// ```
pub fn ap_crc32(data: &[u8]) -> u32 {
    let mut crc = ApCrc32::default();
    crc.update(data);
    crc.value()
}

/// Incremental form of [`ap_crc32`], for data that arrives in pieces.
#[derive(Clone, Debug)]
pub struct ApCrc32(crc32fast::Hasher);

impl Default for ApCrc32 {
    fn default() -> Self {
        // crc32fast inverts before and after; starting it from !0 cancels the first inversion.
        Self(crc32fast::Hasher::new_with_initial(u32::MAX))
    }
}

impl ApCrc32 {
    /// Adds the next bytes to the checksum.
    pub fn update(&mut self, data: &[u8]) {
        self.0.update(data);
    }

    /// The checksum of everything added so far.
    pub fn value(&self) -> u32 {
        !self.0.clone().finalize()
    }
}

/// Size (bytes) and CRC-32 (that of ZIP files) of a file, read in pieces.
///
/// # Errors
///
/// If the file cannot be read.
pub fn file_crc32(path: &Path) -> Result<(u64, u32), FileError> {
    let mut hasher = crc32fast::Hasher::new();
    let size_bytes = read_pieces(path, |piece| hasher.update(piece))?;
    Ok((size_bytes, hasher.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bitwise(data: &[u8]) -> u32 {
        let mut crc = 0_u32;
        for byte in data {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
            }
        }
        crc
    }

    proptest! {
        #[test]
        fn equals_the_bitwise_definition(data in proptest::collection::vec(any::<u8>(), 0..300), cut in 0usize..300) {
            prop_assert_eq!(ap_crc32(&data), bitwise(&data));
            let (head, tail) = data.split_at(cut.min(data.len()));
            let mut pieces = ApCrc32::default();
            pieces.update(head);
            pieces.update(tail);
            prop_assert_eq!(pieces.value(), bitwise(&data));
        }
    }
}
