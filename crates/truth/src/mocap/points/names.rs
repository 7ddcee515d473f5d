//! Recognises markers by label: Plug-in Gait (French too), CMU, OpenSim's gait models, Helen Hayes, Davis, IOR, and
//! joint centres as written by markerless programs and Skiagraph.
//!
//! Labels are compared without subject (`Subject:LFHD`), case and punctuation.

use std::collections::BTreeMap;

use super::malformed;
use crate::mocap::{MocapError, SidesInFile};
use skiagraph_core::input::excerpt;

/// Lateral markers, with their known labels after the side's letter.
pub(super) const SIDED: [(&str, &[&str]); 24] = [
    ("FHD", &["FHD", "HDF"]),
    ("BHD", &["BHD", "HDB"]),
    ("TEM", &["TEMPLE", "TET"]),
    ("SHO", &["SHO", "ACR", "SHOULDERSTUDY", "ACROMIUM", "ACROMION", "SHOULD", "SAJ", "EPAULE"]),
    ("UPA", &["UPA"]),
    ("ELB", &["ELB", "LELB", "LEL", "LELBOWSTUDY", "HLE", "ELBOWLAT", "COU", "COUDE"]),
    ("ELM", &["ELM", "MELB", "MEL", "ELBM", "MELBOWSTUDY", "HME", "MELBOW", "ELBOWMED", "ELBOWMEDIAL", "MEDIALELBOW"]),
    ("FRM", &["FRM", "FRA"]),
    ("WRA", &["WRA", "WRI", "LWRISTSTUDY", "RSP", "WRISTLAT", "WRISTRADIUS", "FARADIUS", "MAI", "POIGNET"]),
    ("WRB", &["WRB", "MWRISTSTUDY", "UHE", "USP", "WRISTMED", "MEDIALWRIST", "WRISTULNA", "FAULNA"]),
    ("FIN", &["FIN", "HM2", "MC5"]),
    // CMU's belt markers are used as iliac spines
    ("ASI", &["ASI", "ASIS", "FWT", "IAS", "ASISSTUDY", "EAS", "EIAS"]),
    ("PSI", &["PSI", "PSIS", "BWT", "IPS", "PSISSTUDY", "EPS", "EIPS"]),
    ("THI", &["THI"]),
    ("KNE", &["KNE", "FLE", "KNEESTUDY", "KNEELAT", "KNEE1", "CL"]),
    ("KNM", &["KNM", "MKNE", "KNEM", "KNEMED", "FME", "MKNEESTUDY", "MKNEE", "KNEEMEDIAL", "MEDIALKNEE", "CM"]),
    ("TIB", &["TIB"]),
    ("ANK", &["ANK", "FAL", "ANKLESTUDY", "ANKLELAT", "MALL", "ML"]),
    (
        "ANM",
        &["ANM", "MANK", "ANKM", "MED", "TAM", "MANKLESTUDY", "MANKLE", "ANKLEMED", "ANKLEMEDIAL", "MEDIALANKLE", "MM"],
    ),
    ("HEE", &["HEE", "HEEL", "CALC", "FCC", "CALCSTUDY", "CAL", "TALON"]),
    ("TOE", &["TOE", "TOESTUDY", "BIGTOE", "TOETIP", "HAL"]),
    ("MT5", &["MT5", "5METASTUDY", "SMALLTOE", "FM5", "TOELAT", "MET"]),
    ("MT1", &["MT1", "FM1", "TOEMED"]),
    ("SHN", &["SHN"]),
];

/// Markers on the midline.
pub(super) const MIDDLE: [(&str, &[&str]); 6] = [
    ("C7", &["C7", "CV7", "C7STUDY"]),
    ("T10", &["T10", "TV10", "T8", "TV8"]),
    ("CLAV", &["CLAV", "IJ", "SJN", "STERNUM", "STER"]),
    ("STRN", &["STRN", "PX", "SXS"]),
    ("SACR", &["SACR", "SAC", "SACRUM", "SACRAL", "VSACRAL", "S2"]),
    ("ARIEL", &["ARIEL", "VTX", "HEADTOP", "TOPHEAD"]),
];

