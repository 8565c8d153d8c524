//! The show mode on the ground: the loaded show, its start time, and the conditions of the start.

use super::params::Params;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::base::time::WEEK_MS;
use crate::protocol::show::{NO_AMSL_MM, SHOW_FILE, Stage, StartConfig, preflight};
use crate::show::skyb;
use crate::sim::autopilot::director::takeoff_time_s;
use crate::sim::autopilot::params::ARM_BEFORE_TAKEOFF_S;
use crate::virtual_fleet::storage::{Storage, StorageError};
use crate::virtual_fleet::world::{LoadedShow, World};

/// Arming is tried for so long after the take-off time, s.
const ARM_UNTIL_S: f64 = 5.0;
/// So long after it a show that was not authorised is over, s.
const MISSED_S: f64 = 6.0;
/// A start that is so far ahead lets a landed drone wait again, s.
const AGAIN_S: f64 = 10.0;
/// Largest show file, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// What became of a reload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reload {
    /// A show is loaded.
    Loaded,
    /// There is no file; that is fine.
    Nothing,
    /// The file is broken, or its show can never take off.
    Broken,
}

/// Action that the stages of the show ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    Nothing,
    /// Arm now if the checks allow it.
    Arm,
    /// Report that the start is given up.
    GiveUp,
}

/// State of the show mode.
pub(super) struct ShowMode<'w> {
    pub(super) stage: Stage,
    pub(super) loaded: Option<&'w LoadedShow>,
    /// GPS time of show time 0, us since the GPS epoch.
    pub(super) start_us: Option<i64>,
    pub(super) authorized: bool,
    /// Failed checks, as in the status packet.
    pub(super) preflight: u8,
    /// Origin, 1e-7 degrees: as it was sent, not as a parameter can say it.
    pub(super) origin: Option<[i32; 2]>,
    pub(super) amsl_mm: i32,
    pub(super) orientation_deg: Option<f32>,
    next_try_us: i64,
    next_check_us: i64,
}

impl<'w> ShowMode<'w> {
    pub(super) fn new() -> Self {
        Self {
            stage: Stage::Off,
            loaded: None,
            start_us: None,
            authorized: false,
            preflight: preflight::NOT_CONFIGURED,
            origin: None,
            amsl_mm: NO_AMSL_MM,
            orientation_deg: None,
            next_try_us: i64::MIN,
            next_check_us: i64::MIN,
        }
    }

    /// Reads the show file.
    pub(super) fn reload(&mut self, world: &'w World<'w>, storage: &dyn Storage) -> Reload {
        self.loaded = None;
        let bytes = match read_file(storage) {
            Ok(bytes) => bytes,
            Err(StorageError::NotFound) => return Reload::Nothing,
            Err(_) => return Reload::Broken,
        };
        let Ok(contents) = skyb::read(&bytes) else { return Reload::Broken };
        let (trajectory, lights) = (contents.drone.trajectory, contents.drone.lights);
        let climb_mps = world.vehicle.autopilot.wpnav_speed_up_mps;
        let Some(takeoff_s) = takeoff_time_s(&trajectory, climb_mps) else {
            return Reload::Broken;
        };
        self.loaded = Some(world.keep(LoadedShow { trajectory, lights, takeoff_s }));
        Reload::Loaded
    }

    /// Takes a start packet.
    pub(super) fn configure(&mut self, start: &StartConfig, gps_us: i64, params: &mut Params) {
        if (0..i32::try_from(WEEK_MS / 1000).unwrap_or(i32::MAX)).contains(&start.start_tow_s)
            || start.start_tow_s < 0
        {
            self.set_start(start.start_tow_s, gps_us, params);
        }
        self.authorized = start.authorization != 0;
        params.put("SHOW_START_AUTH", f32::from(u8::from(self.authorized)));
    }

    /// Sets the start's second of week. One that is past is next week's.
    pub(super) fn set_start(&mut self, tow_s: i32, gps_us: i64, params: &mut Params) {
        if !matches!(self.stage, Stage::Off | Stage::Init | Stage::WaitForStart | Stage::Landed) {
            return;
        }
        params.put("SHOW_START_TIME", tow_s.max(-1) as f32);
        if tow_s < 0 {
            self.start_us = None;
            return;
        }
        let week_us = WEEK_MS as i64 * 1000;
        let of_week_us = i64::from(tow_s) * 1_000_000;
        let this_week_us = gps_us.div_euclid(week_us) * week_us + of_week_us;
        // The same time again, once under way, is no new one.
        let known = self.start_us.filter(|start| start.rem_euclid(week_us) == of_week_us);
        let known = known.filter(|start| *start + 3_600_000_000 > gps_us);
        self.start_us = Some(known.unwrap_or_else(|| {
            if this_week_us > gps_us { this_week_us } else { this_week_us + week_us }
        }));
    }

