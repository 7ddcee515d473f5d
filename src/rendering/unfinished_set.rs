//! An unfinished set: complete files survive an interruption, and the same command resumes.
//!
//! Everything is in `NAME.partial` beside the set: `made_by.json`, by which the same command is recognised, with the
//! key of the random numbers; `finished.sha256`, the journal of complete files; and `set`, which is moved to its place
//! when it is complete.

use std::fs;
use std::path::{Path, PathBuf};

use super::key_source::fresh_key;
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination, MadeBy, Resumable, ResumableKind, output};
use crate::common::ExperimentError;
use skiagraph_core::rng::ObservationKey;
use skiagraph_set::SetError;

const JOURNAL: &str = "finished.sha256";
const FOLDER: &str = "set";
const KEY: &str = "--key";
const KIND: ResumableKind = ResumableKind { is_work: |name| name == FOLDER, others: &[JOURNAL, "finished.writing"] };

#[derive(Debug)]
pub(super) struct UnfinishedSet {
    resumable: Resumable,
    directory: Artefact,
}

impl UnfinishedSet {
    /// Begins a set, or resumes one with the same settings. Without a `stated` key, the key of the resumed set is used,
    /// or a fresh one is drawn.
    pub(super) fn begin(
        to: Destination<'_>,
        made_by: &MadeBy,
        stated: Option<ObservationKey>,
    ) -> Result<Self, ExperimentError> {
        let directory = Resumable::artefact(to, FOLDER, ArtefactKind::Set)?;
        let with_key = made_by.clone().of(KEY, stated.map_or_else(fresh_key, Ok)?.to_hex());
        let resumable = Resumable::begin(to, &KIND, with_key, |there| {
            let mut without_key = there.clone();
            without_key.inputs.remove(KEY);
            without_key.difference_of_other_version(made_by).or_else(|| other_key(key_in(there), stated))
        })?;
        let this = Self { resumable, directory };
        fs::create_dir_all(this.folder()).map_err(output(this.folder(), "create the directory"))?;
        Ok(this)
    }

    pub(super) fn key(&self) -> ObservationKey {
        key_in(self.resumable.made_by())
    }

    pub(super) fn folder(&self) -> &Path {
        self.directory.folder()
    }

    pub(super) fn journal(&self) -> PathBuf {
        self.resumable.folder().join(JOURNAL)
    }

    pub(super) fn keep(&self) {
        self.resumable.keep();
    }

    /// Moves the existing set aside at the end, because it was made with other settings.
    pub(super) fn keep_other(&mut self) {
        self.directory.keep_other();
    }

    pub(super) fn finish(self) -> Result<(), ExperimentError> {
        let Self { resumable, directory } = self;
        directory.finish().map_err(|error| with_progress(&resumable, error.into()))?;
        resumable.discard();
        Ok(())
    }

    /// The error of a set that could not be completed. Progress is kept if the reason may be temporary, else removed.
    pub(super) fn with_progress(&self, error: ExperimentError) -> ExperimentError {
        with_progress(&self.resumable, error)
    }
}

fn with_progress(resumable: &Resumable, error: ExperimentError) -> ExperimentError {
    match error {
        ExperimentError::Set(SetError::Differs { file }) if resumable.is_kept() => {
            let difference = format!("{file} would differ, because a file of the scenario or this program has changed");
            resumable.differs(difference).into()
        }
        ExperimentError::Interrupted
        | ExperimentError::Set(SetError::Io { .. })
        | ExperimentError::Artefact(ArtefactError::Output { .. }) => error.with_progress(resumable),
        other => {
            resumable.discard();
            other
        }
    }
}

fn key_in(made_by: &MadeBy) -> ObservationKey {
    made_by.inputs.get(KEY).and_then(|text| text.parse().ok()).unwrap_or_default()
}

/// The message about a key that differs from that of the unfinished set, which is not revealed.
fn other_key(begun: ObservationKey, stated: Option<ObservationKey>) -> Option<String> {
    let message = "the unfinished set has another key; leave out --key and observation.key to resume with that key";
    stated.filter(|stated| *stated != begun).map(|_| format!("{KEY}: {message}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn begin(path: &Path) -> Result<UnfinishedSet, ExperimentError> {
        let made_by = MadeBy::new("skiagraph render", json!({}));
        UnfinishedSet::begin(Destination { path, force: false }, &made_by, Some(ObservationKey::PUBLIC))
    }

    #[test]
    fn permanent_errors_remove_progress_and_a_full_disk_keeps_it() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("walk"), root.path().join("walk.partial"));
        let set = begin(&place).unwrap();
        set.keep();
        let full = SetError::Io { path: "a".into(), action: "write", source: std::io::ErrorKind::StorageFull.into() };
        let error = set.with_progress(full.into());
        assert!(error.exit_code() == 75 && error.to_string().contains("walk.partial: run the same"), "{error}");
        drop(set);
        assert!(around.exists());
        let set = begin(&place).unwrap();
        assert!(matches!(set.with_progress(ExperimentError::NoTraining), ExperimentError::NoTraining));
        drop(set);
        assert!(!around.exists());
    }
}
