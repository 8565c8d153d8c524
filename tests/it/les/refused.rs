//! Files and flights that do not fit each other, and files that are damaged.

use std::fs;
use std::path::Path;
use std::process::Command;

use nalgebra::Vector3;
use rand::RngExt as _;
use updraft::base::rng::{Purpose, stream};
use updraft::les::{Where, open};
use updraft::sim::Atmosphere as _;

use super::sample::{As, Field, MICROHH, PALM, bytes, write};

fn field() -> Field {
    Field::drawn(3, 0.6, [2.0, 0.5])
}

/// The error of opening a file, with its folder cut off.
fn refused(folder: &Path, spec: &str) -> String {
    let spec = spec.replace("DIR", folder.to_str().unwrap()).parse().unwrap();
    let place = Where { orientation_deg: 0.0, height_m: 60.0 };
    let Err(error) = open(&spec, place) else { panic!("{spec} was opened") };
    let folder = folder.to_str().unwrap();
    error.to_string().replace(&format!("{folder}/"), "").replace(folder, "DIR")
}

#[test]
fn files_that_are_no_model_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&field(), As::new(&PALM, &[0.0, 5.0]), &folder.join("palm.nc"));
    let called = As { called: ["east", "north", "up"], ..As::new(&PALM, &[0.0, 5.0]) };
    write(&field(), called, &folder.join("other.nc"));
    write(&field(), As::new(&PALM, &[0.0, 0.0]), &folder.join("still.nc"));
    let alone = As { components: &[2], ..As::new(&MICROHH, &[0.0]) };
    write(&field(), alone, &folder.join("alone.nc"));
    fs::write(folder.join("text.nc"), "not NetCDF").unwrap();
    let map = |name: &str, text: &str| {
        let head = "schema = \"updraft.les-map/1\"\n";
        fs::write(folder.join(name), format!("{head}{text}")).unwrap();
    };
    map(
        "wrong.toml",
        "[u]\nvariable = \"east\"\n[v]\nvariable = \"north\"\n[w]\nvariable = \"upwards\"\n",
    );
    map(
        "axis.toml",
        "[u]\nvariable = \"u\"\nx = \"yv\"\n[v]\nvariable = \"v\"\n[w]\nvariable = \"w\"\nz = \"depth\"\n",
    );
    map(
        "long.toml",
        "period_m = [640.0, 320.0]\n[u]\nvariable = \"u\"\n[v]\nvariable = \"v\"\n[w]\nvariable = \"w\"\n",
    );
    map("flat.toml", "[u]\nvariable = \"time\"\n[v]\nvariable = \"v\"\n[w]\nvariable = \"w\"\n");
    let said: Vec<String> = [
        "les:DIR/none.nc",
        "les:DIR/text.nc",
        "les:DIR",
        "les:DIR/other.nc",
        "les:DIR/alone.nc",
        "les:DIR/still.nc",
        "les:DIR/palm.nc,map=DIR/none.toml",
        "les:DIR/other.nc,map=DIR/wrong.toml",
        "les:DIR/palm.nc,map=DIR/axis.toml",
        "les:DIR/palm.nc,map=DIR/long.toml",
        "les:DIR/palm.nc,map=DIR/flat.toml",
        "les:DIR/palm.nc,mode=advect,start=10",
    ]
    .iter()
    .map(|spec| refused(folder, spec))
    .collect();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn specifications_that_say_nothing_are_refused() {
    let said: Vec<String> = [
        "les",
        "les:map=names.toml",
        "les:a.nc,mode=backwards",
        "les:a.nc,wind=3",
        "les:a.nc,start=1,start=2",
        "les:a.nc,x=far",
        "field:file=a.nc",
    ]
    .iter()
    .map(|text| text.parse::<updraft::sim::air::spec::AirSpec>().unwrap_err().to_string())
    .collect();
    insta::assert_snapshot!(said.join("\n"));
    // Paths may have commas and equals signs.
    for text in ["les:a,b=c.nc", "les:a,b=c.nc,mode=advect,start=5", "les:C:\\air\\a.nc,x=3"] {
        let spec: updraft::sim::air::spec::AirSpec = text.parse().unwrap();
        assert_eq!(spec.to_string(), text);
    }
    let spec: updraft::sim::air::spec::AirSpec = "les:mode=advect,file=a.nc".parse().unwrap();
    assert_eq!(spec.to_string(), "les:a.nc,mode=advect");
}

