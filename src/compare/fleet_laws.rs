//! The laws of one flight, ready to be compared: the fleet with what its drones share, the drones with what is their own.

use std::array;

use super::result::Quantity;
use super::side::FlightOf;
use crate::analysis::LawKind;
use crate::analysis::law::Symbol;
use crate::analysis::result::{BentLine, DroneAnalysis, Fit, Laws};
use crate::base::estimate::Estimate;
use crate::numeric::extent;

/// Choice of the law that is compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LawChoice {
    /// The one that each flight's windows prefer.
    #[default]
    Preferred,
    /// The paper's line.
    Linear,
    /// The paper's signed quadratic.
    SignedQuadratic,
}

/// Form of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// `u = u0 + A' V + B V² + C V|V|`.
    Bent,
    /// `u = u0 + A' V`.
    Linear,
    /// `u = u0 + A V|V|`, in still air.
    SignedQuadratic,
}

impl Form {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Bent => "line that may bend",
            Self::Linear => LawKind::Linear.name(),
            Self::SignedQuadratic => LawKind::SignedQuadratic.name(),
        }
    }

    /// What the parameters are multiplied with at a vertical speed.
    pub(super) fn basis(self, v: f64) -> [f64; 4] {
        match self {
            Self::Bent => [1.0, v, v * v, v * v.abs()],
            Self::Linear => [1.0, v, 0.0, 0.0],
            Self::SignedQuadratic => [1.0, v * v.abs(), 0.0, 0.0],
        }
    }

    pub(super) fn unit(self, quantity: Quantity, effort: &str) -> String {
        match (quantity, self) {
            (Quantity::Response, Self::SignedQuadratic) => format!("{effort}/(m/s)²"),
            (Quantity::Response, _) => format!("{effort}/(m/s)"),
            _ => effort.to_owned(),
        }
    }
}

pub(super) type Square = [[f64; 4]; 4];

/// Parameters, the effort in hover first, with a covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parameters {
    pub(super) value: [f64; 4],
    pub(super) covariance: Square,
}

impl Parameters {
    /// A linear combination of the parameters.
    pub(super) fn along(&self, g: [f64; 4]) -> Estimate {
        let value = g.iter().zip(self.value).map(|(g, value)| g * value).sum();
        Estimate::new(value, variance(&self.covariance, g).sqrt())
    }
}

pub(super) fn variance(of: &Square, g: [f64; 4]) -> f64 {
    let rows = of.iter().zip(g).map(|(row, left)| {
        left * row.iter().zip(g).map(|(value, right)| value * right).sum::<f64>()
    });
    rows.sum::<f64>().max(0.0)
}

fn diagonal(variances: [f64; 4]) -> Square {
    array::from_fn(|row| array::from_fn(|column| if row == column { variances[row] } else { 0.0 }))
}

/// The laws of a flight.
#[derive(Clone, Debug)]
pub(super) struct FleetLaws {
    pub(super) form: Form,
    pub(super) unit: String,
    /// The fleet, with the covariance that its drones share.
    pub(super) fleet: Parameters,
    /// Slot, label and law of each drone, with the covariance of its own.
    pub(super) drones: Vec<(Option<u16>, String, Parameters)>,
    /// Lowest and highest vertical speed, m/s.
    pub(super) speeds_mps: [f64; 2],
    /// Whether covariances are known beside the variances.
    pub(super) is_complete: bool,
    /// Whether the drones' own errors are told from common ones.
    pub(super) is_split: bool,
}

impl FleetLaws {
    /// The laws of a flight; `None` where it has none of the kind.
    pub(super) fn of(of: FlightOf<'_>, choice: LawChoice) -> Option<Self> {
        let flight = of.flight;
        let unit = flight.indicator.unit();
        let headline = flight.headline.as_ref();
        let whole = || flight.drones.iter().filter(|drone| drone.partial_ladder.is_none());
        let kind = match choice {
            LawChoice::Preferred => {
                if let Some(line) = headline.and_then(|headline| headline.line.as_ref()) {
                    return Self::of_lines(line, whole(), unit);
                }
                headline.map_or(LawKind::Linear, |headline| headline.law)
            }
            LawChoice::Linear => LawKind::Linear,
            LawChoice::SignedQuadratic => LawKind::SignedQuadratic,
        };
        Self::of_fits(kind, flight.flock.as_ref(), whole(), unit)
    }

