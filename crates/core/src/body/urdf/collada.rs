//! Reads Collada (.dae) meshes: the triangles of a scene, in metres.
//!
//! A custom reader on top of the XML parser: existing crates read the whole document (materials, textures, animation)
//! and reject unknown parts, but a body needs only positions and faces. Supported are `<triangles>`, `<polylist>`,
//! `<polygons>`, `<trifans>` and `<tristrips>`, placed by the nodes of the visual scene (matrix, translate, rotate,
//! scale; instances of geometries, nodes and skins) and scaled by `<unit>`. As in RViz and MoveIt, `<up_axis>` is
//! ignored: robots are modelled in the axes of their links.

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix4, Point3, Unit, Vector3};
use roxmltree::{Node, NodeId};

use super::MeshParts;
use super::document::child;
use super::limits::{MOST_MESH_NODES, parse_xml};
use crate::body::rotation_about;
use crate::input::unquoted;

const MAX_DEPTH: usize = 64;
/// Limits of instances of geometries and nodes, and of their vertices and triangles.
const MAX_INSTANCES: usize = 10_000;
const MAX_ELEMENTS: usize = 1 << 22;

/// Reads a Collada document.
pub(super) fn read(text: &str) -> Result<MeshParts, String> {
    let xml = parse_xml(text, MOST_MESH_NODES)
        .map_err(|(line, problem)| format!("not well-formed XML: line {line}: {}", unquoted(problem)))?;
    let root = xml.root_element();
    if !root.has_tag_name("COLLADA") {
        return Err("expected <COLLADA> as the outermost element".to_owned());
    }
    let elements = root.descendants().filter(Node::is_element);
    let ids = elements.filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let unit = child(root, "asset").and_then(|asset| child(asset, "unit")).and_then(|unit| unit.attribute("meter"));
    let metres: f64 = unit.map_or(Ok(1.0), |m| m.trim().parse()).map_err(|_| "<unit meter>: expected a number")?;
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(format!("<unit meter=\"{metres}\">: expected a number above 0"));
    }
    let mut scene = Scene { ids, mesh: MeshParts::default(), instances: 0 };
    let scale = Matrix4::new_scaling(metres);
    match visual_scene(root, &scene) {
        Some(visual) => scene.nodes(visual, &scale, 0)?,
        None => {
            for geometry in root.descendants().filter(|n| n.has_tag_name("geometry")) {
                scene.geometry(geometry, &scale)?;
            }
        }
    }
    Ok(scene.mesh)
}

/// The active scene of the document, or its first.
fn visual_scene<'a, 't>(root: Node<'a, 't>, scene: &Scene<'a, 't>) -> Option<Node<'a, 't>> {
    let shown = child(root, "scene").and_then(|n| child(n, "instance_visual_scene"));
    let shown = shown.and_then(|instance| scene.target(instance, "url"));
    shown.or_else(|| root.descendants().find(|n| n.has_tag_name("visual_scene")))
}

/// A document and the mesh read from it.
struct Scene<'a, 't> {
    ids: HashMap<&'a str, Node<'a, 't>>,
    mesh: MeshParts,
    instances: usize,
}

impl<'a, 't> Scene<'a, 't> {
    /// The element referred to by `#ID` in an attribute.
    fn target(&self, node: Node<'a, 't>, attribute: &str) -> Option<Node<'a, 't>> {
        self.ids.get(node.attribute(attribute)?.trim().trim_start_matches('#')).copied()
    }

    /// Adds everything in the nodes below `parent`.
    fn nodes(&mut self, parent: Node<'a, 't>, outer: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        for node in parent.children().filter(|n| n.has_tag_name("node")) {
            self.node(node, outer, depth + 1)?;
        }
        Ok(())
    }

