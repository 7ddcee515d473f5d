//! Humanoids from URDF: `urdf-rs` reads the values; this module adds checks and locates errors.
//!
//! A link's geometry is its `<visual>` elements, or its `<collision>` elements if it has no visual. Two visual spheres
//! named `taper:NAME:a` and `taper:NAME:b` on one link are the ends of one tapered capsule; other URDF tools show two
//! spheres. A fixed, empty link `marker_NAME` with [`super::Landmark::name`] places a marker and is not kept as a
//! link; markers without such a link are proposed by [`markers`] from names and shape.

mod axes;
mod collada;
mod document;
mod error;
mod geometry;
mod limits;
mod markers;
mod mesh;
mod package;
mod tree;

use std::io;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use document::Document;
pub use error::UrdfError;
use geometry::Meshes;
use markers::MarkerSet;

use super::{Humanoid, Inertia, Joint, Link};
use crate::input::{
    self,
    limits::{ROBOT, describe_size},
};

/// Greatest mass of a link, kilograms.
const MAX_MASS: f64 = 1e5;
/// Moments of inertia that are negative by at most this are rounding errors of the exporting program and become 0, kg
/// m^2.
const ROUNDED_OFF: f64 = 1e-9;

impl Humanoid {
    /// Builds a humanoid from the text of a URDF; `file` names it in messages, `meshes` returns the bytes of a mesh by
    /// its URI in the text. A byte-order mark, CRLF line ends and NUL bytes at the end are accepted.
    ///
    /// # Errors
    /// [`UrdfError`] with the line and the link or joint, what was expected and what to do.
    pub fn from_urdf(text: &str, file: &str, meshes: &dyn Fn(&str) -> io::Result<Vec<u8>>) -> Result<Self, UrdfError> {
        Self::read_urdf(text, file, Some(meshes))
    }

    /// As [`Self::from_urdf`], with capsules from joint to joint ([`Self::with_solids_from_joints`]) instead of the
    /// file's geometry, which is not read: meshes may be missing.
    ///
    /// # Errors
    /// As [`Self::from_urdf`], except for geometry.
    pub fn from_urdf_skeleton(text: &str, file: &str) -> Result<Self, UrdfError> {
        let mut body = Self::read_urdf(text, file, None)?.with_solids_from_joints();
        body.notes.push("solids are capsules from joint to joint; masses and inertias are the file's".to_owned());
        Ok(body)
    }

    /// Without a source of meshes no geometry is read.
    fn read_urdf(text: &str, file: &str, source: Option<MeshSource<'_>>) -> Result<Self, UrdfError> {
        let text = text.trim_start_matches('\u{feff}').trim_end_matches(|c: char| c == '\0' || c.is_whitespace());
        if text.len() as u64 > ROBOT {
            let (file, limit) = (input::plain(file), describe_size(ROBOT));
            let problem = format!("{file}: larger than {limit}; a URDF is a short text, with meshes in separate files");
            return Err(UrdfError::Refused(problem));
        }
        let text = document::with_name_spaces(text);
        let document = Document::parse(&text, file)?;
        let robot = document.check_and_read(&text)?;
        let mut notes: Vec<String> = document.note_of_quaternions().into_iter().collect();
        let tree = tree::order(&document, &robot, &mut notes)?;
        let axes = axes::read(&document, &robot, &tree, &mut notes)?;

        let (mut links, mut joints, mut markers) = (Vec::new(), Vec::new(), MarkerSet::default());
        let mut ours = vec![0; robot.links.len()];
        let mut meshes = source.map(Meshes::new);
        for &index in &tree.links {
            let node = document.link(index);
            let link = Link {
                name: robot.links[index].name.clone(),
                solids: match &mut meshes {
                    Some(meshes) => geometry::solids(&document, node, &robot.links[index], meshes)?,
                    None => Vec::new(),
                },
                inertia: inertia(&document, node, &robot.links[index].inertial)?,
            };
            if let Some(above) = tree.joint_above[index] {
                let joint = Joint {
                    name: robot.joints[above].name.clone(),
                    parent: ours[tree.parent_link[above]],
                    parent_from_joint: isometry(&robot.joints[above].origin),
                    kind: axes.kind(above),
                };
                if let Some(slot) = markers::slot(&link.name) {
                    if !tree.joints_below[index].is_empty() {
                        return Err(document.refuse(node, "a marker must have no children"));
                    }
                    markers[slot] = Some(markers::place(&document, node, &link, &joint)?);
                    continue;
                }
                joints.push(joint);
            }
            ours[index] = links.len();
            links.push(link);
        }
        if let Some(meshes) = meshes {
            notes.extend(meshes.note(&links)?);
        }
        let degrees_of_freedom = axes.degrees_of_freedom;
        let mut body = Self { name: robot.name, links, joints, degrees_of_freedom, markers, skin: None, notes };
        body.check_bounds().map_err(|problem| document.refuse_robot(problem))?;
        markers::propose(&mut body);
        Ok(body)
    }

