//! Masses of a body from its skin.

use nalgebra::{Matrix3, Point3, Vector3};

use super::segment_solids::{SegmentMoments, moments_of_links};
use crate::body::{Humanoid, Inertia, Link};

/// Parts below this volume are not segments, cubic metres: their links keep their mass properties.
const LEAST_VOLUME: f64 = 1e-6;

impl Humanoid {
    /// The same body with masses from its skin: every link gets the mass, centre of mass and rotational inertia of its
    /// part of the skin in the bind pose, where the skin is not bent. The density is uniform and chosen so that the
    /// body keeps its [`Self::total_mass`]; lungs, which make trunks lighter than limbs, are not modelled. Links
    /// without a part of the skin keep their mass properties. Second moments are computed from the tetrahedra of all
    /// triangles (`[Ericson 2005]`); the cuts between links are cones to the middle of the cut.
    ///
    /// A body without a skin or mass, or whose skin encloses no volume, is unchanged.
    #[must_use]
    pub fn with_masses_of_skin(&self) -> Self {
        self.weighed_by_skin().unwrap_or_else(|| self.clone())
    }

    fn weighed_by_skin(&self) -> Option<Self> {
        let skin = self.skin.as_ref()?;
        let (mut moments, about) = moments_of_links(skin, self.links.len());
        // if the surface is inside out, the signs of all parts change alike
        if moments.iter().map(|own| own.volume).sum::<f64>() < 0.0 {
            moments.iter_mut().for_each(|own| *own = own.reversed());
        }
        let solids: Vec<Option<SegmentSolid>> = moments.iter().map(|own| SegmentSolid::new(own, &about)).collect();
        let volume: f64 = solids.iter().flatten().map(|solid| solid.volume).sum();
        let kept = |(link, solid): (&Link, &Option<SegmentSolid>)| match solid {
            None => link.inertia.as_ref().map(|inertia| inertia.mass),
            Some(_) => None,
        };
        let rest = self.total_mass() - self.links.iter().zip(&solids).filter_map(kept).sum::<f64>();
        if !(rest > 0.0 && volume > LEAST_VOLUME) {
            return None;
        }
        let mut body = self.clone();
        for ((link, solid), bind) in body.links.iter_mut().zip(&solids).zip(&skin.bind) {
            let Some(solid) = solid else { continue };
            let turn = bind.rotation.to_rotation_matrix().into_inner();
            let density = rest / volume;
            link.inertia = Some(Inertia {
                mass: density * solid.volume,
                centre_of_mass: bind.inverse_transform_point(&solid.centre),
                tensor: turn.transpose() * solid.tensor * turn * density,
            });
        }
        Some(body)
    }
}

/// A segment of density 1.
struct SegmentSolid {
    volume: f64,
    centre: Point3<f64>,
    /// About the centre, axes of the world.
    tensor: Matrix3<f64>,
}

