//! Whether intervals hold the truth: campaigns made up from the model of [`super::zero`] and
//! [`super::corrections`] with everything drawn that they doubt. The simulator's campaigns are in
//! `tests/it/analysis/coverage.rs`.

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::aware::Aware;
use super::battery::Sag;
use super::budget::{CommonError, Quality, QualityFlag, Supply};
use super::calibrate::FitOptions;
use super::corrections::Corrections;
use super::density::Density;
use super::hover::Hover;
use super::law::LawKind;
use super::measured::Measured;
use super::result::{DroneAnalysis, FlightAnalysis, SampleStats, Trace, WindowStats};
use super::windows::{Target, WindowOptions};
use crate::base::rng::{Purpose as Stream, stream};
use crate::flight::{Clock, Effort, Flight, Indicator, Series};
use crate::mission::plan::{Purpose, SegmentKind};

const DRONES: usize = 4;
const HOVER_S: f64 = 240.0;
const STEP_S: f64 = 0.5;

/// A kind of air: standard deviation and time scale of what is shared and of what is local.
#[derive(Clone, Copy, Debug)]
struct Weather {
    shared: (f64, f64),
    local: (f64, f64),
    /// Noise of a sample, us.
    noise_us: f64,
}

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// An Ornstein-Uhlenbeck process in steps of [`STEP_S`].
fn wander(rng: &mut Pcg64, (sd, tau): (f64, f64), length_s: f64) -> Vec<f64> {
    let decay = (-STEP_S / tau).exp();
    let kick = sd * (1.0 - decay * decay).sqrt();
    let mut value = sd * normal(rng);
    (0..(length_s / STEP_S) as usize)
        .map(|_| {
            value = value * decay + kick * normal(rng);
            value
        })
        .collect()
}

/// What is true of the fleet and its drones.
struct World {
    exponent: f64,
    density: f64,
    warm_us: f64,
    /// Constant, slope and two bends.
    laws: Vec<[f64; 4]>,
    shape: LawKind,
}

impl World {
    fn new(rng: &mut Pcg64, shape: LawKind) -> Self {
        let bends = [0.8 * normal(rng), 0.5 * normal(rng)];
        let law = |rng: &mut Pcg64| match shape {
            LawKind::Linear => {
                [1546.5 + 6.7 * normal(rng), 26.4 + 1.9 * normal(rng), bends[0], bends[1]]
            }
            LawKind::SignedQuadratic => [1598.6 + 2.0 * normal(rng), 0.0, 0.0, 8.1],
        };
        let real = shape == LawKind::Linear;
        Self {
            exponent: if real { 1.0 + 0.05 * normal(rng) } else { 0.0 },
            density: if real { 0.4 + 0.1 * normal(rng) } else { 1.0 },
            warm_us: if real { 3.0 * normal(rng) } else { 0.0 },
            laws: (0..DRONES).map(|_| law(rng)).collect(),
            shape,
        }
    }

    /// Pulse in steady flight.
    fn pulse_us(&self, drone: usize, air: f64, volts: f64, height: f64, time: f64) -> f64 {
        let [u0, a, b, c] = self.laws[drone];
        let level = u0 - 1000.0 + a * air + b * air * air + c * air * air.abs();
        let thin = Self::density().log_ratio(height);
        let warm = self.warm_us * (1.0 - (-time / 100.0).exp());
        1000.0 + level * (8.0 / volts).powf(self.exponent) * (-self.density * thin).exp() + warm
    }

    fn density() -> Density {
        Density { ground_amsl_m: 190.0, exponent: 0.4, indicator: Indicator::Pulse }
    }
}

/// Voltage of a pack at rest.
fn volts(full: f64, time_s: f64) -> f64 {
    full - 0.0008 * time_s
}

