//! Port and secrets of a campaign's page: kept for a day, so that a page finds a station again that was started anew.

use std::fs::OpenOptions;
use std::io::{self, Write as _};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::base::file::{FileError, read_whole};
use crate::base::parse;
use crate::base::private::open_own;

/// Name of the file in a campaign's folder; its user alone can read it.
pub const LIVE_FILE: &str = "fleet-live.json";
/// Name and version of its format.
pub const LIVE_SCHEMA: &str = "updraft.fleet-live/1";
/// The file is never larger, bytes.
const MOST_BYTES: u64 = 4 << 10;
/// Bytes of a secret.
const SECRET_BYTES: usize = 16;
/// Secrets are used so long, s.
const KEPT_S: u64 = 24 * 3600;

/// Port and secrets.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Secrets {
    /// Format name and version: [`LIVE_SCHEMA`].
    pub schema: String,
    /// Port that was listened at last; 0: none yet.
    pub port: u16,
    /// When the secrets were made, s since 1970.
    pub made_unix_s: u64,
    /// Secret of those who may look.
    pub look: String,
    /// Secret of those who may give orders.
    pub order: String,
}

impl std::fmt::Debug for Secrets {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Secrets").field("port", &self.port).finish_non_exhaustive()
    }
}

impl Secrets {
    /// Those of a campaign, or new ones of `random` bytes if there are none, or old ones.
    ///
    /// # Errors
    /// If there is no randomness.
    pub fn of(
        folder: &Path,
        unix_s: u64,
        mut random: impl FnMut(&mut [u8]) -> io::Result<()>,
    ) -> io::Result<Self> {
        let kept = read_whole(&folder.join(LIVE_FILE), MOST_BYTES).ok();
        let kept = kept.and_then(|bytes| parse::json::<Self>(&bytes).ok());
        let long = 2 * SECRET_BYTES;
        let good = kept.filter(|kept| {
            let is_young = unix_s.checked_sub(kept.made_unix_s).is_some_and(|age| age < KEPT_S);
            kept.schema == LIVE_SCHEMA
                && is_young
                && kept.look.len() == long
                && kept.order.len() == long
        });
        if let Some(kept) = good {
            return Ok(kept);
        }
        let mut secret = || {
            let mut bytes = [0; SECRET_BYTES];
            random(&mut bytes)?;
            Ok::<_, io::Error>(base16ct::lower::encode_string(&bytes))
        };
        Ok(Self {
            schema: LIVE_SCHEMA.to_owned(),
            port: 0,
            made_unix_s: unix_s,
            look: secret()?,
            order: secret()?,
        })
    }

    /// Keeps them for the next station of the campaign.
    ///
    /// # Errors
    /// If the file cannot be written, or belongs to somebody else.
    pub fn keep(&self, folder: &Path) -> Result<(), FileError> {
        let path = folder.join(LIVE_FILE);
        let failed = |source| FileError::new("write", &path, source);
        let bytes = serde_json::to_vec_pretty(self).map_err(|error| failed(error.into()))?;
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true);
        open_own(&path, &mut options).and_then(|mut file| file.write_all(&bytes)).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_kept_for_a_day_and_are_their_users_alone() {
        let folder = tempfile::tempdir().unwrap();
        let mut count = 0;
        let mut random = |bytes: &mut [u8]| {
            count += 1;
            bytes.fill(count);
            Ok(())
        };
        let mut made = Secrets::of(folder.path(), 1_000, &mut random).unwrap();
        assert_eq!(made.look, "01".repeat(16));
        assert_ne!(made.look, made.order);
        made.port = 8700;
        made.keep(folder.path()).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let mode = std::fs::metadata(folder.path().join(LIVE_FILE)).unwrap().permissions();
            assert_eq!(mode.mode() & 0o777, 0o600);
        }
        assert_eq!(Secrets::of(folder.path(), 2_000, &mut random).unwrap(), made);
        let later = Secrets::of(folder.path(), 1_000 + KEPT_S, &mut random).unwrap();
        assert_ne!(later.look, made.look);
        let earlier = Secrets::of(folder.path(), 999, &mut random).unwrap();
        assert_ne!(earlier.look, made.look, "made in the future");
        std::fs::write(folder.path().join(LIVE_FILE), "{\"look\": \"\"").unwrap();
        assert_eq!(Secrets::of(folder.path(), 2_000, &mut random).unwrap().port, 0);
    }
}
