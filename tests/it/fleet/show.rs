//! A small plan, and vehicles that do what they are told except for one fault.

#![allow(dead_code, reason = "each test uses its part")]
#![allow(clippy::allow_attributes, reason = "unused in some tests only")]

use std::collections::BTreeMap;

use nalgebra::Vector3;
use updraft::fleet::dry_run::Obliging;
use updraft::fleet::slots::FleetTable;
use updraft::link::clock::{MS, Micros, S};
use updraft::link::conversation::{Conversation, run_all};
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavCmd, MavMissionResult, MavResult};
use updraft::link::id::DroneId;
use updraft::mission::Plan;
use updraft::protocol::ftp::{Op, Packet};
use updraft::protocol::show::{FROM_DRONE, Stage, Status};
use updraft::virtual_fleet::endpoint::Endpoint;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};

use crate::fleet::loaded::hover;
pub(crate) use crate::fleet::loaded::load;

pub(crate) type Net = LossyNet<Scripted>;

pub(crate) fn drone(system: u8) -> DroneId {
    DroneId { network: 0, system }
}

/// A hover of 2 x 3 drones.
pub(crate) fn plan() -> Plan {
    hover(2, 3)
}

pub(crate) fn table(plan: &Plan) -> FleetTable {
    FleetTable::new(plan.slots.iter().map(|slot| (drone(slot.slot as u8), slot.slot)))
}

/// What a vehicle does not do as it should.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Fault {
    #[default]
    None,
    /// Says nothing.
    Silent,
    /// Refuses this command with this result.
    Refuses(MavCmd, MavResult),
    /// Never answers this command.
    Ignores(MavCmd),
    /// Accepts a reload and has no show: the file is missing on board.
    LosesFile,
    /// Loses these flags of its status after a reload.
    LacksFlags(u8),
    /// Does not clear.
    KeepsShow,
    /// Stays in this stage.
    Stage(Stage),
    /// Refuses this file operation with this reason.
    FileRefused(Op, u8),
    /// Writes other bytes.
    BadCard,
    /// Refuses the fence.
    FenceRefused,
    /// Moves a corner.
    FenceMoved,
    /// Keeps FENCE_ALT_MAX as it is.
    ParamKept,
    /// Stops sending its status once a reload came.
    StatusStops,
}

/// An obliging vehicle with a fault.
#[derive(Clone, Debug)]
pub(crate) struct Scripted {
    pub(crate) inner: Obliging,
    pub(crate) fault: Fault,
    pub(crate) heard: Vec<MavMessage>,
    reloaded: bool,
}

impl Scripted {
    pub(crate) fn new(inner: Obliging, fault: Fault) -> Self {
        Self { inner, fault, heard: Vec::new(), reloaded: false }
    }

    fn ack(command: MavCmd, result: MavResult) -> MavMessage {
        MavMessage::COMMAND_ACK(dialect::COMMAND_ACK_DATA { command, result, ..Default::default() })
    }

