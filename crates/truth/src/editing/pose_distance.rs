//! Distance between poses, independent of position and heading on the ground.
//!
//! A pose is compared together with the poses that follow it during a blend: the landmarks of several of these frames
//! form a point cloud. The distance of two clouds is the root mean square distance of corresponding points, minimised
//! over rotations about the vertical and translations on the ground (`[Kovar 2002]`, section 3.1). It therefore
//! includes velocities.

use nalgebra::{Complex, Isometry3, UnitQuaternion, Vector3};

use skiagraph_core::body::{Humanoid, LinkFrames, Markers, Motion};

/// Number of frames in a cloud, spread over a blend.
const SAMPLES: usize = 5;

/// The point clouds of a motion, one per frame followed by enough others.
pub(super) struct PoseClouds {
    clouds: Vec<Cloud>,
}

/// Landmarks during a blend. Points on the ground are complex numbers.
struct Cloud {
    centre: Complex<f64>,
    /// Positions on the ground relative to the centre.
    on_ground: Vec<Complex<f64>>,
    heights: Vec<f64>,
    /// Sum of squared horizontal distances from the centre.
    spread: f64,
}

/// The closest pair of frames of two motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closest {
    /// Frame of the first motion.
    pub(super) leaves: usize,
    /// Frame of the second motion.
    pub(super) enters: usize,
    /// Distance, metres.
    pub(super) distance_m: f64,
}

impl PoseClouds {
    /// The clouds of `motion` for blends of `blend` frames (at least 1). The cloud of frame `i` extends to `i + blend`.
    pub(super) fn new(body: &Humanoid, motion: &Motion, blend: usize) -> Self {
        let mut frames = LinkFrames::default();
        let of = |pose| {
            body.link_frames_into(pose, &mut frames);
            body.markers(&frames)
        };
        let markers: Vec<Markers> = motion.poses.iter().map(of).collect();
        let cloud = |first: usize| {
            let samples = (0..SAMPLES).map(|k| first + k * blend / (SAMPLES - 1));
            Cloud::from_points(samples.flat_map(|frame| markers[frame].iter().flatten().map(|p| p.coords)))
        };
        Self { clouds: (0..markers.len().saturating_sub(blend)).map(cloud).collect() }
    }

    /// Number of frames with a cloud.
    pub(super) fn len(&self) -> usize {
        self.clouds.len()
    }

    /// Distance between frame `own` and frame `others` of another motion of the same body, metres.
    pub(super) fn distance_m(&self, own: usize, other: &Self, others: usize) -> f64 {
        self.clouds[own].distance(&other.clouds[others])
    }

    /// The rotation about the vertical and horizontal translation that best align frame `others` of another motion with
    /// frame `own`.
    pub(super) fn alignment(&self, own: usize, other: &Self, others: usize) -> Isometry3<f64> {
        let (a, b) = (&self.clouds[own], &other.clouds[others]);
        let turn = a.correlation(b);
        let heading = if turn.norm_sqr() > 0.0 { libm::atan2(turn.im, turn.re) } else { 0.0 };
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        let shift = a.centre - b.centre * Complex::new(libm::cos(heading), libm::sin(heading));
        Isometry3::from_parts(Vector3::new(shift.re, shift.im, 0.0).into(), rotation)
    }
}

impl Cloud {
    fn from_points(points: impl Iterator<Item = Vector3<f64>>) -> Self {
        let points: Vec<Vector3<f64>> = points.collect();
        let on_ground: Vec<Complex<f64>> = points.iter().map(|p| Complex::new(p.x, p.y)).collect();
        let centre = on_ground.iter().sum::<Complex<f64>>() / on_ground.len().max(1) as f64;
        let on_ground: Vec<_> = on_ground.iter().map(|p| p - centre).collect();
        let spread = on_ground.iter().map(Complex::norm_sqr).sum();
        Self { centre, on_ground, heights: points.iter().map(|p| p.z).collect(), spread }
    }

    /// The argument of the result is the rotation that best aligns `other` with this cloud.
    fn correlation(&self, other: &Self) -> Complex<f64> {
        self.on_ground.iter().zip(&other.on_ground).map(|(p, q)| p * q.conj()).sum()
    }

    /// Root mean square distance after the best alignment: `sum |p - e^(i t) q|^2` is minimised by the argument `t` of
    /// the correlation, with the value `sum |p|^2 + sum |q|^2 - 2 |correlation|`.
    fn distance(&self, other: &Self) -> f64 {
        let vertical: f64 = self.heights.iter().zip(&other.heights).map(|(a, b)| (a - b) * (a - b)).sum();
        let correlation = self.correlation(other);
        let horizontal = self.spread + other.spread - 2.0 * libm::hypot(correlation.re, correlation.im);
        libm::sqrt((horizontal.max(0.0) + vertical) / self.heights.len().max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::editing::blending::moved;
    use crate::test_bodies::{person, walk};

    #[test]
    fn a_motion_moved_on_the_ground_has_distance_0_and_is_aligned_exactly() {
        let (body, motion) = (person(), walk(30));
        let there = Isometry3::new(Vector3::new(2.0, -3.0, 0.0), Vector3::z() * 2.1);
        let poses = motion.poses.iter().map(|pose| moved(pose, &there)).collect();
        let other = PoseClouds::new(&body, &Motion { poses, ..motion }, 8);
        let own = PoseClouds::new(&body, &motion, 8);
        assert_eq!(own.len(), 22);
        assert!(own.distance_m(5, &other, 5) < 1e-7, "{}", own.distance_m(5, &other, 5));
        assert!(own.distance_m(5, &other, 12) > 1e-3);
        let back = own.alignment(5, &other, 5) * there;
        assert!(back.translation.vector.norm() < 1e-9 && back.rotation.angle() < 1e-9);
    }

    #[test]
    fn the_closed_form_is_the_minimum_over_rotations_and_translations() {
        let (body, motion) = (person(), walk(40));
        let clouds = PoseClouds::new(&body, &motion, 4);
        let (a, b) = (3, 17);
        let smallest_m = clouds.distance_m(a, &clouds, b);
        let found = clouds.alignment(a, &clouds, b);
        let distance = |by: &Isometry3<f64>| {
            let markers = |frame: usize, by: &Isometry3<f64>| -> Vec<Vector3<f64>> {
                let pose = skiagraph_core::body::Pose {
                    world_from_root: by * motion.poses[frame].world_from_root,
                    ..motion.poses[frame].clone()
                };
                body.markers(&body.link_frames(&pose)).iter().flatten().map(|p| p.coords).collect()
            };
            let pairs: Vec<f64> = (0..SAMPLES)
                .flat_map(|k| {
                    let (own, other) = (markers(a + k, &Isometry3::identity()), markers(b + k, by));
                    own.iter().zip(&other).map(|(p, q)| (p - q).norm_squared()).collect::<Vec<_>>()
                })
                .collect();
            (pairs.iter().sum::<f64>() / pairs.len() as f64).sqrt()
        };
        assert!((distance(&found) - smallest_m).abs() < 1e-12);
        for nudge in [Vector3::<f64>::x(), -Vector3::x(), Vector3::y(), -Vector3::y()] {
            assert!(distance(&(Isometry3::translation(0.01 * nudge.x, 0.01 * nudge.y, 0.0) * found)) > smallest_m);
            let turn = Isometry3::rotation(Vector3::z() * 0.02 * nudge.x);
            assert!(nudge.x == 0.0 || distance(&(found * turn)) > smallest_m);
        }
    }
}
