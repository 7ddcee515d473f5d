//! Which column of a file is which marker or joint.

use std::collections::BTreeMap;
use std::path::Path;

use crate::body::{Humanoid, LANDMARKS};
use crate::experiment::ExperimentError;
use crate::input::{self, excerpt, foreign, limits};

/// What a name is where it is both a marker's and a joint's or link's, as that of a thorax.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NameKind {
    Marker,
    /// Of files whose columns are bones.
    Joint,
}

/// Columns with the names that they have here.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NamedColumns {
    pub(super) markers: Vec<(usize, String)>,
    pub(super) joints: Vec<(usize, String)>,
    /// What was left out.
    pub(super) note: Option<String>,
}

/// Reads a joint map: TOML, `"theirs" = "ours"`.
pub(super) fn read_map(path: &Path) -> Result<BTreeMap<String, String>, ExperimentError> {
    let text = input::read_to_string(path, limits::SETTINGS)
        .map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })?;
    toml::from_str(&text).map_err(|e| ExperimentError::Malformed {
        path: path.to_owned(),
        detail: format!("expected lines as \"LHip\" = \"left_hip\": {}", foreign(e)),
    })
}

/// The columns of a file. Without a map a name counts as ours whatever its case and whatever divides its words. A
/// link's name stands for the joint that carries it: joints of BVH files often have the names of the bones.
pub(super) fn columns(
    names: &[String],
    map: Option<&BTreeMap<String, String>>,
    body: &Humanoid,
    first: NameKind,
) -> Result<NamedColumns, String> {
    let markers = LANDMARKS.map(|landmark| landmark.name());
    let joints: Vec<&str> = body.joints.iter().map(|joint| joint.name.as_str()).collect();
    // the root link has no joint, and every other link the joint before it
    let links: Vec<(&str, &str)> =
        body.links.iter().skip(1).map(|link| link.name.as_str()).zip(joints.iter().copied()).collect();
    let mut found = NamedColumns::default();
    let mut left_out = Vec::new();
    if let Some((theirs, _)) = map.into_iter().flatten().find(|(theirs, _)| !names.contains(theirs)) {
        return Err(format!(
            "the joint map names {:?}, which the file has not; it has {}",
            excerpt(theirs),
            listed(names)
        ));
    }
    for (column, name) in names.iter().enumerate() {
        let ours = match map {
            Some(map) => map.get(name).map(String::as_str),
            None => Some(name.as_str()),
        };
        let Some(ours) = ours else {
            left_out.push(name.clone());
            continue;
        };
        let is = |known: &&&str| plain(known) == plain(ours);
        let of_link = || links.iter().find(|(link, _)| plain(link) == plain(ours)).map(|(_, joint)| joint);
        let (kind, known) = match (markers.iter().find(is), joints.iter().find(is).or_else(of_link)) {
            (Some(_), Some(joint)) if first == NameKind::Joint => (&mut found.joints, *joint),
            (Some(marker), _) => (&mut found.markers, *marker),
            (None, Some(joint)) => (&mut found.joints, *joint),
            (None, None) if map.is_some() => {
                return Err(format!(
                    "the joint map gives {:?}, which is neither a marker nor a joint nor a link here",
                    excerpt(ours)
                ));
            }
            (None, None) => {
                left_out.push(name.clone());
                continue;
            }
        };
        if kind.iter().any(|(_, there)| there == known) {
            return Err(format!("two columns are `{known}`: {:?} is the second", excerpt(name)));
        }
        kind.push((column, known.to_owned()));
    }
    if found.markers.is_empty() && found.joints.is_empty() {
        return Err(format!(
            "none of its names is known: {}; expected markers ({}) or joints of start/body.json, or a --joint-map",
            listed(names),
            markers.join(", ")
        ));
    }
    found.note = (!left_out.is_empty()).then(|| format!("has names that were left out: {}", listed(&left_out)));
    Ok(found)
}

fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

fn listed(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(20).map(|name| excerpt(name)).collect();
    format!("{}{}", shown.join(", "), if names.len() > 20 { ", ..." } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::person;
    use crate::body::shipped;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn names_are_known_whatever_their_case_and_others_are_left_out_and_told() {
        let found = columns(&names(&["Pelvis", "Left Knee", "Nose"]), None, &person(), NameKind::Marker).unwrap();
        let known: Vec<&str> = found.markers.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(known, ["pelvis", "left_knee"]);
        assert_eq!(found.note.as_deref(), Some("has names that were left out: Nose"));
        let none = columns(&names(&["a", "b"]), None, &person(), NameKind::Marker).unwrap_err();
        assert!(none.contains("a, b") && none.contains("--joint-map"), "{none}");
        let twice = columns(&names(&["pelvis", "PELVIS"]), None, &person(), NameKind::Marker).unwrap_err();
        assert!(twice.contains("two columns"), "{twice}");
    }

    #[test]
    fn a_link_stands_for_the_joint_that_carries_it() {
        let body = shipped("tracker25").unwrap();
        let (joint, link) = (&body.joints[4].name, &body.links[5].name);
        assert_ne!(joint, link);
        let found = columns(&names(&[link.as_str()]), None, &body, NameKind::Marker).unwrap();
        assert_eq!(found.joints, [(0, joint.clone())]);
        let twice = columns(&names(&[link.as_str(), joint.as_str()]), None, &body, NameKind::Marker).unwrap_err();
        assert!(twice.contains("two columns"), "{twice}");
    }

    #[test]
    fn a_map_must_name_columns_and_markers() {
        let map = |theirs: &str, ours: &str| BTreeMap::from([(theirs.to_owned(), ours.to_owned())]);
        let columns = |map| columns(&names(&["LKnee", "x"]), Some(&map), &person(), NameKind::Marker);
        assert_eq!(columns(map("LKnee", "left_knee")).unwrap().markers, [(0, "left_knee".to_owned())]);
        assert!(columns(map("RKnee", "left_knee")).unwrap_err().contains("\"RKnee\""));
        assert!(columns(map("LKnee", "nose")).unwrap_err().contains("\"nose\""));
    }
}
