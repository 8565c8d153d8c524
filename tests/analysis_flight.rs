use std::path::Path;
use updraft::analysis::calibrate::*;
use updraft::analysis::windows::*;
use updraft::flight::{Flight, FlightOptions};
use updraft::mission::plan::{Kind, Segment, Window};

fn ladder() -> Vec<Segment> {
    let mut s = Vec::new();
    let mut t = 0u64;
    let mut z = 0.0;
    let mut add = |kind: Kind, label: String, v: f64, dur: f64| {
        let d = (dur * 1000.0) as u64;
        let window = match kind {
            Kind::LegUp | Kind::LegDown => {
                Some(Window { start_ms: t + d - 10000, end_ms: t + d - 1000 })
            }
            Kind::Hover => Some(Window { start_ms: t + 3000, end_ms: t + d - 1000 }),
            _ => None,
        };
        s.push(Segment {
            kind,
            label,
            start_ms: t,
            end_ms: t + d,
            from_m: [0., 0., z],
            to_m: [0., 0., z + v * dur],
            velocity_mps: [0., 0., v],
            from_velocity_mps: None,
            window,
        });
        z += v * dur;
        t += d;
    };
    add(Kind::Takeoff, "climb".into(), 2.0, 10.0);
    add(Kind::Hover, "hover".into(), 0.0, 10.0);
    for i in 1..=7 {
        let v = 0.5 * f64::from(i);
        add(Kind::LegUp, format!("up {v} m/s"), v, 20.0);
        add(Kind::Hover, "hover".into(), 0.0, 10.0);
        add(Kind::LegDown, format!("down {v} m/s"), -v, 20.0);
        add(Kind::Hover, "hover".into(), 0.0, 10.0);
    }
    add(Kind::Landing, "descend".into(), -17.5 / 8.5, 8.5);
    s
}

#[test]
fn look() {
    let segments = ladder();
    for f in [
        "arducopter-4.4/ladder-still",
        "arducopter-4.4/ladder-wind5",
        "arducopter-4.4/square-law-ladder-still",
        "real/copter3-rtl",
        "real/copter4.4-sitl-baseline",
        "arducopter-4.4/short-flight",
    ] {
        let p = format!("/work/shared/data/{f}.BIN");
        let x = Flight::open(Path::new(&p), FlightOptions::default()).unwrap();
        let c = correct_tilt(&x, Tilt::Paper);
        for (how, t) in [("plan", planned(&segments)), ("log", inferred(&x))] {
            println!("== {f} {how} {} windows, contradiction {:?}", t.len(), contradiction(&x, &t));
            let w = measure(&x, &c, &t, &WindowOptions::default());
            if how == "plan" && f.contains("ladder") || how == "log" {
                for w in &w {
                    println!(
                        "{:20} {:8.2} {:8.2} cmd {:6.3} V {:8.4} med {:8.4} u {:9.3} med {:7.1} trim {:9.3} sd {:.3} se {:.3} uphi {:9.3} tilt {:.2} h {:.1} {:?}",
                        w.label,
                        w.start_s,
                        w.end_s,
                        w.commanded_mps,
                        w.velocity_mps.mean,
                        w.velocity_mps.median,
                        w.pulse_us.mean,
                        w.pulse_us.median,
                        w.pulse_us.trimmed,
                        w.pulse_us.sd,
                        w.pulse_us.se,
                        w.pulse_phi_us.mean,
                        w.tilt_deg.mean,
                        w.height_m,
                        w.rejected
                    );
                }
            }
            for (name, o) in [
                ("default", FitOptions::default()),
                (
                    "paper",
                    FitOptions {
                        location: Location::Median,
                        weights: Weights::WindowSd,
                        ..Default::default()
                    },
                ),
                (
                    "equal",
                    FitOptions {
                        location: Location::Mean,
                        weights: Weights::Equal,
                        ..Default::default()
                    },
                ),
            ] {
                match calibrate(&w, &o) {
                    Ok(l) => {
                        println!(" {name}: added {:?}", l.sigma_added_us);
                        for fit in [&l.signed_quadratic, &l.linear].into_iter().flatten() {
                            println!(
                                "   {} chi2nu {:?} p {:?} rms {:.3} others {:?} {:?}",
                                fit.parameters
                                    .iter()
                                    .map(|p| format!(
                                        "{} {:.4}±{:.4}",
                                        p.name, p.estimate.value, p.estimate.se
                                    ))
                                    .collect::<Vec<_>>()
                                    .join(" "),
                                fit.chi2_reduced,
                                fit.p_value,
                                fit.rms_us,
                                fit.other_minima,
                                fit.warnings
                            );
                        }
                    }
                    Err(e) => println!(" {name}: {e}"),
                }
            }
        }
    }
}
