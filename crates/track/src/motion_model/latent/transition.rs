//! Transitions between models: destinations of jumps and their probabilities (`[GPDM graph]` Eq. 7 and step 3 of
//! section 3.3).

use faer::Mat;
use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::gpdm_graph::{Candidate, GpdmGraph, GraphSegment};
use super::super::pose_chart::distance;
use super::initialisation::literal_shares;
use super::settings::{InterTransition, JUMP_THRESHOLD, JumpRule, LatentSettings, VELOCITY_WEIGHT};
use skiagraph_core::body::rotation_vector;

/// Number of frames before the end of a segment from which a particle continues in the next.
const FRAMES_TO_THE_END: usize = 2;

/// A pose and its rates, as compared by jumps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PoseRate {
    pub(super) rotations: Vec<UnitQuaternion<f64>>,
    /// Angular velocity of every joint, rad/s.
    pub(super) velocities: Vec<Vector3<f64>>,
}

impl PoseRate {
    pub(super) fn between(
        before: &[UnitQuaternion<f64>],
        now: Vec<UnitQuaternion<f64>>,
        frames_per_second: f64,
    ) -> Self {
        let velocity = |(a, b): (&UnitQuaternion<f64>, &UnitQuaternion<f64>)| {
            rotation_vector(&(a.inverse() * b)) * frames_per_second
        };
        let velocities = before.iter().zip(&now).map(velocity).collect();
        Self { rotations: now, velocities }
    }

    pub(super) fn distance(&self, other: &Self, velocity_weight: f64) -> f64 {
        let velocity = |(a, b): (&Vector3<f64>, &Vector3<f64>)| (a - b).norm_squared();
        let velocities: f64 = self.velocities.iter().zip(&other.velocities).map(velocity).sum();
        distance(&self.rotations, &other.rotations) + velocity_weight * velocities
    }

    /// The distance if it is below `limit`. If the chords of the angles already exceed it, no arctangent is computed.
    pub(super) fn distance_below(&self, other: &Self, velocity_weight: f64, limit: f64) -> Option<f64> {
        let mut least = 0.0;
        let joints = self.rotations.iter().zip(&other.rotations).zip(self.velocities.iter().zip(&other.velocities));
        for ((a, b), (u, v)) in joints {
            let cos = a.coords.dot(&b.coords);
            least += 4.0 * (1.0 - cos * cos) + velocity_weight * (u - v).norm_squared();
            // rounding must not exclude a pose just below the limit
            if least > limit + 1e-9 {
                return None;
            }
        }
        Some(self.distance(other, velocity_weight)).filter(|distance| *distance < limit)
    }
}

#[derive(Clone, Copy, Debug)]
struct JumpTarget {
    at: Candidate,
    /// Reciprocal of the number of candidates of its model.
    share: f64,
}

/// Possible destinations of jumps.
///
/// A destination's pose is the map's mean at its latent point, as in `[GPDM graph]` Eq. 7, not the recorded pose.
#[derive(Clone, Debug)]
pub(super) struct Jumps {
    /// For every segment, all training frames at the map's mean; the velocity of a first frame is that of the second.
    frames: Vec<Vec<PoseRate>>,
    /// All candidates, without natural edges.
    destinations: Vec<JumpTarget>,
}

/// For every segment, the map's mean at every training latent, one row per frame.
pub(super) fn training_means(graph: &GpdmGraph) -> Vec<Mat<f64>> {
    graph.segments.iter().map(|s| s.gpdm.map_mean(s.gpdm.latents())).collect()
}

impl Jumps {
    pub(super) fn new(graph: &GpdmGraph, means: &[Mat<f64>]) -> Self {
        let mut counts = vec![0.0; graph.segments.len()];
        graph.candidates.iter().for_each(|at| counts[at.segment] += 1.0);
        let destination = |at: &Candidate| JumpTarget { at: *at, share: 1.0 / counts[at.segment] };
        let frames = graph.segments.iter().zip(means).map(|(s, means)| frames_of(graph, s, means)).collect();
        Self { frames, destinations: graph.candidates.iter().map(destination).collect() }
    }

    /// The training frame `at`, at the map's mean.
    pub(super) fn frame(&self, at: Candidate) -> &PoseRate {
        &self.frames[at.segment][at.row]
    }

    /// The training frame of a model with the most similar pose.
    fn nearest_row(&self, segment: usize, rotations: &[UnitQuaternion<f64>]) -> Option<usize> {
        let rows = self.frames[segment].iter().enumerate();
        let distances = rows.map(|(row, frame)| (row, distance(rotations, &frame.rotations)));
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(row, _)| row)
    }
}

fn frames_of(graph: &GpdmGraph, segment: &GraphSegment, means: &Mat<f64>) -> Vec<PoseRate> {
    let rotations = |row: usize| graph.chart.rotations_of(&means.row(row).iter().copied().collect::<Vec<_>>());
    let rotations: Vec<_> = (0..means.nrows()).map(rotations).collect();
    let moving = |row: usize| {
        let rows = segment.sequence_of(row);
        let last = row.max(rows.start + 1).min(rows.end - 1);
        let before = &rotations[last.saturating_sub(1)];
        let velocity = PoseRate::between(before, rotations[last].clone(), graph.frames_per_second);
        PoseRate { rotations: rotations[row].clone(), ..velocity }
    };
    (0..rotations.len()).map(moving).collect()
}

