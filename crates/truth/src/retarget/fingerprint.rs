//! Fingerprints that identify a recorded take independent of its file.
//!
//! Two files contain frames of the same take if the distances between landmarks are equal over a stretch in which the
//! body moves. Distances between landmarks, divided by the leg length, are invariant to the file's format, name, axes,
//! unit, position on the ground, frame numbers and cropping. A take is a path through the space of these distances, and
//! paths are compared, so the frame rate has little effect. Two cycles of the same walk differ by several hundredths,
//! copies by less than a thousandth.

use std::collections::BTreeMap;

use super::RetargetError;
use super::anatomy::Anatomy;
use crate::mocap::Clip;
use skiagraph_core::body::{LANDMARKS, Landmark, Markers};

/// Number of distances per frame.
pub const FINGERPRINT_DISTANCES: usize = 16;

/// The pairs of landmarks whose distances are used.
const PAIRS: [(Landmark, Landmark); FINGERPRINT_DISTANCES] = [
    (Landmark::LeftWrist, Landmark::RightWrist),
    (Landmark::LeftAnkle, Landmark::RightAnkle),
    (Landmark::LeftWrist, Landmark::LeftAnkle),
    (Landmark::RightWrist, Landmark::RightAnkle),
    (Landmark::LeftWrist, Landmark::RightAnkle),
    (Landmark::RightWrist, Landmark::LeftAnkle),
    (Landmark::LeftElbow, Landmark::RightElbow),
    (Landmark::LeftKnee, Landmark::RightKnee),
    (Landmark::LeftWrist, Landmark::Pelvis),
    (Landmark::RightWrist, Landmark::Pelvis),
    (Landmark::LeftAnkle, Landmark::Pelvis),
    (Landmark::RightAnkle, Landmark::Pelvis),
    (Landmark::LeftElbow, Landmark::RightKnee),
    (Landmark::RightElbow, Landmark::LeftKnee),
    (Landmark::Thorax, Landmark::LeftKnee),
    (Landmark::Thorax, Landmark::RightKnee),
];

/// Joints of each leg, whose mean length is the unit.
const LEGS: [[Landmark; 3]; 2] = [
    [Landmark::LeftHip, Landmark::LeftKnee, Landmark::LeftAnkle],
    [Landmark::RightHip, Landmark::RightKnee, Landmark::RightAnkle],
];

/// Tolerances for shared frames; a stretch must move by at least ten times its tolerance. Large ones detect copies at
/// another rate, small ones exact copies with little movement.
const TOLERANCES: [f32; 3] = [2e-3, 2e-4, 2e-5];

/// Least ratio of a stretch's movement to the tolerance.
const MIN_MOVEMENT_RATIO: f32 = 10.0;

/// Least number of frames in a stretch.
const MIN_FRAMES: usize = 3;

type DistanceRow = [f32; FINGERPRINT_DISTANCES];

/// The fingerprint of a take: a row of distances between landmarks for every frame, in leg lengths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionFingerprint {
    /// One row per frame.
    pub rows: Vec<DistanceRow>,
}

/// Frames shared by two takes, counted from 0, inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SharedFrames {
    /// First and last frame of this take.
    pub own: (usize, usize),
    /// First and last frame of the other take.
    pub other: (usize, usize),
}

impl MotionFingerprint {
    /// The fingerprint of all frames of a clip, preferably at the rate of its file. Landmarks are found by joint names;
    /// `joint_map` ([`super::RetargetOptions::landmarks`]) is used only if these are not recognised, so that a
    /// different map for a known skeleton does not change the fingerprint.
    pub fn from_clip(clip: &Clip, joint_map: &BTreeMap<String, String>) -> Result<Self, RetargetError> {
        let anatomy = Anatomy::from_clip(clip, &Default::default()).or_else(|_| Anatomy::from_clip(clip, joint_map))?;
        let row = |frame: usize| distances(&anatomy.observe(clip, frame).markers);
        Ok(Self { rows: (0..clip.frames.len()).map(row).collect() })
    }

    /// Distance of a frame's markers from the nearest row or its mirror image: mean absolute difference of the
    /// distances, in leg lengths. `None` without rows, or if the frame has too few markers.
    pub fn nearest(&self, markers: &Markers) -> Option<f32> {
        let own = distances(markers);
        let known =
            || PAIRS.iter().enumerate().filter(|(_, (a, b))| [a, b].iter().all(|m| markers[**m as usize].is_some()));
        let (count, mirrored) = (known().count(), PAIRS.map(mirror_image));
        let difference = |row: &DistanceRow, order: &dyn Fn(usize) -> usize| {
            known().map(|(i, _)| (own[i] - row[order(i)]).abs()).sum::<f32>() / count as f32
        };
        let nearer = |row: &DistanceRow| difference(row, &|i| i).min(difference(row, &|i| mirrored[i]));
        (2 * count > PAIRS.len()).then(|| self.rows.iter().map(nearer).min_by(f32::total_cmp)).flatten()
    }

