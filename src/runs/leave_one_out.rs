//! How well a tracker foretells cameras that it did not see: one after another is left out, and tracked again.

use std::path::Path;

use crate::artefacts::MadeBy;
use crate::common::{ExperimentError, Progress};
use crate::measure::Tracked;
use crate::measure::footage::FootageMeasures;
use crate::tracking::track::track;
use crate::train::Models;
use skiagraph_core::body::Calibrated;
use skiagraph_set::BlindSet;

/// The overlap of the first seed in every camera, tracked again without it: by the camera's name, one value per frame.
///
/// If the run corrected the cameras, all use the corrected ones, to which the images of the left-out camera
/// contributed; the body is calibrated anew without them.
///
/// # Errors
/// [`ExperimentError`] if the run is not of a tracker of this program with all cameras, or tracking fails.
pub(super) fn leave_one_out(
    set: &BlindSet,
    run: &Path,
    tracked: &Tracked,
    progress: &dyn Progress,
) -> Result<Vec<(String, Vec<f64>)>, ExperimentError> {
    let refuse = |expected: &str| ExperimentError::Argument {
        argument: "--leave-one-out",
        detail: format!("expected {expected}: {}", run.display()),
    };
    let record = tracked.record.as_ref().ok_or_else(|| refuse("a run of a tracker that skiagraph has"))?;
    let seed = *tracked.estimates.seeds.first().ok_or_else(|| refuse("a run with a seed"))?;
    if !record.left_out.is_empty() {
        return Err(refuse("a run with all cameras, as track makes without --leave-out"));
    }
    if set.rig.cameras.len() < 2 {
        return Err(refuse("a set of two cameras or more"));
    }
    let asked = MadeBy::at(run).map(|made_by| made_by.settings["--calibrate"].clone());
    let asked = asked.and_then(|asked| serde_json::from_value(asked).ok()).unwrap_or(set.start.calibrate);
    let mut given = set.clone();
    given.start.calibrate = asked;
    if let Some(rig) = tracked.corrected_rig(set, 0) {
        given.rig = rig;
        given.start.calibrate = if asked.has_body() { Calibrated::Body } else { Calibrated::Nothing };
    }
    let mut all = Vec::new();
    for (index, camera) in set.rig.cameras.iter().enumerate() {
        let seen = given.clone().without_images_of(&[index]);
        let mut without = track(&seen, &record.tracker, &[seed], None, &mut Models::default(), progress)?;
        without.record.iter_mut().for_each(|record| record.left_out = vec![camera.name.clone()]);
        all.extend(FootageMeasures::new(&given, &without, progress)?.left_out);
    }
    Ok(all)
}
