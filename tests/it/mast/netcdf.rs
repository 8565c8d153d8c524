//! Masts as NetCDF: what a table says is found in a file by its standard names, and what cannot be right is refused.

use std::fmt::Write as _;
use std::fs;

use netcdf_writer::{NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions};
use rand::{Rng as _, RngExt as _};
use serde_json::Value;
use updraft::base::rng::{Purpose, stream};
use updraft::mast::MastRecord;

use super::{analysed, compared, number, values};

/// 2021-04-20 09:00:00 UTC, s since 1970.
const ZERO_S: f64 = 1_618_909_200.0;

/// How a mast's file is written.
#[derive(Clone)]
struct Mast {
    format: NcWriteFormat,
    name: &'static str,
    standard_name: &'static str,
    units: &'static str,
    time_units: &'static str,
    /// Seconds in a unit of time, and its zero, s since 1970.
    time: (f64, f64),
    cell_methods: &'static str,
    heights_m: Vec<f64>,
    /// Half the length of the times' bounds, s.
    bounds_s: Option<f64>,
}

impl Default for Mast {
    fn default() -> Self {
        Self {
            format: NcWriteFormat::Nc4,
            name: "vertical_wind",
            standard_name: "upward_air_velocity",
            units: "m s-1",
            time_units: "minutes since 2021-04-20 11:00:00 +02:00",
            time: (60.0, ZERO_S),
            cell_methods: "",
            heights_m: vec![18.0],
            bounds_s: None,
        }
    }
}

fn text(value: &str) -> NcAttrValue {
    NcAttrValue::Chars(value.to_owned())
}

impl Mast {
    /// A file whose level of index `k` has w + k, packed into shorts of mm/s; every 50th value is missing.
    fn bytes(&self, values: &[(f64, f64)]) -> Vec<u8> {
        let mut builder = NcFileBuilder::new();
        let time = builder.add_unlimited_dimension("t").unwrap();
        let height = builder.add_dimension("height", self.heights_m.len() as u64).unwrap();
        let times = builder.add_variable::<f64>("t", &[time]).unwrap();
        builder.add_variable_attribute(times, "units", text(self.time_units)).unwrap();
        builder.add_variable_attribute(times, "standard_name", text("time")).unwrap();
        let heights = builder.add_variable::<f64>("height", &[height]).unwrap();
        builder.add_variable_attribute(heights, "units", text("m")).unwrap();
        let w = builder.add_variable::<i16>(self.name, &[time, height]).unwrap();
        builder.set_variable_fill_value(w, i16::MIN).unwrap();
        builder
            .add_variable_attribute(w, "scale_factor", NcAttrValue::Doubles(vec![0.001]))
            .unwrap();
        builder.add_variable_attribute(w, "add_offset", NcAttrValue::Doubles(vec![0.5])).unwrap();
        for (name, value) in [
            ("standard_name", self.standard_name),
            ("units", self.units),
            ("cell_methods", self.cell_methods),
        ] {
            if !value.is_empty() {
                builder.add_variable_attribute(w, name, text(value)).unwrap();
            }
        }
        let place = [("lat", 47.0, "latitude"), ("lon", 19.0, "longitude")];
        let places = place.map(|(name, deg, standard)| {
            let id = builder.add_variable::<f64>(name, &[]).unwrap();
            builder.add_variable_attribute(id, "standard_name", text(standard)).unwrap();
            (id, deg)
        });
        let count = |time_s: f64| (time_s - self.time.1) / self.time.0;
        let bounds = self.bounds_s.map(|half_s| {
            builder.add_variable_attribute(times, "bounds", text("t_bnds")).unwrap();
            let two = builder.add_dimension("two", 2).unwrap();
            let id = builder.add_variable::<f64>("t_bnds", &[time, two]).unwrap();
            let ends = |(at, _): &(f64, f64)| [count(at - half_s), count(at + half_s)];
            (id, values.iter().flat_map(ends).collect::<Vec<f64>>())
        });
        let all: Vec<f64> = values.iter().map(|(time_s, _)| count(*time_s)).collect();
        builder.write_variable(times, &all).unwrap();
        builder.write_variable(heights, &self.heights_m).unwrap();
        for (id, deg) in places {
            builder.write_variable(id, &[deg]).unwrap();
        }
        if let Some((id, ends)) = bounds {
            builder.write_variable(id, &ends).unwrap();
        }
        let mut packed = Vec::new();
        for (index, (_, w)) in values.iter().enumerate() {
            for level in 0..self.heights_m.len() {
                let short = ((w + level as f64 - 0.5) / 0.001).round() as i16;
                packed.push(if index % 50 == 7 { i16::MIN } else { short });
            }
        }
        builder.write_variable(w, &packed).unwrap();
        builder.to_vec(NcWriteOptions { format: self.format }).unwrap().1
    }
}

