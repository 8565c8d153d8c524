//! Reading JSON and TOML: every text and every key in it arrives as [`plain`] text.
//!
//! A show's cue, a template's title, a server's reason: wherever they are printed later, they are
//! text. Errors are the parser's own, with line and column; what they quote is plain as well.

use std::{fmt, io};

use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess,
    VariantAccess, Visitor,
};

use crate::plain::{plain, plain_string};

/// Deserializes JSON; every string and key arrives as [`plain`] text.
///
/// # Errors
///
/// If the bytes are not JSON, hold anything after the value, or do not fit the type.
pub fn json<T: DeserializeOwned>(bytes: &[u8]) -> serde_json::Result<T> {
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let value = T::deserialize(Plain(&mut reader))?;
    reader.end()?;
    Ok(value)
}

/// Deserializes JSON as it is read, so that a seed can take long lists apart without holding them; every string
/// and key arrives as [`plain`] text. The reader should be buffered, and end within bounds.
///
/// # Errors
///
/// If the reader fails, or as [`json`].
pub fn json_from<'de, S: DeserializeSeed<'de>>(
    reader: impl io::Read,
    seed: S,
) -> serde_json::Result<S::Value> {
    let mut reader = serde_json::Deserializer::from_reader(reader);
    let value = seed.deserialize(Plain(&mut reader))?;
    reader.end()?;
    Ok(value)
}

/// Deserializes TOML; every string and key arrives as [`plain`] text.
///
/// # Errors
///
/// If the text is not TOML, or does not fit the type.
pub fn toml<T: DeserializeOwned>(text: &str) -> Result<T, toml::de::Error> {
    T::deserialize(Plain(toml::Deserializer::parse(text)?))
}

/// Words of an error of [`toml()`] with its line, except where it is of the whole text: what is missing has no line.
pub fn toml_trouble(text: &str, error: &toml::de::Error) -> String {
    match error.span() {
        Some(span) if span != (0..0) && span != (0..text.len()) => {
            error.to_string().trim_end().to_owned()
        }
        _ => error.message().to_owned(),
    }
}

/// Passes everything on, texts as [`plain`] ones.
struct Plain<T>(T);

macro_rules! pass_on {
    ($($method:ident)*) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
            self.0.$method(Plain(visitor))
        })*
    };
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Plain<D> {
    type Error = D::Error;

    pass_on! {
        deserialize_any deserialize_bool deserialize_i8 deserialize_i16 deserialize_i32
        deserialize_i64 deserialize_i128 deserialize_u8 deserialize_u16 deserialize_u32
        deserialize_u64 deserialize_u128 deserialize_f32 deserialize_f64
        deserialize_str deserialize_string deserialize_bytes deserialize_byte_buf
        deserialize_option deserialize_unit deserialize_seq deserialize_map
        deserialize_identifier deserialize_ignored_any
    }

    /// One character is no text: a tab may part columns.
    fn deserialize_char<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.0.deserialize_char(visitor)
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_unit_struct(name, Plain(visitor))
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_newtype_struct(name, Plain(visitor))
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_tuple(len, Plain(visitor))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_tuple_struct(name, len, Plain(visitor))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_struct(name, fields, Plain(visitor))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_enum(name, variants, Plain(visitor))
    }

    fn is_human_readable(&self) -> bool {
        self.0.is_human_readable()
    }
}