    fn node(&mut self, node: Node<'a, 't>, outer: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!("nodes nested deeper than {MAX_DEPTH}"));
        }
        let mut placed = *outer;
        for part in node.children().filter(Node::is_element) {
            if let Some(transform) = transform(part)? {
                placed *= transform;
            }
        }
        for instance in node.children().filter(|n| n.is_element()) {
            let tag = instance.tag_name().name();
            if !["instance_geometry", "instance_controller", "instance_node"].contains(&tag) {
                continue;
            }
            self.instances += 1;
            if self.instances > MAX_INSTANCES {
                return Err(format!("more than {MAX_INSTANCES} instances"));
            }
            let url = instance.attribute("url").unwrap_or_default();
            let Some(target) = self.target(instance, "url") else {
                return Err(format!("<{tag} url=\"{url}\">: there is no such element"));
            };
            match tag {
                "instance_node" => self.node(target, &placed, depth + 1)?,
                "instance_geometry" => self.geometry(target, &placed)?,
                _ => self.skin(target, &placed)?,
            }
        }
        self.nodes(node, &placed, depth)
    }

    /// A skinned mesh in its bind shape.
    fn skin(&mut self, controller: Node<'a, 't>, placed: &Matrix4<f64>) -> Result<(), String> {
        let Some(skin) = child(controller, "skin") else { return Ok(()) };
        let shape = child(skin, "bind_shape_matrix").map(matrix).transpose()?.unwrap_or_else(Matrix4::identity);
        match self.target(skin, "source") {
            Some(geometry) => self.geometry(geometry, &(placed * shape)),
            None => Err("a <skin> refers to no geometry".to_owned()),
        }
    }

    fn geometry(&mut self, geometry: Node<'a, 't>, placed: &Matrix4<f64>) -> Result<(), String> {
        let Some(mesh) = child(geometry, "mesh") else { return Ok(()) };
        let mut known = HashMap::new();
        for part in mesh.children().filter(Node::is_element) {
            let shape = part.tag_name().name();
            if ["triangles", "polylist", "polygons", "trifans", "tristrips"].contains(&shape) {
                self.primitives(part, shape, placed, &mut known)?;
            }
        }
        Ok(())
    }

    /// `known` has the start and number of the positions of the geometry's other primitives.
    fn primitives(
        &mut self,
        part: Node<'a, 't>,
        shape: &str,
        placed: &Matrix4<f64>,
        known: &mut HashMap<NodeId, (usize, usize)>,
    ) -> Result<(), String> {
        let inputs = || part.children().filter(|n| n.has_tag_name("input"));
        let offset = |input: &Node<'_, '_>| input.attribute("offset").map_or(Ok(0), |o| o.trim().parse::<usize>());
        let offsets: Result<Vec<usize>, _> = inputs().map(|input| offset(&input)).collect();
        let offsets = offsets.map_err(|_| "<input offset>: expected a number")?;
        let stride = offsets.iter().max().map_or(1, |most| most.saturating_add(1));
        let Some((input, at)) = inputs().zip(&offsets).find(|(i, _)| i.attribute("semantic") == Some("VERTEX")) else {
            return Err(format!("<{shape}> has no input VERTEX"));
        };
        let vertices = self.target(input, "source").ok_or("an input VERTEX refers to no positions")?;
        let (first, count) = match known.get(&vertices.id()) {
            Some(place) => *place,
            None => {
                let place = self.place_vertices(vertices, placed)?;
                *known.entry(vertices.id()).or_insert(place)
            }
        };
        // mirrored faces would be inside out
        let is_mirrored = placed.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for corners in faces(part, shape, stride, *at)? {
            let index = |corner: &usize| {
                if *corner < count {
                    u32::try_from(first + corner).map_err(|_| "too many vertices".to_owned())
                } else {
                    Err(format!("a face refers to vertex {corner}; there are {count}"))
                }
            };
            let corners = corners.iter().map(index).collect::<Result<Vec<u32>, String>>()?;
            let is_strip = shape == "tristrips";
            for at in 2..corners.len() {
                let first = if is_strip { at - 2 } else { 0 };
                let mut triangle = [corners[first], corners[at - 1], corners[at]];
                // every second triangle of a strip has the other order
                if is_mirrored != (is_strip && at % 2 == 1) {
                    triangle.swap(1, 2);
                }
                self.mesh.1.push(triangle);
            }
            if self.mesh.1.len() > MAX_ELEMENTS {
                return Err(format!("more than {MAX_ELEMENTS} triangles; simplify it"));
            }
        }
        Ok(())
    }

    /// Adds the positions of `<vertices>`; returns their start and number.
    fn place_vertices(&mut self, vertices: Node<'a, 't>, placed: &Matrix4<f64>) -> Result<(usize, usize), String> {
        let positions = self.positions(vertices)?;
        let first = self.mesh.0.len();
        if first + positions.len() > MAX_ELEMENTS {
            return Err(format!("more than {MAX_ELEMENTS} vertices; simplify it"));
        }
        self.mesh.0.extend(positions.iter().map(|p| placed.transform_point(p)));
        match self.mesh.0[first..].iter().find(|p| !p.iter().all(|c| c.is_finite())) {
            Some(vertex) => Err(format!("vertex {vertex} is not finite")),
            None => Ok((first, positions.len())),
        }
    }

    /// The POSITION input of `<vertices>`.
    fn positions(&self, vertices: Node<'a, 't>) -> Result<Vec<Point3<f64>>, String> {
        let no_positions = || "an input VERTEX refers to no positions".to_owned();
        let position =
            vertices.children().find(|n| n.has_tag_name("input") && n.attribute("semantic") == Some("POSITION"));
        let source = position.and_then(|p| self.target(p, "source")).ok_or_else(no_positions)?;
        let array = child(source, "float_array").ok_or_else(no_positions)?;
        let accessor = child(source, "technique_common").and_then(|t| child(t, "accessor"));
        let number = |name: &str, default: usize| {
            accessor.and_then(|a| a.attribute(name)).map_or(Ok(default), |v| v.trim().parse::<usize>())
        };
        let wrong = |_| "<accessor>: expected whole numbers".to_owned();
        let (stride, offset) = (number("stride", 3).map_err(wrong)?, number("offset", 0).map_err(wrong)?);
        if stride < 3 {
            return Err(format!("<accessor stride=\"{stride}\">: a position has 3 numbers"));
        }
        let numbers = floats(array)?;
        let rows = numbers.get(offset..).unwrap_or_default().chunks(stride).filter(|row| row.len() >= 3);
        Ok(rows.map(|row| Point3::new(row[0], row[1], row[2])).collect())
    }
}

