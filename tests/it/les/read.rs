//! Files of all models and formats give the same air, and that air is the field.

use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use netcdf_writer::NcWriteFormat;
use updraft::les::{Les, Where, open};
use updraft::sim::Atmosphere as _;

use super::sample::{As, CM1, FIRST_S, Field, MICROHH, PALM, POINTS, SPACING_M, first_m, write};

const WIND_MPS: [f64; 2] = [2.0, 0.5];
const AFTER_S: [f64; 4] = [0.0, 5.0, 10.0, 15.0];

fn field() -> Field {
    Field::drawn(3, 0.6, WIND_MPS)
}

pub(super) fn opened(spec: &str) -> Les {
    let place = Where { orientation_deg: 90.0, height_m: 60.0 };
    open(&spec.parse().unwrap(), place).unwrap()
}

/// Trilinear between the field's own values on the points, linear in time: what the reader must give.
fn expected(field: &Field, component: usize, at: [f64; 3], after_s: f64) -> f64 {
    let of = |after_s: f64| {
        let mut sum = 0.0;
        for corner in 0..8_usize {
            let (mut weight, mut place) = (1.0, [0.0; 3]);
            for axis in 0..3 {
                let along = (at[axis] - first_m(component, axis)) / SPACING_M[axis];
                let (before, share) = (along.floor(), along - along.floor());
                let far = corner >> axis & 1 == 1;
                weight *= if far { share } else { 1.0 - share };
                place[axis] = first_m(component, axis)
                    + SPACING_M[axis] * (before + f64::from(u8::from(far)));
            }
            sum += weight * field.at(component, place, after_s);
        }
        sum
    };
    let step = AFTER_S.windows(2).find(|pair| (pair[0]..=pair[1]).contains(&after_s)).unwrap();
    let share = (after_s - step[0]) / (step[1] - step[0]);
    (1.0 - share) * of(step[0]) + share * of(step[1])
}

/// Largest difference between the air and the field's interpolated values, at places over and beyond the domain.
fn worst(les: &Les, field: &Field) -> f64 {
    let [x0, y0, _] = les.about.origin_m;
    let mut worst: f64 = 0.0;
    for step in 0..60 {
        let step = f64::from(step);
        // Show x is towards east and y towards north here, as the model's are.
        let place = Vector3::new(17.3 * step - 500.0, 300.0 - 11.7 * step, 9.0 + 1.7 * step);
        let time_s = 0.24 * step;
        let v = les.air.air_velocity(&place, time_s);
        let at = [x0 + place.x, y0 + place.y, place.z];
        for component in 0..3 {
            worst = worst.max((v[component] - expected(field, component, at, time_s)).abs());
        }
    }
    worst
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).to_str().unwrap().to_owned()
}

#[test]
fn every_model_and_format_is_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, field) = (folder.path(), field());
    for (index, (names, model, format)) in [
        (&PALM, "PALM", NcWriteFormat::Nc4),
        (&PALM, "PALM", NcWriteFormat::Offset64),
        (&PALM, "PALM", NcWriteFormat::Cdf5),
        (&MICROHH, "MicroHH", NcWriteFormat::Nc4),
        (&CM1, "CM1", NcWriteFormat::Nc4),
        (&CM1, "CM1", NcWriteFormat::Offset64),
    ]
    .into_iter()
    .enumerate()
    {
        let file = path(folder, &format!("{index}.nc"));
        write(&field, As { format, ..As::new(names, &AFTER_S) }, Path::new(&file));
        let les = opened(&format!("les:{file}"));
        assert_eq!(les.about.model, model);
        // CM1's w has a face more than cells, and only along z, which does not repeat.
        let [nx, ny, nz] = POINTS;
        assert_eq!(les.about.points, [nx, ny, nz + usize::from(names.faces)], "{model}");
        assert_eq!(les.about.times_s, (FIRST_S, FIRST_S + 15.0, 4));
        assert!((les.about.period_m[0] - 320.0).abs() < 1e-6);
        let off = worst(&les, &field);
        // 32-bit values.
        assert!(off < 2e-6, "{model} {format:?}: {off} m/s");
    }
}