/// Joint centres and other landmarks, with their known labels.
const LANDMARKS_SIDED: [(&str, &[&str]); 7] = [
    ("shoulder", &["SHOULDER", "SJC", "SHOULDERJOINT"]),
    ("elbow", &["ELBOW", "EJC", "ELBOWJOINT"]),
    ("wrist", &["WRIST", "WJC", "WRISTJOINT"]),
    ("hip", &["HIP", "HJC", "HJCSTUDY", "HIPJOINT"]),
    ("knee", &["KNEE", "KJC", "KNEEJOINT"]),
    ("ankle", &["ANKLE", "AJC", "ANKLEJOINT"]),
    ("toes", &["TOES"]),
];
const LANDMARKS_MIDDLE: [(&str, &[&str]); 3] = [
    ("thorax", &["THORAX", "NECK"]),
    ("pelvis", &["PELVIS", "MIDHIP", "HIPS", "HIP"]),
    ("head_top", &["HEAD_TOP", "HEADTOP", "HEAD"]),
];

/// Joints whose plain names mean a lateral marker in a file of skin markers, with that marker.
const LATERAL: [(&str, &str); 5] =
    [("shoulder", "SHO"), ("elbow", "ELB"), ("wrist", "WRA"), ("knee", "KNE"), ("ankle", "ANK")];

/// Labels that some laboratories give twice: the lateral marker first, then the medial one.
const GIVEN_TWICE: [(&str, &str, &str); 2] = [("COU", "ELB", "ELM"), ("MAI", "WRA", "WRB")];

/// Label endings of angles, forces and other model outputs, which some programs store as points.
const RESULTS: [&str; 7] = ["ANGLES", "FORCE", "FORCES", "MOMENT", "MOMENTS", "POWER", "POWERS"];

/// The recognised points of a file, by standard name of the marker (`LKNE`) or landmark (`left_knee`).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct KnownPoints {
    /// Columns whose mean is the point.
    pub(super) columns: BTreeMap<String, Vec<usize>>,
    /// Labels that are not recognised.
    pub(super) unknown: Vec<String>,
}

/// The name of the same marker or landmark on the other side.
fn of_other_side(name: &str) -> String {
    for (side, other) in [("left_", "right_"), ("right_", "left_")] {
        if let Some(part) = name.strip_prefix(side) {
            return format!("{other}{part}");
        }
    }
    let is_sided = |name: &str| SIDED.iter().any(|(known, _)| *known == name);
    match (name.strip_prefix('L'), name.strip_prefix('R')) {
        (Some(part), _) if is_sided(part) => format!("R{part}"),
        (_, Some(part)) if is_sided(part) => format!("L{part}"),
        _ => name.to_owned(),
    }
}

/// Every name that `marker_map` accepts.
fn all_names() -> Vec<String> {
    let markers = SIDED.iter().flat_map(|(name, _)| ["L", "R"].map(|side| format!("{side}{name}")));
    let landmarks = LANDMARKS_SIDED.iter().flat_map(|(name, _)| ["left", "right"].map(|side| format!("{side}_{name}")));
    let middle = MIDDLE.iter().map(|(name, _)| *name).chain(LANDMARKS_MIDDLE.iter().map(|(name, _)| *name));
    markers.chain(landmarks).chain(middle.map(str::to_owned)).collect()
}

