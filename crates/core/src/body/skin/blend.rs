//! Vertex positions after the links have moved.

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, UnitQuaternion, Vector3};

use super::{Blending, Skin};
use crate::body::LinkFrames;

/// The contribution of one link to a vertex: `R point + weight t`, with the link's rotation `R` and translation `t`.
#[derive(Clone, Copy, Debug)]
pub(super) struct SkinTerm {
    link: u32,
    weight: f64,
    /// The vertex in the link's frame, times the weight.
    point: Vector3<f64>,
}

impl Skin {
    /// `T_i(bind)^-1 v0` of every influence.
    pub(super) fn bone_local(&self) -> Vec<SkinTerm> {
        let of_vertex = |vertex: usize| {
            let point = self.vertices[vertex];
            self.influences(vertex).map(move |(link, weight)| SkinTerm {
                link: link as u32,
                weight,
                point: self.bind[link].inverse_transform_point(&point).coords * weight,
            })
        };
        (0..self.vertices.len()).flat_map(of_vertex).collect()
    }

    /// The vertices with the links at `frames`, world, metres; `deformed` is cleared first.
    pub fn deform_into(&self, frames: &LinkFrames, deformed: &mut Vec<Point3<f64>>) {
        self.deform_with(&Isometry3::identity(), frames, deformed);
    }

    /// As [`Self::deform_into`], in another frame than the world's.
    #[doc(hidden)]
    pub fn deform_with(&self, view_from_world: &Isometry3<f64>, frames: &LinkFrames, deformed: &mut Vec<Point3<f64>>) {
        deformed.clear();
        let view_from_links: Vec<Isometry3<f64>> =
            frames.0.iter().map(|world_from_link| view_from_world * world_from_link).collect();
        match self.blending {
            Blending::Linear => self.blend_linearly(&view_from_links, deformed),
            Blending::DualQuaternion => {
                let moves: Vec<_> = view_from_links
                    .iter()
                    .zip(&self.bind)
                    .map(|(now, bind)| DualQuaternion::from_isometry(&(now * bind.inverse())))
                    .collect();
                deformed.extend((0..self.vertices.len()).map(|vertex| {
                    let shares = self.influences(vertex).map(|(link, weight)| (&moves[link], weight));
                    blended(shares, &self.vertices[vertex])
                }));
            }
        }
    }

    fn blend_linearly(&self, view_from_links: &[Isometry3<f64>], deformed: &mut Vec<Point3<f64>>) {
        let links: Vec<(Matrix3<f64>, Vector3<f64>)> = view_from_links
            .iter()
            .map(|frame| (frame.rotation.to_rotation_matrix().into_inner(), frame.translation.vector))
            .collect();
        deformed.extend(self.first.windows(2).map(|range| {
            let terms = &self.terms[range[0] as usize..range[1] as usize];
            let sum = terms.iter().fold(Vector3::zeros(), |sum, term| {
                let (rotation, place) = &links[term.link as usize];
                sum + rotation * term.point + place * term.weight
            });
            Point3::from(sum)
        }));
    }

    /// The vertices whose dominant link is one of `links`, with the links at `frames`: the link and the position,
    /// world.
    pub(crate) fn deformed_parts<'a>(
        &'a self,
        frames: &'a LinkFrames,
        links: &'a [usize],
    ) -> impl Iterator<Item = (usize, Point3<f64>)> + 'a {
        let own = (0..self.vertices.len()).filter(|&vertex| links.contains(&(self.parts[vertex] as usize)));
        own.map(|vertex| (self.parts[vertex] as usize, self.deformed(vertex, frames)))
    }

    /// One vertex with the links at `frames`, world.
    fn deformed(&self, vertex: usize, frames: &LinkFrames) -> Point3<f64> {
        if self.blending == Blending::DualQuaternion {
            let moves: Vec<_> = self
                .influences(vertex)
                .map(|(link, weight)| {
                    (DualQuaternion::from_isometry(&(frames[link] * self.bind[link].inverse())), weight)
                })
                .collect();
            return blended(moves.iter().map(|(q, weight)| (q, *weight)), &self.vertices[vertex]);
        }
        let terms = &self.terms[self.first[vertex] as usize..self.first[vertex + 1] as usize];
        let carried = |term: &SkinTerm| {
            let frame = &frames[term.link as usize];
            frame.rotation * term.point + frame.translation.vector * term.weight
        };
        Point3::from(terms.iter().map(carried).sum::<Vector3<f64>>())
    }
}

