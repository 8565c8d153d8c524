//! The posterior between the drones of one flight: a grid over time, height and the ground.

use netcdf_writer::NcAttrValue;

use super::file::{Dimension, File, floats, text};
use super::globals::{self, About, Extent};
use super::trajectories::{beside, time_attributes};
use super::{Format, NetcdfError};
use crate::analysis::result::{Analysis, FlightAnalysis, PosteriorGrid, UpdraftMap};
use crate::base::frame::{ShowFrame, WGS84_A_M};
use crate::numeric::extent;
use crate::products::fields_grid::FleetWind;
use crate::products::{Origin, WhereWhen, clean};

/// Half of the time that a value is a mean of, s, and the time between them.
const HALF_S: f64 = 5.0;
const STEP_S: u32 = 10;
/// Inverse flattening of the WGS 84 ellipsoid.
const INVERSE_FLATTENING: f64 = 298.257_223_563;
/// A show frame that is turned by less than this against the points of the compass is not, degrees.
const ALIGNED_DEG: f64 = 1e-3;

/// What becomes of a flight.
pub(super) enum Made {
    File(Vec<u8>),
    /// It has a grid, but no UTC or no place: the sentence that says so.
    Unplaced(String),
    /// It has no grid.
    Nothing,
}

/// The file of a flight.
pub(super) fn file(
    (flight, id): (&FlightAnalysis, &str),
    analysis: &Analysis,
    origin: &Origin,
    format: Format,
) -> Result<Made, NetcdfError> {
    let Some((map, grid)) = grid_of(flight) else { return Ok(Made::Nothing) };
    let here = WhereWhen::of(flight);
    let times: Option<Vec<i64>> = grid.time_s.iter().map(|time_s| here.utc_ms(*time_s)).collect();
    let (Some(times), Some(frame)) = (times.as_ref(), here.frame()) else {
        let lacks = if times.is_none() { "UTC" } else { "place on the globe" };
        return Ok(Made::Unplaced(format!(
            "{}: the posterior between the drones has no {lacks}: there is no NetCDF file of it",
            clean(id)
        )));
    };
    let layout = Layout::of(grid, frame);
    let Some(extent) = extent_of(&layout, &here, grid, times) else { return Ok(Made::Nothing) };
    let mut file = File::new(format);
    let about = About {
        title: &format!(", between the drones ({})", clean(id)),
        summary: "Posterior mean of the vertical air speed on a grid over a swarm of drones, as means over 10 s, with its \
                  standard deviation: what all drones, seconds and the calibration tell together.",
        comment: "w is up positive. w_se holds all errors, those that all cells share as well. Cells that drones say nothing \
                  about are missing. x and y are metres in the projection of crs: towards east and north where the rows of the \
                  fleet point along the compass, else across and along its rows.",
        feature_type: "",
        data_type: "Grid",
        extent,
    };
    globals::write(&mut file, &about, (analysis, origin))?;
    let dims = axes(&mut file, &layout, times, grid)?;
    place(&mut file, &layout, &here, (grid, frame), &dims)?;
    values(&mut file, &layout, (map, grid), &dims, here.amsl_m(grid.height_m).is_some())?;
    Ok(Made::File(file.finish()?))
}

/// Whether a flight has a grid with UTC and a place.
pub(super) fn is_placed(flight: &FlightAnalysis) -> bool {
    let here = WhereWhen::of(flight);
    let timed =
        |grid: &PosteriorGrid| grid.time_s.iter().all(|time_s| here.utc_ms(*time_s).is_some());
    grid_of(flight).is_some_and(|(_, grid)| timed(grid)) && here.frame().is_some()
}

/// A grid whose axes rise, and whose fields are as long as they.
fn grid_of(flight: &FlightAnalysis) -> Option<(&UpdraftMap, &PosteriorGrid)> {
    let map = flight.map.as_ref()?;
    let grid = map.posterior.as_ref()?.grid.as_ref()?;
    let rises = |axis: &[f64]| !axis.is_empty() && axis.windows(2).all(|pair| pair[0] < pair[1]);
    let finite = |axis: &[f64]| axis.iter().all(|value| value.is_finite());
    let axes = [&grid.x_m, &grid.y_m, &grid.time_s];
    let whole =
        axes.into_iter().all(|axis| rises(axis) && finite(axis)) && grid.height_m.is_finite();
    whole.then_some((map, grid))
}

