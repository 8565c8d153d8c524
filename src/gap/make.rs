//! Steps from logs to a verdict and a model.

use super::bins::Bin;
use super::compare::{Comparison, Simulated, amsl_m, lean_law};
use super::data::{Data, Flown, constant_us};
use super::dependence::Dependence;
use super::detectable::detectable;
use super::drones::drones;
use super::error::GapError;
use super::explain::{Found, Options};
use super::heldout::same_bins;
use super::kept::{Question, grows};
use super::lean::mean_wind;
use super::left_out::LeftOut;
use super::model_flights::ModelFlights;
use super::noise::{
    GRADIENT, GUST_TIME, GUSTS, LEAST, OFFSETS, OWN, PULSE_NOISE, SHARED, SHARED_TIME, SIDE_GUSTS,
    SLOPES, WHITE,
};
use super::other_plan::without_strangers;
use super::refine::Parameter;
use super::refly::mean_drone;
use super::regimes::regimes;
use super::sensor::sensor;
use super::stand_in::{as_in_file, read_from_logs, stand_in};
use super::verdict::{
    DataUsed, Drones, Finding, Fitted, Gap, Interval, Noise, Regime, Rung, SensorChannel, Step,
    VERDICT_SCHEMA, Verdict, WindFound, is_strong_wind,
};
use super::warning::{Warning, warnings};
use super::words::summary;
use crate::effects::Role;
use crate::effects::select;
use crate::flight::table::Steps;
use crate::mission::plan::Plan;
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Input of a comparison of measurement and simulation.
#[derive(Debug)]
pub struct Input<'a> {
    /// Model that the logs are compared with.
    pub vehicle: &'a Vehicle,
    /// Plan that was flown, if there is one.
    pub plan: Option<&'a Plan>,
    /// Logs of the drones.
    pub flown: &'a [Flown<'a>],
    /// Logs of another program's simulation; `None`: the plan is simulated.
    pub simulated: Option<&'a [Flown<'a>]>,
    /// Rules for finding steady flight in tables, which have neither plan nor commands: they are
    /// compared with the model's closed forms at the climb that was flown.
    pub table: Option<&'a Steps>,
    /// Number of measured logs, used or not.
    pub logs: usize,
    /// Logs that could not be used, with their reasons.
    pub left_out: Vec<LeftOut>,
}

/// A verdict with the model that it leads to.
#[derive(Clone, Debug)]
pub struct Explained {
    /// Verdict on what the model lacks.
    pub verdict: Verdict,
    /// Vehicle with the effects that were found, as a vehicle file has it.
    pub model: Vehicle,
    /// Findings of the search, for later steps.
    pub found: Found,
}

/// Climb speeds of one rung of the ladder differ by less, m/s. Commands are exact; rungs are 0.5 m/s apart.
const SAME_SPEED_MPS: f64 = 0.05;

