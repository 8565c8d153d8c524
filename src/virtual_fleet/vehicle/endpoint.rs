//! Addressing of messages to a virtual vehicle, and the effect of each of them.

use super::{TICK, VirtualVehicle};
use crate::link::clock::{MS, Micros};
use crate::link::frame::{MavMessage, Sender, dialect};
use crate::link::station::STATION;
use crate::protocol::show::{self, SHOW_MODE, StartConfig};
use crate::virtual_fleet::endpoint::Endpoint;

impl VirtualVehicle<'_> {
    pub(super) fn take_start_packet(&mut self, now: Micros, packet: &dialect::DATA16_DATA) {
        if self.setup.stock || packet.mavtype != show::TO_DRONE {
            return;
        }
        let Some(start) = StartConfig::from_data(&packet.data, packet.len) else { return };
        let was_authorized = self.show.authorized;
        self.show.configure(&start, self.world.gps_us(now), &mut self.params);
        self.on_authorized(was_authorized);
    }

    fn on_authorized(&mut self, was_authorized: bool) {
        let by_itself = self.params.whole("SHOW_MODE_BOOT") & 2 != 0;
        if by_itself
            && self.show.authorized
            && !was_authorized
            && !self.is_armed()
            && self.mode != SHOW_MODE
        {
            self.enter_show_mode();
        }
    }

    /// What setting a parameter changes elsewhere.
    pub(super) fn on_parameter(&mut self, now: Micros, name: &str) {
        let whole = |name| self.params.whole(name) as i32;
        match name {
            "SHOW_START_TIME" => {
                let tow_s = whole(name);
                self.show.set_start(tow_s, self.world.gps_us(now), &mut self.params);
            }
            "SHOW_START_AUTH" => {
                let was_authorized = self.show.authorized;
                self.show.authorized = whole(name) != 0;
                self.on_authorized(was_authorized);
            }
            "SHOW_ORIGIN_LAT" | "SHOW_ORIGIN_LNG" => {
                let place = [whole("SHOW_ORIGIN_LAT"), whole("SHOW_ORIGIN_LNG")];
                self.show.origin = (place != [0, 0]).then_some(place);
            }
            "SHOW_ORIGIN_AMSL" => self.show.amsl_mm = whole(name),
            "SHOW_ORIENTATION" => {
                let orientation = self.params.get(name);
                self.show.orientation_deg = (orientation >= 0.0).then_some(orientation);
            }
            _ => {}
        }
    }
}

impl Endpoint for VirtualVehicle<'_> {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        self.on_frame(now, STATION, message, out);
    }

    fn on_frame(
        &mut self,
        now: Micros,
        sender: Sender,
        message: &MavMessage,
        out: &mut Vec<MavMessage>,
    ) {
        if self.is_gone(now) || self.age(now) < self.setup.boot.heartbeat {
            return;
        }
        if target(message).is_some_and(|system| system != 0 && system != self.setup.system) {
            return;
        }
        match message {
            MavMessage::COMMAND_LONG(command) => self.on_command(now, &command.into(), out),
            MavMessage::COMMAND_INT(command) => self.on_command(now, &command.into(), out),
            MavMessage::DATA16(packet) => self.take_start_packet(now, packet),
            MavMessage::FILE_TRANSFER_PROTOCOL(_) => self.ftp.on_message(sender, message),
            MavMessage::HEARTBEAT(_)
            | MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_)
            | MavMessage::SET_POSITION_TARGET_LOCAL_NED(_) => {
                self.on_stream(now, sender, message, out);
            }
            _ => {
                if let MavMessage::LOG_REQUEST_DATA(_) = message
                    && self.airborne.is_none()
                {
                    self.logbook.close(self.storage.as_mut());
                }
                let armed = self.is_armed();
                self.logs.poll(now, armed, self.storage.as_ref(), out);
                self.logs.on_message(message, armed, self.storage.as_ref(), out);
                self.fence.on_message(now, message, out);
                self.params.put("FENCE_TOTAL", self.fence.len() as f32);
                if let Some(name) = self.params.on_message(message, out) {
                    self.on_parameter(now, name);
                }
            }
        }
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        if self.is_gone(now) {
            return Micros::MAX;
        }
        if self.setup.reboot_at.is_some_and(|at| now >= at) && !self.is_armed() {
            self.setup.reboot_at = None;
            self.reboot(now);
        }
        while self.next_tick <= now {
            let tick = self.next_tick;
            self.next_tick += TICK;
            self.tick(tick, out);
        }
        let mut next = self.next_tick;
        let due = self.streams.due(now);
        if !due.is_empty() {
            let telling = self.telling(now);
            out.extend(due.into_iter().filter_map(|id| telling.message(id)));
        }
        next = next.min(self.streams.next());
        next = next.min(self.ftp.poll(now, self.storage.as_mut(), out));
        let armed = self.is_armed();
        next = next.min(self.logs.poll(now, armed, self.storage.as_ref(), out));
        self.fence.poll(now, out);
        if self.params.poll(out) {
            next = next.min(now + 10 * MS);
        }
        next
    }
}

/// Whom a message is for, if it says so.
fn target(message: &MavMessage) -> Option<u8> {
    Some(match message {
        MavMessage::COMMAND_LONG(it) => it.target_system,
        MavMessage::COMMAND_INT(it) => it.target_system,
        MavMessage::PARAM_SET(it) => it.target_system,
        MavMessage::PARAM_REQUEST_LIST(it) => it.target_system,
        MavMessage::PARAM_REQUEST_READ(it) => it.target_system,
        MavMessage::MISSION_COUNT(it) => it.target_system,
        MavMessage::MISSION_ITEM_INT(it) => it.target_system,
        MavMessage::MISSION_REQUEST_LIST(it) => it.target_system,
        MavMessage::MISSION_REQUEST_INT(it) => it.target_system,
        MavMessage::MISSION_CLEAR_ALL(it) => it.target_system,
        MavMessage::FILE_TRANSFER_PROTOCOL(it) => it.target_system,
        MavMessage::LOG_REQUEST_LIST(it) => it.target_system,
        MavMessage::LOG_REQUEST_DATA(it) => it.target_system,
        MavMessage::LOG_REQUEST_END(it) => it.target_system,
        MavMessage::SET_POSITION_TARGET_GLOBAL_INT(it) => it.target_system,
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(it) => it.target_system,
        _ => return None,
    })
}