impl KnownPoints {
    /// Recognises labels; `map` assigns labels to standard names, `A+B` for the midpoint of two.
    pub(super) fn of(
        file: &str,
        labels: &[String],
        map: &BTreeMap<String, String>,
        sides: SidesInFile,
    ) -> Result<Self, MocapError> {
        let mut known = Self::default();
        let is_french = are_french(labels);
        for (column, label) in labels.iter().enumerate() {
            let Some(mut name) = standard_name(label, is_french) else {
                known.unknown.push(label.clone());
                continue;
            };
            for (twice, lateral, medial) in GIVEN_TWICE {
                if normalised(label).contains(twice) && known.columns.contains_key(&name) {
                    name = name.replace(lateral, medial);
                }
            }
            known.add(name, column, labels);
        }
        known.take_joints_for_markers(labels);
        if sides == SidesInFile::Exchanged {
            known.columns = known.columns.into_iter().map(|(name, columns)| (of_other_side(&name), columns)).collect();
        }
        for (name, wanted) in map {
            if !all_names().contains(name) {
                let names = all_names().join(", ");
                let detail =
                    format!("marker_map: `{}` is not a marker or landmark; expected one of {names}", excerpt(name));
                return Err(malformed(file, detail));
            }
            let column = |label: &str| {
                labels.iter().position(|known| known == label || normalised(known) == normalised(label)).ok_or_else(
                    || {
                        let (label, labels) = (excerpt(label), short_list(labels));
                        let detail = format!("the file has no point `{label}`; it has {labels}");
                        malformed(file, format!("marker_map: `{name}`: {detail}"))
                    },
                )
            };
            let columns = wanted.split('+').map(|label| column(label.trim())).collect::<Result<Vec<_>, _>>()?;
            known.unknown.retain(|label| columns.iter().all(|column| labels[*column] != *label));
            known.columns.insert(name.clone(), columns);
        }
        known.unknown.retain(|label| {
            let stripped = normalised(label);
            !stripped.is_empty() && !label.starts_with('*') && !RESULTS.iter().any(|ending| stripped.ends_with(ending))
        });
        Ok(known)
    }
}

impl KnownPoints {
    /// Adds a recognised point. Of two with one name the first counts, but for a joint's plain name beside that of its
    /// centre, which is the marker on the joint's side: `L.Knee` beside `L.KneeJoint`.
    fn add(&mut self, name: String, column: usize, labels: &[String]) {
        let Some(first) = self.columns.get(&name).map(|columns| columns[0]) else {
            self.columns.insert(name, vec![column]);
            return;
        };
        let (centre, plain) = match [first, column].map(|column| is_centre(&labels[column])) {
            [true, false] => (first, column),
            [false, true] => (column, first),
            _ => return,
        };
        if let Some(marker) = lateral_marker(&name) {
            self.columns.entry(marker).or_insert_with(|| vec![plain]);
        }
        self.columns.insert(name, vec![centre]);
    }

    /// Beside a medial marker, "R.Knee" is a marker on the knee's side, not its centre; beside iliac spines too, unless
    /// hips have plain names.
    fn take_joints_for_markers(&mut self, labels: &[String]) {
        let plain = |columns: &Vec<usize>| !is_centre(&labels[columns[0]]);
        let has_plain = |name: &str| self.columns.get(name).is_some_and(plain);
        let has_spines = self.columns.contains_key("LASI") && self.columns.contains_key("RASI");
        let are_markers = has_spines && !has_plain("left_hip") && !has_plain("right_hip");
        let plain_joints: Vec<String> =
            self.columns.iter().filter(|(_, columns)| plain(columns)).map(|(name, _)| name.clone()).collect();
        for joint in plain_joints {
            let marker = lateral_marker(&joint).filter(|marker| !self.columns.contains_key(marker));
            if let Some(marker) = marker
                && (are_markers || self.columns.contains_key(&format!("{}M", &marker[..3])))
                && let Some(columns) = self.columns.remove(&joint)
            {
                self.columns.insert(marker, columns);
            }
        }
    }
}

/// Whether a label says that its point is the centre of a joint, not a marker on its side.
fn is_centre(label: &str) -> bool {
    let label = normalised(label);
    ["JC", "JCSTUDY", "JOINT"].iter().any(|ending| label.ends_with(ending))
}

