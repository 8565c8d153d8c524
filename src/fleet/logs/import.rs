//! Logs from cards: who flew where is in the logs themselves.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
