//! Side and body part from the name of a link or joint.
//!
//! Names are split into words (`l_hip_yaw_link`, `LeftUpLeg`, `LARM_LINK1`, `upperleg01.L`, `mixamorig:RightFoot`); a
//! side may be a separate word, a prefix or a suffix.

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BodySide {
    Left,
    Right,
}

/// A part of the body. A joint and the link that it moves are one part: the knee is the shank's joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BodyPart {
    Hip,
    Knee,
    Ankle,
    Toe,
    /// Any part of a leg.
    Leg,
    Clavicle,
    Shoulder,
    Elbow,
    Wrist,
    Finger,
    /// Any part of an arm.
    Arm,
    Neck,
    Head,
}

/// Words of sided parts, including those of Atlas's joints (`l_leg_kny`).
const SIDED: [(BodyPart, &[&str]); 10] = [
    (BodyPart::Hip, &["hip", "thigh", "femur", "upleg", "upperleg", "uleg", "hpx", "hpy", "hpz"]),
    (BodyPart::Knee, &["knee", "shin", "calf", "tibia", "shank", "lowleg", "lowerleg", "lleg", "kny"]),
    (BodyPart::Ankle, &["ankle", "foot", "aky", "akx"]),
    (BodyPart::Toe, &["toe", "toes", "toebase", "ball"]),
    (BodyPart::Leg, &["leg"]),
    (BodyPart::Clavicle, &["clavicle", "clav", "collar", "scapula", "scap", "thorax"]),
    (BodyPart::Shoulder, &["shoulder", "uparm", "upperarm", "uarm", "humerus", "bicep", "shx", "shz"]),
    (BodyPart::Elbow, &["elbow", "forearm", "farm", "lowarm", "lowerarm", "larm", "radius", "ulna", "ely", "elx"]),
    (BodyPart::Wrist, &["wrist", "hand", "palm", "wrx", "wry"]),
    (BodyPart::Arm, &["arm"]),
];
/// Words for fingers; in combination with one of them, a hand's name means a finger.
const FINGERS: [&str; 10] =
    ["finger", "fingers", "thumb", "index", "middle", "ring", "pinky", "little", "gripper", "knuckle"];
/// Words for frames that carry no information about the body.
const FRAMES: [&str; 10] = ["imu", "sensor", "ft", "camera", "lidar", "skin", "com", "hokuyo", "eye", "jaw"];
/// Words that may be suffixes of others.
const ENDINGS: [&str; 3] = ["joint", "link", "body"];
/// Words that are joined with the next.
const BEFORE: [&str; 5] = ["upper", "up", "lower", "low", "fore"];

/// The side and part in a name, if present. Parts of a limb need a side.
pub(super) fn side_and_part(name: &str) -> (Option<BodySide>, Option<BodyPart>) {
    let words = words(name);
    if words.iter().any(|w| FRAMES.contains(&w.as_str())) {
        return (None, None);
    }
    let stated = words.iter().find_map(|w| side(w));
    let joined = joined(&words);
    if let Some(side) = stated {
        if joined.iter().any(|w| FINGERS.contains(&w.as_str())) {
            return (Some(side), Some(BodyPart::Finger));
        }
        return (Some(side), part(&joined));
    }
    if let Some(found) = joined.iter().find_map(|word| split_compound(word)) {
        return (Some(found.0), Some(found.1));
    }
    let has =
        |known: &str| joined.iter().any(|w| w.as_str() == known || ENDINGS.iter().any(|e| *w == format!("{known}{e}")));
    let middle = [("head", BodyPart::Head), ("skull", BodyPart::Head), ("neck", BodyPart::Neck)];
    (None, middle.into_iter().find(|(word, _)| has(word)).map(|(_, part)| part))
}

fn side(word: &str) -> Option<BodySide> {
    match word {
        "left" | "l" => Some(BodySide::Left),
        "right" | "r" => Some(BodySide::Right),
        _ => None,
    }
}

/// The part of the most specific word; the name of a whole limb is used only if there is no other.
fn part(words: &[String]) -> Option<BodyPart> {
    let known = |word: &String| {
        let bare = ENDINGS.iter().find_map(|e| word.strip_suffix(e)).filter(|w| !w.is_empty()).unwrap_or(word);
        SIDED.iter().find(|(_, known)| known.contains(&bare)).map(|(part, _)| *part)
    };
    let found: Vec<BodyPart> = words.iter().filter_map(known).collect();
    let is_whole = |part: &&BodyPart| matches!(part, BodyPart::Leg | BodyPart::Arm);
    found.iter().find(|p| !is_whole(p)).or(found.first()).copied()
}