    fn of_lines<'a>(
        fleet: &BentLine,
        drones: impl Iterator<Item = &'a DroneAnalysis>,
        unit: &str,
    ) -> Option<Self> {
        let (fleet_law, mut is_complete) = of_line(fleet);
        let drones: Vec<_> = drones
            .filter_map(|drone| {
                let (mut law, complete) = of_line(drone.line.as_ref()?);
                is_complete &= complete;
                let common =
                    if complete { fleet_law.covariance } else { diagonal(variances(fleet)) };
                for (row, common) in law.covariance.iter_mut().zip(common) {
                    row.iter_mut().zip(common).for_each(|(own, common)| *own -= common);
                }
                Some((drone.slot, drone.name.clone(), law))
            })
            .collect();
        (!drones.is_empty()).then(|| Self {
            form: Form::Bent,
            unit: unit.to_owned(),
            fleet: fleet_law,
            drones,
            speeds_mps: fleet.speeds_mps,
            is_complete,
            is_split: true,
        })
    }

    fn of_fits<'a>(
        kind: LawKind,
        flock: Option<&Laws>,
        drones: impl Iterator<Item = &'a DroneAnalysis> + Clone,
        unit: &str,
    ) -> Option<Self> {
        let form = match kind {
            LawKind::Linear => Form::Linear,
            LawKind::SignedQuadratic => Form::SignedQuadratic,
        };
        let law = |laws: &Laws| of_fit(kind, laws.of(kind)?);
        let own = |drone: &DroneAnalysis| {
            Some((drone.slot, drone.name.clone(), law(drone.laws.as_ref()?)?))
        };
        let laws: Vec<_> = drones.clone().filter_map(own).collect();
        let first = laws.first()?.2;
        let legs = drones
            .flat_map(|drone| &drone.windows)
            .filter(|window| window.kind.is_leg() && window.rejected.is_empty());
        let (slowest, fastest) = extent(legs.map(|window| window.velocity_mps.mean))?;
        Some(Self {
            form,
            unit: unit.to_owned(),
            fleet: flock.and_then(law).unwrap_or(first),
            drones: laws,
            speeds_mps: [slowest, fastest],
            is_complete: true,
            is_split: false,
        })
    }
}

fn variances(line: &BentLine) -> [f64; 4] {
    [line.u0, line.slope, line.bend, line.drag].map(|one| one.se * one.se)
}

/// A line's parameters, and whether their covariances are known.
fn of_line(line: &BentLine) -> (Parameters, bool) {
    let value = [line.u0, line.slope, line.bend, line.drag].map(|one| one.value);
    let covariance = line.covariance.unwrap_or_else(|| diagonal(variances(line)));
    (Parameters { value, covariance }, line.covariance.is_some())
}

/// A fit's parameters without the air that it was flown in; `None` where they mean nothing.
fn of_fit(kind: LawKind, fit: &Fit) -> Option<Parameters> {
    // Of several minima nearly as good, chance picks one.
    if fit.w_beyond_mps.is_some() || !fit.other_minima.is_empty() {
        return None;
    }
    let response = match kind {
        LawKind::Linear => Symbol::Slope,
        LawKind::SignedQuadratic => Symbol::A,
    };
    let n = fit.parameters.len();
    let place = |symbol| fit.parameters.iter().position(|one| one.name == symbol);
    let places = [place(Symbol::U0)?, place(response)?];
    let mut law = Parameters { value: [0.0; 4], covariance: [[0.0; 4]; 4] };
    for (row, at) in places.iter().enumerate() {
        law.value[row] = fit.parameters.get(*at)?.estimate.value;
        for (column, other) in places.iter().enumerate() {
            law.covariance[row][column] = *fit.covariance.get(at * n + other)?;
        }
    }
    Some(law)
}
