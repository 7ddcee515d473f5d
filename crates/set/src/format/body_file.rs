//! A humanoid as lossless JSON (`skiagraph.body/1`): a URDF after reading, scaling and conversion to tapered capsules.
//!
//! Links in topological order, link 0 the root; `joints[i]` carries `links[i + 1]` and names its parent by index.
//! Metres, radians, kilograms; frames as position and quaternion `w x y z`; a missing limit is `null`. The origin of a
//! joint is its frame in the parent link, which is the child link's frame at zero angle.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};

use super::rigid::{self, RigidRecord};
use crate::SetError;
use skiagraph_core::body::{
    Blending, DegreeOfFreedom, Drive, Humanoid, Inertia, Joint, JointKind, LANDMARKS, Link, LinkPoint, Skin, SkinParts,
    Solid,
};
use skiagraph_core::input::excerpt;
use skiagraph_core::raster::TaperedCapsule;

const SCHEMA: &str = "skiagraph.body/1";
const BODIES_SCHEMA: &str = "skiagraph.bodies/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BodiesRecord {
    schema: String,
    bodies: Vec<BodyRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyRecord {
    schema: String,
    name: String,
    links: Vec<LinkRecord>,
    joints: Vec<JointRecord>,
    degrees_of_freedom: Vec<DegreeOfFreedom>,
    /// HumanEva's virtual markers by name.
    markers: BTreeMap<String, MarkerRecord>,
    notes: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    skin: Option<SkinRecord>,
}