/// The ladder: (kind, climb, start and end of the window, height).
fn ladder() -> Vec<(SegmentKind, f64, f64, f64, f64)> {
    let mut rungs = vec![(SegmentKind::Hover, 0.0, 13.0, 19.0, 20.0)];
    let mut time = 20.0;
    for rung in 1..=7 {
        let speed = 0.5 * f64::from(rung);
        let top = 20.0 + 20.0 * speed;
        rungs.push((SegmentKind::LegUp, speed, time + 10.0, time + 19.0, top - 5.5 * speed));
        rungs.push((SegmentKind::Hover, 0.0, time + 23.0, time + 29.0, top));
        rungs.push((SegmentKind::LegDown, -speed, time + 40.0, time + 49.0, 20.0 + 5.5 * speed));
        rungs.push((SegmentKind::Hover, 0.0, time + 53.0, time + 59.0, 20.0));
        time += 60.0;
    }
    rungs
}

fn stats(mean: f64, se: f64) -> SampleStats {
    SampleStats { median: mean, mean, trimmed: mean, sd: 5.0 * se, n: 60, se }
}

fn calibration(rng: &mut Pcg64, world: &World, weather: Weather) -> FlightAnalysis {
    let shared = wander(rng, weather.shared, 450.0);
    let drones = (0..DRONES)
        .map(|drone| {
            let local = wander(rng, weather.local, 450.0);
            let full = 8.2 + 0.05 * normal(rng);
            let windows: Vec<WindowStats> = ladder()
                .into_iter()
                .map(|(kind, climb, start_s, end_s, height_m)| {
                    let (from, to) = ((start_s / STEP_S) as usize, (end_s / STEP_S) as usize);
                    let n = (to - from) as f64;
                    let mean = |air: &[f64]| air[from..to].iter().sum::<f64>() / n;
                    let air: Vec<f64> = shared.iter().zip(&local).map(|(s, l)| s + l).collect();
                    let wind = mean(&air);
                    let scatter = {
                        let squares: f64 = air[from..to].iter().map(|a| (a - wind).powi(2)).sum();
                        26.0 * (squares / n).sqrt()
                    };
                    let middle = f64::midpoint(start_s, end_s);
                    let resting_v = volts(full, middle);
                    let noise = weather.noise_us / (2.0 * n).sqrt();
                    let pulse = world.pulse_us(drone, climb - wind, resting_v, height_m, middle)
                        + noise * normal(rng);
                    WindowStats {
                        offset_outside: false,
                        tilt_form_us: 0.0,
                        kind,
                        label: String::new(),
                        start_s,
                        end_s,
                        commanded_mps: climb,
                        height_m,
                        velocity_mps: stats(climb, 0.001),
                        effort: stats(pulse, noise.hypot(scatter / n.sqrt())),
                        effort_phi: stats(pulse, noise.hypot(scatter / n.sqrt())),
                        tilt_deg: stats(0.0, 0.0),
                        lean_deg: 0.0,
                        offset_us: None,
                        supply: Some(Supply { resting_v, power_w: 0.0, resistance_ohm: 0.0 }),
                        rejected: Vec::new(),
                    }
                })
                .collect();
            DroneAnalysis {
                offset: None,
                slot: Some(drone as u16 + 1),
                name: format!("Drone {drone}"),
                source: String::new(),
                home_m: None,
                clock: Clock::default(),
                laws: super::calibrate::calibrate(&windows, &FitOptions::default()).ok(),
                line: None,
                windows,
                partial_ladder: None,
                trace: Trace::default(),
                warnings: Vec::new(),
            }
        })
        .collect();
    FlightAnalysis {
        indicator: Indicator::Pulse,
        orientation_deg: None,
        site: None,
        site_name: None,
        utc_offset_h: None,
        simulated: false,
        statistics: None,
        turbulence: None,
        wind_legs: None,
        name: String::new(),
        purpose: Purpose::Calibration,
        planned: true,
        true_updraft_mps: None,
        drones,
        logs: DRONES,
        missing: Vec::new(),
        flock: None,
        headline: None,
        table: Vec::new(),
        map: None,
        unmeasured: Vec::new(),
        paper_table: None,
        warnings: Vec::new(),
        unused: Vec::new(),
        partly_used: Vec::new(),
    }
}

