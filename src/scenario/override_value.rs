//! The value of `key=value`, read and written.

use serde::Deserialize;
use serde_json::Value;

use crate::input::foreign;

/// A TOML value; a bare word (`value=overlap`, `clip=a/b.bvh`) is taken as a string.
pub(crate) fn parse_value(text: &str) -> Result<Value, String> {
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

/// Parts between commas that stand in no bracket and no quote.
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

/// A value as TOML writes it in a line.
pub fn as_toml(value: &Value) -> String {
    match value {
        Value::Object(table) => {
            let entries: Vec<String> =
                table.iter().map(|(key, value)| format!("{} = {}", quoted_key(key), as_toml(value))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        Value::Array(values) => format!("[{}]", values.iter().map(as_toml).collect::<Vec<_>>().join(", ")),
        // JSON's escapes of strings and its numbers are TOML's
        other => other.to_string(),
    }
}

fn quoted_key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'));
    if bare { key.to_owned() } else { Value::String(key.to_owned()).to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_written_as_toml_reads_them_back() {
        let tree: Value = toml::from_str("a = [1, 2.5, \"x\\\"y\", true, { b = 1, \"c d\" = [] }]").unwrap();
        let again: Value = toml::from_str(&format!("a = {}", as_toml(&tree["a"]))).unwrap();
        assert_eq!(again, tree);
    }
}