    /// Whether the fault has dealt with the message.
    fn fails(&mut self, message: &MavMessage, out: &mut Vec<MavMessage>) -> bool {
        let command = match message {
            MavMessage::COMMAND_LONG(c) => Some((c.command, c.param1)),
            MavMessage::COMMAND_INT(c) => Some((c.command, c.param1)),
            _ => None,
        };
        let is_clear = command == Some((MavCmd::MAV_CMD_USER_1, 1.0));
        let is_reload = command == Some((MavCmd::MAV_CMD_USER_1, 0.0));
        self.reloaded |= is_reload;
        match (self.fault, message) {
            (Fault::Silent, _) => true,
            (Fault::Refuses(refused, result), _) if !is_clear => {
                let hit = command.is_some_and(|(command, _)| command == refused);
                if hit {
                    out.push(Self::ack(refused, result));
                }
                hit
            }
            (Fault::Ignores(ignored), _) if !is_clear => {
                command.is_some_and(|(command, _)| command == ignored)
            }
            (Fault::LosesFile, _) if is_reload => {
                self.inner.files.clear();
                false
            }
            (Fault::KeepsShow, _) if is_clear => true,
            (Fault::KeepsShow, _) if is_reload => {
                out.push(Self::ack(MavCmd::MAV_CMD_USER_1, MavResult::MAV_RESULT_FAILED));
                true
            }
            (Fault::FileRefused(op, reason), MavMessage::FILE_TRANSFER_PROTOCOL(data)) => {
                let request = Packet::from_payload(&data.payload).unwrap();
                if request.op != op {
                    return false;
                }
                let mut answer = Packet::request(Op::Nak).with_data(&[reason]);
                answer.sequence = request.sequence.wrapping_add(1);
                answer.session = request.session;
                answer.request = op;
                out.push(updraft::fleet::messages::ftp(drone(0), &answer));
                true
            }
            (Fault::BadCard, MavMessage::FILE_TRANSFER_PROTOCOL(data)) => {
                let request = Packet::from_payload(&data.payload).unwrap();
                if request.op == Op::CalcFileCRC32 {
                    for file in self.inner.files.values_mut() {
                        file[0] ^= 1;
                    }
                }
                false
            }
            (Fault::FenceRefused, MavMessage::MISSION_COUNT(count)) => {
                out.push(MavMessage::MISSION_ACK(dialect::MISSION_ACK_DATA {
                    mavtype: MavMissionResult::MAV_MISSION_NO_SPACE,
                    mission_type: count.mission_type,
                    ..Default::default()
                }));
                true
            }
            (Fault::FenceMoved, MavMessage::MISSION_REQUEST_LIST(_)) => {
                self.inner.fence[1].0 += 1;
                false
            }
            (Fault::ParamKept, MavMessage::PARAM_SET(set)) => {
                let name = updraft::fleet::messages::chars(&set.param_id[..]);
                if name != "FENCE_ALT_MAX" {
                    return false;
                }
                let read = updraft::fleet::messages::param_read(drone(1), &name);
                self.inner.params.insert(name, 100.0);
                self.inner.on_message(0, &read, out);
                true
            }
            _ => false,
        }
    }
}

impl Endpoint for Scripted {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        if !matches!(message, MavMessage::HEARTBEAT(_)) {
            self.heard.push(message.clone());
        }
        if !self.fails(message, out) {
            self.inner.on_message(now, message, out);
        }
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        let mut said = Vec::new();
        let next = self.inner.poll(now, &mut said);
        if self.fault == Fault::Silent {
            return next;
        }
        for message in &mut said {
            let MavMessage::DATA16(data) = message else { continue };
            if data.mavtype != FROM_DRONE {
                continue;
            }
            let mut status = Status::from_data(&data.data);
            match self.fault {
                Fault::Stage(stage) => status.stage = stage,
                Fault::LacksFlags(flags) if self.reloaded => status.flags &= !flags,
                Fault::StatusStops if self.reloaded => data.mavtype = 0,
                _ => {}
            }
            data.data = status.to_data();
        }
        out.extend(said);
        next
    }
}

/// Vehicles that stand on the slots of the plan, drone 1 on slot 1 and so on.
pub(crate) fn fleet(plan: &Plan, show: bool, faults: Faults, seed: u64) -> Net {
    let vehicles: BTreeMap<DroneId, Scripted> = plan
        .slots
        .iter()
        .map(|slot| {
            let id = drone(slot.slot as u8);
            let place = plan.site.frame().to_geodetic(Vector3::from(slot.home_m));
            (id, Scripted::new(Obliging::new(id, show, place), Fault::None))
        })
        .collect();
    LossyNet::new(vehicles, faults, seed)
}

/// One frame in five is lost, each way, and takes 200 ms.
pub(crate) fn bad() -> Faults {
    Faults { loss: 0.2, repeat: 0.05, delay: 200 * MS, jitter: 30 * MS, ..Faults::default() }
}

/// Runs one conversation with drone 1.
pub(crate) fn one<C: Conversation>(net: &mut Net, conversation: C) -> C::Done {
    let conversations = BTreeMap::from([(drone(1), conversation)]);
    let mut watch = updraft::link::conversation::NoObserver;
    run_all(net, conversations, 1, &mut watch).unwrap().remove(&drone(1)).expect("it ends")
}

/// Lets time pass; a watch hears everything.
pub(crate) fn pass(
    net: &mut Net,
    for_us: Micros,
    watch: &mut dyn updraft::link::conversation::Observer,
) {
    use updraft::link::net::Net as _;
    let until = net.now() + for_us;
    while net.now() < until {
        if let Some(received) = net.recv(until).unwrap() {
            watch.on_message(net.now(), &received);
        }
        watch.stop(net.now());
    }
}

/// Long enough for everyone to have said everything.
pub(crate) const A_WHILE: Micros = 12 * S;