/// A hover of one drone and the true 10 s means of its air.
fn hover(
    rng: &mut Pcg64,
    world: &World,
    weather: Weather,
    drone: usize,
    shared: &[f64],
) -> (Flight, Vec<f64>) {
    let local = wander(rng, weather.local, HOVER_S);
    let full = 8.2 + 0.05 * normal(rng);
    let air: Vec<f64> = shared.iter().zip(&local).map(|(s, l)| s + l).collect();
    let time_s: Vec<f64> = (0..air.len()).map(|index| index as f64 * STEP_S).collect();
    let series = |value: Vec<f64>| Series { time_s: time_s.clone(), value };
    let flat = |value: f64| series(vec![value; air.len()]);
    let pulse: Vec<f64> = time_s
        .iter()
        .zip(&air)
        .map(|(time, air)| {
            let noise = weather.noise_us / 2.0_f64.sqrt() * normal(rng);
            world.pulse_us(drone, -air, volts(full, *time), 100.0, *time) + noise
        })
        .collect();
    let flight = Flight {
        pulse_max_us: series(pulse.clone()),
        pulse_min_us: series(pulse.clone()),
        effort: Effort { values: series(pulse), ..Effort::default() },
        pulse_limits_us: (1150.0, 1950.0),
        velocity_up_mps: flat(0.0),
        height_m: flat(100.0),
        roll_rad: flat(0.0),
        pitch_rad: flat(0.0),
        resting_v: Some(series(time_s.iter().map(|time| volts(full, *time)).collect())),
        clock: Clock { method: crate::flight::Alignment::ShowRows, ..Clock::default() },
        ..Flight::default()
    };
    let truth = (0..HOVER_S as i32)
        .map(f64::from)
        .map(|second| {
            // The trapezoids of the running mean.
            let (from, to) = ((second - 5.0) / STEP_S, (second + 5.0) / STEP_S);
            if from < 0.0 || to >= air.len() as f64 {
                return f64::NAN;
            }
            let inside = &air[from as usize..=to as usize];
            let ends = f64::midpoint(inside[0], inside[inside.len() - 1]);
            (inside.iter().sum::<f64>() - ends) / (inside.len() - 1) as f64
        })
        .collect();
    (flight, truth)
}

/// Shares of values and of means inside of their intervals, and the rms error, of one campaign.
fn campaign(seed: u64, weather: Weather, shape: LawKind) -> [f64; 3] {
    let mut rng = stream(seed, 0, Stream::Sensors);
    let world = World::new(&mut rng, shape);
    assert_eq!(world.shape, shape);
    let calibration = calibration(&mut rng, &world, weather);
    let density = match shape {
        LawKind::Linear => World::density(),
        LawKind::SignedQuadratic => Density { exponent: 1.0, ..World::density() },
    };
    let corrections = Corrections {
        density: Some(density),
        // Nothing leans here.
        leaning: Some(super::wind::Leaning { thrust_exponent: 1.0, drag_speed_mps: 38.0 }),
        ..Corrections::default()
    };
    let sag = (shape == LawKind::Linear).then(Sag::default);
    let aware = Aware::new(&calibration, corrections, sag, Some(shape)).unwrap();
    let shared = wander(&mut rng, weather.shared, HOVER_S);
    let (mut inside, mut values, mut squares, mut means) = (0, 0, 0.0, 0);
    for drone in 0..DRONES {
        let (flight, truth) = hover(&mut rng, &world, weather, drone, &shared);
        let target = Target {
            kind: SegmentKind::Hover,
            label: String::new(),
            start_s: 0.0,
            end_s: HOVER_S,
            commanded_mps: 0.0,
        };
        let seconds = Hover::of(&flight, &target, &WindowOptions::default());
        let slot = Some(drone as u16 + 1);
        let measured = aware.measure(&flight, &seconds, slot, "").unwrap();
        let mut sum = [0.0, 0.0];
        for (index, interval) in measured.interval_mps.iter().enumerate() {
            let truth = truth[measured.first_s as usize + index];
            let (Some([low, high]), true) = (interval, truth.is_finite()) else { continue };
            values += 1;
            inside += usize::from((*low..=*high).contains(&truth));
            squares += (measured.updraft_mps[index].unwrap() - truth).powi(2);
            sum = [sum[0] + truth, sum[1] + 1.0];
        }
        let [low, high] = measured.mean_interval_mps;
        means += usize::from((low..=high).contains(&(sum[0] / sum[1])));
    }
    let n = values as f64;
    [inside as f64 / n, means as f64 / DRONES as f64, (squares / n).sqrt()]
}

