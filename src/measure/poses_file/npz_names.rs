//! Names of the columns of an `.npz` file: joint maps and keypoint layouts.

use std::collections::BTreeMap;

use super::layouts::nearly_a_layout;
use super::markers_on;
use super::names::{NameKind, NamedColumns, columns};
use skiagraph_core::body::{Humanoid, LANDMARKS};
use skiagraph_core::input::excerpt;
use skiagraph_core::npz::{Array, Npz};

pub(super) struct NamedArchive {
    pub(super) npz: Npz,
    /// The file's name of every marker.
    pub(super) columns: BTreeMap<String, String>,
    pub(super) layout: Option<&'static str>,
    /// Names of the columns that are not used, as a list.
    pub(super) left_out: Option<String>,
}

/// Arrays of positions, the arrays of their names, and the kind of the names.
const KINDS: [(&str, &str, NameKind); 2] = [
    ("estimate_markers", "marker_names", NameKind::Marker),
    ("estimate_joints", "estimate_joint_names", NameKind::Joint),
];

/// Renames columns by the joint map or a keypoint layout. A file that has only names of this program is not changed,
/// nor is one with unknown names, which the reader reports. In a file of points (`points` is the preferred kind of its
/// names), unknown names are left out.
pub(super) fn named(
    mut npz: Npz,
    file: &str,
    map: Option<&BTreeMap<String, String>>,
    body: &Humanoid,
    points: Option<NameKind>,
) -> Result<NamedArchive, String> {
    let mut given = Vec::new();
    for (array, names_array, kind) in KINDS {
        let names = npz.names(file, names_array).map_err(|e| e.detail)?;
        given.extend(names.map(|names| (array, names_array, kind, names.to_vec())));
    }
    if points.is_none() {
        check_map(given.iter().flat_map(|(.., names)| names), map)?;
        for (array, _, _, names) in &given {
            check_axes(array, npz.get(array).map_or(&[], |array| &array.shape), names.len())?;
        }
    }
    let (mut by_marker, mut layout, mut left_out) = (BTreeMap::new(), None, Vec::new());
    for (array, names_array, kind, names) in given {
        let found = if let Some(first) = points {
            columns(&names, map, body, first)?
        } else {
            let applicable = |map: &BTreeMap<String, String>| -> BTreeMap<String, String> {
                map.iter().filter(|(theirs, _)| names.contains(theirs)).map(|(a, b)| (a.clone(), b.clone())).collect()
            };
            let map = map.map(applicable).filter(|map| !map.is_empty());
            if map.is_none() && is_own_output(&names, kind, body) {
                by_marker.extend(own_columns(&names, kind, body));
                continue;
            }
            match columns(&names, map.as_ref(), body, kind) {
                Ok(found) if map.is_some() || found.layout.is_some() => found,
                Err(detail) if map.is_some() => return Err(format!("{names_array}: {detail}")),
                // the reader reports other misspelt names
                _ => match nearly_a_layout(&names.iter().map(String::as_str).collect::<Vec<_>>()) {
                    Some((layout, strangers)) => return Err(unknown_beside(names_array, layout, &strangers)),
                    None => continue,
                },
            }
        };
        by_marker.extend(found.by_marker(&names, body));
        layout = layout.or(found.layout);
        left_out.extend(found.left_out.clone());
        npz = with_columns(&npz, file, [array, names_array], names.len(), &found)?;
    }
    let left_out = (!left_out.is_empty()).then(|| left_out.join(", "));
    Ok(NamedArchive { npz, columns: by_marker, layout, left_out })
}

fn unknown_beside(names_array: &str, layout: &str, strangers: &[&str]) -> String {
    let named: Vec<String> = strangers.iter().map(|name| format!("{:?}", excerpt(name))).collect();
    format!(
        "{names_array}: the names are those of {layout} but for {}; correct or leave out this column, or map it with \
         --joint-map",
        named.join(" and ")
    )
}

fn check_map<'a>(
    names: impl Iterator<Item = &'a String> + Clone,
    map: Option<&BTreeMap<String, String>>,
) -> Result<(), String> {
    match map.into_iter().flatten().find(|(theirs, _)| !names.clone().any(|name| name == *theirs)) {
        Some((theirs, _)) => Err(format!(
            "the joint map names {:?}, which is neither in marker_names nor in estimate_joint_names; it does not apply to poses",
            excerpt(theirs)
        )),
        None => Ok(()),
    }
}

