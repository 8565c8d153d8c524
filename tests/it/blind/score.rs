//! The seal, the scorer and the table on made-up verdicts, and a whole series with a made-up search.

#![expect(clippy::unwrap_used, reason = "a test that cannot write its folder fails")]

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use updraft::base::shard::Share;
use updraft::blind::explain::Cause;
use updraft::blind::render::{Style, render};
use updraft::blind::score::{Called, Outcome, score};
use updraft::blind::series::{FIRST_SCORING_SEED, FlightResult, Place, Settings};
use updraft::blind::table::table;
use updraft::blind::told::{is_right, words};
use updraft::blind::{AirClass, Base, BlindError, Cell, Explain, Protocol, Scenario, Worlds};
use updraft::blind::{seal, series};
use updraft::gap::verdict::{
    Detectable, Finding, Fitted, Form, Interval, SensorChannel, Shrink, Step, VERDICT_SCHEMA,
};
use updraft::gap::{Dependence, Verdict};

fn truth(base: Base, hidden: &[&str]) -> Scenario {
    let hidden = hidden.iter().map(|name| (*name).to_owned()).collect();
    let (worlds, protocol, air) = (Worlds::Home, Protocol::Paper, AirClass::Field);
    let cell = Cell { worlds, protocol, air, base, hidden, side: 3, columns: None };
    Scenario::draw(7, &cell).unwrap()
}

fn verdict(findings: Vec<Finding>) -> Verdict {
    let step = |finding| Step {
        finding,
        gain_nats: 20.0,
        threshold_nats: 8.0,
        alpha: 0.01,
        size_us: 10.0,
        rivals: Vec::new(),
        shape: None,
        in_field: None,
        form: None,
    };
    Verdict {
        schema: VERDICT_SCHEMA.to_owned(),
        made_by: "test".to_owned(),
        vehicle: "airsim-generic-quad".to_owned(),
        steps: findings.into_iter().map(step).collect(),
        ..Verdict::default()
    }
}

fn around(value: f64, half: f64) -> Interval {
    Interval { value, low: value - half, high: value + half }
}

fn name(effect: &str, parameter: &str, value: Interval) -> Finding {
    let fitted = Fitted { name: parameter.to_owned(), unit: String::new(), value, before: None };
    Finding::Name { effect: effect.to_owned(), parameters: vec![fitted], was_there: false }
}

fn plain(effect: &str) -> Finding {
    Finding::Name { effect: effect.to_owned(), parameters: Vec::new(), was_there: false }
}

fn class(effects: &[&str]) -> Finding {
    let effects = effects.iter().map(|name| (*name).to_owned()).collect();
    Finding::Class { effects, parameters: Vec::new() }
}

fn unknown(depends_on: &str) -> Finding {
    Finding::Unknown { depends_on: Dependence::of(depends_on).unwrap(), formula: None }
}

fn scored(hidden: &[&str], findings: Vec<Finding>) -> Outcome {
    score(&truth(Base::Airsim, hidden), &verdict(findings), &[])
}

#[test]
fn the_right_name_with_its_parameter() {
    let truth = truth(Base::Airsim, &["battery"]);
    let value = truth.hidden[0].value();
    let named = |off: f64| verdict(vec![name("battery", "exponent", around(value * off, 0.05))]);
    let outcome = score(&truth, &named(1.02), &[Some(6.5)]);
    let hidden = &outcome.hidden[0];
    assert_eq!((hidden.called, hidden.z, hidden.covered), (Called::Named, Some(6.5), Some(true)));
    assert!((hidden.relative_error.unwrap() - 0.02).abs() < 1e-9);
    assert!(outcome.wrong_names.is_empty() && !outcome.is_false_alarm());
    let far = score(&truth, &named(1.5), &[]);
    assert_eq!((far.hidden[0].covered, far.hidden[0].z), (Some(false), None));
}

#[test]
fn sizes_are_those_of_the_form_that_was_hidden() {
    let mut truth = truth(Base::Airsim, &["rotor-inflow"]);
    // 18 us per m/s at hover, as a share with momentum theory's change of the induced velocity and without.
    truth.hidden[0].parameters.insert("inflow_share".to_owned(), 0.263);
    let mut found = verdict(vec![name("rotor-inflow", "inflow_share", around(0.1405, 0.01))]);
    let covered = |verdict: &Verdict| score(&truth, verdict, &[]).hidden[0].covered;
    assert_eq!(covered(&found), Some(false));
    for (value, is_covered) in [(1.0, false), (0.0, true)] {
        found.steps[0].form =
            Some(Form { name: "induced".to_owned(), value, is_usual: value == 1.0 });
        assert_eq!(covered(&found), Some(is_covered));
    }
    let hidden = &score(&truth, &found, &[]).hidden[0];
    assert!((hidden.fitted.unwrap() - 0.263).abs() < 0.005, "{hidden:?}");
    assert!(hidden.relative_error.unwrap().abs() < 0.02, "{hidden:?}");
}

