//! Kinds of air against published numbers, their sums, and air asked for by name.

#![expect(clippy::unwrap_used, reason = "a test fails")]

use std::fmt::Write as _;

use multirotor_sim::sim::air::spec::{
    Air, AirSpec, KINDS, Preset, build, builtin_names, help_text, load,
};
use multirotor_sim::sim::air::{
    AllenThermals, Atmosphere, DroneConstant, Sum, Thermal, Uniform, WindLaw, WindProfile,
};
use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;
use rayon::prelude::*;
use skybrush_show::frame::{Geodetic, ShowFrame};

fn frame() -> ShowFrame {
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 190.0 };
    ShowFrame { origin, orientation_deg: 30.0 }
}

fn air(texts: &[&str], seed: u64) -> Sum {
    let specs: Vec<_> = texts.iter().flat_map(|text| load(text).unwrap()).collect();
    build(&Air::new([0.0; 3], &specs), &frame(), seed, "hover")
}

#[test]
fn a_thermal_rises_in_the_middle_and_sinks_around() {
    // Allen's example day: w* 2.56 m/s, zi 1401 m (NASA/TM-2006-214019). At 0.4 zi the mean radius
    // is 0.102 zi 0.4^(1/3) 0.9 = 94.8 m and the mean updraft w* 0.4^(1/3) 0.56 = 1.056 m/s.
    let thermal = Thermal::at_height(2.56, 1_401.0, 0.4 * 1_401.0);
    assert!((thermal.outer_m - 94.76).abs() < 0.05, "{thermal:?}");
    assert!((thermal.mean_mps - 1.0563).abs() < 1e-3, "{thermal:?}");
    let share = 0.0011 * thermal.outer_m + 0.14;
    let peak = 3.0 * thermal.mean_mps * (1.0 - share) / (1.0 - share.powi(3));
    assert!((thermal.peak_mps - peak).abs() < 1e-12 && (2.3..2.6).contains(&peak), "{thermal:?}");

    let centre = Vector2::new(40.0, -30.0);
    let thermals = AllenThermals::new(2.56, 1_401.0, Vector3::zeros(), vec![centre]);
    let at = |distance: f64, height: f64| {
        thermals.updraft_mps(&Vector3::new(40.0 + distance, -30.0, height), 0.0)
    };
    let height = 0.4 * 1_401.0;
    assert!((at(0.0, height) / thermal.peak_mps - 1.0).abs() < 0.01);
    assert!(at(50.0, height) < at(20.0, height) && at(50.0, height) > 0.0);
    let sink = at(0.5 * thermals.side_m(), height);
    assert!((-0.5..-0.05).contains(&sink), "{sink}");
    // Neither at the ground nor above 0.91 zi does air rise or sink.
    assert_eq!((at(0.0, 0.0), at(0.0, 1_300.0), at(0.0, 5_000.0)), (0.0, 0.0, 0.0));
    // Air goes down around the upper half of a thermal, faster than far away.
    let high = 0.7 * 1_401.0;
    let ring = 1.4 * Thermal::at_height(2.56, 1_401.0, high).outer_m;
    assert!(at(ring, high) < at(0.5 * thermals.side_m(), high) - 0.05);
}

#[test]
fn what_rises_sinks_elsewhere() {
    // Allen's environment sink balances the updrafts' mean over the area, within the fit of shapes.
    let centres = vec![Vector2::new(-200.0, 10.0), Vector2::new(150.0, 180.0)];
    let thermals = AllenThermals::new(2.0, 1_400.0, Vector3::zeros(), centres);
    let side = thermals.side_m();
    for height in [50.0, 100.0, 400.0, 600.0] {
        let n = 400;
        let grid = |index: i32| (f64::from(index) / f64::from(n) - 0.5) * side;
        let values: Vec<f64> = (0..n * n)
            .map(|i| Vector3::new(grid(i % n), grid(i / n), height))
            .map(|place| thermals.updraft_mps(&place, 0.0))
            .collect();
        let mean = values.iter().sum::<f64>() / f64::from(n * n);
        let up = values.iter().filter(|w| **w > 0.0).sum::<f64>() / f64::from(n * n);
        assert!(mean.abs() < 0.3 * up, "{height} m: mean {mean}, updrafts {up}");
    }
}

