//! Learning a graph segment by segment, so that the work can be monitored, stopped and resumed.

use nalgebra::Point3;

use super::graph::{GpdmGraph, GraphError, GraphSegment, GraphSettings, SegmentRange};
use super::segmentation::{TrainingMotion, grow_segment, learn, learn_jointly};
use crate::motion_model::SettingError;
use crate::motion_model::gpdm::Round;
use crate::motion_model::pose_chart::PoseChart;
use skiagraph_core::body::{Humanoid, LinkFrames, Motion};

/// A graph under construction.
///
/// ```
/// use skiagraph_core::body::{Humanoid, Motion};
/// use skiagraph_track::motion_model::gpdm_graph::{GraphError, GraphLearner, GraphSettings};
///
/// let body = Humanoid::tracker25().unwrap();
/// let motion = Motion { frames_per_second: 60.0, poses: vec![body.zero_pose(); 10] };
/// let (motions, settings) = ([motion], GraphSettings::default());
/// let refused = GraphLearner::new(&body, &motions, &settings);
/// assert!(matches!(refused, Err(GraphError::ShorterThanClip { frames: 10, clip: 30, .. })));
/// ```
pub struct GraphLearner<'a> {
    body: &'a Humanoid,
    motions: &'a [Motion],
    settings: &'a GraphSettings,
    training: Vec<TrainingMotion>,
    clip: usize,
    threshold: f64,
    graph: GpdmGraph,
}

impl<'a> GraphLearner<'a> {
    /// A learner for a graph of `body`'s motions.
    ///
    /// # Errors
    /// [`GraphError`] if settings are out of range or a motion is too short.
    pub fn new(body: &'a Humanoid, motions: &'a [Motion], settings: &'a GraphSettings) -> Result<Self, GraphError> {
        let (frames_per_second, clip) = checked(motions, settings)?;
        let chart = PoseChart::learn(body, motions);
        let threshold = settings.threshold_per_joint * chart.groups().len() as f64;
        let observed = |(index, motion): (usize, &Motion)| TrainingMotion {
            index,
            observations: chart.observe(motion),
            rotations: motion.poses.iter().map(|pose| chart.rotations(pose)).collect(),
        };
        let training = motions.iter().enumerate().map(observed).collect();
        let graph = GpdmGraph { chart, frames_per_second, segments: Vec::new(), candidates: Vec::new() };
        Ok(Self { body, motions, settings, training, clip, threshold, graph })
    }

    /// Resumes the work of another learner with the same motions and settings.
    ///
    /// # Errors
    /// [`GraphError::Motions`] if `finished` are not the first segments of these motions.
    pub fn resume(mut self, finished: Vec<GraphSegment>) -> Result<Self, GraphError> {
        for segment in finished {
            let SegmentRange { motion, first, end } = segment.range;
            let own = self.training.get(motion).and_then(|t| t.rotations.get(first..end));
            if self.next_frame() != Some((motion, first)) || own != Some(segment.rotations.as_slice()) {
                let refused = "the saved segments do not belong to these training motions: train again";
                return Err(GraphError::Motions(refused.to_owned()));
            }
            self.graph.segments.push(segment);
        }
        Ok(self)
    }

    /// The graph learned so far, without candidates.
    pub fn graph(&self) -> &GpdmGraph {
        &self.graph
    }

    /// Number of training frames that belong to a learned model.
    pub fn frames_done(&self) -> usize {
        self.graph.segments.iter().map(|s| s.rotations.len()).sum()
    }

    /// Learns the next segment; `None` when all frames belong to a model. `should_continue` is called after every
    /// round of every model that is tried, and ends the work by returning `false`.
    ///
    /// # Errors
    /// [`GraphError::Model`] if the segment cannot be learned or the work was interrupted.
    pub fn grow(
        &mut self,
        should_continue: &mut dyn FnMut(SegmentRange, Round) -> bool,
    ) -> Result<Option<&GraphSegment>, GraphError> {
        let Some((index, first)) = self.next_frame() else { return Ok(None) };
        let (training, chart, options) = (&self.training[index], &self.graph.chart, &self.settings.training);
        let end = self.motions[index].poses.len();
        let learned = if self.settings.joint {
            learn_jointly(&self.training, chart, options, should_continue)
        } else if self.settings.single {
            learn(training, chart, first, end, options, should_continue)
        } else {
            grow_segment(training, chart, first, self.clip, self.threshold, options, should_continue)
        };
        let range = SegmentRange { motion: index, first, end };
        self.graph.segments.push(learned.map_err(|source| GraphError::Model { range, source })?);
        Ok(self.graph.segments.last())
    }

    /// Finds the inter-transition candidates and returns the graph.
    pub fn finish(mut self) -> GpdmGraph {
        let detector = self.settings.detector;
        for (index, motion) in self.motions.iter().enumerate() {
            let turns = detector.detect(&joint_positions(self.body, motion), self.graph.frames_per_second);
            let located = turns.into_iter().filter_map(|frame| self.graph.locate(index, frame)).collect::<Vec<_>>();
            self.graph.candidates.extend(located);
        }
        self.graph
    }

    /// Motion and first frame of the next segment.
    fn next_frame(&self) -> Option<(usize, usize)> {
        let Some(SegmentRange { motion, end, .. }) = self.graph.segments.last().map(|s| s.range) else {
            return Some((0, 0));
        };
        if self.settings.joint {
            return None;
        }
        if end < self.motions[motion].poses.len() {
            return Some((motion, end));
        }
        (motion + 1 < self.motions.len()).then_some((motion + 1, 0))
    }
}

