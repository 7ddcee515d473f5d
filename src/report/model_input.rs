//! What the page of a motion model shows.

use super::FactGroup;
use super::model_distances::{CandidateFrame, FrameDistances};

/// Points of a latent space, each of as many coordinates as it has dimensions, the principal axis first.
pub type LatentPath = Vec<Vec<f64>>;

/// What the page shows.
#[derive(Clone, Debug)]
pub struct ModelPageInput<'a> {
    /// The model's name.
    pub title: &'a str,
    /// The rate at which it was learned, Hz: its frames are counted at this rate.
    pub frames_per_second: f64,
    /// The kind of the model and its source, each in a few words.
    pub chips: Vec<String>,
    /// The models in the order of the training frames, at least one.
    pub models: Vec<OneModel>,
    /// The threshold of growing segments, rad^2, if any.
    pub threshold: Option<f64>,
    /// Another model of the same motions.
    pub against: Option<OtherModel>,
    /// Distances between training frames.
    pub distances: FrameDistances,
    /// Where particles may change models.
    pub candidates: Vec<CandidateFrame>,
    /// What else a reader should know.
    pub facts: Vec<FactGroup>,
}

/// One learned GPDM.
#[derive(Clone, Debug, PartialEq)]
pub struct OneModel {
    /// Its first training frame, counted over all recordings.
    pub start: usize,
    /// The recording that it was learned from.
    pub recording: String,
    /// Its first frame in that recording, from 0.
    pub first: usize,
    /// Learned latents, one a frame.
    pub learned: LatentPath,
    /// Mean prediction from the first learned latent on, in the same axes.
    pub predicted: LatentPath,
    /// Distance between recording and simulation, one a frame, rad^2.
    pub errors: Vec<f64>,
}

/// The model that this one is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherModel {
    /// What to call it.
    pub name: String,
    /// Distance between recording and simulation over the same frames, rad^2.
    pub errors: Vec<f64>,
}
