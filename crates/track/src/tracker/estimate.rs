//! A tracker's result for one frame.

use crate::motion_model::ModelOccupancy;
use skiagraph_core::body::Pose;

/// A tracker's result for one frame.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Frame number of the observation.
    pub frame: usize,
    /// Pose of the *tracker's* body.
    pub pose: Pose,
    /// Energy of that pose under the tracker's likelihood; `None` for trackers without one.
    pub energy: Option<f64>,
    /// Statistics of the search, layer by layer; empty for trackers without layers, and in frames without a search.
    pub layers: Vec<LayerRecord>,
    /// Whether the search of particles and limbs found a pose of clearly lower energy than the descents before it;
    /// false where nothing is descended.
    pub by_search: bool,
    /// Number of energies evaluated for this frame.
    pub evaluations: u64,
    /// Where the weighted particles lie, for motion models with latent spaces; empty for all others.
    pub occupancy: Vec<ModelOccupancy>,
}

impl Estimate {
    /// The result of a tracker that evaluates no energies.
    pub fn without_search(frame: usize, pose: Pose) -> Self {
        let (layers, occupancy) = (Vec::new(), Vec::new());
        Self { frame, pose, energy: None, layers, by_search: false, evaluations: 0, occupancy }
    }
}

/// Statistics of one annealing layer in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerRecord {
    /// Annealing variable of `[Skinned APF]` Eq. 2.
    pub lambda: f64,
    /// `1 / sum w^2` of the normalised weights.
    pub effective_sample_size: f64,
    /// Lowest energy of a particle.
    pub energy_min: f64,
    /// Mean energy over valid particles.
    pub energy_mean: f64,
    /// Standard deviation of the energy over valid particles.
    pub energy_std: f64,
    /// Whether Eq. 4 had no regular solution (all energies equal, too many ties, too many invalid particles).
    pub degenerate: bool,
}

/// Why tracking failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The number of views differs from the rig's, or a mask has a different size from its camera's image.
    #[error("set frame {frame} (from 0): the observation does not fit the cameras: {detail}")]
    ObservationMismatch {
        /// Frame number.
        frame: usize,
        /// What differs.
        detail: String,
    },
    /// [`super::Tracker::track`] was called before [`super::Tracker::start`].
    #[error("set frame {frame} (from 0): the tracker has no start pose; call `start` before `track`")]
    NotStarted {
        /// Frame number.
        frame: usize,
    },
    /// The start pose belongs to a different body.
    #[error("start pose: expected {expected} joint angles, found {found}; it must be a pose of the tracker's own body")]
    StartMismatch {
        /// Degrees of freedom of the tracker's body.
        expected: usize,
        /// Joint angles of the start pose.
        found: usize,
    },
    /// Every particle was invalid.
    #[error(
        "set frame {frame} (from 0): no valid particle is left; widen the initial covariance or check the start pose"
    )]
    NoValidParticle {
        /// Frame number.
        frame: usize,
    },
}
