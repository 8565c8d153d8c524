//! Proposal of the flight that would answer the questions that a verdict left open.

use std::path::{Path, PathBuf};

use super::proof::{self, Proven, again};
use super::search::Searched;
use super::{MODEL, VERDICT};
use crate::base::file::{FileError, create_folder, write_whole};
use crate::base::plain::Shown as _;
use crate::blind::rehearse::{Rehearsal, answers, rehearse};
use crate::campaign::{self, FlightFolder, to_json};
use crate::effects::{LIBRARY, Signal};
use crate::gap::Verdict;
use crate::gap::next::predict::{least, matters, stated_z};
use crate::gap::next::questions::Kind;
use crate::gap::next::result::{Asked, Told};
use crate::gap::next::search::{Aim, Choice, search};
use crate::gap::next::{Flight, Known, NEXT_SCHEMA, Next, Question, Sought, ask};
use crate::gap::verdict::VERDICT_SCHEMA;
use crate::mission::Plan;
use crate::mission::plan::Purpose;
use crate::mission::resolve::{ResolvedFlight, resolve_text};
use crate::vehicle::{Vehicle, library};
use crate::workflow::check::{Origin, checked, is_safe};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::{made_by, words};

/// Name of the proposal, as template and as JSON.
const TEMPLATE: &str = "next.toml";
const RESULT: &str = "next.json";
/// Folder of the simulated flights that verify it; removed when they are explained.
const REHEARSAL: &str = "next-rehearsal";
/// Most flights that are worth telling: beyond, the question is not for this kind of flight.
const MOST_FLIGHTS: f64 = 100.0;

/// What is asked for.
pub(crate) struct Wish {
    /// Campaign folder that was compared.
    pub(crate) campaign: PathBuf,
    /// Folder of the comparison; `None`: the campaign's `gap`.
    pub(crate) gap: Option<PathBuf>,
    /// Fisher z that every question should reach.
    pub(crate) z: f64,
    /// Longest flight, s; `None`: the vehicle's endurance less its reserve.
    pub(crate) longest_s: Option<f64>,
    /// Flight of the campaign; `None`: its calibration.
    pub(crate) flight: Option<String>,
    /// Horizontal wind that is expected, m/s.
    pub(crate) wind_mps: f64,
    /// Whether the flight is simulated with each answer.
    pub(crate) verify: bool,
    /// Seed of these flights.
    pub(crate) seed: u64,
    /// Where results go; `None`: to the comparison.
    pub(crate) output: Option<PathBuf>,
}

impl Wish {
    /// Folder of the comparison.
    fn compared(&self) -> PathBuf {
        self.gap.clone().unwrap_or_else(|| self.campaign.join("gap"))
    }
}

/// The flight that is proposed.
pub(crate) struct Proposed {
    pub(crate) next: Next,
    /// Where its template is.
    pub(crate) path: PathBuf,
}

