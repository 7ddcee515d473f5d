//! A run over several seeds: those that are finished survive an interruption, and the same command goes on with the
//! others.
//!
//! They lie in `NAME.partial` beside the run: `settings.json`, by which the same command is known, and a folder
//! `seed-N` for each, with a listing of its own, which appears when it is whole. Finished runs are put together from
//! these files alone, so that one that was interrupted has the bytes of an undisturbed one.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::Value;

use super::destination::Destination;
use super::error::output;
use super::partial_file::beside;
use super::place::{sync_parent, write_synced};
use super::same_settings::difference;
use super::{ExperimentError, NamedFiles, ownership, to_json, unfinished};
use crate::input::{self, limits};

const SETTINGS: &str = "settings.json";
const SCHEMA: &str = "skiagraph.unfinished-run/1";
const SEED: &str = "seed-";
const WRITING: &str = "writing";

/// The finished seeds of a run that is being made.
#[derive(Debug)]
pub(super) struct UnfinishedRun {
    around: PathBuf,
    /// Whether a seed is there.
    is_kept: AtomicBool,
}

impl UnfinishedRun {
    /// Begins, or goes on with what was begun with the same settings. The run's place must be locked.
    ///
    /// # Errors
    /// [`ExperimentError::OtherUnfinished`] where a run of other settings was begun, unless `force` is given, which
    /// removes it; [`ExperimentError::Occupied`] where something else is there.
    pub(super) fn begin(to: Destination<'_>, settings: &Value) -> Result<Self, ExperimentError> {
        let around = beside(to.path, ".partial");
        let settings = serde_json::json!({
            "schema": SCHEMA, "version": env!("CARGO_PKG_VERSION"), "run": settings,
        });
        if around.symlink_metadata().is_ok() {
            check_ours(&around)?;
            match found_in(&around) {
                Some(there) => match difference(&there, &settings) {
                    Some(_) if to.force => remove(&around)?,
                    Some(difference) => return Err(ExperimentError::OtherUnfinished { partial: around, difference }),
                    None => {}
                },
                // killed before a seed was finished
                None => remove(&around)?,
            }
        }
        let this = Self { around, is_kept: AtomicBool::new(false) };
        match this.around.is_dir() {
            true => this.keep(),
            false => this.write_settings(&settings)?,
        }
        Ok(this)
    }

    fn write_settings(&self, settings: &Value) -> Result<(), ExperimentError> {
        unfinished::begin(&self.around);
        fs::create_dir(&self.around).map_err(output(&self.around, "create the directory"))?;
        let path = self.around.join(SETTINGS);
        write_synced(&path, &to_json(settings)?).map_err(output(&path, "write"))
    }

    /// The folder of a finished seed, with the files that were put there.
    pub(super) fn seed(&self, seed: u64) -> Option<PathBuf> {
        Some(self.folder_of(seed)).filter(|folder| ownership::is_signed(folder))
    }

    /// Keeps a seed that is finished; gives its folder.
    ///
    /// # Errors
    /// [`ExperimentError::Output`] if it cannot be written.
    pub(super) fn put(&self, seed: u64, files: &NamedFiles) -> Result<PathBuf, ExperimentError> {
        let (folder, writing) = (self.folder_of(seed), self.around.join(WRITING));
        // what was left there is not whole
        for left in [&folder, &writing] {
            remove(left)?;
        }
        fs::create_dir(&writing).map_err(output(&writing, "create the directory"))?;
        for (name, bytes) in files {
            let path = writing.join(name);
            write_synced(&path, bytes).map_err(output(&path, "write"))?;
        }
        ownership::sign(&writing).map_err(output(&writing, "list the files of the directory"))?;
        fs::rename(&writing, &folder).map_err(output(&folder, "write"))?;
        sync_parent(&folder);
        self.keep();
        Ok(folder)
    }

    fn folder_of(&self, seed: u64) -> PathBuf {
        self.around.join(format!("{SEED}{seed}"))
    }

    fn keep(&self) {
        if !self.is_kept.swap(true, Ordering::SeqCst) {
            unfinished::end(&self.around);
            unfinished::keep(Some(&self.around));
        }
    }

    /// Refuses to go on where what is finished was made otherwise.
    ///
    /// # Errors
    /// [`ExperimentError::OtherUnfinished`].
    pub(super) fn check_same(&self, what: &str, there: &str, here: &str) -> Result<(), ExperimentError> {
        if there == here {
            return Ok(());
        }
        let difference = format!("{what}: there {there}, here {here}");
        Err(ExperimentError::OtherUnfinished { partial: self.around.clone(), difference })
    }

