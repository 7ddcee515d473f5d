//! Weights as MakeHuman and MPFB2 write them: JSON with `"weights": { "BONE": [[VERTEX, WEIGHT], ...] }`, vertices
//! counted from 0. Other keys are ignored.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::mesh::SkinError;
use crate::input::unquoted;

#[derive(Deserialize)]
struct WeightsRecord {
    weights: BTreeMap<String, Vec<(u32, f64)>>,
}

/// Reads such a file.
///
/// # Errors
/// [`SkinError::Malformed`] with the line and what was expected.
pub(super) fn parse(file: &str, text: &str) -> Result<BTreeMap<String, Vec<(u32, f64)>>, SkinError> {
    let record: Result<WeightsRecord, _> = serde_json::from_str(text);
    record.map(|record| record.weights).map_err(|e| SkinError::Malformed {
        file: file.to_owned(),
        detail: format!("expected JSON {{\"weights\": {{\"BONE\": [[VERTEX, WEIGHT], ...]}}}}: {}", unquoted(e)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_read_by_bone_and_anything_else_is_refused_with_its_place() {
        let text = r#"{"name": "x", "weights": {"a": [[0, 0.5], [2, 1]], "b": []}}"#;
        let found = parse("w.json", text).unwrap();
        assert_eq!(found["a"], [(0, 0.5), (2, 1.0)]);
        for wrong in ["", "[]", r#"{"weights": {"a": [[-1, 0.5]]}}"#, r#"{"weights": {"a": [0, 1]}}"#] {
            let message = parse("w.json", wrong).unwrap_err().to_string();
            assert!(message.starts_with("w.json: expected JSON") && message.contains("line 1"), "{message}");
        }
    }
}
