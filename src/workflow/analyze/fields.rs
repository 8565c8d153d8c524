//! Files beside the report of an analysis: the measured fields for other programs, and the finished
//! study that goes into the report.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::settings::Files;
use crate::analysis::result::Analysis;
use crate::base::file::write_with;
use crate::base::plain::Shown as _;
use crate::campaign;
use crate::products::{Origin, fields, fields_grid, geojson, kml, thermals, turbulence};
use crate::report::Provenance;
use crate::study::result::{STUDY_RESULT_SCHEMA, StudyResult};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Writes the fields, if there are any. Those of an earlier analysis that has become empty go.
pub(super) fn write_fields(
    host: &dyn Host,
    (analysis, provenance): (&Analysis, &Provenance),
    folder: &Path,
    wish: &Files,
) -> Result<(), WorkflowError> {
    let origin = origin(provenance, wish);
    // They share no file, and each spends most of its time with compressing.
    let (drones, (netcdf, others)) = rayon::join(
        || write_drones(analysis, &origin, folder),
        || {
            rayon::join(
                || write_netcdf(host, (analysis, &origin), folder, wish),
                || write_others(analysis, &origin, folder),
            )
        },
    );
    drones.and(others).and(netcdf)
}

/// Writes the tables of all drones, or removes those of an earlier analysis.
fn write_drones(analysis: &Analysis, origin: &Origin, folder: &Path) -> Result<(), WorkflowError> {
    let (csv, parquet) = (campaign::fields_csv(folder), campaign::fields_parquet(folder));
    if !fields::any(analysis) {
        remove(&[csv, parquet]);
        return Ok(());
    }
    let as_csv = || write_with(&csv, |out| fields::write_csv(analysis, out));
    #[cfg(feature = "parquet")]
    {
        let as_parquet =
            || write_parquet(&parquet, crate::products::fields_parquet::parquet(analysis, origin));
        let (csv, parquet) = rayon::join(as_csv, as_parquet);
        csv?;
        parquet
    }
    #[cfg(not(feature = "parquet"))]
    {
        let _ = origin;
        remove(&[parquet]);
        Ok(as_csv()?)
    }
}

/// Writes the tables of the grid, of turbulence and of thermals, and what maps show, or removes those of an earlier analysis.
fn write_others(analysis: &Analysis, origin: &Origin, folder: &Path) -> Result<(), WorkflowError> {
    let (csv, parquet) = (campaign::fields_grid_csv(folder), campaign::fields_grid_parquet(folder));
    if fields_grid::any(analysis) {
        write_with(&csv, |out| fields_grid::write_csv(analysis, out))?;
        #[cfg(feature = "parquet")]
        write_parquet(&parquet, crate::products::fields_parquet::grid_parquet(analysis, origin))?;
        #[cfg(not(feature = "parquet"))]
        {
            let _ = origin;
            remove(&[parquet]);
        }
    } else {
        remove(&[csv, parquet]);
    }
    write_turbulence(analysis, folder)?;
    let path = campaign::fields_thermals(folder);
    if thermals::any(analysis) {
        write_with(&path, |out| thermals::write_csv(analysis, out))?;
    } else {
        remove(&[path]);
    }
    text(&campaign::fields_geojson(folder), geojson::geojson(analysis))?;
    text(&campaign::fields_kml(folder), kml::kml(analysis))
}

/// Origin of the files, by the report's provenance.
fn origin(provenance: &Provenance, wish: &Files) -> Origin {
    let inputs = provenance.inputs.iter().map(|file| (file.path.clone(), file.sha256.clone()));
    Origin {
        program: provenance.program.clone(),
        command: provenance.command.clone(),
        institution: wish.institution.clone(),
        inputs: inputs.collect(),
        analysis_sha256: provenance.analysis_sha256.clone(),
    }
}

/// Writes the tables of turbulence, or removes those of an earlier analysis.
fn write_turbulence(analysis: &Analysis, folder: &Path) -> Result<(), WorkflowError> {
    for table in turbulence::Table::ALL {
        let path = campaign::fields_turbulence(folder, table.stem());
        if turbulence::any(analysis) {
            write_with(&path, |out| turbulence::write_csv(analysis, table, out))?;
        } else {
            remove(&[path]);
        }
    }
    Ok(())
}

