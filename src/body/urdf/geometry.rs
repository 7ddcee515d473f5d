//! The solids of a link: URDF geometry, and the naming convention for tapered capsules.

use std::io;

use nalgebra::{Isometry3, Point3, Vector3};
use roxmltree::Node;
use urdf_rs::Geometry;

use super::document::Document;
use super::limits::Allowance;
use super::{UrdfError, isometry, mesh};
use crate::body::Flesh;
use crate::input::excerpt;
use crate::raster::TaperedCapsule;

/// Greatest extent of a solid, metres.
const MAX_SIZE: f64 = 100.0;

/// One visual or collision element.
struct Solid<'a, 't> {
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

/// What casts the shadow of a link.
pub(super) fn flesh(
    document: &Document<'_>,
    node: Node<'_, '_>,
    link: &urdf_rs::Link,
    meshes: &dyn Fn(&str) -> io::Result<Vec<u8>>,
    allowance: &Allowance,
) -> Result<Vec<Flesh>, UrdfError> {
    let nodes = |tag: &'static str| node.children().filter(move |n| n.has_tag_name(tag));
    let solids: Vec<Solid<'_, '_>> = if link.visual.is_empty() {
        let collisions = nodes("collision").zip(&link.collision);
        collisions.map(|(node, c)| Solid::new(node, &c.name, &c.origin, &c.geometry)).collect()
    } else {
        nodes("visual").zip(&link.visual).map(|(node, v)| Solid::new(node, &v.name, &v.origin, &v.geometry)).collect()
    };
    let mut flesh = Vec::with_capacity(solids.len());
    let mut ends: Vec<End<'_, '_>> = Vec::new();
    for solid in &solids {
        allowance.take_solid().map_err(|problem| document.refuse(solid.node, problem))?;
        match solid.taper_end(document)? {
            Some(end) => match ends.iter().position(|e| e.name == end.name) {
                Some(other) => flesh.push(ends.swap_remove(other).join(document, &end)?),
                None => ends.push(end),
            },
            None => flesh.push(solid.flesh(document, meshes, allowance)?),
        }
    }
    match ends.first() {
        Some(end) => Err(document.refuse(
            end.node,
            format!("taper:{}:{} stands alone; the link needs both taper:{0}:a and taper:{0}:b", end.name, end.side),
        )),
        None => Ok(flesh),
    }
}

impl<'a, 't> Solid<'a, 't> {
    fn new(node: Node<'a, 't>, name: &'a Option<String>, origin: &urdf_rs::Pose, geometry: &'a Geometry) -> Self {
        Self { node, name: name.as_deref(), link_from_solid: isometry(origin), geometry }
    }

    /// The end of a tapered capsule that this ball is by its name, if it is one.
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

    fn flesh(
        &self,
        document: &Document<'_>,
        meshes: &dyn Fn(&str) -> io::Result<Vec<u8>>,
        allowance: &Allowance,
    ) -> Result<Flesh, UrdfError> {
        self.check_place(document)?;
        let along_z = |half: f64, radius: f64| {
            let ends = [-half, half].map(|z| self.link_from_solid * Point3::new(0.0, 0.0, z));
            Flesh::TaperedCapsule(TaperedCapsule { a: ends[0], b: ends[1], radius_a: radius, radius_b: radius })
        };
        Ok(match self.geometry {
            Geometry::Sphere { radius } => along_z(0.0, self.size(document, *radius)?),
            Geometry::Capsule { radius, length } => {
                let radius = self.size(document, *radius)?;
                let half = if *length == 0.0 { 0.0 } else { 0.5 * self.size(document, *length)? };
                along_z(half, radius)
            }
            Geometry::Cylinder { radius, length } => Flesh::Cylinder {
                link_from_cylinder: self.link_from_solid,
                radius: self.size(document, *radius)?,
                half_length: 0.5 * self.size(document, *length)?,
            },
            Geometry::Box { size } => Flesh::Box {
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
                let bytes = meshes(filename).map_err(|e| refuse(format!("cannot be read: {e}")))?;
                let (mut vertices, triangles) = mesh::read(filename, &bytes).map_err(refuse)?;
                allowance.take_mesh(vertices.len(), triangles.len()).map_err(refuse)?;
                let scale = scale.map_or(Vector3::repeat(1.0), |s| Vector3::from(s.0));
                for vertex in &mut vertices {
                    let scaled = Point3::from(vertex.coords.component_mul(&scale));
                    if scaled.coords.amax() > MAX_SIZE {
                        return Err(refuse(format!("reaches beyond {MAX_SIZE} m; give <mesh> a `scale`")));
                    }
                    *vertex = self.link_from_solid * scaled;
                }
                Flesh::Mesh { vertices, triangles }
            }
        })
    }

    fn size(&self, document: &Document<'_>, size: f64) -> Result<f64, UrdfError> {
        // real files mark centres of mass with solids of size 0, which cast no shadow
        if (0.0..=MAX_SIZE).contains(&size) {
            return Ok(size);
        }
        Err(document.refuse(self.node, format!("a solid of size {size}; expected 0 to {MAX_SIZE} m")))
    }

    fn check_place(&self, document: &Document<'_>) -> Result<(), UrdfError> {
        if self.link_from_solid.translation.vector.amax() <= MAX_SIZE {
            return Ok(());
        }
        Err(document.refuse(self.node, format!("a solid farther than {MAX_SIZE} m from its link")))
    }
}

impl End<'_, '_> {
    fn join(self, document: &Document<'_>, other: &Self) -> Result<Flesh, UrdfError> {
        if self.side == other.side {
            let problem = format!("a second taper:{}:{}; a tapered capsule has ends a and b", self.name, self.side);
            return Err(document.refuse(other.node, problem));
        }
        let (a, b) = if self.side == "a" { (&self, other) } else { (other, &self) };
        Ok(Flesh::TaperedCapsule(TaperedCapsule { a: a.centre, b: b.centre, radius_a: a.radius, radius_b: b.radius }))
    }
}
