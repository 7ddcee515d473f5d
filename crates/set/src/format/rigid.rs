//! Rigid transforms in files: position, then a unit quaternion `w x y z` with `w >= 0`.

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// Greatest coordinate, metres.
const FARTHEST: f64 = 1e6;

/// A rigid transform in a JSON file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RigidRecord {
    /// Metres.
    pub(crate) position: [f64; 3],
    /// Unit quaternion, `w >= 0`.
    pub(crate) quaternion_wxyz: [f64; 4],
}

/// Position and quaternion in one row, as in `truth.npz`: `x y z qw qx qy qz`.
pub(crate) fn to_row(transform: &Isometry3<f64>) -> [f64; 7] {
    let q = transform.rotation.quaternion();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let t = &transform.translation;
    [t.x, t.y, t.z, sign * q.w, sign * q.i, sign * q.j, sign * q.k]
}

/// The exact transform of a row of [`to_row`]; an error message for an invalid row.
pub(crate) fn from_row(row: &[f64; 7]) -> Result<Isometry3<f64>, String> {
    let [x, y, z, w, i, j, k] = *row;
    let quaternion = Quaternion::new(w, i, j, k);
    // the comparison is false for NaN
    if !((quaternion.norm() - 1.0).abs() < 1e-9 && [x, y, z].iter().all(|c| c.abs() <= FARTHEST)) {
        return Err(format!(
            "{row:?} is not a rigid transform; expected x y z within {FARTHEST} m and a unit quaternion w x y z"
        ));
    }
    Ok(Isometry3::from_parts(Translation3::from(Vector3::new(x, y, z)), Unit::new_unchecked(quaternion)))
}

/// As [`from_row`], for a rounded row: a quaternion whose length differs from 1 by less than 0.001 is normalised.
pub(crate) fn from_rounded_row(row: &[f64; 7]) -> Result<Isometry3<f64>, String> {
    let [x, y, z, w, i, j, k] = *row;
    let norm = Quaternion::new(w, i, j, k).norm();
    match (norm - 1.0).abs() {
        off if (1e-9..1e-3).contains(&off) => from_row(&[x, y, z, w / norm, i / norm, j / norm, k / norm]),
        _ => from_row(row),
    }
}

impl RigidRecord {
    pub(crate) fn new(transform: &Isometry3<f64>) -> Self {
        let [x, y, z, w, i, j, k] = to_row(transform);
        Self { position: [x, y, z], quaternion_wxyz: [w, i, j, k] }
    }

    pub(crate) fn transform(&self) -> Result<Isometry3<f64>, String> {
        let ([x, y, z], [w, i, j, k]) = (self.position, self.quaternion_wxyz);
        from_row(&[x, y, z, w, i, j, k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, UnitQuaternion};

    #[test]
    fn a_row_keeps_the_transform_and_has_no_negative_w() {
        let rotation = UnitQuaternion::from_euler_angles(2.0, -1.0, 3.0);
        for rotation in [rotation, Unit::new_unchecked(-rotation.into_inner())] {
            let transform = Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), rotation);
            let row = to_row(&transform);
            assert!(row[3] >= 0.0);
            let back = from_row(&row).unwrap();
            assert_eq!(to_row(&back), row);
            let p = Point3::new(0.3, 0.1, -0.7);
            assert_eq!(back * p, transform * p);
        }
    }

    #[test]
    fn rows_that_are_not_a_transform_are_refused() {
        assert!(from_row(&[0.0; 7]).is_err());
        assert!(from_row(&[f64::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).is_err());
        assert!(from_row(&[0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0]).is_err());
    }
}
