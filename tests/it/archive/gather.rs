//! What is gathered, and what is left as it is.

use std::fs;

use updraft::campaign::lock::FolderLock;

use crate::archive::support::{Campaign, DRONES, SECONDS, archive, outcomes, parts, table};
use crate::cli::support::{Bench, contents};

fn pairs(of: &[(&str, &str)]) -> Vec<(String, String)> {
    of.iter().map(|(name, outcome)| ((*name).to_owned(), (*outcome).to_owned())).collect()
}

#[test]
fn a_campaign_is_gathered_with_all_its_rows() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("june"));
    let said = archive(&bench, 0, &["june"]);
    assert_eq!(outcomes(&said), pairs(&[("june", "added")]));
    let id = said["campaigns"][0]["campaign"].as_str().unwrap();
    assert!(id.starts_with("june-"), "{id}");
    let place = bench.path("archive");
    for name in ["flights", "drones", "thermals", "verdicts", "seconds"] {
        let part = format!("{name}/date=2026-06-01/campaign={id}/part.parquet");
        assert_eq!(parts(&place, name), [part]);
    }
    let (_, flights) = table(&place, "flights");
    assert_eq!(flights.len(), 2);
    assert!(flights[1].contains("purpose: \"measurement\", simulated: false"), "{}", flights[1]);
    assert!(flights[1].contains("start_utc: 2026-06-01 09:30:00.000 +00:00"), "{}", flights[1]);
    let (_, drones) = table(&place, "drones");
    assert!(drones[1].contains("slot: 2, drone: \"Drone 2\", airframe: \"12\""), "{}", drones[1]);
    let (_, seconds) = table(&place, "seconds");
    assert_eq!(seconds.len(), (DRONES + 1) * SECONDS, "and the drone without a log");
    assert!(
        seconds[0].contains("time_s: 95.0, utc: 2026-06-01 09:31:35.000 +00:00"),
        "{}",
        seconds[0]
    );
    // The same values as the table of the campaign has.
    let analysis = Campaign::on_day(0).analysis;
    let first = updraft::products::fields::rows(&analysis).next().unwrap();
    for (name, value) in
        [("w_mps", first.w_mps), ("low_mps", first.low_mps), ("truth_mps", first.truth_mps)]
    {
        let read = seconds[0].split(&format!(" {name}: ")).nth(1).unwrap();
        let read = read.split([',', '}']).next().unwrap();
        assert_eq!(read.parse().ok(), value, "{name}: {}", seconds[0]);
    }
    let filled = seconds.last().unwrap();
    assert!(filled.contains("drone: \"slot 48\", airframe: \"58\""), "{filled}");
    assert!(filled.contains("w_mps: null") && filled.contains("flags: \"filled\""), "{filled}");
}

#[test]
fn only_what_has_changed_is_gathered_again_and_what_is_gone_stays_until_it_is_pruned() {
    let bench = Bench::new();
    for (day, name) in ["a", "b", "c"].iter().enumerate() {
        Campaign::on_day(day as i64).write(&bench.path(&format!("season/{name}")));
    }
    let said = archive(&bench, 0, &["season"]);
    assert_eq!(outcomes(&said), pairs(&[("a", "added"), ("b", "added"), ("c", "added")]));
    let before = contents(&bench.path("archive"));
    let said = archive(&bench, 0, &["season"]);
    let unchanged = pairs(&[("a", "unchanged"), ("b", "unchanged"), ("c", "unchanged")]);
    assert_eq!(outcomes(&said), unchanged);
    assert!(contents(&bench.path("archive")) == before, "nothing was written");

    let mut changed = Campaign::on_day(1);
    changed.analysis.title = "again".to_owned();
    changed.write(&bench.path("season/b"));
    fs::remove_dir_all(bench.path("season/c")).unwrap();
    let said = archive(&bench, 0, &["season"]);
    assert_eq!(outcomes(&said), pairs(&[("a", "unchanged"), ("b", "replaced")]));
    assert_eq!(said["held"], 3);
    let (_, flights) = table(&bench.path("archive"), "flights");
    assert_eq!(flights.iter().filter(|row| row.contains("title: \"again\"")).count(), 2);
    assert_eq!(flights.len(), 6, "the campaign that is gone is still there");

    let said = archive(&bench, 0, &["season", "--prune"]);
    let pruned = pairs(&[("a", "unchanged"), ("b", "unchanged"), ("c", "pruned")]);
    assert_eq!(outcomes(&said), pruned);
    assert_eq!(table(&bench.path("archive"), "flights").1.len(), 4);
    assert!(!bench.path("archive/flights/date=2026-06-03").exists(), "no empty folder is left");
    archive(&bench, 0, &["--prune"]);
}

#[test]
fn a_file_that_was_lost_from_the_archive_comes_back() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("june"));
    archive(&bench, 0, &["june"]);
    let part = parts(&bench.path("archive"), "seconds").remove(0);
    fs::remove_file(bench.path("archive").join(&part)).unwrap();
    assert_eq!(outcomes(&archive(&bench, 0, &["june"])), pairs(&[("june", "replaced")]));
    assert!(bench.path("archive").join(&part).is_file());
    // One that was cut short, too.
    let whole = fs::read(bench.path("archive").join(&part)).unwrap();
    fs::write(bench.path("archive").join(&part), &whole[..whole.len() / 2]).unwrap();
    assert_eq!(outcomes(&archive(&bench, 0, &["june"])), pairs(&[("june", "replaced")]));
    assert_eq!(fs::read(bench.path("archive").join(part)).unwrap(), whole);
}

