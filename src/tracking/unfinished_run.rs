//! An unfinished run over several seeds: finished seeds survive an interruption, and the same command resumes.
//!
//! They are in `NAME.partial` beside the run: `made_by.json`, by which the same command is recognised, and a folder
//! `seed-N` (`METHOD-seed-N`) for each finished seed, with its own listing, which appears when it is complete. Finished
//! runs are made from these files alone, so that an interrupted run has the same bytes as an uninterrupted one.

use std::fs;
use std::path::PathBuf;

use crate::artefacts::{
    ArtefactError, Destination, MadeBy, Resumable, ResumableKind, is_whole, output, remove, sign, sync_parent,
    write_synced,
};
use crate::common::{ExperimentError, NamedFiles};

const SEED: &str = "seed-";
const WRITING: &str = "writing";
const KIND: ResumableKind = ResumableKind {
    is_work: |name| name.rsplit_once(SEED).is_some_and(|(_, seed)| seed.parse::<u64>().is_ok()),
    others: &[WRITING],
};

#[derive(Debug)]
pub(crate) struct UnfinishedRun(Resumable);

impl UnfinishedRun {
    /// Begins a run, or resumes one of the same command, apart from the numbers of its seeds. The run's place must be
    /// locked.
    pub(crate) fn begin(to: Destination<'_>, made_by: &MadeBy) -> Result<Self, ArtefactError> {
        let here = made_by.of_each_seed();
        Resumable::begin(to, &KIND, here.clone(), |there| there.difference_of_other_version(&here)).map(Self)
    }

    /// The seeds of one method of a scenario; the name is empty for the only tracker.
    pub(crate) fn of_method<'a>(&'a self, method: &'a str) -> KeptSeeds<'a> {
        KeptSeeds { run: self, method }
    }

    /// Refuses to resume if the finished seeds were made differently.
    pub(super) fn check_same(&self, what: &str, there: &str, here: &str) -> Result<(), ArtefactError> {
        if there == here { Ok(()) } else { Err(self.0.differs(format!("{what}: was {there}, now {here}"))) }
    }

    pub(crate) fn with_progress(&self, error: ExperimentError) -> ExperimentError {
        error.with_progress(&self.0)
    }

    /// Removes the stored seeds, because the run is complete.
    pub(crate) fn finish(self) {
        self.0.discard();
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptSeeds<'a> {
    pub(super) run: &'a UnfinishedRun,
    method: &'a str,
}

impl KeptSeeds<'_> {
    /// The folder of a finished seed; `None` if it is not finished.
    pub(crate) fn seed(self, seed: u64) -> Option<PathBuf> {
        Some(self.folder_of(seed)).filter(|folder| is_whole(folder))
    }

    pub(crate) fn put(self, seed: u64, files: &NamedFiles) -> Result<PathBuf, ArtefactError> {
        let (folder, writing) = (self.folder_of(seed), self.run.0.folder().join(WRITING));
        // leftovers are incomplete
        for left in [&folder, &writing] {
            remove(left).map_err(output(left, "remove the directory"))?;
        }
        fs::create_dir(&writing).map_err(output(&writing, "create the directory"))?;
        for (name, bytes) in files {
            let path = writing.join(&**name);
            write_synced(&path, bytes).map_err(output(&path, "write"))?;
        }
        sign(&writing)?;
        fs::rename(&writing, &folder).map_err(output(&folder, "write"))?;
        sync_parent(&folder);
        self.run.0.keep();
        Ok(folder)
    }

    fn folder_of(self, seed: u64) -> PathBuf {
        let dash = if self.method.is_empty() { "" } else { "-" };
        self.run.0.folder().join(format!("{}{dash}{SEED}{seed}", self.method))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    fn begin(place: &Path, particles: u32, force: bool) -> Result<UnfinishedRun, ArtefactError> {
        let made_by = MadeBy::new("test", json!({"particles": particles}));
        UnfinishedRun::begin(Destination { path: place, force }, &made_by)
    }

    fn files(text: &str) -> NamedFiles {
        vec![("poses.npz".into(), text.as_bytes().to_vec())]
    }

    #[test]
    fn only_complete_seeds_of_the_same_settings_are_resumed() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("run"), root.path().join("run.partial"));
        let run = begin(&place, 100, false).unwrap();
        assert!(run.of_method("").seed(3).is_none());
        assert!(matches!(run.with_progress(ExperimentError::Interrupted), ExperimentError::Interrupted));
        let folder = run.of_method("").put(3, &files("three")).unwrap();
        assert_eq!(fs::read_to_string(folder.join("poses.npz")).unwrap(), "three");
        run.of_method("").put(4, &files("four")).unwrap();
        let error = run.with_progress(ExperimentError::Interrupted);
        assert!(matches!(error, ExperimentError::Artefact(ArtefactError::ProgressSaved { .. })), "{error}");
        drop(run);
        // a truncated seed is not complete
        fs::write(around.join("seed-4/poses.npz"), "fo").unwrap();
        let again = begin(&place, 100, false).unwrap();
        assert!(again.of_method("").seed(3).is_some() && again.of_method("").seed(4).is_none());
        again.of_method("").put(4, &files("four")).unwrap();
        assert!(again.of_method("").seed(4).is_some());
        // a seed whose removal was killed is not complete
        fs::remove_file(around.join("seed-3/poses.npz")).unwrap();
        assert!(again.of_method("").seed(3).is_none());
        again.finish();
        assert!(!around.exists());
    }
}