    /// Reads a URDF file. Meshes are searched for relative to it, `package://` ones upwards from its directory.
    ///
    /// # Errors
    /// As [`Self::from_urdf`], and if the file or a mesh cannot be read.
    pub fn load(path: &Path) -> Result<Self, UrdfError> {
        let directory = path.parent().unwrap_or(Path::new("")).to_owned();
        Self::from_urdf(&text_of(path)?, &path.display().to_string(), &|uri| package::read(&directory, uri))
    }

    /// Reads a URDF file as in [`Self::from_urdf_skeleton`].
    ///
    /// # Errors
    /// As [`Self::from_urdf_skeleton`], and if the file cannot be read.
    pub fn load_skeleton(path: &Path) -> Result<Self, UrdfError> {
        Self::from_urdf_skeleton(&text_of(path)?, &path.display().to_string())
    }
}

/// Returns the bytes of a mesh by its URI.
type MeshSource<'a> = &'a dyn Fn(&str) -> io::Result<Vec<u8>>;

fn text_of(path: &Path) -> Result<String, UrdfError> {
    let file = path.display().to_string();
    let unreadable = |source| UrdfError::Unreadable { file: file.clone(), source };
    let bytes = input::read(path, ROBOT).map_err(unreadable)?;
    String::from_utf8(bytes).map_err(|e| {
        UrdfError::not_xml(&file, 1, &format!("the text is not UTF-8 ({}); save it as UTF-8", e.utf8_error()))
    })
}

/// Vertices, and triangles as indices into them.
#[doc(hidden)]
pub type MeshParts = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// The vertices and triangles of a mesh file with this name; for `fuzz/`.
#[doc(hidden)]
pub fn mesh_from_bytes(name: &str, bytes: &[u8]) -> Result<MeshParts, String> {
    mesh::read(name, bytes)
}

/// A URDF `<origin>`: fixed-axis roll, pitch, yaw and a translation.
fn isometry(origin: &urdf_rs::Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = origin.rpy.0;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(origin.xyz.0)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

fn inertia(
    document: &Document<'_>,
    link: roxmltree::Node<'_, '_>,
    inertial: &urdf_rs::Inertial,
) -> Result<Option<Inertia>, UrdfError> {
    let mass = inertial.mass.value;
    let place = document::child(link, "inertial").unwrap_or(link);
    if !(0.0..=MAX_MASS).contains(&mass) {
        return Err(document.refuse(place, format!("a mass is {mass} kg; expected 0 to {MAX_MASS} kg")));
    }
    if mass == 0.0 {
        return Ok(None);
    }
    let link_from_inertia = isometry(&inertial.origin);
    let i = &inertial.inertia;
    if [i.ixx, i.iyy, i.izz].iter().any(|moment| *moment < -ROUNDED_OFF) {
        return Err(document.refuse(place, "a moment of inertia is negative; ixx, iyy and izz must be 0 or more"));
    }
    let [ixx, iyy, izz] = [i.ixx, i.iyy, i.izz].map(|moment| moment.max(0.0));
    let rotation = link_from_inertia.rotation.to_rotation_matrix();
    let tensor = Matrix3::new(ixx, i.ixy, i.ixz, i.ixy, iyy, i.iyz, i.ixz, i.iyz, izz);
    Ok(Some(Inertia {
        mass,
        centre_of_mass: link_from_inertia.translation.vector.into(),
        tensor: rotation * tensor * rotation.inverse(),
    }))
}

#[cfg(test)]
mod tests;