#[test]
fn components_of_other_names_and_files_come_by_a_mapping() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, field) = (folder.path(), field());
    // MicroHH's own way: a file for each component, found beside the one that is given.
    for (component, name) in ["u", "v", "w"].into_iter().enumerate() {
        let how = As { components: &[component], ..As::new(&MICROHH, &AFTER_S) };
        write(&field, how, &folder.join(format!("{name}.nc")));
    }
    let les = opened(&format!("les:{}", path(folder, "w.nc")));
    assert_eq!((les.about.model.as_str(), les.about.files.len()), ("MicroHH", 3));
    assert!(worst(&les, &field) < 2e-6);
    // Other names.
    let how = As { called: ["east", "north", "up"], ..As::new(&PALM, &AFTER_S) };
    write(&field, how, &folder.join("other.nc"));
    fs::write(
        folder.join("map.toml"),
        "schema = \"updraft.les-map/1\"\nperiod_m = [320.0, 320.0]\n[u]\nvariable = \"east\"\n[v]\nvariable = \"north\"\n\
         [w]\nvariable = \"up\"\nz = \"zw_3d\"\n",
    )
    .unwrap();
    let spec = format!("les:{},map={}", path(folder, "other.nc"), path(folder, "map.toml"));
    let les = opened(&spec);
    assert_eq!(les.about.files.len(), 2, "the mapping is a source, too");
    assert!(worst(&les, &field) < 2e-6);
    assert_eq!(spec.parse::<updraft::sim::air::spec::AirSpec>().unwrap().to_string(), spec);
}

#[test]
fn frozen_air_moves_with_the_models_mean_wind() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, field) = (folder.path(), field());
    let file = path(folder, "one.nc");
    write(&field, As::new(&PALM, &[0.0]), Path::new(&file));
    let les = opened(&format!("les:{file},mode=advect"));
    let [east, north] = les.about.carried_mps.unwrap();
    // The mean of the waves over the plane is none, but for their 32 bits.
    assert!(
        (east - WIND_MPS[0]).abs() < 1e-6 && (north - WIND_MPS[1]).abs() < 1e-6,
        "{east} {north}"
    );
    let [x0, y0, _] = les.about.origin_m;
    let mut squares = 0.0;
    for step in 0..100 {
        let time_s = 7.0 * f64::from(step);
        let place = Vector3::new(3.0, -8.0, 60.0);
        let v = les.air.air_velocity(&place, time_s);
        squares += (v.z - field.at(2, [x0 + 3.0, y0 - 8.0, 60.0], time_s)).powi(2);
    }
    let rms: f64 = (squares / 100.0_f64).sqrt();
    // Linear interpolation of waves down to 26 m on points every 10 m.
    assert!(rms < 0.2 * 0.6, "{rms} m/s");
    let held = opened(&format!("les:{file},mode=advect,wind=0"));
    let v = |time_s| held.air.air_velocity(&Vector3::new(3.0, -8.0, 60.0), time_s);
    assert_eq!(v(0.0), v(300.0));
}

#[test]
fn a_model_lies_in_the_show_as_it_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, field) = (folder.path(), field());
    let file = path(folder, "one.nc");
    write(&field, As::new(&PALM, &AFTER_S), Path::new(&file));
    // The model's x to the north, its origin 100 m east and 50 m north of that of the show, on a hill of 20 m.
    let spec: updraft::sim::air::spec::AirSpec =
        format!("les:{file},x=40,y=70,ground=20,x_towards=0").parse().unwrap();
    let les = open(&spec, Where { orientation_deg: 90.0, height_m: 60.0 }).unwrap();
    // Show x to the east: the model's x is the show's y, its y is against the show's x.
    let v = les.air.air_velocity(&Vector3::new(12.0, 30.0, 35.0), 5.0);
    let at = [40.0 + 30.0, 70.0 - 12.0, 55.0];
    let [u, v_model, w] = [0, 1, 2].map(|component| expected(&field, component, at, 5.0));
    assert!((v - Vector3::new(-v_model, u, w)).norm() < 5e-6, "{v} {u} {v_model} {w}");
    assert_eq!(les.about.heights_m.1, 100.0, "120 m less the hill");
}
