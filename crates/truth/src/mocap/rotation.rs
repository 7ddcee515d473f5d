//! Rotations of recordings: about coordinate axes, interpolation, sign continuity.

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

/// A coordinate axis, as in channel names and Acclaim's axis orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CoordinateAxis {
    X,
    Y,
    Z,
}

impl CoordinateAxis {
    /// The axis of a letter, upper or lower case.
    pub(super) fn from_letter(letter: char) -> Option<Self> {
        match letter.to_ascii_lowercase() {
            'x' => Some(Self::X),
            'y' => Some(Self::Y),
            'z' => Some(Self::Z),
            _ => None,
        }
    }

    /// 0, 1 or 2.
    pub(super) fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// The rotation by `angle` radians about this axis, computed with libm for identical bits on every machine.
    pub(super) fn turn(self, angle: f64) -> UnitQuaternion<f64> {
        let (sin, cos) = libm::sincos(0.5 * angle);
        let mut imaginary = Vector3::zeros();
        imaginary[self.index()] = sin;
        Unit::new_unchecked(Quaternion::from_parts(cos, imaginary))
    }
}

/// Interpolates from `a` (share 0) to `b` (share 1): positions linearly, rotations by slerp along the shorter arc.
/// Shares 0 and 1 return `a` and `b` bit for bit.
pub(super) fn between(a: &Isometry3<f64>, b: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    if share <= 0.0 {
        return *a;
    }
    if share >= 1.0 {
        return *b;
    }
    let translation = a.translation.vector.lerp(&b.translation.vector, share);
    let rotation = a.rotation * (a.rotation.inverse() * b.rotation).powf(share);
    Isometry3::from_parts(Translation3::from(translation), rotation)
}

/// Chooses, of the two quaternions of each rotation, the one nearer to the previous frame (`w >= 0` in the first).
pub(super) fn make_signs_continuous(frames: &mut [Vec<Isometry3<f64>>]) {
    let Some(first) = frames.first_mut() else { return };
    for transform in first.iter_mut() {
        if transform.rotation.w < 0.0 {
            flip_sign(transform);
        }
    }
    for index in 1..frames.len() {
        let (before, rest) = frames.split_at_mut(index);
        for (previous, transform) in before[index - 1].iter().zip(&mut rest[0]) {
            if previous.rotation.coords.dot(&transform.rotation.coords) < 0.0 {
                flip_sign(transform);
            }
        }
    }
}

fn flip_sign(transform: &mut Isometry3<f64>) {
    transform.rotation = Unit::new_unchecked(-transform.rotation.into_inner());
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn a_quarter_turn_takes_each_axis_to_the_next() {
        let quarter = core::f64::consts::FRAC_PI_2;
        assert_relative_eq!(CoordinateAxis::X.turn(quarter) * Vector3::y(), Vector3::z(), epsilon = 1e-15);
        assert_relative_eq!(CoordinateAxis::Y.turn(quarter) * Vector3::z(), Vector3::x(), epsilon = 1e-15);
        assert_relative_eq!(CoordinateAxis::Z.turn(quarter) * Vector3::x(), Vector3::y(), epsilon = 1e-15);
    }

    #[test]
    fn between_keeps_its_ends_and_turns_at_constant_speed() {
        let a = Isometry3::from_parts(Translation3::new(1.0, 0.0, 0.0), CoordinateAxis::Z.turn(0.3));
        let b = Isometry3::from_parts(Translation3::new(3.0, 2.0, 0.0), CoordinateAxis::Z.turn(1.5));
        assert_eq!(between(&a, &b, 0.0), a);
        assert_eq!(between(&a, &b, 1.0), b);
        let quarter = between(&a, &b, 0.25);
        assert_relative_eq!(quarter.rotation.angle_to(&CoordinateAxis::Z.turn(0.6)), 0.0, epsilon = 1e-12);
        assert_relative_eq!(quarter.translation.vector, Vector3::new(1.5, 0.5, 0.0), epsilon = 1e-15);
    }

    #[test]
    fn between_takes_the_shorter_arc_whatever_the_sign() {
        let a = Isometry3::identity();
        let mut b = Isometry3::from_parts(Translation3::identity(), CoordinateAxis::Y.turn(0.8));
        flip_sign(&mut b);
        assert_relative_eq!(between(&a, &b, 0.5).rotation.angle(), 0.4, epsilon = 1e-12);
    }

    #[test]
    fn a_full_turn_in_small_steps_keeps_its_sign() {
        let mut frames: Vec<_> = (0..200)
            .map(|i| {
                let rotation = UnitQuaternion::from_matrix(
                    &CoordinateAxis::X.turn(f64::from(i) * 0.1).to_rotation_matrix().into_inner(),
                );
                vec![Isometry3::from_parts(Translation3::identity(), rotation)]
            })
            .collect();
        make_signs_continuous(&mut frames);
        assert!(frames.windows(2).all(|w| w[0][0].rotation.coords.dot(&w[1][0].rotation.coords) > 0.99));
    }
}
