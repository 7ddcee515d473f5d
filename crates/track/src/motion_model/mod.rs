//! How a pose may move between frames.
//!
//! A [`MotionModel`] says what a particle carries from frame to frame, how it moves, and in which flat space it may be
//! nudged. [`Diffusion`] carries a pose and lets it wander.
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

use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

pub use diffusion::{Diffusion, DiffusionSettings};
pub use evidence::Evidence;

// Learned models in latent spaces, for the application and the studies: scenarios describe them to users.
#[doc(hidden)]
pub use self::{
    evidence::NormalEquations,
    latent::{Initialisation, InterTransition, JumpRule, LatentModel, LatentParticle, LatentSettings, RootMotion},
};

use crate::body::{Humanoid, Pose};

/// The prior over motion, `p(x_t | x_{t-1})` of `[Skinned APF]` section 6.1, and the space in which a filter spreads
/// its particles.
///
/// A particle's state is a point of a manifold: [`Self::step`] moves it by a vector of [`Self::deviations`]' length,
/// [`Self::difference`] is the vector between two states. A filter needs no more to anneal.
pub trait MotionModel: Send + Sync {
    /// What one particle carries.
    type State: Clone + Send + Sync;

    /// The body that moves.
    fn body(&self) -> &Humanoid;

    /// The state of particle `particle` of `particles` at the first frame, drawn around a known start pose.
    fn sample_initial(&self, start: &Pose, particle: usize, particles: usize, rng: &mut ChaCha8Rng) -> Self::State;

    /// A state of the next frame, drawn from the model. `past` holds the estimates of the frames before, oldest first.
    fn propagate(&self, state: &Self::State, past: &[Pose], rng: &mut ChaCha8Rng) -> Self::State;

    /// As [`Self::propagate`] for all particles at once, each with its own random stream: models whose predictions are
    /// matrix products save much by it. The result may not depend on the number of threads.
    fn propagate_all(&self, states: &[Self::State], past: &[Pose], rngs: &mut [ChaCha8Rng]) -> Vec<Self::State> {
        states.par_iter().zip(rngs.par_iter_mut()).map(|(state, rng)| self.propagate(state, past, rng)).collect()
    }

    /// The pose behind a state.
    fn pose<'a>(&self, state: &'a Self::State) -> &'a Pose;

    /// Standard deviations of the spread between frames, one per number of a step: the roots of `[Skinned APF]`'s
    /// diagonal `P_0`.
    fn deviations(&self) -> &[f64];

    /// The state moved by a step, kept within what the model allows (joint limits).
    fn step(&self, state: &Self::State, step: &[f64]) -> Self::State;

    /// The step from one state to another, written into `step`.
    fn difference(&self, from: &Self::State, to: &Self::State, step: &mut [f64]);

    /// Whether [`Self::descend`] has an answer.
    fn descends(&self) -> bool {
        false
    }

    /// The state moved one damped Gauss-Newton step down `evidence`, which was taken at its pose, the model's own prior
    /// added: a pull towards `anchor`, the last estimate, or what else the model knows. `None` for models that cannot
    /// descend, and where the equations are singular. Must be deterministic.
    fn descend(&self, _state: &Self::State, _anchor: &Pose, _evidence: NormalEquations) -> Option<Self::State> {
        None
    }

    /// Covariance of a step from the state's pose ([`Humanoid::step`]), the model's own prior added to `evidence`,
    /// which was taken at that pose. `None` for models that cannot tell.
    fn covariance(&self, _state: &Self::State, _evidence: &Evidence) -> Option<DMatrix<f64>> {
        None
    }

    /// `state` with another pose; `None` for models whose states cannot have any pose. Such a model is descended from
    /// particles alone, and no limbs are drawn.
    fn with_pose(&self, _state: &Self::State, _pose: &Pose) -> Option<Self::State> {
        None
    }

    /// How weighted states are spread over the K latent spaces of `[GPDM graph]`; empty where no model was learned.
    fn occupancy(&self, _states: &[Self::State], _weights: &[f64]) -> Vec<ModelOccupancy> {
        Vec::new()
    }
}

/// One latent space's part in a frame.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelOccupancy {
    /// Particles in it, before resampling.
    pub particles: u32,
    /// Their share of the weight.
    pub weight: f64,
    /// Of those particles, how many had left the region that the model knows and were brought back in this frame.
    pub recovered: u32,
}

/// A setting of a motion model or tracker is out of its range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: expected {expected}, found {found}")]
#[non_exhaustive]
pub struct SettingError {
    /// The setting, as a scenario spells it.
    pub key: &'static str,
    /// What is allowed.
    pub expected: String,
    /// What was given.
    pub found: String,
}

impl SettingError {
    pub(crate) fn new(key: &'static str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self { key, expected: expected.into(), found: found.to_string() }
    }
}
