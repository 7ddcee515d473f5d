//! Which columns of a file are which markers or joints.

use std::collections::BTreeMap;
use std::path::Path;

use super::layouts::{NamedLayout, layout_names, layout_of};
use super::markers_on;
use crate::common::ExperimentError;
use skiagraph_core::body::{Humanoid, LANDMARKS};
use skiagraph_core::input::{self, excerpt, foreign, limits};

/// The kind of a name. Some names, such as `thorax`, are both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NameKind {
    Marker,
    /// A joint or link; preferred in files of bones.
    Joint,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NamedColumns {
    pub(super) markers: Vec<(usize, String)>,
    pub(super) joints: Vec<(usize, String)>,
    pub(super) left_out: Option<String>,
    /// The keypoint layout of the names, if they are not those of this program.
    pub(super) layout: Option<&'static str>,
}

impl NamedColumns {
    /// The file's name of every marker: of its column, or of its joint's column.
    pub(super) fn by_marker(&self, names: &[String], body: &Humanoid) -> BTreeMap<String, String> {
        let on_joints = self.joints.iter().flat_map(|(column, joint)| {
            markers_on(body, joint).into_iter().map(|marker| (marker.to_owned(), names[*column].clone()))
        });
        let markers = self.markers.iter().map(|(column, marker)| (marker.clone(), names[*column].clone()));
        on_joints.chain(markers).collect()
    }
}

/// Reads a joint map: TOML with lines `"name in the file" = "marker or joint"`.
pub(super) fn read_map(path: &Path) -> Result<BTreeMap<String, String>, ExperimentError> {
    let text = input::read_to_string(path, limits::SETTINGS)
        .map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })?;
    toml::from_str(&text).map_err(|e| ExperimentError::Malformed {
        path: path.to_owned(),
        detail: format!("expected lines such as \"LHip\" = \"left_hip\": {}", foreign(e)),
    })
}

struct NamedColumn {
    column: usize,
    kind: NameKind,
    known: String,
    /// Whether the joint map or a `marker_` name defines it.
    is_mapped: bool,
}

/// The columns of a file. Unmapped names are matched with this program's names, ignoring case and separators. The name
/// of a link means its joint, because joints of BVH files often have the names of the bones. The joint map has the
/// highest priority for a marker; in files of bones (`first`), joints have priority over markers.
pub(super) fn columns(
    names: &[String],
    map: Option<&BTreeMap<String, String>>,
    body: &Humanoid,
    first: NameKind,
) -> Result<NamedColumns, String> {
    if let Some((theirs, _)) = map.into_iter().flatten().find(|(theirs, _)| !names.contains(theirs)) {
        return Err(format!(
            "the joint map names {:?}, which is not in the file; the file has {}",
            excerpt(theirs),
            listed(names)
        ));
    }
    let mut known = Vec::new();
    let is_mapped = |name: &String| map.is_some_and(|map| map.contains_key(name));
    // mapped names also tell layouts apart: HALPE-26 has a head, BODY-25 has none
    let unmapped = || layout(names.iter().filter(|name| !is_mapped(name)), body, first);
    let layout = layout(names.iter(), body, first).or_else(unmapped);
    for (column, name) in names.iter().enumerate() {
        let mapped = map.and_then(|map| map.get(name));
        let of_layout = layout.filter(|_| mapped.is_none()).map(|layout| layout.marker(name).flatten());
        let found = match of_layout {
            Some(marker) => marker.map(|marker| (NameKind::Marker, marker.name())),
            None => known_as(mapped.unwrap_or(name), body, first),
        };
        match (found, mapped) {
            (Some((kind, known_as)), _) => {
                let is_mapped = mapped.is_some() || marker_of_prefixed(name).is_some();
                known.push(NamedColumn { column, kind, known: known_as.to_owned(), is_mapped });
            }
            (None, Some(ours)) => {
                return Err(format!(
                    "the joint map gives {:?}, which is not a marker, joint or link of the tracker's body",
                    excerpt(ours)
                ));
            }
            (None, None) => {}
        }
    }
    leave_out_collisions(&mut known, body, first);
    let mut found = NamedColumns { layout: layout.map(|layout| layout.name), ..NamedColumns::default() };
    for NamedColumn { column, kind, known, .. } in known {
        let kind = if kind == NameKind::Marker { &mut found.markers } else { &mut found.joints };
        if kind.iter().any(|(_, there)| *there == known) {
            return Err(format!("two columns are `{known}`: {:?} is the second", excerpt(&names[column])));
        }
        kind.push((column, known));
    }
    if found.markers.is_empty() && found.joints.is_empty() {
        return Err(format!(
            "no name is known: {}; expected markers ({}), joints of start/body.json, keypoints of {}, or a --joint-map",
            listed(names),
            LANDMARKS.map(|landmark| landmark.name()).join(", "),
            layout_names()
        ));
    }
    let is_read = |column: usize| found.markers.iter().chain(&found.joints).any(|(read, _)| *read == column);
    let left_out = names.iter().enumerate().filter(|(column, _)| !is_read(*column));
    let left_out: Vec<String> = left_out.map(|(_, name)| name.clone()).collect();
    found.left_out = (!left_out.is_empty()).then(|| listed(&left_out));
    Ok(found)
}