/// Looks for the flight, and writes it as template and as JSON.
///
/// # Errors
/// When there is no verdict of the campaign, nothing to ask, or no flight as short.
pub(crate) fn run(host: &dyn Host, wish: &Wish) -> Result<Proposed, WorkflowError> {
    let before = Before::read(wish)?;
    let wind_mps = [wish.wind_mps, 0.0];
    let verdict = &before.verdict;
    let known = Known::new(verdict, before.model.clone(), wind_mps);
    let present = Flight::new(&known, before.plan.clone())?;
    let (questions, passed_over) = questions(&known, &present, verdict)?;
    if questions.is_empty() {
        return Err(WorkflowError::Nothing(format!(
            "{}: nothing is left to ask: no class, nothing unknown, and every effect that matters would \
             have been seen",
            before.place.shown()
        )));
    }
    let limits = &before.plan.limits;
    let longest_s = wish.longest_s.unwrap_or(limits.endurance_s * (1.0 - limits.endurance_reserve));
    let aim = Aim { z: wish.z, longest_s };
    let choice = search(&known, &before.plan, &before.word, &questions, aim)?.ok_or_else(|| {
        WorkflowError::Usage(format!(
            "no flight of the elements is as short as {longest_s:.0} s (--longest)"
        ))
    })?;
    let mut next = result(&before, &questions, &choice, wish.z);
    if next.questions.iter().all(|asked| !asked.reached && asked.flights_needed.is_none()) {
        let asked: Vec<&str> = next.questions.iter().map(|asked| asked.question.as_str()).collect();
        return Err(WorkflowError::Nothing(format!(
            "{}: no flight of these elements would tell, however often it is flown: {}",
            before.place.shown(),
            asked.join("; ")
        )));
    }
    next.notes = notes(&questions, &passed_over, &choice, &known);
    let folder = wish.output.clone().unwrap_or_else(|| wish.compared());
    create_folder(&folder)?;
    let _lock = host.lock(&folder)?;
    let text = choice.elements.template(
        next.title(),
        &choice.plan,
        &before.word,
        &head(&next),
        &next.briefing,
    );
    let path = folder.join(TEMPLATE);
    let flight = planned(&path, &text)?;
    let show = flight.plan.to_show();
    let report = checked(&show, &flight.plan, &flight.vehicle, &Origin::Plan, 1);
    if !is_safe(&report, &[]) {
        next.notes.push(
            "`updraft check` does not pass this flight as it is: plan it and see what it says"
                .to_owned(),
        );
    }
    if wish.verify {
        verify(
            host,
            &mut next,
            &Verify {
                known: &known,
                questions: &questions,
                choice: &choice,
                before: &before,
                flight: &flight,
                folder: &folder.join(REHEARSAL),
                wind_mps,
                seed: wish.seed,
            },
        )?;
        refuse_untold(&next, &before.place)?;
    }
    write_whole(&path, text.as_bytes())?;
    let json = to_json(&next)
        .map_err(|error| WorkflowError::Failed(format!("failed to make JSON: {error}")))?;
    write_whole(&folder.join(RESULT), &json)?;
    Ok(Proposed { next, path })
}

/// Refuses a flight that should have told something at once and told nothing when it was simulated. What needs several
/// flights is not expected of one.
fn refuse_untold(next: &Next, place: &Path) -> Result<(), WorkflowError> {
    let at_once = || next.questions.iter().filter(|asked| asked.reached);
    let verified = || at_once().flat_map(|asked| &asked.verified);
    let flown = verified().count();
    if flown == 0 || verified().any(|answer| answer.told) {
        return Ok(());
    }
    Err(WorkflowError::Nothing(format!(
        "{}: the best flight that was found was simulated with each answer, and told it in 0 of {flown} flights; \
         nothing was written (--no-verify writes it all the same, --longest allows a longer one)",
        place.shown()
    )))
}

/// The flight that was compared, and what came of it.
struct Before {
    place: PathBuf,
    verdict: Verdict,
    plan: Plan,
    model: Vehicle,
    /// The template's word for the vehicle.
    word: String,
}

impl Before {
    fn read(wish: &Wish) -> Result<Self, WorkflowError> {
        let campaign = &wish.campaign;
        let compared = wish.compared();
        let place = compared.join(VERDICT);
        if !place.is_file() {
            // A folder that is not there is another matter than one that was not compared.
            std::fs::metadata(campaign).map_err(|error| FileError::new("read", campaign, error))?;
            campaign::flights(campaign)?;
            let at = match &wish.gap {
                Some(folder) => format!("{} has no {VERDICT}", folder.shown()),
                None => format!("{} has no gap/{VERDICT}", campaign.shown()),
            };
            return Err(WorkflowError::Nothing(format!(
                "{at}: compare it first (`updraft gap {}`), or say where that was put (--gap)",
                campaign.shown()
            )));
        }
        let again = again(campaign, wish.flight.as_deref(), wish.gap.as_deref());
        let Proven { verdict, .. } = proof::read(&compared, &proof::anew(&again))?;
        let (folder, plan) = flight_of(campaign, wish.flight.as_deref())?;
        is_of(&verdict, &plan).map_err(|why| {
            WorkflowError::Usage(format!(
                "{} {why}; name the flight that was compared (--flight), or compare this one (`{again}`)",
                place.shown()
            ))
        })?;
        let vehicle = folder.vehicle();
        let model = compared.join(MODEL);
        let model = library::load(&model.to_string_lossy())?;
        let is_builtin = library::names().any(|name| name == plan.vehicle);
        let word =
            if is_builtin { plan.vehicle.clone() } else { vehicle.to_string_lossy().into_owned() };
        Ok(Self { place, verdict, plan, model, word })
    }
}

