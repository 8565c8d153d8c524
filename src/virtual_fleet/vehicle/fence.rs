//! The geofence: its transfer both ways (MAVLink's mission protocol), and whether it is breached.

use nalgebra::Vector3;

use super::params::Params;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::link::clock::{Micros, S};
use crate::link::frame::{MavMessage, dialect};
use crate::link::station::STATION;
use dialect::{MavCmd, MavMissionResult, MavMissionType};

/// Largest number of items that a vehicle stores.
const MOST_ITEMS: u16 = 300;
/// An item that does not come is asked for again after so long, and an upload is given up.
const ASK_AGAIN: Micros = S;
const GIVE_UP: Micros = 8 * S;
const FENCE: MavMissionType = MavMissionType::MAV_MISSION_TYPE_FENCE;
/// Bits of FENCE_TYPE.
const ALTITUDE: i64 = 1;
const CIRCLE: i64 = 2;
const POLYGON: i64 = 4;
const FLOOR: i64 = 8;

/// A vertex or circle, as it was sent.
type Item = dialect::MISSION_ITEM_INT_DATA;

/// The fence of one vehicle.
#[derive(Clone, Debug, Default)]
pub(super) struct Fence {
    items: Vec<Item>,
    upload: Option<Upload>,
}

#[derive(Clone, Debug)]
struct Upload {
    count: u16,
    items: Vec<Item>,
    asked: Micros,
    last_heard: Micros,
}

impl Fence {
    /// Number of items that are stored.
    pub(super) fn len(&self) -> usize {
        self.items.len()
    }

    /// Where the items are: latitude and longitude, 1e-7 degrees.
    pub(super) fn corners_1e7(&self) -> Vec<(i32, i32)> {
        self.items.iter().map(|item| (item.x, item.y)).collect()
    }

    /// Takes the messages of the mission protocol.
    pub(super) fn on_message(
        &mut self,
        now: Micros,
        message: &MavMessage,
        out: &mut Vec<MavMessage>,
    ) {
        match message {
            MavMessage::MISSION_COUNT(wanted) if wanted.mission_type == FENCE => {
                if wanted.count > MOST_ITEMS {
                    out.push(acknowledge(MavMissionResult::MAV_MISSION_NO_SPACE));
                } else if wanted.count == 0 {
                    self.items.clear();
                    out.push(acknowledge(MavMissionResult::MAV_MISSION_ACCEPTED));
                } else {
                    let count = wanted.count;
                    self.upload =
                        Some(Upload { count, items: Vec::new(), asked: now, last_heard: now });
                    out.push(ask(0));
                }
            }
            MavMessage::MISSION_COUNT(_) => {
                out.push(acknowledge(MavMissionResult::MAV_MISSION_UNSUPPORTED));
            }
            MavMessage::MISSION_ITEM_INT(item) if item.mission_type == FENCE => {
                self.take(now, item, out);
            }
            MavMessage::MISSION_REQUEST_LIST(wanted) if wanted.mission_type == FENCE => {
                out.push(MavMessage::MISSION_COUNT(dialect::MISSION_COUNT_DATA {
                    count: self.items.len() as u16,
                    target_system: STATION.system,
                    target_component: STATION.component,
                    mission_type: FENCE,
                    ..Default::default()
                }));
            }
            MavMessage::MISSION_REQUEST_INT(wanted) if wanted.mission_type == FENCE => {
                match self.items.get(usize::from(wanted.seq)) {
                    Some(item) => out.push(MavMessage::MISSION_ITEM_INT(Item {
                        target_system: STATION.system,
                        target_component: STATION.component,
                        ..item.clone()
                    })),
                    None => out.push(acknowledge(MavMissionResult::MAV_MISSION_INVALID_SEQUENCE)),
                }
            }
            MavMessage::MISSION_CLEAR_ALL(wanted)
                if matches!(wanted.mission_type, FENCE | MavMissionType::MAV_MISSION_TYPE_ALL) =>
            {
                self.items.clear();
                out.push(acknowledge(MavMissionResult::MAV_MISSION_ACCEPTED));
            }
            _ => {}
        }
    }

    fn take(&mut self, now: Micros, item: &Item, out: &mut Vec<MavMessage>) {
        let Some(upload) = &mut self.upload else { return };
        upload.last_heard = now;
        if usize::from(item.seq) != upload.items.len() {
            // One that came twice, or too early: the one that is missing is asked for in time.
            return;
        }
        let known = matches!(
            item.command,
            MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
                | MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
                | MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION
                | MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION
                | MavCmd::MAV_CMD_NAV_FENCE_RETURN_POINT
        );
        if !known {
            self.upload = None;
            out.push(acknowledge(MavMissionResult::MAV_MISSION_UNSUPPORTED));
            return;
        }
        upload.items.push(item.clone());
        upload.asked = now;
        let next = upload.items.len() as u16;
        if next < upload.count {
            out.push(ask(next));
            return;
        }
        if let Some(upload) = self.upload.take() {
            let result = if is_whole(&upload.items) {
                self.items = upload.items;
                MavMissionResult::MAV_MISSION_ACCEPTED
            } else {
                MavMissionResult::MAV_MISSION_ERROR
            };
            out.push(acknowledge(result));
        }
    }

