//! Examples of the documents, run in the order of each block, in a folder of its own.

use std::fs;
use std::path::{Path, PathBuf};

use super::blocks::{Example, in_blocks, in_sentences};
use super::read::{own_words, read};
use super::table::{BEFORE, How, RULES, Rule, Step};
use crate::cli::support::Bench;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README and the pages of docs/.
fn documents() -> Vec<String> {
    let pages = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = pages.filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    let name = |path: PathBuf| format!("docs/{}", path.file_name().unwrap().to_str().unwrap());
    let mut all: Vec<String> = pages.map(name).collect();
    all.push("README.md".to_owned());
    all.sort();
    all
}

fn text(document: &str) -> String {
    fs::read_to_string(root().join(document)).unwrap()
}

fn rule_of(example: &Example) -> Option<&'static Rule> {
    let fits =
        |rule: &&Rule| rule.document == example.document && example.text.starts_with(rule.begins);
    RULES.iter().find(fits)
}

/// The words with these options: in place of their values where they are given, else at the end.
fn with_options(mut words: Vec<String>, options: &[&str]) -> Vec<String> {
    let mut options = options.iter().peekable();
    while let Some(option) = options.next() {
        let value = options.next_if(|word| !word.starts_with('-'));
        let at = words.iter().position(|word| word == option);
        match (at, value) {
            (Some(at), Some(value)) => (*value).clone_into(&mut words[at + 1]),
            (Some(_), None) => {}
            (None, _) => {
                words.push((*option).to_owned());
                words.extend(value.map(|value| (*value).to_owned()));
            }
        }
    }
    words
}

fn step(bench: &Bench, document: &str, step: Step) {
    match step {
        Step::Run(command) => {
            bench.expect(0, &command.split(' ').collect::<Vec<_>>());
        }
        Step::Move(from, to) => {
            let to = bench.path(to);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::rename(bench.path(from), to).unwrap();
        }
        Step::Block(language, file) => {
            let text = text(document);
            let begins = format!("```{language}\n");
            let block = text.split_once(&begins).unwrap().1.split_once("```").unwrap().0;
            fs::write(bench.path(file), block).unwrap();
        }
    }
}

/// Runs the examples of a document.
fn run_document(document: &str) {
    let mut bench = (0, Bench::new());
    let mut prepared = Vec::new();
    for example in in_blocks(document, &text(document)) {
        let block = example.block.unwrap();
        if bench.0 != block {
            bench = (block, Bench::new());
        }
        let bench = &bench.1;
        let rule = rule_of(&example);
        let words = match rule.map(|rule| rule.how) {
            Some(How::Other(_)) => {
                assert_eq!(own_words(&example.text), None, "{example}");
                continue;
            }
            Some(How::Read(_)) => {
                assert!(own_words(&example.text).is_some(), "{example}");
                read(&example).unwrap();
                continue;
            }
            Some(How::With(options)) => with_options(own_words(&example.text).unwrap(), options),
            Some(How::Instead(what, by)) => {
                let replaced = |word: String| if word == what { by.to_owned() } else { word };
                own_words(&example.text).unwrap().into_iter().map(replaced).collect()
            }
            None => own_words(&example.text).unwrap_or_else(|| {
                panic!("{example}\n  say in tests/it/docs/table.rs how it is tested")
            }),
        };
        for (index, before) in BEFORE.iter().enumerate() {
            let is_for = before.document == document && example.text.starts_with(before.begins);
            if is_for && !prepared.contains(&index) {
                prepared.push(index);
                before.steps.iter().for_each(|one| step(bench, document, *one));
            }
        }
        let words: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
        let ended = bench.run(&words);
        assert_eq!(ended.code, Some(0), "{example}\n{ended}");
    }
}

#[test]
fn readme() {
    run_document("README.md");
}

#[test]
fn air() {
    run_document("docs/air.md");
}

#[cfg(feature = "parquet")]
#[test]
fn archive() {
    run_document("docs/archive.md");
}

#[test]
fn other_documents() {
    let own = ["README.md", "docs/air.md", "docs/archive.md"];
    documents()
        .iter()
        .filter(|name| !own.contains(&name.as_str()))
        .for_each(|name| run_document(name));
}

#[test]
fn commands_in_sentences_are_the_programs() {
    let all = documents().into_iter().flat_map(|name| in_sentences(&name, &text(&name)));
    let wrong: Vec<String> = all.filter_map(|example| read(&example).err()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_rule_is_for_nothing() {
    let all: Vec<Example> =
        documents().iter().flat_map(|name| in_blocks(name, &text(name))).collect();
    assert!(all.len() > 50, "{}", all.len());
    let is_for = |document: &str, begins: &str| {
        all.iter().any(|one| one.document == document && one.text.starts_with(begins))
    };
    for rule in RULES {
        assert!(is_for(rule.document, rule.begins), "{}: {}", rule.document, rule.begins);
    }
    for before in BEFORE {
        assert!(is_for(before.document, before.begins), "{}: {}", before.document, before.begins);
    }
    let reasons = RULES.iter().filter_map(|rule| match rule.how {
        How::Read(why) | How::Other(why) => Some(why),
        _ => None,
    });
    assert!(reasons.into_iter().all(|why| !why.is_empty()));
}
