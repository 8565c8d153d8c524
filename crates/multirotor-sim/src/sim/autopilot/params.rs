//! Parameters that are equal for every vehicle here: firmware defaults and the values that the
//! swarm launcher sets, by their ArduPilot names. SI units; the log's PARM rows convert.

/// WPNAV_ACCEL, m/s²: largest horizontal acceleration.
pub const WPNAV_ACCEL: f64 = 8.0;
/// WPNAV_ACCEL_Z, m/s²: largest vertical acceleration.
pub const WPNAV_ACCEL_Z: f64 = 5.0;
/// WPNAV_SPEED, m/s: largest horizontal speed.
pub const WPNAV_SPEED: f64 = 10.0;
/// WPNAV_SPEED_DN, m/s: largest speed of descent.
pub const WPNAV_SPEED_DN: f64 = 4.5;
/// PSC_JERK_XY and PSC_JERK_Z, m/s³: largest jerk.
pub const PSC_JERK: f64 = 30.0;
/// ATC_ACCEL_R_MAX and ATC_ACCEL_P_MAX, degrees/s²: largest angular acceleration in roll and pitch.
pub const ATC_ACCEL_RP_MAX_DEG: f64 = 1100.0;
/// ATC_INPUT_TC, s: time constant with which attitude targets are shaped.
pub const ATC_INPUT_TC: f64 = 0.15;
/// PSC_POSXY_P, 1/s: gain from horizontal position to velocity.
pub const PSC_POSXY_P: f64 = 1.0;
/// PSC_VELXY_P, 1/s: gain from horizontal velocity to acceleration.
pub const PSC_VELXY_P: f64 = 2.0;
/// PSC_VELXY_I, 1/s²: integral gain from horizontal velocity to acceleration.
pub const PSC_VELXY_I: f64 = 1.0;
/// PSC_VELXY_D: derivative gain from horizontal velocity to acceleration, without unit.
pub const PSC_VELXY_D: f64 = 0.5;
/// PSC_VELXY_IMAX, m/s²: limit of the horizontal integral.
pub const PSC_VELXY_IMAX: f64 = 10.0;
/// PSC_VELXY_FLTE, PSC_VELXY_FLTD and PSC_VELZ_FLTE, Hz: low-pass on velocity errors and their
/// derivatives.
pub const PSC_VEL_FLT: f64 = 5.0;
/// PSC_ACCZ_FLTE, Hz: low-pass on the error of the vertical acceleration.
pub const PSC_ACCZ_FLTE: f64 = 20.0;
/// PSC_ACCZ_IMAX, share of full throttle: limit of the vertical integral.
pub const PSC_ACCZ_IMAX: f64 = 0.8;
/// Time constant with which the controllers let go on the ground, s (POSCONTROL_RELAX_TC).
pub const RELAX_S: f64 = 0.16;
/// Low-pass on the throttle, Hz (POSCONTROL_THROTTLE_CUTOFF_FREQ_HZ).
pub const THROTTLE_FLT: f64 = 2.0;
/// ANGLE_MAX, degrees: largest lean.
pub const ANGLE_MAX_DEG: f64 = 30.0;
/// ATC_ANG_RLL_P and ATC_ANG_PIT_P, 1/s: gain from lean error to body rate.
pub const ATC_ANG_P: f64 = 4.5;
/// ATC_ANG_YAW_P, 1/s: gain from heading error to yaw rate; lower than the default, as AirSim's
/// rotors turn the body weakly.
pub const ATC_ANG_YAW_P: f64 = 1.5;
/// ATC_RAT_RLL_P and _I, and those of pitch: gains from body rate to output.
pub const ATC_RAT_P: f64 = 0.135;
/// ATC_RAT_RLL_D, and that of pitch: derivative gain from body rate to output.
pub const ATC_RAT_D: f64 = 0.0036;
/// ATC_RAT_RLL_FLTT and _FLTD, Hz: low-pass on the target rate and on the derivative.
pub const ATC_RAT_FLT: f64 = 20.0;
/// ATC_RAT_YAW_P: gain from yaw rate to output.
pub const ATC_RAT_YAW_P: f64 = 0.5;
/// ATC_RAT_YAW_I: integral gain from yaw rate to output.
pub const ATC_RAT_YAW_I: f64 = 0.05;
/// ATC_RAT_RLL_IMAX: limit of the rate controllers' integrals, share of full output.
pub const ATC_RAT_IMAX: f64 = 0.5;
/// MOT_SPIN_ARM: output of armed motors on the ground, share of the full range.
pub const MOT_SPIN_ARM: f64 = 0.1;
/// MOT_SPOOL_TIME, s: time that the motors take to spool up.
pub const MOT_SPOOL_TIME: f64 = 0.5;
/// MOT_PWM_MIN, us: pulse width of no throttle.
pub const MOT_PWM_MIN: f64 = 1000.0;
/// MOT_PWM_MAX, us: pulse width of full throttle.
pub const MOT_PWM_MAX: f64 = 2000.0;
/// Time constant of hover throttle learning, s (AP_MOTORS_THST_HOVER_TC).
pub const HOVER_LEARN_S: f64 = 10.0;
/// Range of the learned hover throttle, shares of full throttle.
pub const HOVER_RANGE: (f64, f64) = (0.125, 0.6875);
/// ARMING_DELAY, s: time from arming to spinning.
pub const ARMING_DELAY_S: f64 = 2.0;
/// LAND_SPEED, m/s: speed of the last part of a landing.
pub const LAND_SPEED: f64 = 0.5;
/// Low-pass on the acceleration of the landing detector, Hz.
pub const LAND_ACCEL_FLT: f64 = 1.0;
/// LAND_ALT_LOW, m: height below which a landing slows down to LAND_SPEED.
pub const LAND_ALT_LOW: f64 = 10.0;
/// SHOW_CTRL_RATE, Hz: rate of the show mode's targets.
pub const SHOW_CTRL_RATE: u32 = 10;
/// DISARM_DELAY, s: time without orders after which an armed vehicle disarms.
pub const DISARM_DELAY_S: f64 = 10.0;
/// GUID_TIMEOUT, s: time without a new target after which a guided vehicle stops.
pub const GUID_TIMEOUT_S: f64 = 3.0;
/// SHOW_TAKEOFF_ALT, m: height of the take-off.
pub const SHOW_TAKEOFF_ALT: f64 = 2.5;
/// Height at which the take-off ends and the show begins, share of SHOW_TAKEOFF_ALT.
pub const TAKEOFF_DONE: f64 = 0.7;
/// Time before the take-off at which the vehicle arms, s.
pub const ARM_BEFORE_TAKEOFF_S: f64 = 8.0;
/// RTL_ALT, m: least height of a return.
pub const RTL_ALT: f64 = 15.0;
/// RTL_LOIT_TIME, s: time that a return hovers above home before it descends.
pub const RTL_LOIT_TIME_S: f64 = 5.0;
