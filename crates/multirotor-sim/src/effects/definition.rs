//! Definitions: the description of an effect for people and programs.

use schemars::JsonSchema;
use serde::Serialize;

use super::role::Role;
use crate::vehicle::Vehicle;

/// Most parameters an effect has.
pub const MAX_PARAMETERS: usize = 8;

/// Values of an effect's parameters, in the order of its definition; unused ones are 0.
pub type Values = [f64; MAX_PARAMETERS];

/// Description of an effect, for people and for the choice among effects.
#[derive(Debug)]
pub struct Definition {
    /// Standard name in kebab case, the key in vehicle files.
    pub name: &'static str,
    /// Title for tables and pages.
    pub title: &'static str,
    /// Action of the effect in one line.
    pub what: &'static str,
    /// Reason for the effect, and when it matters.
    pub explanation: &'static str,
    /// Formula as text.
    pub formula: &'static str,
    /// Source in the literature.
    pub source: &'static str,
    /// Effects in one class cannot be told apart by the paper's protocol.
    pub class: Class,
    /// Signals that its closed form looks at.
    pub signals: &'static [Signal],
    /// Parameters, at most [`MAX_PARAMETERS`].
    pub parameters: &'static [Parameter],
    /// Places in the simulator at which the effect acts.
    pub hooks: &'static [Hook],
    /// The signal along which it is shown, with the range.
    pub shown: (Signal, f64, f64),
    /// Way in which the effect is looked for where simulation and measurement disagree.
    pub sought: Sought,
}

impl Definition {
    /// Whether its closed form looks at a signal.
    pub fn looks_at(&self, signal: Signal) -> bool {
        self.signals.contains(&signal)
    }

    /// Whether it is a difference between drones and nothing else: the fleet's mean drone lacks it.
    pub fn is_difference(&self) -> bool {
        self.signals == [Signal::Drone] && self.hooks == [Hook::Drone]
    }

    /// Parameter of a name; `None` if there is none.
    pub fn parameter(&self, name: &str) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Parameter with a role; `None` if there is none.
    pub fn with_role(&self, role: Role) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.role == Some(role))
    }
}

/// Way in which an effect is looked for in the residual of measured against simulated pulses.
#[derive(Debug)]
pub enum Sought {
    /// By its closed form.
    Shape {
        /// The parameter that says how large it is.
        size: &'static str,
        /// Sizes to try on a vehicle that lacks the effect; the effect is 0 at size 0.
        sizes: fn(&Vehicle) -> &'static [f64],
        /// The usual size, where the parameter's default is not one.
        usual: Option<f64>,
        /// Another parameter that changes the shape, with values to try.
        shape: Option<(&'static str, &'static [f64])>,
    },
    /// Not in the pulse of steady flight: known physics that is computed, or another channel's; why,
    /// for people.
    No(&'static str),
}

/// One parameter of an effect.
#[derive(Debug)]
pub struct Parameter {
    /// Key in vehicle files.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Meaning of the parameter in a few words.
    pub what: &'static str,
    /// Smallest allowed value, in its unit.
    pub low: f64,
    /// Largest allowed value, in its unit.
    pub high: f64,
    /// Value when the vehicle's file states none.
    pub default: fn(&Vehicle) -> f64,
    /// Meaning to code that does not know the effect.
    pub role: Option<Role>,
}

/// Signals that a closed form looks at; the fields of [`super::Signals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Signal {
    /// Vertical speed relative to the air, m/s up.
    Climb,
    /// Horizontal speed relative to the air, m/s.
    Horizontal,
    /// Lean of the rotor axis into the wind, rad.
    Tilt,
    /// Height above ground, m.
    Height,
    /// Time since the motors started, s.
    Time,
    /// Air density as a share of sea level's.
    Density,
    /// Charge drawn from the battery, Ah.
    ChargeUsed,
    /// Vertical acceleration, m/s² up.
    Acceleration,
    /// Which drone: its deviation from the fleet in standard deviations.
    Drone,
    /// Drones next to this one in the array, 0..8.
    Neighbours,
    /// Change of the hover pulse by the rest of the model, us.
    ModelIncrement,
    /// Change of the pulse per vertical air speed, us/(m/s).
    Sensitivity,
}

impl Signal {
    /// Label with unit, for axes and tables.
    pub fn label(self) -> &'static str {
        match self {
            Self::Climb => "vertical speed relative to the air (m/s)",
            Self::Horizontal => "horizontal speed relative to the air (m/s)",
            Self::Tilt => "tilt (rad)",
            Self::Height => "height above ground (m)",
            Self::Time => "time since motor start (s)",
            Self::Density => "air density (share of sea level's)",
            Self::ChargeUsed => "charge used (Ah)",
            Self::Acceleration => "vertical acceleration (m/s²)",
            Self::Drone => "drone (standard deviations from the fleet)",
            Self::Neighbours => "neighbours",
            Self::ModelIncrement => "rest of the model (us)",
            Self::Sensitivity => "sensitivity to vertical air speed (us/(m/s))",
        }
    }
}

/// Place in the simulator at which an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Hook {
    /// Before the flight, on the drone itself.
    Drone = 1,
    /// On the air around the drone.
    Air = 2,
    /// On the way from command to motor.
    Command = 4,
    /// On thrust, torque and forces.
    Loads = 8,
    /// On what the autopilot takes for its vertical speed.
    Sense = 16,
    /// On what the log has for the vertical speed.
    Log = 32,
}

impl Hook {
    /// Object that the hook acts on, in words.
    pub fn what(self) -> &'static str {
        match self {
            Self::Drone => "the drone itself",
            Self::Air => "the air around it",
            Self::Command => "the way from command to motor",
            Self::Loads => "thrust, torque and forces",
            Self::Sense => "its own idea of its vertical speed",
            Self::Log => "the vertical speed in its log",
        }
    }
}

/// Effects that a flight of the paper's protocol cannot tell apart (they leave the same trace).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// Odd and linear in the vertical air speed.
    AxialLinear,
    /// Scales the odd response to vertical air speed.
    AxialShape,
    /// Only in fast descent; leans on the shape of the axial response.
    Descent,
    /// Slow change with time.
    TimeDrift,
    /// Slow change with height.
    HeightTrend,
    /// Only near the ground.
    NearGround,
    /// Grows with horizontal air speed or tilt.
    Horizontal,
    /// Constant offset of a drone.
    DroneOffset,
    /// Only while accelerating.
    Acceleration,
    /// In the vertical velocity's own channel.
    VelocityChannel,
}

impl Class {
    /// Name of the class in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::AxialLinear => "axial-linear",
            Self::AxialShape => "axial-shape",
            Self::Descent => "descent",
            Self::TimeDrift => "time-drift",
            Self::HeightTrend => "height-trend",
            Self::NearGround => "near-ground",
            Self::Horizontal => "horizontal",
            Self::DroneOffset => "drone-offset",
            Self::Acceleration => "acceleration",
            Self::VelocityChannel => "velocity-channel",
        }
    }
}
