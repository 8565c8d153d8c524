//! Inputs that statistics cannot be made of, each with its reason; and the same numbers on any number
//! of threads.

use crate::statistics::support::{field, flight, grid, simulator};
use updraft::analysis::statistics::result::FieldStatistics;
use updraft::analysis::statistics::{FieldInput, StatisticsOptions, field_statistics};

const FEW: StatisticsOptions = StatisticsOptions { flights: 40, seed: 3, variants: true };

fn good(side: u32, seconds: usize) -> FieldInput {
    let places = grid(side);
    let air = simulator(&places, field([60.0; 2], 30.0, 0.1), seconds, 10);
    flight(&places, &air, 10, 9, |_| 0.0)
}

fn refused(input: &FieldInput) -> String {
    let found = field_statistics(input, &FEW);
    assert!(found.space.is_none() && found.time.is_none() && found.likelihood.is_none());
    assert!(found.simulated.is_none() && found.variants.is_empty());
    found.absent.join("\n")
}

#[test]
fn what_says_nothing_is_refused_with_the_reason() {
    let whole = good(2, 120);
    let mut two = whole.clone();
    two.places_m.truncate(2);
    two.values_mps.truncate(2);
    let one_place = FieldInput { places_m: vec![[1.0, 2.0]; 4], ..whole.clone() };
    let constant = FieldInput { values_mps: vec![vec![Some(0.3); 120]; 4], ..whole.clone() };
    let nowhere = FieldInput { places_m: vec![[f64::NAN; 2]; 4], ..whole.clone() };
    let no_values = FieldInput { values_mps: vec![vec![Some(f64::NAN); 120]; 4], ..whole.clone() };
    let sparse = FieldInput {
        values_mps: whole
            .values_mps
            .iter()
            .map(|row| row.iter().enumerate().map(|(i, v)| v.filter(|_| i % 3 == 0)).collect())
            .collect(),
        ..whole.clone()
    };
    let told: Vec<String> = [
        ("nothing", FieldInput::default()),
        ("59 s", good(2, 59)),
        ("two drones", two),
        ("one place", one_place),
        ("constant", constant),
        ("unknown places", nowhere),
        ("not a number", no_values),
        ("a third of the seconds", sparse),
    ]
    .iter()
    .map(|(name, input)| format!("{name}:\n{}", refused(input)))
    .collect();
    insta::assert_snapshot!(told.join("\n\n"));
}

#[test]
fn gaps_and_a_lost_drone_leave_the_rest() {
    let mut input = good(4, 200);
    input.values_mps[5] = vec![None; 200];
    for row in input.values_mps.iter_mut().take(3) {
        row[40..52].fill(None);
    }
    input.values_mps[7][100] = Some(f64::INFINITY);
    let found = field_statistics(&input, &FEW);
    assert_eq!(found.record.drones, 15);
    assert!((found.record.missing_share - 37.0 / 3000.0).abs() < 1e-9);
    let whole = field_statistics(&good(4, 200), &FEW);
    let lambda = |found: &FieldStatistics| found.likelihood.as_ref().unwrap().lambda_m.value;
    let ratio = lambda(&found) / lambda(&whole);
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
    let said = |words: &str| found.absent.iter().any(|reason| reason.contains(words));
    assert!(
        said("1 drone with values in less than half of the 200 s is not in the correlations"),
        "{:?}",
        found.absent
    );
}

#[test]
fn a_line_of_drones_has_one_direction() {
    let mut input = good(4, 200);
    input.places_m.truncate(4);
    input.values_mps.truncate(4);
    let found = field_statistics(&input, &FEW);
    let space = found.space.as_ref().unwrap();
    assert!(space.along_x.is_none() && space.along_y.is_some() && space.anisotropy.is_none());
    assert!(found.absent.iter().any(|one| one.starts_with("no correlation along x")));
}

#[test]
fn a_large_fleet_is_thinned() {
    let mut input = good(4, 80);
    let rows = input.values_mps.clone();
    input.places_m = grid(15);
    input.values_mps = (0..225).map(|i| rows[i % 16].clone()).collect();
    let found = field_statistics(&input, &StatisticsOptions { flights: 0, ..FEW });
    assert_eq!(found.record.drones, 64);
    assert!((found.record.spacing_m - 14.0).abs() < 1e-9, "every second row and column");
    assert!(found.absent.iter().any(|one| one.contains("64 of 225 drones")));
}

#[test]
fn threads_do_not_change_a_digit() {
    let input = good(4, 200);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| field_statistics(&input, &FEW))
    };
    let one = on(1);
    assert_eq!(one, on(3));
    assert!(one.simulated.as_ref().unwrap().flights == 40);
    let other = field_statistics(&input, &StatisticsOptions { seed: 4, ..FEW });
    let interval = |found: &FieldStatistics| found.likelihood.as_ref().unwrap().tau_s.interval_95;
    assert_ne!(interval(&one), interval(&other), "the seed matters");
}

#[test]
fn every_number_has_its_sentence() {
    let found = field_statistics(&good(5, 300), &FEW);
    let (space, time) = (found.space.as_ref().unwrap(), found.time.as_ref().unwrap());
    let words = [
        space.words.clone(),
        space.anisotropy.as_ref().unwrap().words.clone(),
        time.words.clone(),
        time.half_record.as_ref().unwrap().words.clone(),
        found.simulated.as_ref().unwrap().words.clone(),
    ];
    insta::assert_snapshot!(words.join("\n"));
}