/// Destination of a particle in `segment`, nearest to training row `row` there; `None` to stay. `moving` has the
/// particle's own pose, offset included (step 3 of `[GPDM graph]` section 3.3), and the velocity of the map's mean;
/// `seen` are the velocities of the last estimates, rad/s.
pub(super) fn jump(
    graph: &GpdmGraph,
    jumps: &Jumps,
    settings: &LatentSettings,
    (segment, row): (usize, usize),
    (moving, seen): (&PoseRate, Option<&[Vector3<f64>]>),
    rng: &mut ChaCha8Rng,
) -> Option<Candidate> {
    if settings.natural_edges
        && is_end(graph, segment, row)
        && let Some(at) = continuation(graph, jumps, segment, (moving, seen), &settings.transition)
    {
        return Some(at);
    }
    match settings.transition {
        InterTransition::None => None,
        InterTransition::Switching { probability } => {
            let others = graph.segments.len().checked_sub(1).filter(|others| *others > 0)?;
            if rng.random::<f64>() >= probability {
                return None;
            }
            let drawn = rng.random_range(0..others);
            let target = if drawn < segment { drawn } else { drawn + 1 };
            jumps.nearest_row(target, &moving.rotations).map(|row| Candidate { segment: target, row })
        }
        InterTransition::Graph { rule, threshold, width, velocity_weight } => {
            let joints = moving.rotations.len() as f64;
            let limit = threshold * joints;
            let others = jumps.destinations.iter().filter(|d| d.at.segment != segment);
            let distance =
                |d: &JumpTarget| Some((*d, jumps.frame(d.at).distance_below(moving, velocity_weight, limit)?));
            let near: Vec<(JumpTarget, f64)> = others.filter_map(distance).collect();
            choose(&near, rule, width * joints, rng)
        }
    }
}

/// Whether a row is the last one of its sequence in the model.
fn is_end(graph: &GpdmGraph, segment: usize, row: usize) -> bool {
    row + FRAMES_TO_THE_END >= graph.segments[segment].sequence_of(row).end
}

/// Destination of a particle at the end of its segment: the next segment of the recording or, at the end of the
/// recording, the training frame with the most similar motion, if any is similar enough. Without transitions between
/// models, only the particle's own model is searched.
///
/// The motion compared there is that of the last estimates: the model's own ends with the recording. If that ends at
/// rest, the most similar motion would always be the same rest, even while the body begins to move.
fn continuation(
    graph: &GpdmGraph,
    jumps: &Jumps,
    segment: usize,
    (moving, seen): (&PoseRate, Option<&[Vector3<f64>]>),
    transition: &InterTransition,
) -> Option<Candidate> {
    let stays = *transition == InterTransition::None;
    if let Some(next) = graph.successor(segment).filter(|_| !stays) {
        return Some(Candidate { segment: next, row: 0 });
    }
    let (threshold, velocity_weight) = match *transition {
        InterTransition::Graph { threshold, velocity_weight, .. } => (threshold, velocity_weight),
        _ => (JUMP_THRESHOLD, VELOCITY_WEIGHT),
    };
    let velocities = seen.unwrap_or(&moving.velocities).to_vec();
    let moving = PoseRate { rotations: moving.rotations.clone(), velocities };
    let segments = graph.segments.iter().enumerate().filter(|(other, _)| !stays || *other == segment);
    let rows = segments.flat_map(|(segment, s)| (0..s.rotations.len()).map(move |row| Candidate { segment, row }));
    let inner = rows.filter(|at| !is_end(graph, at.segment, at.row));
    let distance = |at: Candidate| (at, jumps.frame(at).distance(&moving, velocity_weight));
    let nearest = inner.map(distance).min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.filter(|(_, distance)| *distance < threshold * moving.rotations.len() as f64).map(|(at, _)| at)
}

/// Draws one of the destinations by their distances; `None` to stay.
fn choose(near: &[(JumpTarget, f64)], rule: JumpRule, width: f64, rng: &mut ChaCha8Rng) -> Option<Candidate> {
    let drawn: f64 = rng.random();
    let shares = match rule {
        JumpRule::Literal => literal_shares(&near.iter().map(|n| n.1).collect::<Vec<_>>()),
        JumpRule::StayWeighted => jump_probabilities(near.iter().map(|n| libm::exp(-n.1 / width)).collect()),
        JumpRule::StayShared => jump_probabilities(near.iter().map(|n| n.0.share * libm::exp(-n.1 / width)).collect()),
    };
    let mut passed = 0.0;
    near.iter().zip(shares).find_map(|((destination, _), share)| {
        passed += share;
        (drawn < passed).then_some(destination.at)
    })
}

/// Probabilities of jumps with these weights, where staying has weight 1.
fn jump_probabilities(weights: Vec<f64>) -> Vec<f64> {
    let total = 1.0 + weights.iter().sum::<f64>();
    weights.into_iter().map(|weight| weight / total).collect()
}
