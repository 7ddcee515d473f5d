//! The GPDM graph (`[GPDM graph]`): one GPDM per segment of a motion, joined at similar poses.
//!
//! Learning needs no labels: a segment grows clip by clip as long as the model's own simulation of it stays close to
//! the recording (`[GPDM graph]` Table 1, [`GpdmGraph::learn`]); inter-transition candidates are turning points of the
//! motion ([`Detector`]). Tracking moves particles within a model by its dynamics and between models by the similarity
//! of poses (`[GPDM graph]` section 3.3; [`super::LatentModel`]).

mod candidates;
mod graph;
mod learner;
mod parts;
mod segmentation;

pub use candidates::Detector;
pub use graph::{Candidate, GpdmGraph, GraphError, GraphSegment, GraphSettings, ModelKind, SegmentRange};
pub use learner::GraphLearner;