macro_rules! visit {
    ($($method:ident: $kind:ty),*) => {
        $(fn $method<E: Error>(self, value: $kind) -> Result<V::Value, E> {
            self.0.$method(value)
        })*
    };
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Plain<V> {
    type Value = V::Value;

    visit! {
        visit_bool: bool, visit_i8: i8, visit_i16: i16, visit_i32: i32, visit_i64: i64,
        visit_i128: i128, visit_u8: u8, visit_u16: u16, visit_u32: u32, visit_u64: u64,
        visit_u128: u128, visit_f32: f32, visit_f64: f64, visit_char: char, visit_bytes: &[u8],
        visit_borrowed_bytes: &'de [u8], visit_byte_buf: Vec<u8>
    }

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.expecting(f)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<V::Value, E> {
        self.0.visit_str(&plain(text))
    }

    fn visit_borrowed_str<E: Error>(self, text: &'de str) -> Result<V::Value, E> {
        match plain(text) {
            std::borrow::Cow::Borrowed(text) => self.0.visit_borrowed_str(text),
            std::borrow::Cow::Owned(text) => self.0.visit_string(text),
        }
    }

    fn visit_string<E: Error>(self, text: String) -> Result<V::Value, E> {
        self.0.visit_string(plain_string(text))
    }

    fn visit_none<E: Error>(self) -> Result<V::Value, E> {
        self.0.visit_none()
    }

    fn visit_some<D: Deserializer<'de>>(self, inner: D) -> Result<V::Value, D::Error> {
        self.0.visit_some(Plain(inner))
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.0.visit_unit()
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<V::Value, D::Error> {
        self.0.visit_newtype_struct(Plain(inner))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, elements: A) -> Result<V::Value, A::Error> {
        self.0.visit_seq(Plain(elements))
    }

    fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<V::Value, A::Error> {
        self.0.visit_map(Plain(entries))
    }

    fn visit_enum<A: EnumAccess<'de>>(self, variant: A) -> Result<V::Value, A::Error> {
        self.0.visit_enum(Plain(variant))
    }
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Plain<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, inner: D) -> Result<S::Value, D::Error> {
        self.0.deserialize(Plain(inner))
    }
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for Plain<A> {
    type Error = A::Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, A::Error> {
        self.0.next_element_seed(Plain(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Plain<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, A::Error> {
        self.0.next_key_seed(Plain(seed))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.0.next_value_seed(Plain(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: EnumAccess<'de>> EnumAccess<'de> for Plain<A> {
    type Error = A::Error;
    type Variant = Plain<A::Variant>;

    fn variant_seed<S: DeserializeSeed<'de>>(
        self,
        seed: S,
    ) -> Result<(S::Value, Self::Variant), A::Error> {
        let (value, variant) = self.0.variant_seed(Plain(seed))?;
        Ok((value, Plain(variant)))
    }
}

impl<'de, A: VariantAccess<'de>> VariantAccess<'de> for Plain<A> {
    type Error = A::Error;

    fn unit_variant(self) -> Result<(), A::Error> {
        self.0.unit_variant()
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, A::Error> {
        self.0.newtype_variant_seed(Plain(seed))
    }

    fn tuple_variant<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.0.tuple_variant(len, Plain(visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, A::Error> {
        self.0.struct_variant(fields, Plain(visitor))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Deserialize;

    use super::*;
    use crate::plain::acts;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    enum Tagged {
        One { name: String },
    }

    #[derive(Debug, PartialEq, Deserialize)]
    enum Outer {
        Unit,
        New(String),
        Struct { text: Option<String> },
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Document {
        title: String,
        tagged: Vec<Tagged>,
        outer: Vec<Outer>,
        pairs: BTreeMap<String, (f64, bool)>,
        spanned: Option<toml::Spanned<String>>,
    }

    const JSON: &str = r#"{ "title": "a\u001b[2J", "tagged": [{ "kind": "one", "name": "b\nc" }],
        "outer": ["Unit", { "New": "\r" }, { "Struct": { "text": "\u202e" } }],
        "pairs": { "k\u0007": [1.5, true] } }"#;

    #[test]
    fn every_text_of_a_document_is_plain() {
        let document: Document = json(JSON.as_bytes()).unwrap();
        assert_eq!(document.title, "a␛[2J");
        assert_eq!(document.tagged, [Tagged::One { name: "b␊c".to_owned() }]);
        assert_eq!(document.outer[0], Outer::Unit);
        assert_eq!(document.outer[1], Outer::New("␍".to_owned()));
        assert_eq!(document.outer[2], Outer::Struct { text: Some("\u{fffd}".to_owned()) });
        assert_eq!(document.pairs["k␇"], (1.5, true));
        let toml: Document = toml(
            "title = \"a\\u001b\"\nspanned = \"b\\n\"\ntagged = []\nouter = [\"Unit\"]\n[pairs]\n",
        )
        .unwrap();
        assert_eq!(toml.title, "a␛");
        let spanned = toml.spanned.unwrap();
        assert_eq!((spanned.get_ref().as_str(), spanned.span()), ("b␊", 28..33));
    }

    #[test]
    fn errors_quote_plain_text_and_keep_their_place() {
        let error = json::<Document>(b"{\n \"wrong\\n\\u001b[2Jkey\": 1 }").unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("unknown field `wrong␊␛[2Jkey`"), "{text}");
        assert!(text.contains("line 2 column") && !text.contains(acts), "{text}");
        let error = toml::<Document>("title = \"x\"\n\"wrong\\nkey\" = 1\n").unwrap_err();
        assert!(error.message().starts_with("unknown field `wrong␊key`"), "{error}");
        assert_eq!(error.span(), Some(12..24));
        assert!(json::<u8>(b"1 2").is_err(), "one value");
    }

    #[test]
    fn what_is_missing_has_no_line() {
        let told = |text: &str| toml_trouble(text, &toml::<Document>(text).unwrap_err());
        assert_eq!(told("# a remark\ntagged = []\nouter = []\n[pairs]\n"), "missing field `title`");
        assert_eq!(told(""), "missing field `title`");
        let wrong = told("wrong = 1\ntagged = []\n");
        assert!(wrong.contains("line 1") && wrong.contains("unknown field `wrong`"), "{wrong}");
    }
}
