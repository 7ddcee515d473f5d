//! Identifies cells and sets by hashes of everything that their results depend on.
//!
//! | hash | of |
//! |---|---|
//! | set | program version, scenario without its trackers and seeds, contents of recordings and robots |
//! | cell | program version, scenario with one tracker and one seed, contents of recordings, robots, models and programs |
//!
//! The contents of a program are those of the files that its command line names.
//!
//! File names are hashed as written in the scenario, without the folders above them, so that a sweep may be moved.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::common::{ExperimentError, stays_unreadable};
use crate::prepare::scenario_copy::inputs_of;
use crate::scenario::{Scenario, ScenarioFile};
use crate::tracking::program::files_in;
use skiagraph_core::input::{self, hex_sha256, hex_sha256_of};

/// Number of hexadecimal digits of a shortened hash.
pub(super) const DIGITS: usize = 16;

/// Maximum size of an input to hash, bytes: larger than any valid recording or model.
const LARGEST_INPUT: u64 = 4 << 30;

/// A file that cells read, and the hash of its content.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct InputFile {
    pub path: PathBuf,
    pub sha256: String,
}

impl InputFile {
    pub(super) fn read(path: &Path) -> Result<Self, ExperimentError> {
        let unreadable = |source| ExperimentError::Unreadable { path: path.to_owned(), source };
        let file = input::open(path, LARGEST_INPUT).map_err(unreadable)?;
        Ok(Self { path: path.to_owned(), sha256: hex_sha256_of(file).map_err(unreadable)? })
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    pub(super) set: String,
    /// The setting: the cell without its seed.
    setting: String,
}

impl Identity {
    pub(super) fn cell(&self, seed: u64) -> String {
        short(&format!("skiagraph.cell/1\n{}\nseed {seed}\n", self.setting))
    }
}

/// Makes identities; every input is read once.
#[derive(Debug, Default)]
pub(super) struct Identities {
    mocap_directory: Option<PathBuf>,
    /// Files by the scenario parts that name them.
    known: Mutex<BTreeMap<String, Vec<InputFile>>>,
}

impl Identities {
    /// For scenarios whose clips are searched below this folder.
    pub(super) fn new(mocap_directory: Option<&Path>) -> Self {
        Self { mocap_directory: mocap_directory.map(Path::to_owned), known: Mutex::default() }
    }

    pub(super) fn identify(&self, file: &ScenarioFile) -> Result<Identity, ExperimentError> {
        let inputs = self.inputs(file)?;
        let contents: Vec<&str> = inputs.iter().map(|input| input.sha256.as_str()).collect();
        let contents = contents.join("\n");
        let bare = Scenario {
            description: String::new(),
            seed: 0,
            seeds: 1,
            truth_images: Vec::new(),
            methods: BTreeMap::new(),
            ..file.scenario.clone()
        };
        let hashed = |kind: &str, scenario: &Scenario| {
            let scenario = serde_json::to_string(scenario).unwrap_or_default();
            format!("skiagraph.{kind}/1\n{}\n{scenario}\n{contents}\n", env!("CARGO_PKG_VERSION"))
        };
        let programs = self.programs(file.scenario.clone())?;
        let setting = match programs.as_slice() {
            [] => hex_sha256(hashed("setting", &bare).as_bytes()),
            programs => {
                let contents: Vec<&str> = programs.iter().map(|program| program.sha256.as_str()).collect();
                hex_sha256(format!("{}programs\n{}\n", hashed("setting", &bare), contents.join("\n")).as_bytes())
            }
        };
        let set = short(&hashed("set", &Scenario { truth_images: Vec::new(), ..file.scenario.of_set() }));
        Ok(Identity { set, setting })
    }

    fn programs(&self, mut scenario: Scenario) -> Result<Vec<InputFile>, ExperimentError> {
        let commands: Vec<String> = scenario.programs().map(|program| program.command.clone()).collect();
        let named = commands.join("\n");
        if let Some(known) = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&named) {
            return Ok(known.clone());
        }
        let files = commands.iter().flat_map(|command| files_in(command));
        let files = files.map(|path| InputFile::read(&path)).collect::<Result<Vec<_>, _>>()?;
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(named, files.clone());
        Ok(files)
    }

    /// All files read so far, sorted by path.
    pub(super) fn into_inputs(self) -> Vec<InputFile> {
        let known = self.known.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut all: Vec<InputFile> = known.into_values().flatten().collect();
        all.sort();
        all.dedup();
        all
    }