#[test]
fn errors_are_of_the_change_where_the_model_had_the_effect() {
    let truth = truth(Base::Pixel, &["parasitic-drag"]);
    let (value, before) = (truth.hidden[0].value(), truth.hidden[0].before.unwrap());
    assert_eq!(before, 0.02);
    let half_way = f64::midpoint(before, value);
    let finding = name("parasitic-drag", "vertical_m2", around(half_way, 0.001));
    let outcome = score(&truth, &verdict(vec![finding]), &[]);
    assert!((outcome.hidden[0].relative_error.unwrap() + 0.5).abs() < 1e-9);
}

#[test]
fn the_right_class_however_it_is_said() {
    for finding in [class(&["motor-thermal", "battery"]), class(&["motor-thermal"])] {
        let outcome = scored(&["battery"], vec![finding]);
        assert_eq!(outcome.hidden[0].called, Called::InClass);
        assert_eq!((outcome.wrong_classes, outcome.wrong_names.len()), (0, 0));
    }
    // Another of the class, named alone: the class is right, the single name is wrong.
    let outcome = scored(&["battery"], vec![plain("motor-thermal")]);
    assert_eq!(outcome.hidden[0].called, Called::InClass);
    assert_eq!((outcome.wrong_names.len(), outcome.wrong_in_class), (1, 1));
}

#[test]
fn the_wrong_name_class_and_unknown() {
    let outcome = scored(
        &["battery"],
        vec![plain("rotor-inflow"), class(&["vortex-ring", "thrust-curve"]), unknown("height")],
    );
    assert_eq!(outcome.hidden[0].called, Called::Unknown);
    assert_eq!(outcome.wrong_names, ["rotor-inflow"]);
    assert_eq!((outcome.wrong_in_class, outcome.wrong_classes, outcome.wrong_unknowns), (0, 1, 1));
}

#[test]
fn silence_and_false_alarms() {
    let silent = scored(&["battery"], Vec::new());
    assert_eq!((silent.hidden[0].called, silent.is_false_alarm()), (Called::Silent, false));
    assert!(!scored(&[], Vec::new()).is_false_alarm());
    for finding in [plain("battery"), class(&["battery", "motor-thermal"]), unknown("time")] {
        assert!(scored(&[], vec![finding]).is_false_alarm());
    }
    let mut unexplained = verdict(Vec::new());
    let left =
        Shrink { after_without_air_us: 9.0, floor_us: 6.0, chi2: (2.5, 2.5), ..Shrink::default() };
    unexplained.gap.rungs = Some(left);
    let says = |hidden: &[&str]| {
        let outcome = score(&truth(Base::Airsim, hidden), &unexplained, &[]);
        (outcome.is_false_alarm(), is_right(&outcome), words(&outcome, &unexplained).join(" "))
    };
    let (is_false, is_right, words) = says(&[]);
    assert!(is_false && !is_right && words.ends_with("says that something is missing."), "{words}");
    let (is_false, _, words) = says(&["parasitic-drag"]);
    assert!(
        !is_false && words.contains(" m², and the verdict says only that something"),
        "{words}"
    );
    let mut sensor = verdict(Vec::new());
    sensor.sensor.named = true;
    assert!(score(&truth(Base::Airsim, &[]), &sensor, &[]).is_false_alarm());
}

#[test]
fn the_unknown_is_recognised_by_what_it_depends_on() {
    for (hidden, right, wrong) in [
        ("step", "step", "height"),
        ("step", "time", "climb"),
        ("height-wave", "height", "time"),
        ("climb-time", "climb-time", "climb"),
        ("heading", "heading", "wind"),
    ] {
        let outcome = scored(&[hidden], vec![unknown(right)]);
        assert_eq!((outcome.hidden[0].called, outcome.wrong_unknowns), (Called::Named, 0));
        let outcome = scored(&[hidden], vec![unknown(wrong)]);
        assert_eq!((outcome.hidden[0].called, outcome.wrong_unknowns), (Called::Unknown, 1));
        let outcome = scored(&[hidden], vec![plain("battery")]);
        assert_eq!((outcome.hidden[0].called, outcome.wrong_names.len()), (Called::Silent, 1));
    }
}

