//! Columns in any order, missing estimates, and malformed files.

use super::*;
use crate::test_bodies::{person, walk};
use skiagraph_core::npz::{Array, Values};

const NAN: f64 = f64::NAN;

/// A file of another program: 3 frames of seed 5.
fn file(arrays: &[(&str, Array)]) -> Vec<u8> {
    let mut npz = Npz::from_iter([("fps", Array::new(&[1], vec![60_i64])), ("seeds", Array::new(&[1], vec![5_u8]))]);
    arrays.iter().for_each(|(name, array)| npz.push(name, array.clone()));
    npz.to_bytes("p").unwrap()
}

fn read(arrays: &[(&str, Array)]) -> Result<Estimates, String> {
    Estimates::from_bytes("p", &file(arrays), &person()).map_err(|e| e.to_string())
}

fn root_rows() -> Array {
    let rows: Vec<f64> = walk(3).poses.iter().flat_map(|pose| rigid::to_row(&pose.world_from_root)).collect();
    Array::new(&[1, 3, 7], rows)
}

/// Angles with the columns in this order.
fn angle_rows(order: [usize; 6]) -> Array {
    let rows = walk(3).poses.iter().flat_map(|p| order.map(|i| p.joint_angles[i])).collect::<Vec<f64>>();
    Array::new(&[1, 3, 6], rows)
}

fn angle_names(order: &[usize]) -> Array {
    let body = person();
    Array::names(order.iter().map(|i| body.degrees_of_freedom[*i].name.as_str()))
}

fn expected() -> EstimatedSequence {
    EstimatedSequence::from_poses(&person(), walk(3).poses)
}

/// Markers of these landmarks, in this order.
fn marker_rows(landmarks: &[usize]) -> Array {
    let numbers = expected().markers.into_iter().flat_map(|markers| {
        landmarks.iter().flat_map(|l| <[f64; 3]>::from(markers[*l].unwrap())).collect::<Vec<f64>>()
    });
    Array::new(&[1, 3, landmarks.len(), 3], numbers.collect::<Vec<f64>>())
}

fn marker_names(landmarks: &[usize]) -> Array {
    Array::names(landmarks.iter().map(|l| LANDMARKS[*l].name()))
}

fn with(array: Array, index: usize, value: f64) -> Array {
    let Array { shape, values: Values::F64(mut values) } = array else { panic!() };
    values[index] = value;
    Array::new(&shape, values)
}

#[test]
fn permuted_columns_are_put_in_order_by_their_names() {
    let order = [5, 2, 0, 1, 4, 3];
    let permuted = [
        ("estimate_root", root_rows()),
        ("estimate_angles", angle_rows(order)),
        ("estimate_angle_names", angle_names(&order)),
    ];
    let found = read(&permuted).unwrap();
    assert_eq!(found.sequences, [expected()]);
    assert_eq!((found.frames_per_second, found.seeds, found.notes), (60.0, vec![5], Vec::<String>::new()));
    let unnamed = read(&[("estimate_root", root_rows()), ("estimate_angles", angle_rows([0, 1, 2, 3, 4, 5]))]).unwrap();
    assert_eq!(unnamed.sequences, [expected()]);
    assert!(unnamed.notes[0].contains("no estimate_angle_names"), "{:?}", unnamed.notes);
}

#[test]
fn missing_unknown_and_duplicate_names_are_reported() {
    let named = |names: Array| {
        read(&[
            ("estimate_root", root_rows()),
            ("estimate_angles", angle_rows([0, 1, 2, 3, 4, 5])),
            ("estimate_angle_names", names),
        ])
        .unwrap_err()
    };
    assert!(named(angle_names(&[0, 1, 2, 3, 4])).contains("\"right_leg\" is missing"));
    assert!(named(angle_names(&[0, 1, 2, 3, 4, 4])).contains("\"right_forearm\" appears twice"));
    assert!(named(Array::names(["left_upper_arm", "elbow"])).contains("\"elbow\" is not a degree of freedom"));
    let long = "x".repeat(5000);
    assert!(named(Array::names([long.as_str()])).len() < 300);
    let markers =
        |names: &[(&str, Array)]| read(&[&[("estimate_markers", marker_rows(&[0, 1]))], names].concat()).unwrap_err();
    assert!(markers(&[]).contains("estimate_markers needs marker_names"));
    assert!(
        markers(&[("marker_names", Array::names(["thorax", "tail"]))])
            .contains("\"tail\" is not a marker of HumanEva; expected thorax, pelvis, left_shoulder, ")
    );
    assert!(
        markers(&[("marker_names", marker_names(&[0, 1, 2]))]).contains("shape [1, 3, 2, 3], expected [1, 3, 3, 3]")
    );
}

