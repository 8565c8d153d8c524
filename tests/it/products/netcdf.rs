//! NetCDF, by the programs that read it: netCDF4, xarray, the compliance checker of IOOS, pyproj, ncdump.
#![cfg(feature = "netcdf")]

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use updraft::analysis::result::Analysis;
use updraft::products::fields;
use updraft::products::fields_grid;
use updraft::products::netcdf::{Files, Format, expected, files};

use crate::products::support::{can_run, origin, placed, python};
use crate::report::synthetic::campaign;

/// What the scripts begin with.
const READ: &str = include_str!("read.py");

fn made(analysis: &Analysis, format: Format) -> Files {
    files(analysis, &origin(), format).unwrap()
}

/// Writes all files of an analysis into a folder: `updraft.nc`, `updraft-grid.nc` and the tables.
fn write(analysis: &Analysis, folder: &Path, format: Format) {
    let made = made(analysis, format);
    fs::write(folder.join("updraft.nc"), made.drones.unwrap()).unwrap();
    fs::write(folder.join("updraft-grid.nc"), &made.grids[0].1).unwrap();
    let mut csv = Vec::new();
    fields::write_csv(analysis, &mut csv).unwrap();
    fs::write(folder.join("updraft.csv"), csv).unwrap();
    let mut csv = Vec::new();
    fields_grid::write_csv(analysis, &mut csv).unwrap();
    fs::write(folder.join("updraft-grid.csv"), csv).unwrap();
}

/// The same flight with its rows to another point of the compass.
fn turned(orientation_deg: f64) -> Analysis {
    let mut analysis = placed();
    analysis.flights[1].orientation_deg = Some(orientation_deg);
    analysis.flights[1].map.as_mut().unwrap().drones[0].place = None;
    analysis
}

#[test]
fn the_same_analysis_gives_the_same_bytes() {
    let analysis = placed();
    for (format, begins) in [(Format::Netcdf4, &b"\x89HDF"[..]), (Format::Classic, b"CDF\x02")] {
        let (first, second) = (made(&analysis, format), made(&analysis, format));
        assert_eq!(first, second);
        let drones = first.drones.unwrap();
        assert!(drones.starts_with(begins) && first.grids[0].1.starts_with(begins));
    }
}

#[test]
fn what_has_neither_time_nor_place_is_no_file_and_that_is_said() {
    // The synthetic logs have no GPS time.
    let made = made(&campaign(), Format::Netcdf4);
    assert_eq!((made.drones, made.grids.len()), (None, 0));
    assert_eq!(
        made.left_out,
        [
            "The values have no UTC (no GPS time in the log): there is no NetCDF file of the drones; the tables in fields/ \
          have all of them"
        ]
    );
    assert_eq!(expected(&campaign()), (false, Vec::new()));
    let mut nowhere = placed();
    nowhere.flights[1].site = None;
    let made = files(&nowhere, &origin(), Format::Netcdf4).unwrap();
    assert!(made.drones.is_some(), "one drone's log has a place");
    assert_eq!(made.grids, []);
    assert_eq!(made.left_out.len(), 2, "{:?}", made.left_out);
    assert!(made.left_out[0].starts_with("Some values have no place"), "{:?}", made.left_out);
    assert!(made.left_out[1].contains("the posterior between the drones has no place"));
    assert_eq!(expected(&nowhere), (true, Vec::new()));
    assert_eq!(expected(&placed()), (true, vec!["hover".to_owned()]));
}

#[test]
fn xarray_finds_what_the_tables_have() {
    if !can_run("xarray, netCDF4, pandas") {
        return;
    }
    let mut drifting = placed();
    let quality = serde_json::json!([
        {"flag": "drift", "start_s": 95.0, "end_s": 300.0, "reason": ""},
        {"flag": "no_voltage", "start_s": 200.0, "end_s": 400.0, "reason": ""}
    ]);
    drifting.flights[1].map.as_mut().unwrap().drones[0].quality =
        serde_json::from_value(quality).unwrap();
    for format in [Format::Netcdf4, Format::Classic] {
        let folder = tempfile::tempdir().unwrap();
        write(&drifting, folder.path(), format);
        let said = python(folder.path(), &format!("{READ}\ndrones()\ngrid()"));
        assert!(said.contains("rows ") && said.contains("cells "), "{said}");
    }
}

