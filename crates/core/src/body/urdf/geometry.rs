//! The solids of a link: URDF geometry, and the naming convention for tapered capsules.

use std::io;

use nalgebra::{Isometry3, Point3, Vector3};
use roxmltree::Node;
use urdf_rs::Geometry;

use super::document::Document;
use super::limits::Allowance;
use super::{UrdfError, isometry, mesh};
use crate::body::{Link, Solid};
use crate::input::{excerpt, excerpts};
use crate::raster::TaperedCapsule;

/// Greatest extent of a solid, metres.
const MAX_SIZE: f64 = 100.0;

struct GeometryElement<'a, 't> {
    node: Node<'a, 't>,
    name: Option<&'a str>,
    link_from_solid: Isometry3<f64>,
    geometry: &'a Geometry,
}

/// One end of a tapered capsule, waiting for the other.
struct End<'a, 't> {
    node: Node<'a, 't>,
    name: &'a str,
    side: &'a str,
    centre: Point3<f64>,
    radius: f64,
}

/// The source of meshes, and the meshes that could not be read.
pub(super) struct Meshes<'a> {
    fetch: &'a dyn Fn(&str) -> io::Result<Vec<u8>>,
    /// Names as in the URDF, each once.
    missing: Vec<String>,
    /// Number of requests for missing meshes.
    misses: usize,
    first: Option<UrdfError>,
    /// The remaining geometry allowance.
    allowance: Allowance,
}

/// Greatest number of missing meshes listed in a note.
const LISTED: usize = 8;

impl<'a> Meshes<'a> {
    pub(super) fn new(fetch: &'a dyn Fn(&str) -> io::Result<Vec<u8>>) -> Self {
        Self { fetch, missing: Vec::new(), misses: 0, first: None, allowance: Allowance::default() }
    }

    fn miss(&mut self, document: &Document<'_>, node: Node<'_, '_>, name: &str, reason: &str) {
        self.misses += 1;
        if !self.missing.iter().any(|known| known == name) {
            self.missing.push(name.to_owned());
        }
        let problem = || {
            format!(
                "mesh `{}`: {reason}; this body has no other geometry: put its meshes at the paths in the URDF, give its \
                links <visual> solids, or build solids from its joints: solids = \"from_joints\" beside the scenario's `robot` \
                (inspect: --solids from_joints)",
                excerpt(name)
            )
        };
        self.first.get_or_insert_with(|| document.refuse(node, problem()));
    }

    /// A note on omitted meshes, if any.
    pub(super) fn note(self, links: &[Link]) -> Result<Option<String>, UrdfError> {
        let Some(first) = self.first else { return Ok(None) };
        if links.iter().all(|link| link.solids.is_empty()) {
            return Err(first);
        }
        let (count, listed) = (self.missing.len(), excerpts(self.missing.iter(), LISTED));
        Ok(Some(format!(
            "{count} of the meshes cannot be read and are left out: {listed}; the body lacks their shape (solids = \
            \"from_joints\" beside `robot` builds solids from the joints)"
        )))
    }
}

/// A link's geometry: its visual solids, or its collision solids if it has no visual or one of its meshes is missing.
pub(super) fn solids(
    document: &Document<'_>,
    node: Node<'_, '_>,
    link: &urdf_rs::Link,
    meshes: &mut Meshes<'_>,
) -> Result<Vec<Solid>, UrdfError> {
    let nodes = |tag: &'static str| node.children().filter(move |n| n.has_tag_name(tag));
    let visuals = nodes("visual").zip(&link.visual);
    let visuals: Vec<_> =
        visuals.map(|(node, v)| GeometryElement::new(node, &v.name, &v.origin, &v.geometry)).collect();
    let misses = meshes.misses;
    let solids = joined(document, &visuals, meshes)?;
    if !visuals.is_empty() && meshes.misses == misses {
        return Ok(solids);
    }
    let collisions = nodes("collision").zip(&link.collision);
    let collisions: Vec<_> =
        collisions.map(|(node, c)| GeometryElement::new(node, &c.name, &c.origin, &c.geometry)).collect();
    let instead = joined(document, &collisions, meshes)?;
    Ok(if instead.is_empty() { solids } else { instead })
}

/// The geometry of the elements, with the ends of tapered capsules joined.
fn joined(
    document: &Document<'_>,
    elements: &[GeometryElement<'_, '_>],
    meshes: &mut Meshes<'_>,
) -> Result<Vec<Solid>, UrdfError> {
    let mut solids = Vec::with_capacity(elements.len());
    let mut ends: Vec<End<'_, '_>> = Vec::new();
    for element in elements {
        meshes.allowance.take_solid().map_err(|problem| document.refuse(element.node, problem))?;
        match element.taper_end(document)? {
            Some(end) => match ends.iter().position(|e| e.name == end.name) {
                Some(other) => solids.push(ends.swap_remove(other).join(document, &end)?),
                None => ends.push(end),
            },
            None => solids.extend(element.solid(document, meshes)?),
        }
    }
    match ends.first() {
        Some(end) => Err(document.refuse(
            end.node,
            format!(
                "taper:{}:{} has no counterpart; the link needs both taper:{0}:a and taper:{0}:b",
                end.name, end.side
            ),
        )),
        None => Ok(solids),
    }
}