#[test]
fn a_file_says_what_its_table_says() {
    let bench = analysed();
    let of_mast: Vec<(f64, f64)> =
        values(&bench).iter().map(|(time_s, w)| (time_s + 4.0, 0.5 + 0.8 * w)).collect();
    let mut table = "utc,w\n".to_owned();
    for (index, (time_s, w)) in of_mast.iter().enumerate() {
        if index % 50 != 7 {
            writeln!(table, "{time_s:.3},{w:.3}").unwrap();
        }
    }
    fs::write(bench.path("tower.csv"), table).unwrap();
    let by_table = compared(&bench, "tower.csv");
    for (name, format) in [
        ("tower.nc", NcWriteFormat::Nc4),
        ("classic.nc", NcWriteFormat::Classic),
        ("offset.nc", NcWriteFormat::Offset64),
    ] {
        let mast = Mast { format, ..Mast::default() };
        fs::write(bench.path(name), mast.bytes(&of_mast)).unwrap();
        let found = compared(&bench, name);
        let [table, file] =
            [&by_table, &found].map(|of| of["flights"][0]["fleet"].as_object().unwrap().clone());
        for (key, value) in &table {
            let Some(value) = value.as_f64() else { continue };
            let own = number(&file[key]);
            assert!(
                (own - value).abs() < 1e-3 * value.abs().max(1.0),
                "{name} {key}: {own} {value}"
            );
        }
        assert_eq!(number(&found["mast_height_m"]), 18.0);
        assert!(!found["notes"].to_string().contains("place is not known"), "{}", found["notes"]);
    }
    // A mapping names what no standard name does, and chooses the height.
    let plain = Mast {
        name: "Uz",
        standard_name: "",
        heights_m: vec![10.0, 18.0, 40.0],
        ..Mast::default()
    };
    fs::write(bench.path("plain.nc"), plain.bytes(&of_mast)).unwrap();
    let map = "schema = \"updraft.mast/1\"\nfile = \"plain.nc\"\n";
    fs::write(
        bench.path("map.toml"),
        format!("{map}height_m = 16.0\n[w]\ncolumns = [\"Uz\"]\noffset = -1.0\n"),
    )
    .unwrap();
    let found = compared(&bench, "map.toml");
    assert_eq!(number(&found["mast_height_m"]), 18.0);
    let mean = |of: &Value| number(&of["flights"][0]["fleet"]["mast_mean_mps"]);
    assert!((mean(&found) - mean(&by_table)).abs() < 1e-3, "{}", mean(&found));
    let notes = found["notes"].to_string();
    assert!(notes.contains("10, 18, 40 m of Uz that of 18 m is taken"), "{notes}");
}

/// Bounds say which seconds a mean is over, whatever end its time marks.
#[test]
fn bounds_make_means() {
    let bench = analysed();
    let all = values(&bench);
    let slow: Vec<(f64, f64)> = all
        .chunks_exact(20)
        .map(|part| (part[0].0 + 10.0, part.iter().map(|one| one.1).sum::<f64>() / 20.0))
        .collect();
    let mast = Mast { bounds_s: Some(10.0), cell_methods: "t: mean", ..Mast::default() };
    fs::write(bench.path("tower.nc"), mast.bytes(&slow)).unwrap();
    let found = compared(&bench, "tower.nc");
    assert_eq!(number(&found["mast_mean_s"]).round(), 20.0);
    let fleet = &found["flights"][0]["fleet"];
    assert!(number(&fleet["correlation"]) > 0.99 && number(&fleet["rms_mps"]) < 0.05, "{fleet:#}");
    assert!(!found["notes"].to_string().contains("end at their times"));
}

