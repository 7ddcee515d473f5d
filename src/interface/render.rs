//! Benchmark sets from scenarios.

use std::path::PathBuf;

use crate::artefacts::Destination;
use crate::common::{ExperimentError, NoProgress};
use crate::rendering;
use crate::scenario::ScenarioFile;
use skiagraph_set::BenchmarkSet;

/// Makes the benchmark set of a scenario, in memory, or on disk if `to` is given. Returns the set and notes for the
/// user.
///
/// Recordings are searched for as by the commands: beside the scenario, and in the folder that the environment variable
/// `SKIAGRAPH_MOCAP` names. Random errors of the observations are drawn with the key in the scenario, else with the
/// public key, so the same scenario always gives the same bytes. The command `skiagraph render` draws a secret key
/// instead.
///
/// ```
/// use skiagraph::{ScenarioFile, render};
/// let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &["last_frame=4".to_owned()])?;
/// let (set, _notes) = render(&scenario, None)?;
/// assert_eq!(set.blind.observation(0)?.silhouettes.len(), set.blind.rig.cameras.len());
/// assert_eq!(set.truth.ground_truth.frames.len(), set.blind.frame_count);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ExperimentError`] that names the file, line or key. Then nothing has changed on disk. An existing set is replaced
/// only if [`Destination::force`] is set.
pub fn render(
    scenario: &ScenarioFile,
    to: Option<Destination<'_>>,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    let recordings = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
    match to {
        None => rendering::draw(scenario, recordings.as_deref(), &NoProgress),
        Some(to) => rendering::render(scenario, recordings.as_deref(), to, &Default::default(), &NoProgress),
    }
}
