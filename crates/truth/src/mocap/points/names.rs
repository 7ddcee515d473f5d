//! Recognises markers by label: Plug-in Gait, CMU, and joint centres as written by markerless programs and Skiagraph.
//!
//! Labels are compared without subject (`Subject:LFHD`), case and punctuation.

use std::collections::BTreeMap;

use super::malformed;
use crate::input::excerpt;
use crate::mocap::MocapError;

/// Lateral markers, with their known labels after the side's letter.
pub(super) const SIDED: [(&str, &[&str]); 23] = [
    ("FHD", &["FHD"]),
    ("BHD", &["BHD"]),
    ("SHO", &["SHO", "ACR", "SHOULDERSTUDY"]),
    ("UPA", &["UPA"]),
    ("ELB", &["ELB", "LELB", "LEL", "LELBOWSTUDY"]),
    ("ELM", &["ELM", "MELB", "MEL", "ELBM", "MELBOWSTUDY"]),
    ("FRM", &["FRM", "FRA"]),
    ("WRA", &["WRA", "WRI", "LWRISTSTUDY"]),
    ("WRB", &["WRB", "MWRISTSTUDY"]),
    ("FIN", &["FIN"]),
    // CMU's belt markers are used as iliac spines
    ("ASI", &["ASI", "ASIS", "FWT", "IAS", "ASISSTUDY"]),
    ("PSI", &["PSI", "PSIS", "BWT", "IPS", "PSISSTUDY"]),
    ("THI", &["THI"]),
    ("KNE", &["KNE", "FLE", "KNEESTUDY"]),
    ("KNM", &["KNM", "MKNE", "KNEM", "KNEMED", "FME", "MKNEESTUDY"]),
    ("TIB", &["TIB"]),
    ("ANK", &["ANK", "FAL", "ANKLESTUDY"]),
    ("ANM", &["ANM", "MANK", "ANKM", "MED", "TAM", "MANKLESTUDY"]),
    ("HEE", &["HEE", "HEEL", "CALC", "FCC", "CALCSTUDY"]),
    ("TOE", &["TOE", "TOESTUDY", "BIGTOE"]),
    ("MT5", &["MT5", "5METASTUDY", "SMALLTOE"]),
    ("MT1", &["MT1"]),
    ("SHN", &["SHN"]),
];

/// Markers on the midline.
pub(super) const MIDDLE: [(&str, &[&str]); 6] = [
    ("C7", &["C7", "CV7", "C7STUDY"]),
    ("T10", &["T10", "TV10"]),
    ("CLAV", &["CLAV", "IJ", "SJN"]),
    ("STRN", &["STRN", "PX", "SXS"]),
    ("SACR", &["SACR", "SAC"]),
    ("ARIEL", &["ARIEL", "VTX", "HEADTOP"]),
];

/// Joint centres and other landmarks, with their known labels.
const LANDMARKS_SIDED: [(&str, &[&str]); 7] = [
    ("shoulder", &["SHOULDER", "SJC"]),
    ("elbow", &["ELBOW", "EJC"]),
    ("wrist", &["WRIST", "WJC"]),
    ("hip", &["HIP", "HJC", "HJCSTUDY"]),
    ("knee", &["KNEE", "KJC"]),
    ("ankle", &["ANKLE", "AJC"]),
    ("toes", &["TOES"]),
];
const LANDMARKS_MIDDLE: [(&str, &[&str]); 3] = [
    ("thorax", &["THORAX", "NECK"]),
    ("pelvis", &["PELVIS", "MIDHIP", "HIPS", "HIP"]),
    ("head_top", &["HEAD_TOP", "HEADTOP", "HEAD"]),
];

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

/// Every name that `marker_map` accepts.
fn all_names() -> Vec<String> {
    let markers = SIDED.iter().flat_map(|(name, _)| ["L", "R"].map(|side| format!("{side}{name}")));
    let landmarks = LANDMARKS_SIDED.iter().flat_map(|(name, _)| ["left", "right"].map(|side| format!("{side}_{name}")));
    let middle = MIDDLE.iter().map(|(name, _)| *name).chain(LANDMARKS_MIDDLE.iter().map(|(name, _)| *name));
    markers.chain(landmarks).chain(middle.map(str::to_owned)).collect()
}

impl KnownPoints {
    /// Recognises labels; `map` assigns labels to standard names, `A+B` for the midpoint of two.
    pub(super) fn of(file: &str, labels: &[String], map: &BTreeMap<String, String>) -> Result<Self, MocapError> {
        let mut known = Self::default();
        for (column, label) in labels.iter().enumerate() {
            match standard_name(label) {
                Some(name) => drop(known.columns.entry(name).or_insert_with(|| vec![column])),
                None => known.unknown.push(label.clone()),
            }
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
                        let labels = short_list(labels);
                        let detail = format!(
                            "marker_map: `{name}`: the file has no point `{}`; it has {labels}",
                            excerpt(label)
                        );
                        malformed(file, detail)
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

/// The standard name of a label.
fn standard_name(label: &str) -> Option<String> {
    let stripped = normalised(label);
    let in_the_middle = |table: &[(&str, &[&str])]| {
        table.iter().find(|(_, names)| names.contains(&stripped.as_str())).map(|(name, _)| (*name).to_owned())
    };
    if let Some(name) = in_the_middle(&MIDDLE).or_else(|| in_the_middle(&LANDMARKS_MIDDLE)) {
        return Some(name);
    }
    for (side, word, letter) in [("left", "LEFT", "L"), ("right", "RIGHT", "R")] {
        for (name, names) in SIDED {
            if names.iter().any(|own| stripped == format!("{letter}{own}") || stripped == format!("{own}{letter}")) {
                return Some(format!("{letter}{name}"));
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
            assert_eq!(standard_name(label).as_deref(), Some(name), "{label}");
        }
        for label in ["*12", "LKneeAngles", "Nose", "", "V_Mid_ASIS", "LELBOW2"] {
            assert_eq!(standard_name(label), None, "{label}");
        }
    }

    #[test]
    fn a_map_must_name_existing_points_and_the_rest_is_listed_without_model_outputs() {
        let labels = ["a:one", "a:two", "*3", "a:LKneeAngles", "a:LKNE", "a:strange"].map(str::to_owned);
        let map = |name: &str, label: &str| BTreeMap::from([(name.to_owned(), label.to_owned())]);
        let known = KnownPoints::of("f", &labels, &map("left_ankle", "one+two")).unwrap();
        assert_eq!(known.columns["left_ankle"], [0, 1]);
        assert_eq!(known.columns["LKNE"], [4]);
        assert_eq!(known.unknown, ["a:strange"], "mapped points are used");
        let wrong = KnownPoints::of("f", &labels, &map("left_tail", "one")).unwrap_err().to_string();
        assert!(wrong.contains("`left_tail` is not a marker or landmark; expected one of LFHD"), "{wrong}");
        let wrong = KnownPoints::of("f", &labels, &map("left_ankle", "three")).unwrap_err().to_string();
        assert!(wrong.contains("the file has no point `three`; it has a:one, a:two"), "{wrong}");
    }
}