    /// The first stretch of frames contained in both, if any.
    pub fn shared_with(&self, other: &Self) -> Option<SharedFrames> {
        // a path sampled at a low rate cuts corners, so both directions are tried
        let swapped = |s: SharedFrames| SharedFrames { own: s.other, other: s.own };
        stretch_along(&self.rows, &other.rows).or_else(|| stretch_along(&other.rows, &self.rows).map(swapped))
    }
}

fn distances(markers: &Markers) -> DistanceRow {
    let between = |a: Landmark, b: Landmark| match (markers[a as usize], markers[b as usize]) {
        (Some(a), Some(b)) => (a - b).norm(),
        _ => 0.0,
    };
    let legs: f64 = LEGS.iter().map(|[hip, knee, ankle]| between(*hip, *knee) + between(*knee, *ankle)).sum();
    let unit = if legs > 0.0 { 2.0 / legs } else { 0.0 };
    PAIRS.map(|(a, b)| (between(a, b) * unit) as f32)
}

/// Index of the mirrored pair.
fn mirror_image((a, b): (Landmark, Landmark)) -> usize {
    let other = |landmark: Landmark| {
        let name = landmark.name();
        let name = match name.strip_prefix("left_") {
            Some(rest) => format!("right_{rest}"),
            None => name.strip_prefix("right_").map_or(name.to_owned(), |rest| format!("left_{rest}")),
        };
        LANDMARKS.into_iter().find(|known| known.name() == name).unwrap_or(landmark)
    };
    let (a, b) = (other(a), other(b));
    PAIRS.iter().position(|pair| *pair == (a, b) || *pair == (b, a)).unwrap_or(0)
}

/// Distance of a row from a path, and the nearest frame of the path.
#[derive(Clone, Copy)]
struct PathMatch {
    distance: f32,
    frame: usize,
}

/// The first stretch of `rows` that follows the polyline through `path`.
fn stretch_along(rows: &[DistanceRow], path: &[DistanceRow]) -> Option<SharedFrames> {
    if path.len() < 2 {
        return None;
    }
    let matches: Vec<Option<PathMatch>> = rows.iter().map(|row| match_path(row, path)).collect();
    TOLERANCES.into_iter().find_map(|tolerance| {
        let near = |index: usize| matches[index].is_some_and(|m| m.distance <= tolerance);
        let mut first = 0;
        while first < rows.len() {
            let length = (first..rows.len()).take_while(|index| near(*index)).count();
            let stretch = &rows[first..first + length];
            if length >= MIN_FRAMES && movement(stretch) >= MIN_MOVEMENT_RATIO * tolerance {
                let frames = || matches[first..first + length].iter().flatten().map(|m| m.frame);
                let other = (frames().min().unwrap_or(0), frames().max().unwrap_or(0));
                return Some(SharedFrames { own: (first, first + length - 1), other });
            }
            first += length + 1;
        }
        None
    })
}

fn match_path(row: &DistanceRow, path: &[DistanceRow]) -> Option<PathMatch> {
    let mut best: Option<PathMatch> = None;
    for (frame, pair) in path.windows(2).enumerate() {
        let bound = best.map_or(TOLERANCES[0], |b| b.distance);
        if let Some((distance, share)) = distance_to_segment(row, &pair[0], &pair[1], bound) {
            best = Some(PathMatch { distance, frame: if share < 0.5 { frame } else { frame + 1 } });
        }
    }
    best
}

/// Maximum-norm distance of a row from the segment between two others, and the position on the segment; only if below
/// `bound`.
fn distance_to_segment(row: &DistanceRow, from: &DistanceRow, to: &DistanceRow, bound: f32) -> Option<(f32, f32)> {
    let outside = |i: usize| row[i] < from[i].min(to[i]) - bound || row[i] > from[i].max(to[i]) + bound;
    if (0..FINGERPRINT_DISTANCES).any(outside) {
        return None;
    }
    let (mut along, mut length) = (0.0_f32, 0.0_f32);
    for i in 0..FINGERPRINT_DISTANCES {
        let step = to[i] - from[i];
        along += (row[i] - from[i]) * step;
        length += step * step;
    }
    let share = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    let distance =
        (0..FINGERPRINT_DISTANCES).map(|i| (from[i] + share * (to[i] - from[i]) - row[i]).abs()).fold(0.0, f32::max);
    (distance < bound).then_some((distance, share))
}

