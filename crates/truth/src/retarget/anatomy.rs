//! Landmarks and segments of the body on a recorded skeleton.
//!
//! They are found in the tree of joints ([`human_tree`]) or named by the user. The pelvis is the midpoint of the hips.
//! Trunk joints follow from the hierarchy: the pelvis rotates with the lowest common ancestor of both hips, the thorax
//! with that of both shoulders. A missing crown or neck is placed by proportion, fixed to the joint of head or chest.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::RetargetError;
use crate::mocap::{Clip, PosedTree, Skeleton};
use skiagraph_core::body::human_tree::{self, HumanTree, JointTree, NECK_TO_CROWN, role_of};
use skiagraph_core::body::{LANDMARKS, Landmark, Markers};
use skiagraph_core::input::{excerpt, plain};

/// Names of joints below the wrist that turn with the whole hand, best first.
const HANDS: [&str; 2] = ["fingerbase", "hand"];

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
    /// Fixed to a joint, metres in its frame.
    Beside(usize, Vector3<f64>),
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
    /// What was invented, and unusual proportions.
    notes: Vec<String>,
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
    /// Finds the landmarks of a clip. `overrides` maps landmark names to `Joint`, `Joint:tip` or `Joint+Joint` (the
    /// midpoint); the others are found in accordance with them.
    pub(super) fn from_clip(clip: &Clip, overrides: &BTreeMap<String, String>) -> Result<Self, RetargetError> {
        let mut given = [None; LANDMARKS.len()];
        for (landmark, site) in overrides {
            let index =
                LANDMARKS.iter().position(|l| l.name() == landmark).ok_or_else(|| unknown_landmark(landmark))?;
            given[index] = Some(parse_site(&clip.skeleton, landmark, site)?);
        }
        let search = Search::new(clip, &given);
        let found = human_tree::find(&search.tree);
        let mut notes = Vec::new();
        let mut landmarks = match &found {
            Ok(body) => search.landmarks(body, &given, &mut notes),
            Err(_) => [None; LANDMARKS.len()],
        };
        for (landmark, site) in landmarks.iter_mut().zip(given) {
            *landmark = site.or(*landmark);
        }
        let missing: Vec<&str> =
            LANDMARKS.iter().zip(&landmarks).filter(|(_, site)| site.is_none()).map(|(l, _)| l.name()).collect();
        if !missing.is_empty() {
            let why = found.err().unwrap_or_else(|| "parts are missing".to_owned());
            return Err(missing_landmarks(&clip.skeleton, &why, &missing));
        }
        let joint_of = |landmark: Landmark| landmarks[landmark as usize].map(Site::joint);
        let ancestor = |a, b| common_ancestor(&clip.skeleton, joint_of(a)?, joint_of(b)?);
        let ankles = [joint_of(Landmark::LeftAnkle), joint_of(Landmark::RightAnkle)];
        let wrists = [joint_of(Landmark::LeftWrist), joint_of(Landmark::RightWrist)];
        let hands = wrists.map(|wrist| wrist.map(|wrist| hand_below(&clip.skeleton, wrist)));
        let thorax = ancestor(Landmark::LeftShoulder, Landmark::RightShoulder);
        let toes = found.as_ref().map_or([None; 2], |body| body.toes.map(|toes| toes.map(|toes| search.site(toes))));
        let toe_joint = |side: usize| toes[side].filter(|site| matches!(site, Site::Joint(_))).map(Site::joint);
        // a crown is a joint of its own in some files, and then it may not turn
        let head = match (given[Landmark::HeadTop as usize], &found) {
            (None, Ok(body)) => body.head.head,
            _ => joint_of(Landmark::HeadTop),
        };
        let segments = [
            ancestor(Landmark::LeftHip, Landmark::RightHip),
            thorax,
            head,
            hands[0],
            hands[1],
            ankles[0],
            ankles[1],
            toe_joint(0),
            toe_joint(1),
        ];
        let gap = thorax.zip(found.as_ref().ok()).and_then(|(joint, body)| search.missing_bone(clip, joint, body));
        notes.extend(found.iter().filter_map(proportion_note).filter(|_| gap.is_none()));
        Ok(Self {
            toes,
            gap,
            landmarks,
            segments,
            skeleton_parents: clip.skeleton.joints.iter().map(|j| j.parent).collect(),
            notes,
        })
    }

    /// What was invented, and which proportions are unusual.
    pub(super) fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The landmarks as `joint_map` takes them. What is placed by proportion is not in it.
    pub(super) fn joint_map(&self, skeleton: &Skeleton) -> BTreeMap<String, String> {
        let mut map = BTreeMap::new();
        for (landmark, site) in LANDMARKS.iter().zip(&self.landmarks) {
            let name = |joint: usize| &skeleton.joints[joint].name;
            let text = match *site {
                Some(Site::Joint(joint)) => name(joint).clone(),
                Some(Site::Tip(joint)) => format!("{}:tip", name(joint)),
                Some(Site::Middle(a, b)) => format!("{}+{}", name(a), name(b)),
                Some(Site::Beside(..)) | None => continue,
            };
            map.insert(landmark.name().to_owned(), text);
        }
        map
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
            Site::Beside(joint, offset) => frames[joint] * Point3::from(offset),
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
            Self::Joint(joint) | Self::Tip(joint) | Self::Middle(joint, _) | Self::Beside(joint, _) => joint,
        }
    }
}