/// How rows and columns of the file lie in the grid: its axes are those of a projection.
struct Layout {
    /// Coordinates along the file's y and x, m.
    axes: [Vec<f64>; 2],
    /// Which of the grid's axes (0: x, 1: y) the file's y and x are, and whether they run backwards.
    of: [(usize, bool); 2],
    /// Direction of the file's y axis, degrees clockwise from north, between -90 and 90; absent: it is north.
    azimuth_deg: Option<f64>,
    grid: [Vec<f64>; 2],
}

impl Layout {
    fn of(grid: &PosteriorGrid, frame: ShowFrame) -> Self {
        let turned_deg = frame.orientation_deg.rem_euclid(360.0);
        let quarters = turned_deg / 90.0;
        let is_aligned = (quarters - quarters.round()).abs() * 90.0 < ALIGNED_DEG;
        // north = cos x + sin y, east = sin x - cos y; an oblique Mercator's azimuth is between -90 and 90 degrees, so
        // that a show that looks to the south is seen from its other side.
        let (of, azimuth_deg) = match (is_aligned, quarters.round().rem_euclid(4.0) as u8) {
            (true, 0) => ([(0, false), (1, true)], None),
            (true, 1) => ([(1, false), (0, false)], None),
            (true, 2) => ([(0, true), (1, false)], None),
            (true, _) => ([(1, true), (0, true)], None),
            (false, _) if turned_deg < 90.0 => ([(0, false), (1, true)], Some(turned_deg)),
            (false, _) if turned_deg > 270.0 => ([(0, false), (1, true)], Some(turned_deg - 360.0)),
            (false, _) => ([(0, true), (1, false)], Some(turned_deg - 180.0)),
        };
        let both = [grid.x_m.clone(), grid.y_m.clone()];
        let axis = |(which, backwards): (usize, bool)| -> Vec<f64> {
            let [x_m, y_m] = &both;
            let own = if which == 0 { x_m } else { y_m };
            if backwards { own.iter().rev().map(|m| 0.0 - m).collect() } else { own.clone() }
        };
        Self { axes: of.map(axis), of, azimuth_deg, grid: both }
    }

    /// Column (x) and row (y) of the grid for each row and column of the file.
    fn cells(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let [rows, columns] = [0, 1].map(|axis: usize| self.axes.get(axis).map_or(0, Vec::len));
        (0..rows).flat_map(move |row| (0..columns).map(move |column| [row, column])).map(|place| {
            let mut cell = [0; 2];
            for (axis, (which, backwards)) in self.of.into_iter().enumerate() {
                let length = self.axes[axis].len();
                cell[which] = if backwards { length - 1 - place[axis] } else { place[axis] };
            }
            cell
        })
    }

    /// Places of the cells in the show frame, m.
    fn shown_m(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let [x_m, y_m] = &self.grid;
        self.cells().filter_map(|[column, row]| Some([*x_m.get(column)?, *y_m.get(row)?]))
    }
}

fn extent_of(
    layout: &Layout,
    here: &WhereWhen<'_>,
    grid: &PosteriorGrid,
    times: &[i64],
) -> Option<Extent> {
    let places = || layout.shown_m().filter_map(|place| here.lat_lon_deg(place));
    let (lat, lon) = (extent(places().map(|deg| deg[0]))?, extent(places().map(|deg| deg[1]))?);
    Some(Extent {
        lat_deg: [lat.0, lat.1],
        lon_deg: [lon.0, lon.1],
        height_m: [grid.height_m; 2],
        utc_ms: [*times.first()?, *times.last()?],
        step_s: STEP_S,
    })
}

