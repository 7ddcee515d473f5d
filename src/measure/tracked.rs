//! The estimates of a tracker and their files: `track.json`, `poses.npz` and `search.npz`; `learned_from.npz` if the
//! tracker moves on a model from a file; `bodies.json` if it calibrated its body (one body per seed, which the poses of
//! the seed refer to); `cameras.toml` if it corrected its cameras (`cameras-SEED.toml` of each of several seeds).
//!
//! `poses.npz` holds the estimates, and any program may write it. `search.npz` describes the search of this program's
//! trackers (`search_file.rs`).

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::poses_file::ReadAs;
use super::search_file::{SearchRecord, read_search, search_to_npz};
use crate::common::{ExperimentError, NamedFiles, read_file, to_json};
use crate::external::{ANSWERS_FILE, EXTERNAL_FILE, ExternalRecord, TrackTiming};
use crate::scenario::{TrackerSettings, json_tree};
use skiagraph_core::body::Humanoid;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::input::limits;
use skiagraph_set::{
    BlindSet, EstimatedSequence, Estimates, SourceRecording, bodies_from_json, bodies_to_json, cameras_to_toml,
    recordings_from_npz, recordings_to_npz,
};
use skiagraph_track::tracker::{CalibrationReport, CalibrationVerdict, Estimate};

pub(crate) const TRACK_FILE: &str = "track.json";
pub(crate) const POSES_FILE: &str = "poses.npz";
pub(crate) const SEARCH_FILE: &str = "search.npz";
/// The bodies of a run whose tracker calibrated its body, if a calibrated one was kept.
pub(crate) const BODIES_FILE: &str = "bodies.json";
/// The recordings that the tracker's model file was learned from, if it has one, in the format of a set's
/// `truth/recording.npz`.
pub(crate) const LEARNED_FROM_FILE: &str = "learned_from.npz";

/// A tracker's estimates and search records.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Tracked {
    /// The tracker and the set; `None` for poses of another program, and for trackers of a program that uses
    /// this library.
    pub record: Option<TrackRecord>,
    /// The estimates.
    pub estimates: Estimates,
    /// `[seed][frame]`: the search records; empty for poses of another program.
    pub search: Vec<Vec<SearchRecord>>,
    /// The recordings that a model from a file was learned from; empty without such a model.
    pub sources: Vec<SourceRecording>,
    /// The external program that tracked, if one did.
    pub program: Option<ExternalRecord>,
    /// Its table of answers, if it was run now.
    pub(crate) answers: Vec<u8>,
    /// The measured file or folder as named by the command, if the results go elsewhere.
    pub estimate: Option<String>,
    /// How the file was read, if another program wrote it.
    pub read_as: Option<ReadAs>,
}

/// The tracker and the set of a run: `track.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackRecord {
    /// `skiagraph.track/1`.
    pub schema: String,
    /// The tracker and all its settings as in a scenario.
    pub tracker: TrackerSettings,
    /// Hash of the set's files.
    pub set_hash: String,
    /// Descriptions of the tracker's training recordings; empty without any.
    #[serde(default)]
    pub learned_from: Vec<String>,
    /// Names of the cameras whose images it did not get.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// Results of the calibration of the tracker's body, one entry per seed; absent without calibration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub calibration: Vec<CalibrationReport>,
    pub version: String,
    /// What differs between runs.
    pub timing: TrackTiming,
}

impl Tracked {
    /// Estimates of every seed, without a record; `bodies` has one body per seed, or is empty if all use the set's
    /// body.
    pub(crate) fn new(set: &BlindSet, seeds: &[u64], bodies: Vec<Humanoid>, estimates: Vec<Vec<Estimate>>) -> Self {
        let mut sequences = Vec::new();
        let mut search = Vec::new();
        for (index, of_seed) in estimates.into_iter().enumerate() {
            let poses = of_seed.iter().map(|e| e.pose.clone()).collect();
            let body = bodies.get(index).unwrap_or(&set.start.body);
            sequences.push(EstimatedSequence::from_poses(body, poses));
            let records = of_seed.into_iter().map(|e| SearchRecord {
                energy: e.energy,
                evaluations: e.evaluations,
                layers: e.layers,
                by_search: e.by_search,
                occupancy: e.occupancy,
            });
            search.push(records.collect());
        }
        let (frames_per_second, seeds) = (set.frames_per_second, seeds.to_vec());
        let estimates = Estimates { frames_per_second, seeds, sequences, bodies, notes: Vec::new() };
        Self { search, ..Self::from_estimates(estimates) }
    }

    pub(crate) fn from_estimates(estimates: Estimates) -> Self {
        let (search, sources) = (Vec::new(), Vec::new());
        Self {
            record: None,
            estimates,
            search,
            sources,
            program: None,
            answers: Vec::new(),
            estimate: None,
            read_as: None,
        }
    }

