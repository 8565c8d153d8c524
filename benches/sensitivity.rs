//! Gathering the finished campaigns of a large sensitivity study: records read, tables written, indices made.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot write its files fails")]

use std::fs;
use std::path::Path;

use divan::{Bencher, black_box};
use updraft::base::shard::Share;
use updraft::study::sensitivity::{
    Done, ITEM_SCHEMA, Item, ItemRecord, Level, NotDone, Outcome, SensitivityPlan, SensitivityWork,
    evaluate, item_path,
};
use updraft::workflow::sensitivity::write;

fn main() {
    divan::main();
}

/// The built-in study with 10^5 campaigns.
fn study() -> SensitivityPlan {
    let text = include_str!("../templates/sensitivity.toml");
    let large = text.replace("samples = 16 ", "samples = 10000 ");
    SensitivityPlan::parse("templates/sensitivity.toml", &large).unwrap()
}

/// Writes made-up records of all campaigns.
fn fill(study: &SensitivityPlan, folder: &Path) {
    let drawn = study.drawn(1);
    for index in 0..drawn.len() {
        let item = drawn.item(index);
        let level = |factor: usize| item.levels[factor].number().unwrap();
        let rms = 0.1 + 0.03 * level(0) + 0.2 * level(1) + 0.1 / level(3);
        let outcome = Outcome {
            rms_mps: Some(rms),
            zero_rms_mps: Some(level(1)),
            ratio_to_zero: Some(rms / level(1)),
            coverage: Some(0.9 + 0.1 * (item.seed % 1000) as f64 / 1000.0),
            drones: 16,
            values: 2000,
            ..Outcome::default()
        };
        let json = |level| serde_json::to_value::<&Level>(level);
        let levels = study.factors.iter().zip(&item.levels);
        let record = ItemRecord {
            schema: ITEM_SCHEMA.to_owned(),
            key: study.key(&item).unwrap(),
            item: index as u64,
            seed: item.seed,
            levels: levels.map(|(f, level)| (f.name.clone(), json(level).unwrap())).collect(),
            outcome: Some(outcome),
            lost: None,
            warnings: Vec::new(),
        };
        let path = item_path(folder, index);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, serde_json::to_vec(&record).unwrap()).unwrap();
    }
}

#[divan::bench(sample_count = 3)]
fn gather_100000_campaigns(bencher: Bencher<'_, '_>) {
    let study = study();
    let folder = tempfile::tempdir().unwrap();
    fill(&study, folder.path());
    bencher.bench(|| {
        let work =
            SensitivityWork::open(&study, folder.path(), 1, false, Share::default()).unwrap();
        assert_eq!(work.open_items(&|_| true), 0);
        let nothing = |_: &Item| -> Result<Done, NotDone> { unreachable!("all are finished") };
        let stop = std::sync::atomic::AtomicBool::new(false);
        let gathered = work.fly(&|_| true, &nothing, &stop, &|| {}).unwrap();
        let result = evaluate(&study, 1, &gathered);
        write(folder.path(), String::new(), &study, &gathered, &result).unwrap();
        black_box(result)
    });
}