/// Compares, names effects, adds them and reports the verdict.
///
/// # Errors
/// See [`GapError`].
pub fn explain(input: &Input<'_>, options: &Options) -> Result<Explained, GapError> {
    let exponent = super::compare::thrust_exponent(input.vehicle);
    let mut data = match input.plan {
        Some(plan) => {
            let (own, strangers) = without_strangers(plan, input.flown, input.simulated)?;
            let mut data = Data::of_plan(plan, &own, exponent);
            data.left_out.extend(strangers);
            data
        }
        None => Data::of_logs(input.flown, input.table, exponent),
    };
    if data.drones() == 0 {
        return Err(GapError::NothingMeasured { reasons: data.left_out });
    }
    let constant = data.drop_constant(exponent);
    if let (0, Some(value_us)) = (data.drones(), constant) {
        return Err(GapError::ConstantPulse { value_us });
    }
    let data = data.settled();
    let stood_in: Vehicle;
    let mut vehicle = input.vehicle;
    let simulated = match (input.simulated, input.plan) {
        (Some(flown), _) => {
            let values = data.averaged(flown, exponent);
            if let Some(value_us) = constant_us(values.iter().flatten().flatten(), exponent) {
                return Err(GapError::ConstantSimulated { value_us });
            }
            stood_in = stand_in(&data, &values, input.vehicle, input.plan)?;
            vehicle = &stood_in;
            Simulated::Given { values, flew: vehicle, is_foreign: true }
        }
        (None, Some(plan)) => Simulated::Refly(plan),
        (None, None) if input.table.is_some() => Simulated::Closed,
        (None, None) => return Err(GapError::NoSimulatedSide),
    };
    let (train, held) = data.split();
    let mut channel = match input.plan {
        Some(plan) => sensor(input.flown, |slot| plan.slot(slot).map(|slot| plan.segments(slot))),
        None => SensorChannel::default(),
    };
    // A sensor that is off is repaired first: the pulse is then compared at the right speeds. So is a
    // lean that is off: the pulse is then compared in the right wind, at the right tilt.
    let before = Comparison::new(&data, vehicle, &simulated, input.plan)
        .map_err(|error| of_read_wind(error, &data, vehicle, input.plan))?;
    let wind = super::lean_channel::found(&before);
    let mut leans = super::lean_channel::step(&before, &wind, options.alpha);
    let mut repaired = repaired(vehicle, &channel);
    if channel.named {
        // What is late may be the log alone: then the model must not be made late. So it is where no drone could have flown
        // the plan with such an error in its loop.
        let is_nearer = match Comparison::new(&data, &repaired, &simulated, input.plan) {
            Err(error) if error.is_not_flown() => false,
            late => late?.raw_gap_us()? <= before.raw_gap_us()?,
        };
        if !is_nearer {
            channel.in_log = true;
            repaired = vehicle.clone();
        }
    }
    let answered = |repaired: &Vehicle, leans: &[Step]| {
        let mut repaired = repaired.clone();
        add_others(&mut repaired, leans);
        add_bodies(&mut repaired, leans);
        let question = Question {
            original: vehicle,
            repaired: &repaired,
            simulated: &simulated,
            plan: input.plan,
            options,
            flights: &ModelFlights::default(),
        };
        question.answered(&train, &held)
    };
    let (mut found, mut shrink) = match answered(&repaired, leans.as_slice()) {
        Err(error) if error.is_not_flown() && channel.named && !channel.in_log => {
            channel.in_log = true;
            answered(vehicle, leans.as_slice())?
        }
        answered => answered?,
    };
    if is_only_in_log(&channel, &shrink) {
        channel.in_log = true;
        (found, shrink) = answered(vehicle, leans.as_slice())?;
    }
    if grows(&shrink)
        && let Some(step) = &leans
    {
        // The drag that no lean tells from this one can change the pulse in another way: then the model goes without, and the pulse
        // is searched again.
        match answered(if channel.in_log { vehicle } else { &repaired }, &[]) {
            Ok((without, gap)) if !grows(&gap) => {
                leans = Some(super::lean_channel::not_taken_in(step));
                (found, shrink) = (without, gap);
            }
            Err(error) if !error.is_not_flown() => return Err(error),
            _ => {}
        }
    }
    if shrink.left_over().is_some() {
        super::single::beside_what_nothing_explains(&mut found.steps);
    }
    let (plan, updraft_mps) = (input.plan, found.updraft_mps);
    let whole =
        Comparison::of(&data, &found.vehicle, &simulated, plan, updraft_mps, Some(&before))?
            .feeling(&found.felt)
            .spread_as(vehicle);
    if held.drones() > 0 && !found.parameters.is_empty() && found.extras.is_empty() {
        // The sizes that go into the model are those of all drones.
        found.refit(&whole)?;
        super::explain::settle(&mut found);
    }
    // Between two simulations sets of effects were held against each other.
    if let Some(raw) = shrink.drones.or(shrink.rungs).filter(|_| !whole.is_foreign()) {
        super::single::undone_by_another(&mut found.steps, raw.before_us.value);
    }
    super::in_field::tell(&mut found, vehicle)?;
    super::explain::form::tell(&mut found.steps, &found.vehicle);
    // The map of disagreement is drawn in the air that was found.
    let before = if updraft_mps == 0.0 {
        before
    } else {
        Comparison::of(&data, vehicle, &simulated, plan, updraft_mps, Some(&before))?
    };
    let before = same_bins(&before, &whole);
    let held_slots: Vec<u16> = held.groups.iter().flat_map(|group| group.slots.clone()).collect();
    let mut left_out = input.left_out.clone();
    left_out.extend(data.left_out.iter().cloned());
    let used = DataUsed {
        logs: input.logs,
        logs_sha256: String::new(),
        drones: data.drones(),
        groups: data.groups.iter().map(|g| (g.name.clone(), g.slots.len())).collect(),
        bins: whole.data.groups.iter().map(|group| group.bins.len()).collect(),
        held_out: held_slots.clone(),
        left_out,
    };
    let (differences, spread) = if found.extras.is_empty() {
        drones(&whole, &found, vehicle, |slot| held_slots.contains(&slot))?
    } else {
        (Drones::default(), None)
    };
    let mut steps = found.steps.clone();
    super::explain::telling::unknowns_once(&mut steps);
    steps.extend(spread);
    // Momentum drag on all axes took the place of what the leans told, or the pulse named the same body.
    let of_body = leans.as_ref().and_then(|step| step.finding.effects().first().copied());
    let of_body = of_body.filter(|first| Role::BodyDragTop.is_of(first)).map(str::to_owned);
    if let Some(body) = of_body.as_deref().filter(|_| !Role::BodyDragTop.is_on(vehicle)) {
        as_new(&mut steps, body);
    }
    let instead = |one: &Parameter| {
        Role::MomentumDrag.is_of(one.effect) || of_body.as_deref() == Some(one.effect)
    };
    let leans = leans.filter(|_| !found.parameters.iter().any(instead));
    super::single::beside_what_leans_tell(&mut steps, leans.as_ref());
    steps.extend(leans);
    let mut cautions = warnings(&data, &found, &shrink, input);
    as_in_file(&mut steps, vehicle, input.vehicle);
    if let Some((place, value)) = read_from_logs(vehicle, input.vehicle) {
        let (effect, parameter) = (place.name().to_owned(), place.parameter.name.to_owned());
        cautions.push(Warning::StandIn { effect, parameter, value });
    }
    let mut verdict = Verdict {
        schema: VERDICT_SCHEMA.to_owned(),
        made_by: concat!("updraft ", env!("CARGO_PKG_VERSION")).to_owned(),
        vehicle: input.vehicle.name.clone(),
        summary: String::new(),
        data: used,
        sensor: channel,
        steps,
        rest: found.rest.clone(),
        detectable: detectable(&found)?,
        noise: noise(&found)?,
        // As it is read with what was found: a drag that the model lacked looked like more wind before.
        wind: WindFound { mean_mps: whole.wind.mean_mps, ..wind },
        drones: differences,
        gap: shrink,
        map: None,
        regimes: regimes(&before, &same_bins(&whole, &before), &found, options.seed)?,
        ladder: Vec::new(),
        cautions,
    };
    verdict.ladder = ladder(&whole.data, &verdict.regimes);
    verdict.summary = summary(&verdict);
    let mut model = model(vehicle, &found, &verdict.steps);
    if verdict.sensor.named && !verdict.sensor.in_log {
        model = self::repaired(&model, &verdict.sensor);
    }
    Ok(Explained { verdict, model, found })
}