/// The lowest common ancestor of `a` and `b`.
fn common_ancestor(skeleton: &Skeleton, a: usize, b: usize) -> Option<usize> {
    let chain = |from: usize| std::iter::successors(Some(from), |&j| skeleton.joints[j].parent);
    chain(a).find(|&joint| chain(b).any(|other| other == joint))
}

/// The joint that turns with the hand: the wrist's, or one below it by name.
fn hand_below(skeleton: &Skeleton, wrist: usize) -> usize {
    let mut below = vec![wrist];
    for (joint, own) in skeleton.joints.iter().enumerate().skip(wrist + 1) {
        if own.parent.is_some_and(|parent| below.contains(&parent)) {
            below.push(joint);
        }
    }
    for name in HANDS {
        for &joint in &below {
            if human_tree::key(&skeleton.joints[joint].name).ends_with(name) {
                return joint;
            }
        }
    }
    wrist
}

fn proportion_note(body: &HumanTree) -> Option<String> {
    (!body.unusual.is_empty()).then(|| {
        format!("unusual proportions: {}; `inspect` prints the joint_map that was found", body.unusual.join(", "))
    })
}

/// A clip as the tree in which a body is looked for: its joints, and the ends of their bones.
struct Search<'a> {
    tree: JointTree<'a>,
    /// The joint whose tip each node after the joints is.
    tips: Vec<usize>,
    joints: usize,
    /// Frames of all joints in each of the tree's poses.
    frames: Vec<Vec<Isometry3<f64>>>,
}

impl<'a> Search<'a> {
    fn new(clip: &'a Clip, given: &[Option<Site>; LANDMARKS.len()]) -> Self {
        let PosedTree { tree, tips, frames } = clip.joint_tree();
        let mut search = Self { tree, tips, joints: clip.skeleton.joints.len(), frames };
        for (landmark, site) in LANDMARKS.iter().zip(given) {
            let node = match site {
                Some(Site::Joint(joint)) => Some(*joint),
                Some(Site::Tip(joint)) => {
                    search.tips.iter().position(|tip| tip == joint).map(|tip| search.joints + tip)
                }
                _ => None,
            };
            if let (Some(node), Some((role, is_left))) = (node, role_of(*landmark)) {
                search.tree.pins.push((node, role, is_left));
            }
        }
        search
    }

    /// The position of a node of the tree.
    fn site(&self, node: usize) -> Site {
        if node < self.joints { Site::Joint(node) } else { Site::Tip(self.tips[node - self.joints]) }
    }

