//! Verifies a set with progress.

use crate::benchmark_set::{BlindSet, SetPlace, Verification, VerifyOptions, verify_place};
use crate::common::{ExperimentError, Progress, Stage};

/// `skiagraph verify`: makes every check of a set; silhouettes and truth images of every `every`th frame are drawn
/// again.
///
/// # Errors
/// [`ExperimentError::Set`] if the directory is not a set of this format; [`ExperimentError::Interrupted`]. Problems of
/// a set are not errors but faults in the result.
pub fn verify_set(set: SetPlace<'_>, every: usize, progress: &dyn Progress) -> Result<Verification, ExperimentError> {
    // no progress for a set whose frames cannot be counted
    let frames = BlindSet::read(set.folder).map_or(0, |set| set.frame_count.div_ceil(every.max(1)));
    progress.begin(Stage::Verify, frames);
    let how = VerifyOptions { every, tick: &|| progress.advance(), stop: &|| progress.interrupted() };
    Ok(verify_place(set, how)?)
}
