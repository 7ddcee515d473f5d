//! Verifying a set under the eyes of a watch.

use crate::benchmark_set::{BlindSet, SetPlace, Verification, VerifyOptions, verify_place};
use crate::common::{ExperimentError, Progress, Stage};

/// `skiagraph verify`: makes every check of a set; of every `every`th frame silhouettes and truth
/// images are drawn anew.
///
/// # Errors
/// [`ExperimentError::Set`] for a directory that is no set of this format; [`ExperimentError::Interrupted`]. What is
/// wrong with a set is no error but a fault.
pub fn verify_set(set: SetPlace<'_>, every: usize, progress: &dyn Progress) -> Result<Verification, ExperimentError> {
    // a set too broken to be counted has no progress to show
    let frames = BlindSet::read(set.folder).map_or(0, |set| set.frame_count.div_ceil(every.max(1)));
    progress.begin(Stage::Verify, frames);
    let how = VerifyOptions { every, tick: &|| progress.advance(), stop: &|| progress.interrupted() };
    Ok(verify_place(set, how)?)
}
