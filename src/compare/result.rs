//! Words of a comparison, as written to `compare.json`.
//!
//! Every change is *other less reference*. Errors are standard errors; p-values are two-sided.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::estimate::Estimate;

/// Name and version of the format of [`Comparison`].
pub const COMPARE_SCHEMA: &str = "updraft.compare/1";

/// Campaigns side by side, each against the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Comparison {
    /// Format name and version: `updraft.compare/1`.
    pub schema: String,
    /// Program and version that made it.
    pub made_by: String,
    /// Campaigns, the reference first.
    pub campaigns: Vec<ComparedCampaign>,
    /// Level of the tests: probability that any drone of a pair of flights is named wrongly.
    pub level: f64,
    /// Laws, a pair of flights each.
    pub laws: Vec<LawComparison>,
    /// Maps, a pair of flights each.
    pub maps: Vec<MapComparison>,
    /// Correlations of the air, a pair of flights each.
    pub structures: Vec<StructureComparison>,
    /// Tests that all campaigns are equal, where there are three or more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub all_equal: Vec<AllEqual>,
    /// What should have been compared and could not be, one sentence each.
    pub not_compared: Vec<String>,
    /// What a reader must know, one sentence each.
    pub notes: Vec<String>,
}

/// One of the campaigns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ComparedCampaign {
    /// Label, which no other campaign of the comparison has.
    pub id: String,
    /// Path as it was given.
    pub path: String,
    /// Title for people.
    pub title: String,
    /// Vehicle of the plans; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vehicle: Option<String>,
    /// Ids of its flights: campaign/flight.
    pub flights: Vec<String>,
}

/// Two flights whose results are compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pair {
    /// Id of the reference's flight: campaign/flight.
    pub reference: String,
    /// Id of the other flight.
    pub other: String,
}

/// By what drones of two flights are known as the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Identity {
    /// Their system ids.
    Airframe,
    /// Their slots in the plan, or their labels.
    Slot,
}

/// Origin of the errors of single drones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// The drones' own stated errors, widened where the fleet scatters by more.
    Stated,
    /// The scatter of the fleet: the stated errors hold a part that the drones share, and only their ratios count.
    Scatter,
}

/// Laws of two flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LawComparison {
    /// The flights.
    pub pair: Pair,
    /// Form of both laws: `line that may bend`, `linear` or `signed quadratic`.
    pub law: String,
    /// Unit of rotor effort: us, or that of the indicator.
    pub effort_unit: String,
    /// By what drones are known as the same.
    pub identity: Identity,
    /// Drones with a law in both.
    pub drones_in_both: usize,
    /// Labels of drones with a law in the reference alone.
    pub only_reference: Vec<String>,
    /// Labels of drones with a law in the other alone.
    pub only_other: Vec<String>,
    /// Origin of the drones' errors.
    pub basis: Basis,
    /// The fleet as a whole.
    pub fleet: Vec<FleetChange>,
    /// The drones, in the order of the reference.
    pub drones: Vec<DroneChange>,
    /// The fleet's laws over the speeds that both ladders reach.
    pub curve: Vec<CurvePoint>,
}

/// A quantity of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Effort in hover, u0.
    Hover,
    /// Slope in hover A' of a line, or A of a signed quadratic.
    Response,
    /// Effort of the fastest climb that both ladders have, in still air.
    Climb,
    /// Effort of the fastest descent that both ladders have, in still air.
    Descent,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Hover, Self::Response, Self::Climb, Self::Descent];

    /// Whether drones are tested by it: the other quantities follow from these and the bends.
    pub fn is_tested(self) -> bool {
        matches!(self, Self::Hover | Self::Response)
    }
}

/// A change of the fleet as a whole: the median of the drones in both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FleetChange {
    /// Quantity that changed.
    pub quantity: Quantity,
    /// Its unit.
    pub unit: String,
    /// Vertical speed of a climb or descent, m/s, up positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
    /// The reference's fleet, with the error that its drones share.
    pub reference: Estimate,
    /// The other's fleet.
    pub other: Estimate,
    /// Change of the drones in both, with both common errors, each counted once.
    pub change: Estimate,
    /// The drones in both, in the reference: the median of their means over both flights less half of the change, with
    /// the error that they share.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_in_both: Option<Estimate>,
    /// The drones in both, in the other flight: that median and half of the change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other_in_both: Option<Estimate>,
    /// The change over its error; absent: the error is not known, or without what the drones share.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// Probability of at least this change by chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// Scatter of the drones' changes over their stated errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<f64>,
}

/// Changes of one drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneChange {
    /// Airframe or slot, as the drones are known by.
    pub id: String,
    /// Slot in the reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u16>,
    /// Slot in the other flight, where it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other_slot: Option<u16>,
    /// Label in the reference.
    pub name: String,
    /// Its changes.
    pub changes: Vec<Change>,
    /// Whether any of them is more than chance, among all drones and tests of the pair.
    pub is_changed: bool,
}