/// The marker on the side of a joint: `LKNE` of `left_knee`.
fn lateral_marker(joint: &str) -> Option<String> {
    let (side, part) = joint.split_once('_')?;
    let letter = if side == "left" { "L" } else { "R" };
    LATERAL.iter().find(|(own, _)| *own == part).map(|(_, marker)| format!("{letter}{marker}"))
}

/// Names for a message, at most 40.
pub(super) fn short_list(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(40).map(|name| excerpt(name)).collect();
    format!("{}{}", shown.join(", "), if names.len() > 40 { ", ..." } else { "" })
}

/// A label without subject, case and punctuation.
fn normalised(label: &str) -> String {
    let own = label.rsplit(':').next().unwrap_or(label);
    own.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_uppercase()).collect()
}

/// Whether labels are of the French Plug-in Gait: EAS, the anterior superior iliac spine, occurs in no other.
pub(super) fn are_french(labels: &[String]) -> bool {
    // with at most one letter for the side at each end, which leaves out words such as BREAST
    labels.iter().map(|label| normalised(label)).any(|label| label.len() <= 5 && label.contains("EAS"))
}

/// Whether two points of this label are its lateral and its medial marker.
pub(super) fn is_given_twice(label: &str) -> bool {
    GIVEN_TWICE.iter().any(|(twice, ..)| normalised(label).contains(twice))
}