#[test]
fn frames_of_nan_have_no_estimate_and_frames_half_nan_are_refused() {
    let nan_frame = |array: Array, width: usize| (width..2 * width).fold(array, |array, i| with(array, i, NAN));
    let poses = |root, angles| read(&[("estimate_root", root), ("estimate_angles", angles)]);
    let angles = angle_rows([0, 1, 2, 3, 4, 5]);
    let found = poses(nan_frame(root_rows(), 7), nan_frame(angles.clone(), 6)).unwrap();
    assert_eq!((found.sequences[0].pose(1), found.sequences[0].markers[1]), (None, [None; 15]));
    assert_eq!(found.sequences[0].pose(2), Some(&walk(3).poses[2]));
    let message = poses(nan_frame(root_rows(), 7), angles.clone()).unwrap_err();
    assert!(message.contains("seed 5, frame 1: only one of root and angles is NaN"), "{message}");
    let message = poses(root_rows(), with(angles.clone(), 8, NAN)).unwrap_err();
    assert!(
        message.contains("estimate_angles: seed 5, frame 1: expected only finite numbers, or only NaN"),
        "{message}"
    );
    let message = poses(with(root_rows(), 0, f64::INFINITY), angles).unwrap_err();
    assert!(message.contains("estimate_root: seed 5, frame 0"), "{message}");
}

#[test]
fn markers_alone_are_an_estimate_in_any_order_and_number() {
    let few = [14, 3, 1];
    let rows = (9..12).fold(marker_rows(&few), |array, i| with(array, i, NAN));
    let found = read(&[("estimate_markers", rows), ("marker_names", marker_names(&few))]).unwrap();
    let sequence = &found.sequences[0];
    assert_eq!(sequence.articulation, Articulation::Unknown);
    for (frame, truth) in expected().markers.iter().enumerate() {
        for (landmark, marker) in sequence.markers[frame].iter().enumerate() {
            let there = few.contains(&landmark) && (frame, landmark) != (1, 14);
            assert_eq!(*marker, truth[landmark].filter(|_| there), "frame {frame}, {landmark}");
        }
    }
    assert!(found.notes[0].contains("gives 3 of the 15 markers"), "{:?}", found.notes);
    let message = read(&[("estimate_markers", with(marker_rows(&few), 4, NAN)), ("marker_names", marker_names(&few))]);
    assert!(message.unwrap_err().contains("seed 5, frame 0: \"left_elbow\" is"));
}

#[test]
fn joints_alone_give_the_markers_at_the_joints_and_a_root_those_on_its_link() {
    let body = person();
    let names: Vec<&str> = body.joints.iter().rev().map(|joint| joint.name.as_str()).collect();
    let joints = walk(3).poses.into_iter().flat_map(|pose| {
        let frames = body.link_frames(&pose);
        let rows = frames.0.iter().skip(1).rev().flat_map(|f| <[f64; 3]>::from(f.translation.vector));
        rows.collect::<Vec<f64>>()
    });
    let joints = Array::new(&[1, 3, names.len(), 3], joints.collect::<Vec<f64>>());
    let arrays = [("estimate_joints", joints), ("estimate_joint_names", Array::names(names))];
    let has = |found: &Estimates| {
        let markers = found.sequences[0].markers[2].iter().enumerate();
        markers.filter_map(|(landmark, marker)| marker.map(|_| LANDMARKS[landmark].name())).collect::<Vec<_>>()
    };
    let alone = read(&arrays).unwrap();
    let on_joints = ["left_shoulder", "left_elbow", "right_shoulder", "right_elbow", "left_hip", "right_hip"];
    assert_eq!(has(&alone), on_joints);
    for (found, truth) in alone.sequences[0].markers.iter().flatten().zip(expected().markers.iter().flatten()) {
        assert!(found.is_none_or(|found| (found - truth.unwrap()).norm() < 1e-12));
    }
    let with_root = read(&[&arrays[..], &[("estimate_root", root_rows())]].concat()).unwrap();
    let on_root = ["thorax", "pelvis", "head_top"];
    assert_eq!(
        has(&with_root),
        [&on_root[..2], &on_joints[..], &on_root[2..]].concat(),
        "the head is fixed to the torso"
    );
    assert_eq!(with_root.sequences[0].roots(), expected().roots());
}

#[test]
fn joints_of_which_none_is_at_a_marker_are_refused_with_those_that_are() {
    let body = person();
    let without = |joint: &usize| body.markers_on_joint(*joint).next().is_none();
    let joint = (0..body.joints.len()).find(without).unwrap();
    let names = Array::names([body.joints[joint].name.as_str()]);
    let places = Array::new(&[1, 3, 1, 3], vec![0.5; 9]);
    let message = read(&[("estimate_joints", places), ("estimate_joint_names", names)]).unwrap_err();
    let (at, off) = message.split_once("; without: ").unwrap();
    assert!(at.contains("none of its joints is at one; ") && off.contains(&body.joints[joint].name), "{message}");
    for (index, joint) in body.joints.iter().enumerate() {
        let list = if without(&index) { off } else { at };
        assert!(list.contains(&joint.name), "{}: {message}", joint.name);
    }
}

