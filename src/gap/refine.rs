//! Sizes of what was named: a joint fit of all parameters in the noise's own metric.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::bins::Bin;
use super::candidates::set;
use super::compare::Comparison;
use super::error::GapError;
use super::generic::form_doubts;
use super::gls::{Column, Likelihood, Problem, Solution, Split, Start};
use super::noise::{GroupPattern, Hyper, SHARED, SHARED_TIME};
use super::pack;
use super::power_channel;
use super::response::shifted;
use super::scene::Scene;
use super::verdict::{Fitted, Interval};
use crate::effects::select::{acting, value_of};
use crate::effects::{Class, Definition, Role, Sought, find};
use crate::numeric::extent;
use crate::vehicle::Vehicle;

/// Rounds of Gauss-Newton; the forms are nearly linear in their sizes, and a fit ends when no size moves by
/// a twentieth of its error. Numerical.
const ROUNDS: usize = 8;
/// Step of the derivatives, share of a parameter's value or of its usual step. Numerical.
const STEP: f64 = 0.02;
/// A second parameter (the form) is fitted when its own z over the range that is tried is at least this: the
/// z of the threshold (docs/physics.md, 3.3).
const FORM_Z: f64 = 4.0;
/// Share of a change that its form is not known by: what closed forms, curves of charge and mean drones
/// leave out, whatever the noise. Measured: standard deviation over blind flights of high z.
const FORM_SHARE: f64 = 0.03;
/// Least factor of a 95 % interval: Student's with 18 degrees of freedom; longer flights are not believed to
/// know their air better. Chosen.
const INTERVAL: f64 = 2.1;
/// Air that all drones share which moves by less is calm, m/s. Chosen.
const CALM_MPS: f64 = 0.1;
/// Fewest time scales that a noise is believed to be estimated from: Student's factor is 3.2 there. Below it
/// intervals would be arbitrary.
const FEWEST_SCALES: f64 = 3.0;

/// One fitted parameter of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name of the effect.
    pub effect: &'static str,
    /// Name of the parameter.
    pub name: &'static str,
    /// Unit of the parameter.
    pub unit: &'static str,
    /// Smallest and largest value, in the parameter's unit.
    pub bounds: (f64, f64),
    /// Value in the model that was compared with the logs; `None` if it lacked the effect.
    pub before: Option<f64>,
}

/// A joint fit.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// The vehicle with the fitted values.
    pub vehicle: Vehicle,
    /// Parameters of the noise by restricted likelihood.
    pub noise: Start,
    /// Value and standard error of each parameter.
    pub values: Vec<(f64, f64)>,
}

impl Fit {
    /// The fit with the vehicle of a round before, and its values.
    fn back_to(self, vehicle: Vehicle, parameters: &[Parameter]) -> Self {
        let of = |(parameter, (_, se)): (&Parameter, &(f64, f64))| {
            (value_of(&vehicle, parameter.effect, parameter.name).unwrap_or(0.0), *se)
        };
        let values = parameters.iter().zip(&self.values).map(of).collect();
        Self { vehicle, values, ..self }
    }
}

/// What a round of the fit looks at.
struct Facing {
    patterns: Vec<GroupPattern>,
    split: Split,
    slopes: Vec<Column>,
    doubts: Vec<Column>,
}

impl Facing {
    fn of(
        comparison: &Comparison,
        vehicle: &Vehicle,
        (all, parameters): (&[Parameter], &[Parameter]),
        gusts_mps: f64,
    ) -> Result<Self, GapError> {
        Ok(Self {
            patterns: comparison.patterns(vehicle, gusts_mps)?,
            split: Split::of(&comparison.residual(vehicle, gusts_mps)?),
            slopes: slopes(comparison, vehicle, parameters)?,
            doubts: doubts(comparison, vehicle, all)?,
        })
    }
}

/// Fits the parameters jointly, from the values that the vehicle has, with further regressors free. What another channel
/// tells better than the pulse has that value.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn refine(
    comparison: &Comparison,
    vehicle: &Vehicle,
    parameters: &[Parameter],
    extras: &[Column],
    start: &Start,
    gusts_mps: f64,
    fit_noise: bool,
) -> Result<Fit, GapError> {
    let mut vehicle = vehicle.clone();
    let told = told_elsewhere(comparison, &mut vehicle, parameters);
    let free = parameters.iter().zip(&told).filter(|(_, told)| told.is_none());
    let free: Vec<Parameter> = free.map(|(parameter, _)| parameter.clone()).collect();
    let mut fit =
        refine_free(comparison, vehicle, (parameters, &free), extras, start, gusts_mps, fit_noise)?;
    let mut values = std::mem::take(&mut fit.values).into_iter();
    fit.values = told.iter().filter_map(|told| told.or_else(|| values.next())).collect();
    Ok(fit)
}