/// The keypoint layout that has all these names, unless all are names of this program.
fn layout<'a>(
    names: impl Iterator<Item = &'a String> + Clone,
    body: &Humanoid,
    first: NameKind,
) -> Option<&'static NamedLayout> {
    let is_known = names.clone().all(|name| known_as(name, body, first).is_some());
    let names: Vec<&str> = names.map(String::as_str).collect();
    layout_of(&names).filter(|_| !is_known)
}

/// The marker of a name `marker_NAME`, as of links in a URDF; such a name is never a joint.
fn marker_of_prefixed(name: &str) -> Option<&'static str> {
    let name = name.strip_prefix("marker_")?;
    LANDMARKS.iter().map(|landmark| landmark.name()).find(|known| *known == name)
}

fn known_as<'a>(name: &str, body: &'a Humanoid, first: NameKind) -> Option<(NameKind, &'a str)> {
    let is = |known: &&str| plain(known) == plain(name);
    if let Some(marker) = marker_of_prefixed(name) {
        return Some((NameKind::Marker, marker));
    }
    let marker = LANDMARKS.iter().map(|landmark| landmark.name()).find(is);
    // the root link has no joint, and link i + 1 has joint i
    let of_link = || body.links.iter().skip(1).position(|link| is(&link.name.as_str()));
    let joint = body.joints.iter().position(|joint| is(&joint.name.as_str())).or_else(of_link);
    let joint = joint.and_then(|joint| body.joints.get(joint)).map(|joint| joint.name.as_str());
    match (marker, joint) {
        (Some(_), Some(joint)) if first == NameKind::Joint => Some((NameKind::Joint, joint)),
        (Some(marker), _) => Some((NameKind::Marker, marker)),
        (None, joint) => joint.map(|joint| (NameKind::Joint, joint)),
    }
}

