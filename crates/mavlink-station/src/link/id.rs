//! Identity of a vehicle on the air: its network and its system id.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A vehicle on the air. A MAVLink system id is one byte, so that 255 vehicles fill a network;
/// larger fleets are several networks, and only both together name a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct DroneId {
    /// The network, counted from 0 in the order of `--connect`.
    pub network: u16,
    /// The system id (SYSID_THISMAV), 1..=255.
    pub system: u8,
}

impl fmt::Display for DroneId {
    /// The system id alone in the first network, as crews with one network know it; else
    /// `network:system`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.network {
            0 => f.pad(&self.system.to_string()),
            network => f.pad(&format!("{network}:{}", self.system)),
        }
    }
}

/// Error of a text that is not a drone id.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is not a drone id: give a system id (1 to 255) or network:system, such as 1:12")]
pub struct NoDroneId {
    text: String,
}

impl FromStr for DroneId {
    type Err = NoDroneId;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (network, system) = text.split_once(':').unwrap_or(("0", text));
        let parsed = network.parse().ok().zip(system.parse().ok());
        parsed
            .filter(|(_, system)| *system != 0)
            .map(|(network, system)| Self { network, system })
            .ok_or_else(|| NoDroneId { text: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::DroneId;

    #[test]
    fn is_read_as_it_is_written() {
        for id in [DroneId { network: 0, system: 7 }, DroneId { network: 3, system: 255 }] {
            assert_eq!(id.to_string().parse(), Ok(id));
        }
        for wrong in ["", "0", "256", "1:0", "a", "1:2:3", "-1"] {
            assert!(wrong.parse::<DroneId>().is_err(), "{wrong}");
        }
    }
}
