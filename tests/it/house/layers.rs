//! Dependencies between the rooms point one way, and some things are done in one place only.
//!
//! Judged on syntax: comments, strings and test modules do not count, and imports are followed through
//! their braces.

#![expect(clippy::unwrap_used, reason = "a test that cannot read the repository fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::sources;
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens as _;
use syn::{Attribute, ImplItem, Item, UseTree};

/// Each room and those it may use. Crates are not listed: the compiler holds them.
const ALLOWED: &[(&str, &[&str])] = &[
    ("base", &[]),
    ("numeric", &[]),
    ("mission", &["base", "numeric"]),
    ("les", &["base"]),
    ("skybrush_server", &["base"]),
    ("campaign", &["base", "mission"]),
    ("fleet", &["base", "numeric", "mission", "campaign", "flight"]),
    ("virtual_fleet", &["base", "mission"]),
    ("flight", &["base", "numeric", "mission"]),
    ("analysis", &["base", "numeric", "mission", "flight"]),
    ("gap", &["base", "numeric", "mission", "flight", "analysis"]),
    ("blind", &["base", "numeric", "mission", "campaign", "flight", "analysis", "gap"]),
    ("study", &["base", "numeric", "mission", "flight", "analysis"]),
    ("compare", &["base", "numeric", "mission", "flight", "analysis"]),
    ("archive", &["base", "numeric", "mission", "campaign", "fleet", "flight", "analysis", "gap"]),
    ("products", &["base", "numeric", "mission", "flight", "analysis"]),
    ("mast", &["base", "numeric", "flight", "analysis", "products"]),
    (
        "report",
        &[
            "base", "numeric", "mission", "flight", "analysis", "gap", "study", "compare",
            "products", "mast",
        ],
    ),
    ("live", &["base", "numeric", "mission", "campaign", "fleet", "flight", "analysis"]),
    (
        "workflow",
        &[
            "base",
            "numeric",
            "mission",
            "les",
            "live",
            "skybrush_server",
            "campaign",
            "fleet",
            "virtual_fleet",
            "flight",
            "analysis",
            "gap",
            "blind",
            "study",
            "compare",
            "products",
            "mast",
            "report",
            "archive",
        ],
    ),
];

/// The room of arguments, terminal and exit codes: it may use all others.
const FRONT: &str = "cli";

/// A file's code without what is compiled for tests alone.
struct Code {
    path: PathBuf,
    /// Paths that are imported, each from its first segment on.
    imports: Vec<Vec<String>>,
    /// All other tokens.
    tokens: Vec<String>,
}