fn updraft(arguments: &str, folder: &Path) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_updraft"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn flights_that_a_model_does_not_cover_are_refused_before_they_fly() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let after_s: Vec<f64> = (0..40).map(|index| 8.0 * f64::from(index)).collect();
    write(&field(), As::new(&PALM, &after_s), &folder.join("les.nc"));
    write(&field(), As::new(&PALM, &[0.0]), &folder.join("one.nc"));
    let walled = As { wall: 20, ..As::new(&PALM, &after_s) };
    write(&field(), walled, &folder.join("wall.nc"));
    let (done, said) = updraft("plan hover --grid 1x2 --duration 100 --height 60 -o c", folder);
    assert!(done, "{said}");
    let (done, said) = updraft("plan hover --grid 1x2 --duration 20 --height 119 -o high", folder);
    assert!(done, "{said}");
    let (done, said) =
        updraft("plan hover --grid 1x2 --duration 20 --height 121 -o higher", folder);
    assert!(done, "{said}");
    let mut messages = Vec::new();
    for (campaign, air) in [
        ("c", "les:les.nc,start=3850"),
        ("c", "les:les.nc,start=3000"),
        ("c", "les:one.nc"),
        ("higher", "les:les.nc"),
        ("c", "les:les.nc,repeat=0,x=600"),
        ("c", "les:one.nc,mode=advect,repeat=0"),
        ("c", "les:wall.nc,x=100"),
        ("c", "les:les.nc,ground=70"),
    ] {
        let (done, said) = updraft(&format!("simulate {campaign} --air {air}"), folder);
        assert!(!done, "{air}");
        let flights = FlightsIn(&folder.join(campaign)).logs();
        assert_eq!(flights, 0, "{air} left logs");
        messages.push(
            said.lines().filter(|line| !line.starts_with("Air of")).collect::<Vec<_>>().join("\n"),
        );
    }
    insta::assert_snapshot!(messages.join("\n"));
    let (done, said) = updraft("simulate high --air les:les.nc --dry-run", folder);
    assert!(done && said.contains("Would fly hover: 2 drones"), "{said}");
    assert_eq!(FlightsIn(&folder.join("high")).logs(), 0);
    let (done, said) = updraft("simulate high --air les:les.nc", folder);
    assert!(done, "{said}");
    let covers = said.lines().find(|line| line.starts_with("Air of")).unwrap();
    insta::assert_snapshot!("covers", covers);
    // Two drones beside a wall; the fill values of the wall do not reach them.
    let (done, said) = updraft("simulate c --air les:wall.nc,x=260 --truth", folder);
    assert!(done, "{said}");
}

/// Logs below a campaign.
struct FlightsIn<'a>(&'a Path);

impl FlightsIn<'_> {
    fn logs(&self) -> usize {
        let simulated = self.0.join("simulated");
        let Ok(entries) = fs::read_dir(simulated) else { return 0 };
        entries
            .filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|e| e == "BIN"))
            .count()
    }
}

/// Whatever is in a file: an answer or an error, without a panic, and soon.
#[test]
fn damaged_files_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.nc");
    let spec = format!("les:{}", path.to_str().unwrap()).parse().unwrap();
    let place = Where { orientation_deg: 0.0, height_m: 60.0 };
    let mut rng = stream(11, 0, Purpose::Air);
    let (mut refused, mut opened) = (0, 0);
    for format in [netcdf_writer::NcWriteFormat::Nc4, netcdf_writer::NcWriteFormat::Offset64] {
        let whole = bytes(&field(), As { format, ..As::new(&PALM, &[0.0, 5.0]) });
        for _ in 0..150 {
            let mut damaged = whole.clone();
            match rng.random_range(0..4) {
                0 => damaged.truncate(rng.random_range(0..whole.len())),
                // Most of what describes the file is at its beginning.
                1 => {
                    for _ in 0..rng.random_range(1..8) {
                        let at = rng.random_range(0..4_096.min(whole.len()));
                        damaged[at] = rng.random();
                    }
                }
                2 => {
                    for _ in 0..rng.random_range(1..200) {
                        let at = rng.random_range(0..whole.len());
                        damaged[at] = rng.random();
                    }
                }
                _ => {
                    let at = rng.random_range(0..whole.len() - 8);
                    damaged[at..at + 8].copy_from_slice(&u64::MAX.to_le_bytes());
                }
            }
            fs::write(&path, &damaged).unwrap();
            match open(&spec, place) {
                Err(_) => refused += 1,
                Ok(les) => {
                    opened += 1;
                    for step in 0..20 {
                        let m = 17.0 * f64::from(step);
                        let v = les
                            .air
                            .air_velocity(&Vector3::new(m, -m, 5.0 * f64::from(step)), 0.3 * m);
                        assert!(v.iter().all(|one| one.is_finite()));
                    }
                }
            }
        }
    }
    assert!(refused > 50 && opened > 20, "{refused} refused, {opened} opened");
}
