//! Triangle meshes: STL (binary and text), Wavefront OBJ and Collada, positions and faces only.

use std::collections::HashMap;

use nalgebra::Point3;

use super::MeshParts;
use super::collada;
use crate::input::{excerpt, plain};

/// The reason why a mesh with this name cannot be read, if any.
pub(super) fn unsupported(name: &str) -> Option<String> {
    let Some(ending) = ending(name) else {
        return Some("the name has no file extension; expected .stl, .obj or .dae".to_owned());
    };
    let known = ["stl", "obj", "dae"].contains(&ending.as_str());
    (!known).then(|| format!("extension `.{}` is not supported; convert it to .stl, .obj or .dae", excerpt(&ending)))
}

/// The extension of a file name, in lower case.
fn ending(name: &str) -> Option<String> {
    let file = name.rsplit(['/', '\\']).next()?;
    file.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase())
}

/// Reads a mesh in the format of its extension.
pub(super) fn read(name: &str, bytes: &[u8]) -> Result<MeshParts, String> {
    if let Some(reason) = unsupported(name) {
        return Err(reason);
    }
    let text = || String::from_utf8_lossy(bytes);
    let mesh = match ending(name).unwrap_or_default().as_str() {
        "stl" => stl(bytes),
        "dae" => collada::read(&text()),
        _ => obj(&text()),
    };
    let mesh = mesh.map_err(plain)?;
    if mesh.1.is_empty() {
        return Err("has no triangles".to_owned());
    }
    Ok(mesh)
}

/// Collects triangles, merging equal corners into one vertex.
#[derive(Default)]
struct Welder {
    seen: HashMap<[u64; 3], u32>,
    mesh: MeshParts,
}

impl Welder {
    fn corner(&mut self, [x, y, z]: [f64; 3]) -> Result<u32, String> {
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err(format!("vertex ({x}, {y}, {z}) is not finite"));
        }
        let next = u32::try_from(self.mesh.0.len()).map_err(|_| "too many vertices".to_owned())?;
        let index = *self.seen.entry([x, y, z].map(f64::to_bits)).or_insert(next);
        if index == next {
            self.mesh.0.push(Point3::new(x, y, z));
        }
        Ok(index)
    }

    fn triangle(&mut self, corners: [[f64; 3]; 3]) -> Result<(), String> {
        let [a, b, c] = corners;
        let triangle = [self.corner(a)?, self.corner(b)?, self.corner(c)?];
        self.mesh.1.push(triangle);
        Ok(())
    }
}

/// Binary if the length fits (84 bytes plus 50 per triangle), else text.
fn stl(bytes: &[u8]) -> Result<MeshParts, String> {
    let mut welder = Welder::default();
    if let Some(records) = binary_records(bytes) {
        for record in records.chunks_exact(50) {
            let number = |i: usize| {
                let at = 12 + 4 * i;
                f64::from(f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]))
            };
            welder.triangle([0, 3, 6].map(|i| [number(i), number(i + 1), number(i + 2)]))?;
        }
        return Ok(welder.mesh);
    }
    let text = std::str::from_utf8(bytes)
        .ok()
        .filter(|t| t.trim_start().starts_with("solid"))
        .ok_or("is neither a binary STL of the length stated in its header nor a text STL")?;
    let mut corners = Vec::with_capacity(3);
    for (line, words) in text.lines().enumerate().map(|(i, l)| (i + 1, l.split_whitespace())) {
        let mut words = words;
        match words.next() {
            Some("vertex") => corners.push(three(words, line)?),
            Some("endfacet") => {
                let &[a, b, c] = corners.as_slice() else {
                    return Err(format!("line {line}: a facet has {} vertices; expected 3", corners.len()));
                };
                welder.triangle([a, b, c])?;
                corners.clear();
            }
            _ => {}
        }
    }
    Ok(welder.mesh)
}

fn binary_records(bytes: &[u8]) -> Option<&[u8]> {
    let count = bytes.get(80..84).and_then(|c| c.try_into().ok()).map(u32::from_le_bytes)?;
    let records = &bytes[84..];
    (records.len() as u64 == 50 * u64::from(count)).then_some(records)
}