/// Time, z, y and x with their variables.
fn axes(
    file: &mut File,
    layout: &Layout,
    times: &[i64],
    grid: &PosteriorGrid,
) -> Result<[Dimension; 4], NetcdfError> {
    let [y_m, x_m] = &layout.axes;
    let dims = [
        file.dimension("time", times.len())?,
        file.dimension("z", 1)?,
        file.dimension("y", y_m.len())?,
        file.dimension("x", x_m.len())?,
    ];
    let [time, z, y, x] = dims;
    let ends = file.dimension("bound", 2)?;
    let time_s: Vec<f64> = times.iter().map(|ms| *ms as f64 / 1000.0).collect();
    let bounds: Vec<f64> = time_s.iter().flat_map(|s| [s - HALF_S, s + HALF_S]).collect();
    file.variable("time", &[time], &time_attributes("time_bounds"), (&time_s, None))?;
    file.variable("time_bounds", &[time, ends], &[], (&bounds, None))?;
    let height = [
        ("standard_name", text("height")),
        ("long_name", text("height above take-off")),
        ("units", text("m")),
        ("positive", text("up")),
        ("axis", text("Z")),
    ];
    file.variable("z", &[z], &height, (&[grid.height_m], None))?;
    let along = |name: &str, long_name: &str, axis: &str| {
        [
            ("standard_name", text(format!("projection_{name}_coordinate"))),
            ("long_name", text(long_name)),
            ("units", text("m")),
            ("axis", text(axis)),
        ]
    };
    let [north, east] = match layout.azimuth_deg {
        None => ["metres north of the origin", "metres east of the origin"],
        Some(_) => ["metres from the origin along the azimuth of crs", "metres to the right of it"],
    };
    file.variable("y", &[y], &along("y", north, "Y"), (y_m, None))?;
    file.variable("x", &[x], &along("x", east, "X"), (x_m, None))?;
    let shown = beside("show time: since the start of the flight's show", "s");
    file.variable("show_time", &[time], &shown, (&grid.time_s, None))?;
    Ok(dims)
}

/// Latitude and longitude of the cells, and the projection.
fn place(
    file: &mut File,
    layout: &Layout,
    here: &WhereWhen<'_>,
    (grid, frame): (&PosteriorGrid, ShowFrame),
    [_, z, y, x]: &[Dimension; 4],
) -> Result<(), NetcdfError> {
    let ground = [*y, *x];
    for (name, standard, units, axis) in
        [("lat", "latitude", "degrees_north", 0), ("lon", "longitude", "degrees_east", 1)]
    {
        let degrees = |place| here.lat_lon_deg(place).map_or(f64::NAN, |deg| deg[axis]);
        let values: Vec<f64> = layout.shown_m().map(degrees).collect();
        let attributes = [
            ("standard_name", text(standard)),
            ("long_name", text(format!("{standard} (WGS 84)"))),
            ("units", text(units)),
        ];
        file.variable(name, &ground, &attributes, (&values, None))?;
    }
    if let Some(amsl_m) = here.amsl_m(grid.height_m) {
        let attributes = [
            ("standard_name", text("altitude")),
            (
                "long_name",
                text("height above mean sea level (the receiver's geoid, or the plan's)"),
            ),
            ("units", text("m")),
            ("positive", text("up")),
        ];
        file.variable("alt", &[*z], &attributes, (&[amsl_m], None))?;
    }
    let (name, long_name) = match layout.azimuth_deg {
        None => ("transverse_mercator", "transverse Mercator at the origin of the show"),
        Some(_) => {
            ("oblique_mercator", "oblique Mercator along the rows of the show, at its origin")
        }
    };
    let mut attributes = vec![("grid_mapping_name", text(name)), ("long_name", text(long_name))];
    let [lat_deg, lon_deg] = [frame.origin.lat_deg, frame.origin.lon_deg];
    let mut numbers = vec![
        ("latitude_of_projection_origin", lat_deg),
        ("false_easting", 0.0),
        ("false_northing", 0.0),
        ("semi_major_axis", WGS84_A_M),
        ("inverse_flattening", INVERSE_FLATTENING),
    ];
    match layout.azimuth_deg {
        None => numbers.extend([
            ("longitude_of_central_meridian", lon_deg),
            ("scale_factor_at_central_meridian", 1.0),
        ]),
        Some(azimuth_deg) => numbers.extend([
            ("azimuth_of_central_line", azimuth_deg),
            // By another name, too: the compliance checker looks for that one.
            ("azimuth", azimuth_deg),
            ("longitude_of_projection_origin", lon_deg),
            ("scale_factor_at_projection_origin", 1.0),
        ]),
    }
    attributes
        .extend(numbers.into_iter().map(|(name, value)| (name, NcAttrValue::Doubles(vec![value]))));
    file.variable("crs", &[], &attributes, (&[0_i32], None))
}