/// Removes unmapped columns whose marker another column gives too: a mapped column, or in files of bones a joint. A
/// bone may merely have the name of a marker, such as `thorax`.
fn leave_out_collisions(columns: &mut Vec<NamedColumn>, body: &Humanoid, first: NameKind) {
    let markers_of = |column: &NamedColumn| -> Vec<usize> {
        match column.kind {
            NameKind::Marker => {
                LANDMARKS.iter().position(|landmark| landmark.name() == column.known).into_iter().collect()
            }
            NameKind::Joint => {
                let joint = body.joints.iter().position(|joint| joint.name == column.known);
                joint.into_iter().flat_map(|joint| body.markers_on_joint(joint)).collect()
            }
        }
    };
    let given_by = |is_first: &dyn Fn(&NamedColumn) -> bool| -> Vec<usize> {
        columns.iter().filter(|column| is_first(column)).flat_map(markers_of).collect()
    };
    let mapped = given_by(&|column| column.is_mapped);
    let by_bones = given_by(&|column| first == NameKind::Joint && column.kind == NameKind::Joint);
    let collides = |column: &NamedColumn| {
        let gives = |given: &[usize]| markers_of(column).iter().any(|marker| given.contains(marker));
        gives(&mapped) || (column.kind == NameKind::Marker && gives(&by_bones))
    };
    let stays: Vec<bool> = columns.iter().map(|column| column.is_mapped || !collides(column)).collect();
    let mut stays = stays.into_iter();
    columns.retain(|_| stays.next().unwrap_or(true));
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
    use crate::test_bodies::person;
    use skiagraph_core::body::shipped;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn names_match_in_any_case_and_unknown_names_are_listed() {
        let found = columns(&names(&["Pelvis", "Left Knee", "Nose"]), None, &person(), NameKind::Marker).unwrap();
        let known: Vec<&str> = found.markers.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(known, ["pelvis", "left_knee"]);
        assert_eq!(found.left_out.as_deref(), Some("Nose"));
        let none = columns(&names(&["a", "b"]), None, &person(), NameKind::Marker).unwrap_err();
        assert!(none.contains("a, b") && none.contains("--joint-map"), "{none}");
        let twice = columns(&names(&["pelvis", "PELVIS"]), None, &person(), NameKind::Marker).unwrap_err();
        assert!(twice.contains("two columns"), "{twice}");
    }

    #[test]
    fn mapped_names_tell_layouts_apart() {
        let body = person();
        let halpe: Vec<String> = skiagraph_core::body::KeypointLayout::Halpe26
            .keypoints()
            .iter()
            .map(|point| point.name().to_owned())
            .collect();
        let pairs = [("mid_hip", "pelvis"), ("neck", "thorax"), ("head", "head_top")];
        let map = BTreeMap::from(pairs.map(|(theirs, ours)| (theirs.to_owned(), ours.to_owned())));
        let found = columns(&halpe, Some(&map), &body, NameKind::Marker).unwrap();
        assert_eq!((found.layout, found.markers.len()), (Some("HALPE-26"), 15));
    }

    #[test]
    fn the_name_of_a_link_means_its_joint() {
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

    #[test]
    fn an_unmapped_name_is_used_unless_the_map_gives_its_marker() {
        let map = BTreeMap::from([("LKnee".to_owned(), "left_knee".to_owned())]);
        let of = |all: &[&str]| columns(&names(all), Some(&map), &person(), NameKind::Marker).unwrap();
        let found = of(&["LKnee", "right_knee", "nose"]);
        assert_eq!(found.markers, [(0, "left_knee".to_owned()), (1, "right_knee".to_owned())]);
        assert_eq!(found.left_out.as_deref(), Some("nose"));
        let found = of(&["left_knee", "LKnee"]);
        assert_eq!(found.markers, [(1, "left_knee".to_owned())]);
    }

    #[test]
    fn in_files_of_bones_a_joint_has_priority_over_the_marker_on_it() {
        let body = shipped("tracker25").unwrap();
        let (joint, landmark) = (0..body.joints.len())
            .find_map(|joint| Some((joint, body.markers_on_joint(joint).next()?)))
            .expect("a joint with a marker");
        let both = names(&[LANDMARKS[landmark].name(), body.joints[joint].name.as_str()]);
        let found = columns(&both, None, &body, NameKind::Joint).unwrap();
        assert_eq!((found.markers.len(), found.joints.len()), (0, 1));
        let found = columns(&both, None, &body, NameKind::Marker).unwrap();
        assert_eq!((found.markers.len(), found.joints.len()), (1, 1));
    }
}