#[test]
fn what_the_library_has_come_to_have_is_no_longer_unknown() {
    let outcome = scored(&["climb-time"], vec![plain("response-drift")]);
    assert_eq!(outcome.hidden[0].called, Called::Named);
    assert!(outcome.wrong_names.is_empty());
    let outcome = scored(&["step"], vec![plain("response-drift")]);
    assert_eq!(outcome.hidden[0].called, Called::Silent);
}

#[test]
fn the_sensor_channel_is_a_name_too() {
    let truth = truth(Base::Airsim, &["velocity-bias"]);
    let value = truth.hidden[0].value();
    let mut said = verdict(Vec::new());
    said.sensor = SensorChannel { bias_mps: Some(around(value, 0.01)), named: true, ..said.sensor };
    let outcome = score(&truth, &said, &[]);
    assert_eq!((outcome.hidden[0].called, outcome.hidden[0].covered), (Called::Named, Some(true)));
    assert!(outcome.wrong_names.is_empty());
}

#[test]
fn pairs_are_scored_one_by_one_and_in_any_order() {
    let findings = vec![plain("battery"), plain("rotor-inflow")];
    let outcome = scored(&["rotor-inflow", "battery"], findings);
    assert!(outcome.hidden.iter().all(|hidden| hidden.called == Called::Named));
    assert!(outcome.wrong_names.is_empty());
}

#[test]
fn the_gap_and_what_could_not_be_seen() {
    let truth = truth(Base::Airsim, &["battery"]);
    let shrink = Shrink {
        before_us: around(20.0, 1.0),
        after_us: around(5.0, 1.0),
        before_without_air_us: 18.0,
        after_without_air_us: 4.0,
        excess_shrink: around(0.9, 0.05),
        mean_us: (10.0, 4.0),
        ..Shrink::default()
    };
    let mut said = verdict(vec![plain("battery")]);
    said.gap.drones = Some(shrink);
    let visible = |smallest| Detectable {
        effect: "battery".to_owned(),
        parameter: "exponent".to_owned(),
        unit: String::new(),
        usual: 1.0,
        smallest,
        usual_z: 5.0,
        would_be_seen: true,
        like: Vec::new(),
        why: String::new(),
    };
    said.detectable = vec![visible(Some(0.1))];
    let outcome = score(&truth, &said, &[]);
    assert_eq!((outcome.raw_shrink, outcome.excess_shrink), (Some(0.75), Some(0.9)));
    assert_eq!((outcome.made_worse, outcome.hidden[0].said_visible), (false, Some(true)));

    said.gap.drones = Some(Shrink { after_without_air_us: 18.5, ..shrink });
    for smallest in [None, Some(3.0)] {
        said.detectable = vec![visible(smallest)];
        let outcome = score(&truth, &said, &[]);
        assert_eq!((outcome.made_worse, outcome.hidden[0].said_visible), (true, Some(false)));
    }
}

#[test]
fn the_seal_opens_after_the_verdict_and_shows_tampering() {
    let folder = tempfile::tempdir().unwrap();
    let beside = folder.path();
    let truth = truth(Base::Pixel, &["battery", "step"]);
    let hash = seal::seal(beside, &truth).unwrap();
    assert!(std::fs::read_to_string(seal::hash_path(beside)).unwrap().starts_with(&hash));
    let path = beside.join("verdict.json");
    let early = seal::open(beside, &path, None).unwrap_err().to_string();
    std::fs::write(&path, "").unwrap();
    assert!(matches!(seal::open(beside, &path, None), Err(BlindError::NoVerdict { .. })), "empty");
    std::fs::write(&path, "{}").unwrap();
    let opened = seal::open(beside, &path, None).unwrap();
    assert_eq!((&opened.truth, &opened.truth_sha256), (&truth, &hash));
    let text = std::fs::read_to_string(seal::truth_path(beside)).unwrap();
    std::fs::write(seal::truth_path(beside), text.replacen("battery", "buttery", 1)).unwrap();
    let changed = seal::open(beside, &path, None).unwrap_err().to_string();
    let place = beside.display().to_string();
    let text = [early, changed].join("\n").replace(&place, "FOLDER");
    let hashes: Vec<_> = text.split(' ').filter(|word| word.len() >= 64).collect();
    let mut shown = text.clone();
    for hash in hashes {
        shown = shown.replace(hash.trim_end_matches(','), "HASH");
    }
    insta::assert_snapshot!(shown);
}