/// The standard name of a label. Words of two letters, and D and G for right and left, are only used in French.
pub(super) fn standard_name(label: &str, is_french: bool) -> Option<String> {
    let mut stripped = normalised(label);
    let in_the_middle = |table: &[(&str, &[&str])]| {
        table.iter().find(|(_, names)| names.contains(&stripped.as_str())).map(|(name, _)| (*name).to_owned())
    };
    if let Some(name) = in_the_middle(&MIDDLE).or_else(|| in_the_middle(&LANDMARKS_MIDDLE)) {
        return Some(name);
    }
    if is_french {
        for (own, english) in [('G', "L"), ('D', "R")] {
            let rest = stripped.strip_suffix(own).or_else(|| stripped.strip_prefix(own));
            let is_known = |rest: &str| SIDED.iter().any(|(_, names)| names.contains(&rest));
            if let Some(rest) = rest.filter(|rest| is_known(rest)) {
                stripped = format!("{english}{rest}");
            }
        }
    }
    for (side, word, letter) in [("left", "LEFT", "L"), ("right", "RIGHT", "R")] {
        for (name, names) in SIDED {
            for own in names.iter().filter(|own| own.len() > 2 || is_french) {
                if stripped == format!("{letter}{own}") || stripped == format!("{own}{letter}") {
                    return Some(format!("{letter}{name}"));
                }
            }
        }
        for (name, names) in LANDMARKS_SIDED {
            let spelt = |own: &&str| {
                [format!("{letter}{own}"), format!("{word}{own}"), format!("{own}{letter}"), format!("{own}{word}")]
            };
            if names.iter().any(|own| spelt(own).contains(&stripped)) {
                return Some(format!("{side}_{name}"));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_common_marker_sets_are_recognised_with_subjects_and_in_any_case() {
        for (label, name) in [
            ("LFHD", "LFHD"),
            ("Jim:RKNE", "RKNE"),
            ("jim:LFWT", "LASI"),
            ("RBWT", "RPSI"),
            ("C7", "C7"),
            ("LKnee", "left_knee"),
            ("RKNE", "RKNE"),
            ("left_ankle", "left_ankle"),
            ("RBigToe", "RTOE"),
            ("Hip", "pelvis"),
            ("RHip", "right_hip"),
            ("LHJC", "left_hip"),
            ("Neck", "thorax"),
            ("head_top", "ARIEL"),
            ("r_mknee_study", "RKNM"),
            ("L.ASIS_study", "LASI"),
        ] {
            assert_eq!(standard_name(label, false).as_deref(), Some(name), "{label}");
        }
        for label in ["*12", "LKneeAngles", "Nose", "", "V_Mid_ASIS", "LELBOW2"] {
            assert_eq!(standard_name(label, false), None, "{label}");
        }
    }

    /// The columns of the points with these labels.
    fn columns(labels: &[&str]) -> BTreeMap<String, Vec<usize>> {
        let labels: Vec<String> = labels.iter().map(|label| (*label).to_owned()).collect();
        KnownPoints::of("f", &labels, &BTreeMap::new(), SidesInFile::Right).unwrap().columns
    }

    /// "R.Knee" is a centre in one file and a marker on the skin in another; a French laboratory gives COU twice.
    #[test]
    fn marker_sets_of_laboratories_are_known() {
        let skin = columns(&["R.ASIS", "L.ASIS", "V.Sacral", "R.Knee", "R.MKnee", "Top.Head", "r mall", "L_HLE"]);
        let names: Vec<&str> = skin.keys().map(String::as_str).collect();
        assert_eq!(names, ["ARIEL", "LASI", "LELB", "RANK", "RASI", "RKNE", "RKNM", "SACR"]);
        assert!(columns(&["RHip", "LHip", "RKnee"]).contains_key("right_knee"));
        let french = columns(&["REAS", "LEAS", "RCOU", "RCOU", "LCL", "LCM", "TALOND"]);
        assert_eq!((&french["RELB"], &french["RELM"]), (&vec![2], &vec![3]));
        assert!(["LKNE", "LKNM", "RHEE"].iter().all(|name| french.contains_key(*name)), "{french:?}");
        assert!(!columns(&["LCL"]).contains_key("LKNE"));
    }

    // With labels of the hips' centres, markers on the sides of knees and ankles were taken for centres, 50 mm off.
    #[test]
    fn centres_and_markers_of_one_joint_are_told_apart() {
        let opensim =
            columns(&["R.ASIS", "L.ASIS", "R_HJC", "L_HJC", "R.Knee", "R.MKnee", "L_ankle", "R_wrist_radius"]);
        let names: Vec<&str> = opensim.keys().map(String::as_str).collect();
        assert_eq!(names, ["LANK", "LASI", "RASI", "RKNE", "RKNM", "RWRA", "left_hip", "right_hip"]);
        let with_hips = columns(&["R.ASIS", "L.ASIS", "R.Hip", "L.Hip", "R.Knee", "R.MedialKnee", "L.Knee"]);
        assert_eq!((&with_hips["RKNE"], &with_hips["RKNM"], &with_hips["left_knee"]), (&vec![4], &vec![5], &vec![6]));
        for labels in [["R.Knee", "R.KneeJoint"], ["R.KneeJoint", "R.Knee"]] {
            let both = columns(&labels);
            assert_eq!([&both["RKNE"], &both["right_knee"]].map(|c| labels[c[0]]), ["R.Knee", "R.KneeJoint"]);
        }
    }

    #[test]
    fn a_map_must_name_existing_points_and_the_rest_is_listed_without_model_outputs() {
        let labels = ["a:one", "a:two", "*3", "a:LKneeAngles", "a:LKNE", "a:strange"].map(str::to_owned);
        let map = |name: &str, label: &str| BTreeMap::from([(name.to_owned(), label.to_owned())]);
        let known = KnownPoints::of("f", &labels, &map("left_ankle", "one+two"), SidesInFile::Right).unwrap();
        assert_eq!(known.columns["left_ankle"], [0, 1]);
        assert_eq!(known.columns["LKNE"], [4]);
        assert_eq!(known.unknown, ["a:strange"], "mapped points are used");
        let wrong =
            KnownPoints::of("f", &labels, &map("left_tail", "one"), SidesInFile::Right).unwrap_err().to_string();
        assert!(wrong.contains("`left_tail` is not a marker or landmark; expected one of LFHD"), "{wrong}");
        let wrong =
            KnownPoints::of("f", &labels, &map("left_ankle", "three"), SidesInFile::Right).unwrap_err().to_string();
        assert!(wrong.contains("the file has no point `three`; it has a:one, a:two"), "{wrong}");
    }
}
