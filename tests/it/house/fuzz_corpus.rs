//! The fuzzer's corpus and seeded mutations of it, on the stable toolchain.

use std::fs;
use std::path::Path;

#[path = "../../../fuzz/targets.rs"]
mod targets;

/// Mutations of each input: some seconds for all targets together.
const MUTATIONS: u64 = 400;

/// splitmix64.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// What a fuzzer does: bits flipped, bytes set to extremes, pieces cut, doubled and swapped.
fn mutate(input: &[u8], state: &mut u64) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..=next(state) % 6 {
        let choice = next(state) % 6;
        if bytes.is_empty() {
            bytes.push(next(state) as u8);
            continue;
        }
        let at = (next(state) % bytes.len() as u64) as usize;
        let end = (at + (next(state) % 64) as usize).min(bytes.len());
        match choice {
            0 => bytes[at] ^= 1 << (next(state) % 8),
            1 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff, b'-'][(next(state) % 6) as usize],
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                let to = (next(state) % bytes.len() as u64) as usize;
                bytes.splice(to..to, piece);
            }
            4 => bytes.truncate(at),
            _ => bytes[at..end].fill_with(|| next(state) as u8),
        }
    }
    bytes
}

#[test]
fn every_target_survives_its_corpus_and_mutations_of_it() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    for (name, target) in targets::TARGETS {
        let mut inputs: Vec<_> =
            fs::read_dir(corpus.join(name)).unwrap().map(|entry| entry.unwrap().path()).collect();
        inputs.sort();
        assert!(!inputs.is_empty(), "fuzz/corpus/{name} is empty");
        targets::run(name, &[]);
        for (index, path) in inputs.iter().enumerate() {
            let input = fs::read(path).unwrap();
            target(&input);
            let mut state = index as u64;
            for _ in 0..MUTATIONS {
                target(&mutate(&input, &mut state));
            }
        }
    }
}
