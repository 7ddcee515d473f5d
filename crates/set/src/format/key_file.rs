//! `truth/key.txt`: the secret key of all random numbers of the observations, 32 hexadecimal digits and a line feed.
//! Absent with the public key. It also prevents that hashes of the truth confirm a guess.

use std::str;

use super::listing::KEY_FILE;
use crate::SetError;
use crate::files::SetFiles;
use skiagraph_core::rng::ObservationKey;

pub(crate) fn to_text(key: ObservationKey) -> Vec<u8> {
    format!("{}\n", key.to_hex()).into_bytes()
}

/// The key of a set; the public key if it has none.
pub(crate) fn read(files: &SetFiles) -> Result<ObservationKey, SetError> {
    if !files.has(KEY_FILE) {
        return Ok(ObservationKey::PUBLIC);
    }
    let bytes = files.read(KEY_FILE)?;
    let parsed = str::from_utf8(&bytes).unwrap_or_default().trim_end().parse();
    parsed.map_err(|e: skiagraph_core::rng::KeyError| SetError::malformed(KEY_FILE, e.to_string()))
}
