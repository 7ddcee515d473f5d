//! Names of the keypoints of common datasets and programs, and the HumanEva markers at these keypoints.

use skiagraph_core::body::{LANDMARKS, Landmark};

/// A keypoint's [`canonical`] name, and the marker at this place.
type NamedPoint = (&'static str, Option<Landmark>);

#[derive(Debug)]
pub(super) struct NamedLayout {
    /// Its usual name.
    pub(super) name: &'static str,
    parts: &'static [&'static [NamedPoint]],
}

use Landmark::{
    HeadTop, LeftAnkle, LeftElbow, LeftHip, LeftKnee, LeftShoulder, LeftWrist, Pelvis, RightAnkle, RightElbow,
    RightHip, RightKnee, RightShoulder, RightWrist, Thorax,
};

const LIMBS: &[NamedPoint] = &[
    ("leftshoulder", Some(LeftShoulder)),
    ("rightshoulder", Some(RightShoulder)),
    ("leftelbow", Some(LeftElbow)),
    ("rightelbow", Some(RightElbow)),
    ("leftwrist", Some(LeftWrist)),
    ("rightwrist", Some(RightWrist)),
    ("lefthip", Some(LeftHip)),
    ("righthip", Some(RightHip)),
    ("leftknee", Some(LeftKnee)),
    ("rightknee", Some(RightKnee)),
];
const ANKLES: &[NamedPoint] = &[("leftankle", Some(LeftAnkle)), ("rightankle", Some(RightAnkle))];
const FACE: &[NamedPoint] =
    &[("nose", None), ("lefteye", None), ("righteye", None), ("leftear", None), ("rightear", None)];
const FEET: &[NamedPoint] = &[
    ("leftbigtoe", None),
    ("rightbigtoe", None),
    ("leftsmalltoe", None),
    ("rightsmalltoe", None),
    ("leftheel", None),
    ("rightheel", None),
];
const SMPL_TRUNK: &[NamedPoint] = &[
    ("pelvis", Some(Pelvis)),
    ("spine1", None),
    ("spine2", None),
    ("spine3", None),
    ("leftfoot", None),
    ("rightfoot", None),
    ("neck", Some(Thorax)),
    ("leftcollar", None),
    ("rightcollar", None),
    ("head", None),
    ("lefthand", None),
    ("righthand", None),
];
const HUMAN36M_TRUNK: &[NamedPoint] = &[
    ("leftfoot", Some(LeftAnkle)),
    ("rightfoot", Some(RightAnkle)),
    ("hip", Some(Pelvis)),
    ("spine", None),
    ("thorax", Some(Thorax)),
    ("neck", None),
    ("neckbase", None),
    ("necknose", None),
    ("nose", None),
    ("head", Some(HeadTop)),
];
const HALPE_TRUNK: &[NamedPoint] =
    &[("head", Some(HeadTop)), ("neck", Some(Thorax)), ("hip", Some(Pelvis)), ("midhip", Some(Pelvis))];
const BODY25_TRUNK: &[NamedPoint] = &[("neck", Some(Thorax)), ("midhip", Some(Pelvis))];
const HUMANEVA_TRUNK: &[NamedPoint] = &[("pelvis", Some(Pelvis)), ("thorax", Some(Thorax)), ("headtop", Some(HeadTop))];

/// The head of Human3.6M and HALPE is its top; that of SMPL is its joint with the neck, where no marker is.
static LAYOUTS: [NamedLayout; 6] = [
    NamedLayout { name: "COCO-17", parts: &[LIMBS, ANKLES, FACE] },
    NamedLayout { name: "HALPE-26", parts: &[LIMBS, ANKLES, FACE, HALPE_TRUNK, FEET] },
    NamedLayout { name: "BODY-25", parts: &[LIMBS, ANKLES, FACE, BODY25_TRUNK, FEET] },
    NamedLayout { name: "Human3.6M", parts: &[LIMBS, HUMAN36M_TRUNK] },
    NamedLayout { name: "SMPL", parts: &[LIMBS, ANKLES, SMPL_TRUNK] },
    // the markers' own names, in another spelling
    NamedLayout { name: "HumanEva", parts: &[LIMBS, ANKLES, HUMANEVA_TRUNK] },
];

impl NamedLayout {
    /// The marker of a keypoint: `None` if the layout has no such keypoint, `Some(None)` if no marker is there.
    pub(super) fn marker(&self, name: &str) -> Option<Option<Landmark>> {
        let name = canonical(name);
        self.parts.iter().copied().flatten().find(|(known, _)| *known == name).map(|(_, marker)| *marker)
    }

    fn size(&self) -> usize {
        self.parts.iter().map(|part| part.len()).sum()
    }
}

/// The smallest layout that has all these names; `None` unless they are more than half of its keypoints.
pub(super) fn layout_of(names: &[&str]) -> Option<&'static NamedLayout> {
    let has_all = |layout: &&NamedLayout| names.iter().all(|name| layout.marker(name).is_some());
    let is_most = |layout: &&NamedLayout| 2 * names.len() > layout.size();
    LAYOUTS.iter().filter(has_all).filter(is_most).min_by_key(|layout| layout.size())
}

/// Names beside those of a layout that are probably misspelt, at most.
const MOST_STRANGERS: usize = 2;