fn settings(seed: u64, tuning: bool) -> Settings {
    Settings {
        worlds: vec![Worlds::Home],
        protocols: vec![Protocol::Paper],
        airs: vec![AirClass::Calm, AirClass::Field],
        bases: vec![Base::Airsim, Base::Pixel],
        hidden: vec![vec![], vec!["rotor-inflow".to_owned()]],
        flights: 3,
        seed,
        side: 1,
        tuning,
    }
}

#[test]
fn seeds_for_tuning_and_for_scoring_do_not_meet() {
    let text = |seed, tuning| settings(seed, tuning).check_seed().unwrap_err().to_string();
    insta::assert_snapshot!(
        [text(FIRST_SCORING_SEED - 1, false), text(FIRST_SCORING_SEED, true)].join("\n")
    );
    settings(FIRST_SCORING_SEED, false).check_seed().unwrap();
    settings(FIRST_SCORING_SEED - 1, true).check_seed().unwrap();
}

#[test]
fn cells_leave_out_what_a_base_does_not_take() {
    let cells = settings(1, true).cells().unwrap();
    // Nothing on two bases, the inflow on AirSim's alone; two airs each.
    assert_eq!(cells.len(), 6);
    assert!(cells.iter().all(|cell| cell.hidden.is_empty() || cell.base == Base::Airsim));
    let order = |seed| settings(seed, true).cells().unwrap();
    assert_ne!(order(1), order(4));
}

/// Names the inflow whenever there are logs, and counts how often it is asked.
struct Always<'a>(&'a AtomicUsize);

impl Explain for Always<'_> {
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause> {
        self.0.fetch_add(1, Ordering::SeqCst);
        for file in ["template.toml", "vehicle.toml", "plan.json", "logs"] {
            assert!(flight.join(file).exists(), "{file}");
        }
        let verdict_file = flight.parent().unwrap().join("verdict.json");
        assert!(!verdict_file.exists() && flight.parent().unwrap().join("sealed/SHA256").exists());
        Ok(verdict(vec![plain("rotor-inflow")]))
    }

    fn fisher_z(&self, _flight: &Path, truth: &Scenario) -> Vec<Option<f64>> {
        vec![Some(7.0); truth.hidden.len()]
    }
}

/// What became of each flight of a share.
fn run(
    settings: &Settings,
    place: &Place,
    share: Share,
    made_by: &str,
    search: &dyn Explain,
) -> Result<Vec<Result<FlightResult, BlindError>>, BlindError> {
    let stop = AtomicBool::new(false);
    let taken = series::run(settings, place, share, made_by, search, &stop, &|| {})?;
    Ok(taken.into_iter().map(|taken| taken.result).collect())
}

fn place(folder: &Path, keep: bool) -> Place {
    Place { folder: folder.to_owned(), keep, scratch: None }
}

fn share(shard: &str) -> Share {
    Share { shard: Some(shard.parse().unwrap()), gather_only: false }
}

#[test]
fn shards_make_the_table_that_one_process_makes() {
    let folder = tempfile::tempdir().unwrap();
    let (one, many) = (folder.path().join("one"), folder.path().join("many"));
    let settings = settings(3, true);
    let asked = AtomicUsize::new(0);
    let search = Always(&asked);
    run(&settings, &place(&one, false), Share::default(), "updraft", &search).unwrap();
    let many_place = Place { scratch: Some(folder.path().join("scratch")), ..place(&many, true) };
    let gather = Share { shard: None, gather_only: true };
    for (shard, left) in [("2/2", 2), ("1/2", 0)] {
        run(&settings, &many_place, share(shard), "updraft", &search).unwrap();
        let all = run(&settings, &many_place, gather, "updraft", &search).unwrap();
        let is_missing = |one: &&Result<_, _>| matches!(one, Err(BlindError::NotFlown { .. }));
        assert_eq!(all.iter().filter(is_missing).count(), left);
    }
    assert_eq!(asked.load(Ordering::SeqCst), 6);
    for index in 0..3 {
        let file = format!("flights/{index:05}.json");
        let bytes = |folder: &Path| std::fs::read(folder.join(&file)).unwrap();
        assert_eq!(bytes(&one), bytes(&many), "{file}");
        assert!(many_place.work(index).join("verdict.json").exists());
    }
    assert_eq!(std::fs::read_dir(folder.path().join("scratch")).unwrap().count(), 0);
    let newer = run(&settings, &many_place, gather, "updraft 9", &search).unwrap_err().to_string();
    assert!(newer.contains("was made by updraft, this is updraft 9"), "{newer}");
}

