//! Enums whose values are sentences in files: typed in memory, text where they are written.

/// Gives an enum with a `Display` and a variant `Said(String)` the form of text in files and schemas:
/// it is written as its sentence and read back as `Said`, and two values are equal if they say the same.
///
/// A type that a reader decides by gives `from_text`, which may recognise the sentence of a typed value.
macro_rules! said_in_files {
    ($name:ty) => {
        $crate::base::said::said_in_files!($name, <$name>::Said);
    };
    ($name:ty, $from_text:expr) => {
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                String::deserialize(deserializer).map($from_text)
            }
        }

        impl schemars::JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                String::schema_name()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                String::json_schema(generator)
            }
        }

        impl PartialEq for $name {
            fn eq(&self, other: &Self) -> bool {
                self.to_string() == other.to_string()
            }
        }
    };
}

pub(crate) use said_in_files;
