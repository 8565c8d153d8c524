//! Shows are loaded whole or refused, over good and bad links, in simulated time.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::collections::BTreeMap;

use crate::fleet::show::{Fault, Net, bad, drone, fleet, load, one, plan};
use insta::assert_snapshot;
use updraft::fleet::clear::Clear;
use updraft::fleet::dry_run::{Obliging, dry_run};
use updraft::fleet::fence::{PutFence, fence_of};
use updraft::fleet::upload::Upload;
use updraft::link::conversation::{Conversation as _, NoObserver, Step, run_all};
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{MavCmd, MavResult};
use updraft::protocol::ftp::{Op, Packet};
use updraft::protocol::show::{SHOW_FILE, Stage, flag};
use updraft::virtual_fleet::lossy::Faults;

const READY: u8 = flag::LOADED | flag::ORIGIN_SET | flag::ORIENTATION_SET | flag::FENCE_ON;

/// Uploads slot 1 to drone 1 with a fault; its answer, and what is then on the vehicle.
fn refused(fault: Fault) -> String {
    let plan = plan();
    let mut net = fleet(&plan, true, Faults::default(), 3);
    let vehicle = net.vehicles.get_mut(&drone(1)).unwrap();
    vehicle.fault = fault;
    // An old show that must not be flown.
    vehicle.inner.files.insert(SHOW_FILE.to_owned(), vec![1, 2, 3]);
    vehicle.inner.status.flags |= flag::LOADED;
    let refused = one(&mut net, Upload::new(drone(1), load(&plan, 1), 1)).unwrap_err();
    let on_it = net.vehicles[&drone(1)].inner.status.flags & flag::LOADED;
    format!("{refused}{}", if on_it == 0 { "" } else { " [a show is on it]" })
}

#[test]
fn every_refusal_says_why_and_what_is_on_the_drone() {
    let accepted = |command, result| Fault::Refuses(command, result);
    let origin = MavCmd::MAV_CMD_USER_2;
    let reload = MavCmd::MAV_CMD_USER_1;
    let all = [
        ("silent", Fault::Silent),
        ("stage", Fault::Stage(Stage::Error)),
        ("file", Fault::FileRefused(Op::CreateFile, 10)),
        ("card", Fault::BadCard),
        ("origin refused", accepted(origin, MavResult::MAV_RESULT_UNSUPPORTED)),
        ("origin ignored", Fault::Ignores(origin)),
        ("fence refused", Fault::FenceRefused),
        ("fence moved", Fault::FenceMoved),
        ("fence parameter", Fault::ParamKept),
        ("reload failed", accepted(reload, MavResult::MAV_RESULT_FAILED)),
        ("reload denied", accepted(reload, MavResult::MAV_RESULT_DENIED)),
        ("file lost", Fault::LosesFile),
        ("no origin", Fault::LacksFlags(flag::ORIGIN_SET)),
        ("no orientation", Fault::LacksFlags(flag::ORIENTATION_SET)),
        ("fence off", Fault::LacksFlags(flag::FENCE_ON)),
        ("no status", Fault::StatusStops),
        ("not cleared", Fault::KeepsShow),
    ];
    let lines: Vec<String> =
        all.iter().map(|(name, fault)| format!("{name}: {}", refused(*fault))).collect();
    assert_snapshot!(lines.join("\n"));
}

#[test]
fn armed_authorized_and_stock_drones_are_not_touched() {
    let plan = plan();
    let mut lines = Vec::new();
    for case in 0..3 {
        let mut net = fleet(&plan, case != 2, Faults::default(), 3);
        let vehicle = net.vehicles.get_mut(&drone(1)).unwrap();
        match case {
            0 => vehicle.inner.armed = true,
            1 => vehicle.inner.status.flags |= flag::AUTHORIZED,
            _ => {}
        }
        let done = one(&mut net, Upload::new(drone(1), load(&plan, 1), 1));
        lines.push(done.unwrap_err().to_string());
        assert!(net.vehicles[&drone(1)].heard.is_empty());
    }
    assert_snapshot!(lines.join("\n"));
}

fn writes(net: &Net, system: u8) -> usize {
    let is_write = |message: &&MavMessage| match message {
        MavMessage::FILE_TRANSFER_PROTOCOL(data) => {
            Packet::from_payload(&data.payload).is_some_and(|packet| packet.op == Op::WriteFile)
        }
        _ => false,
    };
    net.vehicles[&drone(system)].heard.iter().filter(is_write).count()
}