/// Writes a text, or removes that of an earlier analysis.
fn text(path: &Path, text: Option<String>) -> Result<(), WorkflowError> {
    let Some(text) = text else {
        remove(&[path.to_owned()]);
        return Ok(());
    };
    Ok(write_with(path, |out| out.write_all(text.as_bytes()))?)
}

#[cfg(feature = "netcdf")]
fn write_netcdf(
    host: &dyn Host,
    (analysis, origin): (&Analysis, &Origin),
    folder: &Path,
    wish: &Files,
) -> Result<(), WorkflowError> {
    use crate::base::file::write_whole;
    use crate::products::netcdf::{self, Format};

    let format = if wish.netcdf_classic { Format::Classic } else { Format::Netcdf4 };
    let made = netcdf::files(analysis, origin, format)
        .map_err(|error| WorkflowError::Failed(error.to_string()))?;
    let drones = campaign::fields_netcdf(folder);
    match &made.drones {
        Some(bytes) => write_whole(&drones, bytes)?,
        None => remove(&[drones]),
    }
    let grids = one_each(&made.grids, |name| campaign::fields_grid_netcdf(folder, name))?;
    remove_others(campaign::fields_grids_netcdf(folder), &grids);
    let of_turbulence = |name: Option<&str>| campaign::fields_turbulence_netcdf(folder, name);
    let turbulence = one_each(&made.turbulence, of_turbulence)?;
    remove_others(campaign::fields_turbulences_netcdf(folder), &turbulence);
    for sentence in &made.left_out {
        host.say(sentence);
    }
    Ok(())
}

/// Writes a file for each flight; that of a single flight has no flight in its name.
#[cfg(feature = "netcdf")]
fn one_each(
    files: &[(String, Vec<u8>)],
    path: impl Fn(Option<&str>) -> PathBuf,
) -> Result<Vec<PathBuf>, WorkflowError> {
    let mut written: Vec<PathBuf> = Vec::new();
    let single = files.len() == 1;
    for (number, (flight, bytes)) in files.iter().enumerate() {
        let mut own = path((!single).then_some(flight.as_str()));
        if written.contains(&own) {
            own = path(Some(&format!("{flight}-{number}")));
        }
        crate::base::file::write_whole(&own, bytes)?;
        written.push(own);
    }
    Ok(written)
}

/// Removes files of an earlier analysis.
#[cfg(feature = "netcdf")]
fn remove_others(mut old: Vec<PathBuf>, written: &[PathBuf]) {
    old.retain(|path| !written.contains(path));
    remove(&old);
}

#[cfg(not(feature = "netcdf"))]
fn write_netcdf(
    _: &dyn Host,
    _: (&Analysis, &Origin),
    folder: &Path,
    _: &Files,
) -> Result<(), WorkflowError> {
    remove(&[campaign::fields_netcdf(folder)]);
    remove(&campaign::fields_grids_netcdf(folder));
    remove(&campaign::fields_turbulences_netcdf(folder));
    Ok(())
}

fn remove(old: &[PathBuf]) {
    for old in old {
        // Nothing to remove is the usual case.
        let _ = std::fs::remove_file(old);
    }
}

#[cfg(feature = "parquet")]
fn write_parquet(
    path: &Path,
    bytes: parquet::errors::Result<Vec<u8>>,
) -> Result<(), WorkflowError> {
    let bytes =
        bytes.map_err(|error| WorkflowError::Failed(format!("failed to make Parquet: {error}")))?;
    Ok(crate::base::file::write_whole(path, &bytes)?)
}

/// The study that a campaign holds; says so, and goes on without, where it cannot be read.
pub(super) fn read_study(host: &dyn Host, root: &Path) -> Option<StudyResult> {
    let path = campaign::study_result(root);
    if !path.is_file() {
        return None;
    }
    match campaign::read_json::<StudyResult>(&path) {
        Ok(study) if study.schema == STUDY_RESULT_SCHEMA => Some(study),
        Ok(study) => {
            host.warn(&format!(
                "{} has the format \"{}\", this program reads \"{STUDY_RESULT_SCHEMA}\": the \
                 report does without Fig. 2 and Table I; fly the study again",
                path.shown(),
                study.schema
            ));
            None
        }
        Err(error) => {
            host.warn(&format!("the report does without Fig. 2 and Table I: {error}"));
            None
        }
    }
}