#[test]
fn thermals_drift_with_the_wind_and_come_around() {
    let wind = Vector3::new(2.0, -1.0, 0.0);
    let thermals = AllenThermals::new(2.0, 1_400.0, wind, vec![Vector2::new(10.0, 20.0)]);
    let start = Vector3::new(30.0, 25.0, 100.0);
    let w = thermals.updraft_mps(&start, 0.0);
    assert!((thermals.updraft_mps(&(start + wind * 77.0), 77.0) - w).abs() < 1e-9);
    let around = start + Vector3::new(-3.0, 5.0, 0.0) * thermals.side_m();
    assert!((thermals.updraft_mps(&Vector3::new(around.x, around.y, 100.0), 0.0) - w).abs() < 1e-6);
}

#[test]
fn wind_grows_with_height_by_its_law() {
    let reference_mps = Vector3::new(4.0, 3.0, 0.0);
    let log = WindProfile {
        reference_mps,
        reference_height_m: 10.0,
        law: WindLaw::Log { roughness_m: 0.03 },
    };
    // ln(100/0.03) / ln(10/0.03) = 8.1117 / 5.8091.
    for (height, ratio) in [(10.0, 1.0), (100.0, 1.396_36), (0.03, 0.0), (0.0, 0.0), (-5.0, 0.0)] {
        let wind = log.air_velocity(&Vector3::new(0.0, 0.0, height), 0.0);
        assert!((wind - reference_mps * ratio).norm() < 1e-4, "{height} m: {wind}");
    }
    let power = WindProfile { law: WindLaw::Power { alpha: 1.0 / 7.0 }, ..log };
    // 10^(1/7) = 1.38950.
    for (height, ratio) in [(10.0, 1.0), (100.0, 1.389_495), (0.0, 0.0), (-5.0, 0.0)] {
        assert!((power.ratio(height) - ratio).abs() < 1e-5, "{height} m");
    }
}

#[test]
fn drones_have_constants_of_their_own() {
    let constant = DroneConstant { sd_mps: 0.5, seed: 7, component: 2 };
    let values: Vec<f64> = (1..=4_000).map(|drone| constant.updraft_mps(drone)).collect();
    let mean = values.iter().sum::<f64>() / 4e3;
    let sd = (values.iter().map(|value| value * value).sum::<f64>() / 4e3).sqrt();
    assert!(mean.abs() < 0.024 && (sd - 0.5).abs() < 0.017, "{mean} {sd}");
    let mut sampler = constant.sampler(17);
    for time_s in [0.0, 100.0] {
        let air = sampler.air_velocity(&Vector3::new(1.0, 2.0, time_s), time_s);
        assert_eq!(air, Vector3::new(0.0, 0.0, values[16]));
    }
    assert_ne!(constant.updraft_mps(1), DroneConstant { seed: 8, ..constant }.updraft_mps(1));
    assert_ne!(constant.updraft_mps(1), DroneConstant { component: 3, ..constant }.updraft_mps(1));
}

#[test]
fn parts_add_up() {
    let wind = "wind:speed=3,from=200";
    let moving =
        ["thermals:wind=1", "field:wind=0", "dryden:wind=4", "profile:speed=2", "lenschow:wind=2"];
    let place = Vector3::new(12.0, 3.0, 80.0);
    let texts: Vec<&str> = std::iter::once(wind).chain(moving).collect();
    let sum = air(&texts, 3).air_velocity(&place, 50.0);
    // A component's random stream is that of its number: air that does nothing takes the places
    // before it.
    let mut total = air(&[wind], 3).air_velocity(&place, 50.0);
    // From 200 degrees in a show along 30: 10 degrees left of straight ahead.
    let expected = 3.0 * Vector2::new(10_f64.to_radians().cos(), 10_f64.to_radians().sin());
    assert!((total.xy() - expected).norm() < 1e-12 && total.z == 0.0, "{total}");
    for (index, text) in moving.iter().enumerate() {
        let mut alone = vec!["drone-constant:sd=0"; index];
        alone.push(text);
        let part = air(&alone, 3).air_velocity(&place, 50.0);
        assert!(part.norm() > 1e-3, "{text} does nothing");
        total += part;
    }
    assert!((total - sum).norm() < 1e-12, "{total} {sum}");
    let boxed: Sum = Sum(vec![
        Box::new(Uniform(Vector3::new(1.0, 2.0, 3.0))),
        Box::new(air(&texts, 3)),
        Box::new(Uniform(Vector3::new(-1.0, 0.0, 0.5))),
    ]);
    let both = boxed.air_velocity(&place, 50.0);
    assert!((both - sum - Vector3::new(0.0, 2.0, 3.5)).norm() < 1e-12);
    let mut sampler = boxed.sampler(1);
    let sampled = sampler.air_velocity(&place, 50.0);
    assert!((sampled - both).norm() < 1e-12, "at a knot the sampler is exact: {}", sampled - both);
    assert_eq!(Sum::default().air_velocity(&place, 0.0), Vector3::zeros());
}