#[test]
fn a_fleet_is_loaded_over_a_bad_link_and_not_twice() {
    let plan = plan();
    for seed in 0..10 {
        let mut net = fleet(&plan, true, bad(), seed);
        let uploads = |numbers: u32| -> BTreeMap<_, _> {
            (1..=6_u16)
                .map(|slot| {
                    let id = drone(slot as u8);
                    (id, Upload::new(id, load(&plan, slot), numbers + u32::from(slot)))
                })
                .collect()
        };
        let done = run_all(&mut net, uploads(1), 4, &mut NoObserver).unwrap();
        assert_eq!(done.len(), 6);
        for (id, result) in done {
            assert!(result.as_ref().is_ok_and(|loaded| loaded.written), "{seed} {id}: {result:?}");
            let vehicle = &net.vehicles[&id].inner;
            assert_eq!(vehicle.status.flags & READY, READY);
            let wanted = load(&plan, id.system.into());
            assert_eq!(vehicle.files[SHOW_FILE], wanted.skyb, "seed {seed}");
            assert_eq!(vehicle.fence, wanted.fence.corners_1e7);
        }
        let before = writes(&net, 1);
        let done = run_all(&mut net, uploads(100), 4, &mut NoObserver).unwrap();
        assert!(done.values().all(|r| r.as_ref().is_ok_and(|loaded| !loaded.written)), "{done:?}");
        assert_eq!(writes(&net, 1), before, "a file that is there is not written again");
    }
}

#[test]
fn a_refused_drone_is_cleared_over_a_bad_link_too() {
    let plan = plan();
    for seed in 0..10 {
        let mut net = fleet(&plan, true, bad(), seed);
        net.vehicles.get_mut(&drone(1)).unwrap().fault =
            Fault::Refuses(MavCmd::MAV_CMD_USER_1, MavResult::MAV_RESULT_FAILED);
        let refused = one(&mut net, Upload::new(drone(1), load(&plan, 1), 1)).unwrap_err();
        assert!(refused.to_string().contains("was cleared"), "{refused}");
        assert!(net.vehicles[&drone(1)].inner.files.is_empty());
    }
}

#[test]
fn a_drone_that_is_in_another_mode_enters_show_mode() {
    let plan = plan();
    let mut net = fleet(&plan, true, Faults::default(), 3);
    let vehicle = net.vehicles.get_mut(&drone(1)).unwrap();
    vehicle.inner.mode = 5;
    vehicle.inner.status.stage = Stage::Off;
    one(&mut net, Upload::new(drone(1), load(&plan, 1), 1)).unwrap();
    assert_eq!(net.vehicles[&drone(1)].inner.mode, 127);
}

#[test]
fn a_late_answer_to_a_reload_is_no_answer_to_clearing() {
    let (mut clear, mut now) = (Clear::new(drone(1)), 0);
    let plan = plan();
    let place = plan.site.frame().origin;
    let mut vehicle = Obliging::new(drone(1), true, place);
    vehicle.status.flags |= flag::LOADED;
    assert!(matches!(clear.poll(now), Step::Send(_)));
    let mut said = Vec::new();
    // The clear is lost; an acknowledgement comes nevertheless.
    let reload =
        updraft::fleet::messages::command_long(drone(1), MavCmd::MAV_CMD_USER_1, [0.0; 7], 0);
    vehicle.files.insert(SHOW_FILE.to_owned(), vec![1]);
    vehicle.on_message(now, &reload, &mut said);
    for _ in 0..4 {
        now = vehicle.poll(now, &mut said);
        for message in said.drain(..) {
            clear.on_message(now, &message);
        }
        assert!(!matches!(clear.poll(now), Step::Done(_)), "a show is still on it");
    }
}

#[test]
fn a_fence_that_is_smaller_than_the_show_is_refused() {
    let good = plan();
    let show = good.to_show();
    let text = |change: &dyn Fn(&mut updraft::mission::plan::Fence)| {
        let mut plan = good.clone();
        change(&mut plan.fence);
        fence_of(&plan, &show).unwrap_err().to_string()
    };
    let lines = [
        text(&|fence| fence.polygon_m.truncate(2)),
        text(&|fence| fence.polygon_m[0][1] = f64::NAN),
        text(&|fence| fence.max_altitude_m = f64::INFINITY),
        text(&|fence| fence.margin_m = -1.0),
        text(&|fence| fence.polygon_m = vec![[0.0, 0.0]; 61]),
        text(&|fence| fence.polygon_m.iter_mut().for_each(|corner| corner[0] *= 0.5)),
        text(&|fence| fence.max_altitude_m = 32.0),
    ];
    assert_snapshot!(lines.join("\n"));
}

#[test]
fn a_fence_comes_over_a_bad_link() {
    let plan = plan();
    let fence = load(&plan, 1).fence;
    for seed in 0..20 {
        let mut net = fleet(&plan, true, bad(), seed);
        one(&mut net, PutFence::new(drone(1), fence.clone())).unwrap();
        let vehicle = &net.vehicles[&drone(1)].inner;
        assert_eq!(vehicle.fence, fence.corners_1e7, "seed {seed}");
        assert_eq!(vehicle.params["FENCE_ENABLE"], 1.0);
        assert_eq!(vehicle.params["FENCE_TYPE"], 5.0);
    }
}

#[test]
fn a_dry_run_shows_the_messages() {
    let plan = plan();
    let mut vehicle = Obliging::new(drone(1), true, plan.site.frame().origin);
    let (lines, done) = dry_run(Upload::new(drone(1), load(&plan, 1), 1), &mut vehicle, 1000);
    assert!(done.unwrap().is_ok());
    assert_snapshot!(lines.join("\n"));
}