/// Values and standard errors of the parameters that another channel than the pulse tells, which the vehicle gets.
fn told_elsewhere(
    comparison: &Comparison,
    vehicle: &mut Vehicle,
    parameters: &[Parameter],
) -> Vec<Option<(f64, f64)>> {
    let mut of = |parameter: &Parameter| {
        sag_of(parameter)?;
        let told = power_channel::told(&comparison.data, drifts_otherwise(vehicle, parameter))?;
        let (low, high) = parameter.bounds;
        let exponent = told.exponent.clamp(low, high);
        flies_with(comparison, vehicle, parameter, exponent).then_some((exponent, told.se))
    };
    parameters.iter().map(&mut of).collect()
}

/// The effect of which a parameter is the voltage's exponent; `None`: it is another parameter.
fn sag_of(parameter: &Parameter) -> Option<&'static Definition> {
    let definition = find(parameter.effect)?.definition();
    let sag = definition.with_role(Role::BatterySag)?;
    (sag.name == parameter.name).then_some(definition)
}

/// Gives the vehicle a value unless it cannot fly with it.
fn flies_with(
    comparison: &Comparison,
    vehicle: &mut Vehicle,
    parameter: &Parameter,
    value: f64,
) -> bool {
    let mut other = vehicle.clone();
    set(&mut other, parameter.effect, parameter.name, value);
    let flies = comparison.scene_of(&other).pulses(&other).is_ok();
    if flies {
        *vehicle = other;
    }
    flies
}

/// Whether the vehicle has another effect than a parameter's that changes the pulse with time.
fn drifts_otherwise(vehicle: &Vehicle, parameter: &Parameter) -> bool {
    acting(vehicle).any(|effect| {
        let definition = effect.definition();
        definition.name != parameter.effect
            && definition.class == Class::TimeDrift
            && matches!(definition.sought, Sought::Shape { .. })
    })
}

/// Fits those of the parameters that are free.
fn refine_free(
    comparison: &Comparison,
    mut vehicle: Vehicle,
    (all, parameters): (&[Parameter], &[Parameter]),
    extras: &[Column],
    start: &Start,
    gusts_mps: f64,
    fit_noise: bool,
) -> Result<Fit, GapError> {
    let mut noise = start.clone();
    let mut last = None;
    let mut shifts: Vec<Vec<f64>> = Vec::new();
    let mut flown = vehicle.clone();
    for round in 0..ROUNDS {
        let Facing { mut patterns, split, slopes, doubts } =
            match Facing::of(comparison, &vehicle, (all, parameters), gusts_mps) {
                Ok(facing) => facing,
                // Too far: gusts or doubts take it where it cannot fly.
                Err(error) if error.is_not_flown() && last.is_some() => {
                    last = last.map(|fit: Fit| fit.back_to(flown, parameters));
                    break;
                }
                Err(error) => return Err(error),
            };
        flown.clone_from(&vehicle);
        for (pattern, shift_mps) in patterns.iter_mut().zip(std::mem::take(&mut shifts)) {
            pattern.shift_mps = shift_mps;
        }
        let problem = Problem::new(&patterns, &split).doubting(&doubts).with(extras).with(&slopes);
        let is_fitted = fit_noise && (round == 0 || round == 2);
        let solution = match is_fitted {
            true if round == 0 => fit_from_both(&problem, &noise),
            true => problem.fit(&noise, Likelihood::Restricted),
            false => problem.at(&noise.hyper),
        };
        if is_fitted {
            noise = Start::from(&solution);
        }
        shifts = shifted(&patterns, &problem, &solution).into_iter().map(|p| p.shift_mps).collect();
        let first = solution.beta.len() - parameters.len();
        let covariance = solution.covariance();
        let mut moved: f64 = 0.0;
        let mut values = Vec::new();
        for (index, parameter) in parameters.iter().enumerate() {
            let place = first + index;
            let se = covariance[(place, place)].max(0.0).sqrt();
            let now = value_of(&vehicle, parameter.effect, parameter.name).unwrap_or(0.0);
            let (low, high) = parameter.bounds;
            let farthest = (0.5 * now.abs()).max(0.05 * (high - low).min(1.0)).max(2.0 * se);
            let by = solution.beta[place].clamp(-farthest, farthest);
            let next = (now + by).clamp(low, high);
            moved = moved.max((next - now).abs() / se.max(1e-12));
            values.push((next, se));
            // A value that the vehicle cannot have stops there.
            flies_with(comparison, &mut vehicle, parameter, next);
        }
        last = Some(Fit { vehicle: vehicle.clone(), noise: noise.clone(), values });
        if moved < 0.05 && (round >= 2 || !fit_noise) {
            break;
        }
    }
    last.ok_or(GapError::NothingCommon)
}