    /// Asks again for what does not come.
    pub(super) fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) {
        let Some(upload) = &mut self.upload else { return };
        if now >= upload.last_heard + GIVE_UP {
            self.upload = None;
            out.push(acknowledge(MavMissionResult::MAV_MISSION_OPERATION_CANCELLED));
        } else if now >= upload.asked + ASK_AGAIN {
            upload.asked = now;
            out.push(ask(upload.items.len() as u16));
        }
    }

    /// Whether a place (show frame) is outside. `height_m` is above home.
    pub(super) fn is_breached(
        &self,
        params: &Params,
        frame: &ShowFrame,
        position_m: &Vector3<f64>,
        home_m: &Vector3<f64>,
    ) -> bool {
        if params.whole("FENCE_ENABLE") == 0 {
            return false;
        }
        let kinds = params.whole("FENCE_TYPE");
        let height_m = position_m.z - home_m.z;
        let far_m = (position_m.xy() - home_m.xy()).norm();
        (kinds & ALTITUDE != 0 && height_m > f64::from(params.get("FENCE_ALT_MAX")))
            || (kinds & FLOOR != 0 && height_m < f64::from(params.get("FENCE_ALT_MIN")))
            || (kinds & CIRCLE != 0 && far_m > f64::from(params.get("FENCE_RADIUS")))
            || (kinds & POLYGON != 0 && self.is_outside(frame, position_m))
    }

    fn is_outside(&self, frame: &ShowFrame, position_m: &Vector3<f64>) -> bool {
        let place = |item: &Item| {
            let place = Geodetic {
                lat_deg: f64::from(item.x) * 1e-7,
                lon_deg: f64::from(item.y) * 1e-7,
                amsl_m: frame.origin.amsl_m,
            };
            frame.from_geodetic(place)
        };
        let mut at = 0;
        while let Some(item) = self.items.get(at) {
            let size = usize::try_from(item.param1 as i64).unwrap_or(0).max(1);
            let circle_m = (position_m.xy() - place(item).xy()).norm();
            let (outside, length) = match item.command {
                MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
                | MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION => {
                    let end = (at + size).min(self.items.len());
                    let corners: Vec<_> = self.items[at..end].iter().map(place).collect();
                    let keeps_in =
                        item.command == MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION;
                    (is_inside(&corners, position_m) != keeps_in, size)
                }
                MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION => {
                    (circle_m > f64::from(item.param1), 1)
                }
                MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION => {
                    (circle_m < f64::from(item.param1), 1)
                }
                _ => (false, 1),
            };
            if outside {
                return true;
            }
            at += length;
        }
        false
    }
}

/// Whether every polygon has the number of vertices that it says.
fn is_whole(items: &[Item]) -> bool {
    let mut at = 0;
    while let Some(item) = items.get(at) {
        let is_vertex = matches!(
            item.command,
            MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
                | MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION
        );
        let size = if is_vertex { item.param1 as usize } else { 1 };
        let same = |other: &Item| other.command == item.command;
        if size < 1
            || (is_vertex && size < 3)
            || !items.get(at..at + size).is_some_and(|items| items.iter().all(same))
        {
            return false;
        }
        at += size;
    }
    true
}

/// Whether a point is inside a polygon, by the even-odd rule.
fn is_inside(corners: &[Vector3<f64>], point: &Vector3<f64>) -> bool {
    let mut inside = false;
    for (index, a) in corners.iter().enumerate() {
        let b = &corners[(index + 1) % corners.len()];
        if (a.y > point.y) != (b.y > point.y)
            && point.x < (b.x - a.x) * (point.y - a.y) / (b.y - a.y) + a.x
        {
            inside = !inside;
        }
    }
    inside
}

/// The firmware asks with the older of the two messages, and some stations know no other from it.
#[expect(deprecated, reason = "the firmware sends it")]
fn ask(seq: u16) -> MavMessage {
    MavMessage::MISSION_REQUEST(dialect::MISSION_REQUEST_DATA {
        seq,
        target_system: STATION.system,
        target_component: STATION.component,
        mission_type: FENCE,
    })
}

fn acknowledge(result: MavMissionResult) -> MavMessage {
    MavMessage::MISSION_ACK(dialect::MISSION_ACK_DATA {
        target_system: STATION.system,
        target_component: STATION.component,
        mavtype: result,
        mission_type: FENCE,
        opaque_id: 0,
    })
}