/// One change of a drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Change {
    /// Quantity that changed.
    pub quantity: Quantity,
    /// Its value in the reference, with the drone's own error.
    pub reference: Estimate,
    /// Its value in the other flight.
    pub other: Estimate,
    /// Change less that of the fleet, with an error free of what all drones share; absent: too few drones to tell it
    /// from the fleet's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beyond_fleet: Option<Estimate>,
    /// That over its error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub t: Option<f64>,
    /// Degrees of freedom of Student's t; absent: a normal value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dof: Option<f64>,
    /// Probability of at least this change by chance, of this drone alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// That among all drones and tests of the pair (Holm); absent: not tested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_holm: Option<f64>,
}

/// The fleets' laws at one vertical speed through still air.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurvePoint {
    /// Vertical speed, m/s, up positive.
    pub speed_mps: f64,
    /// Effort of the reference; an error of 0 is not known.
    pub reference: Estimate,
    /// Effort of the other.
    pub other: Estimate,
}

/// Maps of two flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapComparison {
    /// The flights.
    pub pair: Pair,
    /// Mean vertical air speed over fleet and hover.
    pub mean: MeanComparison,
    /// The same of the posteriors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posterior: Option<MeanComparison>,
    /// Whether both maps rest on the same calibration.
    pub same_calibration: bool,
    /// Whether its errors cancel in the difference: those of a line's zero do, those of a law that is flat near hover
    /// change what a drone makes of the air.
    #[serde(default)]
    pub errors_cancel: bool,
    /// Means by place; absent: the places differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub places: Option<PlaceComparison>,
    /// Strength and scales of the air.
    pub scales: Vec<ScaleComparison>,
}

/// Means of two maps, m/s, up positive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeanComparison {
    /// The reference.
    pub reference: Estimate,
    /// Its 95 % interval; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_interval: Option<[f64; 2]>,
    /// The other.
    pub other: Estimate,
    /// Its 95 % interval; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other_interval: Option<[f64; 2]>,
    /// Other less reference, errors that cancel left out.
    pub change: Estimate,
    /// 95 % interval of the change; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change_interval: Option<[f64; 2]>,
    /// The change over its error; absent: the error is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// Probability of at least this change by chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
}

/// Time means of two maps by place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlaceComparison {
    /// The places that both have.
    pub places: Vec<PlaceChange>,
    /// Sum of squares of the differences less their mean over their errors.
    pub chi2: f64,
    /// Degrees of freedom of that.
    pub dof: usize,
    /// Probability of at least that chi² if the pattern is the same.
    pub p_value: f64,
    /// Pearson's correlation of the two means over the places.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Number of independent places that the scales of the air leave of them; absent: the scales are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effective_places: Option<f64>,
    /// Probability of at least that correlation between independent fields of these scales; absent: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation_p_value: Option<f64>,
}

/// Means at one place, m/s, up positive, with errors of their own: free of what all places share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlaceChange {
    /// Label of the drone in the reference.
    pub name: String,
    /// Slot in the reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u16>,
    /// Place in the show frame, m (x forward, y left).
    pub position_m: [f64; 2],
    /// The reference.
    pub reference: Estimate,
    /// The other.
    pub other: Estimate,
    /// Other less reference.
    pub change: Estimate,
}

/// A strength or scale of the air in two flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScaleComparison {
    /// What it is, for people.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// The reference.
    pub reference: f64,
    /// Its 95 % interval; absent: not known, or nothing is determined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_interval: Option<[f64; 2]>,
    /// The other.
    pub other: f64,
    /// Its 95 % interval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other_interval: Option<[f64; 2]>,
    /// Logarithm of the ratio over its error; absent: not determined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// Probability of at least this ratio by chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// That among all scales of the pair (Holm).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_holm: Option<f64>,
}

/// Correlations of the air in two flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StructureComparison {
    /// The flights.
    pub pair: Pair,
    /// Over distance between drones, where both have the distance.
    pub distance: Vec<DistancePoint>,
    /// Over time.
    pub time: Vec<LagPoint>,
}

/// Median correlation of pairs of drones at one distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DistancePoint {
    /// Distance, m.
    pub distance_m: f64,
    /// The reference; an error of 0 is not known.
    pub reference: Estimate,
    /// The other.
    pub other: Estimate,
}

/// Mean autocorrelation of the drones at one lag.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LagPoint {
    /// Lag, s.
    pub lag_s: f64,
    /// The reference.
    pub reference: f64,
    /// The other.
    pub other: f64,
}

/// Whether all campaigns have the same value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AllEqual {
    /// Flights that are compared: campaign/flight.
    pub flights: Vec<String>,
    /// What is compared, for people.
    pub name: String,
    /// Airframe or slot; absent: it is of the fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drone: Option<String>,
    /// Sum of squares about the weighted mean, over errors.
    pub chi2: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Probability of at least that chi² if all are equal.
    pub p_value: f64,
    /// That among all drones (Holm); absent: it is of the fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_holm: Option<f64>,
}