/// Noise by restricted likelihood, from the present one. In calm air the noise that a model had to have before it knew what
/// was found now can be one that no small step makes likelier: so from the beginning, too, and the likelier is taken.
fn fit_from_both(problem: &Problem<'_>, start: &Start) -> Solution {
    let near = problem.fit(start, Likelihood::Restricted);
    if near.hyper.get(SHARED) > CALM_MPS || start.hyper == Hyper::default() {
        return near;
    }
    let anew = problem.fit(Hyper::default(), Likelihood::Restricted);
    if anew.log_posterior() > near.log_posterior() { anew } else { near }
}

/// What is not known exactly, as regressors of one standard deviation each: the updraft that each flight is in all over (that
/// of the first flight comes first), the wind, the vehicle's form, and the forms of effects of which only the size is fitted.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn doubts(
    comparison: &Comparison,
    vehicle: &Vehicle,
    parameters: &[Parameter],
) -> Result<Vec<Column>, GapError> {
    let mut doubts = comparison.updraft_doubts(vehicle)?;
    doubts.extend(comparison.wind_doubts(vehicle)?);
    doubts.extend(comparison.spread_doubts(vehicle)?);
    doubts.extend(form_doubts(&comparison.scene));
    for fitted in parameters.iter().filter(|fitted| fitted.before.is_none()) {
        let Some((form, sd)) =
            form_of(fitted).or_else(|| load_of(fitted, &comparison.scene, vehicle))
        else {
            continue;
        };
        let is_fitted = |one: &Parameter| (one.effect, one.name) == (form.effect, form.name);
        if parameters.iter().any(is_fitted) {
            continue;
        }
        let slopes = slopes(comparison, vehicle, &[form])?;
        doubts.extend(slopes.iter().map(|slope| slope.each(|g, d, b| sd * slope.at(g, d, b))));
    }
    Ok(doubts)
}

/// The form of an effect whose size this is, with what it is not known by: half the range that is tried.
fn form_of(size: &Parameter) -> Option<(Parameter, f64)> {
    let definition = find(size.effect)?.definition();
    let Sought::Shape { size: name, shape: Some((form, values)), .. } = &definition.sought else {
        return None;
    };
    if *name != size.name {
        return None;
    }
    let form = parameter(definition, form)?;
    if is_chosen(&form) {
        return None;
    }
    let (low, high) = extent(*values)?;
    Some((form, (high - low) / 2.0))
}

/// The fall of the voltage under load, by the resistance, where the sag is fitted.
fn load_of(size: &Parameter, scene: &Scene, vehicle: &Vehicle) -> Option<(Parameter, f64)> {
    let definition = sag_of(size)?;
    let resistance = definition.with_role(Role::BatteryResistance)?.name;
    let ohm = Role::BatteryResistance.value(vehicle)?;
    Some((parameter(definition, resistance)?, pack::load_doubt(scene) * ohm))
}

/// Whether a form is one of two, of which the search chooses: the size is that of the chosen one.
fn is_chosen(form: &Parameter) -> bool {
    let known = find(form.effect).and_then(|effect| effect.definition().parameter(form.name));
    known.and_then(|known| known.role).is_some_and(Role::is_choice)
}

