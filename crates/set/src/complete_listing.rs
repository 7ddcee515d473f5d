//! `complete.sha256` of a set without its truth: the lines that the complete set is known by.

use std::collections::BTreeMap;
use std::path::Path;

use super::SetError;
use super::identity::{SEALED, counts};
use super::listing::{COMPLETE, LISTING, READER, README, digests_in};
use crate::input::{self, hex_sha256, limits};

/// The lines of the complete set, in a set without its truth whose files are `listed`, those in shards included; each
/// file that is there must be among them.
pub(super) fn complete_lines(
    directory: &Path,
    own: Option<&String>,
    listed: &BTreeMap<&String, &String>,
) -> Result<Option<String>, SetError> {
    let Some(own) = own else { return Ok(None) };
    let path = directory.join(COMPLETE);
    let text = input::read_to_string(&path, limits::LISTING).map_err(SetError::io(&path, "read"))?;
    let found = hex_sha256(text.as_bytes());
    if found != *own {
        let file = path.display().to_string();
        return Err(SetError::Tampered { file, listed: own.clone(), found });
    }
    let complete = digests_in(directory, COMPLETE, &text)?;
    let shared = |path: &str| {
        let is_apart = path.starts_with("truth/") || [README, READER, COMPLETE, SEALED].contains(&path);
        counts(path) && !is_apart
    };
    let here = listed.iter().map(|(path, digest)| (*path, *digest)).filter(|(path, _)| shared(path));
    match here.eq(complete.iter().filter(|(path, _)| shared(path))) {
        true => Ok(Some(text)),
        false => {
            let detail = format!("{LISTING} and {COMPLETE} are not of the same files; get the set again");
            Err(SetError::NotASet { path: directory.to_owned(), detail })
        }
    }
}
