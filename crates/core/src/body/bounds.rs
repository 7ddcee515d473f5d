//! Limits of bodies from any source. Beyond them geometry and simulation, partly in single precision, are meaningless.

use nalgebra::Point3;

use super::{Drive, Humanoid, JointKind, Solid};

/// Greatest number of links of a body; it has one joint fewer.
pub(super) const MOST_LINKS: usize = 1_000;
/// Greatest number of solids of all links.
pub(super) const MOST_SOLIDS: usize = 5_000;
/// Greatest number of triangles, and of vertices, of all meshes.
pub(super) const MOST_TRIANGLES: usize = 5_000_000;
/// Greatest number of characters of a name; degrees of freedom are named after their joints.
const LONGEST_NAME: usize = 210;
/// Greatest radius or edge of a solid, metres.
const GREATEST_SIZE: f64 = 1e4;
/// Greatest coordinate, metres.
const FARTHEST: f64 = 1e6;
/// Greatest mass of a link, kilograms.
const GREATEST_MASS: f64 = 1e6;
/// Greatest entry of an inertia tensor, kg m^2.
const GREATEST_INERTIA: f64 = 1e12;
/// Greatest multiplier or offset of a mimicking joint.
const GREATEST_DRIVE: f64 = 1e6;

impl Humanoid {
    /// Checks all values; the error names the link or joint, the value and the expected range.
    #[doc(hidden)]
    pub fn check_bounds(&self) -> Result<(), String> {
        at_most(self.links.len(), MOST_LINKS, "links")?;
        at_most(self.links.iter().map(|link| link.solids.len()).sum(), MOST_SOLIDS, "solids")?;
        let size = |solid: &Solid| match solid {
            Solid::Mesh { vertices, triangles } => vertices.len().max(triangles.len()),
            _ => 0,
        };
        let triangles = self.links.iter().flat_map(|link| &link.solids).map(size).sum();
        at_most(triangles, MOST_TRIANGLES, "triangles or vertices of meshes")?;
        let names = self.links.iter().map(|link| &link.name).chain(self.joints.iter().map(|joint| &joint.name));
        let names = names.chain(self.degrees_of_freedom.iter().map(|dof| &dof.name)).chain([&self.name]);
        names
            .map(|name| name.chars().count())
            .try_for_each(|length| at_most(length, LONGEST_NAME, "characters of a name"))?;
        for link in &self.links {
            self.check_link(link).map_err(|problem| format!("link `{}`: {problem}", link.name))?;
        }
        for joint in &self.joints {
            let place = Point3::from(joint.parent_from_joint.translation.vector);
            let valid = near(&place).and_then(|()| match &joint.kind {
                JointKind::Revolute { drive, .. } | JointKind::Prismatic { drive, .. } => check_drive(drive),
                _ => Ok(()),
            });
            valid.map_err(|problem| format!("joint `{}`: {problem}", joint.name))?;
        }
        self.markers.iter().flatten().try_for_each(|marker| near(&marker.point_in_link))
    }

    fn check_link(&self, link: &super::Link) -> Result<(), String> {
        link.solids.iter().try_for_each(Solid::check_bounds)?;
        let Some(inertia) = &link.inertia else { return Ok(()) };
        within("a mass", inertia.mass, 0.0, GREATEST_MASS, "kg")?;
        near(&inertia.centre_of_mass)?;
        let greatest = inertia.tensor.iter().map(|entry| entry.abs()).fold(0.0, greater);
        within("an inertia", greatest, 0.0, GREATEST_INERTIA, "kg m^2")
    }
}

impl Solid {
    /// Checks the solid; the error names the first value out of bounds.
    #[doc(hidden)]
    pub fn check_bounds(&self) -> Result<(), String> {
        let sized = |size: f64| within("a solid of size", size, 0.0, GREATEST_SIZE, "m");
        match self {
            Self::TaperedCapsule(c) => {
                [c.radius_a, c.radius_b].into_iter().try_for_each(sized)?;
                [c.a, c.b].iter().try_for_each(near)
            }
            Self::Box { link_from_box, half_extents } => {
                half_extents.iter().copied().try_for_each(sized)?;
                near(&link_from_box.translation.vector.into())
            }
            Self::Cylinder { link_from_cylinder, radius, half_length } => {
                [*radius, *half_length].into_iter().try_for_each(sized)?;
                near(&link_from_cylinder.translation.vector.into())
            }
            Self::Mesh { vertices, .. } => vertices.iter().try_for_each(near),
        }
    }
}

fn check_drive(drive: &Drive) -> Result<(), String> {
    within("a multiplier", drive.multiplier.abs(), 0.0, GREATEST_DRIVE, "")?;
    within("an offset", drive.offset.abs(), 0.0, GREATEST_DRIVE, "rad")
}

fn at_most(found: usize, most: usize, what: &str) -> Result<(), String> {
    if found <= most { Ok(()) } else { Err(format!("{found} {what}; expected at most {most}")) }
}

fn near(point: &Point3<f64>) -> Result<(), String> {
    within("a position of", point.iter().map(|x| x.abs()).fold(0.0, greater), 0.0, FARTHEST, "m")
}

/// The greater number; NaN if either is NaN.
fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// NaN is out of bounds.
fn within(what: &str, value: f64, least: f64, most: f64, unit: &str) -> Result<(), String> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(format!("{what} {value:e} {unit}; expected {least} to {most} {unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{SHIPPED_ROBOTS, shipped};
    use crate::raster::TaperedCapsule;

    #[test]
    fn built_in_robots_are_within_bounds_and_absurd_ones_are_not() {
        for (name, _) in SHIPPED_ROBOTS {
            shipped(name).unwrap().check_bounds().unwrap();
        }
        let refused = |change: &dyn Fn(&mut Humanoid)| {
            let mut body = shipped("tracker25").unwrap();
            change(&mut body);
            body.check_bounds().unwrap_err()
        };
        let mass = refused(&|body| body.links[3].inertia.as_mut().unwrap().mass = f64::NAN);
        assert!(mass.contains("a mass NaN kg; expected 0 to 1000000 kg"), "{mass}");
        let far = refused(&|body| body.joints[2].parent_from_joint.translation.x = 1e20);
        assert!(far.starts_with("joint `") && far.contains("a position of 1e20 m"), "{far}");
        let long = refused(&|body| body.links[1].name = "x".repeat(100_000));
        assert_eq!(long, "100000 characters of a name; expected at most 210");
    }

    #[test]
    fn a_ball_of_1e20_m_and_a_ball_with_negative_zero_size_are_refused() {
        let ball = |radius| {
            let a = Point3::origin();
            Solid::TaperedCapsule(TaperedCapsule { a, b: a, radius_a: radius, radius_b: radius }).check_bounds()
        };
        assert_eq!(ball(0.1), Ok(()));
        assert_eq!(ball(1e20).unwrap_err(), "a solid of size 1e20 m; expected 0 to 10000 m");
        assert!(ball(-1.0).is_err() && ball(f64::NAN).is_err());
    }
}