/// Whether a verdict can be one of this flight; else why not, as the rest of a sentence that begins with the verdict.
pub(crate) fn is_of(verdict: &Verdict, plan: &Plan) -> Result<(), String> {
    if verdict.schema != VERDICT_SCHEMA {
        return Err(format!("has the schema \"{}\", not {VERDICT_SCHEMA}", verdict.schema));
    }
    let names = |group: &(String, usize)| plan.groups.iter().any(|known| known.name == group.0);
    let stranger = verdict.data.groups.iter().find(|group| !names(group));
    match stranger {
        Some((name, _)) => Err(format!(
            "compares a group \"{name}\", which the flight {} does not have",
            plan.name
        )),
        None if verdict.data.drones > plan.slots.len() => Err(format!(
            "compares {} drones, and the flight {} has {}",
            verdict.data.drones,
            plan.name,
            plan.slots.len()
        )),
        None => Ok(()),
    }
}

/// The flight that is named, else the calibration, else the first.
fn flight_of(campaign: &Path, name: Option<&str>) -> Result<(FlightFolder, Plan), WorkflowError> {
    let mut flights = Vec::new();
    for folder in campaign::flights(campaign)? {
        let plan = folder.read_plan()?;
        flights.push((folder, plan));
    }
    let place = match name {
        Some(name) => flights.iter().position(|(_, plan)| plan.name == name),
        None => flights
            .iter()
            .position(|(_, plan)| plan.purpose == Purpose::Calibration)
            .or((!flights.is_empty()).then_some(0)),
    };
    let names: Vec<&str> = flights.iter().map(|(_, plan)| plan.name.as_str()).collect();
    match place {
        Some(place) => Ok(flights.swap_remove(place)),
        None => Err(WorkflowError::Usage(format!(
            "there is no flight \"{}\"; flights are {}",
            name.unwrap_or_default(),
            names.join(", ")
        ))),
    }
}

/// What is asked, and the effects that were too small to see and do not matter for the pulse.
fn questions(
    known: &Known,
    present: &Flight,
    verdict: &Verdict,
) -> Result<(Vec<Question>, Vec<String>), WorkflowError> {
    let (mut asked, mut passed_over) = (Vec::new(), Vec::new());
    for question in ask(verdict) {
        match &question.sought {
            Sought::Seen { effect } if !matters(known, present, effect)? => {
                passed_over.push(effect.clone());
            }
            _ => asked.push(question),
        }
    }
    Ok((asked, passed_over))
}

fn planned(path: &Path, text: &str) -> Result<ResolvedFlight, WorkflowError> {
    let mut mission = resolve_text(&path.shown().to_string(), text, &[])?;
    if mission.flights.is_empty() {
        return Err(WorkflowError::Failed("the proposed template has no flight".to_owned()));
    }
    Ok(mission.flights.swap_remove(0))
}

fn result(before: &Before, questions: &[Question], choice: &Choice, wanted_z: f64) -> Next {
    let asked: Vec<Asked> = questions
        .iter()
        .zip(&choice.was)
        .zip(choice.predicted.iter().zip(&choice.wanted))
        .map(|((question, was), (will, wanted))| {
            let (present_z, proposed_z) = (least(was), least(will));
            let needed = (wanted / proposed_z.max(1e-9)).powi(2).ceil();
            let from = will.iter().map(|told| {
                let before = was.iter().find(|before| before.from == told.from);
                Told {
                    from: told.from.clone(),
                    size: told.size,
                    present_z: before.map_or(0.0, |before| before.z),
                    proposed_z: told.z,
                }
            });
            let reached = proposed_z >= *wanted;
            Asked {
                kind: question.kind(),
                question: question.words.clone(),
                wanted_z: *wanted,
                present_z,
                proposed_z,
                reached,
                flights_needed: (!reached && needed <= MOST_FLIGHTS).then_some(needed as u32),
                from: from.collect(),
                verified: Vec::new(),
            }
        })
        .collect();
    Next {
        schema: NEXT_SCHEMA.to_owned(),
        made_by: made_by(),
        flight: before.plan.name.clone(),
        wanted_z,
        present_s: before.plan.duration_ms as f64 / 1000.0,
        proposed_s: choice.plan.duration_ms as f64 / 1000.0,
        reaches: asked.iter().all(|asked| asked.reached),
        elements: choice.elements,
        why: choice.elements.words().into_iter().map(str::to_owned).collect(),
        briefing: choice.elements.briefing(&choice.plan),
        questions: asked,
        predicted_flights: choice.looked_at,
        notes: Vec::new(),
    }
}

