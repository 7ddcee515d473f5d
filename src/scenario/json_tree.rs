//! Reads settings from a JSON tree for every file format, so that each type is compiled for one input only, and every
//! error has its key and its parts as values.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, StringDeserializer};
use serde::de::{
    self, DeserializeOwned, DeserializeSeed, Deserializer, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;
use serde_json::{Map, Value};

use super::diagnostic::did_you_mean;
use skiagraph_core::input::{excerpt, foreign_about, plain};

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Problem {
    /// A word that is none of the known ones: the key of a table, or the name of a choice.
    Unknown { is_key: bool, word: String, known: &'static [&'static str] },
    /// A key that must be there.
    Missing { key: &'static str },
    /// A value of another kind or length.
    Unexpected { what: &'static str, found: String, expected: String },
    /// A whole number below 0, and what its key allows, if known.
    Negative { found: i64, expected: Option<String> },
    /// Several keys, or none, in a table that names one thing.
    NotOne,
    /// The name of a thing in place of a table with its settings.
    NameAlone,
    /// Anything else.
    Other(String),
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { is_key, word, known } => {
                let what = if *is_key { "key" } else { "name" };
                let guess = did_you_mean(word, known.iter().copied());
                let guess = guess.map(|g| format!(", did you mean `{g}`?")).unwrap_or_default();
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                write!(f, "unknown {what} `{}`{guess} (known here: {known})", excerpt(word))
            }
            Self::Missing { key } => write!(f, "missing key `{key}`"),
            Self::Unexpected { what, found, expected } => {
                write!(f, "{what} {}, expected {}", excerpt(found), in_plain_words(expected))
            }
            Self::Negative { found, expected: None } => write!(f, "expected a whole number from 0, found {found}"),
            Self::Negative { found, expected: Some(expected) } => write!(f, "{expected}, found {found}"),
            Self::NotOne => write!(f, "expected a single name in this table"),
            Self::NameAlone => write!(f, "expected a table of settings, found a name alone"),
            Self::Other(message) => write!(f, "{}", plain(message)),
        }
    }
}

/// What serde's derived code expects, which are types of Rust.
fn in_plain_words(expected: &str) -> &str {
    match expected {
        "usize" | "u8" | "u16" | "u32" | "u64" | "i64" => "a whole number",
        "f64" => "a number",
        _ if expected.starts_with("struct ") => "a table of settings",
        other => other,
    }
}

#[derive(Clone, Debug)]
pub(crate) struct TreeError {
    /// Dotted key of the value; empty for the whole tree.
    pub(crate) key: String,
    pub(crate) problem: Problem,
}

impl TreeError {
    fn new(problem: Problem) -> Self {
        Self { key: String::new(), problem }
    }

    /// The same error of a value at `key` of a tree.
    fn below(self, key: &str) -> Self {
        let dot = if self.key.is_empty() || self.key.starts_with('[') { "" } else { "." };
        Self { key: format!("{key}{dot}{}", self.key), ..self }
    }

    fn unexpected(what: &'static str, found: impl fmt::Display, expected: &dyn Expected) -> Self {
        Self::new(Problem::Unexpected { what, found: found.to_string(), expected: expected.to_string() })
    }
}

impl fmt::Display for TreeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.key.is_empty() {
            write!(f, "{}: ", excerpt(&self.key))?;
        }
        write!(f, "{}", self.problem)
    }
}

impl std::error::Error for TreeError {}

impl de::Error for TreeError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(Problem::Other(message.to_string()))
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        match found {
            Unexpected::UnitVariant => Self::new(Problem::NameAlone),
            found => Self::unexpected("invalid type:", found, expected),
        }
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        match found {
            Unexpected::Signed(found) if found < 0 => Self::new(Problem::Negative { found, expected: None }),
            found => Self::unexpected("invalid value:", found, expected),
        }
    }

    fn invalid_length(found: usize, expected: &dyn Expected) -> Self {
        Self::unexpected("invalid length", found, expected)
    }

    fn unknown_field(word: &str, known: &'static [&'static str]) -> Self {
        Self::new(Problem::Unknown { is_key: true, word: word.to_owned(), known })
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        Self::new(Problem::Unknown { is_key: false, word: word.to_owned(), known })
    }

    fn missing_field(key: &'static str) -> Self {
        Self::new(Problem::Missing { key })
    }
}