/// The layout that has all these names but one or two, and those; `None` if the names are not mostly a layout's.
pub(super) fn nearly_a_layout<'n>(names: &[&'n str]) -> Option<(&'static str, Vec<&'n str>)> {
    let strangers = |layout: &'static NamedLayout| {
        let unknown: Vec<&str> = names.iter().copied().filter(|name| layout.marker(name).is_none()).collect();
        let is_most = 2 * (names.len() - unknown.len()) > layout.size();
        ((1..=MOST_STRANGERS).contains(&unknown.len()) && is_most).then_some((layout.name, unknown))
    };
    // the names of the set's own markers, misspelt, are nearer to these
    let misspelt = names.iter().filter(|name| LANDMARKS.iter().all(|own| own.name() != **name)).count();
    let nearest = LAYOUTS.iter().filter_map(strangers).min_by_key(|(_, unknown)| unknown.len());
    nearest.filter(|(_, unknown)| unknown.len() < misspelt)
}

/// The names of all layouts but that of the markers themselves, for messages.
pub(super) fn layout_names() -> String {
    LAYOUTS.iter().map(|layout| layout.name).filter(|name| *name != "HumanEva").collect::<Vec<_>>().join(", ")
}

/// A name in lower case, only letters and digits, with `left` or `right` in front: `L_Knee`, `LKnee`, `knee_l` and
/// `LeftKnee` are `leftknee`.
fn canonical(name: &str) -> String {
    const PARTS: [&str; 16] = [
        "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "eye", "ear", "bigtoe", "smalltoe", "heel", "foot",
        "collar", "hand", "upleg", "toe",
    ];
    let plain: String = name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    // Pose2Sim's name
    if plain == "chip" {
        return "midhip".to_owned();
    }
    let sides = [('l', "left"), ('r', "right")];
    for (letter, side) in sides {
        let around = [plain.strip_prefix(letter), plain.strip_suffix(letter), plain.strip_suffix(side)];
        if let Some(part) = around.into_iter().flatten().find(|part| PARTS.contains(part)) {
            return format!("{side}{part}");
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(names: &str) -> Option<&'static str> {
        layout_of(&names.split_whitespace().collect::<Vec<_>>()).map(|layout| layout.name)
    }

    #[test]
    fn all_spellings_of_sides_are_recognised() {
        for name in ["left_knee", "LKnee", "L_Knee", "knee_l", "LeftKnee", "kneeLeft", "l.knee"] {
            assert_eq!(canonical(name), "leftknee", "{name}");
        }
        assert_eq!(["Ear", "Heel", "REar", "RHeel"].map(canonical), ["ear", "heel", "rightear", "rightheel"]);
    }

    #[test]
    fn layouts_are_distinguished_by_all_their_names() {
        let limbs = "LShoulder RShoulder LElbow RElbow LWrist RWrist LHip RHip LKnee RKnee";
        let face = "Nose LEye REye LEar REar";
        let feet = "LBigToe RBigToe LSmallToe RSmallToe LHeel RHeel";
        assert_eq!(found(&format!("{limbs} {face} LAnkle RAnkle")), Some("COCO-17"));
        assert_eq!(found(&format!("{limbs} {face} {feet} LAnkle RAnkle Head Neck Hip")), Some("HALPE-26"));
        assert_eq!(found(&format!("{limbs} {face} {feet} LAnkle RAnkle Neck MidHip")), Some("BODY-25"));
        assert_eq!(found(&format!("{limbs} {feet} LAnkle RAnkle Nose Neck CHip")), Some("BODY-25"), "of Pose2Sim");
        assert_eq!(found(&format!("{limbs} LFoot RFoot Hip Spine Thorax Neck/Nose Head")), Some("Human3.6M"));
        let trunk = "Pelvis Spine1 Spine2 Spine3 Neck Head L_Collar R_Collar L_Foot R_Foot L_Hand R_Hand";
        assert_eq!(found(&format!("{limbs} L_Ankle R_Ankle {trunk}")), Some("SMPL"));
        assert_eq!(found(&format!("{limbs} LAnkle RAnkle Pelvis THORAX HeadTop")), Some("HumanEva"));
        assert_eq!(found(&format!("{limbs} tail")), None);
        assert_eq!(found("LKnee"), None);
    }

    #[test]
    fn a_stranger_among_the_names_of_a_layout_is_named() {
        let names =
            "nose leye reye lear rear lshoulder rshoulder lelbow relbow lwrst rwrist lhip rhip lknee rknee lankle";
        let found = |names: &str| nearly_a_layout(&names.split_whitespace().collect::<Vec<_>>()).map(|(name, _)| name);
        let names_and = |more: &str| format!("{names} {more}");
        let split: Vec<&str> = names.split_whitespace().collect();
        assert_eq!(nearly_a_layout(&split), Some(("COCO-17", vec!["lwrst"])));
        assert_eq!(found(&names_and("tail")), Some("COCO-17"));
        assert_eq!(found(&names_and("tail mane hoof")), None);
        assert_eq!(found("pelvis left_kne"), None);
        // `headtop` was said to be a stranger among the names of SMPL
        let own = LANDMARKS.map(|own| if own.name() == "head_top" { "headtop" } else { own.name() });
        assert_eq!(nearly_a_layout(&own), None);
    }

    #[test]
    fn a_foot_is_an_ankle_in_one_layout_and_not_in_another() {
        let of = |layout: usize, name: &str| LAYOUTS[layout].marker(name);
        assert_eq!(of(3, "LFoot"), Some(Some(Landmark::LeftAnkle)));
        assert_eq!(of(4, "left_foot"), Some(None));
        assert_eq!(of(0, "LFoot"), None);
    }
}