fn notes(
    questions: &[Question],
    passed_over: &[String],
    choice: &Choice,
    known: &Known,
) -> Vec<String> {
    let mut notes = Vec::new();
    if !passed_over.is_empty() {
        let names: Vec<&str> = passed_over.iter().map(String::as_str).collect();
        notes.push(format!(
            "not asked: {}: at the usual size too little for such a flight, less than 2.5 us of pulse",
            words::list(&names)
        ));
    }
    let is_asked = |effect: &str| {
        questions.iter().any(|question| match &question.sought {
            Sought::Seen { effect: one } => one == effect,
            Sought::Apart { effects, .. } => effects.iter().any(|one| one == effect),
            Sought::Shape { .. } => false,
        })
    };
    let by_place = LIBRARY.iter().map(|effect| effect.definition());
    for effect in by_place.filter(|definition| definition.looks_at(Signal::Neighbours)) {
        if is_asked(effect.name) {
            notes.push(format!(
                "{} hides in the drones' own offsets: fly twice, with the drones' slots permuted in \
                 between (that is not predicted here)",
                effect.name
            ));
        }
    }
    if choice.elements.payload {
        notes.push(
            "`updraft gap` does not know of the payload: it shows in the offsets of the drones that \
             carry it"
                .to_owned(),
        );
    }
    if !known.has_voltage {
        notes.push(
            "the logs have no voltage at rest: staggered charge tells nothing until they do"
                .to_owned(),
        );
    }
    notes
}

/// Comment lines of the template.
fn head(next: &Next) -> Vec<String> {
    let mut head = vec![
        format!(
            "{}: made by `updraft gap next` from the verdict on {}.",
            next.title(),
            next.flight
        ),
        String::new(),
        format!(
            "Predicted Fisher z ({} is wanted), of the flight that was flown and of this:",
            next.wanted_z
        ),
    ];
    if let Some(falls) = next.shortfall() {
        head.insert(1, format!("As predicted, {falls}."));
    }
    for asked in &next.questions {
        head.push(format!(
            "  {:5.1} -> {:5.1}  {}",
            asked.present_z, asked.proposed_z, asked.question
        ));
        for told in asked.from.iter().filter(|told| !told.from.is_empty()) {
            head.push(format!(
                "  {:5.1} -> {:5.1}    from {}",
                told.present_z, told.proposed_z, told.from
            ));
        }
    }
    head.push(String::new());
    head.extend(next.why.iter().map(|why| format!("* {why}")));
    head.push(String::new());
    head
}

struct Verify<'a> {
    known: &'a Known,
    questions: &'a [Question],
    choice: &'a Choice,
    before: &'a Before,
    flight: &'a ResolvedFlight,
    folder: &'a Path,
    wind_mps: [f64; 2],
    seed: u64,
}

/// Simulates the proposed flight with each answer in turn.
fn verify(host: &dyn Host, next: &mut Next, with: &Verify<'_>) -> Result<(), WorkflowError> {
    let rehearsal = Rehearsal {
        flight: with.flight,
        elements: with.choice.elements,
        noise: &with.before.verdict.noise,
        wind_mps: with.wind_mps,
        seed: with.seed,
    };
    let flown = Flight::new(with.known, with.flight.plan.clone())?;
    let brings = (with.choice.elements.charge, with.choice.elements.payload);
    let all = with.questions.iter().zip(&with.choice.predicted).zip(&mut next.questions);
    for ((question, predicted), asked) in all {
        let answers = answers(question, &with.before.model, predicted);
        if let Some(why) = not_simulated(asked, answers.len()) {
            next.notes.push(format!("not simulated ({}): {why}", asked.question));
            continue;
        }
        for mut answer in answers {
            host.check_stop()?;
            // What no steady flight can have keeps the question's own z: the flight itself will say.
            if let Sought::Seen { effect } = &question.sought
                && let Ok(Some(z)) = stated_z(with.known, &flown, brings, effect, answer.size)
            {
                answer.from = vec![(String::new(), z)];
            }
            host.say(&format!("Simulating it with {} ...", answer.effect));
            let stop = Some(host.stop_flag());
            asked.verified.push(rehearse(&rehearsal, &answer, with.folder, &Searched, stop)?);
        }
    }
    Ok(())
}

