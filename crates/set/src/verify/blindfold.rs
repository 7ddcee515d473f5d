//! Searches for poses of the test in the files for trackers.

use std::path::Path;

use super::{CheckOutcome, Fault};
use crate::SetError;
use crate::files::SetFiles;
use crate::leaks::find_leaks_of;

pub(super) fn check(directory: &Path, complete: &Path, files: &SetFiles) -> CheckOutcome {
    let outside = files.paths().filter(|path| !path.starts_with("truth/")).count();
    let faults = match find_leaks_of(directory, complete) {
        Ok(leaks) => leaks
            .into_iter()
            .map(|leak| {
                let frame = leak.frame.map(|frame| format!(" of frame {frame}")).unwrap_or_default();
                Fault { file: leak.file, detail: format!("{}: {}{frame}", leak.place, leak.what) }
            })
            .collect(),
        // the search needs the truth
        Err(SetError::Tampered { file, .. }) => return Err(format!("not checked: {file} was changed")),
        Err(SetError::MissingShard { file, .. } | SetError::BrokenShard { file, .. }) => {
            return Err(format!("not checked: {file} is damaged or missing"));
        }
        Err(error) => vec![error.into()],
    };
    Ok((format!("{outside} files outside truth/"), faults))
}
