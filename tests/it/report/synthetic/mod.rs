//! A synthetic analysis: what the paper's campaign would give in simulated air.
//!
//! Deterministic, and independent of the analysis code: the report is tested against it alone.

#![allow(dead_code, clippy::allow_attributes, reason = "each test binary uses a part")]

mod posterior;
mod traces;
mod whole;

use std::f64::consts::TAU;

use rand::Rng as _;
use updraft::analysis::law::{LawOf, Symbol};
use updraft::analysis::result::{
    ANALYSIS_SCHEMA, Analysis, DroneAnalysis, DroneUpdraft, ErrorBudget, Fit, FitWarning,
    FlightAnalysis, FlightSite, Laws, Missing, Parameter, Rejection, SampleStats, TableRow, Trace,
    Unmeasured, UpdraftMap, WindowStats,
};
use updraft::analysis::table::{PaperTable, Quantity, TableLaw};
use updraft::analysis::{Cause, LawKind, Warning};
use updraft::base::estimate::Estimate;
use updraft::base::rng::{self, Purpose as Stream};
use updraft::flight::{Alignment, Clock, Indicator};
use updraft::mission::plan::{Purpose, SegmentKind};
use updraft::report::{InputFile, Provenance};

#[allow(unused_imports, reason = "each test binary uses a part")]
pub(crate) use posterior::posterior;
#[allow(unused_imports, reason = "each test binary uses a part")]
pub(crate) use traces::{crowd, traced};
pub(crate) use whole::whole_campaign;

/// The paper's simulated law.
const A: f64 = 8.14;
const U0: f64 = 1598.6;
const W_BIAS: f64 = -0.035;
const SPACING_M: f64 = 7.0;

/// Noise of one drone.
struct Noise(rand_pcg::Pcg64);