/// A rigid motion as a dual quaternion: `real` is the rotation, `dual` half the translation times the rotation.
struct DualQuaternion {
    real: Quaternion<f64>,
    dual: Quaternion<f64>,
}

impl DualQuaternion {
    fn from_isometry(motion: &Isometry3<f64>) -> Self {
        let real = motion.rotation.into_inner();
        let translation = Quaternion::from_imag(motion.translation.vector);
        Self { real, dual: translation * real * 0.5 }
    }
}

/// A point moved by a blend of motions, with weights summing to 1 (`[Kavan 2007]`). Rotations are blended in the
/// hemisphere of the first.
fn blended<'a>(shares: impl Iterator<Item = (&'a DualQuaternion, f64)>, point: &Point3<f64>) -> Point3<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::skin::Influence;

    /// A tube of radius 1 along x between two links that meet at the origin, with the ring there shared equally.
    fn tube() -> Skin {
        let ring = |x: f64| {
            (0..12).map(move |k| {
                let (sin, cos) = libm::sincos(f64::from(k) * core::f64::consts::TAU / 12.0);
                Point3::new(x, cos, sin)
            })
        };
        let vertices: Vec<_> = [-2.0, 0.0, 2.0].into_iter().flat_map(ring).collect();
        let of = |ring: usize| match ring {
            0 => vec![Influence { link: 0, weight: 1.0 }],
            1 => vec![Influence { link: 0, weight: 0.5 }, Influence { link: 1, weight: 0.5 }],
            _ => vec![Influence { link: 1, weight: 1.0 }],
        };
        let influences: Vec<_> = (0..36).map(|vertex| of(vertex / 12)).collect();
        let quads = (0..2_u32).flat_map(|r| {
            (0..12).map(move |k| [12 * r + k, 12 * r + (k + 1) % 12, 12 * r + 12 + k, 12 * r + 12 + (k + 1) % 12])
        });
        let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [b, d, c]]).collect();
        Skin::assemble("tube", vertices, triangles, &influences, vec![Isometry3::identity(); 2])
    }

    /// Radius of the shared ring after rotating the second link, in the plane of the ring's own axis.
    fn middle_radius(skin: &Skin, turn: UnitQuaternion<f64>) -> f64 {
        let frames = LinkFrames(vec![Isometry3::identity(), Isometry3::from_parts(Vector3::zeros().into(), turn)]);
        let mut vertices = Vec::new();
        skin.deform_into(&frames, &mut vertices);
        vertices[12..24].iter().map(|p| p.coords.norm()).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn linear_blending_collapses_a_turned_ring_by_the_cosine_of_half_the_angle_and_dual_quaternions_do_not() {
        // twisted about the axis of the tube, and bent across it
        for (axis, degrees) in [(0, 0.0_f64), (0, 45.0), (0, 90.0), (0, 150.0), (0, 179.0), (2, 90.0), (2, 150.0)] {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::ith_axis(axis), degrees.to_radians());
            let expected = libm::cos(0.5 * degrees.to_radians());
            assert!((middle_radius(&tube(), turn) - expected).abs() < 1e-12, "{axis} {degrees}");
            let cured = tube().with_blending(Blending::DualQuaternion);
            assert!((middle_radius(&cured, turn) - 1.0).abs() < 1e-9, "{axis} {degrees}");
        }
    }

    #[test]
    fn the_bind_pose_gives_the_mesh_and_a_rigid_motion_moves_it_rigidly_in_both_blendings() {
        let skin = tube();
        let by = Isometry3::new(Vector3::new(0.3, -2.0, 1.0), Vector3::new(0.4, 1.1, -0.7));
        for blending in [Blending::Linear, Blending::DualQuaternion] {
            let skin = skin.clone().with_blending(blending);
            let mut vertices = Vec::new();
            skin.deform_into(&LinkFrames(vec![by; 2]), &mut vertices);
            for (now, was) in vertices.iter().zip(skin.vertices()) {
                assert!((now - by * was).norm() < 1e-12);
            }
            for (vertex, (part, place)) in skin.deformed_parts(&LinkFrames(vec![by; 2]), &[0, 1]).enumerate() {
                assert_eq!(part, skin.parts()[vertex] as usize);
                assert!((place - vertices[vertex]).norm() < 1e-12);
            }
        }
    }
}
