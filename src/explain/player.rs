//! The inputs of a tracker that may be wrong, which are replaced by the truth one after another.

use serde::Serialize;

use crate::scenario::{EvidenceSource, TrackerSettings};
use skiagraph_core::body::Pose;
use skiagraph_set::BenchmarkSet;
use skiagraph_truth::observing::{Corruption, KeypointSettings, ObservationFacts, SilhouetteSource};

/// What may cause an error: an input of the tracker, or its search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Player {
    /// The tracker's body is not the actor's.
    Body,
    /// The cameras are not where the tracker is told, or have another lens.
    Cameras,
    /// Images are not of the frame's time.
    Time,
    /// Silhouettes or keypoints are not exact.
    Observations,
    /// The start pose is not the truth.
    Start,
    /// The search ends elsewhere than a descent from the truth.
    Search,
}

/// The inputs, in the order of the page.
pub(super) const INPUTS: [Player; 5] =
    [Player::Body, Player::Cameras, Player::Time, Player::Observations, Player::Start];

/// Greatest difference of a coordinate, m, or an angle, rad, between poses that count as equal.
const SAME_POSE: f64 = 1e-9;

/// Which observations a tracker uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sees {
    Silhouettes,
    Keypoints,
    /// Both, or it is not known: a program.
    Both,
}

impl Sees {
    pub(super) fn of(tracker: &TrackerSettings) -> Self {
        match tracker {
            TrackerSettings::Program(_) => Self::Both,
            TrackerSettings::Keypoints(_) => Self::Keypoints,
            TrackerSettings::AnnealedParticleFilter(filter) => match filter.evidence {
                EvidenceSource::Silhouettes => Self::Silhouettes,
                EvidenceSource::Keypoints => Self::Keypoints,
                EvidenceSource::Both => Self::Both,
            },
            _ => Self::Silhouettes,
        }
    }

    fn words(self, set: &BenchmarkSet) -> &'static str {
        match self {
            Self::Silhouettes => "silhouettes",
            Self::Keypoints => "keypoints",
            Self::Both if set.blind.keypoints.is_none() => "silhouettes",
            Self::Both => "silhouettes and keypoints",
        }
    }
}

impl Player {
    /// Its name in tables.
    pub(super) fn title(self, sees: Sees, set: &BenchmarkSet) -> &'static str {
        match self {
            Self::Body => "body",
            Self::Cameras => "cameras",
            Self::Time => "timing",
            Self::Observations => sees.words(set),
            Self::Start => "start pose",
            Self::Search => "search",
        }
    }

    /// Whether the tracker is given anything but the truth here.
    pub(super) fn differs(self, set: &BenchmarkSet, sees: Sees) -> bool {
        let (blind, truth) = (&set.blind, &set.truth);
        let facts = facts(set);
        let corruption = facts.corruption;
        match self {
            Self::Body => !blind.start.body.is_same_body(&truth.ground_truth.actor),
            Self::Cameras => Self::Cameras.part_of(&corruption).changes_cameras(),
            Self::Time => !Self::Time.part_of(&corruption).is_none() || truth.rig.leaves_frames(),
            Self::Observations => !observation_faults(&facts, sees).is_empty(),
            Self::Start => !has_exact_start(set),
            Self::Search => false,
        }
    }

    /// What is wrong of whatever the tracker sees, in a few words; empty if nothing is known.
    pub(super) fn fault(self, set: &BenchmarkSet, sees: Sees) -> String {
        let facts = facts(set);
        match self {
            Self::Body => set.truth.facts.mismatch.clone(),
            Self::Time => {
                let words = [timing(set), self.part_of(&facts.corruption).describe()];
                words.into_iter().filter(|words| !words.is_empty()).collect::<Vec<_>>().join("; ")
            }
            Self::Observations => observation_faults(&facts, sees).join("; "),
            Self::Cameras | Self::Start => self.part_of(&facts.corruption).describe(),
            Self::Search => String::new(),
        }
    }

    fn part_of(self, corruption: &Corruption) -> Corruption {
        INPUTS.into_iter().filter(|other| *other != self).fold(*corruption, |rest, other| other.without(&rest))
    }

    /// The corruption without that of this input.
    pub(super) fn without(self, corruption: &Corruption) -> Corruption {
        match self {
            Self::Body => Corruption { wrong_body_percent: 0.0, ..*corruption },
            Self::Cameras => Corruption {
                calibration_mm: 0.0,
                calibration_deg: 0.0,
                calibration_px: 0.0,
                lens_ignored: 0.0,
                ..*corruption
            },
            Self::Time => Corruption {
                desynchronisation_ms: 0.0,
                clock_drift_ms_per_min: 0.0,
                line_delay_us: 0.0,
                dropped_frames: 0.0,
                ..*corruption
            },
            Self::Observations => Corruption {
                boundary_px: 0.0,
                boundary_s: 0.0,
                holes: 0.0,
                blobs: 0.0,
                missing_limb: 0.0,
                shadow_m: 0.0,
                salt_and_pepper: 0.0,
                ..*corruption
            },
            Self::Start => Corruption { start_mm: 0.0, start_deg: 0.0, ..*corruption },
            Self::Search => *corruption,
        }
    }
}