impl Noise {
    fn of(slot: u16, stream: Stream) -> Self {
        Self(rng::stream(2024, u64::from(slot), stream))
    }

    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Close enough to a standard normal number.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// 49 drones, calibration and hover, some logs missing.
pub(crate) fn campaign() -> Analysis {
    let missing = [
        (7, "no log was found"),
        (18, "the log ends 41 s before take-off"),
        (33, "no log was found"),
        (41, "the file is not a DataFlash log"),
    ];
    let calibration = calibration("calibration", 49, 0.0, &missing);
    Analysis {
        schema: ANALYSIS_SCHEMA.to_owned(),
        made_by: "updraft 0.1.0".to_owned(),
        title: "Pixel fleet, 49 drones over a synthetic thermal".to_owned(),
        flights: vec![calibration, hover()],
        laws_from: None,
        warnings: vec![Warning::Said(
            "Slot 12: the clock was aligned with the plan only; its windows may be off by 0.2 s."
                .to_owned(),
        )],
    }
}

/// One drone flown in eleven updrafts, as for the paper's Figure 2.
pub(crate) fn updraft_series() -> Analysis {
    let flights = (-5..=5)
        .map(|i| {
            let w = f64::from(i) * 0.7;
            calibration(&format!("updraft {w:+.1} m/s"), 1, w, &[])
        })
        .collect();
    Analysis {
        schema: ANALYSIS_SCHEMA.to_owned(),
        made_by: "updraft 0.1.0".to_owned(),
        title: "One drone in eleven updrafts".to_owned(),
        flights,
        laws_from: None,
        warnings: Vec::new(),
    }
}

pub(crate) fn provenance() -> Provenance {
    Provenance {
        program: "updraft 0.1.0".to_owned(),
        command: "updraft run --grid 7x7 --spacing 7 --seed 2024 -o my-campaign".to_owned(),
        seed: Some(2024),
        made_at: "2026-11-20 12:00 UTC".to_owned(),
        settings: vec![("law of the map".to_owned(), "auto".to_owned())],
        inputs: (1..=3)
            .map(|i| InputFile {
                path: format!("calibration/logs/{i:02}.BIN"),
                sha256: format!("{i:02x}").repeat(32),
            })
            .collect(),
        ..Provenance::default()
    }
}

fn site() -> FlightSite {
    FlightSite { lat_deg: 47.4733, lon_deg: 19.0621, ground_amsl_m: Some(190.0), planned: true }
}

fn home(slot: u16) -> [f64; 2] {
    let (row, column) = ((slot - 1) / 7, (slot - 1) % 7);
    [(f64::from(row) - 3.0) * SPACING_M, (f64::from(column) - 3.0) * SPACING_M]
}

pub(crate) fn calibration(
    name: &str,
    drones: u16,
    truth: f64,
    missing: &[(u16, &str)],
) -> FlightAnalysis {
    let gone: Vec<u16> = missing.iter().map(|(slot, _)| *slot).collect();
    let analysed: Vec<DroneAnalysis> = (1..=drones)
        .filter(|slot| !gone.contains(slot))
        .map(|slot| calibrated_drone(slot, truth))
        .collect();
    let flock = Laws {
        signed_quadratic: Some(fit(&[
            (Symbol::A, A, 0.012),
            (Symbol::U0, U0, 0.031),
            (Symbol::W, truth + W_BIAS, 0.0021),
        ])),
        signed_quadratic_held: None,
        sigma_added_us: Some(0.42),
        held: None,
        linear: Some(straight(23.1, U0 - 0.4)),
    };
    let table = table(&analysed);
    FlightAnalysis {
        name: name.to_owned(),
        indicator: Indicator::Pulse,
        purpose: Purpose::Calibration,
        planned: true,
        orientation_deg: Some(30.0),
        site: Some(site()),
        site_name: None,
        utc_offset_h: None,
        simulated: true,
        warnings: Vec::new(),
        unused: Vec::new(),
        partly_used: Vec::new(),
        true_updraft_mps: Some(truth),
        logs: analysed.len(),
        drones: analysed,
        missing: missing
            .iter()
            .map(|(slot, reason)| Missing {
                slot: *slot,
                home_m: None,
                reason: Cause::Said((*reason).to_owned()),
            })
            .collect(),
        flock: (drones > 1).then_some(flock),
        headline: None,
        table: if drones > 1 { table } else { Vec::new() },
        map: None,
        unmeasured: Vec::new(),
        statistics: None,
        turbulence: None,
        wind_legs: None,
        paper_table: Some(PaperTable::Simulation),
    }
}

/// Legs of the ladder: start (s), end (s), velocity (m/s).
fn ladder() -> Vec<(f64, f64, f64)> {
    let mut legs = vec![(30.0, 40.0, 0.0)];
    let mut time = 40.0;
    for step in 1..=7 {
        for sign in [1.0, -1.0] {
            legs.push((time, time + 20.0, sign * 0.5 * f64::from(step)));
            legs.push((time + 20.0, time + 30.0, 0.0));
            time += 30.0;
        }
    }
    legs
}

fn law(v: f64, w: f64) -> f64 {
    A * (v - w) * (v - w).abs() + U0
}

fn calibrated_drone(slot: u16, truth: f64) -> DroneAnalysis {
    let mut noise = Noise::of(slot, Stream::Sensors);
    let bias = 0.06 * noise.normal();
    let w = truth + W_BIAS;
    let mut windows = Vec::new();
    let mut trace = Trace::default();
    let mut height = 20.0;
    for (start, end, v) in ladder() {
        let begin = if v == 0.0 { start } else { start + 10.0 };
        let stats = |median: f64, sd: f64| SampleStats {
            median,
            mean: median,
            trimmed: median,
            sd,
            se: sd / 3.0,
            n: 90,
        };
        let measured = law(v, w) + bias + 0.6 * noise.normal();
        windows.push(WindowStats {
            kind: match v {
                v if v > 0.0 => SegmentKind::LegUp,
                v if v < 0.0 => SegmentKind::LegDown,
                _ => SegmentKind::Hover,
            },
            label: if v == 0.0 {
                "hover".to_owned()
            } else {
                format!("{} {:.1} m/s", if v > 0.0 { "up" } else { "down" }, v.abs())
            },
            start_s: begin,
            end_s: end - 1.0,
            commanded_mps: v,
            height_m: height + v * (end - start) / 2.0,
            velocity_mps: stats(v + 0.01 * noise.normal(), 0.04),
            effort: stats(measured + 0.4, 4.0),
            effort_phi: stats(measured, 4.0),
            tilt_deg: stats(1.2, 0.4),
            lean_deg: 1.1,
            tilt_form_us: 0.0,
            offset_us: None,
            offset_outside: false,
            supply: None,
            rejected: if slot == 23 && v > 3.2 { vec![Rejection::Saturated] } else { Vec::new() },
        });
        let mut time = start;
        while time < end {
            let settled = 1.0 - (-(time - start) / 1.5).exp();
            trace.time_s.push(time);
            trace.height_m.push(height);
            trace.velocity_mps.push(v * settled + 0.03 * noise.normal());
            trace.pulse_phi_us.push(law(v * settled, w) + bias + 4.0 * noise.normal());
            height += 0.5 * v;
            time += 0.5;
        }
    }
    let (slope, u0) = straight_line(&windows);
    let chi2 = 0.98 + 0.3 * noise.normal().clamp(-2.0, 2.0);
    let mut quadratic = fit(&[
        (Symbol::A, A + 0.02 * noise.normal(), 0.021),
        (Symbol::U0, U0 + bias, 0.051),
        (Symbol::W, w + 0.004 * noise.normal(), 0.0043),
    ]);
    quadratic.chi2_reduced = Some(chi2);
    let mut warnings = Vec::new();
    if slot == 12 {
        let text = "no SHOW rows in the log; clock aligned with the plan".to_owned();
        warnings.push(Warning::Said(text));
    }
    if slot == 30 {
        let text = "W is correlated with A (0.93)".to_owned();
        quadratic.warnings.push(FitWarning::Said(text));
    }
    DroneAnalysis {
        slot: Some(slot),
        name: format!("Drone {slot}"),
        source: format!("calibration/logs/{slot:02}.BIN"),
        home_m: Some(home(slot)),
        clock: Clock {
            method: if slot == 12 { Alignment::Plan } else { Alignment::ShowRows },
            ..Clock::default()
        },
        windows,
        offset: None,
        line: None,
        laws: Some(Laws {
            signed_quadratic: Some(quadratic),
            signed_quadratic_held: None,
            sigma_added_us: Some(0.0),
            held: None,
            linear: Some(straight(slope, u0)),
        }),
        partial_ladder: None,
        trace,
        warnings,
    }
}

/// A line through windows on a parabola: many times their errors away from it.
fn straight(slope: f64, u0: f64) -> Fit {
    let line = fit(&[(Symbol::Slope, slope, 1.4), (Symbol::U0, u0, 3.1)]);
    Fit { chi2: 720.0, chi2_reduced: Some(60.0), ..line }
}

fn straight_line(windows: &[WindowStats]) -> (f64, f64) {
    let moving: Vec<(f64, f64)> = windows
        .iter()
        .filter(|window| window.kind.is_leg())
        .map(|window| (window.velocity_mps.median, window.effort_phi.median))
        .collect();
    let n = moving.len() as f64;
    let (mx, my) =
        (moving.iter().map(|p| p.0).sum::<f64>() / n, moving.iter().map(|p| p.1).sum::<f64>() / n);
    let slope = moving.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / moving.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    (slope, my - slope * mx)
}

pub(crate) fn fit(parameters: &[(Symbol, f64, f64)]) -> Fit {
    Fit {
        parameters: parameters
            .iter()
            .map(|(name, value, se)| Parameter {
                name: *name,
                unit: name.unit(Indicator::Pulse),
                estimate: Estimate::new(*value, *se),
                held: false,
            })
            .collect(),
        covariance: vec![0.0; parameters.len().pow(2)],
        points: 14,
        chi2: 10.8,
        chi2_reduced: Some(10.8 / (14 - parameters.len()) as f64),
        dof: 14 - parameters.len(),
        p_value: None,
        rms_us: 0.61,
        other_minima: Vec::new(),
        warnings: Vec::new(),
        w_beyond_mps: None,
    }
}

fn table(drones: &[DroneAnalysis]) -> Vec<TableRow> {
    let row = |law: TableLaw, parameter: Quantity, unit: &str, paper: Option<Estimate>| {
        let estimates: Vec<Estimate> = drones
            .iter()
            .filter_map(|drone| {
                let laws = drone.laws.as_ref()?;
                let fit =
                    if law == TableLaw::Linear { &laws.linear } else { &laws.signed_quadratic };
                let fit = fit.as_ref()?;
                match parameter {
                    Quantity::Parameter(symbol) => Some(fit.parameter(symbol)?.estimate),
                    _ => Some(Estimate::new(fit.chi2_reduced?, 0.0)),
                }
            })
            .collect();
        let n = estimates.len() as f64;
        let mean = estimates.iter().map(|e| e.value).sum::<f64>() / n;
        let squares = estimates.iter().map(|e| (e.value - mean).powi(2)).sum::<f64>();
        TableRow {
            law,
            parameter,
            unit: unit.to_owned(),
            mean,
            sd: (squares / (n - 1.0)).sqrt(),
            mean_se: estimates.iter().map(|e| e.se).sum::<f64>() / n,
            n: estimates.len(),
            paper,
            not_compared: None,
        }
    };
    let paper = |value, se| Some(Estimate::new(value, se));
    vec![
        row(
            TableLaw::SignedQuadratic,
            Quantity::Parameter(Symbol::A),
            "us/(m/s)²",
            paper(8.207, 0.020),
        ),
        row(
            TableLaw::SignedQuadratic,
            Quantity::Parameter(Symbol::U0),
            "us",
            paper(1598.656, 0.039),
        ),
        row(
            TableLaw::SignedQuadratic,
            Quantity::Parameter(Symbol::W),
            "m/s",
            paper(-0.0589, 0.0031),
        ),
        row(TableLaw::SignedQuadratic, Quantity::ReducedChi2, "", None),
        row(TableLaw::Linear, Quantity::Parameter(Symbol::Slope), "us/(m/s)", paper(26.4, 2.6)),
        row(TableLaw::Linear, Quantity::Parameter(Symbol::U0), "us", paper(1546.5, 7.8)),
        row(TableLaw::Linear, Quantity::ReducedChi2, "", None),
    ]
}

/// A thermal beside the middle of the grid, sinking air around it, slowly swinging.
fn air(position: [f64; 2], time_s: f64) -> f64 {
    let drift = 5.0 * (time_s / 600.0 - 0.5);
    let r2 = (position[0] - 8.0 - drift).powi(2) + (position[1] + 5.0 + drift).powi(2);
    1.15 * (-r2 / (2.0 * 11.0_f64.powi(2))).exp() - 0.38
        + 0.16 * (TAU * time_s / 240.0 + position[0] / 25.0).sin()
}

pub(crate) fn hover() -> FlightAnalysis {
    let missing: [(u16, &str); 6] = [
        (3, "no log was found"),
        (7, "no log was found"),
        (18, "no log was found"),
        (26, "the log has no EKF velocity"),
        (33, "no log was found"),
        (45, "the log ends after 212 s of 600 s"),
    ];
    let slots = (1..=49).filter(|slot| !missing.iter().any(|(gone, _)| gone == slot));
    let mut drones = Vec::new();
    let mut estimates = Vec::new();
    let time_s: Vec<f64> = (0..590).map(|i| 95.0 + f64::from(i)).collect();
    for slot in slots {
        let mut noise = Noise::of(slot, Stream::Air);
        let position = home(slot);
        let bias = 0.025 * noise.normal();
        let mut drift = 0.0;
        let truth: Vec<f64> = time_s.iter().map(|&time| air(position, time)).collect();
        let updraft: Vec<Option<f64>> = truth
            .iter()
            .enumerate()
            .map(|(index, w)| {
                drift = 0.9 * drift + 0.02 * noise.normal();
                (slot != 20 || index < 300).then_some(w + bias + drift)
            })
            .collect();
        let present: Vec<f64> = updraft.iter().copied().flatten().collect();
        let mean = present.iter().sum::<f64>() / present.len() as f64;
        // Its hover was rejected: see `unmeasured` below.
        let measured = slot != 44;
        estimates.extend(measured.then(|| DroneUpdraft {
            slot: Some(slot),
            name: format!("Drone {slot}"),
            position_m: Some(position),
            track_m: Vec::new(),
            height_m: 100.0,
            mapping: if [41].contains(&slot) { LawOf::Flock } else { LawOf::Own },
            mean: Estimate::new(mean, 0.028),
            mean_interval_mps: None,
            errors: ErrorBudget::default(),
            systematic_mps: 0.11,
            tilt_deg: 1.2,
            updraft_mps: updraft,
            sd_mps: Vec::new(),
            interval_mps: Vec::new(),
            posterior_mps: Vec::new(),
            posterior_sd_mps: Vec::new(),
            posterior_mean: None,
            quality: Vec::new(),
            truth_mps: Some(truth.into_iter().map(Some).collect()),
            place: None,
            wind: None,
        }));
        drones.push(DroneAnalysis {
            slot: Some(slot),
            name: format!("Drone {slot}"),
            source: format!("hover/logs/{slot:02}.BIN"),
            home_m: Some(position),
            clock: Clock { method: Alignment::ShowRows, ..Clock::default() },
            windows: Vec::new(),
            offset: None,
            laws: None,
            line: None,
            partial_ladder: None,
            trace: Trace::default(),
            warnings: if slot == 20 {
                vec![Warning::Said("gap of 290 s in the log".to_owned())]
            } else {
                Vec::new()
            },
        });
    }
    FlightAnalysis {
        name: "hover".to_owned(),
        indicator: Indicator::Pulse,
        purpose: Purpose::Measurement,
        planned: true,
        orientation_deg: Some(30.0),
        site: Some(site()),
        site_name: None,
        utc_offset_h: None,
        simulated: true,
        warnings: Vec::new(),
        unused: Vec::new(),
        partly_used: Vec::new(),
        true_updraft_mps: None,
        logs: drones.len(),
        drones,
        missing: missing
            .iter()
            .map(|(slot, reason)| Missing {
                slot: *slot,
                home_m: None,
                reason: Cause::Said((*reason).to_owned()),
            })
            .collect(),
        flock: None,
        headline: None,
        table: Vec::new(),
        unmeasured: vec![Unmeasured {
            slot: Some(44),
            name: "Drone 44".to_owned(),
            reason: Cause::Said(
                "the hover from 95 to 685 s was rejected: a motor touched its limit".to_owned(),
            ),
        }],
        statistics: None,
        turbulence: None,
        wind_legs: None,
        paper_table: None,
        map: Some(UpdraftMap {
            law: LawKind::SignedQuadratic,
            law_reason: None,
            wind: None,
            leaning: None,
            density: None,
            flock: None,
            time_s,
            drones: estimates,
            battery: None,
            calibration_air: None,
            common: None,
            truth: None,
            levelled: None,
            combined: None,
            posterior: None,
            thermals: Vec::new(),
        }),
    }
}
