//! Inputs of a command, which are never overwritten.

use std::fs;
use std::path::{Path, PathBuf};

use super::{ExperimentError, clip_file, skins};
use crate::benchmark_set::is_set;
use crate::scenario::{ScenarioFile, TrackerSettings};

/// The files and directories that a command reads.
#[derive(Clone, Debug, Default)]
pub(crate) struct Inputs {
    paths: Vec<PathBuf>,
}

impl Inputs {
    /// Of these paths; those that are not there are left out.
    pub(super) fn new(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        Self { paths: paths.into_iter().filter(|path| path.exists()).collect() }
    }

    /// The paths themselves.
    pub(crate) fn into_paths(self) -> Vec<PathBuf> {
        self.paths
    }

    /// Of a scenario: its file, recordings, robots and models.
    pub(crate) fn from_scenario(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Self {
        let scenario = &file.scenario;
        let training = scenario.training.iter().flat_map(|training| &training.clips);
        let others = scenario.distractor.iter().map(|other| &other.motion);
        let recordings = training.chain([&scenario.motion]).chain(others).flat_map(|motion| motion.takes("motion"));
        let places = clip_file::ClipFolders::of(file, mocap_directory);
        let recordings = recordings.flat_map(|(_, take)| clip_file::paths_of(places, Path::new(&take.clip), &take));
        let others = scenario.distractor.iter().map(|other| &other.robot);
        let robots = [&scenario.actor.robot, &scenario.tracker_body.robot].into_iter().chain(others);
        let robots = robots.map(|robot| file.folder.join(robot));
        let cameras = scenario.rig.file.iter().map(|settings| file.folder.join(&settings.path));
        let trackers = scenario.trackers();
        let models =
            trackers.iter().filter_map(|(_, tracker)| tracker.kind().model_file()).map(|name| file.folder.join(name));
        let named = robots.chain(cameras).chain(models).chain(skins::paths_of(file));
        // what a scenario may not name is not read
        let named = named.filter(|path| file.allowed.check(path).is_ok());
        Self::new(file.path.iter().cloned().chain(recordings).chain(named))
    }

    /// Of a tracker that reads a set.
    pub(super) fn from_set(set: &Path, settings: &TrackerSettings) -> Self {
        Self::new(settings.kind().model_file().map(PathBuf::from).into_iter().chain([set.to_owned()]))
    }

    /// An error if to write `target` would change an input: if it is one, holds one, or lies in a set that is one.
    ///
    /// # Errors
    /// [`ExperimentError::IsInput`].
    pub(super) fn keep_from(&self, target: &Path) -> Result<(), ExperimentError> {
        if target.file_name().is_none() {
            // a root or `..`: nothing can be written there at all, which is said elsewhere
            return Ok(());
        }
        let place = resolved(target);
        let changes = |input: &&PathBuf| {
            let read = resolved(input);
            read.starts_with(&place) || (is_set(&read) && place.starts_with(&read)) || same_file(target, input)
        };
        match self.paths.iter().find(changes) {
            Some(input) => Err(ExperimentError::IsInput { path: target.to_owned(), input: input.clone() }),
            None => Ok(()),
        }
    }
}

/// The path without links; of what is not there yet, by the nearest directory that is.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(real) = fs::canonicalize(path) {
        return real;
    }
    match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) if !parent.as_os_str().is_empty() => resolved(parent).join(name),
        (_, Some(name)) => resolved(Path::new(".")).join(name),
        _ => path.to_owned(),
    }
}

/// Whether two paths lead to one file, by whatever link.
#[cfg(unix)]
fn same_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |path| fs::metadata(path).map(|found| (found.dev(), found.ino()));
    matches!((identity(a), identity(b)), (Ok(a), Ok(b)) if a == b)
}

#[cfg(not(unix))]
fn same_file(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_kept_whatever_it_is_called() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        fs::create_dir_all(at("data/set")).unwrap();
        fs::write(at("data/walk.bvh"), "walk").unwrap();
        fs::write(at("data/set/files.sha256"), "set").unwrap();
        let inputs = Inputs::new([at("data/walk.bvh"), at("data/set"), at("nowhere")]);
        let mut targets = vec!["data/walk.bvh", "data/../data/walk.bvh", "data", "data/set", "data/set/runs/new"];
        if cfg!(unix) {
            #[cfg(unix)]
            std::os::unix::fs::symlink(at("data"), at("link")).unwrap();
            fs::hard_link(at("data/walk.bvh"), at("hard.bvh")).unwrap();
            targets.extend(["link", "link/walk.bvh", "hard.bvh", "link/set/a"]);
        }
        for target in targets {
            assert!(inputs.keep_from(&at(target)).is_err(), "{target}");
        }
        for target in ["data/walk.html", "data/set2", "runs/a/b", "nowhere", "data/walk.bvh~"] {
            inputs.keep_from(&at(target)).unwrap();
        }
    }
}