/// Refuses positions whose axes are in another order than repetitions, frames, names and coordinates.
fn check_axes(array: &str, shape: &[usize], names: usize) -> Result<(), String> {
    let [_, axes @ ..] = shape else { return Ok(()) };
    let Ok(axes) = <[usize; 3]>::try_from(axes) else { return Ok(()) };
    if axes[1..] == [names, 3] {
        return Ok(());
    }
    let orders = [[1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    match orders.into_iter().find(|order| order.map(|axis| axes[axis])[1..] == [names, 3]) {
        Some(order) => Err(format!(
            "{array}: its axes, {axes:?}, are transposed: expected frames, {names} names and 3 coordinates; write \
             numpy.transpose(array, {order:?}), of each seed"
        )),
        None => Ok(()),
    }
}

fn is_own_output(names: &[String], kind: NameKind, body: &Humanoid) -> bool {
    let is_known = |name: &String| match kind {
        NameKind::Marker => LANDMARKS.iter().any(|landmark| landmark.name() == name),
        NameKind::Joint => body.joints.iter().any(|joint| joint.name == *name),
    };
    names.iter().all(is_known)
}

fn own_columns(names: &[String], kind: NameKind, body: &Humanoid) -> Vec<(String, String)> {
    let of = |name: &String| match kind {
        NameKind::Marker => vec![(name.clone(), name.clone())],
        NameKind::Joint => markers_on(body, name).into_iter().map(|marker| (marker.to_owned(), name.clone())).collect(),
    };
    names.iter().flat_map(of).collect()
}

/// The archive with the columns of one array selected, renamed, and moved to the array of their kind.
fn with_columns(
    npz: &Npz,
    file: &str,
    [array, names_array]: [&str; 2],
    width: usize,
    found: &NamedColumns,
) -> Result<Npz, String> {
    let mut other = Npz::default();
    for (name, kept) in npz.iter().filter(|(name, _)| *name != array && *name != names_array) {
        other.push(name, kept.clone());
    }
    for ((points, points_names, _), kind) in KINDS.iter().zip([&found.markers, &found.joints]) {
        if kind.is_empty() {
            continue;
        }
        if other.get(points).is_some() {
            return Err(format!(
                "{names_array} has names that belong to {points}, which the file also has; give every position once"
            ));
        }
        let picked: Vec<usize> = kind.iter().map(|(column, _)| *column).collect();
        if npz.get(array).is_some() {
            other.push(points, picked_columns(npz, file, array, width, &picked)?);
        }
        other.push(points_names, Array::names(kind.iter().map(|(_, name)| name.as_str())));
    }
    Ok(other)
}

/// Some columns of an array (seeds, frames, columns, ...).
fn picked_columns(npz: &Npz, file: &str, name: &str, width: usize, picked: &[usize]) -> Result<Array, String> {
    let shape = npz.get(name).map(|array| array.shape.clone()).unwrap_or_default();
    let [seeds, frames, columns, rest @ ..] = shape.as_slice() else {
        return Err(format!("{name}: shape {shape:?}, expected (seeds, frames, {width}, ...)"));
    };
    if *columns != width {
        return Err(format!("{name}: expected {width} columns, one per name, found {columns}"));
    }
    let any = vec![None; shape.len()];
    let numbers = npz.numbers(file, name, &any).map_err(|e| e.detail)?;
    let size: usize = rest.iter().product();
    let rows = numbers.chunks_exact((width * size).max(1));
    let chosen: Vec<f64> = rows
        .flat_map(|row| picked.iter().flat_map(|column| row[column * size..(column + 1) * size].to_vec()))
        .collect();
    Ok(Array::new(&[&[*seeds, *frames, picked.len()], rest].concat(), chosen))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transposed_positions_are_refused_with_the_order_that_mends_them() {
        let check = |axes: [usize; 4]| check_axes("estimate_markers", &axes, 15);
        assert!(check([1, 15, 61, 3]).unwrap_err().contains("numpy.transpose(array, [1, 0, 2])"));
        assert!(check([1, 3, 61, 15]).unwrap_err().contains("numpy.transpose(array, [1, 2, 0])"));
        assert_eq!(check([5, 61, 15, 3]), Ok(()));
    }
    use crate::test_bodies::person;

    /// Two frames; all coordinates of a column are its index.
    fn archive(names: &[&str]) -> Npz {
        let rows = (0..2).flat_map(|_| (0..names.len()).flat_map(|column| [column as f64; 3]));
        Npz::from_iter([
            ("fps", Array::new(&[], vec![60.0])),
            ("estimate_markers", Array::new(&[1, 2, names.len(), 3], rows.collect::<Vec<f64>>())),
            ("marker_names", Array::names(names.iter().copied())),
        ])
    }

    #[test]
    fn a_map_renames_columns_and_must_name_columns_of_the_file() {
        let map = |theirs: &str, ours: &str| BTreeMap::from([(theirs.to_owned(), ours.to_owned())]);
        let npz = archive(&["LKnee", "tail", "pelvis"]);
        let found = named(npz.clone(), "p", Some(&map("LKnee", "left_knee")), &person(), None).unwrap();
        assert_eq!(found.npz.names("p", "marker_names").unwrap().unwrap(), ["left_knee", "pelvis"]);
        let numbers = found.npz.f64s("p", "estimate_markers", &[Some(1), Some(2), Some(2), Some(3)]).unwrap();
        assert_eq!(numbers, [[0.0; 3], [2.0; 3], [0.0; 3], [2.0; 3]].as_flattened());
        assert_eq!(found.left_out.as_deref(), Some("tail"));
        assert_eq!(found.columns["left_knee"], "LKnee");
        let refused = named(npz, "p", Some(&map("RKnee", "left_knee")), &person(), None).err().unwrap();
        assert!(refused.contains("\"RKnee\"") && refused.contains("marker_names"), "{refused}");
    }

    #[test]
    fn the_keypoints_of_coco_are_known_and_misspelt_markers_are_kept_for_the_reader() {
        let sides = ["eye", "ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle"];
        let names: Vec<String> =
            sides.iter().flat_map(|part| [format!("left_{part}"), format!("right_{part}")]).collect();
        let names: Vec<&str> = std::iter::once("nose").chain(names.iter().map(String::as_str)).collect();
        let found = named(archive(&names), "p", None, &person(), None).unwrap();
        assert_eq!(found.layout, Some("COCO-17"));
        assert_eq!(found.npz.get("estimate_markers").unwrap().shape, [1, 2, 12, 3]);
        let strange: Vec<&str> =
            names.iter().map(|name| if *name == "left_ear" { "left_horn" } else { *name }).collect();
        let refused = named(archive(&strange), "p", None, &person(), None).err().unwrap();
        assert!(refused.contains("COCO-17 but for \"left_horn\""), "{refused}");
        let misspelt = archive(&["pelvis", "left_kne"]);
        let found = named(misspelt.clone(), "p", None, &person(), None).unwrap();
        assert_eq!(found.npz.names("p", "marker_names").unwrap().unwrap(), ["pelvis", "left_kne"]);
    }
}
