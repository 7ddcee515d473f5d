//! The articulated body: links, joints and degrees of freedom.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{LANDMARKS, LinkPoint, Skin, Solid};

/// An articulated body. Invariants: links are in topological order (a link's parent has a smaller index), link 0 is
/// the root, joint `i` moves link `i + 1`, every axis has unit length, every lower limit is at most the upper one.
#[derive(Clone, Debug, PartialEq)]
pub struct Humanoid {
    /// The robot's name in its URDF.
    pub name: String,
    /// All links, root first.
    pub links: Vec<Link>,
    /// `joints[i]` moves `links[i + 1]`.
    pub joints: Vec<Joint>,
    /// The degrees of freedom, in the order of a [`super::Pose`].
    pub degrees_of_freedom: Vec<DegreeOfFreedom>,
    /// Positions of the virtual markers, in the order of [`LANDMARKS`]; `None` for markers that this body lacks.
    pub markers: [Option<LinkPoint>; LANDMARKS.len()],
    /// The surface seen by cameras and in contact with the ground; without it, the links' solids are used.
    pub skin: Option<Arc<Skin>>,
    /// Notes about its file: assumed limits, locked joints.
    pub notes: Vec<String>,
}

/// A rigid part of the body. Links without mass and geometry connect the axes of a compound joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Unique name.
    pub name: String,
    /// The link's geometry, in the link's frame.
    pub solids: Vec<Solid>,
    /// Mass and inertia; `None` for a massless link.
    pub inertia: Option<Inertia>,
}

/// Mass properties of a link, in the link's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Inertia {
    /// Kilograms, > 0.
    pub mass: f64,
    /// Centre of mass, metres.
    pub centre_of_mass: Point3<f64>,
    /// Rotational inertia about the centre of mass, axes of the link's frame, kg m^2.
    pub tensor: Matrix3<f64>,
}

/// The connection from `links[parent]` to its child.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique name.
    pub name: String,
    /// Index of the parent link.
    pub parent: usize,
    /// The joint's frame in the parent link; at zero angle it is the child link's frame.
    pub parent_from_joint: Isometry3<f64>,
    /// The allowed motion of the child.
    pub kind: JointKind,
}

/// The motions that a joint allows. Every moving axis has the degree of freedom that drives it.
#[derive(Clone, Debug, PartialEq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Rotation about a unit axis in the joint frame.
    Revolute {
        /// Unit axis in the joint's frame.
        axis: Unit<Vector3<f64>>,
        /// The driving degree of freedom.
        drive: Drive,
    },
    /// Translation along a unit axis in the joint frame.
    Prismatic {
        /// Unit axis in the joint's frame.
        axis: Unit<Vector3<f64>>,
        /// The driving degree of freedom.
        drive: Drive,
    },
    /// Any rotation: degrees of freedom `first .. first + 3` are its rotation vector (radians, joint frame).
    Spherical {
        /// Index of the first of three degrees of freedom.
        first: usize,
    },
    /// Any rigid motion: degrees of freedom `first .. first + 3` translate, `first + 3 .. first + 6` are a rotation
    /// vector.
    Floating {
        /// Index of the first of six degrees of freedom.
        first: usize,
    },
}

/// The value of one joint axis: `multiplier * joint_angles[degree_of_freedom] + offset` (URDF's `mimic`; otherwise 1
/// and 0).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Index into [`super::Pose::joint_angles`].
    pub degree_of_freedom: usize,
    /// Factor.
    pub multiplier: f64,
    /// Added value, radians or metres.
    pub offset: f64,
}

/// One number of a pose. Unlimited values are null in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DegreeOfFreedom {
    /// The joint's name, with `.x` `.y` `.z` (and `.rx` ...) appended if the joint has several.
    pub name: String,
    /// Lowest value, radians or metres; `-inf` if unlimited.
    #[serde(serialize_with = "if_limited", deserialize_with = "or_least")]
    pub lower: f64,
    /// Highest value; `>= lower`.
    #[serde(serialize_with = "if_limited", deserialize_with = "or_greatest")]
    pub upper: f64,
    /// Greatest speed, rad/s or m/s; `inf` if the file does not define it.
    #[serde(serialize_with = "if_limited", deserialize_with = "or_greatest")]
    pub max_velocity: f64,
    /// Greatest effort, N m or N; `inf` if the file does not define it.
    #[serde(serialize_with = "if_limited", deserialize_with = "or_greatest")]
    pub max_effort: f64,
}

fn if_limited<S: Serializer>(limit: &f64, to: S) -> Result<S::Ok, S::Error> {
    limit.is_finite().then_some(*limit).serialize(to)
}

fn or_least<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NEG_INFINITY))
}

fn or_greatest<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

impl DegreeOfFreedom {
    /// One without limits.
    #[doc(hidden)]
    pub fn unlimited(name: &str) -> Self {
        let (greatest, name) = (f64::INFINITY, name.to_owned());
        Self { name, lower: -greatest, upper: greatest, max_velocity: greatest, max_effort: greatest }
    }
}

impl Drive {
    /// A drive equal to the degree of freedom.
    pub fn direct(degree_of_freedom: usize) -> Self {
        Self { degree_of_freedom, multiplier: 1.0, offset: 0.0 }
    }
}

impl Humanoid {
    /// Whether it is the same body as `other`: links with geometry and inertia, joints, degrees of freedom, markers
    /// and skin, bit for bit. The robot's name and the notes are ignored.
    pub fn is_same_body(&self, other: &Self) -> bool {
        let Self { name: _, links, joints, degrees_of_freedom, markers, skin, notes: _ } = self;
        *links == other.links
            && *joints == other.joints
            && *degrees_of_freedom == other.degrees_of_freedom
            && *markers == other.markers
            && *skin == other.skin
    }

    /// Index of the link with this name.
    pub fn find_link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// Index of the degree of freedom with this name.
    pub fn find_degree_of_freedom(&self, name: &str) -> Option<usize> {
        self.degrees_of_freedom.iter().position(|d| d.name == name)
    }

    /// Index of the parent of link `link`; `None` for the root.
    #[inline]
    pub fn parent(&self, link: usize) -> Option<usize> {
        link.checked_sub(1).map(|joint| self.joints[joint].parent)
    }
}

#[cfg(test)]
mod tests {
    use crate::body::{BodyShape, shipped};

    #[test]
    fn names_do_not_distinguish_bodies_but_a_thousandth_of_girth_does() {
        let body = shipped("tracker25").unwrap();
        let mut renamed = body.clone();
        renamed.name = "somebody".into();
        renamed.notes.push("a note about the file".into());
        assert!(body.is_same_body(&renamed) && body != renamed);
        assert!(!body.is_same_body(&body.reshaped(&BodyShape::random_mismatch(&body, 1, 0.0, 0.001))));
        assert!(!body.is_same_body(&shipped("actor").unwrap()));
    }
}
