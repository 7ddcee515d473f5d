//! A skin on a body with other lengths and girths.

use nalgebra::{Isometry3, Point3, Vector3};

use super::{MeshTopology, Skin};
use crate::body::{BodyShape, Humanoid, LinkShape, Solid};

impl Skin {
    /// The same skin without the triangles whose dominant links are marked in `gone` (one entry per link). It is open
    /// where they were.
    #[doc(hidden)]
    pub fn without_links(&self, gone: &[bool]) -> Self {
        let (mut triangles, mut triangle_parts) = (Vec::new(), Vec::new());
        for (corners, part) in self.triangles.iter().zip(&self.triangle_parts) {
            if !gone.get(*part as usize).is_some_and(|gone| *gone) {
                triangles.push(*corners);
                triangle_parts.push(*part);
            }
        }
        let topology = MeshTopology::new(self.vertices.len(), &triangles);
        Self { triangles, triangle_parts, topology, ..self.clone() }
    }

    /// The skin of `body` reshaped by `shape`: as for solids, lengths move the points of a link's axes, and girths
    /// scale the distances from them. The bind pose keeps its angles.
    pub(in crate::body) fn reshaped(&self, body: &Humanoid, shape: &BodyShape) -> Self {
        let of = |link: usize| shape.links.get(link).copied().unwrap_or(LinkShape::SAME);
        let mut bind = self.bind.clone();
        for link in 1..bind.len() {
            let Some(parent) = body.parent(link) else { continue };
            // as far from the parent's origin as the joint, even if the mesh was modelled otherwise
            let offset = self.bind[parent].inverse_transform_point(&self.bind[link].translation.vector.into()).coords;
            let place = bind[parent] * Point3::from(offset.component_mul(&of(parent).length));
            bind[link] = Isometry3::from_parts(place.into(), bind[link].rotation);
        }
        let axes: Vec<Vec<MiddleLine>> =
            body.links.iter().map(|link| link.solids.iter().map(MiddleLine::from_solid).collect()).collect();
        let moved = |vertex: usize| {
            let carried = self.influences(vertex).map(|(link, weight)| {
                let own = self.bind[link].inverse_transform_point(&self.vertices[vertex]);
                (bind[link] * stretched(&own, &axes[link], &of(link))).coords * weight
            });
            Point3::from(carried.sum::<Vector3<f64>>())
        };
        let vertices = (0..self.vertices.len()).map(moved).collect();
        self.with_places(vertices, bind)
    }

    /// The skin with its surface moved outwards by `metres`: every vertex along the area-weighted mean of its
    /// triangles' normals. A vertex without triangles stays.
    #[doc(hidden)]
    pub fn inflated(&self, metres: f64) -> Self {
        if metres == 0.0 {
            return self.clone();
        }
        let mut normals = vec![Vector3::zeros(); self.vertices.len()];
        let mut volume = 0.0;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| self.vertices[corner as usize].coords);
            let normal = (b - a).cross(&(c - a));
            volume += a.dot(&b.cross(&c));
            triangle.iter().for_each(|corner| normals[*corner as usize] += normal);
        }
        // the normals of an inside-out mesh point inwards
        let outward = metres.copysign(metres * volume);
        let moved = |(vertex, normal): (&Point3<f64>, &Vector3<f64>)| {
            vertex + normal.try_normalize(1e-18).unwrap_or_default() * outward
        };
        let vertices = self.vertices.iter().zip(&normals).map(moved).collect();
        self.with_places(vertices, self.bind.clone())
    }

    /// The same mesh and weights with other positions in the bind pose.
    fn with_places(&self, vertices: Vec<Point3<f64>>, bind: Vec<Isometry3<f64>>) -> Self {
        let mut skin = Self { vertices, bind, ..self.clone() };
        skin.terms = skin.bone_local();
        skin
    }
}

/// The middle line of a solid, in the link's frame.
struct MiddleLine {
    from: Point3<f64>,
    to: Point3<f64>,
}

impl MiddleLine {
    fn from_solid(solid: &Solid) -> Self {
        let line = |frame: &Isometry3<f64>, half: Vector3<f64>| Self {
            from: frame * Point3::from(-half),
            to: frame * Point3::from(half),
        };
        match solid {
            Solid::TaperedCapsule(capsule) => Self { from: capsule.a, to: capsule.b },
            Solid::Box { link_from_box, half_extents } => {
                let longest = Vector3::from(*half_extents).imax();
                line(link_from_box, Vector3::ith(longest, half_extents[longest]))
            }
            Solid::Cylinder { link_from_cylinder, half_length, .. } => {
                line(link_from_cylinder, Vector3::z() * *half_length)
            }
            Solid::Mesh { vertices, .. } => {
                let sum: Vector3<f64> = vertices.iter().map(|v| v.coords).sum();
                let middle = Point3::from(sum / vertices.len().max(1) as f64);
                Self { from: middle, to: middle }
            }
        }
    }

    fn nearest(&self, point: &Point3<f64>) -> Point3<f64> {
        let axis = self.to - self.from;
        let along = (point - self.from).dot(&axis) / axis.norm_squared().max(1e-18);
        self.from + axis * along.clamp(0.0, 1.0)
    }
}

/// A point of a link's frame: with `c` the mean of the nearest points of the link's axes, weighted towards near ones,
/// it is moved to `length c + girth (point - c)`.
fn stretched(point: &Point3<f64>, axes: &[MiddleLine], shape: &LinkShape) -> Point3<f64> {
    if *shape == LinkShape::SAME {
        return *point;
    }
    let (mut sum, mut total) = (Vector3::zeros(), 0.0);
    for axis in axes {
        let nearest = axis.nearest(point);
        let weight = 1.0 / ((point - nearest).norm_squared() + 1e-4).powi(2);
        sum += nearest.coords * weight;
        total += weight;
    }
    let centre = if total > 0.0 { sum / total } else { Vector3::zeros() };
    Point3::from(centre.component_mul(&shape.length) + (point.coords - centre) * shape.girth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{LinkFrames, shipped, shipped_skin};

    #[test]
    fn an_inflated_skin_grows_by_its_area_times_the_distance_and_shrinks_likewise() {
        let body = shipped("tracker25").unwrap();
        let bind = body.link_frames(&body.zero_pose());
        let skin = Skin::bound(&shipped_skin("person_coarse").unwrap(), &body, &bind).unwrap();
        let area: f64 = skin
            .triangles()
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|corner| skin.vertices()[corner as usize]);
                0.5 * (b - a).cross(&(c - a)).norm()
            })
            .sum();
        let held = |skin: &Skin| skin.volume(&LinkFrames(skin.bind().to_vec())).unwrap().0;
        let reversed = skin.triangles().iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        let turned = Skin { triangles: reversed, ..skin.clone() };
        for skin in [&skin, &turned] {
            for metres in [0.001, -0.001] {
                let growth = held(&skin.inflated(metres)) - held(skin);
                // a triangle's plane moves by less than its corners, whose normals diverge
                let share = growth / (area * metres);
                assert!((0.8..1.02).contains(&share), "{share}");
            }
            assert_eq!(skin.inflated(0.0), *skin);
        }
    }
}
