//! The fleet's parameters as in the paper's Tables I and II.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::calibrate::{FitOptions, Weights};
use super::fitted::{Fit, Laws};
use super::kind::{LawKind, Symbol};
use super::stats::mean_sd;
use crate::base::estimate::Estimate;

/// Table of the paper that stands beside the fleet's numbers.
///
/// In files it stands by its number in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum PaperTable {
    /// Table I: simulation in still air.
    #[serde(rename = "I")]
    Simulation,
    /// Table II: flights in the field.
    #[serde(rename = "II")]
    Field,
}

impl PaperTable {
    fn value(self, law: TableLaw, quantity: Quantity) -> Option<Estimate> {
        use Quantity::{Parameter, ReducedChi2};
        use Symbol::{A, Slope, U0, W};
        use TableLaw::{Linear, SignedQuadratic};
        let (value, se) = match (self, law, quantity) {
            (Self::Simulation, SignedQuadratic, Parameter(A)) => (8.207, 0.020),
            (Self::Simulation, SignedQuadratic, Parameter(U0)) => (1598.656, 0.039),
            (Self::Simulation, SignedQuadratic, Parameter(W)) => (-0.0589, 0.0031),
            (Self::Field, SignedQuadratic, Parameter(A)) => (10.5, 2.6),
            (Self::Field, SignedQuadratic, Parameter(U0)) => (1562.0, 42.0),
            (Self::Field, SignedQuadratic, Parameter(W)) => (0.4, 3.0),
            (Self::Field, SignedQuadratic, ReducedChi2) => (2.19, 0.84),
            (Self::Field, Linear, Parameter(Slope)) => (26.4, 2.6),
            (Self::Field, Linear, Parameter(U0)) => (1546.5, 7.8),
            (Self::Field, Linear, ReducedChi2) => (0.91, 0.44),
            _ => return None,
        };
        Some(Estimate::new(value, se))
    }
}

/// The law that a row of Table I or II belongs to. In files it stands by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TableLaw {
    /// The signed quadratic with all parameters free.
    #[serde(rename = "signed quadratic")]
    SignedQuadratic,
    /// The signed quadratic with A and u0 held at those of a reference.
    #[serde(rename = "signed quadratic, A and u0 held")]
    SignedQuadraticHeld,
    /// The calibration's own curve, shifted.
    #[serde(rename = "calibration's curve held")]
    CurveHeld,
    /// The straight line.
    #[serde(rename = "linear")]
    Linear,
    /// All laws: a row about the fits as a whole.
    #[serde(rename = "both laws")]
    Both,
}

impl TableLaw {
    /// Name of the law in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::SignedQuadratic => LawKind::SignedQuadratic.name(),
            Self::SignedQuadraticHeld => "signed quadratic, A and u0 held",
            Self::CurveHeld => "calibration's curve held",
            Self::Linear => LawKind::Linear.name(),
            Self::Both => "both laws",
        }
    }

    /// Form of the law; `None` for rows about all laws.
    pub fn kind(self) -> Option<LawKind> {
        match self {
            Self::SignedQuadratic | Self::SignedQuadraticHeld => Some(LawKind::SignedQuadratic),
            Self::Linear => Some(LawKind::Linear),
            Self::CurveHeld | Self::Both => None,
        }
    }
}

/// Subject of a row of Table I or II.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum Quantity {
    /// A parameter of the law.
    Parameter(Symbol),
    /// Chi² over the degrees of freedom.
    ReducedChi2,
    /// Scatter that was added to the windows' own noise ([`Laws::sigma_added_us`]).
    AddedScatter,
}

impl Quantity {
    const ALL: [Self; 6] = [
        Self::Parameter(Symbol::A),
        Self::Parameter(Symbol::Slope),
        Self::Parameter(Symbol::U0),
        Self::Parameter(Symbol::W),
        Self::ReducedChi2,
        Self::AddedScatter,
    ];

    /// Name of the quantity in files: the parameter's symbol, `chi2_nu` or `sigma_added`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter(symbol) => symbol.name(),
            Self::ReducedChi2 => "chi2_nu",
            Self::AddedScatter => "sigma_added",
        }
    }
}

impl From<Quantity> for &'static str {
    fn from(quantity: Quantity) -> Self {
        quantity.name()
    }
}

/// Error of a table in a file: a row is about an unknown quantity, with this name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{0}` is no parameter of a law, nor chi2_nu or sigma_added")]
pub struct UnknownQuantity(String);

impl TryFrom<String> for Quantity {
    type Error = UnknownQuantity;