/// What is wrong with the silhouettes and the keypoints, as far as the tracker sees them.
fn observation_faults(facts: &ObservationFacts, sees: Sees) -> Vec<String> {
    let corruption = Player::Observations.part_of(&facts.corruption);
    let are_wrong = facts.silhouette == SilhouetteSource::Segmented || !corruption.is_none() || facts.distractors > 0;
    let masks = ObservationFacts { corruption, keypoints: None, colour_images: None, ..facts.clone() };
    let masks = (are_wrong && sees != Sees::Keypoints).then(|| masks.describe());
    let keypoints = facts.keypoints.as_ref().filter(|keypoints| keypoints.is_drawn() && sees != Sees::Silhouettes);
    masks.into_iter().chain(keypoints.map(KeypointSettings::describe)).collect()
}

pub(super) fn facts(set: &BenchmarkSet) -> ObservationFacts {
    set.blind.observation.clone().unwrap_or_default()
}

/// When cameras take their images, if not at the frames' times: the cameras with the same times together.
fn timing(set: &BenchmarkSet) -> String {
    if !set.truth.rig.leaves_frames() {
        return String::new();
    }
    let mut groups: Vec<(String, Vec<&str>)> = Vec::new();
    for (index, camera) in set.blind.rig.cameras.iter().enumerate() {
        let words = set.blind.moments.as_ref().and_then(|all| all.describe(index, set.blind.frames_per_second));
        let Some(words) = words else { continue };
        match groups.iter_mut().find(|(known, _)| *known == words) {
            Some((_, names)) => names.push(&camera.name),
            None => groups.push((words, vec![&camera.name])),
        }
    }
    let all = set.blind.rig.cameras.len();
    let group = |(words, names): (String, Vec<&str>)| match names.len() {
        count if count == all => format!("all cameras {words}"),
        _ => format!("{} {words}", names.join(", ")),
    };
    groups.into_iter().map(group).collect::<Vec<_>>().join("; ")
}

/// Whether the tracker starts at the pose of its body that is nearest to the truth.
pub(super) fn has_exact_start(set: &BenchmarkSet) -> bool {
    let exact = set.truth.refitted.as_ref().and_then(|motion| motion.poses.first());
    exact.is_some_and(|exact| are_same(exact, &set.blind.start.pose))
}

fn are_same(a: &Pose, b: &Pose) -> bool {
    let [here, there] = [a, b].map(|pose| pose.world_from_root);
    a.joint_angles.len() == b.joint_angles.len()
        && (here.translation.vector - there.translation.vector).norm() < SAME_POSE
        && here.rotation.angle_to(&there.rotation) < SAME_POSE
        && (&a.joint_angles - &b.joint_angles).amax() < SAME_POSE
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::KeypointLayout;
    use skiagraph_truth::observing::ColourFormat;

    #[test]
    fn noise_that_the_tracker_does_not_see_is_not_named_as_wrong() {
        let keypoints = KeypointSettings { white_percent: 1.0, ..KeypointSettings::exact(KeypointLayout::Coco17) };
        let facts = ObservationFacts {
            silhouette: SilhouetteSource::Corrupted,
            corruption: Corruption { boundary_px: 2.0, calibration_deg: 1.0, ..Corruption::default() },
            keypoints: Some(keypoints),
            colour_images: Some(ColourFormat::Png),
            ..ObservationFacts::default()
        };
        let [masks, points] = ["corrupted: boundary_px 2 px", "keypoints coco17: white_percent 1 %"];
        assert_eq!(observation_faults(&facts, Sees::Silhouettes), [masks]);
        assert_eq!(observation_faults(&facts, Sees::Keypoints), [points]);
        assert_eq!(observation_faults(&facts, Sees::Both), [masks, points]);
        let exact =
            ObservationFacts { silhouette: SilhouetteSource::Exact, corruption: Corruption::default(), ..facts };
        assert_eq!(observation_faults(&exact, Sees::Both), [points]);
        assert!(observation_faults(&exact, Sees::Silhouettes).is_empty());
    }
}