#[test]
fn the_compliance_checker_finds_nothing() {
    if !can_run("compliance_checker, netCDF4") {
        return;
    }
    let mut low = placed();
    low.flights[1].site.as_mut().unwrap().ground_amsl_m = None;
    low.flights[1].map.as_mut().unwrap().drones[0].place = None;
    let folder = tempfile::tempdir().unwrap();
    let cases =
        [("placed", placed()), ("north", turned(0.0)), ("west", turned(-90.0)), ("low", low)];
    for (name, analysis) in cases {
        let folder = folder.path().join(name);
        fs::create_dir(&folder).unwrap();
        write(&analysis, &folder, Format::Netcdf4);
        let said = python(
            &folder,
            &format!("{READ}\ncomplies('updraft.nc')\ncomplies('updraft-grid.nc')"),
        );
        assert_eq!(said.matches("All tests passed!").count(), 2, "{name}: {said}");
    }
    // The checker must be able to fail. The netCDF library changes files of the classic format alone: see docs/products.md.
    let folder = folder.path().join("damaged");
    fs::create_dir(&folder).unwrap();
    write(&placed(), &folder, Format::Classic);
    let damaged =
        "import netCDF4\nwith netCDF4.Dataset('updraft.nc', 'a') as file: file['w'].units = 'ohm'";
    python(&folder, damaged);
    let said = python(&folder, &format!("{READ}\ncomplies('updraft.nc')"));
    assert!(!said.contains("All tests passed!"), "{said}");
}

#[test]
fn the_grids_projection_leads_to_the_places_of_its_cells() {
    if !can_run("pyproj, netCDF4, xarray, pandas") {
        return;
    }
    for orientation_deg in [0.0, 90.0, 180.0, 270.0, 30.0, 120.0, 210.0, 330.0, 89.0, -1.0] {
        let folder = tempfile::tempdir().unwrap();
        write(&turned(orientation_deg), folder.path(), Format::Netcdf4);
        let said = python(folder.path(), &format!("{READ}\ngrid()\nprojection({orientation_deg})"));
        assert!(said.contains("projected 4"), "{orientation_deg}: {said}");
    }
}

#[test]
fn the_documents_python_reads_grids() {
    if !can_run("xarray, netCDF4") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let fields = folder.path().join("my-campaign/fields");
    fs::create_dir_all(&fields).unwrap();
    write(&placed(), &fields, Format::Netcdf4);
    let text =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/products.md")).unwrap();
    let blocks = text.split("```python\n").skip(1).filter_map(|rest| rest.split("```").next());
    let blocks: Vec<&str> = blocks.filter(|block| block.contains("updraft-grid")).collect();
    assert!(!blocks.is_empty());
    for block in blocks {
        python(folder.path(), block);
    }
}

#[test]
fn ncdump_reads_both_formats() {
    let there = Command::new("ncdump").output().is_ok();
    if !there {
        // Written directly: the harness swallows what a passing test prints.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no ncdump for tests/it/products; apt-get install netcdf-bin"
        );
        return;
    }
    for (format, kind) in [(Format::Netcdf4, "netCDF-4"), (Format::Classic, "64-bit offset")] {
        let folder = tempfile::tempdir().unwrap();
        write(&placed(), folder.path(), format);
        let run = |option: &str| {
            let output = Command::new("ncdump")
                .args([option, "updraft.nc"])
                .current_dir(folder.path())
                .output()
                .unwrap();
            assert!(output.status.success());
            String::from_utf8(output.stdout).unwrap()
        };
        assert_eq!(run("-k").trim(), kind);
        let header = run("-h");
        for line in [
            "w:standard_name = \"upward_air_velocity\"",
            "row_size:sample_dimension = \"obs\"",
            "trajectory_id:cf_role = \"trajectory_id\"",
            ":featureType = \"trajectory\"",
        ] {
            assert!(header.contains(line), "{line}: {header}");
        }
    }
}
