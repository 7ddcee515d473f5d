//! Maps joints of a recorded skeleton to landmarks and segments of the body, by name.
//!
//! One ordered vocabulary covers every known naming convention. If two conventions use one name for different joints,
//! the order decides (`LeftShoulder` is the shoulder in cgspeed's 3ds Max files and in MocapBank's, but the clavicle in
//! a skeleton that also has a `LeftArm`):
//!
//! | | CMU ASF/AMC | cgspeed MotionBuilder | cgspeed 3ds Max | Animated Drawings | MocapBank | DeepMimic |
//! |---|---|---|---|---|---|---|
//! | hip | `lfemur` | `LeftUpLeg` | `LeftHip` | `LeftUpLeg` | `LeftHip` | `left_hip` |
//! | knee | `ltibia` | `LeftLeg` | `LeftKnee` | `LeftLeg` | `LeftKnee` | `left_knee` |
//! | ankle | `lfoot` | `LeftFoot` | `LeftAnkle` | `LeftFoot` | `LeftAnkle` | `left_ankle` |
//! | shoulder | `lhumerus` | `LeftArm` | `LeftShoulder` | `LeftArm` | `LeftShoulder` | `left_shoulder` |
//! | elbow | `lradius` | `LeftForeArm` | `LeftElbow` | `LeftForeArm` | `LeftElbow` | `left_elbow` |
//! | wrist | `lwrist` | `LeftHand` | `LeftWrist` | `LeftHand` | `LeftWrist` | `left_wrist` |
//! | thorax (C7) | `upperneck` | `Neck1` | `Neck` | `Neck` | `Neck` | `neck` |
//! | head top | tip of `head` | tip of `Head` | tip of `Head` | tip of `Head` | tip of `Head` | tip of `neck` |
//!
//! The pelvis is the midpoint of the hips. Trunk joints follow from the hierarchy: the pelvis rotates with the lowest
//! common ancestor of both hips, the thorax with that of both shoulders.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::RetargetError;
use crate::body::{LANDMARKS, Landmark, Markers};
use crate::mocap::{Clip, Skeleton};

/// Names of a lateral joint without its side, best first. Names are compared without case, punctuation or namespace.
const SIDED: [(Landmark, Landmark, &[&str]); 6] = [
    (Landmark::LeftHip, Landmark::RightHip, &["upleg", "upperleg", "thigh", "femur", "hip"]),
    (Landmark::LeftKnee, Landmark::RightKnee, &["leg", "lowleg", "lowerleg", "shin", "calf", "shank", "tibia", "knee"]),
    (Landmark::LeftAnkle, Landmark::RightAnkle, &["foot", "ankle"]),
    (Landmark::LeftShoulder, Landmark::RightShoulder, &["arm", "uparm", "upperarm", "humerus", "shoulder"]),
    (Landmark::LeftElbow, Landmark::RightElbow, &["forearm", "lowarm", "lowerarm", "radius", "elbow"]),
    (Landmark::LeftWrist, Landmark::RightWrist, &["wrist", "hand"]),
];
/// Mixamo's prefix, in files that lack the colon after it.
const MIXAMO: &str = "mixamorig";
const NECK: [&str; 3] = ["upperneck", "neck1", "neck"];
const HEAD: [&str; 2] = ["head", "neck"];
const TOES: [&str; 4] = ["toebase", "toes", "toe", "ball"];
const HAND: [&str; 3] = ["fingerbase", "hand", "wrist"];

/// A body segment whose orientation a recording may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BodySegment {
    Pelvis,
    Thorax,
    Head,
    LeftHand,
    RightHand,
    LeftFoot,
    RightFoot,
    LeftToes,
    RightToes,
}

/// All segments, in the order of [`SubjectFrame::rotations`].
pub(super) const SEGMENTS: [BodySegment; 9] = [
    BodySegment::Pelvis,
    BodySegment::Thorax,
    BodySegment::Head,
    BodySegment::LeftHand,
    BodySegment::RightHand,
    BodySegment::LeftFoot,
    BodySegment::RightFoot,
    BodySegment::LeftToes,
    BodySegment::RightToes,
];

/// A position on a recorded skeleton.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Site {
    Joint(usize),
    Tip(usize),
    Middle(usize, usize),
}

