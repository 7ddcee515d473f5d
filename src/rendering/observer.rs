//! Observes the truth with the settings of `[observation]`.

use super::memory;
use crate::common::ExperimentError;
use skiagraph_core::camera::TimedRig;
use skiagraph_truth::observing::{ObservationSettings, SilhouetteObserver, SilhouetteSource};
use skiagraph_truth::scene::GroundTruth;

/// The observer of the truth with the true cameras.
///
/// # Errors
/// [`ExperimentError::Argument`] if the background cannot be learned, or would take more than the available memory.
pub(crate) fn observer<'a>(
    truth: &'a GroundTruth,
    rig: &TimedRig,
    settings: &ObservationSettings,
) -> Result<SilhouetteObserver<'a>, ExperimentError> {
    if settings.silhouette == SilhouetteSource::Segmented
        && let Some(detail) = memory::shortage(rig.rig(), &settings.images, rayon::current_num_threads())
    {
        return Err(ExperimentError::Argument { argument: "observation.silhouette", detail });
    }
    let seen = SilhouetteObserver::new(truth, rig, &settings.facts(), settings.keyed_seed());
    seen.map_err(|e| ExperimentError::Argument {
        argument: "observation.images.background_frames",
        detail: e.to_string(),
    })
}