/// Why the model cannot fly, where that may be the wind that its drag says without being told.
fn of_read_wind(error: GapError, data: &Data, vehicle: &Vehicle, plan: Option<&Plan>) -> GapError {
    let law = lean_law(&mean_drone(vehicle), amsl_m(plan), 0.0);
    let wind_mps = mean_wind(data, law, None);
    if data.has_legs() || !error.is_not_flown() || !is_strong_wind(wind_mps) {
        return error;
    }
    error.in_read_wind(wind_mps[0].hypot(wind_mps[1]))
}

fn noise(found: &Found) -> Result<Noise, GapError> {
    let hyper = &found.noise.hyper;
    Ok(Noise {
        shared_air_mps: hyper.get(SHARED),
        shared_air_s: hyper.get(SHARED_TIME),
        own_air_mps: hyper.get(OWN),
        gusts_mps: hyper.get(GUSTS),
        gusts_s: hyper.get(GUST_TIME),
        white_us: hyper.get(WHITE),
        drones_us: hyper.get(OFFSETS),
        slopes: hyper.get(SLOPES),
        least_response: hyper.get(LEAST),
        gradient_mps: hyper.get(GRADIENT),
        side_gusts_mps: hyper.get(SIDE_GUSTS),
        pulse_noise_us: hyper.get(PULSE_NOISE),
        updraft_mps: found.updraft_mps,
        updraft_half_mps: super::updraft_error::half_mps(found)?,
    })
}

