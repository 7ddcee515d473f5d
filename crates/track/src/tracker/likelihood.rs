//! How well a pose explains what the cameras saw.

use super::TrackError;
use crate::motion_model::NormalEquations;
use skiagraph_core::body::Pose;
use skiagraph_core::observation::Observation;

/// Energy of a pose given an observation, `E(y_t, x_t)` of `[Skinned APF]` Eq. 2; lower is better.
///
/// Work that depends only on the observation is done once, in [`Self::prepare`]. [`Self::energy`] is then called for
/// many poses from several threads, each with its own scratch buffers.
pub trait Likelihood: Send + Sync {
    /// Scratch buffers of one thread.
    type Scratch: Send;

    /// New scratch buffers.
    fn scratch(&self) -> Self::Scratch;

    /// Sets the observation for the following energies.
    ///
    /// # Errors
    /// [`TrackError::ObservationMismatch`] if it does not match the cameras of this likelihood.
    fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError>;

    /// Learns from the start pose and the first frame, which was prepared. Does nothing by default.
    fn start(&mut self, _start: &Pose) {}

    /// Learns from the estimate of the frame that was prepared. Does nothing by default.
    fn learn(&mut self, _estimate: &Pose) {}

    /// The energy of `pose`; not finite for an invalid pose. The result for a pose is bit-identical for any scratch.
    fn energy(&self, pose: &Pose, scratch: &mut Self::Scratch) -> f64;

    /// Writes the energy of each pose to `energies`, which has the same length. Likelihoods can override it if
    /// processing all poses stage by stage is faster. Bit-identical to [`Self::energy`].
    fn energies(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut Self::Scratch) {
        for (pose, energy) in poses.iter().zip(energies) {
            *energy = self.energy(pose, scratch);
        }
    }

    /// The energy of `pose` without rejection; the same as [`Self::energy`] for likelihoods that reject no pose.
    fn energy_unrejected(&self, pose: &Pose, scratch: &mut Self::Scratch) -> f64 {
        self.energy(pose, scratch)
    }

    /// Believes the whole observation that was prepared, as measures do, so that energies can be compared; returns
    /// whether any of it was doubted.
    fn believe(&mut self) -> bool {
        false
    }

    /// Whether [`Self::linearise`] is supported.
    fn descends(&self) -> bool {
        false
    }

    /// The observation's evidence about a small step from `pose`: linearised squared contour residuals with robust
    /// weights of `width` lengths (a length is 1/240 of the image height). `None` if the likelihood has no such
    /// residuals, which rules out descent, or if the pose is not finite.
    fn linearise(&self, _pose: &Pose, _width: f64, _scratch: &mut Self::Scratch) -> Option<NormalEquations> {
        None
    }

    /// Share of the body's outline at `pose` that agrees with the observation, in [0, 1], for robust weights of `width`
    /// lengths; `None` if no outline is in an image, or without outlines.
    fn agreement(&self, _pose: &Pose, _width: f64, _scratch: &mut Self::Scratch) -> Option<f64> {
        None
    }

    /// Number of images of the prepared frame whose outlines are all the evidence; 0 if there is other evidence.
    fn views(&self) -> usize {
        0
    }
}