/// Side and part of a compound word such as `lfoot`, `rarm` or `leftknee`.
fn split_compound(word: &str) -> Option<(BodySide, BodyPart)> {
    let prefixes =
        [("left", BodySide::Left), ("right", BodySide::Right), ("l", BodySide::Left), ("r", BodySide::Right)];
    prefixes.into_iter().find_map(|(prefix, side)| {
        let rest = word.strip_prefix(prefix)?.to_owned();
        let part = if FINGERS.contains(&rest.as_str()) { BodyPart::Finger } else { part(&[rest])? };
        Some((side, part))
    })
}

/// Lower-case words of a name: split at anything but letters, and before capitals that begin a word.
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words: Vec<String> = vec![String::new()];
    for (i, letter) in letters.iter().enumerate() {
        if !letter.is_ascii_alphabetic() {
            words.push(String::new());
            continue;
        }
        let follows_small = i > 0 && letters[i - 1].is_ascii_lowercase();
        let precedes_small = i > 0 && letters.get(i + 1).is_some_and(char::is_ascii_lowercase);
        if letter.is_ascii_uppercase() && (follows_small || precedes_small) {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.push(letter.to_ascii_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Words, with `upper`, `lower` and `fore` joined with the next.
fn joined(words: &[String]) -> Vec<String> {
    let mut joined: Vec<String> = Vec::with_capacity(words.len());
    for (i, word) in words.iter().enumerate() {
        if i > 0 && BEFORE.contains(&words[i - 1].as_str()) && ["leg", "arm"].contains(&word.as_str()) {
            joined.pop();
            joined.push(format!("{}{word}", words[i - 1]));
        } else {
            joined.push(word.clone());
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_robots_give_side_and_part() {
        use BodyPart::*;
        let sided: [(BodyPart, &[&str]); 12] = [
            (Hip, &["l_hip_yaw_link", "LeftUpLeg", "mixamorig:LeftUpLeg", "LeftUpperLeg_f1", "leftHipYawLink"]),
            (Hip, &["l_uleg", "LHipYawPitch", "upperleg01.L", "lfemur", "L_Hip"]),
            (Knee, &["l_leg_kny", "l_lleg", "left_shin", "LeftLowerLeg", "leftKneePitch", "LTibia", "Bip01 L Calf"]),
            (Ankle, &["LeftFoot", "left_ankle_roll_link", "lfoot"]),
            (Leg, &["leg_left_1_link", "LLEG_LINK4", "LeftLeg"]),
            (Toe, &["LeftToe"]),
            (Clavicle, &["l_clav", "L_Thorax"]),
            (Shoulder, &["LeftUpperArm", "left_shoulder_pitch_link", "l_uarm"]),
            (Arm, &["LARM_LINK2", "LeftArm", "arm_left_7_link"]),
            (Elbow, &["l_larm", "LeftForeArm", "left_lowerarm", "LElbowYaw", "leftelbow"]),
            (Wrist, &["left_rubber_hand", "l_wrist", "lhand"]),
            (Finger, &["LeftHandIndex1", "l_hand_thumb_2_link", "left_hand_middle_0_link", "lthumb"]),
        ];
        for (expected, names) in sided {
            for name in names {
                assert_eq!(side_and_part(name), (Some(BodySide::Left), Some(expected)), "{name}");
                let mirrored = name.replace("left", "right").replace("Left", "Right").replace("LLEG", "RLEG");
                if mirrored != *name {
                    assert_eq!(side_and_part(&mirrored), (Some(BodySide::Right), Some(expected)), "{mirrored}");
                }
            }
        }
        for name in ["head_link", "HeadYaw_link", "head2"] {
            assert_eq!(side_and_part(name), (None, Some(Head)), "{name}");
        }
        for name in ["upperNeckPitchLink", "Neck_f1"] {
            assert_eq!(side_and_part(name), (None, Some(Neck)), "{name}");
        }
    }

    #[test]
    fn trunks_frames_and_other_words_give_no_part() {
        for name in ["pelvis", "Hips", "torso_link", "middle_pelvis", "LINK", "l_foot_ft_sensor", "imu", ""] {
            assert_eq!(side_and_part(name).1, None, "{name}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_name_causes_a_panic(name in ".{0,40}") {
            let _ = side_and_part(&name);
        }
    }
}