#[test]
fn copies_under_other_names_count_once_and_a_lost_disk_prunes_nothing() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("data/june"));
    Campaign::on_day(0).write(&bench.path("data/june (copy)"));
    let said = archive(&bench, 0, &["data"]);
    assert_eq!(outcomes(&said), pairs(&[("june", "added"), ("june (copy)", "copy")]));
    assert_eq!(said["held"], 1);
    // Renamed, it is the same campaign.
    fs::remove_dir_all(bench.path("data/june")).unwrap();
    let said = archive(&bench, 0, &["data", "--prune"]);
    assert_eq!(outcomes(&said), pairs(&[("june (copy)", "unchanged")]));
    assert_eq!(said["held"], 1);
    fs::rename(bench.path("data"), bench.path("elsewhere")).unwrap();
    fs::create_dir(bench.path("data")).unwrap();
    let refused = bench.expect(2, &["archive", "data", "--prune"]);
    assert!(refused.err.contains("would remove every campaign"), "{refused}");
    assert_eq!(parts(&bench.path("archive"), "flights").len(), 1);
}

#[test]
fn campaigns_of_the_same_name_do_not_meet_and_copies_count_once() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("2026/may/my-campaign"));
    Campaign::on_day(30).write(&bench.path("2026/june/my-campaign"));
    Campaign::on_day(0).write(&bench.path("backup/my-campaign"));
    let said = archive(&bench, 0, &["2026", "backup"]);
    let outcome: Vec<String> = outcomes(&said).into_iter().map(|(_, outcome)| outcome).collect();
    assert_eq!(outcome, ["added", "added", "copy"]);
    assert_eq!(said["held"], 2);
    // Moved, it is the same campaign.
    fs::rename(bench.path("2026/may"), bench.path("2026/spring")).unwrap();
    fs::remove_dir_all(bench.path("backup")).unwrap();
    let said = archive(&bench, 0, &["2026", "--prune"]);
    let unchanged = pairs(&[("my-campaign", "unchanged"), ("my-campaign", "unchanged")]);
    assert_eq!(outcomes(&said), unchanged);
    assert_eq!(said["held"], 2);
}

#[test]
fn a_folder_that_is_flown_again_in_the_field_is_another_campaign() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("meadow"));
    archive(&bench, 0, &["meadow"]);
    Campaign::on_day(7).write(&bench.path("meadow"));
    let said = archive(&bench, 0, &["meadow"]);
    assert_eq!(outcomes(&said), pairs(&[("meadow", "added")]));
    assert_eq!(said["held"], 2);
    // Its old flight is in its folder no more.
    let said = archive(&bench, 0, &["meadow", "--prune"]);
    assert_eq!(said["held"], 1);
    assert_eq!(parts(&bench.path("archive"), "flights").len(), 1);
}

#[test]
fn a_simulated_campaign_is_gathered_and_flown_again_replaces_itself() {
    let bench = Bench::new();
    bench.fly();
    bench.expect(0, &["analyze", "campaign"]);
    let said = archive(&bench, 0, &["campaign"]);
    let place = bench.path("archive");
    let (_, drones) = table(&place, "drones");
    assert_eq!(drones.len(), 2, "{drones:?}");
    assert!(drones[0].contains("airframe: \"sim 1:1\""), "{}", drones[0]);
    let law = drones[0].split("a_us_per_mps2: ").nth(1).unwrap().split(',').next().unwrap();
    let analysis = fs::read(bench.path("campaign/analysis.json")).unwrap();
    let analysis: serde_json::Value = serde_json::from_slice(&analysis).unwrap();
    let fit = &analysis["flights"][0]["drones"][0]["laws"]["signed_quadratic"];
    let wanted = &fit["parameters"][0]["estimate"]["value"];
    assert_eq!(law.parse().ok(), wanted.as_f64());
    let (_, flights) = table(&place, "flights");
    assert!(flights[0].contains("simulated: true"), "{}", flights[0]);
    let id = &said["campaigns"][0]["campaign"];

    bench.expect(0, &["simulate", "campaign", "--seed", "2", "--force"]);
    bench.expect(0, &["analyze", "campaign"]);
    let said = archive(&bench, 0, &["campaign"]);
    assert_eq!(outcomes(&said), pairs(&[("campaign", "replaced")]));
    assert_ne!(&said["campaigns"][0]["campaign"], id);
    assert_eq!(said["held"], 1);
    let (_, drones) = table(&place, "drones");
    assert!(drones.len() == 2 && drones[0].contains("airframe: \"sim 2:1\""), "{drones:?}");
}

#[test]
fn flights_whose_start_nobody_knows_have_no_date() {
    let bench = Bench::new();
    let mut campaign = Campaign::on_day(0);
    campaign.is_recorded = false;
    campaign.write(&bench.path("june"));
    let campaign = Campaign { analysis: crate::archive::support::small(), ..Campaign::on_day(0) };
    campaign.analyse_again(&bench.path("june"));
    archive(&bench, 0, &["june"]);
    let part = parts(&bench.path("archive"), "seconds").remove(0);
    assert!(part.starts_with("seconds/date=__HIVE_DEFAULT_PARTITION__/campaign=june-"), "{part}");
    let (_, seconds) = table(&bench.path("archive"), "seconds");
    assert!(seconds[0].contains("utc: null"), "{}", seconds[0]);
}

#[test]
fn a_second_archive_waits_outside() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("june"));
    let lock = FolderLock::take(&bench.path("archive")).unwrap();
    let refused = bench.expect(6, &["archive", "june"]);
    assert!(refused.err.contains("another updraft is writing into archive"), "{refused}");
    drop(lock);
    bench.expect(0, &["archive", "june"]);
}
