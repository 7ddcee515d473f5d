//! The lowest points of a body, and its feet.

use nalgebra::{Isometry3, Point3, Vector3};

use super::{Humanoid, Landmark, LinkFrames, Solid};

impl Solid {
    /// The lowest point of the solid in the world with its link at `world_from_link`, metres; one of them if there are
    /// several. `None` for a mesh without vertices.
    pub fn lowest_point(&self, world_from_link: &Isometry3<f64>) -> Option<Point3<f64>> {
        let down_in = |frame: &Isometry3<f64>| frame.rotation.inverse() * -Vector3::z();
        let lower = |a: Point3<f64>, b: Point3<f64>| if b.z < a.z { b } else { a };
        match self {
            Solid::TaperedCapsule(capsule) => {
                let bottom = |centre: &Point3<f64>, radius: f64| world_from_link * centre - Vector3::z() * radius;
                Some(lower(bottom(&capsule.a, capsule.radius_a), bottom(&capsule.b, capsule.radius_b)))
            }
            Solid::Box { link_from_box, half_extents } => {
                let frame = world_from_link * link_from_box;
                let corner = down_in(&frame).zip_map(&Vector3::from(*half_extents), |down, half| half.copysign(down));
                Some(frame * Point3::from(corner))
            }
            Solid::Cylinder { link_from_cylinder, radius, half_length } => {
                let frame = world_from_link * link_from_cylinder;
                let down = down_in(&frame);
                let rim = Vector3::new(down.x, down.y, 0.0).try_normalize(1e-12).unwrap_or_default() * *radius;
                Some(frame * Point3::from(rim + Vector3::z() * half_length.copysign(down.z)))
            }
            Solid::Mesh { vertices, .. } => vertices.iter().map(|vertex| world_from_link * vertex).reduce(lower),
        }
    }

    /// The centre of the solid in its link's frame, metres: midway between the ends of a capsule, the mean vertex of a
    /// mesh. `None` for a mesh without vertices.
    pub fn middle(&self) -> Option<Point3<f64>> {
        match self {
            Solid::TaperedCapsule(capsule) => Some(nalgebra::center(&capsule.a, &capsule.b)),
            Solid::Box { link_from_box: frame, .. } | Solid::Cylinder { link_from_cylinder: frame, .. } => {
                Some(frame.translation.vector.into())
            }
            Solid::Mesh { vertices, .. } if vertices.is_empty() => None,
            Solid::Mesh { vertices, .. } => {
                let sum = vertices.iter().fold(Vector3::zeros(), |sum, vertex| sum + vertex.coords);
                Some((sum / vertices.len() as f64).into())
            }
        }
    }
}

impl Humanoid {
    /// Height from the lowest point of the body to the top of its head, upright at its zero pose whatever the axes of
    /// its root, metres; `None` for a body without a head or solids.
    pub fn stature(&self) -> Option<f64> {
        let frames = self.link_frames(&self.standing_pose());
        let top = self.markers(&frames)[Landmark::HeadTop as usize]?;
        let links: Vec<usize> = (0..self.links.len()).collect();
        Some(top.z - self.lowest_point(&frames, &links)?.z)
    }

    /// Links of the left and of the right foot: first the link with the ankle marker, then its descendants. Empty if
    /// the body has no such marker. In a body without ankle joints, the foot is part of the shank, which is then the
    /// link.
    pub fn foot_links(&self) -> [Vec<usize>; 2] {
        [Landmark::LeftAnkle, Landmark::RightAnkle].map(|landmark| {
            let ankle = self.markers[landmark as usize].map(|marker| marker.link);
            let mut is_foot = vec![false; self.links.len()];
            for link in 0..self.links.len() {
                is_foot[link] = ankle == Some(link) || self.parent(link).is_some_and(|parent| is_foot[parent]);
            }
            (0..self.links.len()).filter(|&link| is_foot[link]).collect()
        })
    }

    /// The lowest point of these links' surface (the skin's if there is one), world, metres; `None` if they have none.
    pub fn lowest_point(&self, frames: &LinkFrames, links: &[usize]) -> Option<Point3<f64>> {
        self.lowest_on_link(frames, links).map(|(_, point)| point)
    }

    /// As [`Self::lowest_point`], with the link of the point.
    pub fn lowest_on_link(&self, frames: &LinkFrames, links: &[usize]) -> Option<(usize, Point3<f64>)> {
        let lower = |a: &(usize, Point3<f64>), b: &(usize, Point3<f64>)| a.1.z.total_cmp(&b.1.z);
        if let Some(skin) = &self.skin {
            return skin.deformed_parts(frames, links).min_by(lower);
        }
        let of_link = |&link: &usize| {
            self.links[link].solids.iter().filter_map(move |solid| Some((link, solid.lowest_point(&frames[link])?)))
        };
        links.iter().flat_map(of_link).min_by(lower)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::TaperedCapsule;

    #[test]
    fn the_lowest_point_of_every_solid_is_on_it_and_below_all_sampled_points() {
        let frame = Isometry3::new(Vector3::new(0.1, -0.2, 0.5), Vector3::new(0.4, 0.9, -0.3));
        let here = Isometry3::new(Vector3::new(0.3, 0.2, 0.1), Vector3::new(-0.7, 0.2, 0.5));
        let whole = frame * here;
        let capsule = TaperedCapsule {
            a: here * Point3::origin(),
            b: here * Point3::new(0.0, 0.0, 0.3),
            radius_a: 0.04,
            radius_b: 0.09,
        };
        let solids = [
            Solid::TaperedCapsule(capsule),
            Solid::Box { link_from_box: here, half_extents: [0.1, 0.2, 0.3] },
            Solid::Cylinder { link_from_cylinder: here, radius: 0.1, half_length: 0.3 },
        ];
        let inside: [fn(&Point3<f64>) -> bool; 3] = [
            |p| {
                (0..=100).any(|i| {
                    let t = f64::from(i) / 100.0;
                    (p - Point3::new(0.0, 0.0, 0.3 * t)).norm() <= 0.04 + 0.05 * t
                })
            },
            |p| p.x.abs() <= 0.1 && p.y.abs() <= 0.2 && p.z.abs() <= 0.3,
            |p| p.x * p.x + p.y * p.y <= 0.01 && p.z.abs() <= 0.3,
        ];
        for (solid, inside) in solids.iter().zip(inside) {
            let bottom = solid.lowest_point(&frame).unwrap();
            let grid = (0..40 * 40 * 40).map(|i| {
                let at = |k: i32| -0.4 + 0.02 * f64::from(k % 40);
                Point3::new(at(i), at(i / 40), at(i / 1600))
            });
            let sampled = grid.filter(inside).map(|p| (whole * p).z).fold(f64::INFINITY, f64::min);
            assert!(bottom.z <= sampled + 1e-9 && sampled < bottom.z + 0.03, "{solid:?}: {} {sampled}", bottom.z);
        }
    }
}