    /// What to tell of a run that ended early.
    pub(super) fn told(&self, error: ExperimentError) -> ExperimentError {
        let partial = self.around.clone();
        match error {
            _ if !self.is_kept.load(Ordering::SeqCst) => error,
            ExperimentError::Interrupted => ExperimentError::ProgressSaved { partial },
            error @ ExperimentError::OtherUnfinished { .. } => error,
            error => ExperimentError::Unfinished { partial, source: Box::new(error) },
        }
    }

    /// The run stands in its place: what was kept for it goes.
    pub(super) fn finish(&self) {
        self.is_kept.store(false, Ordering::SeqCst);
    }
}

impl Drop for UnfinishedRun {
    fn drop(&mut self) {
        if !self.is_kept.load(Ordering::SeqCst) {
            // nobody is left to tell of a failure
            unfinished::remove(&self.around).ok();
            unfinished::end(&self.around);
            sync_parent(&self.around);
        }
        unfinished::keep(None);
    }
}

/// Refuses a folder of that name that holds anything else than what this program keeps there.
fn check_ours(around: &Path) -> Result<(), ExperimentError> {
    let is_own_output = |name: &str| {
        let is_seed = name.strip_prefix(SEED).is_some_and(|seed| seed.parse::<u64>().is_ok());
        is_seed || name == SETTINGS || name == WRITING
    };
    let names = fs::read_dir(around).into_iter().flatten().flatten().map(|entry| entry.file_name());
    let is_folder = around.is_dir() && !around.is_symlink();
    match is_folder && names.into_iter().all(|name| name.to_str().is_some_and(is_own_output)) {
        true => Ok(()),
        false => Err(ExperimentError::Occupied { path: around.to_owned() }),
    }
}

/// The settings of what was begun.
fn found_in(around: &Path) -> Option<Value> {
    let bytes = input::read(&around.join(SETTINGS), limits::RECORD).ok()?;
    serde_json::from_slice::<Value>(&bytes).ok().filter(|settings| settings["schema"] == SCHEMA)
}

fn remove(folder: &Path) -> Result<(), ExperimentError> {
    unfinished::remove(folder).map_err(output(folder, "remove the directory"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begin(place: &Path, particles: u32, force: bool) -> Result<UnfinishedRun, ExperimentError> {
        UnfinishedRun::begin(Destination { path: place, force }, &serde_json::json!({"particles": particles}))
    }

    fn files(text: &str) -> NamedFiles {
        vec![("poses.npz", text.as_bytes().to_vec())]
    }

    #[test]
    fn finished_seeds_are_found_by_the_same_settings_alone_and_only_whole() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("run"), root.path().join("run.partial"));
        let run = begin(&place, 100, false).unwrap();
        assert!(
            run.seed(3).is_none()
                && !matches!(run.told(ExperimentError::Interrupted), ExperimentError::ProgressSaved { .. })
        );
        let folder = run.put(3, &files("three")).unwrap();
        assert_eq!(fs::read_to_string(folder.join("poses.npz")).unwrap(), "three");
        run.put(4, &files("four")).unwrap();
        let told = run.told(ExperimentError::Interrupted);
        assert!(matches!(told, ExperimentError::ProgressSaved { .. }), "{told}");
        drop(run);
        let other = begin(&place, 200, false).unwrap_err();
        assert!(other.to_string().contains("particles: there 100, here 200"), "{other}");
        // a seed that was cut is not whole
        fs::write(around.join("seed-4/poses.npz"), "fo").unwrap();
        let again = begin(&place, 100, false).unwrap();
        assert!(again.seed(3).is_some() && again.seed(4).is_none());
        again.put(4, &files("four")).unwrap();
        assert!(again.seed(4).is_some());
        again.finish();
        drop(again);
        assert!(!around.exists());
        begin(&place, 100, false).unwrap().put(0, &files("0")).unwrap();
        assert!(begin(&place, 200, true).unwrap().seed(0).is_none(), "begun anew");
        assert!(!around.exists());
    }

    #[test]
    fn somebody_elses_folder_of_that_name_is_left_alone() {
        let root = tempfile::tempdir().unwrap();
        let (place, around) = (root.path().join("run"), root.path().join("run.partial"));
        fs::create_dir(&around).unwrap();
        fs::write(around.join("thesis.tex"), "years of work").unwrap();
        for force in [false, true] {
            assert!(matches!(begin(&place, 1, force), Err(ExperimentError::Occupied { .. })));
        }
        fs::remove_file(around.join("thesis.tex")).unwrap();
        fs::write(around.join(SETTINGS), "{\"sche").unwrap();
        drop(begin(&place, 1, false).unwrap());
        assert!(!around.exists(), "killed before a seed was finished");
    }
}