/// Measured pulses of each climb speed, and the models' by the residuals of its regime.
fn ladder(data: &Data, regimes: &[Regime]) -> Vec<Rung> {
    let pulses = |climb_mps: f64| -> Vec<f64> {
        let of_rung = |bin: &Bin| {
            !bin.is_horizontal() && (bin.climb_mps() - climb_mps).abs() < SAME_SPEED_MPS
        };
        let drones = data
            .groups
            .iter()
            .flat_map(|group| group.measured.iter().map(move |drone| group.bins.iter().zip(drone)));
        drones
            .flatten()
            .filter(|(bin, _)| of_rung(bin))
            .map(|(_, values)| values.pulse_us)
            .collect()
    };
    let rungs = regimes.iter().filter(|regime| regime.by == Dependence::Climb);
    rungs
        .filter_map(|rung| {
            let pulses = pulses(rung.x);
            let measured_us = mean(&pulses)?;
            measured_us.is_finite().then_some(Rung {
                climb_mps: rung.x,
                measured_us,
                before_us: measured_us - rung.before_us.0,
                after_us: measured_us - rung.after_us,
                se_us: rung.before_us.1,
            })
        })
        .collect()
}

/// The vehicle file with what was found; what makes drones differ stays as it was.
fn model(vehicle: &Vehicle, found: &Found, steps: &[Step]) -> Vehicle {
    let mut model = vehicle.clone();
    for parameter in &found.parameters {
        let Some(table) = found.vehicle.effects.get(parameter.effect) else { continue };
        let entry = model.effects.entry(parameter.effect.to_owned()).or_default();
        entry.on = true;
        for (name, value) in &table.parameters {
            entry.parameters.insert(name.clone(), *value);
        }
        // The spread between drones that the mean drone was flown without.
        if let Some(spread) =
            vehicle.effects.get(parameter.effect).and_then(|t| t.parameters.get("spread"))
        {
            entry.parameters.insert("spread".to_owned(), *spread);
        }
    }
    if !found.parameters.is_empty() {
        model.name = format!("{}-found", vehicle.name);
        let names: Vec<&str> = found.parameters.iter().map(|parameter| parameter.effect).collect();
        model.source =
            format!("{}; {} found in measured flights", vehicle.source, names.join(", "));
    }
    add_others(&mut model, steps);
    if !found.parameters.iter().any(|one| Role::BodyDragTop.is_of(one.effect)) {
        add_bodies(&mut model, steps);
    }
    model
}

/// Whether an error of the velocity that was taken into the model's loop is the log's alone after all. Which of the two it
/// is was asked in still air; if in the air that was found the model with the error is farther from the logs, its loop
/// has none.
fn is_only_in_log(channel: &SensorChannel, gap: &Gap) -> bool {
    channel.named && !channel.in_log && grows(gap)
}

