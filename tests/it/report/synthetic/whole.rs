//! The synthetic campaign with everything that an analysis in the field adds: offsets, errors,
//! quality, statistics.

use updraft::analysis::offset::{OffsetMap, OffsetPoint};
use updraft::analysis::result::{
    Analysis, CommonError, ErrorBudget, Quality, QualityFlag, TruthCheck,
};
use updraft::analysis::statistics::result::{
    Anisotropy, Averaging, DistanceClass, DistanceCorrelation, FieldRecord, FieldStatistics,
    HalfRecord, Interval, Reached, Reads, Scale, Simulated, SpaceCorrelation, TiltWind,
    TimeCorrelation, TimeLine, Treatment, Variant,
};
use updraft::base::estimate::Estimate;

/// [`super::campaign`] as flown in a field.
pub(crate) fn whole_campaign() -> Analysis {
    let mut analysis = super::campaign();
    for drone in &mut analysis.flights[0].drones {
        let phase = f64::from(drone.slot.unwrap_or(0)) / 9.0;
        let points = drone
            .windows
            .iter()
            .filter(|window| window.kind.is_hover())
            .map(|window| {
                let time_s = f64::midpoint(window.start_s, window.end_s);
                let offset_us =
                    8.0 * (time_s / 70.0 + phase).sin() + 0.05 * (window.height_m - 40.0);
                OffsetPoint { time_s, height_m: window.height_m, offset_us }
            })
            .collect();
        let map = OffsetMap { baseline_us: Estimate::new(1598.6, 1.2), points };
        map.apply(&mut drone.windows);
        drone.offset = Some(map);
    }
    let hover = &mut analysis.flights[1];
    hover.statistics = Some(statistics());
    let map = hover.map.as_mut().expect("a map");
    for drone in &mut map.drones {
        drone.errors = ErrorBudget {
            window_mps: 0.02,
            law_mps: 0.05,
            zero_mps: 0.11,
            battery_mps: 0.04,
            wind_mps: 0.03,
            density_mps: 0.01,
            velocity_mps: 0.02,
            total_mps: 0.135,
        };
        drone.mean_interval_mps = Some([drone.mean.value - 0.27, drone.mean.value + 0.27]);
        drone.sd_mps = drone.updraft_mps.iter().map(|w| w.map(|_| 0.06)).collect();
        drone.interval_mps =
            drone.updraft_mps.iter().map(|w| w.map(|w| [w - 0.3, w + 0.3])).collect();
    }
    map.drones[4].quality = vec![QualityFlag {
        flag: Quality::LowBattery,
        start_s: 500.0,
        end_s: 684.0,
        reason: "6.61 V, below 3.35 V for each cell".to_owned(),
    }];
    map.common = Some(CommonError {
        se_mps: 0.12,
        half_width_mps: 0.27,
        zero_mps: 0.11,
        battery_mps: 0.04,
        wind_mps: 0.03,
        density_mps: 0.01,
        law_mps: 0.02,
    });
    map.truth = Some(TruthCheck {
        zero_rms_mps: 0.5,
        drones: map.drones.len(),
        values: 24_000,
        rms_mps: 0.101,
        bias_mps: -0.034,
        rms_without_bias_mps: 0.095,
        inside_share: Some(0.953),
        means_inside_share: Some(0.976),
        limit_rms_mps: None,
        at_limit_rms_mps: None,
        limit_se_mps: None,
    });
    analysis
}

