//! A checked mesh with weights, as read from files.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::Point3;

use crate::input::{excerpt, plain};

/// Greatest number of vertices of a skin; the cost of deforming and drawing grows with it.
pub(super) const MOST_VERTICES: usize = 500_000;
pub(super) const MOST_TRIANGLES: usize = 1_000_000;

/// Greatest coordinate, metres.
const FARTHEST: f64 = 100.0;

/// Greatest deviation from 1 of a vertex's sum of weights, which are then normalised. Files are rounded to three or
/// four decimals.
pub(super) const SUM_TOLERANCE: f64 = 0.02;

/// A mesh in the pose in which it was modelled: metres, X forward, Y left, Z up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SkinMesh {
    /// Its name.
    pub name: String,
    /// Vertices.
    pub vertices: Vec<Point3<f64>>,
    /// Indices into the vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Vertices and their weights, by name of a body segment (or link). `None`: weights are computed by distance.
    pub weights: Option<BTreeMap<String, Vec<(u32, f64)>>>,
    /// Positions of the body's landmarks in the mesh, by name ([`crate::body::Landmark::name`]), metres.
    pub landmarks: BTreeMap<String, Point3<f64>>,
    /// The joints of landmarks in its file, as `joint_map` of a scenario takes them; empty if the file has no joints.
    pub joint_map: BTreeMap<String, String>,
    /// Notes on assumptions and corrections.
    pub notes: Vec<String>,
}

/// Why a skin cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SkinError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", plain(path.display()))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// The file's content is not a valid skin.
    #[error("{}: {}", plain(file), plain(detail))]
    Malformed {
        /// The file.
        file: String,
        /// The problem, and what was expected.
        detail: String,
    },
    /// There is no built-in skin of this name, the skin belongs to another skeleton, or the body has no solids from
    /// which distances could be measured.
    #[error("{0}")]
    Unsuited(String),
    /// The skin's landmarks do not determine the body's pose.
    #[error("skin `{}`: {}", excerpt(skin), plain(detail))]
    Landmarks {
        /// The skin.
        skin: String,
        /// The problem.
        detail: String,
    },
}

impl SkinMesh {
    /// Checks sizes, indices, numbers and weights; weights that sum to nearly 1 are normalised. `file` names it in
    /// messages.
    pub(super) fn checked(mut self, file: &str) -> Result<Self, SkinError> {
        let malformed = |detail: String| SkinError::Malformed { file: file.to_owned(), detail };
        for (found, most, what) in
            [(self.vertices.len(), MOST_VERTICES, "vertices"), (self.triangles.len(), MOST_TRIANGLES, "triangles")]
        {
            if found > most {
                return Err(malformed(format!("{found} {what}; expected at most {most}: decimate the mesh")));
            }
        }
        if self.triangles.is_empty() {
            return Err(malformed("the mesh has no triangles".to_owned()));
        }
        let places = self.vertices.iter().chain(self.landmarks.values());
        if let Some(far) = places.flat_map(|p| p.iter()).find(|c| c.is_nan() || c.abs() > FARTHEST) {
            return Err(malformed(format!("a coordinate is {far} m; expected a body within {FARTHEST} m, in metres")));
        }
        let count = self.vertices.len();
        if let Some(triangle) = self.triangles.iter().find(|t| t.iter().any(|corner| *corner as usize >= count)) {
            let last = count.saturating_sub(1);
            return Err(malformed(format!("a triangle has vertices {triangle:?}; expected 0 to {last}")));
        }
        if let Some(weights) = &mut self.weights {
            normalise(weights, count).map_err(malformed)?;
        }
        Ok(self)
    }
}

/// Checks weights and normalises those of every vertex.
fn normalise(weights: &mut BTreeMap<String, Vec<(u32, f64)>>, vertices: usize) -> Result<(), String> {
    let mut sums = vec![0.0; vertices];
    for (segment, pairs) in weights.iter() {
        for (vertex, weight) in pairs {
            let sum = sums.get_mut(*vertex as usize).ok_or_else(|| {
                format!("`{}`: weight of vertex {vertex}, but the mesh has {vertices}, from 0", excerpt(segment))
            })?;
            if !(*weight >= 0.0 && *weight <= 1.0 + SUM_TOLERANCE) {
                return Err(format!("`{}`: vertex {vertex} has weight {weight}; expected 0 to 1", excerpt(segment)));
            }
            *sum += weight;
        }
    }
    if let Some(bare) = sums.iter().position(|sum| *sum == 0.0) {
        let bares = sums.iter().filter(|sum| **sum == 0.0).count();
        return Err(format!(
            "vertex {bare}, from 0, has no weight ({bares} of {vertices} have none); give every vertex a weight"
        ));
    }
    if let Some(off) = sums.iter().position(|sum| (sum - 1.0).abs() > SUM_TOLERANCE) {
        return Err(format!("the weights of vertex {off}, from 0, sum to {:.4}; expected 1", sums[off]));
    }
    for (vertex, weight) in weights.values_mut().flatten() {
        *weight /= sums[*vertex as usize];
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(weights: &[(&str, &[(u32, f64)])]) -> SkinMesh {
        SkinMesh {
            name: "one".into(),
            vertices: vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            weights: Some(weights.iter().map(|(name, pairs)| ((*name).to_owned(), pairs.to_vec())).collect()),
            ..SkinMesh::default()
        }
    }

    fn message(mesh: SkinMesh) -> String {
        mesh.checked("m.obj").unwrap_err().to_string()
    }

    #[test]
    fn weights_are_normalised_and_invalid_ones_are_refused_with_their_vertex() {
        let near = triangle(&[("a", &[(0, 0.5), (1, 1.0), (2, 0.3)]), ("b", &[(0, 0.499), (2, 0.701)])]);
        let weights = near.checked("m").unwrap().weights.unwrap();
        assert!((weights["a"][0].1 + weights["b"][0].1 - 1.0).abs() < 1e-15);
        let half = triangle(&[("a", &[(0, 0.5), (1, 1.0), (2, 1.0)])]);
        assert_eq!(message(half), "m.obj: the weights of vertex 0, from 0, sum to 0.5000; expected 1");
        let bare = triangle(&[("a", &[(0, 1.0), (2, 1.0)])]);
        assert!(message(bare).contains("vertex 1, from 0, has no weight (1 of 3 have none)"));
        let beyond = triangle(&[("a", &[(7, 1.0)])]);
        assert!(message(beyond).contains("weight of vertex 7, but the mesh has 3"));
        for wrong in [f64::NAN, -0.1, f64::INFINITY, 2.0] {
            assert!(message(triangle(&[("a", &[(0, wrong), (1, 1.0), (2, 1.0)])])).contains("expected 0 to 1"));
        }
    }

    #[test]
    fn meshes_that_are_not_finite_not_indexed_or_too_large_are_refused() {
        let whole = || triangle(&[("a", &[(0, 1.0), (1, 1.0), (2, 1.0)])]);
        let mut nan = whole();
        nan.vertices[1].y = f64::NAN;
        assert!(message(nan).contains("a coordinate is NaN m"));
        let mut astray = whole();
        astray.triangles.push([0, 1, 9]);
        assert!(message(astray).contains("a triangle has vertices [0, 1, 9]; expected 0 to 2"));
        let mut huge = whole();
        huge.triangles = vec![[0, 1, 2]; MOST_TRIANGLES + 1];
        assert!(message(huge).contains("1000001 triangles; expected at most 1000000: decimate the mesh"));
        let mut empty = whole();
        empty.triangles.clear();
        assert!(message(empty).contains("no triangles"));
    }
}
