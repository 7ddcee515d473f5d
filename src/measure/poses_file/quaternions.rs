//! Detects root quaternions whose real part is last.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, UnitQuaternion};

use super::read_as::ReadAs;
use crate::benchmark_set::{Articulation, Estimates};

/// A first estimate turned by more than this from the start pose, radians, is probably misread.
const FAR: f64 = 0.5;
/// A first estimate turned by less than this is right.
const NEAR: f64 = 0.2;

/// A note if the roots of frame 0 in all seeds are far from the start pose when read as w x y z, and near it when read
/// as x y z w. `None` otherwise, and without roots.
///
/// The order changes neither the length of the quaternions nor their continuity, so only the start pose, which every
/// tracker is given, can show it.
pub(super) fn note(estimates: &Estimates, read_as: &ReadAs, start: &UnitQuaternion<f64>) -> Option<String> {
    let roots: Vec<Isometry3<f64>> =
        estimates.sequences.iter().filter_map(|seed| first_root(&seed.articulation)).collect();
    let set_from_file = rotation(&read_as.order.set_from_file())?;
    let turned = |root: &Isometry3<f64>| {
        let otherwise = with_real_part_last(&(set_from_file.inverse() * root.rotation));
        [root.rotation.angle_to(start), (set_from_file * otherwise).angle_to(start)]
    };
    let turned: Vec<[f64; 2]> = roots.iter().map(turned).collect();
    let is_last = |[read, otherwise]: &[f64; 2]| *read > FAR && *otherwise < NEAR;
    let [read, otherwise] = *turned.first().filter(|_| turned.iter().all(is_last))?;
    Some(format!(
        "may have the real part of its root quaternions last: frame 0 is turned by {:.0} degrees from the set's start pose \
         (start/start.json) as read, in the order w x y z, and by {:.0} if they are x y z w; write estimate_root as \
         x y z qw qx qy qz, in NumPy root[..., [0, 1, 2, 6, 3, 4, 5]]",
        read.to_degrees(),
        otherwise.to_degrees()
    ))
}

fn first_root(articulation: &Articulation) -> Option<Isometry3<f64>> {
    match articulation {
        Articulation::Poses(poses) => poses.first()?.as_ref().map(|pose| pose.world_from_root),
        Articulation::Roots(roots) => *roots.first()?,
        Articulation::Unknown => None,
    }
}

/// The rotation of numbers x y z w that were read as w x y z.
fn with_real_part_last(read: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(read.k, read.w, read.i, read.j))
}

/// The rotation of a matrix; `None` for mirrored axes, for which poses are refused.
fn rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    (matrix.determinant() > 0.0)
        .then(|| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix)))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::{ASSUMED, PosesDeclared};
    use super::*;
    use crate::benchmark_set::EstimatedSequence;

    fn note_for(rotations: &[UnitQuaternion<f64>], start: &UnitQuaternion<f64>, axes: Option<&str>) -> Option<String> {
        let declared = PosesDeclared { axes: axes.map(|axes| axes.parse().unwrap()), ..PosesDeclared::default() };
        let read_as = ReadAs::new(Path::new("a.npz"), ASSUMED, &declared);
        let sequence = |rotation: &UnitQuaternion<f64>| EstimatedSequence {
            articulation: Articulation::Roots(vec![Some(Isometry3::from_parts(Default::default(), *rotation))]),
            markers: vec![[None; 15]],
            covariances: Vec::new(),
        };
        let sequences = rotations.iter().map(sequence).collect();
        let seeds = (0..rotations.len() as u64).collect();
        let estimates = Estimates { frames_per_second: 60.0, seeds, sequences, bodies: Vec::new(), notes: Vec::new() };
        note(&estimates, &read_as, start)
    }

    /// The rotation that is read as w x y z if this one was written as x y z w.
    fn written_last(rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        UnitQuaternion::new_unchecked(Quaternion::new(rotation.i, rotation.j, rotation.k, rotation.w))
    }

    #[test]
    fn a_real_part_at_the_end_is_detected_and_one_at_the_beginning_is_accepted() {
        let turn = |roll: f64, pitch: f64, yaw: f64| UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        for start in [turn(0.0, 0.0, 0.0), turn(0.1, -0.2, 1.0), turn(0.0, 0.3, -2.8), turn(0.02, 0.01, 1.5)] {
            let near = turn(0.02, -0.03, 0.05) * start;
            assert_eq!(note_for(&[near, near], &start, None), None);
            let found = note_for(&[written_last(&near), written_last(&start)], &start, None).unwrap();
            assert!(found.contains("if they are x y z w") && found.contains("[0, 1, 2, 6, 3, 4, 5]"), "{found}");
            assert_eq!(note_for(&[written_last(&near), near], &start, None), None, "one seed is right");
            assert_eq!(note_for(&[turn(0.0, 0.0, 1.0) * start], &start, None), None, "merely turned");
            // in the axes of a file
            let order: crate::evaluation::AxisOrder = "y,z,x".parse().unwrap();
            let set_from_file = rotation(&order.set_from_file()).unwrap();
            let read = set_from_file * written_last(&(set_from_file.inverse() * near));
            assert!(note_for(&[read], &start, Some("y,z,x")).is_some());
        }
        assert_eq!(note_for(&[], &turn(0.0, 0.0, 0.0), None), None);
    }
}
