//! Every frame of a run in every camera, small enough for a page: the reader moves through time, pictures and plots
//! together.
//!
//! [`PlaybackPlan`] decides how finely silhouettes are kept, so that all of them fit; [`PlaybackPlan::pack`] makes run
//! lengths of one view. The page's script draws them.

mod data;
mod pack;

pub use pack::{PackedView, PlaybackPlan};

pub(super) use data::playback_data;

use crate::body::Markers;
use crate::camera::CameraRig;
use crate::raster::Mask;

/// All frames of one seed.
#[derive(Clone, Debug)]
pub struct Playback {
    /// The seed.
    pub seed: u64,
    /// How views were packed.
    pub plan: PlaybackPlan,
    /// `[frame][camera]`, of the frames of [`PlaybackPlan::frames`].
    pub views: Vec<Vec<PackedView>>,
    /// Props in every camera's image; empty without any, and where a camera moves.
    pub props: Vec<Mask>,
    /// The cameras in those frames, where any moves; else empty.
    pub moved: Vec<CameraRig>,
    /// The actor's markers in those frames.
    pub truth: Vec<Markers>,
    /// The estimated markers in those frames.
    pub estimate: Vec<Markers>,
}