#[test]
fn what_cannot_be_right_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let every =
        |step_s: f64| (0..100).map(|k| (ZERO_S + step_s * f64::from(k), 0.1)).collect::<Vec<_>>();
    let path = folder.path().join("tower.nc");
    let says = |mast: Mast, step_s: f64, near_m: Option<f64>, words: &str| {
        fs::write(&path, mast.bytes(&every(step_s))).unwrap();
        match MastRecord::read(&path, near_m) {
            Ok(_) => panic!("was read: {words}"),
            Err(error) => {
                let error = error.to_string();
                assert!(error.contains("tower.nc") && error.contains(words), "{error}");
            }
        }
    };
    let usual = Mast::default;
    says(
        Mast { standard_name: "air_temperature", ..usual() },
        1.0,
        None,
        "no variable with the vertical air speed",
    );
    says(Mast { standard_name: "", ..usual() }, 1.0, None, "it has t, height, vertical_wind");
    says(
        Mast { units: "K", ..usual() },
        1.0,
        None,
        "variable vertical_wind: its units \"K\" are not known",
    );
    says(
        Mast { time_units: "seconds", ..usual() },
        1.0,
        None,
        "variable t: its units \"seconds\" are not of the form",
    );
    says(
        Mast { cell_methods: "time: variance", ..usual() },
        1.0,
        None,
        "no variable with the vertical",
    );
    says(Mast { cell_methods: "time: point", ..usual() }, 60.0, None, "single samples 60 s apart");
    let heights_m = vec![10.0, 20.0, 40.0];
    let several = Mast { heights_m: heights_m.clone(), ..usual() };
    says(
        several.clone(),
        1.0,
        None,
        "it has the heights 10, 20, 40 m, and that of the drones is not known",
    );
    fs::write(&path, several.bytes(&every(1.0))).unwrap();
    let record = MastRecord::read(&path, Some(33.0)).unwrap();
    assert_eq!((record.height_m, record.place_deg), (Some(40.0), Some([47.0, 19.0])));
    assert!(record.notes[0].contains("the nearest to the drones' 33.0 m"), "{:?}", record.notes);
    assert!((record.w.value[0] - 2.1).abs() < 1e-9);
    assert_eq!(record.zero_ms, (ZERO_S * 1000.0) as i64);
    let cm = Mast { units: "cm s-1", ..usual() };
    fs::write(&path, cm.bytes(&every(1.0))).unwrap();
    assert!((MastRecord::read(&path, None).unwrap().w.value[0] - 0.001).abs() < 1e-9);
    fs::write(&path, "no NetCDF at all").unwrap();
    let error = MastRecord::read(&path, None).unwrap_err().to_string();
    assert!(error.contains("it is not NetCDF that can be read"), "{error}");
}

/// Damaged files have an answer, and bounded memory.
#[test]
fn damaged_files_do_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tower.nc");
    let values: Vec<(f64, f64)> = (0..60).map(|k| (ZERO_S + f64::from(k), 0.1)).collect();
    let mut rng = stream(11, 1, Purpose::Air);
    let mut refused = 0;
    for round in 0..400 {
        let format = if round % 2 == 0 { NcWriteFormat::Nc4 } else { NcWriteFormat::Classic };
        let mut bytes = Mast { format, ..Mast::default() }.bytes(&values);
        for _ in 0..rng.random_range(1..8) {
            // The head of the file more than its values.
            let most = if rng.random::<bool>() { bytes.len().min(600) } else { bytes.len() };
            let at = rng.random_range(0..most);
            bytes[at] = (rng.next_u32() & 0xff) as u8;
        }
        if round % 5 == 0 {
            bytes.truncate(rng.random_range(0..bytes.len()));
        }
        fs::write(&path, &bytes).unwrap();
        refused += u32::from(MastRecord::read(&path, Some(20.0)).is_err());
    }
    assert!((100..400).contains(&refused), "{refused}");
}