/// Mean shares over campaigns with their Monte-Carlo errors: values of one campaign share its zero,
/// so that campaigns are counted, not values.
fn cover(campaigns: u64, weather: Weather, shape: LawKind) -> [(f64, f64); 2] {
    use rayon::prelude::*;
    let shares: Vec<[f64; 3]> =
        (0..campaigns).into_par_iter().map(|seed| campaign(seed, weather, shape)).collect();
    let rms = shares.iter().map(|share| share[2].powi(2)).sum::<f64>() / shares.len() as f64;
    let found = [0, 1].map(|which| {
        let values: Vec<f64> = shares.iter().map(|share| share[which]).collect();
        let (mean, sd) = super::stats::mean_sd(&values);
        (mean, sd / (values.len() as f64).sqrt())
    });
    println!(
        "{shape:?} {weather:?}: values {:.3} ± {:.3}, means {:.3} ± {:.3}, rms {:.3} m/s",
        found[0].0,
        found[0].1,
        found[1].0,
        found[1].1,
        rms.sqrt()
    );
    found
}

const STILL: Weather = Weather { shared: (0.0, 100.0), local: (0.0, 100.0), noise_us: 2.0 };
const FIELD: Weather = Weather { shared: (0.48, 186.0), local: (0.14, 186.0), noise_us: 4.0 };
const GUSTY: Weather = Weather { shared: (0.3, 15.0), local: (0.3, 5.0), noise_us: 6.0 };
const BREEZE: Weather = Weather { shared: (0.2, 60.0), local: (0.1, 30.0), noise_us: 4.0 };

fn holds(campaigns: u64, weather: Weather, shape: LawKind) {
    for (share, error) in cover(campaigns, weather, shape) {
        let (low, high) = (share - 2.0 * error, share + 2.0 * error);
        assert!(low <= 0.97 && high >= 0.93, "{shape:?} {weather:?}: {share} ± {error}");
    }
}

#[test]
fn intervals_hold_95_percent_in_still_air() {
    holds(60, STILL, LawKind::Linear);
}

#[test]
fn intervals_hold_95_percent_in_the_air_of_a_field_day() {
    holds(120, FIELD, LawKind::Linear);
}

/// `cargo test --release --lib coverage -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn many_campaigns() {
    for shape in [LawKind::Linear, LawKind::SignedQuadratic] {
        for weather in [STILL, BREEZE, GUSTY, FIELD] {
            cover(1000, weather, shape);
        }
    }
}

/// What drone 0 measures in a hover at a lean, by a calibration in still air: its values, the noise of a second
/// in us, the law's true slope, and what it shares with the others.
fn at_a_lean(lean_rad: f64, corrections: Corrections<'_>) -> (Measured, f64, f64, CommonError) {
    in_air(0.0, lean_rad, corrections)
}