impl<'a, 't> GeometryElement<'a, 't> {
    fn new(node: Node<'a, 't>, name: &'a Option<String>, origin: &urdf_rs::Pose, geometry: &'a Geometry) -> Self {
        Self { node, name: name.as_deref(), link_from_solid: isometry(origin), geometry }
    }

    /// The end of a tapered capsule declared by this sphere's name, if any.
    fn taper_end(&self, document: &Document<'_>) -> Result<Option<End<'a, 't>>, UrdfError> {
        let Some(rest) = self.name.and_then(|n| n.strip_prefix("taper:")) else { return Ok(None) };
        let Some((name, side @ ("a" | "b"))) = rest.rsplit_once(':') else {
            return Err(document.refuse(self.node, format!("`taper:{rest}`: expected taper:NAME:a or taper:NAME:b")));
        };
        let Geometry::Sphere { radius } = self.geometry else {
            return Err(document.refuse(self.node, format!("`taper:{rest}` must be a <sphere>")));
        };
        let centre = self.link_from_solid.translation.vector.into();
        self.check_place(document)?;
        Ok(Some(End { node: self.node, name, side, centre, radius: self.size(document, *radius)? }))
    }

    /// `None` for a mesh that cannot be read.
    fn solid(&self, document: &Document<'_>, meshes: &mut Meshes<'_>) -> Result<Option<Solid>, UrdfError> {
        self.check_place(document)?;
        let along_z = |half: f64, radius: f64| {
            let ends = [-half, half].map(|z| self.link_from_solid * Point3::new(0.0, 0.0, z));
            Solid::TaperedCapsule(TaperedCapsule { a: ends[0], b: ends[1], radius_a: radius, radius_b: radius })
        };
        Ok(Some(match self.geometry {
            Geometry::Sphere { radius } => along_z(0.0, self.size(document, *radius)?),
            Geometry::Capsule { radius, length } => {
                let radius = self.size(document, *radius)?;
                let half = if *length == 0.0 { 0.0 } else { 0.5 * self.size(document, *length)? };
                along_z(half, radius)
            }
            Geometry::Cylinder { radius, length } => Solid::Cylinder {
                link_from_cylinder: self.link_from_solid,
                radius: self.size(document, *radius)?,
                half_length: 0.5 * self.size(document, *length)?,
            },
            Geometry::Box { size } => Solid::Box {
                link_from_box: self.link_from_solid,
                half_extents: [
                    0.5 * self.size(document, size[0])?,
                    0.5 * self.size(document, size[1])?,
                    0.5 * self.size(document, size[2])?,
                ],
            },
            Geometry::Mesh { filename, scale } => {
                let refuse =
                    |problem: String| document.refuse(self.node, format!("mesh `{}`: {problem}", excerpt(filename)));
                let fetched = match mesh::unsupported(filename) {
                    Some(reason) => Err(reason),
                    None => match (meshes.fetch)(filename) {
                        // it exists, but this file may not refer to it
                        Err(e) if e.kind() == io::ErrorKind::PermissionDenied => return Err(refuse(e.to_string())),
                        fetched => fetched.map_err(|e| format!("cannot be read: {e}")),
                    },
                };
                let bytes = match fetched {
                    Ok(bytes) => bytes,
                    Err(reason) => {
                        meshes.miss(document, self.node, filename, &reason);
                        return Ok(None);
                    }
                };
                let (mut vertices, mut triangles) = mesh::read(filename, &bytes).map_err(refuse)?;
                meshes.allowance.take_mesh(vertices.len(), triangles.len()).map_err(refuse)?;
                let scale = scale.map_or(Vector3::repeat(1.0), |s| Vector3::from(s.0));
                for vertex in &mut vertices {
                    let scaled = Point3::from(vertex.coords.component_mul(&scale));
                    if scaled.coords.amax() > MAX_SIZE {
                        return Err(refuse(format!("extends beyond {MAX_SIZE} m; give <mesh> a `scale`")));
                    }
                    *vertex = self.link_from_solid * scaled;
                }
                // a mirrored mesh would be inside out
                if scale.iter().product::<f64>() < 0.0 {
                    triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
                }
                Solid::Mesh { vertices, triangles }
            }
        }))
    }

    fn size(&self, document: &Document<'_>, size: f64) -> Result<f64, UrdfError> {
        // some files mark centres of mass with invisible solids of size 0
        if (0.0..=MAX_SIZE).contains(&size) {
            return Ok(size);
        }
        Err(document.refuse(self.node, format!("a solid of size {size}; expected 0 to {MAX_SIZE} m")))
    }

    fn check_place(&self, document: &Document<'_>) -> Result<(), UrdfError> {
        if self.link_from_solid.translation.vector.amax() <= MAX_SIZE {
            return Ok(());
        }
        Err(document.refuse(self.node, format!("a solid is farther than {MAX_SIZE} m from its link")))
    }
}

impl End<'_, '_> {
    fn join(self, document: &Document<'_>, other: &Self) -> Result<Solid, UrdfError> {
        if self.side == other.side {
            let problem = format!("a second taper:{}:{}; a tapered capsule has ends a and b", self.name, self.side);
            return Err(document.refuse(other.node, problem));
        }
        let (a, b) = if self.side == "a" { (&self, other) } else { (other, &self) };
        Ok(Solid::TaperedCapsule(TaperedCapsule { a: a.centre, b: b.centre, radius_a: a.radius, radius_b: b.radius }))
    }
}
