//! Campaigns of a calibration and a hover, each in air of its own.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::path::Path;

use updraft::analysis::AnalysisOptions;
use updraft::analysis::result::{Analysis, Turbulence};
use updraft::analysis::statistics::StatisticsOptions;
use updraft::campaign::{self, FlightFolder};
use updraft::mission::resolve::Override;
use updraft::sim::air::spec::{self, Air};
use updraft::workflow::analyze::{Analysing, Settings};
use updraft::workflow::find::{Work, find};
use updraft::workflow::host::Quiet;
use updraft::workflow::simulate::{Simulation, simulate};
use updraft::workflow::{mission, plan};

/// Half the width of a normal 95 % interval, standard errors.
const NORMAL: f64 = 1.96;

/// Settings without the map between the drones, which takes most of an analysis.
pub(crate) fn settings() -> Settings {
    let statistics =
        StatisticsOptions { flights: 0, variants: false, ..StatisticsOptions::default() };
    let options = AnalysisOptions { posterior: false, statistics, ..AnalysisOptions::default() };
    Settings { options, ..Settings::default() }
}

/// A fleet that hovers.
pub(crate) struct Fleet {
    pub(crate) side: i64,
    pub(crate) spacing_m: f64,
    pub(crate) hover_s: f64,
}

impl Fleet {
    /// Plans a campaign into `root`.
    pub(crate) fn plan(&self, root: &Path) -> Vec<FlightFolder> {
        let overrides = [
            Override::new("vehicle", "pixel"),
            Override::new("grid.rows", self.side),
            Override::new("grid.columns", self.side),
            Override::new("grid.spacing_m", self.spacing_m),
            Override::new("duration_s", self.hover_s),
        ];
        let planned = mission::resolve("campaign", &overrides).unwrap();
        let shows = plan::shows(&planned);
        plan::write(&Quiet::default(), &planned, &shows, root, false).unwrap();
        campaign::flights(root).unwrap()
    }

    /// Turbulence of hovers in such air, each of drones and a calibration in steady wind of its own: a seed draws the drones, too.
    pub(crate) fn flown(
        &self,
        seeds: std::ops::Range<u64>,
        air: &[&str],
        wind: &str,
    ) -> Vec<Turbulence> {
        let host = Quiet::default();
        let campaign = |seed: u64| {
            let folder = tempfile::tempdir().unwrap();
            let root = folder.path().join("campaign");
            let flights = self.plan(&root);
            for (flight, air) in flights.iter().zip([vec![wind], [air, &[wind]].concat()]) {
                let specs: Vec<_> = air.iter().flat_map(|part| spec::load(part).unwrap()).collect();
                let air = Air::new([0.0; 3], &specs);
                let plan = flight.read_plan().unwrap();
                simulate(&host, flight, &plan, &Simulation::new(air, seed)).unwrap();
            }
            let mut work = Work::new(&root);
            find(&root, None, &mut work).unwrap();
            analysed(&work)
        };
        seeds.flat_map(campaign).collect()
    }
}

/// Turbulence of the hovers among the flights.
pub(crate) fn analysed(work: &Work) -> Vec<Turbulence> {
    let settings = settings();
    let host = Quiet::default();
    let found: Analysis =
        Analysing::begin(&host, work, &settings, None).unwrap().run(false).unwrap().analysis;
    found.flights.into_iter().filter_map(|flight| flight.turbulence).collect()
}

/// Wilson's 95 % interval of a share.
pub(crate) fn wilson(inside: usize, of: usize) -> [f64; 2] {
    let (n, share) = (of as f64, inside as f64 / of as f64);
    let z2 = NORMAL * NORMAL;
    let centre = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = NORMAL * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt() / (1.0 + z2 / n);
    [centre - half, centre + half]
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
