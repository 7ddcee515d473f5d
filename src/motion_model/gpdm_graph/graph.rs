//! A learned graph: its models, where they came from and where they may turn into each other.

use nalgebra::{Point3, UnitQuaternion};

use super::candidates::{CandidateDetector, detector};
use super::segmentation::{Learned, SegmentRange, TrainingMotion, grow_segment, learn};
use crate::body::{Humanoid, LinkFrames, Motion};
use crate::motion_model::gpdm::{Gpdm, GpdmError, TrainingOptions};
use crate::motion_model::pose_chart::{PoseChart, distance};

/// How a graph is learned.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GraphSettings {
    /// Length of a clip, seconds. S1: "60 frames or 0.5 s".
    pub clip_s: f64,
    /// TH of S1's Table 1 per anatomical joint, rad^2: S1's 1.0 over the 13 joints of a CMU body.
    pub threshold_per_joint: f64,
    /// `short_term_pca` (S1) or `speed_minima`.
    pub detector: String,
    /// How each model is learned.
    pub training: TrainingOptions,
    /// Whether to learn one model of each whole motion in place of segments: the original GPDM.
    pub single: bool,
}

impl Default for GraphSettings {
    fn default() -> Self {
        Self {
            clip_s: 0.5,
            threshold_per_joint: 1.0 / 13.0,
            detector: "short_term_pca".to_owned(),
            training: TrainingOptions::default(),
            single: false,
        }
    }
}

/// One model of the graph.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// The training frames that it was learned from.
    pub range: SegmentRange,
    /// The model.
    pub gpdm: Gpdm,
    /// Distance between recording and simulation, per frame (S1 Eq. 9, rad^2).
    pub errors: Vec<f64>,
    /// Joint rotations of the training frames.
    pub rotations: Vec<Vec<UnitQuaternion<f64>>>,
}

/// A moment at which the motion may turn into another (S1's `b_i`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Candidate {
    /// Index of the model, S1's `k`.
    pub segment: usize,
    /// Row of that model's latents.
    pub row: usize,
}

/// GPDMs joined into a graph.
#[derive(Clone, Debug, PartialEq)]
pub struct GpdmGraph {
    /// How poses are written as observation vectors.
    pub chart: PoseChart,
    /// Frames a second of the training motions.
    pub frames_per_second: f64,
    /// The models, in the order of the training frames.
    pub segments: Vec<Segment>,
    /// Inter-transition candidates.
    pub candidates: Vec<Candidate>,
}

/// Why a graph could not be learned.
#[derive(Debug, thiserror::Error)]
pub enum GraphError {
    /// No training motion.
    #[error("no training motion: give at least one")]
    NoMotion,
    /// A motion shorter than a clip.
    #[error(
        "training motion {motion} has {frames} frames, fewer than one clip of {clip}: give a longer one or a shorter clip_s"
    )]
    ShorterThanClip {
        /// Index of the motion.
        motion: usize,
        /// Its frames.
        frames: usize,
        /// Frames of a clip.
        clip: usize,
    },
    /// Motions of several rates.
    #[error("training motions at {first} and {other} frames a second: resample them to one rate")]
    Rates {
        /// Of the first.
        first: f64,
        /// Of another.
        other: f64,
    },
    /// A setting is out of its range.
    #[error("{key}: expected {expected}, found {found}")]
    Setting {
        /// The setting.
        key: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was given.
        found: String,
    },
    /// A model could not be learned.
    #[error("frames {} to {} of training motion {}: {source}", range.first, range.end, range.motion)]
    Model {
        /// Where.
        range: SegmentRange,
        /// Why.
        source: GpdmError,
    },
}

impl GpdmGraph {
    /// Learns a graph of `body`'s motions. `progress` hears of every finished model and of the frames done so far.
    ///
    /// # Errors
    /// [`GraphError`] where settings are out of range or the motions are too short, not finite or hardly vary.
    pub fn learn(
        body: &Humanoid,
        motions: &[Motion],
        settings: &GraphSettings,
        mut progress: impl FnMut(&Segment, usize),
    ) -> Result<Self, GraphError> {
        let (rate, clip, detector) = checked(motions, settings)?;
        let chart = PoseChart::learn(body, motions);
        let threshold = settings.threshold_per_joint * chart.groups().len() as f64;
        let mut graph = Self { chart, frames_per_second: rate, segments: Vec::new(), candidates: Vec::new() };
        let mut done = 0;
        for (index, motion) in motions.iter().enumerate() {
            let training = graph.training_motion(index, motion);
            let mut first = 0;
            while first < motion.poses.len() {
                let learned = if settings.single {
                    learn(&training, &graph.chart, first, motion.poses.len(), &settings.training)
                } else {
                    grow_segment(&training, &graph.chart, first, clip, threshold, &settings.training)
                };
                let range = SegmentRange { motion: index, first, end: motion.poses.len() };
                let learned = learned.map_err(|source| GraphError::Model { range, source })?;
                first = learned.range.end;
                let segment = Segment::new(learned, &training);
                progress(&segment, done + first);
                graph.segments.push(segment);
            }
            done += motion.poses.len();
            let turns = detector.detect(&joint_positions(body, motion), rate);
            let located = turns.into_iter().filter_map(|frame| graph.locate(index, frame)).collect::<Vec<_>>();
            graph.candidates.extend(located);
        }
        Ok(graph)
    }

