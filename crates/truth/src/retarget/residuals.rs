//! Quality measures of a retargeting.

use serde::Serialize;

use super::SegmentLengths;
use super::anatomy::SubjectFrame;
use super::goals::marker_distances;
use skiagraph_core::body::{Humanoid, LANDMARKS, Motion};

/// Quality measures of a retargeting, in millimetres, metres or degrees according to the name.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RetargetReport {
    /// Mean distance between the body's landmarks and the recorded ones, over frames and landmarks.
    pub mean_residual_mm: f64,
    /// The same for each landmark.
    pub landmarks: Vec<LandmarkResidual>,
    /// Share of the frames in which a landmark is more than 100 mm from its recorded place.
    pub out_of_reach: f64,
    /// Degrees of freedom that reached a limit in some frame.
    pub limit_hits: Vec<LimitHits>,
    /// Height of the feet after all shifts; `None` if the feet have no solids.
    pub foot_height: Option<FootHeight>,
    /// Upward shift of the motion to the ground.
    pub ground_shift_m: f64,
    /// Rotation of the motion that levels its ground.
    pub ground_levelled_deg: f64,
    /// Horizontal shift (x, y) that centres the path.
    pub path_shift_m: [f64; 2],
    /// The subject's segment lengths, as used for scaling the body.
    pub lengths: SegmentLengths,
    /// Notes of the clip's reader and of the retargeting.
    pub notes: Vec<String>,
}

/// Distance of a landmark from its recorded position, over frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LandmarkResidual {
    /// The landmark's name.
    pub landmark: &'static str,
    /// Mean.
    pub mean_mm: f64,
    /// 95th percentile.
    pub p95_mm: f64,
    /// Maximum.
    pub max_mm: f64,
}

/// How often a degree of freedom is at a limit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LimitHits {
    /// Name of the degree of freedom.
    pub degree_of_freedom: String,
    /// Frames at the lower limit.
    pub lower_frames: usize,
    /// Frames at the upper limit.
    pub upper_frames: usize,
}

/// Height of the lowest point of the feet above the ground, over frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FootHeight {
    /// Mean.
    pub mean_mm: f64,
    /// Minimum; negative below the ground.
    pub min_mm: f64,
}

/// A landmark farther than this from its recorded place is out of reach, metres.
pub(super) const OUT_OF_REACH: f64 = 0.1;
/// Tolerance for being at a limit, radians or metres.
const AT_LIMIT: f64 = 1e-6;

impl RetargetReport {
    pub(super) fn new(humanoid: &Humanoid, subject: &[SubjectFrame], motion: &Motion, lengths: SegmentLengths) -> Self {
        let distances: Vec<_> = subject
            .iter()
            .zip(&motion.poses)
            .map(|(frame, pose)| marker_distances(humanoid, &frame.markers, pose))
            .collect();
        let of = |landmark: usize| distances.iter().filter_map(|d| d[landmark]).map(|d| 1000.0 * d).collect();
        let landmarks: Vec<LandmarkResidual> = LANDMARKS
            .iter()
            .enumerate()
            .filter_map(|(index, landmark)| LandmarkResidual::from_distances(landmark.name(), of(index)))
            .collect();
        let mean_residual_mm = landmarks.iter().map(|l| l.mean_mm).sum::<f64>() / landmarks.len().max(1) as f64;
        Self {
            mean_residual_mm,
            landmarks,
            out_of_reach: distances.iter().filter(|own| own.iter().flatten().any(|d| *d > OUT_OF_REACH)).count() as f64
                / distances.len().max(1) as f64,
            limit_hits: limit_hits(humanoid, motion),
            foot_height: None,
            ground_shift_m: 0.0,
            ground_levelled_deg: 0.0,
            path_shift_m: [0.0; 2],
            lengths,
            notes: Vec::new(),
        }
    }
}

impl LandmarkResidual {
    fn from_distances(landmark: &'static str, distances_mm: Vec<f64>) -> Option<Self> {
        let mean_mm = distances_mm.iter().sum::<f64>() / distances_mm.len() as f64;
        let max_mm = distances_mm.iter().copied().reduce(f64::max)?;
        Some(Self { landmark, mean_mm, p95_mm: super::quantile(distances_mm, 0.95)?, max_mm })
    }
}

impl FootHeight {
    pub(super) fn from_heights(heights: &[f64]) -> Option<Self> {
        let min = heights.iter().copied().reduce(f64::min)?;
        Some(Self { mean_mm: 1000.0 * heights.iter().sum::<f64>() / heights.len() as f64, min_mm: 1000.0 * min })
    }
}

/// Maximum plausible speed of a landmark, m/s.
const MAX_SPEED: f64 = 15.0;
/// Maximum number of frames listed in a note.
const LISTED: usize = 10;

/// A note on the frames, from 0, into which the recording jumps, if any. `frames_per_second` is the recorded rate, not
/// that of playback.
pub(super) fn jump_note(subject: &[SubjectFrame], frames_per_second: f64) -> Option<String> {
    let is_jump = |pair: &[SubjectFrame]| {
        let moved =
            pair[0].markers.iter().zip(&pair[1].markers).filter_map(|(a, b)| Some((b.as_ref()? - a.as_ref()?).norm()));
        moved.fold(0.0, f64::max) * frames_per_second > MAX_SPEED
    };
    let frames: Vec<usize> = (1..subject.len()).filter(|&i| is_jump(&subject[i - 1..=i])).collect();
    let listed: Vec<String> = frames.iter().take(LISTED).map(usize::to_string).collect();
    let more = if frames.len() > LISTED { format!(" and {} more", frames.len() - LISTED) } else { String::new() };
    (!frames.is_empty()).then(|| {
        format!(
            "the recording jumps (a landmark moves faster than {MAX_SPEED} m/s) into frame {}{more} (from 0, at the \
            resampled rate)",
            listed.join(", ")
        )
    })
}

fn limit_hits(humanoid: &Humanoid, motion: &Motion) -> Vec<LimitHits> {
    let count = |index: usize, is_at: &dyn Fn(f64) -> bool| {
        motion.poses.iter().filter(|pose| is_at(pose.joint_angles[index])).count()
    };
    let hits = humanoid.degrees_of_freedom.iter().enumerate().map(|(index, limits)| LimitHits {
        degree_of_freedom: limits.name.clone(),
        lower_frames: count(index, &|angle| angle <= limits.lower + AT_LIMIT),
        upper_frames: count(index, &|angle| angle >= limits.upper - AT_LIMIT),
    });
    hits.filter(|hits| hits.lower_frames + hits.upper_frames > 0).collect()
}