    /// Runs of one tracker with one seed each, joined in their order.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] if there is no run.
    pub(crate) fn of_seeds(set: &BlindSet, seeds: Vec<Self>) -> Result<Self, ExperimentError> {
        let own_body = |one: &Self| one.estimates.bodies.first().unwrap_or(&set.start.body).clone();
        let are_calibrated = seeds.iter().any(|one| !one.estimates.bodies.is_empty());
        let bodies = if are_calibrated { seeds.iter().map(own_body).collect() } else { Vec::new() };
        let mut seeds = seeds.into_iter();
        let mut all = seeds
            .next()
            .ok_or_else(|| ExperimentError::Malformed { path: POSES_FILE.into(), detail: "no seed".to_owned() })?;
        for one in seeds {
            all.estimates.seeds.extend(one.estimates.seeds);
            all.estimates.sequences.extend(one.estimates.sequences);
            all.search.extend(one.search);
            if let (Some(record), Some(of_seed)) = (&mut all.record, one.record) {
                record.calibration.extend(of_seed.calibration);
                record.timing = record.timing.and(of_seed.timing);
            }
        }
        all.estimates.bodies = bodies;
        Ok(all)
    }

    /// The files of a run that is not measured yet.
    ///
    /// # Errors
    /// [`ExperimentError::Set`] if the arrays are too large for a file.
    pub fn files(&self, set: &BlindSet) -> Result<NamedFiles, ExperimentError> {
        let mut files: NamedFiles =
            vec![(POSES_FILE.into(), self.estimates.to_bytes(POSES_FILE, &set.start.body, None)?)];
        if let Some(record) = &self.record {
            files.push((TRACK_FILE.into(), to_json(record)?));
            files.push((SEARCH_FILE.into(), search_to_npz(&self.search).to_bytes(SEARCH_FILE)?));
        }
        if let Some(program) = &self.program {
            files.push((EXTERNAL_FILE.into(), to_json(program)?));
        }
        if !self.answers.is_empty() {
            files.push((ANSWERS_FILE.into(), self.answers.clone()));
        }
        if !self.estimates.bodies.is_empty() {
            files.push((BODIES_FILE.into(), bodies_to_json(BODIES_FILE, &self.estimates.bodies)?));
        }
        for (index, seed) in self.estimates.seeds.iter().enumerate() {
            if let Some(rig) = self.corrected_rig(set, index) {
                let which = if self.estimates.seeds.len() > 1 { format!("-{seed}") } else { String::new() };
                files.push((format!("cameras{which}.toml").into(), cameras_to_toml(&rig.cameras).into_bytes()));
            }
        }
        if !self.sources.is_empty() {
            files.push((LEARNED_FROM_FILE.into(), recordings_to_npz(LEARNED_FROM_FILE, &self.sources)?));
        }
        Ok(files)
    }

    /// The cameras as the seed of this index corrected them; `None` if it uses the given ones.
    pub(crate) fn corrected_rig(&self, set: &BlindSet, seed: usize) -> Option<CameraRig> {
        let report = self.record.as_ref()?.calibration.get(seed)?;
        let is_used = report.verdict == CalibrationVerdict::Kept && !report.cameras.is_empty();
        is_used.then(|| {
            let mut rig = set.rig.clone();
            for (camera, correction) in rig.cameras.iter_mut().zip(&report.cameras) {
                camera.camera_from_world *= correction.motion();
            }
            rig
        })
    }

    /// Reads a run of this program; `body` is the tracker's body in the run's set.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the missing or malformed file.
    pub fn read(folder: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let path = folder.join(BODIES_FILE);
        let bodies = if path.is_file() {
            bodies_from_json(&path.display().to_string(), &read_file(&path, limits::JSON)?)?
        } else {
            Vec::new()
        };
        let path = folder.join(POSES_FILE);
        let bytes = read_file(&path, limits::ARRAYS)?;
        let estimates = Estimates::from_bodies(&path.display().to_string(), &bytes, body, bodies)?;
        let path = folder.join(TRACK_FILE);
        let malformed = |detail| ExperimentError::Malformed { path: path.clone(), detail };
        let record = json_tree::value_of_file(&read_file(&path, limits::RECORD)?).map_err(malformed)?;
        let path = folder.join(SEARCH_FILE);
        let search = read_search(&path, [estimates.seeds.len(), estimates.frames()])?;
        let path = folder.join(LEARNED_FROM_FILE);
        let sources = if path.is_file() {
            recordings_from_npz(&path.display().to_string(), &read_file(&path, limits::ARRAYS)?)?
        } else {
            Vec::new()
        };
        Ok(Self { record: Some(record), search, sources, ..Self::from_estimates(estimates) })
    }

    /// Reads a run of `skiagraph track --exec`.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the missing or malformed file.
    pub fn read_program(folder: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let path = folder.join(EXTERNAL_FILE);
        let malformed = |detail| ExperimentError::Malformed { path: path.clone(), detail };
        let program: ExternalRecord =
            json_tree::value_of_file(&read_file(&path, limits::RECORD)?).map_err(malformed)?;
        Ok(Self { program: Some(program.sanitised()), ..Self::from_others(&folder.join(POSES_FILE), body)? })
    }

    /// Reads only a `poses.npz` of any program, for the tracker's body.
    ///
    /// # Errors
    /// [`ExperimentError`] if it cannot be read or is malformed.
    pub fn from_others(file: &Path, body: &Humanoid) -> Result<Self, ExperimentError> {
        let estimates = Estimates::from_bytes(&file.display().to_string(), &read_file(file, limits::ARRAYS)?, body)?;
        Ok(Self::from_estimates(estimates))
    }
}