/// `#[cfg(test)]` and its like.
fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().filter(|attribute| attribute.path().is_ident("cfg")).any(|attribute| {
        let words = flat(attribute.meta.to_token_stream());
        words.iter().any(|word| word == "test") && !words.iter().any(|word| word == "not")
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Tokens one after the other, brackets too.
fn flat(stream: TokenStream) -> Vec<String> {
    let mut tokens = Vec::new();
    for tree in stream {
        match tree {
            TokenTree::Group(group) => {
                let [open, close] = match group.delimiter() {
                    proc_macro2::Delimiter::Parenthesis => ["(", ")"],
                    proc_macro2::Delimiter::Brace => ["{", "}"],
                    proc_macro2::Delimiter::Bracket => ["[", "]"],
                    proc_macro2::Delimiter::None => ["", ""],
                };
                tokens.push(open.to_owned());
                tokens.extend(flat(group.stream()));
                tokens.push(close.to_owned());
            }
            tree => tokens.push(tree.to_string()),
        }
    }
    tokens
}

fn imports_of(tree: &UseTree, before: &[String], imports: &mut Vec<Vec<String>>) {
    let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
    match tree {
        UseTree::Path(path) => imports_of(&path.tree, &with(&path.ident), imports),
        UseTree::Name(name) => imports.push(with(&name.ident)),
        UseTree::Rename(name) => imports.push(with(&name.ident)),
        UseTree::Glob(_) => imports.push(before.to_vec()),
        UseTree::Group(group) => {
            group.items.iter().for_each(|tree| imports_of(tree, before, imports));
        }
    }
}

/// Takes items in; `tests`: files that are compiled for tests alone.
fn take(items: Vec<Item>, folder: &Path, code: &mut Code, tests: &mut BTreeSet<PathBuf>) {
    for item in items {
        let for_tests = is_for_tests(attributes(&item));
        match item {
            Item::Mod(module) if module.content.is_none() => {
                if for_tests {
                    tests.insert(folder.join(format!("{}.rs", module.ident)));
                }
            }
            _ if for_tests => {}
            Item::Mod(module) => {
                let items = module.content.map(|(_, items)| items).unwrap_or_default();
                take(items, &folder.join(module.ident.to_string()), code, tests);
            }
            Item::Use(item) => imports_of(&item.tree, &[], &mut code.imports),
            Item::Impl(mut item) => {
                item.items.retain(|item| match item {
                    ImplItem::Fn(item) => !is_for_tests(&item.attrs),
                    _ => true,
                });
                code.tokens.extend(flat(item.into_token_stream()));
            }
            item => code.tokens.extend(flat(item.into_token_stream())),
        }
    }
}

/// All code below a folder that is not for tests alone.
fn code_below(root: &Path) -> Vec<Code> {
    let mut files = Vec::new();
    sources(root, &mut files);
    files.sort();
    let (mut all, mut tests) = (Vec::new(), BTreeSet::new());
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        let file =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let stem = path.file_stem().unwrap();
        let above = path.parent().unwrap();
        let is_root = ["mod", "lib", "main"].iter().any(|root| stem == *root);
        let folder = if is_root { above.to_owned() } else { above.join(stem) };
        let mut code = Code { path, imports: Vec::new(), tokens: Vec::new() };
        take(file.items, &folder, &mut code, &mut tests);
        all.push(code);
    }
    all.retain(|code| !tests.contains(&code.path));
    all
}

impl Code {
    /// Whether these tokens stand in it, one after the other.
    fn has(&self, sequence: &[&str]) -> bool {
        self.tokens.windows(sequence.len()).any(|window| window.iter().eq(sequence))
    }

    /// Whether it names this crate, or anything of it.
    fn names_crate(&self, name: &str) -> bool {
        let imported = self.imports.iter().any(|path| path[0] == name);
        imported || self.has(&[name, ":", ":"])
    }

    /// The rooms that it names by their paths from the crate's root. `rooms_deep`: how many `super` lead
    /// out of its own room.
    fn rooms(&self, rooms_deep: usize) -> BTreeSet<String> {
        let mut rooms = BTreeSet::new();
        for path in &self.imports {
            let above = path.iter().take_while(|part| *part == "super").count();
            match path[0].as_str() {
                "crate" => rooms.extend(path.get(1).cloned()),
                "super" if above > rooms_deep => rooms.extend(path.get(above).cloned()),
                _ => {}
            }
        }
        for window in self.tokens.windows(4) {
            if window[..3] == ["crate", ":", ":"] {
                rooms.insert(window[3].clone());
            }
        }
        rooms
    }
}

/// All code of the library and the program, read once.
fn house() -> &'static [Code] {
    static HOUSE: OnceLock<Vec<Code>> = OnceLock::new();
    HOUSE.get_or_init(|| code_below(&repository().join("src")))
}

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// How many `super` stay in the room.
fn depth(path: &Path, room: &Path) -> usize {
    let below = path.strip_prefix(room).unwrap();
    let is_root = path.ends_with("mod.rs");
    below.components().count() - usize::from(is_root)
}

#[test]
fn no_room_uses_one_behind_it() {
    let allowed: BTreeMap<_, _> = ALLOWED.iter().copied().collect();
    let root = repository().join("src");
    let library = syn::parse_file(&fs::read_to_string(root.join("lib.rs")).unwrap()).unwrap();
    let rooms: BTreeSet<String> = library
        .items
        .iter()
        .filter_map(|item| match item {
            Item::Mod(module) => Some(module.ident.to_string()),
            _ => None,
        })
        .collect();
    assert!(rooms.contains(FRONT) && rooms.contains("workflow"), "rooms have moved: {rooms:?}");
    let mut against = Vec::new();
    for room in rooms.iter().filter(|room| *room != FRONT) {
        let Some(may_use) = allowed.get(room.as_str()) else {
            against.push(format!("{room} has no place among the rooms: add it to ALLOWED"));
            continue;
        };
        let folder = root.join(room);
        for code in house().iter().filter(|code| code.path.starts_with(&folder)) {
            for named in code.rooms(depth(&code.path, &folder)) {
                let may = named == *room || may_use.contains(&named.as_str());
                if rooms.contains(&named) && !may {
                    against.push(format!("{} uses {named}", code.path.display()));
                }
            }
        }
    }
    assert!(against.is_empty(), "{}", against.join("\n"));
}