/// Why a question's answers are not simulated; `None`: they are.
fn not_simulated(asked: &Asked, answers: usize) -> Option<String> {
    if asked.kind == Kind::TooSmall && !asked.reached {
        let often = match asked.flights_needed {
            Some(flights) => format!("; {flights} such flights would reach it"),
            None => String::new(),
        };
        return Some(format!(
            "one flight with z {:.1} of the {:.1} that are wanted would hardly find it{often}",
            asked.proposed_z, asked.wanted_z
        ));
    }
    (answers == 0).then(|| "what is not in the library cannot be flown".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::next::Elements;
    use crate::gap::next::result::Verified;

    /// A question that this flight would answer at once or not, and whether each simulated answer was told.
    fn asked(reached: bool, told: &[bool]) -> Asked {
        let answer = |told: &bool| Verified {
            truth: "rotor-inflow".to_owned(),
            size: 0.4,
            found: Vec::new(),
            told: *told,
            predicted_z: 6.0,
            reached_z: None,
        };
        Asked {
            kind: Kind::Class,
            question: "is it one or the other?".to_owned(),
            wanted_z: 5.0,
            present_z: 1.0,
            proposed_z: 6.0,
            reached,
            flights_needed: None,
            from: Vec::new(),
            verified: told.iter().map(answer).collect(),
        }
    }

    fn proposal(questions: Vec<Asked>) -> Next {
        Next {
            schema: NEXT_SCHEMA.to_owned(),
            made_by: String::new(),
            flight: String::new(),
            wanted_z: 5.0,
            present_s: 600.0,
            proposed_s: 600.0,
            reaches: true,
            elements: Elements::ALL,
            why: Vec::new(),
            briefing: Vec::new(),
            questions,
            predicted_flights: 1,
            notes: Vec::new(),
        }
    }

    fn refused(questions: Vec<Asked>) -> Option<String> {
        let next = proposal(questions);
        refuse_untold(&next, Path::new("campaign/gap")).err().map(|error| error.to_string())
    }

    #[test]
    fn a_flight_that_falls_short_says_so_and_why_it_was_not_simulated() {
        let mut next = proposal(vec![asked(true, &[])]);
        assert_eq!((next.title(), next.shortfall()), ("The flight that would tell", None));
        assert_eq!(not_simulated(&next.questions[0], 2), None);
        let short = Asked {
            kind: Kind::TooSmall,
            question: "is there battery of the usual size?".to_owned(),
            proposed_z: 3.2,
            flights_needed: Some(3),
            ..asked(false, &[])
        };
        let why = not_simulated(&short, 1).unwrap();
        assert_eq!(
            why,
            "one flight with z 3.2 of the 5.0 that are wanted would hardly find it; 3 such flights would reach it"
        );
        assert!(not_simulated(&Asked { kind: Kind::Unknown, ..asked(true, &[]) }, 0).is_some());
        next.questions.push(short);
        next.reaches = false;
        assert_eq!(next.title(), "The flight that would tell most, and not enough");
        let lines = head(&next);
        assert!(lines[0].starts_with("The flight that would tell most, and not enough: "));
        assert_eq!(lines[1], "As predicted, it falls short in 1 of 2 questions, by z 1.8.");
        let text = crate::report::next_terminal::text(&next);
        assert!(text.starts_with("The flight that would tell most, and not enough\n"), "{text}");
    }

    #[test]
    fn a_flight_that_told_nothing_when_it_was_simulated_is_refused() {
        let said = refused(vec![asked(true, &[false, false]), asked(true, &[false])]).unwrap();
        assert!(said.contains("campaign/gap: the best flight"), "{said}");
        assert!(said.contains("told it in 0 of 3 flights; nothing was written"), "{said}");
        // One answer that is told is something.
        assert_eq!(refused(vec![asked(true, &[false, true]), asked(true, &[false])]), None);
        // What takes several flights is not expected of one, nor counts what it happened to tell.
        assert_eq!(refused(vec![asked(false, &[false])]), None);
        assert!(refused(vec![asked(false, &[true]), asked(true, &[false])]).is_some());
        assert_eq!(refused(vec![asked(true, &[])]), None, "nothing was simulated");
    }
}
