//! The files of a scenario: its copy beside the results, and the files that it reads.

use std::path::Path;

use super::camera_files::files_at;
use super::{clip_file, skins};
use crate::artefacts::{Inputs, MADE_BY, MadeBy};
use crate::common::ExperimentError;
use crate::scenario::{RUN_COMMAND, Scenario, ScenarioFile};

/// The scenario that `place` writes; runs of earlier versions have theirs in it.
pub(crate) const SCENARIO_FILE: &str = "scenario.toml";

/// The scenario with its overrides as TOML, to be run again.
pub(crate) fn scenario_text(scenario: &Scenario) -> Result<String, ExperimentError> {
    let malformed = |detail| ExperimentError::Malformed { path: SCENARIO_FILE.into(), detail };
    let tree = serde_json::to_value(scenario).map_err(|e| malformed(e.to_string()))?;
    toml::to_string(&tree).map_err(|e| malformed(e.to_string()))
}

/// `skiagraph run` of a scenario: the record is a scenario to be run again.
pub(crate) fn made_by_run(scenario: &Scenario) -> Result<MadeBy, ExperimentError> {
    made_by(RUN_COMMAND, scenario)
}

/// `skiagraph render` of a scenario without trackers.
pub(crate) fn made_by_render(scenario: &Scenario) -> Result<MadeBy, ExperimentError> {
    made_by("skiagraph render", scenario)
}

fn made_by(command: &str, scenario: &Scenario) -> Result<MadeBy, ExperimentError> {
    let malformed = |e: serde_json::Error| ExperimentError::Malformed { path: MADE_BY.into(), detail: e.to_string() };
    Ok(MadeBy::new(command, serde_json::to_value(scenario).map_err(malformed)?))
}

/// The files that a scenario reads: its own file, recordings, robots, skins, cameras and models.
pub(crate) fn inputs_of(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Inputs {
    let scenario = &file.scenario;
    let training = scenario.training.iter().flat_map(|training| &training.clips);
    let others = scenario.distractor.iter().map(|other| &other.motion);
    let recordings = training.chain([&scenario.motion]).chain(others).flat_map(|motion| motion.takes("motion"));
    let places = clip_file::Folders::of(file, mocap_directory);
    let recordings = recordings.flat_map(|(_, take)| clip_file::paths_of(places, Path::new(&take.clip), &take));
    let others = scenario.distractor.iter().map(|other| &other.robot);
    let robots = [&scenario.actor.robot, &scenario.tracker_body.robot].into_iter().chain(others);
    let robots = robots.map(|robot| file.folder.join(robot));
    let cameras = scenario.rig.file.iter().flat_map(|settings| files_at(&file.folder.join(&settings.path)).concat());
    let trackers = scenario.trackers();
    let models =
        trackers.iter().filter_map(|(_, tracker)| tracker.kind().model_file()).map(|name| file.folder.join(name));
    let named = robots.chain(cameras).chain(models).chain(skins::paths_of(scenario, &file.folder));
    Inputs::new(file.path.iter().cloned().chain(recordings).chain(named))
}
