use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

/// A source whose values are a function of component, time and point.
struct Made {
    value: fn(Component, usize, [usize; 3]) -> f32,
    reads: Arc<AtomicUsize>,
    fails: bool,
}

impl GridSource for Made {
    fn read(&self, component: Component, time: usize, block: &Block) -> Result<Vec<f32>, String> {
        self.reads.fetch_add(1, Ordering::Relaxed);
        if self.fails {
            return Err("the disk is gone".to_owned());
        }
        let mut values = Vec::new();
        for k in block.from[0]..block.from[0] + block.count[0] {
            for j in block.from[1]..block.from[1] + block.count[1] {
                for i in block.from[2]..block.from[2] + block.count[2] {
                    values.push((self.value)(component, time, [k, j, i]));
                }
            }
        }
        Ok(values)
    }
}

/// 40 x 70 points every 10 m, 12 heights every 5 m, staggered as models do, times every 10 s.
fn grid(repeats: bool) -> Grid {
    let along = |first_m: f64, count| Regular { first_m, spacing_m: 10.0, count };
    let heights = |first_m: f64| {
        Heights::of((0..12).map(|k| first_m + 5.0 * f64::from(k)).collect()).unwrap()
    };
    let points = [
        Points { x: along(0.0, 40), y: along(5.0, 70), z: heights(2.5) },
        Points { x: along(5.0, 40), y: along(0.0, 70), z: heights(2.5) },
        Points { x: along(5.0, 40), y: along(5.0, 70), z: heights(0.0) },
    ];
    Grid { points, times_s: (0..5).map(|k| 100.0 + 10.0 * f64::from(k)).collect(), repeats }
}

fn air(
    value: fn(Component, usize, [usize; 3]) -> f32,
    placing: Placing,
    passage: Passage,
) -> (GriddedAir, Arc<AtomicUsize>) {
    let reads = Arc::new(AtomicUsize::new(0));
    let source = Made { value, reads: Arc::clone(&reads), fails: false };
    (GriddedAir::new(Box::new(source), grid(true), placing, passage), reads)
}

fn here() -> Placing {
    Placing { origin_m: Vector3::zeros(), turned_rad: 0.0 }
}

/// Linear in place and time within the domain: interpolation must be exact.
fn linear(component: Component, time: usize, [k, j, i]: [usize; 3]) -> f32 {
    let points = &grid(true).points[component as usize];
    let x = points.x.first_m + 10.0 * i as f64;
    let y = points.y.first_m + 10.0 * j as f64;
    let z = points.z.all_m()[k];
    (match component {
        Component::U => 0.01 * x,
        Component::V => 0.01 * y + 0.02 * z,
        Component::W => 0.01 * (x + 2.0 * y) + 0.03 * z + 0.1 * time as f64,
    }) as f32
}

#[test]
fn staggered_components_are_linear_between_points_and_times() {
    let (air, _) = air(linear, here(), Passage::Replay { start_s: 105.0 });
    for (x, y, z, t) in
        [(33.0, 47.0, 12.0, 0.0), (321.0, 333.0, 31.0, 7.5), (300.5, 600.0, 50.0, 21.0)]
    {
        let at = Vector3::new(x, y, z);
        let v = air.air_velocity(&at, t);
        assert!((v.x - 0.01 * x).abs() < 1e-5, "{v}");
        assert!((v.y - 0.01 * y - 0.02 * z).abs() < 1e-5, "{v}");
        let w = 0.01 * (x + 2.0 * y) + 0.03 * z + 0.1 * (5.0 + t) / 10.0;
        assert!((v.z - w).abs() < 1e-5, "{v} instead of {w}");
        assert_eq!(air.sampler(1).air_velocity(&at, t), v);
    }
}

#[test]
fn beyond_the_domain_it_repeats_and_does_not_jump() {
    let waves = |component, _: usize, [_, j, i]: [usize; 3]| {
        let _: Component = component;
        ((i as f32 / 40.0 * std::f32::consts::TAU).sin()
            + (j as f32 / 70.0 * std::f32::consts::TAU).cos())
            * 2.0
    };
    let (air, _) = air(waves, here(), Passage::Replay { start_s: 100.0 });
    let mut sampler = air.sampler(1);
    let mut last = None;
    for step in -9_000..9_000 {
        let m = f64::from(step) * 0.25;
        let at = Vector3::new(m, 3.0 * m, 20.0);
        let v = sampler.air_velocity(&at, 0.0);
        let again = air.air_velocity(&(at + Vector3::new(-400.0, 1_400.0, 0.0)), 0.0);
        assert!((v - again).norm() < 1e-9, "{m}: {v} {again}");
        let jump = last.map_or(0.0, |last: Vector3<f64>| (v - last).norm());
        // 2 m/s times the steepest slope of both waves over a step.
        assert!(jump < 0.06, "{m}: {jump}");
        last = Some(v);
    }
}

