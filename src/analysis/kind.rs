//! Names of the laws: their forms, their parameters, and their owners.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::flight::Indicator;

/// Form of a law. In files and tables it stands by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LawKind {
    /// The straight line `u = A' V + u0`.
    #[serde(rename = "linear")]
    Linear,
    /// The signed quadratic `u = A f(V - W) + u0`.
    #[serde(rename = "signed quadratic")]
    SignedQuadratic,
}

impl LawKind {
    /// Name of the form in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::SignedQuadratic => "signed quadratic",
        }
    }

    /// The signed quadratic for the line, and the line for the signed quadratic.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Linear => Self::SignedQuadratic,
            Self::SignedQuadratic => Self::Linear,
        }
    }
}

impl fmt::Display for LawKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A parameter of a law. In files it stands by its symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Symbol {
    /// Coefficient A of the signed quadratic.
    A,
    /// Slope A' of the line.
    #[serde(rename = "A'")]
    Slope,
    /// Effort in hover, u0.
    #[serde(rename = "u0")]
    U0,
    /// Vertical air speed W during the calibration.
    W,
}

impl Symbol {
    /// Parameters of the line, in their order.
    pub const LINEAR: [Self; 2] = [Self::Slope, Self::U0];
    /// Parameters of the signed quadratic, in their order.
    pub const SIGNED_QUADRATIC: [Self; 3] = [Self::A, Self::U0, Self::W];

    /// Symbol of the parameter in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::Slope => "A'",
            Self::U0 => "u0",
            Self::W => "W",
        }
    }

    /// Unit of the parameter in laws of an indicator.
    pub fn unit(self, indicator: Indicator) -> String {
        let effort = indicator.unit();
        match self {
            Self::A => format!("{effort}/(m/s)²"),
            Self::Slope => format!("{effort}/(m/s)"),
            Self::U0 => effort.to_owned(),
            Self::W => "m/s".to_owned(),
        }
    }
}

/// Owner of the law that a drone's effort was inverted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LawOf {
    /// The drone's own law.
    Own,
    /// The law of the drones' average.
    Flock,
}

impl LawOf {
    /// Name of the owner in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Flock => "flock",
        }
    }
}