pub(crate) fn value<T: DeserializeOwned>(tree: Value) -> Result<T, TreeError> {
    T::deserialize(Tree(tree))
}

/// The value of a JSON file, or an error, which quotes the file only if it is in a format of this program.
pub(crate) fn value_of_file<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let tree = serde_json::from_slice(bytes).map_err(|e| foreign_about(bytes, e))?;
    value(tree).map_err(|e| foreign_about(bytes, e))
}

struct Tree(Value);

struct Elements(std::iter::Enumerate<std::vec::IntoIter<Value>>);

impl<'de> SeqAccess<'de> for Elements {
    type Error = TreeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, TreeError> {
        let Some((index, value)) = self.0.next() else { return Ok(None) };
        seed.deserialize(Tree(value)).map(Some).map_err(|error| error.below(&format!("[{index}]")))
    }
}

/// The keys and values of a table, or the name of a choice with its settings.
struct Entries {
    entries: serde_json::map::IntoIter,
    is_choice: bool,
    next: (String, Value),
}

impl<'de> MapAccess<'de> for Entries {
    type Error = TreeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, TreeError> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        self.next = (key.clone(), value);
        let read = seed.deserialize(key.into_deserializer()).map(Some);
        read.map_err(|error: TreeError| if self.is_choice { error } else { error.below(&self.next.0) })
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, TreeError> {
        let (key, value) = std::mem::take(&mut self.next);
        seed.deserialize(Tree(value)).map_err(|error| error.below(&key))
    }
}

impl Entries {
    fn new(table: Map<String, Value>, is_choice: bool) -> Self {
        Self { entries: table.into_iter(), is_choice, next: Default::default() }
    }
}

impl<'de> Deserializer<'de> for Tree {
    type Error = TreeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, TreeError> {
        match self.0 {
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(value),
            Value::Number(number) => match (number.as_u64(), number.as_i64()) {
                (Some(value), _) => visitor.visit_u64(value),
                (None, Some(value)) => visitor.visit_i64(value),
                (None, None) => visitor.visit_f64(number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => visitor.visit_string(text),
            Value::Array(values) => {
                let count = values.len();
                let expected = (&visitor as &dyn de::Expected).to_string();
                let mut elements = Elements(values.into_iter().enumerate());
                let made = visitor.visit_seq(&mut elements)?;
                match elements.0.next() {
                    Some(_) => Err(de::Error::invalid_length(count, &expected.as_str())),
                    None => Ok(made),
                }
            }
            Value::Object(table) => visitor.visit_map(Entries::new(table, false)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, TreeError> {
        if self.0.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &str, visitor: V) -> Result<V::Value, TreeError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, TreeError> {
        match self.0 {
            Value::String(word) => {
                let named: StringDeserializer<TreeError> = word.clone().into_deserializer();
                named.deserialize_enum(name, variants, visitor).map_err(|error| match error.problem {
                    Problem::NameAlone => error.below(&word),
                    _ => error,
                })
            }
            Value::Object(table) if table.len() == 1 => {
                MapAccessDeserializer::new(Entries::new(table, true)).deserialize_enum(name, variants, visitor)
            }
            Value::Object(_) => Err(TreeError::new(Problem::NotOne)),
            other => Err(TreeError::unexpected("invalid type:", described(&other), &"a text or a table")),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

/// A value that is neither a text nor a table.
fn described(value: &Value) -> String {
    let kind = match value {
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "floating point",
        Value::Number(_) => "integer",
        _ => return "sequence".to_owned(),
    };
    format!("{kind} `{value}`")
}