    fn landmarks(
        &self,
        body: &HumanTree,
        given: &[Option<Site>; LANDMARKS.len()],
        notes: &mut Vec<String>,
    ) -> [Option<Site>; LANDMARKS.len()] {
        use Landmark as L;
        let mut landmarks = [None; LANDMARKS.len()];
        let limbs = [
            (body.legs[0], [L::LeftHip, L::LeftKnee, L::LeftAnkle]),
            (body.legs[1], [L::RightHip, L::RightKnee, L::RightAnkle]),
            (body.arms[0], [L::LeftShoulder, L::LeftElbow, L::LeftWrist]),
            (body.arms[1], [L::RightShoulder, L::RightElbow, L::RightWrist]),
        ];
        for (limb, places) in limbs {
            for (joint, landmark) in limb.into_iter().zip(places) {
                landmarks[landmark as usize] = Some(self.site(joint));
            }
        }
        landmarks[L::Pelvis as usize] = Some(Site::Middle(body.legs[0][0], body.legs[1][0]));
        landmarks[L::Thorax as usize] = body.head.neck.map(|neck| self.site(neck));
        landmarks[L::HeadTop as usize] = body.head.crown.map(|crown| self.site(crown));
        if landmarks[L::Thorax as usize].or(given[L::Thorax as usize]).is_none() {
            landmarks[L::Thorax as usize] = Some(self.fixed_to(body.chest, |pose| neck_by_proportion(body, pose)));
            notes.push("the recording has no joint at the base of the neck: placed by proportion".to_owned());
        }
        if landmarks[L::HeadTop as usize].or(given[L::HeadTop as usize]).is_none() {
            landmarks[L::HeadTop as usize] = Some(self.crown_by_proportion(body));
            notes.push(format!(
                "the recording has no point at the top of the head: placed {:.2} m from the neck by proportion",
                NECK_TO_CROWN * body.stature
            ));
        }
        if !body.are_sides_named {
            notes.push("left and right are told by where the feet point, because no names say them".to_owned());
        }
        landmarks
    }

    /// A position that is given in every pose, fixed to a joint: the mean in its frame.
    fn fixed_to(&self, joint: usize, place: impl Fn(&[Point3<f64>]) -> Point3<f64>) -> Site {
        let mut sum = Vector3::zeros();
        for (frames, pose) in self.frames.iter().zip(&self.tree.poses) {
            sum += frames[joint].inverse_transform_point(&place(pose)).coords / self.frames.len() as f64;
        }
        Site::Beside(joint, sum)
    }

    /// The crown in the direction from the hips to the head, on average over the poses.
    fn crown_by_proportion(&self, body: &HumanTree) -> Site {
        self.fixed_to(body.head.head.unwrap_or(body.chest), |pose| {
            let [shoulders, hips] =
                [body.arms, body.legs].map(|pair| nalgebra::center(&pose[pair[0][0]], &pose[pair[1][0]]));
            let base = body.head.head.map_or(shoulders, |head| pose[head]);
            let neck = body.head.neck.map_or_else(|| neck_by_proportion(body, pose), |neck| pose[neck]);
            let above = (NECK_TO_CROWN * body.stature - (base - neck).norm()).max(LEAST_SKULL * body.stature);
            base + (base - hips).normalize() * above
        })
    }

    /// cgspeed's conversions of CMU's recordings lack the thorax bone: all children of the thorax joint coincide with
    /// it (0.1166 m too low for subject 1). CMU's back has three bones of nearly equal length, so the one below is used
    /// instead, if the trunk is too short without it.
    fn missing_bone(&self, clip: &Clip, thorax: usize, body: &HumanTree) -> Option<(usize, Vector3<f64>)> {
        let offset = |joint: usize| clip.frames.first().map(|frame| frame[joint].translation.vector);
        let mut children = (0..clip.skeleton.joints.len()).filter(|&j| clip.skeleton.joints[j].parent == Some(thorax));
        let all_coincide = children.clone().count() > 1 && children.all(|j| offset(j).is_some_and(|o| o.norm() < 1e-6));
        let bone = offset(thorax).filter(|bone| all_coincide && bone.norm() > 1e-6)?;
        let trunk = body.trunk_to_leg * body.leg_length;
        // a back of more bones has shorter ones, and lacks none
        let is_of_three = bone.norm() > LEAST_OF_BACK * trunk;
        (is_of_three && trunk + bone.norm() < LONGEST_TRUNK * body.leg_length).then_some((thorax, bone))
    }
}

