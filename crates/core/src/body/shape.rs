//! The same body with other lengths and girths.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::solid::vertex_bounds;
use super::{Humanoid, Inertia, Solid};
use crate::raster::TaperedCapsule;

/// Scale factors of one link relative to the original humanoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkShape {
    /// Factors along the link's own axes on all positions in its frame: the joints of its children, its geometry, its
    /// markers, its centre of mass; > 0.
    pub length: Vector3<f64>,
    /// Factor on the radii of its geometry; > 0.
    pub girth: f64,
}

impl LinkShape {
    /// No change.
    pub const SAME: Self = Self { length: Vector3::new(1.0, 1.0, 1.0), girth: 1.0 };
}

/// Lengths and girths of a whole body relative to a humanoid: one [`LinkShape`] per link, in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyShape {
    /// One per link; links beyond the end are unchanged.
    pub links: Vec<LinkShape>,
}

impl BodyShape {
    /// The shape without changes.
    pub fn identity(humanoid: &Humanoid) -> Self {
        Self { links: vec![LinkShape::SAME; humanoid.links.len()] }
    }

    /// This shape followed by `next`.
    pub fn then(&self, next: &Self) -> Self {
        let at = |shape: &Self, link: usize| shape.links.get(link).copied().unwrap_or(LinkShape::SAME);
        let both = |link| {
            let (first, second) = (at(self, link), at(next, link));
            LinkShape { length: first.length.component_mul(&second.length), girth: first.girth * second.girth }
        };
        Self { links: (0..self.links.len().max(next.links.len())).map(both).collect() }
    }
}

impl Humanoid {
    /// The same body with the lengths and girths of `shape`.
    ///
    /// Boxes, cylinders and meshes scale with the length along their longest direction and with the girth across it. A
    /// link's mass scales with its length (along the line from its origin to its centre of mass) and the square of its
    /// girth, at constant density. A skin follows the solids. Angles, limits and joint axes do not change.
    pub fn reshaped(&self, shape: &BodyShape) -> Self {
        let mut body = self.clone();
        for (index, change) in shape.links.iter().enumerate().take(self.links.len()) {
            let link = &mut body.links[index];
            link.solids.iter_mut().for_each(|solid| *solid = change.solid(solid));
            link.inertia = link.inertia.as_ref().map(|inertia| change.inertia(inertia));
            for joint in body.joints.iter_mut().filter(|j| j.parent == index) {
                let offset = &mut joint.parent_from_joint.translation.vector;
                *offset = offset.component_mul(&change.length);
            }
            for marker in body.markers.iter_mut().flatten().filter(|m| m.link == index) {
                marker.point_in_link = change.place(&marker.point_in_link);
            }
        }
        body.skin = self.skin.as_ref().map(|skin| Arc::new(skin.reshaped(self, shape)));
        body
    }
}

impl LinkShape {
    fn place(&self, point: &Point3<f64>) -> Point3<f64> {
        point.coords.component_mul(&self.length).into()
    }

    /// Factor on lengths along the unit vector `direction` of the link's frame.
    fn along(&self, direction: &Vector3<f64>) -> f64 {
        direction.component_mul(&self.length).norm()
    }

    fn frame(&self, frame: &Isometry3<f64>) -> Isometry3<f64> {
        let place = frame.translation.vector.component_mul(&self.length);
        Isometry3::from_parts(place.into(), frame.rotation)
    }

    /// A solid of the link with this shape.
    #[doc(hidden)]
    pub fn solid(&self, solid: &Solid) -> Solid {
        match solid {
            Solid::TaperedCapsule(c) => Solid::TaperedCapsule(TaperedCapsule {
                a: self.place(&c.a),
                b: self.place(&c.b),
                radius_a: c.radius_a * self.girth,
                radius_b: c.radius_b * self.girth,
            }),
            Solid::Box { link_from_box, half_extents } => {
                let longest = Vector3::from(*half_extents).imax();
                let mut half_extents = half_extents.map(|h| h * self.girth);
                let direction = link_from_box.rotation * Vector3::ith_axis(longest).into_inner();
                half_extents[longest] *= self.along(&direction) / self.girth;
                Solid::Box { link_from_box: self.frame(link_from_box), half_extents }
            }
            Solid::Cylinder { link_from_cylinder, radius, half_length } => Solid::Cylinder {
                link_from_cylinder: self.frame(link_from_cylinder),
                radius: radius * self.girth,
                half_length: half_length * self.along(&(link_from_cylinder.rotation * Vector3::z())),
            },
            Solid::Mesh { vertices, triangles } => {
                let (low, high) = vertex_bounds(vertices);
                let middle = nalgebra::center(&low, &high);
                let mut factors = Vector3::repeat(self.girth);
                let longest = (high - low).imax();
                factors[longest] = self.length[longest];
                let moved = self.place(&middle);
                let vertices = vertices.iter().map(|v| moved + (v - middle).component_mul(&factors)).collect();
                Solid::Mesh { vertices, triangles: triangles.clone() }
            }
        }
    }

