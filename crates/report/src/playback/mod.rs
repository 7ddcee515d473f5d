//! Every frame of a run in every camera, small enough for a page, in which the reader moves through time.
//!
//! [`PlaybackPlan`] sets the resolution of silhouettes, so that all of them fit; [`PlaybackPlan::pack`] run-length
//! encodes one view. The page's script draws them.

mod data;
mod pack;

pub use pack::{PackedView, PlaybackBudget, PlaybackPlan};

pub(super) use data::playback_data;

use skiagraph_core::body::Markers;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::raster::Mask;

/// All frames of one seed.
#[derive(Clone, Debug)]
pub struct Playback {
    /// The seed.
    pub seed: u64,
    /// The plan by which views were packed.
    pub plan: PlaybackPlan,
    /// `[frame][camera]`, for the frames of [`PlaybackPlan::kept`].
    pub views: Vec<Vec<PackedView>>,
    /// Props in every camera's image; empty without props, and if a camera moves.
    pub props: Vec<Mask>,
    /// The cameras in those frames, if any moves; else empty.
    pub moved: Vec<CameraRig>,
    /// The actor's markers in those frames.
    pub truth: Vec<Markers>,
    /// The estimated markers in those frames.
    pub estimate: Vec<Markers>,
}
