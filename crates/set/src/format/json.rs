//! The JSON files of a set: pretty-printed, each with a schema tag.

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::SetError;
use skiagraph_core::input::{excerpt, foreign_about, is_own_output};

pub(crate) fn to_bytes(file: &str, value: &impl Serialize) -> Result<Vec<u8>, SetError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|e| SetError::malformed(file, e.to_string()))?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The value of a file with one of these `schemas`.
pub(crate) fn from_bytes<T: DeserializeOwned>(file: &str, schemas: &[&str], bytes: &[u8]) -> Result<T, SetError> {
    #[derive(Deserialize)]
    struct Tag {
        schema: String,
    }
    let malformed = |e: serde_json::Error| SetError::malformed(file, foreign_about(bytes, e));
    let Tag { schema: found } = serde_json::from_slice(bytes).map_err(malformed)?;
    if !schemas.contains(&found.as_str()) {
        let known = schemas.iter().map(|schema| format!("{schema:?}")).collect::<Vec<_>>().join(" and ");
        let found =
            if is_own_output(bytes) { format!("schema {:?}", excerpt(&found)) } else { "another schema".to_owned() };
        return Err(SetError::malformed(file, format!("{found}, this program reads {known}")));
    }
    serde_json::from_slice(bytes).map_err(malformed)
}
