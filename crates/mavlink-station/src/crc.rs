//! CRC-32 that ArduPilot answers to MAVFTP's CalcFileCRC32.

/// CRC-32 with the reflected polynomial `0xEDB88320`, initial value 0 and no final XOR
/// (ArduPilot's `crc_crc32`).
///
/// ```
/// assert_eq!(mavlink_station::crc::ap_crc32(b"123456789"), 0x2DFD_2D88);
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
    /// Adds the next bytes.
    pub fn update(&mut self, data: &[u8]) {
        self.0.update(data);
    }

    /// Checksum of everything added so far.
    pub fn value(&self) -> u32 {
        !self.0.clone().finalize()
    }
}