/// The vehicle with the error of its vertical velocity, where that was named.
fn repaired(vehicle: &Vehicle, channel: &SensorChannel) -> Vehicle {
    let mut vehicle = vehicle.clone();
    if channel.named {
        let of = |interval: Option<Interval>| interval.map_or(0.0, |interval| interval.value);
        Role::SensorBias.set(&mut vehicle, of(channel.bias_mps).clamp(-2.0, 2.0));
        Role::SensorLag.set(&mut vehicle, of(channel.lag_s).clamp(0.0, 1.0));
        if let Some(place) = Role::SensorBias.place() {
            // What is told is the fleet's: drones do not differ in it.
            let spreads = place.effect.definition().parameters.iter();
            for spread in spreads.filter(|spread| spread.role.is_some_and(Role::is_spread)) {
                select::set(&mut vehicle, place.name(), spread.name, 0.0);
            }
        }
    }
    vehicle
}

/// The body that the leans told, until the pulse tells its top.
fn add_bodies(model: &mut Vehicle, steps: &[Step]) {
    for step in steps {
        let (Some(first), Finding::Class { parameters, .. }) =
            (step.finding.effects().first().copied(), &step.finding)
        else {
            continue;
        };
        for role in [Role::BodyDragTop, Role::BodyDragSide] {
            let is_it = |one: &&Fitted| {
                role.place()
                    .is_some_and(|place| place.name() == first && place.parameter.name == one.name)
            };
            if let Some(area) = parameters.iter().find(is_it) {
                role.set(model, area.value.value);
            }
        }
    }
}

/// Tells an effect as new that the model got from the leans before the pulse was searched.
fn as_new(steps: &mut [Step], effect: &str) {
    for step in steps {
        if step.finding.effects().first() != Some(&effect) {
            continue;
        }
        if let Finding::Name { was_there, .. } = &mut step.finding {
            *was_there = false;
        }
        if let Finding::Name { parameters, .. } | Finding::Class { parameters, .. } =
            &mut step.finding
        {
            for one in parameters {
                one.before = None;
            }
        }
    }
}