/// Derivatives of the model's pulse by each parameter.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn slopes(
    comparison: &Comparison,
    vehicle: &Vehicle,
    parameters: &[Parameter],
) -> Result<Vec<Column>, GapError> {
    let mut columns = Vec::new();
    for parameter in parameters {
        let now = value_of(vehicle, parameter.effect, parameter.name).unwrap_or(0.0);
        let (low, high) = parameter.bounds;
        let mut by = STEP * now.abs().max(0.02 * (high - low).min(1.0));
        if now + by > high {
            by = -by;
        }
        let mut other = vehicle.clone();
        set(&mut other, parameter.effect, parameter.name, now + by);
        let change = comparison.change(vehicle, &other)?;
        let per_unit = 1.0 / by;
        columns.push(change.each(|group, drone, bin| change.at(group, drone, bin) * per_unit));
    }
    Ok(columns)
}

/// Parameters of an effect that is named: its size, and its form where the flight tells it.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn parameters_of(
    comparison: &Comparison,
    vehicle: &Vehicle,
    effect: &str,
    before: Option<f64>,
    base: &Solution,
) -> Result<Vec<Parameter>, GapError> {
    let Some(known) = find(effect) else { return Ok(Vec::new()) };
    let definition = known.definition();
    let (size, shape) = match &definition.sought {
        Sought::Shape { size, shape, .. } => (*size, shape),
        Sought::No(_) => match definition.with_role(Role::MomentumDrag) {
            Some(parameter) => (parameter.name, &None),
            None => return Ok(Vec::new()),
        },
    };
    let of = |name: &str| parameter(definition, name);
    let mut found: Vec<Parameter> =
        of(size).map(|parameter| Parameter { before, ..parameter }).into_iter().collect();
    if let Some((name, values)) = shape
        && let Some(parameter) = of(name).filter(|form| !is_chosen(form))
    {
        let both = [found.clone(), vec![parameter.clone()]].concat();
        let columns = slopes(comparison, vehicle, &both)?;
        if let [size, form] = &columns[..] {
            // What the form says beyond the size, over the range that is tried.
            let (size, form) = (base.white(size), base.white(form));
            let alike = base.likeness(&size, &form);
            let information = base.information(&form) * (1.0 - alike * alike).max(0.0);
            let (low, high) = extent(*values).unwrap_or_default();
            if information.sqrt() * (high - low) > FORM_Z {
                found.push(parameter);
            }
        }
    }
    Ok(found)
}

/// The size of an effect as a parameter; `None`: steady flight does not show it.
pub(super) fn size_of(effect: &str, size: &str) -> Option<Parameter> {
    let definition = find(effect)?.definition();
    let Sought::Shape { .. } = &definition.sought else { return None };
    parameter(definition, size)
}

/// One parameter of an effect, of which nothing is known.
fn parameter(definition: &Definition, name: &str) -> Option<Parameter> {
    let known = definition.parameters.iter().find(|known| known.name == name)?;
    Some(Parameter {
        effect: definition.name,
        name: known.name,
        unit: known.unit,
        bounds: (known.low, known.high),
        before: None,
    })
}

/// Standard errors of the shares of what is known to be there, each by its trace in the pulse, with everything else free;
/// `parameters` are the sizes of the effects among them.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn trace_errors(
    comparison: &Comparison,
    vehicle: &Vehicle,
    parameters: &[Parameter],
    traces: &[Column],
) -> Result<Vec<f64>, GapError> {
    let patterns = comparison.patterns(vehicle, 0.0)?;
    let split = Split::of(&comparison.residual(vehicle, 0.0)?);
    let doubts = doubts(comparison, vehicle, parameters)?;
    let problem = Problem::new(&patterns, &split).doubting(&doubts).with(traces);
    let solution = problem.fit(Hyper::default(), Likelihood::Restricted);
    let covariance = solution.covariance();
    let first = solution.beta.len() - traces.len();
    let se = |place: usize| covariance[(place, place)].max(0.0).sqrt();
    Ok((first..first + traces.len()).map(se).collect())
}

/// Standard errors in half of a 95 % interval: the strength of the shared air is estimated from as many
/// pieces as its time scale goes into the flight, so Student's law with so many degrees of freedom.
pub(super) fn half_interval(comparison: &Comparison, hyper: &Hyper) -> f64 {
    let times = comparison.data.groups.iter().flat_map(|group| &group.bins).map(Bin::middle_s);
    let (first, last) = extent(times).unwrap_or_default();
    let scales = ((last - first) / hyper.get(SHARED_TIME)).max(FEWEST_SCALES);
    StudentsT::new(0.0, 1.0, scales).map_or(INTERVAL, |law| law.inverse_cdf(0.975).max(INTERVAL))
}

