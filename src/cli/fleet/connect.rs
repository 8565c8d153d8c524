//! `--connect`: from words to links.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use crate::cli::context::{Context, complain};
use crate::cli::exit::CommandError;
use crate::link::address::{Address, links};
use crate::link::signing::{Key, exposure};
use crate::link::station::Station;
use crate::workflow::clock::{Clock, SinceNow};
use crate::workflow::fleet::links::open;

/// Where drones are listened for without a choice.
const DEFAULT_LINK: &str = "udpin:0.0.0.0:14550";

/// How drones are reached.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Links")]
pub(in crate::cli) struct ConnectArgs {
    /// How to reach the drones: udpin:HOST:PORT (listen), udpout:HOST:PORT, tcp:HOST:PORT,
    /// serial:DEVICE:BAUD, a file with one of these per line, skybrush://HOST:PORT (through Skybrush
    /// Server), or sim (virtual drones); can be repeated
    ///
    /// 1@udpin:... puts a link into network 1. System ids are one byte; the same id in another
    /// network is another drone.
    #[arg(long, value_name = "LINK", default_value = DEFAULT_LINK)]
    pub(in crate::cli) connect: Vec<String>,
    /// File with the signing key: every frame is signed, and frames not signed with it are refused
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) key: Option<PathBuf>,
    /// How long to wait for drones to be heard, s
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = seconds)]
    pub(in crate::cli) wait: f64,
}

/// Parser of waiting times.
pub(in crate::cli) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=86_400.0).contains(&value) => Ok(value),
        _ => Err("a time between 0 and 86400 s".to_owned()),
    }
}

/// What is behind `--connect`.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::cli) enum Target {
    /// Links to drones.
    Links(Vec<Address>),
    /// Virtual drones of our own.
    Sim,
    /// A Skybrush Server: `host:port` of its TCP interface.
    Server(String),
}

impl ConnectArgs {
    /// What the words mean.
    pub(in crate::cli) fn target(&self) -> Result<Target, CommandError> {
        let usage = |text: String| CommandError::Usage(text);
        if let [only] = self.connect.as_slice() {
            if only == "sim" {
                return Ok(Target::Sim);
            }
            if let Some(server) = only.strip_prefix("skybrush://") {
                let server = server.trim_end_matches('/');
                let has_port =
                    server.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
                let address = if has_port { server.to_owned() } else { format!("{server}:5001") };
                return Ok(Target::Server(address));
            }
        }
        let mut all = Vec::new();
        for words in &self.connect {
            if words == "sim" || words.starts_with("skybrush://") {
                return Err(usage(format!(
                    "--connect {words} cannot be combined with another link"
                )));
            }
            all.extend(links(words).map_err(|error| usage(error.to_string()))?);
        }
        Ok(Target::Links(all))
    }

    /// Opens the links.
    pub(in crate::cli) fn open(
        &self,
        context: &Context,
        links: Vec<Address>,
    ) -> Result<Station, CommandError> {
        let key = read_key(self.key.as_deref())?;
        let clock: Arc<dyn Clock> = Arc::new(SinceNow::of(context.clock()));
        open(links, key, &clock)
    }
}

/// The signing key in a file, if one is given.
pub(in crate::cli) fn read_key(path: Option<&Path>) -> Result<Option<Key>, CommandError> {
    let key = path.map(Key::from_file).transpose();
    if let Some(warning) = path.filter(|_| key.is_ok()).and_then(exposure) {
        complain(&format!("warning: {warning}"));
    }
    key.map_err(|error| CommandError::Usage(crate::cli::exit::with_reasons(&error)))
}