/// The largest range of any distance over a stretch.
fn movement(rows: &[DistanceRow]) -> f32 {
    let of = |i: usize| {
        let values = || rows.iter().map(|row| row[i]);
        values().fold(f32::NEG_INFINITY, f32::max) - values().fold(f32::INFINITY, f32::min)
    };
    (0..FINGERPRINT_DISTANCES).map(of).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mocap::{ReadOptions, parse_bvh, parse_deepmimic};

    fn jumps() -> Clip {
        let text = include_str!("../../../../scenarios/motions/01_01.bvh");
        let options = ReadOptions { metres_per_unit: Some(0.0254 / 0.45), ..ReadOptions::default() };
        parse_bvh(text, "01_01.bvh", &options).unwrap()
    }

    fn deepmimic(text: &str) -> MotionFingerprint {
        MotionFingerprint::from_clip(
            &parse_deepmimic(text, "a.txt", &ReadOptions::default()).unwrap(),
            &Default::default(),
        )
        .unwrap()
    }

    fn fingerprint(clip: &Clip) -> MotionFingerprint {
        MotionFingerprint::from_clip(clip, &Default::default()).unwrap()
    }

    #[test]
    fn every_pair_has_a_mirror_image_and_a_frame_matches_only_itself_and_its_mirror_image() {
        for (index, pair) in PAIRS.into_iter().enumerate() {
            assert_eq!(mirror_image(PAIRS[mirror_image(pair)]), index, "{pair:?}");
        }
        let body = skiagraph_core::body::shipped("actor").unwrap();
        let mut pose = body.zero_pose();
        for (i, angle) in pose.joint_angles.iter_mut().enumerate() {
            *angle = 0.5 * (i as f64).sin();
        }
        let markers = body.markers(&body.link_frames(&pose));
        let row = distances(&markers);
        let mirrored = std::array::from_fn(|i| row[mirror_image(PAIRS[i])]);
        assert_ne!(row, mirrored);
        let nearest = |row| MotionFingerprint { rows: vec![row] }.nearest(&markers);
        assert_eq!((nearest(row), nearest(mirrored)), (Some(0.0), Some(0.0)));
        assert!(nearest([0.0; FINGERPRINT_DISTANCES]).unwrap() > 0.4);
        assert_eq!(MotionFingerprint::default().nearest(&markers), None);
    }

    #[test]
    fn a_part_of_a_take_is_found_at_higher_and_lower_rates() {
        let take = jumps();
        let test = take.clone().crop(1000..1400).unwrap();
        for rate in [24.0, 30.0, 60.0, 97.3, 120.0, 240.0] {
            let copy = take.clone().crop(1300..1800).unwrap().resampled(rate).unwrap();
            let shared = fingerprint(&copy).shared_with(&fingerprint(&test));
            let shared = shared.unwrap_or_else(|| panic!("{rate} Hz: 0.8 s are shared"));
            assert!(shared.own.0 as f64 <= 0.1 * rate && shared.other.0.abs_diff(300) < 15, "{rate} Hz: {shared:?}");
        }
    }

    #[test]
    fn a_few_exactly_shared_frames_are_found() {
        let take = jumps();
        let test = fingerprint(&take.clone().crop(1000..1400).unwrap());
        let shared = fingerprint(&take.clone().crop(1395..1800).unwrap()).shared_with(&test).unwrap();
        assert_eq!(shared, SharedFrames { own: (0, 4), other: (395, 399) });
        let next = fingerprint(&take.crop(1400..1800).unwrap());
        assert_eq!(next.shared_with(&test), None, "the next frame is not shared");
    }

    #[test]
    fn a_moved_rotated_and_scaled_take_is_the_same() {
        let take = jumps().crop(1000..1400).unwrap();
        let mut moved = take.clone();
        let place = nalgebra::Isometry3::new(nalgebra::Vector3::new(3.0, -1.0, 0.2), nalgebra::Vector3::z() * 1.3);
        for frame in &mut moved.frames {
            frame[0] = place * frame[0];
            frame.iter_mut().for_each(|joint| joint.translation.vector *= 1.07);
        }
        moved.skeleton.joints.iter_mut().filter_map(|j| j.tip.as_mut()).for_each(|tip| *tip *= 1.07);
        assert!(fingerprint(&moved).shared_with(&fingerprint(&take)).is_some());
    }

    #[test]
    fn other_motions_and_other_parts_of_the_same_take_share_nothing() {
        let take = jumps();
        let parts: Vec<MotionFingerprint> =
            (0..5).map(|k| fingerprint(&take.clone().crop(50 + 500 * k..550 + 500 * k).unwrap())).collect();
        let clips = [
            deepmimic(include_str!("../../../../scenarios/motions/humanoid3d_walk.txt")),
            deepmimic(include_str!("../../../../scenarios/motions/humanoid3d_run.txt")),
            deepmimic(include_str!("../../../../scenarios/motions/humanoid3d_jump.txt")),
        ];
        let all: Vec<&MotionFingerprint> = parts.iter().chain(&clips).collect();
        for (i, a) in all.iter().enumerate() {
            for (j, b) in all.iter().enumerate() {
                assert_eq!(a.shared_with(b).is_some(), i == j, "{i} and {j}: {:?}", a.shared_with(b));
            }
        }
    }

    #[test]
    fn takes_without_movement_share_nothing() {
        let still = MotionFingerprint { rows: vec![[1.0; FINGERPRINT_DISTANCES]; 100] };
        assert_eq!(still.shared_with(&still), None);
        assert_eq!(still.shared_with(&MotionFingerprint::default()), None);
    }
}