/// What is told from other channels than the fleet's pulse: what makes drones differ, by their
/// offsets; the drag of the rotors, by the lean.
fn add_others(model: &mut Vehicle, steps: &[Step]) {
    for step in steps {
        let effects = step.finding.effects();
        let (Some(first), Finding::Name { parameters, .. } | Finding::Class { parameters, .. }) =
            (effects.first(), &step.finding)
        else {
            continue;
        };
        for role in [Role::RotorDrag, Role::MassSpread, Role::ThrustSpread] {
            if let Some(place) = role.place().filter(|place| place.name() == *first)
                && let Some(size) = parameters.first()
            {
                role.set(model, size.value.value.min(place.parameter.high));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::super::verdict::Shrink;
    use super::*;
    use crate::flight::{Flight, Series};
    use crate::gap::bins::BinValues;
    use crate::sim::SimError;

    #[test]
    fn a_body_that_leans_told_is_round_and_new() {
        let area = |name: &str, value: f64| Fitted {
            name: name.to_owned(),
            unit: "m²".to_owned(),
            value: Interval { value, low: 0.0, high: 1.0 },
            before: None,
        };
        let parameters = vec![area("vertical_m2", 0.03), area("horizontal_m2", 0.03)];
        let effects = vec!["parasitic-drag".to_owned(), "face-drag".to_owned()];
        let told = trial::step(Finding::Class { effects, parameters }, 20.0, &[]);
        let mut model = trial::vehicle();
        model.effects.clear();
        let areas =
            |model: &Vehicle| [Role::BodyDragTop, Role::BodyDragSide].map(|role| role.value(model));
        let known = model.clone();
        add_bodies(&mut model, std::slice::from_ref(&told));
        assert_eq!(areas(&model), [Some(0.03), Some(0.03)]);
        // The model that is written has it though the pulse told nothing of it.
        let mut found = Found::nothing(trial::comparison(&trial::data(2, |_, _| 0.0)));
        found.vehicle = model;
        let steps = [told];
        assert_eq!(areas(&super::model(&known, &found, &steps)), [Some(0.03), Some(0.03)]);
        // What the pulse was fitted with stays.
        found.parameters.extend(crate::gap::refine::size_of("parasitic-drag", "vertical_m2"));
        Role::BodyDragTop.set(&mut found.vehicle, 0.02);
        assert_eq!(areas(&super::model(&known, &found, &steps)), [Some(0.02), Some(0.03)]);
        let before = Fitted { before: Some(0.03), ..area("vertical_m2", 0.02) };
        let again = Finding::Name {
            effect: "parasitic-drag".to_owned(),
            parameters: vec![before.clone()],
            was_there: true,
        };
        let effects = vec!["parasitic-drag".to_owned(), "thrust-curve".to_owned()];
        let class = Finding::Class { effects, parameters: vec![before] };
        let mut steps = [again, class].map(|finding| trial::step(finding, 20.0, &[]));
        as_new(&mut steps, "parasitic-drag");
        let Finding::Name { parameters, was_there, .. } = &steps[0].finding else { panic!() };
        assert!(!was_there && parameters[0].before.is_none());
        let Finding::Class { parameters, .. } = &steps[1].finding else { panic!() };
        assert!(parameters[0].before.is_none());
    }

    /// Logs of a small fleet that flies as its model says, and what the held-out drones have more in their
    /// pulses, us by m/s of climb.
    fn logs(drones: usize, held_us_per_mps: f64) -> Vec<Flight> {
        let data = trial::data(drones, |drone, bin: &Bin| {
            let is_held = drone % 4 == 2;
            drone as f64 + if is_held { held_us_per_mps * bin.climb_mps() } else { 0.0 }
        });
        let group = &data.groups[0];
        let log = |values: &Vec<BinValues>| {
            let mut flight = Flight::default();
            let (mut pulse, mut climb) = (Series::default(), Series::default());
            for (bin, values) in group.bins.iter().zip(values) {
                for tick in 0..30 {
                    // Steps of 12 s: the transients are cut off.
                    let start_s =
                        12.0 * bin.segment as f64 + 6.0 * f64::from(bin.start_s as i32 % 10 / 3);
                    let time_s = start_s + 0.2 * f64::from(tick);
                    for (series, value) in
                        [(&mut pulse, values.pulse_us), (&mut climb, values.climb_mps)]
                    {
                        series.time_s.push(time_s);
                        series.value.push(value);
                    }
                }
            }
            let flat = |value: f64| Series {
                time_s: pulse.time_s.clone(),
                value: vec![value; pulse.time_s.len()],
            };
            flight.height_m = flat(30.0);
            (flight.roll_rad, flight.pitch_rad) = (flat(0.0), flat(0.0));
            flight.pulse_limits_us = (1100.0, 1950.0);
            flight.pulse_max_us = pulse.clone();
            flight.pulse_min_us = pulse.clone();
            flight.armed_s = vec![(0.0, 200.0)];
            flight.effort.values = pulse;
            flight.velocity_up_mps = climb;
            flight
        };
        group.measured.iter().map(log).collect()
    }

    fn explained(held_us_per_mps: f64) -> Explained {
        let flights = logs(8, held_us_per_mps);
        let flown: Vec<Flown<'_>> =
            flights.iter().zip(1..).map(|(flight, slot)| Flown { slot, flight }).collect();
        let vehicle = trial::vehicle();
        let input = Input {
            vehicle: &vehicle,
            plan: None,
            flown: &flown,
            simulated: None,
            table: Some(&Steps::default()),
            logs: flown.len(),
            left_out: Vec::new(),
        };
        let options = Options { replicates: 0, most_steps: 0, ..Options::default() };
        explain(&input, &options).unwrap()
    }

    #[test]
    fn a_model_that_cannot_fly_in_the_wind_that_only_leans_tell_says_so() {
        let told = |lean_rad: f64, legs_mps: &[f64]| {
            let mut data = trial::data(2, |_, _| 0.0);
            let values = data.groups[0].measured.iter_mut().flatten();
            values.for_each(|values| values.lean_rad = [lean_rad, 0.0]);
            for (bin, leg_mps) in data.groups[0].bins.iter_mut().zip(legs_mps) {
                bin.velocity_mps = [*leg_mps, 0.0, 0.0];
            }
            let error = GapError::from(SimError::Diverged { drone: 6, time_s: 20.0 });
            of_read_wind(error, &data, &trial::vehicle(), None).to_string()
        };
        let text = told(0.15, &[]);
        assert!(
            text.starts_with("the model cannot fly in the ") && text.contains("legs"),
            "{text}"
        );
        assert_eq!(told(0.15, &[4.0, -4.0]), "the model's flight failed", "legs tell the wind");
        assert_eq!(told(0.15, &[4.0]), text, "one does not");
        assert_eq!(told(0.01, &[]), "the model's flight failed", "hardly any wind");
    }

    #[test]
    fn what_held_out_drones_do_moves_the_gap_and_never_the_fit() {
        let (clean, poisoned) = (explained(0.0), explained(6.0));
        assert_eq!(poisoned.verdict.data.held_out, [3, 7]);
        assert_eq!(
            poisoned.found.noise.hyper, clean.found.noise.hyper,
            "the noise is that of the others"
        );
        assert_eq!(poisoned.verdict.rest, clean.verdict.rest, "so is what is left to be found");
        let gap = |explained: &Explained| explained.verdict.gap.drones.unwrap().before_us.value;
        assert!(gap(&clean) < 1.0, "{}", gap(&clean));
        assert!(gap(&poisoned) > 5.0, "{}", gap(&poisoned));
    }

    #[test]
    fn an_error_of_the_velocity_that_makes_the_gap_larger_is_the_logs_alone() {
        let us = |value: f64| Interval { value, low: value, high: value };
        let gap = |after_us: f64| {
            let (before_us, after_us) = (us(20.0), us(after_us));
            Gap { drones: Some(Shrink { before_us, after_us, ..Shrink::default() }), rungs: None }
        };
        let late = SensorChannel { named: true, ..SensorChannel::default() };
        assert!(is_only_in_log(&late, &gap(20.3)), "1.5 % more");
        assert!(!is_only_in_log(&late, &gap(20.1)), "as good as the same");
        let known = SensorChannel { in_log: true, ..late.clone() };
        let none = SensorChannel { named: false, ..late };
        assert!(!is_only_in_log(&known, &gap(20.3)) && !is_only_in_log(&none, &gap(20.3)));
    }

    #[test]
    fn the_models_pulse_of_a_rung_is_the_measured_less_what_is_left() {
        let data = trial::data(4, |_, _| 0.0);
        let regime = |x: f64| Regime {
            by: Dependence::Climb,
            label: String::new(),
            x,
            before_us: (5.0, 1.0),
            after_us: -2.0,
            before_mps: 0.0,
            bins: 8,
        };
        let rungs = ladder(&data, &[-2.0, 2.0, 3.0, 7.0].map(regime));
        assert_eq!(rungs.len(), 3, "nobody flew 7 m/s");
        assert!(rungs.windows(2).all(|pair| pair[0].measured_us < pair[1].measured_us));
        for rung in rungs {
            assert!((rung.before_us - (rung.measured_us - 5.0)).abs() < 1e-9, "{rung:?}");
            assert!((rung.after_us - (rung.measured_us + 2.0)).abs() < 1e-9, "{rung:?}");
        }
    }
}