/// Positions of landmarks and segments on a recorded skeleton.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    landmarks: [Option<Site>; LANDMARKS.len()],
    segments: [Option<usize>; SEGMENTS.len()],
    /// Left and right ball of the foot.
    toes: [Option<Site>; 2],
    /// The joint above which a bone is missing, and that bone in the joint's frame.
    gap: Option<(usize, Vector3<f64>)>,
    skeleton_parents: Vec<Option<usize>>,
}

/// Landmarks and segment orientations in one frame of a recording.
#[derive(Clone, Debug)]
pub(super) struct SubjectFrame {
    /// World positions, metres.
    pub(super) markers: Markers,
    /// World rotation of the recorded joint of each segment.
    pub(super) rotations: [Option<UnitQuaternion<f64>>; SEGMENTS.len()],
    /// Balls of the left and right foot, metres.
    pub(super) toes: [Option<Point3<f64>>; 2],
}

impl Anatomy {
    /// Recognises the joints of a clip by name. `overrides` maps landmark names to `Joint`, `Joint:tip` or
    /// `Joint+Joint` (the midpoint).
    pub(super) fn from_clip(clip: &Clip, overrides: &BTreeMap<String, String>) -> Result<Self, RetargetError> {
        let names = Names::from_skeleton(&clip.skeleton);
        let mut landmarks = named_landmarks(&names);
        for (landmark, site) in overrides {
            let index = LANDMARKS
                .iter()
                .position(|l| l.name() == landmark)
                .ok_or_else(|| RetargetError::UnknownLandmark(landmark.clone()))?;
            landmarks[index] = Some(parse_site(&clip.skeleton, landmark, site)?);
        }
        let missing: Vec<&str> =
            LANDMARKS.iter().zip(&landmarks).filter(|(_, site)| site.is_none()).map(|(l, _)| l.name()).collect();
        if !missing.is_empty() {
            let joints = clip.skeleton.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(RetargetError::MissingLandmarks { missing: missing.join(", "), joints });
        }
        let joint_of = |landmark: Landmark| landmarks[landmark as usize].map(Site::joint);
        let ancestor = |a, b| common_ancestor(&clip.skeleton, joint_of(a)?, joint_of(b)?);
        let sided = |side, stems: &[&str]| names.sided(side, stems);
        let toes = [sided("left", &TOES), sided("right", &TOES)];
        let feet = [joint_of(Landmark::LeftAnkle), joint_of(Landmark::RightAnkle)];
        let thorax = ancestor(Landmark::LeftShoulder, Landmark::RightShoulder);
        let segments = [
            ancestor(Landmark::LeftHip, Landmark::RightHip),
            thorax,
            joint_of(Landmark::HeadTop),
            sided("left", &HAND).or(joint_of(Landmark::LeftWrist)),
            sided("right", &HAND).or(joint_of(Landmark::RightWrist)),
            feet[0],
            feet[1],
            toes[0],
            toes[1],
        ];
        let ball = |side: usize| {
            let foot_tip = feet[side].filter(|&j| clip.skeleton.joints[j].tip.is_some()).map(Site::Tip);
            toes[side].map(Site::Joint).or(foot_tip)
        };
        Ok(Self {
            toes: [ball(0), ball(1)],
            gap: thorax.and_then(|joint| missing_bone(clip, joint)),
            landmarks,
            segments,
            skeleton_parents: clip.skeleton.joints.iter().map(|j| j.parent).collect(),
        })
    }

    /// Length of the bone missing in the recording between the thorax joint and its children, metres.
    pub(super) fn restored_bone_m(&self) -> Option<f64> {
        self.gap.map(|(_, bone)| bone.norm())
    }

    /// The joints that move the observed parts: those of landmarks, segments and toes, and all their ancestors.
    pub(super) fn joints(&self) -> Vec<usize> {
        let sites = self.landmarks.iter().chain(&self.toes).flatten().map(|site| site.joint());
        let own: Vec<usize> = sites.chain(self.segments.iter().flatten().copied()).collect();
        let mut moves = vec![false; self.skeleton_parents.len()];
        for joint in own {
            let up = std::iter::successors(Some(joint), |&j| self.skeleton_parents[j]);
            up.for_each(|j| moves[j] = true);
        }
        (0..moves.len()).filter(|&joint| moves[joint]).collect()
    }

    /// The observations in frame `frame` of the clip.
    pub(super) fn observe(&self, clip: &Clip, frame: usize) -> SubjectFrame {
        let mut frames = clip.joint_frames(frame);
        self.close_gap(&mut frames);
        let place = |site: Site| self.place(site, clip, &frames);
        SubjectFrame {
            markers: self.landmarks.map(|site| site.map(place)),
            rotations: self.segments.map(|joint| joint.map(|j| frames[j].rotation)),
            toes: self.toes.map(|site| site.map(place)),
        }
    }

