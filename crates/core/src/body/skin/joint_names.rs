//! Recognises body segments from joint names of skinned files in the conventions of common programs.

/// Landmarks at the origins of segments, without their side.
pub(super) const ORIGINS: [(&str, &str); 7] = [
    ("shoulder", "upper_arm"),
    ("elbow", "forearm"),
    ("wrist", "hand"),
    ("hip", "thigh"),
    ("knee", "shank"),
    ("ankle", "foot"),
    ("toes", "toes"),
];

/// Naming convention of a skeleton's joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Vocabulary {
    /// By the bone that begins at the joint: `LeftUpLeg`, `LeftLeg`, `LeftFoot`.
    Bones,
    /// By the joint itself: `LeftHip`, `LeftKnee`, `LeftAnkle`.
    Hinges,
}

impl Vocabulary {
    /// The convention of a skeleton: names by joint include a knee.
    pub(super) fn of<'a>(mut names: impl Iterator<Item = &'a str>) -> Self {
        let is_knee = |name: &str| matches!(parts(name), (Some(_), part) if part == "knee");
        if names.any(is_knee) { Self::Hinges } else { Self::Bones }
    }

    /// The body segment of a joint's name; `None` for fingers, tips and anything unknown.
    pub(super) fn segment(self, name: &str) -> Option<String> {
        let (side, part) = parts(name);
        let segment = match (side, part.as_str()) {
            (None, "hips" | "pelvis" | "hip") => "pelvis",
            (None, "spine" | "spine01" | "abdomen" | "lowerback" | "waist") => "abdomen",
            (None, "spine1" | "spine2" | "spine3" | "spine02" | "spine03" | "chest" | "upperchest") => "thorax",
            (None, "thorax" | "torso" | "spine001" | "spine002") => "thorax",
            (None, "neck" | "neck1" | "neck01" | "upperneck") => "neck",
            (None, "head") => "head",
            (Some(_), part) => match self {
                Self::Bones => bone(part)?,
                Self::Hinges => hinge(part)?,
            },
            _ => return None,
        };
        Some(side.map_or_else(|| segment.to_owned(), |side| format!("{side}_{segment}")))
    }
}

fn bone(part: &str) -> Option<&'static str> {
    Some(match part {
        "shoulder" | "clavicle" | "collar" => "clavicle",
        "arm" | "upperarm" | "uparm" => "upper_arm",
        "forearm" | "lowerarm" => "forearm",
        "hand" | "wrist" => "hand",
        "upleg" | "upperleg" | "thigh" => "thigh",
        "leg" | "lowerleg" | "shin" | "calf" | "shank" => "shank",
        "foot" | "ankle" => "foot",
        "toebase" | "toe" | "toes" | "ball" => "toes",
        _ => return None,
    })
}

fn hinge(part: &str) -> Option<&'static str> {
    Some(match part {
        "collar" | "clavicle" => "clavicle",
        "shoulder" => "upper_arm",
        "elbow" => "forearm",
        "wrist" => "hand",
        "hip" => "thigh",
        "knee" => "shank",
        "ankle" => "foot",
        "foot" | "toe" | "toes" | "toebase" => "toes",
        _ => return None,
    })
}

/// Side of a name, and the rest in lower case without name space, exporter prefixes and punctuation.
fn parts(name: &str) -> (Option<&'static str>, String) {
    let name = name.rsplit([':', '|']).next().unwrap_or_default().to_ascii_lowercase();
    let name = ["def-", "j_bip_c_", "j_bip_", "mixamorig_", "mixamorig", "bip01_", "bip01 "]
        .iter()
        .find_map(|prefix| name.strip_prefix(prefix))
        .unwrap_or(&name);
    let (side, rest) = side_of(name);
    (side, rest.chars().filter(char::is_ascii_alphanumeric).collect())
}

/// Side and rest of a lower-case name: `leftarm`, `l_arm`, `arm.l`, `upperarm_l`.
fn side_of(name: &str) -> (Option<&'static str>, &str) {
    for (side, letter) in [("left", 'l'), ("right", 'r')] {
        let divided = |c: char| matches!(c, '_' | '.' | '-' | ' ');
        let by_letter = || {
            let before = name.strip_prefix(letter).filter(|rest| rest.starts_with(divided));
            before.or_else(|| name.strip_suffix(letter).filter(|rest| rest.ends_with(divided)))
        };
        let rest = name.strip_prefix(side).or_else(|| name.strip_suffix(side)).or_else(by_letter);
        if let Some(rest) = rest {
            return (Some(side), rest);
        }
    }
    (None, name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_of_many_programs_are_recognised_as_segments_and_fingers_are_not() {
        for (name, segment) in [
            ("mixamorig:LeftUpLeg", "left_thigh"),
            ("mixamorig:Spine1", "thorax"),
            ("mixamorigRightHand", "right_hand"),
            ("Hips", "pelvis"),
            ("RightForeArm", "right_forearm"),
            ("upperarm_l", "left_upper_arm"),
            ("calf_r", "right_shank"),
            ("LeftToeBase", "left_toes"),
            ("Thigh.R", "right_thigh"),
            ("DEF-upper_arm.L", "left_upper_arm"),
            ("J_Bip_L_LowerLeg", "left_shank"),
            ("Bip01 R Calf", "right_shank"),
        ] {
            assert_eq!(Vocabulary::Bones.segment(name).as_deref(), Some(segment), "{name}");
        }
        for name in ["mixamorig:LeftHandIndex1", "HeadTop_End", "Camera", "", "l", "ball"] {
            assert_eq!(Vocabulary::Bones.segment(name), None, "{name}");
        }
    }

    #[test]
    fn a_skeleton_with_knees_is_named_by_its_joints() {
        let smpl = ["Pelvis", "L_Hip", "L_Knee", "L_Ankle", "L_Foot", "L_Shoulder", "L_Elbow", "L_Wrist", "L_Hand"];
        let vocabulary = Vocabulary::of(smpl.into_iter());
        assert_eq!(vocabulary, Vocabulary::Hinges);
        let found: Vec<Option<String>> = smpl.iter().map(|name| vocabulary.segment(name)).collect();
        let expected = ["pelvis", "thigh", "shank", "foot", "toes", "upper_arm", "forearm", "hand"];
        for (found, expected) in found.iter().zip(expected) {
            assert!(found.as_ref().is_some_and(|found| found.ends_with(expected)), "{found:?}, {expected}");
        }
        assert_eq!(found[8], None);
        assert_eq!(Vocabulary::of(["LeftUpLeg", "LeftLeg"].into_iter()), Vocabulary::Bones);
    }
}