impl SegmentSolid {
    /// `None` for an empty part or a surface folded through itself.
    fn new(moments: &SegmentMoments, about: &Point3<f64>) -> Option<Self> {
        if moments.volume < LEAST_VOLUME {
            return None;
        }
        let centre: Vector3<f64> = moments.first / moments.volume;
        let spread = moments.second - centre * centre.transpose() * moments.volume;
        let spread = 0.5 * (spread + spread.transpose());
        let valid = spread.symmetric_eigenvalues().iter().all(|value| *value > 0.0);
        let tensor = Matrix3::from_diagonal_element(spread.trace()) - spread;
        valid.then_some(Self { volume: moments.volume, centre: about + centre, tensor })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::body::skin::{Influence, Skin};
    use crate::body::{SkinMesh, shipped, shipped_skin};

    /// A surface of revolution about z through `(radius, height)`, closed at its poles, and the index along the
    /// profile of every vertex.
    fn turned(profile: &[[f64; 2]], around: u32) -> (Vec<Point3<f64>>, Vec<[u32; 3]>, Vec<usize>) {
        let mut vertices = vec![Point3::new(0.0, 0.0, profile[0][1])];
        let mut ring_of = vec![0];
        for (number, [radius, height]) in profile[1..profile.len() - 1].iter().enumerate() {
            for k in 0..around {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(around));
                vertices.push(Point3::new(radius * cos, radius * sin, *height));
                ring_of.push(number + 1);
            }
        }
        vertices.push(Point3::new(0.0, 0.0, profile[profile.len() - 1][1]));
        ring_of.push(profile.len() - 1);
        let rings = profile.len() as u32 - 2;
        let last = vertices.len() as u32 - 1;
        let at = |ring: u32, k: u32| 1 + ring * around + k % around;
        let mut triangles = Vec::new();
        for k in 0..around {
            triangles.push([0, at(0, k + 1), at(0, k)]);
            triangles.push([last, at(rings - 1, k), at(rings - 1, k + 1)]);
            for ring in 0..rings - 1 {
                triangles.push([at(ring, k), at(ring, k + 1), at(ring + 1, k)]);
                triangles.push([at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)]);
            }
        }
        (vertices, triangles, ring_of)
    }

    fn dressed(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>, link_of: impl Fn(usize) -> u32) -> Humanoid {
        let mut body = shipped("tracker25").unwrap();
        let influences: Vec<Vec<Influence>> =
            (0..vertices.len()).map(|vertex| vec![Influence { link: link_of(vertex), weight: 1.0 }]).collect();
        let bind = (0..body.links.len()).map(|link| {
            let at = 0.1 * link as f64;
            nalgebra::Isometry3::new(Vector3::new(at, -at, 0.3), Vector3::new(0.2 * at, 0.3, -0.5 * at))
        });
        body.skin = Some(Skin::assemble("turned", vertices, triangles, &influences, bind.collect()).into());
        body
    }

    #[test]
    fn a_ball_has_the_mass_centre_and_inertia_of_a_ball_in_any_orientation() {
        let (radius, centre) = (0.3, Vector3::new(0.4, -0.1, 1.2));
        let profile: Vec<[f64; 2]> = (0..=200)
            .map(|i| {
                let (sin, cos) = libm::sincos(PI * f64::from(i) / 200.0);
                [radius * sin, radius * cos]
            })
            .collect();
        let (vertices, triangles, _) = turned(&profile, 200);
        let vertices: Vec<_> = vertices.iter().map(|vertex| vertex + centre).collect();
        let reversed: Vec<_> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        for triangles in [triangles, reversed] {
            let body = dressed(vertices.clone(), triangles, |_| 0);
            let kept: f64 = body.links[1..].iter().filter_map(|link| link.inertia.as_ref()).map(|own| own.mass).sum();
            let found = body.with_masses_of_skin();
            let own = found.links[0].inertia.as_ref().unwrap();
            assert!((own.mass - (body.total_mass() - kept)).abs() < 1e-9);
            let at = body.skin.as_ref().unwrap().bind()[0] * own.centre_of_mass;
            assert!((at.coords - centre).norm() < 1e-9, "{at}");
            let expected = 0.4 * own.mass * radius * radius;
            assert!((own.tensor - Matrix3::from_diagonal_element(expected)).norm() < 1e-3 * expected, "{}", own.tensor);
        }
    }

    #[test]
    fn a_capsule_shared_by_two_links_is_split_into_a_cylinder_and_a_ball_at_each_end() {
        // a cylinder of 0.8 m with half balls; the cut is at 0.2 m of its height
        let (radius, half): (f64, f64) = (0.1, 0.4);
        let ball = |i: i32, at: f64| {
            let (sin, cos) = libm::sincos(PI * f64::from(i) / 200.0);
            [radius * sin, at - radius * cos]
        };
        let mut profile: Vec<[f64; 2]> = (0..=100).map(|i| ball(i, -half)).collect();
        profile.extend((1..100).map(|i| [radius, -half + 2.0 * half * f64::from(i) / 100.0]));
        profile.extend((100..=200).map(|i| ball(i, half)));
        let (vertices, triangles, ring_of) = turned(&profile, 160);
        let cut = profile.iter().position(|[_, height]| (height - 0.2).abs() < 1e-9).unwrap();
        // a triangle follows two of its corners: the edge of the cut is on the ring or half a ring beside it
        let bare = shipped("tracker25").unwrap();
        let [lower, upper] = ["left_thigh", "right_thigh"].map(|name| bare.find_link(name).unwrap());
        let link_of = |vertex: usize| if ring_of[vertex] <= cut { lower } else { upper };
        let body = dressed(vertices, triangles, |vertex| link_of(vertex) as u32);
        let found = body.with_masses_of_skin();
        let skin = body.skin.as_ref().unwrap();
        let [low, high] = [lower, upper].map(|link| found.links[link].inertia.clone().unwrap());
        let solid = |cylinder: f64| {
            let (round, end) = (PI * radius * radius * cylinder, 2.0 / 3.0 * PI * radius.powi(3));
            // the centre of a half ball is 3/8 of the radius beyond its plane
            let centre = (round * 0.5 * cylinder + end * (cylinder + 0.375 * radius)) / (round + end);
            (round + end, centre)
        };
        let ((low_volume, low_centre), (high_volume, high_centre)) = (solid(0.6), solid(0.2));
        assert!((low.mass / high.mass / (low_volume / high_volume) - 1.0).abs() < 0.03, "{} {}", low.mass, high.mass);
        for (link, inertia, height) in [(lower, &low, 0.2 - low_centre), (upper, &high, 0.2 + high_centre)] {
            let at = skin.bind()[link] * inertia.centre_of_mass;
            assert!((at - Point3::new(0.0, 0.0, height)).norm() < 0.005, "{at} {height}");
        }
        // both together are the capsule
        let whole = (low.mass * (skin.bind()[lower] * low.centre_of_mass).coords
            + high.mass * (skin.bind()[upper] * high.centre_of_mass).coords)
            / (low.mass + high.mass);
        assert!(whole.norm() < 1e-9, "{whole}");
    }

    #[test]
    fn the_total_centre_of_mass_is_that_of_the_volume_for_any_division_and_holes_are_closed() {
        let person = shipped("actor").unwrap();
        for (name, cut_open) in [("person", false), ("person_coarse", false), ("person_coarse", true)] {
            let mut mesh = shipped_skin(name).unwrap();
            if cut_open {
                mesh.triangles.drain(100..130);
            }
            let bind = person.link_frames(&person.zero_pose());
            let skin = Skin::bound(&mesh, &person, &bind).unwrap();
            let volume = skin.volume(&crate::body::LinkFrames(skin.bind().to_vec())).unwrap();
            let body = Humanoid { skin: Some(skin.into()), ..person.clone() };
            let found = body.with_masses_of_skin();
            assert!((found.total_mass() - body.total_mass()).abs() < 1e-9);
            let centre = found.centre_of_mass(&bind).unwrap();
            // the volume closes holes to another point
            let within = if cut_open { 0.02 } else { 1e-9 };
            let as_before = found.links.iter().zip(&body.links).filter(|(is, was)| is.inertia.is_some() && is == was);
            let as_before: Vec<&str> = as_before.map(|(link, _)| link.name.as_str()).collect();
            assert!(name != "person" || as_before.is_empty(), "every segment of {name} carries skin: {as_before:?}");
            assert!((centre - volume.1).norm() < within, "{name}: {centre} {}", volume.1);
            for link in found.links.iter().filter_map(|link| link.inertia.as_ref()) {
                let moments = link.tensor.symmetric_eigenvalues();
                assert!(moments.min() > 0.0 && 2.0 * moments.max() <= moments.sum() + 1e-12, "{moments}");
            }
        }
    }

    /// Regression test: a triangle of three links was that of its first corner, and mesh tools rotate corners. The
    /// pelvis of `person_coarse` lost 31 % of its mass.
    #[test]
    fn rotated_corners_do_not_change_masses() {
        let person = shipped("actor").unwrap();
        let bind = person.link_frames(&person.zero_pose());
        let mut mesh = shipped_skin("person_coarse").unwrap();
        let mut found = Vec::new();
        for _ in 0..3 {
            let skin = Skin::bound(&mesh, &person, &bind).unwrap();
            found.push(Humanoid { skin: Some(skin.into()), ..person.clone() }.with_masses_of_skin());
            mesh.triangles.iter_mut().for_each(|triangle| triangle.rotate_left(1));
        }
        for (index, link) in found[0].links.iter().enumerate() {
            for other in &found[1..] {
                let [own, rotated] =
                    [link, &other.links[index]].map(|link| link.inertia.as_ref().map_or(0.0, |i| i.mass));
                assert!((own - rotated).abs() < 1e-9, "{}: {own} kg, with rotated corners {rotated}", link.name);
            }
        }
    }

    #[test]
    fn a_body_without_skin_or_mass_or_with_a_flat_skin_is_unchanged() {
        let body = shipped("actor").unwrap();
        assert_eq!(body.with_masses_of_skin(), body);
        let flat = SkinMesh {
            name: "flat".into(),
            vertices: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from).to_vec(),
            triangles: vec![[0, 1, 2]],
            weights: Some(BTreeMap::from([("pelvis".to_owned(), vec![(0, 1.0), (1, 1.0), (2, 1.0)])])),
            ..SkinMesh::default()
        };
        let skin = Skin::bound(&flat, &body, &body.link_frames(&body.zero_pose())).unwrap();
        let wearing = Humanoid { skin: Some(skin.into()), ..body.clone() };
        assert_eq!(wearing.with_masses_of_skin(), wearing);
        let mut weightless = dressed(turned(&[[0.0, 0.0], [1.0, 0.5], [0.0, 1.0]], 8).0, vec![[0, 1, 2]], |_| 0);
        weightless.links.iter_mut().for_each(|link| link.inertia = None);
        assert_eq!(weightless.with_masses_of_skin(), weightless);
    }
}
