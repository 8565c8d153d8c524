//! Addresses of links, as `--connect` takes them.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use untrusted_io::file::read_whole;
use untrusted_io::plain::{Shown as _, acts};

/// A link and the network it belongs to.
///
/// ```
/// use mavlink_station::link::address::{Address, Way};
///
/// let radio: Address = "1@serial:/dev/ttyUSB0:57600".parse()?;
/// assert_eq!(radio.network, 1);
/// assert_eq!(radio.way, Way::Serial("/dev/ttyUSB0".to_owned(), 57_600));
/// # Ok::<(), mavlink_station::link::address::AddressError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Network of the link: vehicles with equal system ids in different networks are different
    /// vehicles.
    pub network: u16,
    /// Transport of the link.
    pub way: Way,
}

/// Transport of a link, with its address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Way {
    /// A UDP socket that listens; answers go to where each vehicle was heard.
    UdpIn(String),
    /// A UDP socket that sends to this address first.
    UdpOut(String),
    /// A connection to a TCP server, such as the firmware's simulator.
    Tcp(String),
    /// A serial radio, by device and baud rate.
    Serial(String, u32),
}

/// Error of an address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// The address has no known form.
    #[error(
        "{text:?} is not a link: give udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, \
         serial:DEVICE:BAUD or a file with one of these per line; N@ before it puts it into \
         network N"
    )]
    Form {
        /// Text that was given.
        text: String,
    },
    /// A number in the address is not valid.
    #[error("{text:?}: {part:?} is no {what}")]
    Number {
        /// Text that was given.
        text: String,
        /// Part of the text that is not valid.
        part: String,
        /// Name of the number that it should be.
        what: &'static str,
    },
    /// A list file cannot be read.
    #[error("cannot read the list of links {}: {reason}", path.shown())]
    List {
        /// Path of the list file.
        path: PathBuf,
        /// Reason why it cannot be read.
        reason: String,
    },
    /// A line of a list file is not valid.
    #[error("{}:{line}: {source}", path.shown())]
    Line {
        /// Path of the list file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Error of the address on the line.
        source: Box<AddressError>,
    },
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.network != 0 {
            write!(f, "{}@", self.network)?;
        }
        match &self.way {
            Way::UdpIn(host) => write!(f, "udpin:{host}"),
            Way::UdpOut(host) => write!(f, "udpout:{host}"),
            Way::Tcp(host) => write!(f, "tcp:{host}"),
            Way::Serial(device, baud) => write!(f, "serial:{device}:{baud}"),
        }
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.contains(acts) {
            return Err(AddressError::Form { text: text.to_owned() });
        }
        let number = |part: &str, what| AddressError::Number {
            text: text.to_owned(),
            part: part.to_owned(),
            what,
        };
        let (network, link) = match text.split_once('@') {
            Some((network, link)) => {
                (network.parse().map_err(|_| number(network, "network number"))?, link)
            }
            None => (0, text),
        };
        let form = || AddressError::Form { text: text.to_owned() };
        let (kind, rest) = link.split_once(':').ok_or_else(form)?;
        let (head, tail) = rest.rsplit_once(':').ok_or_else(form)?;
        if head.is_empty() {
            return Err(form());
        }
        let host = || match tail.parse::<u16>() {
            Ok(port) if port != 0 => Ok(rest.to_owned()),
            _ => Err(number(tail, "port (1 to 65535)")),
        };
        let way = match kind {
            "udpin" => Way::UdpIn(host()?),
            "udpout" => Way::UdpOut(host()?),
            "tcp" | "tcpout" => Way::Tcp(host()?),
            "serial" => {
                let baud = tail.parse().map_err(|_| number(tail, "baud rate"))?;
                Way::Serial(head.to_owned(), baud)
            }
            _ => return Err(form()),
        };
        Ok(Self { network, way })
    }
}

/// Most links in one list.
const MOST: usize = 1_000;
/// Longest list file, bytes.
const LONGEST_LIST: u64 = 1_000_000;

/// Links of one `--connect`: an address, or a file that lists addresses (one per line, `#` begins a
/// comment).
///
/// # Errors
///
/// If the address has no known form, a number in it is not valid, or the list file cannot be read.
pub fn links(text: &str) -> Result<Vec<Address>, AddressError> {
    let path = Path::new(text);
    match text.parse() {
        Ok(address) => Ok(vec![address]),
        Err(_) if path.is_file() => list(path),
        Err(error) => Err(error),
    }
}

fn list(path: &Path) -> Result<Vec<Address>, AddressError> {
    let unreadable = |reason: String| AddressError::List { path: path.to_owned(), reason };
    let bytes =
        read_whole(path, LONGEST_LIST).map_err(|error| unreadable(error.source.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|error| unreadable(error.to_string()))?;
    let mut links = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        links.push(line.parse().map_err(|source| AddressError::Line {
            path: path.to_owned(),
            line: index + 1,
            source: Box::new(source),
        })?);
    }
    match links.len() {
        0 => Err(unreadable("it lists no link".to_owned())),
        1..=MOST => Ok(links),
        count => Err(unreadable(format!("it lists {count} links; {MOST} can be open"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_read_as_they_are_written() {
        for text in [
            "udpin:0.0.0.0:14550",
            "1@udpout:10.0.0.7:14555",
            "tcp:localhost:5760",
            "udpin:[::1]:14550",
            "serial:/dev/ttyUSB0:57600",
        ] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let text = |link: &str| links(link).unwrap_err().to_string();
        assert!(text("udp:14550").contains("give udpin:HOST:PORT"));
        assert!(text("udpin:0.0.0.0:0").contains("\"0\" is no port"));
        assert!(text("x@tcp:a:1").contains("\"x\" is no network number"));
        assert!(text("serial:/dev/ttyS0:fast").contains("\"fast\" is no baud rate"));
    }

    #[test]
    fn a_wrong_line_of_a_list_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fleet.txt");
        std::fs::write(&path, "# field radios\ntcp:10.0.0.1:5760\n\n1@tcp:10.0.0.2:5760 # spare\n")
            .unwrap();
        assert_eq!(links(path.to_str().unwrap()).unwrap().len(), 2);
        std::fs::write(&path, "tcp:a:1\nradio 7\n").unwrap();
        assert!(links(path.to_str().unwrap()).unwrap_err().to_string().contains("fleet.txt:2: "));
    }
}