/// The base of the neck on the way from the shoulders to the head's joint, or up from the shoulders.
fn neck_by_proportion(body: &HumanTree, pose: &[Point3<f64>]) -> Point3<f64> {
    let [shoulders, hips] = [body.arms, body.legs].map(|pair| nalgebra::center(&pose[pair[0][0]], &pose[pair[1][0]]));
    match body.head.head {
        Some(head) => shoulders + (pose[head] - shoulders) * NECK_SHARE,
        None => shoulders + (shoulders - hips).normalize() * (NECK_ABOVE_SHOULDERS * body.stature),
    }
}

/// The base of the neck on the way from the middle of the shoulders to the joint below the head.
const NECK_SHARE: f64 = 0.3;
/// Height of the base of the neck above the shoulders, share of the stature.
const NECK_ABOVE_SHOULDERS: f64 = 0.023;
/// Least distance from the head's joint to the crown, share of the stature.
const LEAST_SKULL: f64 = 0.07;
/// Trunk over leg of adults with a long trunk: a bone that makes it longer is not missing.
const LONGEST_TRUNK: f64 = 0.7;
/// Least length of the bone below the thorax in a back of three bones, one of which is missing, share of the trunk.
const LEAST_OF_BACK: f64 = 0.2;

/// Maximum number of characters in a list of joints.
const MAX_LISTED_CHARS: usize = 2000;

fn joint_names(skeleton: &Skeleton) -> String {
    skeleton.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", ")
}

fn unknown_landmark(landmark: &str) -> RetargetError {
    let known = LANDMARKS.map(Landmark::name).join(", ");
    RetargetError::Refused(format!("`{}` is not a landmark; landmarks are: {known}", excerpt(landmark)))
}

/// The error with a `joint_map` to be pasted and filled in.
fn missing_landmarks(skeleton: &Skeleton, why: &str, missing: &[&str]) -> RetargetError {
    let map: Vec<String> = missing.iter().map(|landmark| format!("{landmark} = \"\"")).collect();
    RetargetError::Refused(format!(
        "no human body is found in the recording: {why}; not found: {}; set them in `joint_map` of `[motion]` (\"Joint\", \
         \"Joint:tip\" or \"Joint+Joint\"): joint_map = {{ {} }}; its joints are: {}",
        missing.join(", "),
        map.join(", "),
        plain(joint_names(skeleton).chars().take(MAX_LISTED_CHARS).collect::<String>())
    ))
}

fn parse_site(skeleton: &Skeleton, landmark: &str, site: &str) -> Result<Site, RetargetError> {
    let unknown = |joint: &str| {
        let (landmark, joint, joints) = (excerpt(landmark), excerpt(joint), excerpt(&joint_names(skeleton)));
        let problem = format!("the recording has no joint `{joint}`; its joints are: {joints}");
        RetargetError::Refused(format!("landmark `{landmark}`: {problem}"))
    };
    let find = |name: &str| skeleton.find(name).ok_or_else(|| unknown(name));
    if let Some(joint) = skeleton.find(site) {
        return Ok(Site::Joint(joint));
    }
    if let Some((a, b)) = site.split_once('+') {
        return Ok(Site::Middle(find(a.trim())?, find(b.trim())?));
    }
    match site.strip_suffix(":tip") {
        Some(name) => {
            let joint = find(name)?;
            // without an end the tip is the joint itself: a forearm of no length
            skeleton.joints[joint].tip.map(|_| Site::Tip(joint)).ok_or_else(|| unknown(site))
        }
        None => find(site).map(Site::Joint),
    }
}

#[cfg(test)]
mod tests;