    fn try_from(name: String) -> Result<Self, UnknownQuantity> {
        Self::ALL.into_iter().find(|known| known.name() == name).ok_or(UnknownQuantity(name))
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One row of Table I or II: a parameter over the fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TableRow {
    /// Law: `signed quadratic` or `linear`.
    #[schemars(with = "String")]
    pub law: TableLaw,
    /// Parameter symbol, or `chi2_nu`.
    #[schemars(with = "String")]
    pub parameter: Quantity,
    /// Unit.
    pub unit: String,
    /// Mean over drones.
    pub mean: f64,
    /// Standard deviation between drones.
    pub sd: f64,
    /// Mean of the drones' own standard errors.
    pub mean_se: f64,
    /// Drones.
    pub n: usize,
    /// The paper's value and error where it has one.
    pub paper: Option<Estimate>,
    /// Why the two are not to be compared; absent: they are, where the paper has a value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_compared: Option<String>,
}

/// Why a chi² of other weights is not compared.
const OTHER_CHI2: &str = "the paper weighs windows by the spread of their samples, which is no error of \
    a mean; ours (without --paper) is over their standard errors";

type FitOf = fn(&Laws) -> Option<&Fit>;

/// Statistics over the laws of drones, in the rows of Tables I and II. Without `paper`, nothing is
/// compared.
///
/// The paper's chi² counts the samples' standard deviation as the error of a window: it is compared
/// with ours only when the weights are the same ([`Weights::WindowSd`]).
///
/// Fits that ended at the edge of the searched range of W are left out, unless `with_edges` (as the paper's
/// table has them), and fits with laws of another vehicle held.
pub fn table(
    laws_of: &[&Laws],
    paper: Option<PaperTable>,
    options: &FitOptions,
    with_edges: bool,
) -> Vec<TableRow> {
    let FitOptions { weights, indicator, .. } = *options;
    let laws: [(TableLaw, FitOf); 3] = [
        (TableLaw::SignedQuadratic, |laws| laws.signed_quadratic.as_ref()),
        (TableLaw::SignedQuadraticHeld, Laws::of_own_vehicle),
        (TableLaw::Linear, |laws| laws.linear.as_ref()),
    ];
    let mut rows = Vec::new();
    for (law, fit_of) in laws {
        let within = |fit: &&Fit| with_edges || fit.w_beyond_mps.is_none();
        let fits: Vec<&Fit> = laws_of.iter().copied().filter_map(fit_of).filter(within).collect();
        let Some(first) = fits.first() else { continue };
        for (index, parameter) in first.parameters.iter().enumerate() {
            if parameter.held {
                continue;
            }
            let estimates: Vec<Estimate> =
                fits.iter().filter_map(|fit| Some(fit.parameters.get(index)?.estimate)).collect();
            let values: Vec<f64> = estimates.iter().map(|estimate| estimate.value).collect();
            let errors: Vec<f64> =
                estimates.iter().map(|estimate| estimate.se).filter(|se| *se > 0.0).collect();
            let quantity = Quantity::Parameter(parameter.name);
            rows.push(row(law, quantity, &parameter.unit, &values, &errors, paper));
        }
        let reduced: Vec<f64> = fits.iter().filter_map(|fit| fit.chi2_reduced).collect();
        if !reduced.is_empty() {
            let row = row(law, Quantity::ReducedChi2, "", &reduced, &[], paper);
            let other = row.paper.is_some() && weights != Weights::WindowSd;
            rows.push(TableRow { not_compared: other.then(|| OTHER_CHI2.to_owned()), ..row });
        }
    }
    let held = || laws_of.iter().filter_map(|laws| laws.held.as_ref()?.updraft);
    if held().next().is_some() {
        let (values, errors): (Vec<f64>, Vec<f64>) = held().map(|w| (w.value, w.se)).unzip();
        let (quantity, unit) = (Quantity::Parameter(Symbol::W), Symbol::W.unit(indicator));
        rows.push(row(TableLaw::CurveHeld, quantity, &unit, &values, &errors, paper));
    }
    let added: Vec<f64> = laws_of.iter().filter_map(|laws| laws.sigma_added_us).collect();
    if !added.is_empty() {
        let quantity = Quantity::AddedScatter;
        rows.push(row(TableLaw::Both, quantity, indicator.unit(), &added, &[], paper));
    }
    rows
}

fn row(
    law: TableLaw,
    quantity: Quantity,
    unit: &str,
    values: &[f64],
    errors: &[f64],
    paper: Option<PaperTable>,
) -> TableRow {
    let (mean, sd) = mean_sd(values);
    TableRow {
        law,
        parameter: quantity,
        unit: unit.to_owned(),
        mean,
        sd,
        mean_se: mean_sd(errors).0,
        n: values.len(),
        paper: paper.and_then(|paper| paper.value(law, quantity)),
        not_compared: None,
    }
}
