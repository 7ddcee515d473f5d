//! Size limits of a URDF, checked before memory is allocated for it.

use crate::body::bounds::{MOST_SOLIDS, MOST_TRIANGLES};

/// Greatest number of attributes of an element; elements of a URDF have at most eight, except namespaces on `<robot>`.
const MOST_ATTRIBUTES: usize = 64;
/// Greatest number of elements, comments and texts in a URDF.
pub(super) const MOST_NODES: u32 = 200_000;
/// Greatest number of elements, comments and texts in a Collada mesh, where every polygon can be an element.
pub(super) const MOST_MESH_NODES: u32 = 1_000_000;
pub(super) const LONGEST_NAME: usize = 200;

/// Parses XML of at most `most_nodes` elements, comments and texts, without document type definitions (and therefore
/// without custom entities).
pub(super) fn parse_xml(text: &str, most_nodes: u32) -> Result<roxmltree::Document<'_>, (u32, String)> {
    check_attributes(text)?;
    let options = roxmltree::ParsingOptions { nodes_limit: most_nodes, ..Default::default() };
    roxmltree::Document::parse_with_options(text, options).map_err(|error| match error {
        roxmltree::Error::NodesLimitReached => (1, format!("more than {most_nodes} elements and texts")),
        other => (other.pos().row, other.to_string()),
    })
}

/// Returns the line and the problem of the first element with too many attributes. Counts `=` inside tags before
/// parsing, because the XML reader compares all pairs of attributes.
pub(super) fn check_attributes(text: &str) -> Result<(), (u32, String)> {
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(open) = text[at..].find('<').map(|found| at + found) {
        let closing = [("<!--", "-->"), ("<![CDATA[", "]]>")].iter().find(|(begin, _)| text[open..].starts_with(begin));
        if let Some((_, end)) = closing {
            let Some(length) = text[open..].find(end) else { return Ok(()) };
            at = open + length + end.len();
            continue;
        }
        let (mut attributes, mut quote) = (0, None);
        at = open + 1;
        while at < bytes.len() {
            match (bytes[at], quote) {
                (byte, Some(begun)) if byte == begun => quote = None,
                (b'"' | b'\'', None) => quote = Some(bytes[at]),
                (b'=', None) => attributes += 1,
                (b'>' | b'<', None) => break,
                _ => {}
            }
            at += 1;
        }
        if attributes > MOST_ATTRIBUTES {
            let line = text[..open].matches('\n').count() as u32 + 1;
            return Err((line, format!("an element has {attributes} attributes; expected at most {MOST_ATTRIBUTES}")));
        }
    }
    Ok(())
}

/// The remaining geometry allowance of a robot.
pub(super) struct Allowance {
    solids: usize,
    triangles: usize,
}

impl Default for Allowance {
    fn default() -> Self {
        Self { solids: MOST_SOLIDS, triangles: MOST_TRIANGLES }
    }
}

impl Allowance {
    /// Counts one more solid, or returns an error.
    pub(super) fn take_solid(&mut self) -> Result<(), String> {
        take(&mut self.solids, 1, || format!("more than {MOST_SOLIDS} solids on all links together"))
    }

    /// Counts one more mesh, or returns an error.
    pub(super) fn take_mesh(&mut self, vertices: usize, triangles: usize) -> Result<(), String> {
        take(&mut self.triangles, vertices.max(triangles), || {
            format!(
                "with it the meshes have more than {MOST_TRIANGLES} triangles or vertices in total (a mesh counts every \
                time it is used); simplify the meshes"
            )
        })
    }
}

fn take(left: &mut usize, wanted: usize, refused: impl FnOnce() -> String) -> Result<(), String> {
    *left = left.checked_sub(wanted).ok_or_else(refused)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_counted_by_element_and_not_in_comments_or_values() {
        let tag = |count: usize| format!("<a {}/>", "b=\"=<>'\" ".repeat(count));
        assert_eq!(check_attributes(&tag(64).repeat(3)), Ok(()));
        assert_eq!(check_attributes(&format!("<!-- {} don't -->{}", "=".repeat(1000), tag(3))), Ok(()));
        let (line, problem) = check_attributes(&format!("<r>\n{}\n{}", tag(2), tag(65))).unwrap_err();
        assert_eq!((line, problem.as_str()), (3, "an element has 65 attributes; expected at most 64"));
    }
}
