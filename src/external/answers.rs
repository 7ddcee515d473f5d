//! Converts a program's answers to estimates, by way of the arrays of a `poses.npz`.

use std::collections::BTreeMap;

use super::protocol::{Named, RepliedPose};
use crate::common::ExperimentError;
use skiagraph_core::body::LANDMARKS;
use skiagraph_core::npz::{Array, Npz};
use skiagraph_set::{BlindSet, Estimates, zeros_as_missing};

/// Answers of all seeds, `[seed][frame]`.
pub(super) type Poses = Vec<Vec<Option<RepliedPose>>>;

/// The estimates of these answers, which are all of one kind. A program that never answered lost every frame.
pub(super) fn estimates(set: &BlindSet, seeds: &[u64], poses: &Poses) -> Result<Estimates, ExperimentError> {
    let whole: Vec<i64> = seeds.iter().map(|seed| i64::try_from(*seed).unwrap_or(i64::MAX)).collect();
    let mut npz = Npz::from_iter([
        ("fps", Array::new(&[], vec![set.frames_per_second])),
        ("seeds", Array::new(&[whole.len()], whole)),
    ]);
    let shape = [seeds.len(), set.frame_count];
    let body = &set.start.body;
    match poses.iter().flatten().flatten().next() {
        Some(RepliedPose::Angles { .. }) => {
            let degrees = body.degrees_of_freedom.len();
            let (mut roots, mut all) = (Vec::new(), Vec::new());
            for pose in poses.iter().flatten() {
                match pose {
                    Some(RepliedPose::Angles { root, angles }) => {
                        roots.extend(root);
                        all.extend(angles);
                    }
                    _ => {
                        roots.extend([f64::NAN; 7]);
                        all.extend(std::iter::repeat_n(f64::NAN, degrees));
                    }
                }
            }
            npz.push("estimate_root", Array::new(&[shape[0], shape[1], 7], roots));
            npz.push("estimate_angles", Array::new(&[shape[0], shape[1], degrees], all));
            npz.push("estimate_angle_names", Array::names(body.degrees_of_freedom.iter().map(|d| d.name.as_str())));
        }
        Some(RepliedPose::Joints(_)) => {
            let names: Vec<&str> = body.joints.iter().map(|joint| joint.name.as_str()).collect();
            push_points(&mut npz, ["estimate_joints", "estimate_joint_names"], &shape, &names, poses);
        }
        _ => {
            let names = LANDMARKS.map(|landmark| landmark.name());
            push_points(&mut npz, ["estimate_markers", "marker_names"], &shape, &names, poses);
        }
    }
    let file = "the program's answers";
    // as in files: many programs answer 0, 0, 0 for a point that they did not find
    let (npz, zeros) = zeros_as_missing(&npz, file)?;
    let mut estimates = Estimates::from_npz(file, npz, body, Vec::new())?;
    estimates.notes.extend(zeros);
    Ok(estimates)
}

fn push_points(npz: &mut Npz, [array, names_array]: [&str; 2], shape: &[usize; 2], names: &[&str], poses: &Poses) {
    let empty = BTreeMap::new();
    let of = |pose: &Option<RepliedPose>| -> Vec<f64> {
        let given: &Named = match pose {
            Some(RepliedPose::Markers(given) | RepliedPose::Joints(given)) => given,
            _ => &empty,
        };
        names.iter().flat_map(|name| given.get(*name).copied().unwrap_or([f64::NAN; 3])).collect()
    };
    let numbers: Vec<f64> = poses.iter().flatten().flat_map(of).collect();
    npz.push(array, Array::new(&[shape[0], shape[1], names.len(), 3], numbers));
    npz.push(names_array, Array::names(names.iter().copied()));
}