/// Takes its time, so that copies of a flight meet.
struct Slow;

impl Explain for Slow {
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause> {
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(flight.join("plan.json").exists(), "another copy has removed this one's");
        Ok(verdict(vec![plain("rotor-inflow")]))
    }

    fn fisher_z(&self, _flight: &Path, truth: &Scenario) -> Vec<Option<f64>> {
        vec![Some(7.0); truth.hidden.len()]
    }
}

/// Three copies of a shard are at the same flights, each in a folder of its own.
#[test]
fn copies_of_a_flight_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let settings = settings(2, true);
    let places: Vec<Place> = ["a", "b", "c"]
        .map(|scratch| Place {
            scratch: Some(folder.path().join(scratch)),
            ..place(&folder.path().join("table"), true)
        })
        .into();
    let all = std::thread::scope(|scope| {
        let settings = &settings;
        let run =
            |place| scope.spawn(move || run(settings, place, Share::default(), "updraft", &Slow));
        let copies: Vec<_> = places.iter().map(run).collect();
        copies.into_iter().map(|copy| copy.join().unwrap().unwrap()).collect::<Vec<_>>()
    });
    let results = |copy: &Vec<Result<FlightResult, BlindError>>| {
        copy.iter().map(|one| one.as_ref().unwrap().clone()).collect::<Vec<_>>()
    };
    assert!(all.iter().all(|copy| results(copy) == results(&all[0])));
    for index in 0..2 {
        assert!(places[0].work(index).join("verdict.json").exists());
    }
    for place in &places {
        // A copy that found everything done has flown nothing, and has no folder.
        let scratch = place.scratch.as_ref().unwrap();
        let left = std::fs::read_dir(scratch).map_or(0, Iterator::count);
        assert_eq!(left, 0);
    }
}

#[test]
fn a_table_goes_on_where_it_was_interrupted() {
    let folder = tempfile::tempdir().unwrap();
    let place = place(folder.path(), false);
    let settings = settings(3, true);
    let asked = AtomicUsize::new(0);
    let search = Always(&asked);
    let first = run(&settings, &place, Share::default(), "updraft", &search).unwrap();
    let first: Vec<_> = first.into_iter().map(Result::unwrap).collect();
    assert_eq!(asked.load(Ordering::SeqCst), 3);
    assert!(!place.work(0).exists(), "flights that are scored are removed");

    std::fs::remove_file(folder.path().join("flights/00001.json")).unwrap();
    let again = run(&settings, &place, Share::default(), "updraft", &search).unwrap();
    let again: Vec<_> = again.into_iter().map(Result::unwrap).collect();
    assert_eq!(asked.load(Ordering::SeqCst), 4);
    assert_eq!(first, again);

    let outcomes: Vec<_> = first.into_iter().map(|result| result.outcome).collect();
    let made = table(&settings, &outcomes, 0, "updraft");
    let nothing = outcomes.iter().filter(|one| one.hidden.is_empty()).count();
    let alarms = &made.groups[0].metrics[0];
    assert_eq!(alarms.counts, (nothing, nothing));
    let text = render(&made, Style::Text, Some("2026-11-20, commit 0"));
    assert!(text.starts_with("Blind benchmark: TUNING seeds, not a score"), "{text}");
    assert!(render(&made, Style::Markdown, None).contains("| rotor-inflow |"));

    let other = Settings { seed: 4, ..settings };
    let refused =
        run(&other, &place, Share::default(), "updraft", &search).unwrap_err().to_string();
    assert!(refused.contains("flight 0 of another table"), "{refused}");
}

#[test]
fn a_search_that_fails_costs_its_flight_alone() {
    let folder = tempfile::tempdir().unwrap();
    let place = place(folder.path(), true);
    let search = |_: &Path| -> Result<Verdict, Cause> { Err("out of ideas".into()) };
    let settings = Settings { flights: 1, ..settings(3, true) };
    let results = run(&settings, &place, Share::default(), "updraft", &search).unwrap();
    let error = results.into_iter().next().unwrap().unwrap_err();
    assert!(error.to_string().starts_with("no verdict on"), "{error}");
    assert!(place.work(0).join("flight/plan.json").exists());
    assert!(!folder.path().join("flights/00000.json").exists());
}
