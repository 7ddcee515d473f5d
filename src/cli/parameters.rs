//! `--params-json`: overrides from another program.

use std::io::Read;
use std::path::Path;

use serde_json::{Map, Value};

use crate::common::ExperimentError;
use crate::scenario::as_toml;
use skiagraph_core::input::{self, foreign, limits};

/// Reads overrides from a JSON object: the path of a file, `-` for standard input, or the object itself.
pub(super) fn read(path: &Path) -> Result<Vec<String>, ExperimentError> {
    let bytes = if path == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().take(limits::SETTINGS).read_to_end(&mut bytes).map(|_| bytes)
    } else if let Some(text) = path.to_str().filter(|text| text.trim_start().starts_with('{') && !path.exists()) {
        Ok(text.as_bytes().to_vec())
    } else {
        input::read(path, limits::SETTINGS)
    };
    let bytes = bytes.map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })?;
    overrides(&bytes).map_err(|detail| ExperimentError::Argument { argument: "--params-json", detail })
}

fn overrides(bytes: &[u8]) -> Result<Vec<String>, String> {
    let expected = "expected a JSON object of keys and values, such as {\"particles\": 50}";
    let table: Map<String, Value> = serde_json::from_slice(bytes).map_err(|e| format!("{expected}: {}", foreign(e)))?;
    let assignment = |(key, value): (&String, &Value)| match value {
        Value::Null => Err(format!("{key}: expected a value, found null")),
        _ if key.contains('=') => Err(format!("expected a dotted key, found {key:?}")),
        value => Ok(format!("{key}={}", as_toml(value))),
    };
    table.iter().map(assignment).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_may_be_given_inline() {
        assert_eq!(read(Path::new("{\"particles\": 50}")).unwrap(), ["particles=50"]);
        assert!(read(Path::new("{nonsense")).is_err() && read(Path::new("no_such_file.json")).is_err());
    }

    #[test]
    fn each_key_of_an_object_is_an_override() {
        let text = br#"{"particles": 50, "rig.ring.size_px": [160, 120], "name": "a b", "tracker_body.mismatch": {"percent": {"length": 1.5}}}"#;
        assert_eq!(
            overrides(text).unwrap(),
            [
                "particles=50",
                "rig.ring.size_px=[160, 120]",
                "name=\"a b\"",
                "tracker_body.mismatch={ percent = { length = 1.5 } }"
            ]
        );
        for bad in [&b"[1]"[..], b"", b"{\"a\": null}", b"{\"a=b\": 1}"] {
            assert!(overrides(bad).is_err());
        }
    }
}
