//! CRC-32 that ArduPilot answers to MAVFTP's CalcFileCRC32.

/// CRC-32 with the reflected polynomial `0xEDB88320`, initial value 0 and no final XOR
/// (ArduPilot's `crc_crc32`).
///
/// ```
/// assert_eq!(mavlink_station::crc::ap_crc32(b"123456789"), 0x2DFD_2D88);
/// ```
pub fn ap_crc32(data: &[u8]) -> u32 {
    // crc32fast inverts before and after; starting it from !0 cancels the first inversion.
    let mut hasher = crc32fast::Hasher::new_with_initial(u32::MAX);
    hasher.update(data);
    !hasher.finalize()
}