    /// Scales the link's second moments along the limb by its length and across it by its girth, at constant density.
    fn inertia(&self, inertia: &Inertia) -> Inertia {
        let limb = inertia.centre_of_mass.coords.try_normalize(1e-3);
        let length = limb.map_or_else(|| libm::cbrt(self.length.product()), |l| self.along(&l));
        let growth = length * self.girth * self.girth;
        let across = Matrix3::from_diagonal_element(self.girth);
        let stretch = match limb {
            Some(limb) => across + limb * limb.transpose() * (length - self.girth),
            None => Matrix3::from_diagonal_element(libm::cbrt(growth)),
        };
        let moments = Matrix3::from_diagonal_element(0.5 * inertia.tensor.trace()) - inertia.tensor;
        let moments = stretch * moments * stretch.transpose() * growth;
        Inertia {
            mass: inertia.mass * growth,
            centre_of_mass: self.place(&inertia.centre_of_mass),
            tensor: Matrix3::from_diagonal_element(moments.trace()) - moments,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    #[test]
    fn a_longer_thigh_moves_the_knee_and_everything_below_it() {
        let body = shipped("actor").unwrap();
        let mut shape = BodyShape::identity(&body);
        let thigh = body.find_link("left_thigh").unwrap();
        shape.links[thigh] = LinkShape { length: Vector3::new(1.0, 1.0, 1.1), girth: 1.2 };
        let longer = body.reshaped(&shape);
        let markers = |b: &Humanoid| b.markers(&b.link_frames(&b.zero_pose()));
        let (before, after) = (markers(&body), markers(&longer));
        for (landmark, (b, a)) in crate::body::LANDMARKS.iter().zip(before.iter().zip(&after)) {
            let drop = b.unwrap().z - a.unwrap().z;
            let expected = if ["left_knee", "left_ankle"].contains(&landmark.name()) { 0.1 * 0.42875 } else { 0.0 };
            assert!((drop - expected).abs() < 1e-4, "{}: {drop}", landmark.name());
        }
        let growth =
            longer.links[thigh].inertia.as_ref().unwrap().mass / body.links[thigh].inertia.as_ref().unwrap().mass;
        assert!((growth - 1.1 * 1.44).abs() < 1e-12);
    }

    #[test]
    fn the_identity_changes_nothing_and_shapes_compose() {
        let body = shipped("actor").unwrap();
        let same = body.reshaped(&BodyShape::identity(&body));
        assert_eq!((&same.joints, &same.markers), (&body.joints, &body.markers));
        for (a, b) in same.links.iter().zip(&body.links) {
            assert_eq!(a.solids, b.solids);
            let tensors = a.inertia.as_ref().zip(b.inertia.as_ref());
            assert!(
                tensors.is_none_or(|(a, b)| (a.tensor - b.tensor).norm() < 1e-12 && (a.mass - b.mass).abs() < 1e-12)
            );
        }
        let (first, second) =
            (BodyShape::random_mismatch(&body, 1, 0.03, 0.1), BodyShape::random_mismatch(&body, 2, 0.03, 0.1));
        let (at_once, in_turn) = (body.reshaped(&first.then(&second)), body.reshaped(&first).reshaped(&second));
        let pose = body.zero_pose();
        for (a, b) in at_once.link_frames(&pose).0.iter().zip(&in_turn.link_frames(&pose).0) {
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-12);
        }
        assert!((at_once.total_mass() - in_turn.total_mass()).abs() < 1e-9);
    }

    #[test]
    fn a_uniform_rod_of_twice_the_length_has_eight_times_the_inertia() {
        let rod = Inertia {
            mass: 2.0,
            centre_of_mass: Point3::new(0.0, 0.0, -0.5),
            tensor: Matrix3::from_diagonal(&Vector3::new(2.0 / 12.0, 2.0 / 12.0, 0.0)),
        };
        let longer = LinkShape { length: Vector3::new(1.0, 1.0, 2.0), girth: 1.0 }.inertia(&rod);
        assert!((longer.tensor[(0, 0)] - 8.0 * 2.0 / 12.0).abs() < 1e-12);
        assert!(longer.tensor[(2, 2)].abs() < 1e-12);
        assert_eq!((longer.mass, longer.centre_of_mass.z), (4.0, -1.0));
    }

    #[test]
    fn boxes_and_cylinders_grow_with_length_along_and_girth_across() {
        let shape = LinkShape { length: Vector3::new(1.0, 1.0, 2.0), girth: 3.0 };
        let frame = Isometry3::translation(0.0, 0.0, 1.0);
        let grown = shape.solid(&Solid::Box { link_from_box: frame, half_extents: [0.1, 0.2, 0.5] });
        let Solid::Box { link_from_box, half_extents } = grown else { panic!("a box stays a box") };
        assert_eq!(link_from_box.translation.z, 2.0);
        let expected = [0.1 * 3.0, 0.2 * 3.0, 1.0];
        assert!(half_extents.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{half_extents:?}");
        let grown = shape.solid(&Solid::Cylinder { link_from_cylinder: frame, radius: 0.1, half_length: 0.5 });
        let Solid::Cylinder { radius, half_length, .. } = grown else { panic!("a cylinder stays a cylinder") };
        assert!((radius - 0.3).abs() < 1e-12 && (half_length - 1.0).abs() < 1e-12);
    }
}
