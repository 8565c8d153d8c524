//! A body and its air for the real firmware: the physics side of ArduPilot SITL's JSON interface.
//!
//! ArduPilot's simulator build sends the pulses of its outputs over UDP and waits for the motion
//! that follows from them; its clock is the time stamp in the reply. Both sides go in lockstep, so a
//! flight does not depend on how fast either runs.
//!
//! [`ServoPacket`] is what comes, [`Instance`] answers it (bytes in, text out, no socket, no clock),
//! [`serve`] puts an instance behind a UDP socket. The reply is where the show frame becomes north,
//! east, down and the body's forward, left, up becomes forward, right, down.
//!
//! Source: ArduPilot, libraries/SITL/examples/JSON/readme.md and SIM_JSON.cpp (4.4 to 4.7).

mod imu;
mod instance;
mod packet;
mod reply;
mod serve;
mod track;

pub use instance::{Instance, InstanceSetup, Refusal, Status};
pub use packet::{MAX_PACKET_BYTES, PacketError, ServoPacket};
pub use serve::serve;

/// UDP port on which ArduPilot expects the physics of its first instance (`-I0`).
pub const BASE_PORT: u16 = 9002;
/// Difference between the ports of ArduPilot's instances `-I n` and `-I n+1`.
pub const PORTS_PER_INSTANCE: u16 = 10;
