//! What the name of a joint says about its place in a body. Names only break ties and tell left from right.

use crate::body::Landmark;

/// A joint's place in a limb or in the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The upper joint of a leg.
    Hip,
    /// The middle joint of a leg.
    Knee,
    /// The lower joint of a leg.
    Ankle,
    /// The joint or end at the ball of the foot.
    Toes,
    /// The upper joint of an arm.
    Shoulder,
    /// The middle joint of an arm.
    Elbow,
    /// The lower joint of an arm.
    Wrist,
    /// The base of the neck.
    Neck,
    /// The joint between neck and head.
    Head,
    /// Fingers, faces, ends and joints of twist.
    Detail,
}

/// Parts of names. The longest part that a name contains decides; of equally long ones, the first.
const STEMS: [(Role, &[&str]); 10] = [
    (
        Role::Detail,
        &[
            "thumb", "index", "middle", "ring", "pinky", "finger", "twist", "headtop", "headend", "headnub", "jaw",
            "eye", "heel", "clavicle", "collar", "tail", "hair", "ponytail", "breast",
        ],
    ),
    (Role::Hip, &["hip", "thigh", "upleg", "upperleg", "legupper", "femur"]),
    (Role::Knee, &["knee", "leg", "shin", "calf", "loleg", "lowleg", "lowerleg", "leglower", "shank", "tibia"]),
    (Role::Ankle, &["ankle", "foot"]),
    (Role::Toes, &["toe", "ball"]),
    (Role::Shoulder, &["shoulder", "shldr", "arm", "uarm", "uparm", "upperarm", "armupper", "humerus"]),
    (Role::Elbow, &["elbow", "farm", "forearm", "loarm", "lowarm", "lowerarm", "armlower", "radius"]),
    (Role::Wrist, &["wrist", "hand"]),
    (Role::Neck, &["neck"]),
    (Role::Head, &["head"]),
];

/// Initial letters of the words for left and right: English and German, French, Spanish, Italian, Chinese and Japanese.
const SIDES: [(char, char); 6] = [('l', 'r'), ('g', 'd'), ('i', 'd'), ('s', 'd'), ('左', '右'), ('좌', '우')];

/// A name in lower case, without namespace, punctuation and numbers before it.
pub fn key(name: &str) -> String {
    let own = name.rsplit([':', '|']).next().unwrap_or(name);
    own.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// What a landmark is in the tree, and whether it is a left one.
pub fn role_of(landmark: Landmark) -> Option<(Role, Option<bool>)> {
    use Landmark as L;
    let role = match landmark {
        L::LeftShoulder | L::RightShoulder => Role::Shoulder,
        L::LeftElbow | L::RightElbow => Role::Elbow,
        L::LeftWrist | L::RightWrist => Role::Wrist,
        L::LeftHip | L::RightHip => Role::Hip,
        L::LeftKnee | L::RightKnee => Role::Knee,
        L::LeftAnkle | L::RightAnkle => Role::Ankle,
        L::Thorax => Role::Neck,
        L::Pelvis | L::HeadTop => return None,
    };
    Some((role, landmark.is_on_limb().then(|| landmark.name().starts_with("left"))))
}

pub(super) fn role(name: &str) -> Option<Role> {
    let key = key(name);
    let mut best: Option<(usize, Role)> = None;
    for (role, stems) in STEMS {
        for stem in stems {
            if key.contains(stem) && best.is_none_or(|(length, _)| stem.len() > length) {
                best = Some((stem.len(), role));
            }
        }
    }
    best.map(|(_, role)| role)
}

/// Whether a name is that of a joint of the body, not of the bone that begins there.
pub(super) fn is_hinge(name: &str) -> bool {
    let key = key(name);
    ["knee", "ankle", "elbow", "wrist"].iter().any(|hinge| key.contains(hinge))
}

pub(super) fn is_crown(name: &str) -> bool {
    let key = key(name);
    ["headtop", "headend", "headnub", "topofhead"].iter().any(|top| key.contains(top))
}

pub(super) fn is_of_face(name: &str) -> bool {
    let key = key(name);
    ["jaw", "eye", "brow", "chin", "mouth", "lip", "nose", "tongue", "hair"].iter().any(|part| key.contains(part))
}

/// Whether `a` is the left one of two joints whose names differ in a word for their side, from where they differ.
pub(super) fn is_left_of(a: &str, b: &str) -> Option<bool> {
    let (a, b): (Vec<char>, Vec<char>) = (a.to_lowercase().chars().collect(), b.to_lowercase().chars().collect());
    let same = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let (a, b) = (*a.get(same)?, *b.get(same)?);
    for (left, right) in SIDES {
        if (a, b) == (left, right) || (b, a) == (left, right) {
            return Some(a == left);
        }
    }
    None
}