    fn place(&self, site: Site, clip: &Clip, frames: &[Isometry3<f64>]) -> Point3<f64> {
        let origin = |joint: usize| Point3::from(frames[joint].translation.vector);
        match site {
            Site::Joint(joint) => origin(joint),
            Site::Tip(joint) => frames[joint] * Point3::from(clip.skeleton.joints[joint].tip.unwrap_or_default()),
            Site::Middle(a, b) => nalgebra::center(&origin(a), &origin(b)),
        }
    }

    /// Moves all descendants of the joint below the gap by the missing bone.
    fn close_gap(&self, frames: &mut [Isometry3<f64>]) {
        let Some((below, bone)) = self.gap else { return };
        let shift = frames[below].rotation * bone;
        let mut above = vec![false; frames.len()];
        for joint in below + 1..frames.len() {
            above[joint] = self.skeleton_parents[joint].is_some_and(|p| p == below || above[p]);
            if above[joint] {
                frames[joint].translation.vector += shift;
            }
        }
    }
}

impl Site {
    /// The joint that moves the position.
    fn joint(self) -> usize {
        match self {
            Self::Joint(joint) | Self::Tip(joint) | Self::Middle(joint, _) => joint,
        }
    }
}

/// The lowest common ancestor of `a` and `b`.
fn common_ancestor(skeleton: &Skeleton, a: usize, b: usize) -> Option<usize> {
    let chain = |from: usize| std::iter::successors(Some(from), |&j| skeleton.joints[j].parent);
    chain(a).find(|&joint| chain(b).any(|other| other == joint))
}

/// Joints by normalised name: lower case, letters and digits only, without namespace.
struct Names(BTreeMap<String, usize>);

impl Names {
    fn from_skeleton(skeleton: &Skeleton) -> Self {
        let mut names = BTreeMap::new();
        for (index, joint) in skeleton.joints.iter().enumerate() {
            let bare = joint.name.rsplit([':', '|']).next().unwrap_or(&joint.name);
            let key: String =
                bare.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect();
            let digits = |rest: &str| rest.trim_start_matches(|c: char| c.is_ascii_digit()).to_owned();
            let key = key.strip_prefix(MIXAMO).map(digits).unwrap_or(key);
            names.entry(key).or_insert(index);
        }
        Self(names)
    }

    fn first(&self, candidates: &[&str]) -> Option<usize> {
        candidates.iter().find_map(|name| self.0.get(*name)).copied()
    }

    fn sided(&self, side: &str, stems: &[&str]) -> Option<usize> {
        let letter = &side[..1];
        let spellings = |stem: &&str| {
            [format!("{side}{stem}"), format!("{letter}{stem}"), format!("{stem}{side}"), format!("{stem}{letter}")]
        };
        stems.iter().flat_map(spellings).find_map(|name| self.0.get(&name).copied())
    }
}

fn named_landmarks(names: &Names) -> [Option<Site>; LANDMARKS.len()] {
    let mut landmarks = [None; LANDMARKS.len()];
    for (left, right, stems) in SIDED {
        landmarks[left as usize] = names.sided("left", stems).map(Site::Joint);
        landmarks[right as usize] = names.sided("right", stems).map(Site::Joint);
    }
    let hip = |landmark: Landmark| landmarks[landmark as usize].map(Site::joint);
    if let (Some(left), Some(right)) = (hip(Landmark::LeftHip), hip(Landmark::RightHip)) {
        landmarks[Landmark::Pelvis as usize] = Some(Site::Middle(left, right));
    }
    landmarks[Landmark::Thorax as usize] = names.first(&NECK).map(Site::Joint);
    landmarks[Landmark::HeadTop as usize] = names.first(&HEAD).map(Site::Tip);
    landmarks
}

