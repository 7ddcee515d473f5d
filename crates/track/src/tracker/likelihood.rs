//! How well a pose explains what the cameras saw.

use super::TrackError;
use crate::body::Pose;
use crate::motion_model::{Evidence, NormalEquations};
use crate::observation::Observation;

/// An energy of poses given an observation, `E(y_t, x_t)` of `[Skinned APF]` Eq. 2; lower is better.
///
/// Work that depends on the observation alone is done once in [`Self::prepare`]; [`Self::energy`] is then called for
/// many poses, from many threads at once, each with its own scratch.
pub trait Likelihood: Send + Sync {
    /// Buffers of one thread.
    type Scratch: Send;

    /// Fresh buffers.
    fn scratch(&self) -> Self::Scratch;

    /// Takes the observation that the next energies are about.
    ///
    /// # Errors
    /// [`TrackError::ObservationMismatch`] if it is not what the cameras of this likelihood give.
    fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError>;

    /// The energy of `pose`; not finite for a pose that cannot be. Same bits for the same pose, whatever the scratch.
    fn energy(&self, pose: &Pose, scratch: &mut Self::Scratch) -> f64;

    /// The energies of several poses, as many as there are places for them: for likelihoods whose work falls into parts
    /// that are done faster for all poses one after the other. Same bits as [`Self::energy`].
    fn energies(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut Self::Scratch) {
        for (pose, energy) in poses.iter().zip(energies) {
            *energy = self.energy(pose, scratch);
        }
    }

    /// The energy of `pose` as if no pose were rejected for what it is; the same as [`Self::energy`] where none ever
    /// is.
    fn energy_unrejected(&self, pose: &Pose, scratch: &mut Self::Scratch) -> f64 {
        self.energy(pose, scratch)
    }

    /// Whether [`Self::linearise`] has an answer.
    fn descends(&self) -> bool {
        false
    }

    /// What the observation says of a small step from `pose`: squared residuals of contours, linearised, with robust
    /// weights of `width` lengths (a length is 1/240 of an image's height). `None` for likelihoods without such
    /// residuals, which cannot be descended, and for poses that are not finite.
    fn linearise(&self, _pose: &Pose, _width: f64, _scratch: &mut Self::Scratch) -> Option<NormalEquations> {
        None
    }

    /// As [`Self::linearise`], with how the residuals scatter: how sure the observation is of a pose.
    fn evidence(&self, _pose: &Pose, _width: f64, _scratch: &mut Self::Scratch) -> Option<Evidence> {
        None
    }
}
