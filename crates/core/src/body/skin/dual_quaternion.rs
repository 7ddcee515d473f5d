//! Rigid motions as dual quaternions, and their blend (`[Kavan 2007]`).

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion};

/// A rigid motion: `real` is the rotation, `dual` half the translation times the rotation.
pub(super) struct DualQuaternion {
    real: Quaternion<f64>,
    dual: Quaternion<f64>,
}

impl DualQuaternion {
    pub(super) fn from_isometry(motion: &Isometry3<f64>) -> Self {
        let real = motion.rotation.into_inner();
        let translation = Quaternion::from_imag(motion.translation.vector);
        Self { real, dual: translation * real * 0.5 }
    }
}

/// A point moved by the blend of some motions, whose weights sum to 1. Rotations are blended on the hemisphere of the
/// first.
pub(super) fn blended<'a>(shares: impl Iterator<Item = (&'a DualQuaternion, f64)>, point: &Point3<f64>) -> Point3<f64> {
    let mut pivot: Option<Quaternion<f64>> = None;
    let (mut real, mut dual) = (Quaternion::new(0.0, 0.0, 0.0, 0.0), Quaternion::new(0.0, 0.0, 0.0, 0.0));
    for (motion, weight) in shares {
        let pivot = pivot.get_or_insert(motion.real);
        let weight = if pivot.coords.dot(&motion.real.coords) < 0.0 { -weight } else { weight };
        real += motion.real * weight;
        dual += motion.dual * weight;
    }
    let norm = real.norm();
    let (real, dual) = (real / norm, dual / norm);
    let translation = (dual * real.conjugate()).imag() * 2.0;
    UnitQuaternion::new_unchecked(real) * point + translation
}