fn parse_site(skeleton: &Skeleton, landmark: &str, site: &str) -> Result<Site, RetargetError> {
    let find = |name: &str| {
        skeleton.find(name).ok_or_else(|| RetargetError::UnknownJoint {
            landmark: landmark.into(),
            joint: name.into(),
            joints: skeleton.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    };
    if let Some(joint) = skeleton.find(site) {
        return Ok(Site::Joint(joint));
    }
    if let Some((a, b)) = site.split_once('+') {
        return Ok(Site::Middle(find(a.trim())?, find(b.trim())?));
    }
    match site.strip_suffix(":tip") {
        Some(name) => Ok(Site::Tip(find(name)?)),
        None => find(site).map(Site::Joint),
    }
}

/// cgspeed's conversions of CMU's recordings lack the thorax bone: all children of the thorax joint coincide with it
/// (0.1166 m too low for subject 1). CMU's back has three bones of nearly equal length, so the one below is used
/// instead.
fn missing_bone(clip: &Clip, thorax: usize) -> Option<(usize, Vector3<f64>)> {
    let offset = |joint: usize| clip.frames.first().map(|frame| frame[joint].translation.vector);
    let mut children = (0..clip.skeleton.joints.len()).filter(|&j| clip.skeleton.joints[j].parent == Some(thorax));
    let all_coincide = children.clone().count() > 1 && children.all(|j| offset(j).is_some_and(|o| o.norm() < 1e-6));
    offset(thorax).filter(|bone| all_coincide && bone.norm() > 1e-6).map(|bone| (thorax, bone))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mocap::SkeletonJoint;

    /// The joints of a convention: trunk, then arm and leg names spelled with each side.
    fn skeleton(trunk: &[&str], limbs: &[&str], spell: impl Fn(&str, &str) -> String) -> Skeleton {
        let sided = ["Left", "Right"].into_iter().flat_map(|side| limbs.iter().map(move |stem| (side, *stem)));
        let names = trunk.iter().map(|name| (*name).to_owned()).chain(sided.map(|(side, stem)| spell(side, stem)));
        Skeleton { joints: names.map(|name| SkeletonJoint { name, parent: None, tip: Some(Vector3::z()) }).collect() }
    }

    #[test]
    fn names_of_common_programs_give_all_landmarks() {
        let before = |text: &'static str| move |side: &str, stem: &str| format!("{text}{side}{stem}");
        let short = |side: &str| side[..1].to_ascii_lowercase();
        let biped = ["Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase"];
        let hinges = ["Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Toe"];
        let xsens = ["Shoulder", "UpperArm", "ForeArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "Toe"];
        let rokoko = ["Shoulder", "Arm", "ForeArm", "Hand", "Thigh", "Shin", "Foot", "Toe"];
        let cmu = ["clavicle", "humerus", "radius", "wrist", "femur", "tibia", "foot", "toes"];
        let unreal = ["clavicle", "upperarm", "lowerarm", "hand", "thigh", "calf", "foot", "ball"];
        let trunk = ["Hips", "Spine", "Neck", "Head"];
        let dialects = [
            ("MotionBuilder", skeleton(&trunk, &biped, before(""))),
            ("MotionBuilder with a namespace", skeleton(&trunk, &biped, before("Actor:"))),
            ("Mixamo", skeleton(&["mixamorig:Neck", "mixamorig:Head"], &biped, before("mixamorig:"))),
            ("Mixamo without colons", skeleton(&["mixamorigNeck", "mixamorigHead"], &biped, before("mixamorig"))),
            ("Mixamo's second figure", skeleton(&["mixamorig1Neck", "mixamorig1Head"], &biped, before("mixamorig1"))),
            ("Biovision, Xsens MVN", skeleton(&["Hips", "Chest", "Neck", "Head"], &hinges, before(""))),
            ("Xsens", skeleton(&["Pelvis", "L5", "Neck", "Head"], &xsens, before(""))),
            ("Rokoko", skeleton(&trunk, &rokoko, before(""))),
            ("CMU", skeleton(&["root", "upperneck", "head"], &cmu, |s, n| format!("{}{n}", short(s)))),
            ("Unreal", skeleton(&["pelvis", "neck", "head"], &unreal, |s, n| format!("{n}_{}", short(s)))),
        ];
        for (dialect, skeleton) in dialects {
            let found = named_landmarks(&Names::from_skeleton(&skeleton));
            for (landmark, site) in LANDMARKS.iter().zip(&found) {
                assert!(site.is_some(), "{dialect}: {}", landmark.name());
            }
            let shoulder = &skeleton.joints[found[Landmark::LeftShoulder as usize].unwrap().joint()].name;
            let shoulder = shoulder.to_lowercase();
            assert!(!shoulder.contains("collar") && !shoulder.contains("clavicle"), "{dialect}: {shoulder}");
        }
    }
}
