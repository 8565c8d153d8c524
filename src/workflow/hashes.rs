//! SHA-256 of the files that were read, for the report. A file whose CRC-32 is asked first (against a
//! flight's record) is read once for both.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use sha2::{Digest, Sha256};

use crate::base::digest::hexadecimal;
use crate::base::file::{FileError, read_pieces};

/// SHA-256 hashes of files, by path; each file is read once.
#[derive(Debug, Default)]
pub struct Hashes {
    known: Mutex<BTreeMap<PathBuf, String>>,
}

impl Hashes {
    /// CRC-32 (that of ZIP files) of a file; its SHA-256 is known afterwards.
    pub(crate) fn crc32(&self, path: &Path) -> Result<u32, FileError> {
        let (mut crc32, mut sha256) = (crc32fast::Hasher::new(), Sha256::new());
        read_pieces(path, |piece| {
            crc32.update(piece);
            sha256.update(piece);
        })?;
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(path.to_owned(), hexadecimal(sha256));
        Ok(crc32.finalize())
    }

    /// SHA-256 of a file in hexadecimal.
    pub(crate) fn sha256(&self, path: &Path) -> Result<String, FileError> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(path).cloned();
        if let Some(known) = known {
            return Ok(known);
        }
        let mut sha256 = Sha256::new();
        read_pieces(path, |piece| sha256.update(piece))?;
        Ok(hexadecimal(sha256))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_give_the_files_hash() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, b"123456789").unwrap();
        let wanted = "15e2b0d3c33891ebb0f1ef609ec419420c20e320ce94c65fbc8c3312448eb225";
        let hashes = Hashes::default();
        assert_eq!(hashes.sha256(&path).unwrap(), wanted);
        assert_eq!(hashes.crc32(&path).unwrap(), 0xCBF4_3926);
        assert_eq!(hashes.sha256(&path).unwrap(), wanted);
        assert!(hashes.sha256(&folder.path().join("b")).is_err());
    }
}
