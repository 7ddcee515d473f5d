//! A learned graph: its models, their training frames and the transitions between them.

use std::ops::Range;

use nalgebra::UnitQuaternion;

use super::candidates::Detector;
use crate::motion_model::SettingError;
use crate::motion_model::gpdm::{Gpdm, GpdmError, TrainingOptions};
use crate::motion_model::pose_chart::{PoseChart, distance};

#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GraphSettings {
    /// Length of a clip, seconds. `[GPDM graph]`: "60 frames or 0.5 s".
    pub clip_s: f64,
    /// TH of Table 1 of `[GPDM graph]` per anatomical joint, rad^2: the paper's 1.0 divided by the 13 joints of a CMU
    /// body.
    pub threshold_per_joint: f64,
    /// Method of finding the candidates for transitions.
    pub detector: Detector,
    pub training: TrainingOptions,
    /// Whether to learn one model of each whole motion instead of segments: the original GPDM.
    pub single: bool,
    /// Whether to learn one model of all motions together, without transitions between them. Not for model files.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub joint: bool,
}

impl Default for GraphSettings {
    fn default() -> Self {
        Self {
            clip_s: 0.5,
            threshold_per_joint: 1.0 / 13.0,
            detector: Detector::default(),
            training: TrainingOptions::default(),
            single: false,
            joint: false,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelKind {
    /// The original GPDM: no segments, no candidates.
    Gpdm,
    /// A graph of GPDMs, one per segment.
    GpdmGraph,
}

impl ModelKind {
    /// Its name for `skiagraph train --model`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gpdm => "gpdm",
            Self::GpdmGraph => "gpdm-graph",
        }
    }
}

impl GraphSettings {
    pub fn from_kind(kind: ModelKind) -> Self {
        Self { single: kind == ModelKind::Gpdm, ..Self::default() }
    }

    pub fn kind(&self) -> ModelKind {
        if self.single { ModelKind::Gpdm } else { ModelKind::GpdmGraph }
    }
}

/// Frames `first .. end` of one training motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SegmentRange {
    pub motion: usize,
    pub first: usize,
    /// One past the last frame.
    pub end: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub struct GraphSegment {
    /// The training frames from which it was learned; for a model of several motions those of the first, followed by
    /// the others as a whole.
    pub range: SegmentRange,
    pub gpdm: Gpdm,
    /// Distance between recording and simulation, per frame (`[GPDM graph]` Eq. 9, rad^2).
    pub errors: Vec<f64>,
    /// Joint rotations of the training frames.
    pub rotations: Vec<Vec<UnitQuaternion<f64>>>,
}

impl GraphSegment {
    /// The rows of the motion that contains a row: adjacent rows of different motions are not consecutive in time.
    pub fn sequence_of(&self, row: usize) -> Range<usize> {
        self.sequences().find(|rows| rows.contains(&row)).unwrap_or(0..self.rotations.len())
    }

    /// The training motion and frame of a row.
    pub fn source_of(&self, row: usize) -> (usize, usize) {
        let index = self.sequences().position(|rows| rows.contains(&row)).unwrap_or(0);
        let first = if index == 0 { self.range.first } else { 0 };
        (self.range.motion + index, first + row - self.sequence_of(row).start)
    }

    /// The rows of every motion.
    fn sequences(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let layout = self.gpdm.layout();
        layout.starts().zip(&layout.lengths).map(|(start, length)| start..start + length)
    }
}

/// A moment at which the motion may change into another (`b_i` in `[GPDM graph]`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Candidate {
    /// Index of the model, `k` in `[GPDM graph]`.
    pub segment: usize,
    /// Row of that model's latents.
    pub row: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub struct GpdmGraph {
    /// Conversion of poses to observation vectors.
    pub chart: PoseChart,
    pub frames_per_second: f64,
    /// The models, in the order of the training frames.
    pub segments: Vec<GraphSegment>,
    pub candidates: Vec<Candidate>,
}

/// Why a graph could not be learned.
#[derive(Debug, thiserror::Error)]
pub enum GraphError {
    /// The motions do not belong together, or saved segments to them.
    #[error("{0}")]
    Motions(String),
    #[error(
        "training motion {motion} has {frames} frames, fewer than one clip of {clip}: use a longer motion or a smaller \
        clip_s"
    )]
    ShorterThanClip { motion: usize, frames: usize, clip: usize },
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A model could not be learned.
    #[error("frames {} to {} (from 0) of training motion {}: {source}", range.first, range.end, range.motion)]
    Model { range: SegmentRange, source: GpdmError },
}

impl GpdmGraph {
    /// The model and row of a training frame.
    pub(super) fn locate(&self, motion: usize, frame: usize) -> Option<Candidate> {
        let row_in = |s: &GraphSegment| {
            let mut sequences = (s.range.motion..).zip(s.sequences());
            let (_, rows) = sequences.find(|(other, _)| *other == motion)?;
            let first = if s.range.motion == motion { s.range.first } else { 0 };
            frame.checked_sub(first).map(|row| rows.start + row).filter(|row| rows.contains(row))
        };
        let located = |(segment, s): (usize, &GraphSegment)| Some(Candidate { segment, row: row_in(s)? });
        self.segments.iter().enumerate().find_map(located)
    }

    /// The model that follows segment `segment` in its recording.
    pub fn successor(&self, segment: usize) -> Option<usize> {
        let (this, next) = (&self.segments[segment].range, self.segments.get(segment + 1)?);
        (next.range.motion == this.motion && next.range.first == this.end).then_some(segment + 1)
    }

    /// Mean over all frames of the distance between recording and simulation (`[GPDM graph]` Eq. 9, Fig. 3), rad^2.
    pub fn mean_reconstruction_error(&self) -> f64 {
        let errors = || self.segments.iter().flat_map(|s| &s.errors);
        errors().sum::<f64>() / errors().count().max(1) as f64
    }

    /// The training frame most similar to a pose: `(segment, row, distance)`.
    pub fn nearest(&self, rotations: &[UnitQuaternion<f64>]) -> Option<(usize, usize, f64)> {
        self.segments
            .iter()
            .enumerate()
            .flat_map(|(k, s)| s.rotations.iter().enumerate().map(move |(row, r)| (k, row, r)))
            .map(|(k, row, r)| (k, row, distance(rotations, r)))
            .min_by(|a, b| a.2.total_cmp(&b.2))
    }
}