#[test]
fn a_moving_drone_meets_what_is_there() {
    // The whole field day with a drone on a ladder: rms difference to direct look-ups.
    let air = air(&["field-day"], 5);
    let mut sampler = air.sampler(1);
    let (mut error, mut power, mut n) = (0.0, 0.0, 0.0);
    let mut height = 20.0;
    for step in 0..20_000 {
        let time_s = f64::from(step) * 0.01;
        height += 0.01 * if step / 2_000 % 2 == 0 { 3.0 } else { -3.0 };
        let place = Vector3::new(7.0, 14.0, height);
        let direct = air.air_velocity(&place, time_s).z;
        error += (sampler.air_velocity(&place, time_s).z - direct).powi(2);
        power += direct * direct;
        n += 1.0;
    }
    let (error, size): (f64, f64) = ((error / n).sqrt(), (power / n).sqrt());
    assert!(error < 0.01 && error < 0.03 * size, "rms {error} of {size} m/s");
}

#[test]
fn the_same_seed_gives_the_same_air_on_any_number_of_threads() {
    let texts = ["field-day", "thermal-day", "drone-constant:sd=0.3"];
    let fly = |threads: usize| -> Vec<u64> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let air = air(&texts, 11);
        pool.install(|| {
            (1..=8_u16)
                .into_par_iter()
                .flat_map_iter(|drone| {
                    let mut sampler = air.sampler(drone);
                    let place = Vector3::new(7.0 * f64::from(drone), 0.0, 60.0);
                    (0..200)
                        .map(move |step| {
                            sampler.air_velocity(&place, f64::from(step) * 0.01).z.to_bits()
                        })
                        .collect::<Vec<_>>()
                })
                .collect()
        })
    };
    let one = fly(1);
    assert_eq!(one, fly(3));
    let place = Vector3::new(7.0, 0.0, 60.0);
    let w = |seed, flight| {
        let specs = load("field").unwrap();
        build(&Air::new([0.0; 3], &specs), &frame(), seed, flight).air_velocity(&place, 9.0).z
    };
    assert_eq!(w(1, "hover"), w(1, "hover"));
    assert_ne!(w(1, "hover"), w(2, "hover"), "another seed");
    assert_ne!(w(1, "hover"), w(1, "calibration"), "another flight of the campaign");
}