/// The same in air that rises.
fn in_air(
    air_mps: f64,
    lean_rad: f64,
    corrections: Corrections<'_>,
) -> (Measured, f64, f64, CommonError) {
    let mut rng = stream(5, 0, Stream::Sensors);
    let world = World::new(&mut rng, LawKind::Linear);
    let calibration = calibration(&mut rng, &world, STILL);
    let corrections = Corrections { density: Some(World::density()), ..corrections };
    let sag = Some(Sag::default());
    let aware = Aware::new(&calibration, corrections, sag, Some(LawKind::Linear)).unwrap();
    let air = vec![air_mps; (HOVER_S / STEP_S) as usize];
    let (mut flight, _) = hover(&mut rng, &world, STILL, 0, &air);
    flight.roll_rad.value.fill(lean_rad);
    let label = String::new();
    let target = Target {
        kind: SegmentKind::Hover,
        label,
        start_s: 0.0,
        end_s: HOVER_S,
        commanded_mps: 0.0,
    };
    let seconds = Hover::of(&flight, &target, &WindowOptions::default());
    let measured = aware.measure(&flight, &seconds, Some(1), "").unwrap();
    let common = aware.common(&[&measured]);
    (measured, seconds.noise_us(0.0), world.laws[0][1], common)
}

#[test]
fn the_noise_of_ten_seconds_is_that_of_one_over_the_root_of_ten() {
    let (measured, noise_us, slope, _) = at_a_lean(0.0, Corrections::default());
    let sd: Vec<f64> = measured.sd_mps.iter().flatten().copied().collect();
    assert_eq!(sd.len(), 231, "the values of 240 s");
    let one_second_mps = noise_us / slope;
    for sd_mps in sd {
        let ratio = sd_mps / one_second_mps;
        assert!((ratio - 10_f64.sqrt().recip()).abs() < 0.03, "{ratio}");
    }
    let ratio = measured.errors.window_mps / one_second_mps;
    assert!((ratio - 231_f64.sqrt().recip()).abs() < 0.006, "{ratio}");
}

#[test]
fn every_origin_of_an_error_is_in_the_total() {
    let (measured, .., common) = at_a_lean(5_f64.to_radians(), Corrections::default());
    let errors = measured.errors;
    let parts = [
        errors.window_mps,
        errors.law_mps,
        errors.zero_mps,
        errors.battery_mps,
        errors.wind_mps,
        errors.density_mps,
    ];
    assert!(parts.iter().all(|part| *part > 0.0), "{errors:?}");
    assert!(errors.wind_mps > 0.3, "at 5 degrees nobody knows what the wind does: {errors:?}");
    let sum = parts.iter().map(|part| part * part).sum::<f64>() + errors.velocity_mps.powi(2);
    assert!((errors.total_mps - sum.sqrt()).abs() < 1e-9, "{errors:?}");
    let [low, high] = measured.mean_interval_mps;
    assert!((high - low) / 2.0 > 1.9 * errors.total_mps, "{low} {high} {errors:?}");
    let parts =
        [common.zero_mps, common.battery_mps, common.wind_mps, common.density_mps, common.law_mps];
    assert!(parts.iter().all(|part| *part > 0.0), "{common:?}");
    let sum: f64 = parts.iter().map(|part| part * part).sum();
    assert!((common.se_mps - sum.sqrt()).abs() < 1e-9, "{common:?}");
    assert!(common.half_width_mps >= 1.95 * common.se_mps, "{common:?}");
}

#[test]
fn air_is_told_to_be_faster_than_the_ladder_where_it_is() {
    let reasons = |air_mps: f64| -> Vec<String> {
        let (measured, ..) = in_air(air_mps, 0.0, Corrections::default());
        let beyond = |flag: &&QualityFlag| flag.flag == Quality::BeyondLadder;
        measured.quality.iter().filter(beyond).map(|flag| flag.reason.clone()).collect()
    };
    for air_mps in [-3.0, 0.0, 3.0] {
        assert_eq!(reasons(air_mps), [] as [&str; 0], "the ladder reaches to 3.5 m/s");
    }
    for air_mps in [-5.0, 5.0] {
        let told = "231 s of faster air than the ladder's -3.5 to +3.5 m/s";
        assert_eq!(reasons(air_mps), [told], "{air_mps} m/s");
    }
}
