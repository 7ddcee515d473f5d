//! The finished sets of an incomplete ladder, in a file beside them, so that the same command resumes.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::key_source::{KeySource, fresh_key, has_secrets, note, without_key};
use super::unfinished_set::{UnfinishedSet, settings_of};
use crate::artefacts::{ArtefactError, output, write_whole};
use crate::benchmark_set::BlindSet;
use crate::common::ExperimentError;
use crate::input::{self, hex_sha256, limits};
use crate::prepare::scenario_copy::scenario_text;
use crate::rng::ObservationKey;
use crate::scenario::ScenarioFile;

const SCHEMA: &str = "skiagraph.ladder-progress/1";

/// The finished sets of an incomplete ladder.
#[derive(Debug)]
pub struct LadderProgress {
    path: PathBuf,
    record: ProgressRecord,
}

#[derive(Debug, Serialize, Deserialize)]
struct ProgressRecord {
    schema: String,
    /// The key of all sets.
    #[serde(default)]
    key: ObservationKey,
    #[serde(default)]
    made: Vec<MadeSet>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct MadeSet {
    /// Hash of scenario and options.
    settings_sha256: String,
    set_hash: String,
}

impl LadderProgress {
    /// The progress of the ladder of an axis in `folder`; empty if there is no such file of this program.
    pub fn read(folder: &Path, axis: &str) -> Self {
        let path = folder.join(format!("{axis}.partial"));
        let text = input::read_to_string(&path, limits::SETTINGS).unwrap_or_default();
        let record = toml::from_str(&text).ok().filter(|record: &ProgressRecord| record.schema == SCHEMA);
        let none = ProgressRecord { schema: SCHEMA.to_owned(), key: ObservationKey::PUBLIC, made: Vec::new() };
        Self { path, record: record.unwrap_or(none) }
    }

    /// The key of all sets of this ladder, which differ only in a strength: the given key, that of the unfinished
    /// ladder, or a fresh one. Returns a note about a drawn key.
    ///
    /// # Errors
    /// [`ExperimentError::Argument`] if the operating system provides no random numbers.
    pub fn settle_key(
        &mut self,
        source: KeySource,
        sets: &[(ScenarioFile, PathBuf)],
    ) -> Result<(ObservationKey, Option<String>), ExperimentError> {
        let stated = sets.first().and_then(|(file, _)| source.stated(file));
        let of_made = || (!self.record.made.is_empty()).then_some(self.record.key);
        let begun = || of_made().or_else(|| sets.iter().find_map(|(_, place)| UnfinishedSet::key_begun(place)));
        let key = match stated.or_else(begun) {
            Some(key) => key,
            None if sets.iter().any(|(file, _)| has_secrets(file)) => fresh_key()?,
            None => ObservationKey::PUBLIC,
        };
        if self.record.key != key {
            self.record.made.clear();
        }
        self.record.key = key;
        let place = sets.first().map(|(_, place)| place).filter(|_| stated.is_none() && !key.is_public());
        Ok((key, place.map(|place| note(place))))
    }

    /// Whether `place` has the set that this ladder made from these settings.
    ///
    /// # Errors
    /// [`ExperimentError`] if the scenario cannot be serialised.
    pub fn has(&self, file: &ScenarioFile, shards: Option<usize>, place: &Path) -> Result<bool, ExperimentError> {
        let settings = digest(file, shards)?;
        let made = self.record.made.iter().find(|made| made.settings_sha256 == settings);
        let there = || BlindSet::read(place).ok().map(|set| set.set_hash);
        Ok(made.is_some_and(|made| there().as_ref() == Some(&made.set_hash)))
    }

    /// Records a finished set.
    ///
    /// # Errors
    /// [`ArtefactError::Output`] if the file cannot be written; [`ArtefactError::Occupied`] if another file is there.
    pub fn add(&mut self, file: &ScenarioFile, shards: Option<usize>, set_hash: &str) -> Result<(), ExperimentError> {
        let made = MadeSet { settings_sha256: digest(file, shards)?, set_hash: set_hash.to_owned() };
        let is_own_output =
            || input::read_to_string(&self.path, limits::SETTINGS).is_ok_and(|text| text.contains(SCHEMA));
        if self.path.symlink_metadata().is_ok() && !is_own_output() {
            return Err(ArtefactError::Occupied { path: self.path.clone() }.into());
        }
        self.record.made.push(made);
        let malformed =
            |e: toml::ser::Error| ExperimentError::Malformed { path: self.path.clone(), detail: e.to_string() };
        let text = toml::to_string(&self.record).map_err(malformed)?;
        Ok(write_whole(&self.path, text.as_bytes())?)
    }

    /// Removes the file of a complete ladder.
    ///
    /// # Errors
    /// [`ArtefactError::Output`] if the file cannot be removed.
    pub fn finish(self) -> Result<(), ArtefactError> {
        if self.record.made.is_empty() {
            return Ok(());
        }
        fs::remove_file(&self.path).map_err(output(&self.path, "remove"))
    }
}

fn digest(file: &ScenarioFile, shards: Option<usize>) -> Result<String, ExperimentError> {
    let settings = toml::to_string(&settings_of(&scenario_text(&without_key(file))?, shards)?);
    let malformed = |e: toml::ser::Error| ExperimentError::Malformed { path: "settings".into(), detail: e.to_string() };
    Ok(hex_sha256(settings.map_err(malformed)?.as_bytes()))
}
