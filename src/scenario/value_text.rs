//! Values as they are written on the command line.

use serde::Deserialize;
use serde_json::Value;

use skiagraph_core::input::foreign;

/// A TOML value; a bare word (`value=overlap`, `clip=a/b.bvh`) is taken as a string.
pub(crate) fn parse_value(text: &str) -> Result<Value, String> {
    let bare = |c: char| c.is_ascii_alphanumeric() || "_-./:~ ".contains(c);
    if text.trim().is_empty() {
        return Err("expected a value after `=`, found none".to_owned());
    }
    match toml::de::ValueDeserializer::parse(text).and_then(Value::deserialize) {
        Ok(value) => Ok(value),
        // TOML needs a digit before the point
        Err(_) if text.trim_start_matches(['-', '+']).starts_with('.') && text.parse::<f64>().is_ok() => {
            Ok(text.parse::<f64>().map_or(Value::Null, Value::from))
        }
        Err(_) if !text.is_empty() && text.chars().all(bare) => Ok(Value::String(text.to_owned())),
        Err(e) => Err(format!("the value is not TOML: {}", foreign(e.message()))),
    }
}

/// Splits at commas outside brackets and quotes.
pub(crate) fn split_at_commas(text: &str) -> Vec<&str> {
    let (mut parts, mut begin, mut depth, mut quote) = (Vec::new(), 0, 0_usize, None);
    for (at, c) in text.char_indices() {
        match (c, quote) {
            (c, Some(open)) if c == open => quote = None,
            (_, Some(_)) => {}
            ('"' | '\'', None) => quote = Some(c),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth = depth.saturating_sub(1),
            (',', None) if depth == 0 => {
                parts.push(&text[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[begin..]);
    parts
}
