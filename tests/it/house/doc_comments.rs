//! Doc comments of public items stand alone: a reader of the API page has no line before them.

#![expect(clippy::unwrap_used, reason = "a test that cannot read the repository fails")]

use std::fs;
use std::path::{Path, PathBuf};

use quote::ToTokens as _;
use syn::{Attribute, Expr, Fields, ImplItem, Item, Lit, Meta, TraitItem, Visibility};

/// Beginnings that lean on another line, or ask where they should say.
const OPENINGS: &[&str] =
    &["The same", "Same", "Why", "What", "So", "Likewise", "Ditto", "As above", "See", "Its"];

/// Derives whose doc comments are a schema's descriptions or a command's help, reviewed there.
const PUBLISHED: &[&str] = &["JsonSchema", "Args", "Parser", "Subcommand", "ValueEnum"];

/// A doc comment and the item that it is about.
struct Doc {
    item: String,
    text: String,
}

/// Doc comments of public items, as they are met.
#[derive(Default)]
struct Docs(Vec<Doc>);

impl Docs {
    fn of(source: &str) -> Vec<Doc> {
        let file = syn::parse_file(source).unwrap();
        let mut docs = Self::default();
        docs.add("the module", &file.attrs);
        docs.items(file.items);
        docs.0
    }

    fn add(&mut self, item: &str, attributes: &[Attribute]) {
        let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
            Meta::NameValue(doc) if doc.path.is_ident("doc") => match &doc.value {
                Expr::Lit(literal) => match &literal.lit {
                    Lit::Str(text) => Some(text.value()),
                    _ => None,
                },
                _ => None,
            },
            _ => None,
        });
        let text: String = lines.collect::<Vec<_>>().join("\n");
        if !text.is_empty() {
            self.0.push(Doc { item: item.to_owned(), text: text.trim().to_owned() });
        }
    }

    fn add_public(&mut self, item: &str, visibility: &Visibility, attributes: &[Attribute]) {
        if matches!(visibility, Visibility::Public(_)) {
            self.add(item, attributes);
        }
    }

    fn items(&mut self, items: Vec<Item>) {
        for item in items {
            match item {
                Item::Const(of) => self.add_public(&of.ident.to_string(), &of.vis, &of.attrs),
                Item::Static(of) => self.add_public(&of.ident.to_string(), &of.vis, &of.attrs),
                Item::Type(of) => self.add_public(&of.ident.to_string(), &of.vis, &of.attrs),
                Item::Fn(of) => self.add_public(&of.sig.ident.to_string(), &of.vis, &of.attrs),
                Item::Struct(of) if !is_published(&of.attrs) => {
                    let name = of.ident.to_string();
                    self.add_public(&name, &of.vis, &of.attrs);
                    self.fields(&name, &of.fields, false);
                }
                Item::Enum(of) if !is_published(&of.attrs) => {
                    let name = of.ident.to_string();
                    self.add_public(&name, &of.vis, &of.attrs);
                    for variant in of.variants {
                        let name = format!("{name}::{}", variant.ident);
                        self.add_public(&name, &of.vis, &variant.attrs);
                        let is_public = matches!(of.vis, Visibility::Public(_));
                        self.fields(&name, &variant.fields, is_public);
                    }
                }
                Item::Trait(of) => {
                    let name = of.ident.to_string();
                    self.add_public(&name, &of.vis, &of.attrs);
                    for item in &of.items {
                        let (of_item, attributes) = match item {
                            TraitItem::Fn(item) => (&item.sig.ident, &item.attrs),
                            TraitItem::Const(item) => (&item.ident, &item.attrs),
                            TraitItem::Type(item) => (&item.ident, &item.attrs),
                            _ => continue,
                        };
                        self.add_public(&format!("{name}::{of_item}"), &of.vis, attributes);
                    }
                }
                Item::Impl(of) => {
                    let name = of.self_ty.to_token_stream().to_string();
                    for item in &of.items {
                        let (of_item, visibility, attributes) = match item {
                            ImplItem::Fn(item) => (&item.sig.ident, &item.vis, &item.attrs),
                            ImplItem::Const(item) => (&item.ident, &item.vis, &item.attrs),
                            _ => continue,
                        };
                        self.add_public(&format!("{name}::{of_item}"), visibility, attributes);
                    }
                }
                Item::Mod(of) if !is_for_tests(&of.attrs) => {
                    self.add_public(&of.ident.to_string(), &of.vis, &of.attrs);
                    self.items(of.content.map(|(_, items)| items).unwrap_or_default());
                }
                _ => {}
            }
        }
    }

    fn fields(&mut self, of: &str, fields: &Fields, all: bool) {
        for field in fields {
            let name = field.ident.as_ref().map(ToString::to_string).unwrap_or_default();
            if all || matches!(field.vis, Visibility::Public(_)) {
                self.add(&format!("{of}::{name}"), &field.attrs);
            }
        }
    }
}