impl GpdmGraph {
    /// Learns a graph of `body`'s motions; [`GraphLearner`] does the same step by step.
    ///
    /// # Errors
    /// [`GraphError`] if settings are out of range or the motions are too short, not finite or hardly vary.
    pub fn learn(body: &Humanoid, motions: &[Motion], settings: &GraphSettings) -> Result<Self, GraphError> {
        let mut learner = GraphLearner::new(body, motions, settings)?;
        while learner.grow(&mut |_, _| true)?.is_some() {}
        Ok(learner.finish())
    }
}

fn checked(motions: &[Motion], settings: &GraphSettings) -> Result<(f64, usize), GraphError> {
    let none = || GraphError::Motions("there is no training motion; at least one is required".to_owned());
    let rate = motions.first().ok_or_else(none)?.frames_per_second;
    if let Some(other) = motions.iter().map(|m| m.frames_per_second).find(|other| *other != rate) {
        let refused = format!("training motions at {rate} and {other} frames a second: resample them to one rate");
        return Err(GraphError::Motions(refused));
    }
    if !(settings.clip_s > 0.0 && settings.clip_s <= 60.0) {
        return Err(SettingError::new("clip_s", "seconds, > 0 and at most 60", settings.clip_s).into());
    }
    if !(settings.threshold_per_joint > 0.0 && settings.threshold_per_joint.is_finite()) {
        return Err(SettingError::new("threshold_per_joint", "rad^2, > 0", settings.threshold_per_joint).into());
    }
    if !(1..=8).contains(&settings.training.latent_dimensions) {
        return Err(
            SettingError::new("training.latent_dimensions", "1 to 8", settings.training.latent_dimensions).into()
        );
    }
    let least = settings.training.latent_dimensions.max(settings.training.order.lag() + 1) + 1;
    let clip = ((settings.clip_s * rate).round() as usize).max(least);
    if let Some(motion) = motions.iter().position(|m| m.poses.len() < clip) {
        return Err(GraphError::ShorterThanClip { motion, frames: motions[motion].poses.len(), clip });
    }
    Ok((rate, clip))
}

/// Positions of all moving joints in the root's frame, frame by frame, metres.
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

#[cfg(test)]
mod tests {
    use super::super::graph::Candidate;
    use super::*;
    use crate::motion_model::pose_chart::tests::swinging;

    fn quick() -> GraphSettings {
        let mut settings = GraphSettings { threshold_per_joint: 1e-6, ..GraphSettings::default() };
        settings.training.rounds = 1;
        settings
    }

    #[test]
    fn a_resumed_graph_equals_the_graph_learned_at_once() {
        let body = Humanoid::tracker25().unwrap();
        let (motions, settings) = ([swinging(&body, 70), swinging(&body, 40)], quick());
        let at_once = GpdmGraph::learn(&body, &motions, &settings).unwrap();
        assert!(at_once.segments.len() > 2, "{} segments", at_once.segments.len());
        let finished = at_once.segments[..2].to_vec();
        let mut learner = GraphLearner::new(&body, &motions, &settings).unwrap().resume(finished).unwrap();
        while learner.grow(&mut |_, _| true).unwrap().is_some() {}
        assert_eq!(learner.frames_done(), 110);
        assert_eq!(learner.finish(), at_once);
    }

    #[test]
    fn segments_of_another_motion_are_not_resumed() {
        let body = Humanoid::tracker25().unwrap();
        let (motions, settings) = ([swinging(&body, 40)], quick());
        let graph = GpdmGraph::learn(&body, &motions, &settings).unwrap();
        let mut other = motions.clone();
        other[0].poses[3].joint_angles[0] += 0.01;
        let refused = GraphLearner::new(&body, &other, &settings).unwrap().resume(graph.segments).err();
        assert!(refused.unwrap().to_string().starts_with("the saved segments do not belong to these"));
    }

    #[test]
    fn a_joint_model_of_one_motion_is_its_single_model() {
        let body = Humanoid::tracker25().unwrap();
        let motions = [swinging(&body, 40)];
        let single = GraphSettings { single: true, ..quick() };
        let [single, joint] = [single.clone(), GraphSettings { joint: true, ..single }]
            .map(|settings| GpdmGraph::learn(&body, &motions, &settings).unwrap());
        assert_eq!(single, joint);
    }

    #[test]
    fn a_joint_model_knows_the_motion_and_frame_of_every_row() {
        let body = Humanoid::tracker25().unwrap();
        let mut other = swinging(&body, 50);
        other.poses.reverse();
        let motions = [swinging(&body, 70), other];
        let settings = GraphSettings { joint: true, ..quick() };
        let graph = GpdmGraph::learn(&body, &motions, &settings).unwrap();
        assert_eq!((graph.segments.len(), &graph.segments[0].gpdm.layout().lengths), (1, &vec![70, 50]));
        let segment = &graph.segments[0];
        assert_eq!([0, 69, 70, 119].map(|row| segment.source_of(row)), [(0, 0), (0, 69), (1, 0), (1, 49)]);
        assert_eq!([segment.sequence_of(69), segment.sequence_of(70)], [0..70, 70..120]);
        for (row, rotations) in segment.rotations.iter().enumerate() {
            let (motion, frame) = segment.source_of(row);
            assert_eq!(rotations, &graph.chart.rotations(&motions[motion].poses[frame]), "row {row}");
            assert_eq!(graph.locate(motion, frame), Some(Candidate { segment: 0, row }));
        }
        assert_eq!((graph.locate(0, 70), graph.locate(1, 50), graph.locate(2, 0)), (None, None, None));
        // each motion's simulation starts at its own first latent, so errors stay small
        assert!(segment.errors[0] < 0.05 && segment.errors[70] < 0.05, "{} {}", segment.errors[0], segment.errors[70]);
    }
}