/// Faces with more than three corners become fans; negative indices count from the latest vertex.
fn obj(text: &str) -> Result<MeshParts, String> {
    let mut mesh = MeshParts::default();
    for (line, words) in text.lines().enumerate().map(|(i, l)| (i + 1, l.split_whitespace())) {
        let mut words = words;
        match words.next() {
            Some("v") => {
                let vertex = three(words, line)?;
                if vertex.iter().any(|c| !c.is_finite()) {
                    return Err(format!("line {line}: a vertex is not finite"));
                }
                mesh.0.push(Point3::from(vertex));
            }
            Some("f") => {
                let corners: Result<Vec<u32>, String> = words.map(|w| obj_index(w, mesh.0.len(), line)).collect();
                let corners = corners?;
                if corners.len() < 3 {
                    return Err(format!("line {line}: a face has {} corners; expected at least 3", corners.len()));
                }
                mesh.1.extend(corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]));
            }
            _ => {}
        }
    }
    Ok(mesh)
}

fn obj_index(word: &str, vertices: usize, line: usize) -> Result<u32, String> {
    let index: Option<i64> = word.split('/').next().and_then(|i| i.parse().ok());
    let index = match index {
        Some(i) if i < 0 => i.checked_add_unsigned(vertices as u64),
        Some(i) => i.checked_sub(1),
        None => None,
    };
    index.filter(|&i| i >= 0 && (i as u64) < vertices as u64).and_then(|i| u32::try_from(i).ok()).ok_or_else(|| {
        // a file of any kind may be given as a mesh, so only numbers are quoted
        let corner = index.map_or_else(|| "a corner".to_owned(), |index| format!("corner `{}`", index + 1));
        format!("line {line}: {corner} refers to no vertex above it (there are {vertices})")
    })
}

fn three<'a>(words: impl Iterator<Item = &'a str>, line: usize) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = words.take(3).filter_map(|w| w.parse().ok()).collect();
    numbers.try_into().map_err(|_| format!("line {line}: expected 3 numbers"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|c| c.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn the_same_triangles_are_read_from_binary_stl_text_stl_and_obj() {
        let (a, b, c, d) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]);
        let stl_bytes = binary(&[[a, b, c], [a, c, d]]);
        let text = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 .5\nendloop\nendfacet\n\
            facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 .5\nvertex 0 1 .5\nendloop\nendfacet\nendsolid s\n";
        let obj = "# a quad\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nvn 0 0 1\nv 0 1 0.5\nf 1/1/1 2//1 3 -1\n";
        let expected = read("m.STL", &stl_bytes).unwrap();
        assert_eq!(expected.1, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(read("m.stl", text.as_bytes()).unwrap(), expected);
        assert_eq!(read("m.obj", obj.as_bytes()).unwrap(), expected);
    }

    #[test]
    fn errors_of_invalid_meshes_are_specific() {
        let message = |name: &str, bytes: &[u8]| read(name, bytes).unwrap_err();
        assert!(message("m.glb", b"").contains("convert it to .stl, .obj or .dae"));
        assert!(message("m.dae", b"").contains("not well-formed XML"));
        assert!(message("m.stl", b"").contains("neither a binary STL"));
        assert!(message("m.stl", b"solid empty\nendsolid").contains("no triangles"));
        assert!(message("m.stl", b"solid s\nvertex 1 2\n").contains("line 2: expected 3 numbers"));
        assert!(message("m.stl", &binary(&[[[f32::NAN, 0.0, 0.0], [0.0; 3], [1.0; 3]]])).contains("not finite"));
        assert!(message("m.obj", b"v 0 0 0\nf 1 1 2\n").contains("line 2: corner `2` refers to no vertex"));
        assert!(message("m.obj", b"v 0 0 0\nf 1 1\n").contains("a face has 2 corners"));
        // A header claiming four billion triangles must not be trusted.
        let mut huge = vec![0; 80];
        huge.extend(u32::MAX.to_le_bytes());
        assert!(message("m.stl", &huge).contains("neither a binary STL"));
    }
}