/// Fitted values with their intervals of so many standard errors to each side, for the verdict.
pub(super) fn fitted(
    parameters: &[Parameter],
    values: &[(f64, f64)],
    half_interval: f64,
) -> Vec<Fitted> {
    let one = |(parameter, (value, se)): (&Parameter, &(f64, f64))| {
        let (low, high) = parameter.bounds;
        let se = se.hypot(FORM_SHARE * (value - parameter.before.unwrap_or(0.0)));
        Fitted {
            name: parameter.name.to_owned(),
            unit: parameter.unit.to_owned(),
            value: Interval {
                value: *value,
                low: (value - half_interval * se).max(low),
                high: (value + half_interval * se).min(high),
            },
            before: parameter.before,
        }
    };
    parameters.iter().zip(values).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;

    #[test]
    fn a_sag_that_is_fitted_doubts_what_the_voltage_falls_by_under_load() {
        let comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let mut vehicle = trial::vehicle();
        set(&mut vehicle, "battery", "exponent", 0.8);
        let sag = parameter(find("battery").unwrap().definition(), "exponent").unwrap();
        let without = doubts(&comparison, &vehicle, &[]).unwrap().len();
        let fitted = doubts(&comparison, &vehicle, &[sag]).unwrap();
        assert_eq!(fitted.len(), without + 1);
        // Half of 0.05 ohm steepens the response: who climbs takes more current than who descends.
        let bins = &comparison.data.groups[0].bins;
        let at = |climb_mps: f64| {
            let bin = bins.iter().position(|bin| bin.climb_mps() == climb_mps).unwrap();
            fitted[without].at(0, 0, bin)
        };
        assert!(at(2.0) > at(-2.0) && at(-2.0) > 0.0, "{} and {}", at(2.0), at(-2.0));
    }

    #[test]
    fn noise_is_fitted_on_by_the_curvature_that_was_found() {
        let data = trial::data(3, |drone, bin| {
            0.3 * f64::from((5 * bin.segment as i32 + drone as i32) % 3 - 1)
        });
        let comparison = trial::comparison(&data);
        let fitted = |start: &Start| {
            refine(&comparison, &trial::vehicle(), &[], &[], start, 0.0, true).unwrap().noise
        };
        let first = fitted(&Start::default());
        assert_ne!(first, Start::from(first.hyper), "it knows how the likelihood bends");
        let again = fitted(&first);
        let moved = again.hyper.0.iter().zip(&first.hyper.0).map(|(a, b)| (a - b).abs());
        assert!(moved.fold(0.0, f64::max) < 0.3, "it was there: {again:?} {first:?}");
    }

    #[test]
    fn a_sag_has_the_exponent_that_the_logged_power_tells() {
        let data = power_channel::tests::flown(0.6, 0.0, 0.1, power_channel::tests::motors);
        let comparison = trial::comparison(&data);
        let mut vehicle = trial::vehicle();
        set(&mut vehicle, "battery", "exponent", 0.2);
        let battery = find("battery").unwrap().definition();
        let of = |name: &str| parameter(battery, name).unwrap();
        let fitted = |parameters: &[Parameter]| {
            refine(&comparison, &vehicle, parameters, &[], &Start::default(), 0.0, false).unwrap()
        };
        let fit = fitted(&[of("exponent")]);
        let [(exponent, se)] = fit.values[..] else { panic!("{:?}", fit.values) };
        assert!((exponent - 0.6).abs() < 0.01 && se < 0.03, "{exponent} {se}");
        assert_eq!(value_of(&fit.vehicle, "battery", "exponent"), Some(exponent));
        // Others beside it are fitted, and stay in their places.
        let fit = fitted(&[of("resistance_ohm"), of("exponent")]);
        assert_eq!(fit.values.len(), 2);
        assert!((fit.values[1].0 - 0.6).abs() < 0.01, "{:?}", fit.values);
        // Without a current there is nothing else than the pulse.
        let mut data = data;
        for values in data.groups.iter_mut().flat_map(|group| group.measured.iter_mut().flatten()) {
            values.power_w = f64::NAN;
        }
        let told = told_elsewhere(&trial::comparison(&data), &mut vehicle, &[of("exponent")]);
        assert_eq!(told, [None]);
        assert_eq!(value_of(&vehicle, "battery", "exponent"), Some(0.2));
    }
}