#[test]
fn a_turned_model_turns_its_wind() {
    let towards_x =
        |component, _: usize, _: [usize; 3]| f32::from(u8::from(component == Component::U));
    let placing = Placing { origin_m: Vector3::zeros(), turned_rad: std::f64::consts::FRAC_PI_2 };
    let (air, _) = air(towards_x, placing, Passage::Replay { start_s: 100.0 });
    let v = air.air_velocity(&Vector3::new(10.0, 20.0, 30.0), 0.0);
    assert!((v - Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-12, "{v}");
    let place = |_, _: usize, [_, _, i]: [usize; 3]| i as f32;
    let (air, _) = self::air(place, placing, Passage::Replay { start_s: 100.0 });
    // The model's x is the show's y.
    let w = air.air_velocity(&Vector3::new(7.0, 105.0, 30.0), 0.0).z;
    assert!((w - 10.0).abs() < 1e-9, "{w}");
}

#[test]
fn frozen_air_is_carried_by_the_wind() {
    let place = |_, time: usize, [_, _, i]: [usize; 3]| (i + 100 * time) as f32;
    let passage = Passage::Advect { time: 3, wind_mps: Vector2::new(2.0, 0.0) };
    let (air, _) = air(place, here(), passage);
    let w = |x, t| air.air_velocity(&Vector3::new(x, 100.0, 20.0), t).z;
    assert_eq!(w(105.0, 0.0), 310.0);
    assert_eq!(w(155.0, 25.0), 310.0, "it has come 50 m");
    assert!((w(105.0, 25.0) - 305.0).abs() < 1e-9);
}

#[test]
fn below_the_lowest_point_the_wind_is_held_and_w_dies_out() {
    let ones = |_, _: usize, _: [usize; 3]| 1.0;
    let mut grid = grid(true);
    grid.points[2].z = Heights::of((1..13).map(|k| 5.0 * f64::from(k)).collect()).unwrap();
    let source = Made { value: ones, reads: Arc::default(), fails: false };
    let air = GriddedAir::new(Box::new(source), grid, here(), Passage::Replay { start_s: 100.0 });
    let v = air.air_velocity(&Vector3::new(0.0, 0.0, 1.0), 0.0);
    assert_eq!((v.x, v.y), (1.0, 1.0));
    assert!((v.z - 0.2).abs() < 1e-12);
}

#[test]
fn walls_are_still_and_places_without_air_are_known() {
    let wall = |_, _: usize, [_, _, i]: [usize; 3]| if i < 10 { f32::NAN } else { 1.0 };
    let (air, _) = air(wall, here(), Passage::Replay { start_s: 100.0 });
    assert!(!air.has_air(&Vector3::new(50.0, 0.0, 20.0), 0.0));
    assert_eq!(air.air_velocity(&Vector3::new(50.0, 0.0, 20.0), 0.0).z, 0.0);
    // Half-way between the last point in the wall and the first one in the air.
    assert!(air.has_air(&Vector3::new(100.0, 0.0, 20.0), 0.0));
    assert!((air.air_velocity(&Vector3::new(100.0, 0.0, 20.0), 0.0).z - 0.5).abs() < 1e-9);
}

#[test]
fn blocks_are_read_once_and_a_failure_is_kept() {
    let (air, reads) = air(linear, here(), Passage::Replay { start_s: 100.0 });
    for _ in 0..3 {
        let mut sampler = air.sampler(1);
        for step in 0..300 {
            sampler.air_velocity(&Vector3::new(100.0, 50.0, 20.0), f64::from(step) * 0.1);
        }
    }
    // Three components at four times, each in one read.
    assert_eq!(reads.load(Ordering::Relaxed), 12);
    assert_eq!(air.failure(), None);
    let source = Made { value: linear, reads: Arc::default(), fails: true };
    let air =
        GriddedAir::new(Box::new(source), grid(true), here(), Passage::Replay { start_s: 100.0 });
    assert_eq!(air.air_velocity(&Vector3::zeros(), 0.0), Vector3::zeros());
    assert_eq!(air.failure().as_deref(), Some("the disk is gone"));
}

#[test]
fn axes_that_are_no_axes_are_refused() {
    assert_eq!(Regular::of(&[0.0, 10.0, 20.0]).map(|axis| axis.period_m()), Some(30.0));
    for points in [&[0.0, 10.0, 21.0][..], &[0.0], &[], &[3.0, 2.0], &[0.0, f64::NAN], &[1.0, 1.0]]
    {
        assert_eq!(Regular::of(points), None, "{points:?}");
    }
    assert_eq!(Heights::of(vec![0.0, 5.0, 4.0]), None);
    assert_eq!(Heights::of(vec![0.0]), None);
    assert_eq!(axis::bracket(&[1.0, 2.0, 4.0], 3.0), (1, 0.5));
    assert_eq!(axis::bracket(&[1.0, 2.0, 4.0], 9.0), (2, 0.0));
    assert_eq!(axis::bracket(&[1.0, 2.0, 4.0], 0.0), (0, 0.0));
    assert_eq!(axis::bracket(&[1.0], 1.0), (0, 0.0));
}