fn values(
    file: &mut File,
    layout: &Layout,
    (map, grid): (&UpdraftMap, &PosteriorGrid),
    dims: &[Dimension; 4],
    has_amsl: bool,
) -> Result<(), NetcdfError> {
    let coordinates = if has_amsl { "lat lon alt" } else { "lat lon" };
    let fields = [
        (
            "w",
            "upward_air_velocity",
            "vertical air speed, up positive: posterior mean",
            &grid.updraft_mps,
        ),
        (
            "w_se",
            "upward_air_velocity standard_error",
            "standard deviation of w, all errors included",
            &grid.sd_mps,
        ),
    ];
    for (name, standard, long_name, field) in fields {
        let cells: Vec<[usize; 2]> = layout.cells().collect();
        let value = |time: usize, [column, row]: [usize; 2]| {
            field.get(time)?.get(row)?.get(column).copied().flatten().filter(|mps| mps.is_finite())
        };
        let all =
            (0..grid.time_s.len()).flat_map(|time| cells.iter().map(move |cell| (time, *cell)));
        let values = floats(&all.collect::<Vec<_>>(), |(time, cell)| value(*time, *cell));
        let mut attributes = vec![
            ("standard_name", text(standard)),
            ("long_name", text(long_name)),
            ("units", text("m s-1")),
            ("grid_mapping", text("crs")),
            ("coordinates", text(coordinates)),
            ("coverage_content_type", text(content(name))),
        ];
        if name == "w" {
            attributes.push(("ancillary_variables", text("w_se")));
            attributes.push(("cell_methods", text("time: mean")));
        }
        file.variable(name, dims, &attributes, (&values, Some(f32::NAN)))?;
    }
    let winds: Vec<Option<FleetWind>> =
        grid.time_s.iter().map(|time_s| FleetWind::at(map, *time_s)).collect();
    for (axis, [name, se, standard, towards]) in
        [["u", "u_se", "eastward_wind", "east"], ["v", "v_se", "northward_wind", "north"]]
            .into_iter()
            .enumerate()
    {
        let attributes = [
            ("standard_name", text(standard)),
            (
                "long_name",
                text(format!("wind towards true {towards}, mean over the drones by their leans")),
            ),
            ("units", text("m s-1")),
            ("ancillary_variables", text(se)),
            ("cell_methods", text("time: mean")),
            ("coverage_content_type", text(content(name))),
        ];
        let values = floats(&winds, |wind| Some((*wind)?.east_north_mps[axis]));
        file.variable(name, &dims[..1], &attributes, (&values, Some(f32::NAN)))?;
        let attributes = [
            ("standard_name", text(format!("{standard} standard_error"))),
            ("long_name", text(format!("standard error of {name}, from drag and trim"))),
            ("units", text("m s-1")),
            ("coverage_content_type", text(content(se))),
        ];
        let values = floats(&winds, |wind| Some((*wind)?.se_mps[axis]));
        file.variable(se, &dims[..1], &attributes, (&values, Some(f32::NAN)))?;
    }
    Ok(())
}

/// Kind of a variable, by ACDD.
fn content(name: &str) -> &'static str {
    if name.ends_with("_se") { "qualityInformation" } else { "physicalMeasurement" }
}