#[test]
fn positions_given_twice_must_agree() {
    let both = |markers: Array| {
        read(&[
            ("estimate_root", root_rows()),
            ("estimate_angles", angle_rows([0, 1, 2, 3, 4, 5])),
            ("estimate_markers", markers),
            ("marker_names", marker_names(&[3, 4])),
        ])
    };
    assert_eq!(both(marker_rows(&[3, 4])).unwrap().sequences, [expected()]);
    let message = both(with(marker_rows(&[3, 4]), 10, 0.5)).unwrap_err();
    assert!(message.contains("estimate_markers: seed 5, frame 1: left_wrist is"), "{message}");
}

#[test]
fn a_file_without_an_estimate_says_what_is_expected() {
    assert!(read(&[]).unwrap_err().contains("contains no estimate; expected estimate_root and estimate_angles, or"));
    let angles = angle_rows([0, 1, 2, 3, 4, 5]);
    let alone = read(&[
        ("estimate_angles", angles),
        ("estimate_markers", marker_rows(&[0])),
        ("marker_names", marker_names(&[0])),
    ]);
    assert!(alone.unwrap_err().contains("estimate_angles needs estimate_root"));
    let none = Array::new(&[1, 0, 7], Vec::<f64>::new());
    assert!(read(&[("estimate_root", none)]).unwrap_err().contains("contains no frame"));
    let flat = Array::new(&[], vec![1.0]);
    assert!(read(&[("estimate_root", flat)]).unwrap_err().contains("contains no frame"));
}

#[test]
fn quaternions_in_single_precision_are_accepted() {
    let Values::F64(rows) = root_rows().values else { panic!() };
    let single = Array::new(&[1, 3, 7], rows.iter().map(|x| *x as f32).collect::<Vec<f32>>());
    let found = read(&[("estimate_root", single)]).unwrap().sequences[0].roots().unwrap();
    for (found, truth) in found.iter().zip(expected().roots().unwrap()) {
        let (found, truth) = (found.unwrap(), truth.unwrap());
        assert!((found.rotation.norm() - 1.0).abs() < 1e-12);
        assert!((found.inverse() * truth).rotation.angle() < 1e-6);
    }
    assert!(read(&[("estimate_root", with(root_rows(), 3, 2.0))]).unwrap_err().contains("not a rigid transform"));
}

#[test]
fn one_repetition_needs_neither_seeds_nor_their_axis() {
    let without_axis = |array: Array| Array { shape: array.shape[1..].to_vec(), ..array };
    let alone = |arrays: &[(&str, Array)], seeds: Option<Array>| {
        let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![60.0]))]);
        seeds.into_iter().for_each(|seeds| npz.push("seeds", seeds));
        arrays.iter().for_each(|(name, array)| npz.push(name, array.clone()));
        Estimates::from_bytes("p", &npz.to_bytes("p").unwrap(), &person()).map_err(|e| e.to_string())
    };
    let few = [1, 3];
    let names = ("marker_names", marker_names(&few));
    let with_axis = [("estimate_markers", marker_rows(&few)), names.clone()];
    let none = [("estimate_markers", without_axis(marker_rows(&few))), names.clone()];
    let expected = read(&with_axis).unwrap().sequences;
    let one = |seed: i64| Some(Array::new(&[1], vec![seed]));
    for (found, seeds) in [
        (alone(&none, None), [0]),
        (alone(&with_axis, None), [0]),
        (alone(&none, one(5)), [5]),
        (alone(&none, Some(Array::new(&[], vec![7_i64]))), [7]),
    ] {
        let found = found.unwrap();
        assert_eq!((found.sequences, found.seeds), (expected.clone(), seeds.to_vec()));
    }
    let poses = [
        ("estimate_root", without_axis(root_rows())),
        ("estimate_angles", without_axis(angle_rows([0, 1, 2, 3, 4, 5]))),
    ];
    assert_eq!(alone(&poses, None).unwrap().sequences, [self::expected()]);
    let several = alone(&none, Some(Array::new(&[2], vec![1_i64, 2])));
    assert!(several.unwrap_err().contains("several seeds"));
    let mixed = [("estimate_root", root_rows()), ("estimate_angles", without_axis(angle_rows([0, 1, 2, 3, 4, 5])))];
    assert!(alone(&mixed, None).unwrap_err().contains("use one form for all"));
}

#[test]
fn coordinates_and_angles_that_no_body_has_are_refused() {
    let few = [14, 3];
    for far in [1e300, -1.1e6] {
        let markers = [("estimate_markers", with(marker_rows(&few), 6 + 4, far)), ("marker_names", marker_names(&few))];
        let refused = read(&markers).unwrap_err();
        assert!(refused.contains("estimate_markers: seed 5, frame 1: \"left_elbow\" is at"), "{refused}");
        let refused = read(&[("estimate_root", with(root_rows(), 8, far))]).unwrap_err();
        assert!(refused.contains("estimate_root: seed 5, frame 1: the root is at"), "{refused}");
        let angles = with(angle_rows([0, 1, 2, 3, 4, 5]), 6, far);
        let refused = read(&[("estimate_root", root_rows()), ("estimate_angles", angles)]).unwrap_err();
        assert!(refused.contains("estimate_angles: seed 5, frame 1: an angle is beyond"), "{refused}");
    }
    assert!(read(&[("estimate_root", with(root_rows(), 7, 9e5))]).is_ok());
}