    fn training_motion(&self, index: usize, motion: &Motion) -> TrainingMotion {
        TrainingMotion {
            index,
            observations: self.chart.observe(motion),
            rotations: motion.poses.iter().map(|pose| self.chart.rotations(pose)).collect(),
        }
    }

    /// The model and row of a training frame.
    fn locate(&self, motion: usize, frame: usize) -> Option<Candidate> {
        let holds = |s: &Segment| s.range.motion == motion && (s.range.first..s.range.end).contains(&frame);
        let segment = self.segments.iter().position(holds)?;
        Some(Candidate { segment, row: frame - self.segments[segment].range.first })
    }

    /// The model that continues segment `segment` in its recording.
    pub fn successor(&self, segment: usize) -> Option<usize> {
        let (this, next) = (&self.segments[segment].range, self.segments.get(segment + 1)?);
        (next.range.motion == this.motion && next.range.first == this.end).then_some(segment + 1)
    }

    /// Mean over all frames of the distance between recording and simulation (S1 Eq. 9, Fig. 3), rad^2.
    pub fn mean_reconstruction_error(&self) -> f64 {
        let errors = || self.segments.iter().flat_map(|s| &s.errors);
        errors().sum::<f64>() / errors().count().max(1) as f64
    }

    /// The training frame most like a pose: `(segment, row, distance)`.
    pub fn nearest(&self, rotations: &[UnitQuaternion<f64>]) -> Option<(usize, usize, f64)> {
        self.segments
            .iter()
            .enumerate()
            .flat_map(|(k, s)| s.rotations.iter().enumerate().map(move |(row, r)| (k, row, r)))
            .map(|(k, row, r)| (k, row, distance(rotations, r)))
            .min_by(|a, b| a.2.total_cmp(&b.2))
    }
}

impl Segment {
    fn new(learned: Learned, training: &TrainingMotion) -> Self {
        let Learned { range, gpdm, errors } = learned;
        Self { range, gpdm, errors, rotations: training.rotations[range.first..range.end].to_vec() }
    }
}

fn checked(
    motions: &[Motion],
    settings: &GraphSettings,
) -> Result<(f64, usize, Box<dyn CandidateDetector>), GraphError> {
    let rate = motions.first().ok_or(GraphError::NoMotion)?.frames_per_second;
    if let Some(other) = motions.iter().find(|m| m.frames_per_second != rate) {
        return Err(GraphError::Rates { first: rate, other: other.frames_per_second });
    }
    let wrong = |key, expected, found| Err(GraphError::Setting { key, expected, found });
    if !(settings.clip_s > 0.0 && settings.clip_s <= 60.0) {
        return wrong("clip_s", "seconds, > 0 and at most 60", settings.clip_s.to_string());
    }
    if !(settings.threshold_per_joint > 0.0 && settings.threshold_per_joint.is_finite()) {
        return wrong("threshold_per_joint", "rad^2, > 0", settings.threshold_per_joint.to_string());
    }
    if !(1..=8).contains(&settings.training.latent_dimensions) {
        return wrong("training.latent_dimensions", "1 to 8", settings.training.latent_dimensions.to_string());
    }
    let Some(detector) = detector(&settings.detector) else {
        return wrong("detector", "\"short_term_pca\" or \"speed_minima\"", settings.detector.clone());
    };
    let least = settings.training.latent_dimensions.max(settings.training.order.lag() + 1) + 1;
    let clip = ((settings.clip_s * rate).round() as usize).max(least);
    if let Some(motion) = motions.iter().position(|m| m.poses.len() < clip) {
        return Err(GraphError::ShorterThanClip { motion, frames: motions[motion].poses.len(), clip });
    }
    Ok((rate, clip, detector))
}

/// Where every moving joint is in the root's frame, frame by frame, metres.
fn joint_positions(body: &Humanoid, motion: &Motion) -> Vec<Vec<Point3<f64>>> {
    let mut frames = LinkFrames::default();
    motion
        .poses
        .iter()
        .map(|pose| {
            body.link_frames_into(pose, &mut frames);
            let root_from_world = pose.world_from_root.inverse();
            frames.0[1..].iter().map(|link| root_from_world * Point3::from(link.translation.vector)).collect()
        })
        .collect()
}