/// A surface that bends with the links.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SkinRecord {
    name: String,
    /// `linear` or `dual_quaternion`.
    blending: String,
    /// In the bind pose.
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Links and weights of every vertex.
    influences: Vec<Vec<(u32, f64)>>,
    /// `world_from_link` in the bind pose, for every link `x y z qw qx qy qz`.
    bind: Vec<[f64; 7]>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkRecord {
    name: String,
    // the name in sets of older versions
    #[serde(alias = "flesh")]
    solids: Vec<SolidRecord>,
    inertia: Option<InertiaRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum SolidRecord {
    TaperedCapsule { a: [f64; 3], b: [f64; 3], radius_a: f64, radius_b: f64 },
    Box { frame: RigidRecord, half_extents: [f64; 3] },
    Cylinder { frame: RigidRecord, radius: f64, half_length: f64 },
    Mesh { vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]> },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct InertiaRecord {
    mass: f64,
    centre_of_mass: [f64; 3],
    tensor: [[f64; 3]; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointRecord {
    name: String,
    parent: usize,
    origin: RigidRecord,
    kind: KindRecord,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum KindRecord {
    Fixed,
    Revolute { axis: [f64; 3], drive: Drive },
    Prismatic { axis: [f64; 3], drive: Drive },
    Spherical { first: usize },
    Floating { first: usize },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MarkerRecord {
    link: usize,
    point: [f64; 3],
}

/// The bytes of the body's file.
///
/// # Errors
/// [`SetError::Malformed`] if a number other than a limit is not finite.
pub fn to_json(file: &str, body: &Humanoid) -> Result<Vec<u8>, SetError> {
    super::json::to_bytes(file, &BodyRecord::new(body))
}

/// Reads the body of a file written by [`to_json`] and checks every invariant of [`Humanoid`]. `file` is its name in
/// errors.
///
/// # Errors
/// [`SetError::Malformed`] with the problem.
pub fn from_json(file: &str, bytes: &[u8]) -> Result<Humanoid, SetError> {
    let record: BodyRecord = super::json::from_bytes(file, &[SCHEMA], bytes)?;
    record.body().map_err(|detail| SetError::malformed(file, detail))
}

/// The bytes of a file of several bodies (`skiagraph.bodies/1`): those of a run whose tracker calibrated its body, one
/// per seed.
///
/// # Errors
/// [`SetError::Malformed`] if a number other than a limit is not finite.
pub fn bodies_to_json(file: &str, bodies: &[Humanoid]) -> Result<Vec<u8>, SetError> {
    let record =
        BodiesRecord { schema: BODIES_SCHEMA.to_string(), bodies: bodies.iter().map(BodyRecord::new).collect() };
    super::json::to_bytes(file, &record)
}

/// Reads the bodies of a file written by [`bodies_to_json`] and checks every invariant of [`Humanoid`].
///
/// # Errors
/// [`SetError::Malformed`] with the problem.
pub fn bodies_from_json(file: &str, bytes: &[u8]) -> Result<Vec<Humanoid>, SetError> {
    let record: BodiesRecord = super::json::from_bytes(file, &[BODIES_SCHEMA], bytes)?;
    let bodies = record.bodies.into_iter().map(BodyRecord::body).collect::<Result<_, _>>();
    bodies.map_err(|detail: String| SetError::malformed(file, detail))
}

impl BodyRecord {
    fn new(body: &Humanoid) -> Self {
        let markers = LANDMARKS.iter().zip(&body.markers).filter_map(|(landmark, marker)| {
            let marker = marker.as_ref()?;
            Some((landmark.name().to_string(), MarkerRecord { link: marker.link, point: marker.point_in_link.into() }))
        });
        Self {
            schema: SCHEMA.to_string(),
            name: body.name.clone(),
            links: body.links.iter().map(LinkRecord::new).collect(),
            joints: body.joints.iter().map(JointRecord::new).collect(),
            degrees_of_freedom: body.degrees_of_freedom.clone(),
            markers: markers.collect(),
            notes: body.notes.clone(),
            skin: body.skin.as_ref().map(|skin| SkinRecord::new(skin)),
        }
    }

    fn body(self) -> Result<Humanoid, String> {
        if self.links.len() != self.joints.len() + 1 {
            return Err(format!(
                "{} links and {} joints; expected one joint fewer",
                self.links.len(),
                self.joints.len()
            ));
        }
        let degrees = self.degrees_of_freedom.len();
        let joints = self.joints.into_iter().enumerate().map(|(index, joint)| {
            let name = joint.name.clone();
            joint.joint(index, degrees).map_err(|e| format!("joint {:?}: {e}", excerpt(&name)))
        });
        let joints = joints.collect::<Result<Vec<_>, _>>()?;
        let mut markers = [None; LANDMARKS.len()];
        for (name, marker) in self.markers {
            let landmark = LANDMARKS.iter().position(|l| l.name() == name);
            let slot = landmark.ok_or_else(|| format!("marker {:?} is not one of HumanEva's 15", excerpt(&name)))?;
            if marker.link >= self.links.len() {
                return Err(format!("marker {name:?}: the body has no link {}", marker.link));
            }
            markers[slot] = Some(LinkPoint { link: marker.link, point_in_link: marker.point.into() });
        }
        let crossed = self.degrees_of_freedom.iter().find(|degree| degree.lower > degree.upper);
        if let Some(DegreeOfFreedom { name, lower, upper, .. }) = crossed {
            return Err(format!(
                "degree of freedom {:?}: lower limit {lower} is above the upper limit {upper}",
                excerpt(name)
            ));
        }
        let links = self.links.len();
        let skin = self.skin.map(|skin| skin.skin(links).map_err(|e| format!("skin: {e}"))).transpose()?;
        let body = Humanoid {
            skin: skin.map(Arc::new),
            name: self.name,
            links: self.links.into_iter().map(LinkRecord::link).collect::<Result<_, _>>()?,
            joints,
            degrees_of_freedom: self.degrees_of_freedom,
            markers,
            notes: self.notes,
        };
        body.check_bounds().map(|()| body)
    }
}

impl SkinRecord {
    fn new(skin: &Skin) -> Self {
        let parts = skin.to_parts();
        Self {
            name: parts.name,
            blending: match parts.blending {
                Blending::Linear => "linear",
                Blending::DualQuaternion => "dual_quaternion",
            }
            .to_string(),
            vertices: parts.vertices.into_iter().map(Into::into).collect(),
            triangles: parts.triangles,
            influences: parts.influences,
            bind: parts.bind.iter().map(rigid::to_row).collect(),
        }
    }

    fn skin(self, links: usize) -> Result<Skin, String> {
        let parts = SkinParts {
            blending: match self.blending.as_str() {
                "linear" => Blending::Linear,
                "dual_quaternion" => Blending::DualQuaternion,
                other => return Err(format!("blending {:?}; expected linear or dual_quaternion", excerpt(other))),
            },
            name: self.name,
            vertices: self.vertices.into_iter().map(Point3::from).collect(),
            triangles: self.triangles,
            influences: self.influences,
            bind: self.bind.iter().map(rigid::from_row).collect::<Result<_, _>>()?,
        };
        Skin::from_parts(parts, links)
    }
}

impl LinkRecord {
    fn new(link: &Link) -> Self {
        let inertia = link.inertia.as_ref().map(|inertia| InertiaRecord {
            mass: inertia.mass,
            centre_of_mass: inertia.centre_of_mass.into(),
            tensor: inertia.tensor.transpose().into(),
        });
        Self { name: link.name.clone(), solids: link.solids.iter().map(SolidRecord::new).collect(), inertia }
    }

    fn link(self) -> Result<Link, String> {
        let inertia = self.inertia.map(|inertia| Inertia {
            mass: inertia.mass,
            centre_of_mass: inertia.centre_of_mass.into(),
            tensor: Matrix3::from(inertia.tensor).transpose(),
        });
        let solids = self.solids.into_iter().map(SolidRecord::solid).collect::<Result<_, _>>();
        Ok(Link {
            solids: solids.map_err(|e| format!("link {:?}: {e}", excerpt(&self.name)))?,
            name: self.name,
            inertia,
        })
    }
}

impl SolidRecord {
    pub(crate) fn new(solid: &Solid) -> Self {
        match solid {
            Solid::TaperedCapsule(c) => {
                Self::TaperedCapsule { a: c.a.into(), b: c.b.into(), radius_a: c.radius_a, radius_b: c.radius_b }
            }
            Solid::Box { link_from_box, half_extents } => {
                Self::Box { frame: RigidRecord::new(link_from_box), half_extents: *half_extents }
            }
            Solid::Cylinder { link_from_cylinder, radius, half_length } => Self::Cylinder {
                frame: RigidRecord::new(link_from_cylinder),
                radius: *radius,
                half_length: *half_length,
            },
            Solid::Mesh { vertices, triangles } => {
                Self::Mesh { vertices: vertices.iter().map(|v| (*v).into()).collect(), triangles: triangles.clone() }
            }
        }
    }

    pub(crate) fn solid(self) -> Result<Solid, String> {
        Ok(match self {
            Self::TaperedCapsule { a, b, radius_a, radius_b } => {
                Solid::TaperedCapsule(TaperedCapsule { a: a.into(), b: b.into(), radius_a, radius_b })
            }
            Self::Box { frame, half_extents } => Solid::Box { link_from_box: frame.transform()?, half_extents },
            Self::Cylinder { frame, radius, half_length } => {
                Solid::Cylinder { link_from_cylinder: frame.transform()?, radius, half_length }
            }
            Self::Mesh { vertices, triangles } => {
                if triangles.as_flattened().iter().any(|v| *v as usize >= vertices.len()) {
                    return Err("a triangle refers to a vertex that does not exist".to_string());
                }
                Solid::Mesh { vertices: vertices.into_iter().map(Point3::from).collect(), triangles }
            }
        })
    }
}

impl JointRecord {
    fn new(joint: &Joint) -> Self {
        let kind = match &joint.kind {
            JointKind::Fixed => KindRecord::Fixed,
            JointKind::Revolute { axis, drive } => {
                KindRecord::Revolute { axis: axis.into_inner().into(), drive: *drive }
            }
            JointKind::Prismatic { axis, drive } => {
                KindRecord::Prismatic { axis: axis.into_inner().into(), drive: *drive }
            }
            JointKind::Spherical { first } => KindRecord::Spherical { first: *first },
            JointKind::Floating { first } => KindRecord::Floating { first: *first },
        };
        Self {
            name: joint.name.clone(),
            parent: joint.parent,
            origin: RigidRecord::new(&joint.parent_from_joint),
            kind,
        }
    }

    /// Joint `index` of a body with `degrees` degrees of freedom.
    fn joint(self, index: usize, degrees: usize) -> Result<Joint, String> {
        if self.parent > index {
            return Err(format!("parent {} does not come before its child", self.parent));
        }
        let (kind, last) = match self.kind {
            KindRecord::Fixed => (JointKind::Fixed, None),
            KindRecord::Revolute { axis, drive } => {
                (JointKind::Revolute { axis: unit(axis)?, drive }, Some(drive.degree_of_freedom))
            }
            KindRecord::Prismatic { axis, drive } => {
                (JointKind::Prismatic { axis: unit(axis)?, drive }, Some(drive.degree_of_freedom))
            }
            KindRecord::Spherical { first } => (JointKind::Spherical { first }, Some(first.saturating_add(2))),
            KindRecord::Floating { first } => (JointKind::Floating { first }, Some(first.saturating_add(5))),
        };
        if last.is_some_and(|last| last >= degrees) {
            return Err(format!("refers to a degree of freedom outside the body's {degrees}"));
        }
        Ok(Joint { name: self.name, parent: self.parent, parent_from_joint: self.origin.transform()?, kind })
    }
}

fn unit(axis: [f64; 3]) -> Result<Unit<Vector3<f64>>, String> {
    let axis = Vector3::from(axis);
    if (axis.norm() - 1.0).abs() < 1e-9 {
        Ok(Unit::new_unchecked(axis))
    } else {
        Err("its axis does not have length 1".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn a_body_with_every_kind_of_joint_and_solid_is_read_back_to_the_bit() {
        let body = fixture::every_kind_of_body();
        assert_eq!(from_json("b", &to_json("b", &body).unwrap()).unwrap(), body);
    }

    #[test]
    fn bodies_that_break_an_invariant_are_refused_by_name() {
        let json: serde_json::Value =
            serde_json::from_slice(&to_json("b", &fixture::every_kind_of_body()).unwrap()).unwrap();
        let message = |path: &str, value: serde_json::Value| {
            let mut broken = json.clone();
            *broken.pointer_mut(path).unwrap() = value;
            from_json("b", broken.to_string().as_bytes()).unwrap_err().to_string()
        };
        assert!(message("/joints/1/parent", 4.into()).contains("joint \"slide\": parent 4"));
        assert!(message("/joints/0/kind/revolute/axis/0", 3.0.into()).contains("length 1"));
        assert!(message("/joints/2/kind/spherical/first", 99.into()).contains("degree of freedom"));
        assert!(message("/joints/2/kind/spherical/first", u64::MAX.into()).contains("degree of freedom"));
        assert!(message("/markers/pelvis/link", 77.into()).contains("no link 77"));
        assert!(message("/schema", "other/2".into()).contains("skiagraph.body/1"));
    }
}