    /// Whether it will take off by itself.
    pub(super) fn is_counting_down(&self) -> bool {
        self.authorized && self.start_us.is_some() && self.stage == Stage::WaitForStart
    }

    /// Enters the show mode.
    pub(super) fn enter(&mut self) {
        self.stage = Stage::Init;
    }

    /// Leaves the show mode.
    pub(super) fn leave(&mut self) {
        self.stage = Stage::Off;
    }

    /// Show time, s.
    pub(super) fn show_time_s(&self, gps_us: i64) -> Option<f64> {
        self.start_us.map(|start| (gps_us - start) as f64 * 1e-6)
    }

    /// What the status packet says of the time, s.
    pub(super) fn elapsed_s(&self, gps_us: i64) -> Option<i16> {
        let elapsed_s = self.show_time_s(gps_us)?.floor();
        (elapsed_s.abs() < f64::from(i16::MAX)).then_some(elapsed_s as i16)
    }

    /// The frame that the drone was told, at the place's true altitude.
    fn told_frame(&self, amsl_m: f64) -> Option<ShowFrame> {
        let [lat, lon] = self.origin?;
        let origin =
            Geodetic { lat_deg: f64::from(lat) * 1e-7, lon_deg: f64::from(lon) * 1e-7, amsl_m };
        Some(ShowFrame { origin, orientation_deg: self.orientation_deg?.into() })
    }

    /// Checks what is failing now. `place` is where the drone stands.
    fn check(&mut self, place: Geodetic, params: &Params) {
        self.preflight = 0;
        let (Some(frame), Some(show)) = (self.told_frame(place.amsl_m), self.loaded) else {
            self.preflight = preflight::NOT_CONFIGURED;
            return;
        };
        let stands_m = frame.from_geodetic(place);
        let away_m = (stands_m.xy() - show.trajectory.start_m.xy()).norm();
        if away_m > f64::from(params.get("SHOW_TAKEOFF_ERR")) {
            self.preflight |= preflight::NOT_AT_TAKEOFF;
        }
    }

    /// Moves the stages on while the drone is on the ground.
    pub(super) fn tick(&mut self, gps_us: i64, place: Geodetic, params: &Params) -> Wish {
        let to_takeoff_s = |mode: &Self| {
            let show = mode.loaded?;
            Some(show.takeoff_s - mode.show_time_s(gps_us)?)
        };
        match self.stage {
            Stage::Init => {
                self.stage = Stage::WaitForStart;
                self.check(place, params);
                Wish::Nothing
            }
            Stage::WaitForStart => {
                if gps_us >= self.next_check_us || self.preflight != 0 {
                    self.next_check_us = gps_us + 1_000_000;
                    self.check(place, params);
                }
                let Some(left_s) = to_takeoff_s(self) else { return Wish::Nothing };
                if left_s <= -MISSED_S {
                    self.stage = Stage::Landed;
                } else if self.authorized && left_s < -ARM_UNTIL_S {
                    self.stage = Stage::Error;
                    return Wish::GiveUp;
                } else if self.authorized
                    && left_s <= ARM_BEFORE_TAKEOFF_S
                    && gps_us >= self.next_try_us
                {
                    self.next_try_us = gps_us + 1_000_000;
                    return Wish::Arm;
                }
                Wish::Nothing
            }
            Stage::Landed => {
                if to_takeoff_s(self).is_some_and(|left_s| left_s > AGAIN_S) {
                    self.stage = Stage::Init;
                }
                Wish::Nothing
            }
            _ => Wish::Nothing,
        }
    }
}

fn read_file(storage: &dyn Storage) -> Result<Vec<u8>, StorageError> {
    let size = storage.size(SHOW_FILE)?;
    if size > MOST_BYTES {
        return Err(StorageError::Failed(27));
    }
    let mut bytes = vec![0; size as usize];
    let read = storage.read_at(SHOW_FILE, 0, &mut bytes)?;
    bytes.truncate(read);
    Ok(bytes)
}
