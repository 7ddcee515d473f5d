//! The input of the page of a motion model.

use super::FactGroup;
use super::model_distances::{CandidateFrame, FrameDistances};

/// Points of a latent space, `[frame][dimension]`, the principal axis first.
pub type LatentPath = Vec<Vec<f64>>;

/// The content of the page.
#[derive(Clone, Debug)]
pub struct ModelPageInput<'a> {
    /// The model's name.
    pub title: &'a str,
    /// The frame rate at which it was learned, Hz.
    pub frames_per_second: f64,
    /// Short descriptions of the model's kind and source.
    pub chips: Vec<String>,
    /// The models in the order of the training frames, at least one.
    pub models: Vec<OneModel>,
    /// The threshold for growing segments, rad^2, if any.
    pub threshold: Option<f64>,
    /// Another model of the same motions.
    pub against: Option<OtherModel>,
    /// Distances between training frames.
    pub distances: FrameDistances,
    /// Frames at which particles may change models.
    pub candidates: Vec<CandidateFrame>,
    /// Further facts.
    pub facts: Vec<FactGroup>,
}

/// One learned GPDM.
#[derive(Clone, Debug, PartialEq)]
pub struct OneModel {
    /// Its first training frame, counted over all recordings.
    pub start: usize,
    /// Its recording.
    pub recording: String,
    /// Its first frame in that recording, from 0.
    pub first: usize,
    /// Learned latents, one per frame.
    pub learned: LatentPath,
    /// Mean prediction starting at the first learned latent, in the same axes.
    pub predicted: LatentPath,
    /// Distance between recording and simulation, one per frame, rad^2.
    pub errors: Vec<f64>,
}

/// The model that this one is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherModel {
    /// Its name.
    pub name: String,
    /// Distance between recording and simulation over the same frames, rad^2.
    pub errors: Vec<f64>,
}