/// Crates that are the command line's alone.
const OF_THE_FRONT: &[&str] =
    &["clap", "clap_complete", "clap_mangen", "ctrlc", "indicatif", "signal_hook", "terminal_size"];

/// What only the command line does.
const DONE_IN_FRONT: &[&[&str]] = &[
    &["print", "!"],
    &["println", "!"],
    &["eprint", "!"],
    &["eprintln", "!"],
    &["stdin", "("],
    &["stdout", "("],
    &["stderr", "("],
    &["is_terminal", "("],
    &["process", ":", ":", "exit"],
    &["process", ":", ":", "abort"],
    &["env", ":", ":", "args"],
    &["ExitCode"],
];

#[test]
fn arguments_terminal_and_exit_codes_are_the_command_lines() {
    let root = repository().join("src");
    let mut against = Vec::new();
    let mut front_has = false;
    for code in house() {
        let shown = code.path.strip_prefix(&root).unwrap();
        let is_front = shown.starts_with(FRONT) || shown == Path::new("main.rs");
        for name in OF_THE_FRONT.iter().filter(|name| code.names_crate(name)) {
            front_has |= is_front;
            if !is_front {
                against.push(format!("{} uses {name}", shown.display()));
            }
        }
        for what in DONE_IN_FRONT.iter().filter(|what| !is_front && code.has(what)) {
            against.push(format!("{} has {}", shown.display(), what.concat()));
        }
    }
    assert!(front_has, "the command line has moved");
    assert!(against.is_empty(), "{}", against.join("\n"));
}

/// What passes on the text of others as it is, what to use instead, and the files that may.
const DOORS: &[(&[&str], &str, &[&str])] = &[
    (&[".", "display", "(", ")"], "base::plain::Shown: `path.shown()`", &[]),
    (
        &["serde_json", ":", ":", "from_"],
        "base::parse::json",
        &["crates/skybrush-show/src/skyc/write.rs", "crates/untrusted-io/src/parse.rs"],
    ),
    (&["toml", ":", ":", "from_str"], "base::parse::toml", &[]),
    (&["stdout", "(", ")", ".", "lock"], "cli::context::Context", &["src/cli/context.rs"]),
    (
        &["stderr", "(", ")", ".", "lock"],
        "cli::context::complain or prompt",
        &["src/cli/context.rs"],
    ),
    (
        &["fs", ":", ":", "read_to_string"],
        "base::file::read_whole, which is bounded",
        &["src/cli/signals.rs"],
    ),
    (&["fs", ":", ":", "read", "("], "base::file::read_whole, which is bounded", &[]),
];

#[test]
fn text_of_others_comes_and_goes_by_its_own_doors() {
    let root = repository();
    let mut crates = Vec::new();
    for of_crate in fs::read_dir(root.join("crates")).unwrap() {
        crates.extend(code_below(&of_crate.unwrap().path().join("src")));
    }
    let mut wrong = Vec::new();
    for code in house().iter().chain(&crates) {
        let name = code.path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
        for (call, instead, may) in DOORS {
            let matches = |window: &[String]| {
                window.iter().zip(*call).all(|(token, wanted)| {
                    // Words that end in an underscore begin several names.
                    token == wanted || wanted.ends_with('_') && token.starts_with(wanted)
                })
            };
            let is_there = code.tokens.windows(call.len()).any(matches);
            if is_there && !may.contains(&name.as_str()) {
                wrong.push(format!("{name}: {}: use {instead}", call.concat()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn code_is_judged_by_its_syntax() {
    let text = r#"
        use crate::{base::file, fleet::{gate, slots::{self, Stand}}};
        use super::super::report::page;
        /// Not `crate::gap::x`, nor clap::Args.
        fn f() { let _ = "crate::study"; format!("{}", crate::blind::seal()); }
        #[cfg(test)]
        mod tests { use crate::cli::run; }
        #[cfg(test)]
        fn g() { crate::sim::fly() }
        impl T { #[cfg(test)] fn h() { println!() } }
    "#;
    let mut code = Code { path: PathBuf::new(), imports: Vec::new(), tokens: Vec::new() };
    let file = syn::parse_file(text).unwrap();
    take(file.items, Path::new(""), &mut code, &mut BTreeSet::new());
    let rooms: Vec<String> = code.rooms(1).into_iter().collect();
    assert_eq!(rooms, ["base", "blind", "fleet", "report"]);
    assert!(!code.names_crate("clap") && !code.has(&["println", "!"]));
}
