//! Models of the motion of a pose between frames.
//!
//! A [`MotionModel`] defines the state of a particle, how it moves from frame to frame, and the vector space of small
//! changes. [`Diffusion`] is the simplest: a pose with Gaussian noise.
//!
//! ```
//! use skiagraph_core::body::{ProposalScales, shipped};
//! use skiagraph_track::motion_model::{Diffusion, DiffusionSettings, MotionModel};
//! use skiagraph_core::rng::{Purpose, stream};
//! let body = shipped("tracker25")?;
//! let scales = ProposalScales::for_human(&body, 60.0);
//! let model = Diffusion::new(body.clone(), &scales, &DiffusionSettings::default())?;
//! let mut random = stream(0, Purpose::MotionModel, 1, 0, 0);
//! let now = model.sample_initial(&body.zero_pose(), 0, 1, &mut random);
//! let next = model.propagate(&now, &[], &mut random);
//! assert_ne!(model.pose(&now), model.pose(&next));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod diffusion;
mod evidence;
// Learned models, for the application and the studies: scenarios describe them to users.
#[doc(hidden)]
pub mod gpdm;
#[doc(hidden)]
pub mod gpdm_graph;
mod latent;
mod lbfgs;
#[doc(hidden)]
pub mod pose_chart;

use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

pub use diffusion::{Diffusion, DiffusionSettings};

// Learned models in latent spaces, for the application and the studies: scenarios describe them to users.
#[doc(hidden)]
pub use self::{
    evidence::NormalEquations,
    latent::{Initialisation, InterTransition, JumpRule, LatentModel, LatentParticle, LatentSettings, RootMotion},
};

use skiagraph_core::body::{Humanoid, Pose};

/// The prior over motion, `p(x_t | x_{t-1})` of `[Skinned APF]` section 6.1, and the space in which a filter spreads
/// its particles.
///
/// A particle's state is a point of a manifold: [`Self::step`] moves it by a vector of the length of
/// [`Self::deviations`], [`Self::difference`] is the vector between two states. An annealing filter needs nothing
/// else.
pub trait MotionModel: Send + Sync {
    /// State of one particle.
    type State: Clone + Send + Sync;

    /// The moving body.
    fn body(&self) -> &Humanoid;

    /// The state of particle `particle` of `particles` at the first frame, drawn around a known start pose.
    fn sample_initial(&self, start: &Pose, particle: usize, particles: usize, rng: &mut ChaCha8Rng) -> Self::State;

    /// A state of the next frame, drawn from the model. `past` contains the estimates of the previous frames, oldest
    /// first.
    fn propagate(&self, state: &Self::State, past: &[Pose], rng: &mut ChaCha8Rng) -> Self::State;

    /// As [`Self::propagate`] for all particles at once, each with its own random stream: faster for models whose
    /// predictions are matrix products. The result must not depend on the number of threads.
    fn propagate_all(&self, states: &[Self::State], past: &[Pose], rngs: &mut [ChaCha8Rng]) -> Vec<Self::State> {
        states.par_iter().zip(rngs.par_iter_mut()).map(|(state, rng)| self.propagate(state, past, rng)).collect()
    }

    /// The pose of a state.
    fn pose<'a>(&self, state: &'a Self::State) -> &'a Pose;

    /// Standard deviations of the spread between frames, one per number of a step: the roots of the diagonal `P_0` of
    /// `[Skinned APF]`.
    fn deviations(&self) -> &[f64];

    /// The state moved by a step and restricted to what the model allows (joint limits).
    fn step(&self, state: &Self::State, step: &[f64]) -> Self::State;

    /// The step from one state to another, written into `step`.
    fn difference(&self, from: &Self::State, to: &Self::State, step: &mut [f64]);

    /// Whether [`Self::descend`] is supported.
    fn descends(&self) -> bool {
        false
    }

    /// The state moved by one damped Gauss-Newton step on `evidence`, which was computed at its pose, plus the model's
    /// own prior: a pull towards `anchor`, the last estimate, or other knowledge of the model. `None` for models that
    /// do not support descent, and if the equations are singular. Must be deterministic.
    fn descend(&self, _state: &Self::State, _anchor: &Pose, _evidence: NormalEquations) -> Option<Self::State> {
        None
    }

    /// `state` with another pose; `None` for models whose states cannot have arbitrary poses. For such a model,
    /// descents start only at particles, and limbs are not resampled.
    fn with_pose(&self, _state: &Self::State, _pose: &Pose) -> Option<Self::State> {
        None
    }

    /// Distribution of weighted states over the K latent spaces of `[GPDM graph]`; empty for models without latent
    /// spaces.
    fn occupancy(&self, _states: &[Self::State], _weights: &[f64]) -> Vec<ModelOccupancy> {
        Vec::new()
    }
}

/// Occupancy of one latent space in a frame.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelOccupancy {
    /// Number of particles in it, before resampling.
    pub particles: u32,
    /// Their share of the weight.
    pub weight: f64,
    /// Number of these particles that had left the region of the training data and were brought back in this frame.
    pub recovered: u32,
}

/// A setting of a motion model or tracker is out of range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: expected {expected}, found {found}")]
#[non_exhaustive]
pub struct SettingError {
    /// The setting's key in a scenario.
    pub key: &'static str,
    /// The allowed values.
    pub expected: String,
    /// The given value.
    pub found: String,
}

impl SettingError {
    pub(crate) fn new(key: &'static str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self { key, expected: expected.into(), found: found.to_string() }
    }
}