/// The faces of a primitive, each a list of position indices.
fn faces(part: Node<'_, '_>, shape: &str, stride: usize, at: usize) -> Result<Vec<Vec<usize>>, String> {
    let indices = |node: Node<'_, '_>| -> Result<Vec<usize>, String> {
        let words = node.text().map_or(Vec::new(), |t| t.split_ascii_whitespace().collect());
        let number = |word: &&str| word.parse().map_err(|_| format!("<p>: `{word}` is not an index"));
        words.iter().skip(at).step_by(stride).map(number).collect()
    };
    let lists = part.children().filter(|n| n.has_tag_name("p") || n.has_tag_name("ph"));
    // holes in polygons are ignored
    let lists = lists.map(|n| indices(child(n, "p").unwrap_or(n))).collect::<Result<Vec<_>, String>>()?;
    Ok(match shape {
        "triangles" => lists.concat().chunks_exact(3).map(<[usize]>::to_vec).collect(),
        "polylist" => {
            let counts = child(part, "vcount").and_then(|n| n.text()).unwrap_or_default().split_ascii_whitespace();
            let all = lists.concat();
            let mut rest = all.as_slice();
            let mut faces = Vec::new();
            for word in counts {
                let count: usize = word.parse().map_err(|_| format!("<vcount>: `{word}` is not a number"))?;
                let Some((face, after)) = rest.split_at_checked(count) else {
                    return Err("<vcount> counts more corners than <p> has".to_owned());
                };
                faces.push(face.to_vec());
                rest = after;
            }
            faces
        }
        _ => lists,
    })
}

fn floats(node: Node<'_, '_>) -> Result<Vec<f64>, String> {
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    words.map(|word| word.parse().map_err(|_| format!("`{word}` is not a number"))).collect()
}

fn exactly<const N: usize>(node: Node<'_, '_>) -> Result<[f64; N], String> {
    let tag = node.tag_name().name();
    floats(node)?.try_into().map_err(|_| format!("<{tag}>: expected {N} numbers"))
}

/// Sixteen numbers, row by row.
fn matrix(node: Node<'_, '_>) -> Result<Matrix4<f64>, String> {
    exactly::<16>(node).map(|numbers| Matrix4::from_row_slice(&numbers))
}