fn any_spec() -> impl Strategy<Value = String> {
    // Output of a model needs its file: tests/it/les of the package makes one.
    let drawn: Vec<_> = KINDS.iter().filter(|kind| kind.name != "les").collect();
    (0..drawn.len()).prop_flat_map(move |index| {
        let kind = drawn[index];
        let keys: Vec<_> = kind
            .keys
            .iter()
            // z0 goes with the log law, alpha with the other; from with a wind.
            .filter(|key| !["z0", "x", "y", "from", "modes"].contains(&key.name))
            .map(|key| {
                let name = key.name;
                let must = key.default == Preset::Required;
                (any::<bool>(), key.range.0..key.range.1)
                    .prop_map(move |(there, value)| (must || there).then_some((name, value)))
            })
            .collect();
        keys.prop_map(move |values| {
            let given: Vec<_> = values
                .into_iter()
                .flatten()
                .map(|(name, value)| format!("{name}={value}"))
                .collect();
            format!("{}:{}", kind.name, given.join(","))
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn air_is_finite_everywhere_and_its_text_reads_back(
        text in any_spec(),
        place in prop::array::uniform3(prop_oneof![-1e3..1e3, -1e9..1e9, Just(1e300), Just(-0.0)]),
        time_s in prop_oneof![-1e3..1e6, Just(1e18)],
    ) {
        let spec: AirSpec = text.parse().unwrap();
        prop_assert_eq!(&spec, &spec.to_string().parse().unwrap());
        let air = air(&[&text], 1);
        let place = Vector3::from(place);
        let velocity = air.air_velocity(&place, time_s);
        prop_assert!(velocity.iter().all(|value| value.is_finite()), "{}: {}", text, velocity);
        prop_assert!(velocity.norm() < 1_500.0, "{}: {}", text, velocity);
        let sampled = air.sampler(3).air_velocity(&place, time_s);
        prop_assert!(sampled.iter().all(|value| value.is_finite()), "{}: {}", text, sampled);
    }

    #[test]
    fn any_text_is_read_or_refused(text in "[a-z_=:,.0-9-]{0,40}|field:.{0,20}|\\PC{0,20}") {
        let _ = load(&text);
    }
}

#[test]
fn what_is_wrong_is_told_with_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let wrong_file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        load(&path.display().to_string())
            .unwrap_err()
            .to_string()
            .replace(&folder.path().display().to_string(), "FOLDER")
    };
    let mut told = String::new();
    for text in [
        "breeze",
        "field:sd",
        "field:sd=much",
        "field:sd=50",
        "field:sd=NaN",
        "field:lamda=145",
        "field:sd=1,sd=2",
        "field:from=90",
        "wind",
        "wind:from=90",
        "profile:speed=3,z0=0.1,alpha=0.2",
        "thermals:x=10",
        "still:speed=1",
        "",
        "missing.toml",
    ] {
        let error = load(text).unwrap_err();
        writeln!(told, "{text:?}: {error}").unwrap();
    }
    for (name, text) in [
        ("other.toml", "schema = \"updraft.air/9\"\ntitle = \"\"\nair = []"),
        ("syntax.toml", "schema = \"updraft.air/1\"\ntitle = \n"),
        ("key.toml", "schema = \"updraft.air/1\"\ntitle = \"\"\nairs = []"),
        (
            "kind.toml",
            "schema = \"updraft.air/1\"\ntitle = \"\"\n[[air]]\nkind = \"field\"\n[[air]]\nkind = \"x\"",
        ),
        (
            "value.toml",
            "schema = \"updraft.air/1\"\ntitle = \"\"\n[[air]]\nkind = \"field\"\nsd = \"1\"",
        ),
        (
            "range.toml",
            "schema = \"updraft.air/1\"\ntitle = \"\"\n[[air]]\nkind = \"field\"\nsd = -1",
        ),
    ] {
        writeln!(told, "{name}: {}", wrong_file(name, text)).unwrap();
    }
    insta::assert_snapshot!(told);
}

#[test]
fn the_help_lists_every_kind_and_key() {
    insta::assert_snapshot!(help_text());
}

#[test]
fn files_of_the_program_are_valid_and_found_by_name_and_path() {
    for name in builtin_names() {
        let specs = load(name).unwrap();
        assert!(specs.len() > 1, "{name}");
        assert_eq!(specs, load(&format!("templates/air/{name}.toml")).unwrap());
        assert_eq!(specs, load(&format!("{name}.toml")).unwrap());
        let air = Air::new([0.0; 3], &specs);
        let again: Vec<AirSpec> = air.texts().iter().map(|text| text.parse().unwrap()).collect();
        assert_eq!(again, air.moving, "the record says how to make it again");
    }
    // The uniform parts are taken out and summed.
    let specs: Vec<_> = ["still", "wind:speed=2,from=270", "uniform:up=0.5,north=1", "field"]
        .iter()
        .flat_map(|text| load(text).unwrap())
        .collect();
    let air = Air::new([1.0, 0.0, -0.2], &specs);
    let [east, north, up] = air.uniform_mps;
    assert!((east - 3.0).abs() < 1e-12 && (north - 1.0).abs() < 1e-12 && (up - 0.3).abs() < 1e-12);
    assert_eq!(air.texts(), ["field"]);
}