    fn inputs(&self, file: &ScenarioFile) -> Result<Vec<InputFile>, ExperimentError> {
        let scenario = &file.scenario;
        let trackers = scenario.trackers();
        let models: Vec<&str> = trackers.iter().filter_map(|(_, tracker)| tracker.kind().model_file()).collect();
        let bodies = [
            (&scenario.actor.robot, &scenario.actor.skin),
            (&scenario.tracker_body.robot, &scenario.tracker_body.skin),
        ];
        let Scenario { motion, training, distractor, rig, .. } = scenario;
        let named =
            serde_json::to_string(&(motion, training, distractor, &rig.file, bodies, models)).unwrap_or_default();
        if let Some(known) = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&named) {
            return Ok(known.clone());
        }
        let own = file.path.as_deref();
        let paths = inputs_of(file, self.mocap_directory.as_deref()).into_paths();
        let paths = paths.iter().filter(|path| Some(path.as_path()) != own);
        // an unreadable or missing file is reported by the cells that need it
        let readable = paths.filter_map(|path| match InputFile::read(path) {
            Err(ExperimentError::Unreadable { source, .. }) if stays_unreadable(&source) => None,
            read => Some(read),
        });
        let inputs = readable.collect::<Result<Vec<_>, _>>()?;
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(named, inputs.clone());
        Ok(inputs)
    }
}

/// The first digits of a SHA-256.
pub(super) fn short(text: &str) -> String {
    let mut digest = hex_sha256(text.as_bytes());
    digest.truncate(DIGITS);
    digest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity(overrides: &[&str]) -> Identity {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        Identities::default().identify(&ScenarioFile::built_in(&overrides).unwrap()).unwrap()
    }

    #[test]
    fn the_hash_of_a_cell_covers_exactly_what_its_result_depends_on() {
        let base = identity(&[]);
        assert_eq!(base.cell(0).len(), DIGITS);
        assert_ne!(base.cell(0), base.cell(1));
        for same in [
            "seed=7",
            "seeds=2",
            "description=\"other words\"",
            "truth_images=[\"depth\"]",
            "tracker.annealed_particle_filter.layers=5",
        ] {
            assert_eq!(identity(&[same]), base, "{same}");
        }
        for tracker in ["particles=61", "survival_rate=0.4", "tracker.frozen={}"] {
            let other = identity(&[tracker]);
            assert_eq!(other.set, base.set, "{tracker}: the set is shared");
            assert_ne!(other.cell(0), base.cell(0), "{tracker}");
        }
        for scene in ["rig.ring.count=3", "motion.loop_to_s=4", "tracker_body.seed=2"] {
            let other = identity(&[scene]);
            assert!(other.set != base.set && other.cell(0) != base.cell(0), "{scene}");
        }
    }

    #[test]
    fn a_recording_is_identified_by_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let clip = folder.path().join("walk.txt");
        let of = |content: &str| {
            std::fs::write(&clip, content).unwrap();
            let overrides = ["motion.clip=walk.txt".to_owned()];
            let file =
                ScenarioFile::parse(crate::scenario::DEFAULT_SCENARIO, "a", folder.path().to_owned(), &overrides);
            let identities = Identities::new(None);
            let identity = identities.identify(&file.unwrap()).unwrap();
            (identity, identities.into_inputs())
        };
        let (one, inputs) = of("one");
        assert_eq!((inputs.len(), &inputs[0].path), (1, &clip));
        assert_ne!(one, of("two").0);
        assert_eq!(one, of("one").0);
    }

    #[test]
    fn settings_that_differ_only_in_a_file_have_separate_inputs() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.obj", "b.obj", "c.xml", "d.xml"] {
            std::fs::write(folder.path().join(name), name).unwrap();
        }
        let identities = Identities::new(None);
        let text = crate::scenario::DEFAULT_SCENARIO;
        for own in
            ["actor.skin=a.obj", "actor.skin=b.obj", "rig.file=[{path=\"c.xml\"}]", "rig.file=[{path=\"d.xml\"}]"]
        {
            let file = ScenarioFile::parse(text, "a", folder.path().to_owned(), &[own.to_owned()]).unwrap();
            identities.identify(&file).unwrap();
        }
        assert_eq!(identities.into_inputs().len(), 4);
    }
}
