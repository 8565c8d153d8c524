//! Laws as they were fitted to windows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::fit_warning::FitWarning;
use super::hold::HeldCurve;
use super::kind::{LawKind, Symbol};
use crate::base::estimate::Estimate;

/// The laws fitted to one set of windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Laws {
    /// `u = A f(V - W) + u0`, f(x) = x|x|, W free.
    pub signed_quadratic: Option<Fit>,
    /// The same with A and u0 held from a reference, only W fitted.
    pub signed_quadratic_held: Option<Fit>,
    /// `u = A' V + u0`.
    pub linear: Option<Fit>,
    /// Scatter of the windows beyond their own measured noise, us: the standard deviation that was
    /// added to every window's error before the fits, chosen so that the better law's chi² became its
    /// degrees of freedom. It is turbulence longer than a window and what the law does not describe.
    /// `None` when the weights do not ask for it or there are no degrees of freedom.
    #[serde(default)]
    pub sigma_added_us: Option<f64>,
    /// The updraft with the calibration's own curve held, where a calibration was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<HeldCurve>,
}

/// A fitted law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Parameters in the law's order: `A`, `u0`, `W` or `A'`, `u0`.
    pub parameters: Vec<Parameter>,
    /// Covariance of the free parameters, row-major over all parameters (0 where held).
    pub covariance: Vec<f64>,
    /// Points fitted.
    pub points: usize,
    /// Sum of squared residuals over the windows' own errors, before any scatter was added to them
    /// ([`Laws::sigma_added_us`]).
    pub chi2: f64,
    /// That over the degrees of freedom; `None` without any. A statistic: nothing was tuned for it.
    pub chi2_reduced: Option<f64>,
    /// Probability of a chi² at least this large if the law and the sigmas are right.
    #[serde(default)]
    pub p_value: Option<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// Unweighted rms residual, us.
    pub rms_us: f64,
    /// Other local minima within a chi2 of 4 of the best: their parameters.
    pub other_minima: Vec<Vec<f64>>,
    /// What is doubtful about this fit.
    pub warnings: Vec<FitWarning>,
    /// The edge of the searched range of W where the fit ended, or that two standard errors of its W reach, m/s: W may
    /// lie beyond, and no parameter of the fit means anything. Absent: it ended within.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub w_beyond_mps: Option<f64>,
}

impl Fit {
    /// Parameter of the fit; `None` if its law does not have it.
    pub fn parameter(&self, symbol: Symbol) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == symbol)
    }

    /// Value of a parameter; `None` if the fit's law does not have it.
    pub fn value(&self, symbol: Symbol) -> Option<f64> {
        self.parameter(symbol).map(|parameter| parameter.estimate.value)
    }
}

/// One fitted or held parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// Symbol: `A`, `u0`, `W`, `A'`.
    #[schemars(with = "String")]
    pub name: Symbol,
    /// Unit: `us/(m/s)²`, `us`, `m/s`, `us/(m/s)`.
    pub unit: String,
    /// Value and standard error; the error is 0, and unknown, without degrees of freedom.
    pub estimate: Estimate,
    /// Held, not fitted.
    pub held: bool,
}

impl Laws {
    /// Fit with A and u0 held, if there is one and they are not those of another vehicle.
    pub fn of_own_vehicle(&self) -> Option<&Fit> {
        let is_other = self.held.as_ref().is_some_and(|held| held.is_other_vehicle);
        self.signed_quadratic_held.as_ref().filter(|_| !is_other)
    }

    /// Free fit of a law, if there is one.
    pub fn of(&self, law: LawKind) -> Option<&Fit> {
        match law {
            LawKind::Linear => self.linear.as_ref(),
            LawKind::SignedQuadratic => self.signed_quadratic.as_ref(),
        }
    }
}
