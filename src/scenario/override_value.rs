//! The value of `key=value`.

use serde::Deserialize;
use serde_json::Value;

use crate::input::foreign;

/// A TOML value; a bare word (`value=overlap`, `clip=a/b.bvh`) is taken as a string.
pub(super) fn parse_value(text: &str) -> Result<Value, String> {
    let bare = |c: char| c.is_ascii_alphanumeric() || "_-./:~ ".contains(c);
    if text.trim().is_empty() {
        return Err("expected a value behind `=`, found none".to_owned());
    }
    match toml::de::ValueDeserializer::parse(text).and_then(Value::deserialize) {
        Ok(value) => Ok(value),
        Err(_) if !text.is_empty() && text.chars().all(bare) => Ok(Value::String(text.to_owned())),
        Err(e) => Err(format!("the value is not TOML: {}", foreign(e.message()))),
    }
}
