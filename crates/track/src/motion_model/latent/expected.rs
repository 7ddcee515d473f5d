//! What a model expects of a particle.

use super::root::RootPlace;
use crate::body::Pose;

/// What a model expects of a particle before its noise is drawn.
#[derive(Clone, Debug)]
pub(super) struct Expected {
    /// Mean of the latent point.
    pub(super) latent: Vec<f64>,
    /// Deviation of every coordinate of it.
    pub(super) deviation: f64,
    /// Mean of the offset.
    pub(super) offset: Vec<f64>,
    /// Pose and place one frame before.
    pub(super) before: Pose,
    pub(super) place: RootPlace,
}