/// The transform defined by an element of a node, if any.
fn transform(node: Node<'_, '_>) -> Result<Option<Matrix4<f64>>, String> {
    Ok(Some(match node.tag_name().name() {
        "matrix" => matrix(node)?,
        "translate" => Matrix4::new_translation(&Vector3::from(exactly::<3>(node)?)),
        "scale" => Matrix4::new_nonuniform_scaling(&Vector3::from(exactly::<3>(node)?)),
        "rotate" => {
            let [x, y, z, degrees] = exactly::<4>(node)?;
            match Unit::try_new(Vector3::new(x, y, z), 1e-12) {
                Some(axis) => {
                    let turn: Matrix3<f64> = *rotation_about(&axis, degrees.to_radians()).to_rotation_matrix().matrix();
                    turn.to_homogeneous()
                }
                None => Matrix4::identity(),
            }
        }
        _ => return Ok(None),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A document with this unit, nodes and primitives of the unit square in its x-y plane.
    fn document(unit: &str, nodes: &str, primitives: &str) -> String {
        format!(
            "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\
             <asset>{unit}<up_axis>Y_UP</up_axis></asset><library_effects><effect><broken/></effect></library_effects>\
             <library_geometries><geometry id=\"g\"><mesh><source id=\"s\">\
             <float_array id=\"a\" count=\"999999999\">0 0 0 1 0 0 1 1 0 0 1 0</float_array>\
             <technique_common><accessor source=\"#a\" count=\"4\" stride=\"3\"/></technique_common></source>\
             <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>{primitives}</mesh></geometry>\
             </library_geometries><library_visual_scenes><visual_scene id=\"one\">{nodes}</visual_scene>\
             </library_visual_scenes><scene><instance_visual_scene url=\"#one\"/></scene></COLLADA>"
        )
    }

    const NODE: &str = "<node><instance_geometry url=\"#g\"/></node>";
    const INPUTS: &str = "<input semantic=\"NORMAL\" source=\"#s\" offset=\"1\"/>\
                          <input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>";

    fn triangles() -> String {
        format!("<triangles count=\"2\">{INPUTS}<p>0 9 1 9 2 9 0 9 2 9 3 9</p></triangles>")
    }

    #[test]
    fn every_kind_of_primitive_gives_the_same_square() {
        let expected = read(&document("", NODE, &triangles())).unwrap();
        assert_eq!(expected.1, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(expected.0[2], Point3::new(1.0, 1.0, 0.0));
        let corners = "<p>0 9 1 9 2 9 3 9</p>";
        for (tag, before) in [("polylist", "<vcount>4</vcount>"), ("polygons", ""), ("trifans", "")] {
            let primitives = format!("<{tag}>{INPUTS}{before}{corners}</{tag}>");
            assert_eq!(read(&document("", NODE, &primitives)).unwrap(), expected, "{tag}");
        }
        // all counter-clockwise, as the square is
        let strip = format!("<tristrips>{INPUTS}<p>0 9 1 9 3 9 2 9</p></tristrips>");
        assert_eq!(read(&document("", NODE, &strip)).unwrap().1, [[0, 1, 3], [1, 2, 3]]);
    }

    #[test]
    fn a_mirrored_node_is_not_inside_out() {
        let mirrored = "<node><scale>-1 1 1</scale><instance_geometry url=\"#g\"/></node>";
        assert_eq!(read(&document("", mirrored, &triangles())).unwrap().1, [[0, 2, 1], [0, 3, 2]]);
    }

    #[test]
    fn units_nodes_and_instances_place_the_mesh() {
        let unit = "<unit meter=\"0.01\" name=\"cm\"/>";
        let nodes = "<node><translate>100 0 0</translate><node><rotate>0 0 1 90</rotate><scale>2 1 1</scale>\
                     <instance_geometry url=\"#g\"/></node></node>\
                     <node><matrix>1 0 0 0 0 1 0 0 0 0 1 300 0 0 0 1</matrix><instance_geometry url=\"#g\"/></node>";
        let (vertices, triangles) = read(&document(unit, nodes, &triangles())).unwrap();
        assert_eq!((vertices.len(), triangles.len()), (8, 4));
        // (1, 1, 0) is scaled to (2, 1, 0), rotated to (-1, 2, 0), moved to (99, 2, 0) centimetres
        assert!((vertices[2] - Point3::new(0.99, 0.02, 0.0)).norm() < 1e-15, "{}", vertices[2]);
        assert!((vertices[6] - Point3::new(0.01, 0.01, 3.0)).norm() < 1e-15, "{}", vertices[6]);
        assert_eq!(triangles[2], [4, 5, 6]);
    }

    #[test]
    fn errors_of_invalid_documents_are_specific() {
        let message = |unit: &str, nodes: &str, primitives: &str| read(&document(unit, nodes, primitives)).unwrap_err();
        assert!(read("<a/>").unwrap_err().contains("expected <COLLADA>"));
        assert!(message("<unit meter=\"0\"/>", NODE, "").contains("expected a number above 0"));
        assert!(message("", "<node><instance_geometry url=\"#h\"/></node>", "").contains("url=\"#h\""));
        assert!(message("", "<node><matrix>1 2</matrix></node>", "").contains("expected 16 numbers"));
        let far = triangles().replace("3 9</p>", "4 9</p>");
        assert!(message("", NODE, &far).contains("refers to vertex 4; there are 4"));
        let counts = format!("<polylist>{INPUTS}<vcount>5</vcount><p>0 0 1 1</p></polylist>");
        assert!(message("", NODE, &counts).contains("counts more corners"));
        let attributes: String = (0..65).map(|i| format!("a{i}=\"\" ")).collect();
        let many = format!("<COLLADA>\n<b {attributes}/></COLLADA>");
        assert!(read(&many).unwrap_err().contains("line 2: an element has 65"));
        let nodes = "<p/>".repeat(MOST_MESH_NODES as usize);
        assert!(read(&format!("<COLLADA>{nodes}</COLLADA>")).unwrap_err().contains("more than 1000000 elements"));
        let ring = "<node id=\"n\"><instance_node url=\"#n\"/></node>";
        assert!(message("", ring, &triangles()).contains("nested deeper"));
        let many = format!("<node>{}</node>", "<instance_geometry url=\"#g\"/>".repeat(MAX_INSTANCES + 1));
        assert!(message("", &many, "").contains("instances"));
    }
}