fn is_published(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = attribute.meta.to_token_stream().to_string();
        !attribute.path().is_ident("doc")
            && text.contains("derive")
            && PUBLISHED.iter().any(|name| text.contains(name))
    })
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.meta.to_token_stream().to_string().contains("test")
    })
}

/// What is wrong with a doc comment.
fn fault(text: &str) -> Option<&'static str> {
    let opens = |opening: &&str| {
        text.strip_prefix(*opening).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
    };
    if OPENINGS.iter().any(opens) {
        return Some("does not stand alone");
    }
    let words = text.split_whitespace().filter(|word| word.contains(char::is_alphanumeric));
    let has_unit = text.contains([',', '`']) || text.contains(|c: char| c.is_ascii_digit());
    (words.count() <= 2 && !has_unit).then_some("says too little")
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.ends_with("tests") {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !path.ends_with("tests.rs")
        {
            found.push(path);
        }
    }
}

#[test]
fn public_items_are_documented_on_their_own() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    for member in fs::read_dir(root.join("crates")).unwrap() {
        sources(&member.unwrap().path().join("src"), &mut files);
    }
    let (mut faults, mut count) = (Vec::new(), 0);
    for file in files {
        let name = file.strip_prefix(root).unwrap().display().to_string();
        for Doc { item, text } in Docs::of(&fs::read_to_string(&file).unwrap()) {
            count += 1;
            let first = text.lines().next().unwrap_or_default();
            faults.extend(fault(&text).map(|fault| format!("{name}: {item}: \"{first}\" {fault}")));
        }
    }
    assert!(count > 1000, "the rooms have moved: only {count} doc comments were found");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_bad_kinds_are_found() {
    let source = "
//! The same for modules.

/// Why.
pub fn why() {}

/// Why.
fn private() {}

/// An error of something.
#[derive(Debug)]
pub enum Error {
    /// Why.
    Variant {
        /// What was asked.
        reason: String,
    },
}

/// A vehicle and its load.
pub struct Vehicle {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Its name.
    pub name: String,
    /// Why.
    hidden: bool,
}

impl Vehicle {
    /// North.
    pub fn north(&self) {}
}

/// What a schema describes.
#[cfg_attr(feature = \"schemars\", derive(JsonSchema))]
pub struct Published {
    /// Why.
    pub reason: String,
}

#[cfg(test)]
mod tests {
    /// Why.
    pub fn helper() {}
}
";
    let docs = Docs::of(source);
    let bad = docs.iter().filter(|doc| fault(&doc.text).is_some()).map(|doc| doc.item.as_str());
    assert_eq!(
        bad.collect::<Vec<_>>(),
        [
            "the module",
            "why",
            "Error::Variant",
            "Error::Variant::reason",
            "Vehicle::name",
            "Vehicle::north"
        ]
    );
    assert_eq!(docs.len(), 9);
    assert_eq!(fault("Whatever else a show holds."), None);
    assert_eq!(fault("Velocity, m/s."), None);
}