fn statistics() -> FieldStatistics {
    let interval = |low, high| Some(Interval { low, high });
    let lambda = |value, paper, se| Scale {
        value,
        fit_se: Some(0.03 * value),
        interval_95: interval(0.4 * value, 4.1 * value),
        reads: Some(Reads {
            truth: value,
            median: 0.55 * value,
            range_90: Interval { low: 0.2 * value, high: 1.6 * value },
            flights: 400,
        }),
        paper: Some(Estimate::new(paper, se)),
        undetermined: None,
    };
    let along = |columns: f64, lambda_m: Scale| DistanceCorrelation {
        classes: (1..=6).map(|k| class(7.0 * f64::from(k), columns / f64::from(k))).collect(),
        lambda_m: Some(lambda_m),
        ..DistanceCorrelation::default()
    };
    let mut distances: Vec<f64> = (0..=6_i32)
        .flat_map(|i| (i.max(1)..=6).map(move |j| 7.0 * f64::from(i * i + j * j).sqrt()))
        .collect();
    distances.sort_by(f64::total_cmp);
    distances.dedup();
    let all = DistanceCorrelation {
        classes: distances.into_iter().map(|r| class(r, 30.0)).collect(),
        lambda_m: Some(lambda(98.2, 145.4, 3.0)),
        ..DistanceCorrelation::default()
    };
    let lag_s: Vec<f64> = (0..=400).map(f64::from).collect();
    let mean: Vec<f64> = lag_s.iter().map(|lag| (-lag / 120.0).exp() - 0.0012 * lag).collect();
    FieldStatistics {
        record: FieldRecord {
            drones: 42,
            length_s: 590.0,
            missing_share: 0.004,
            running_mean_s: 10.0,
            spacing_m: 7.0,
            extent_m: 59.4,
            sd_mps: 0.31,
            common_sd_mps: 0.22,
        },
        space: Some(SpaceCorrelation {
            all,
            along_x: Some(along(30.0, lambda(88.0, 121.3, 6.8))),
            along_y: Some(along(26.0, lambda(131.0, 252.0, 18.0))),
            anisotropy: Some(Anisotropy {
                ratio: 1.49,
                p_value: Some(0.61),
                words: "The lengths along x and y differ by less than chance makes them."
                    .to_owned(),
            }),
            words: "A grid of 42 m reads half of a true length of 145 m.".to_owned(),
        }),
        time: Some(TimeCorrelation {
            sd_between_drones: lag_s.iter().map(|lag| 0.02 + 0.0004 * lag).collect(),
            drones: vec![42; lag_s.len()],
            lag_s,
            mean,
            first_zero_s: Some(146.0),
            line: Some(TimeLine {
                slope_per_s: Estimate::new(-0.0064, 0.0001),
                t0_s: lambda(149.0, 186.0, 0.37),
                points: 147,
            }),
            half_record: Some(HalfRecord {
                length_s: 295.0,
                first_t0_s: Some(71.0),
                second_t0_s: Some(80.0),
                ratio: 0.51,
                simulated_ratio: None,
                words: "Half of the record gives half of t₀.".to_owned(),
            }),
            words: "t₀ is made by the length of the record.".to_owned(),
        }),
        likelihood: None,
        variants: [Treatment::AsMeasured, Treatment::Detrended]
            .map(|treatment| Variant { treatment, lambda_m: Some(98.2), ..Variant::default() })
            .into(),
        simulated: Some(Simulated {
            flights: 400,
            seed: 1,
            words: "400 simulated flights of the same drones.".to_owned(),
        }),
        wind: Some(TiltWind {
            from_deg: Some(240.0),
            speed_mps: Some(Estimate::new(2.4, 0.2)),
            words: "2.4 ± 0.2 m/s from 240°.".to_owned(),
            ..TiltWind::default()
        }),
        baseline: None,
        averaging: Some(Averaging {
            averaging_s: vec![1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0],
            median_mps: vec![0.04, 0.06, 0.1, 0.15, 0.17, 0.14, 0.11, 0.12],
            quartiles_mps: [0.04, 0.06, 0.1, 0.15, 0.17, 0.14, 0.11, 0.12]
                .map(|mps| Interval { low: 0.8 * mps, high: 1.25 * mps })
                .into(),
            drones: Vec::new(),
            smoothed_below_s: 10.0,
            best: Some(Reached { deviation_mps: 0.11, averaging_s: 100.0 }),
            reached: Vec::new(),
            words: "Averages of 100 s repeat best.".to_owned(),
        }),
        true_air: None,
        absent: vec!["Nothing was left out but this sentence.".to_owned()],
    }
}

fn class(distance_m: f64, pairs: f64) -> DistanceClass {
    let middle = (-distance_m / 98.2).exp();
    let n = pairs.max(1.0) as u32;
    let correlations: Vec<f64> = (0..n)
        .map(|i| {
            let place = 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
            (middle + 0.004 * distance_m * place.powi(3) - 0.02).clamp(-1.0, 1.0)
        })
        .collect();
    let mean = correlations.iter().sum::<f64>() / f64::from(n);
    DistanceClass {
        nominal_m: distance_m,
        distance_m,
        median: correlations[correlations.len() / 2],
        mean,
        quartiles: Interval {
            low: correlations[correlations.len() / 4],
            high: correlations[3 * correlations.len() / 4],
        },
        correlations,
        median_se: None,
    }
}
