//! The summary of a skin, and its fit on the robot `actor`.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::{ClipSummary, INSPECT_SCHEMA};
use crate::common::ExperimentError;
use skiagraph_core::body::{Humanoid, SHIPPED_SKINS, SkinMesh, read_skin, shipped, shipped_skin};
use skiagraph_core::input::{self, limits};
use skiagraph_truth::retarget::with_skin;

const BODY: &str = "actor";

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SkinSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `skin`.
    pub what: &'static str,
    pub name: String,
    /// Its file or built-in name.
    pub from: String,
    pub vertices: usize,
    pub triangles: usize,
    /// Edges that do not belong to two triangles: 0 for a closed surface.
    pub open_edges: usize,
    /// Height from the lowest to the highest vertex, as modelled.
    pub height_m: f64,
    pub weights: String,
    pub segments: Vec<String>,
    pub landmarks: Vec<String>,
    /// Landmarks and their joints, as `joint_map` of `[actor]` takes them; empty for a file without joints.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    pub body: String,
    /// Depth of the skin's lowest point below that of the robot's solids, standing.
    pub soles_below_solids_mm: f64,
    /// Volume inside the skin, standing, litres; absent for a skin without volume.
    pub litres: Option<f64>,
    /// Offset of the centre of the skin's volume from the centre of mass of the robot's links, standing; X forward, Y
    /// left, Z up.
    pub centre_from_links_mm: Option<[f64; 3]>,
    /// The animation in the same file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Box<ClipSummary>>,
    /// Notes about assumptions and repairs.
    pub notes: Vec<String>,
}

/// Whether a `.toml` file is a skin rather than a scenario, by its schema.
pub fn is_skin_file(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let text = || input::read(path, limits::SETTINGS).ok();
    is_toml && text().is_some_and(|text| String::from_utf8_lossy(&text).contains("skiagraph.skin/"))
}

pub(super) fn read(name: &str, path: &Path) -> Result<(SkinSummary, Humanoid), ExperimentError> {
    let known = SHIPPED_SKINS.iter().find(|known| path == Path::new(known) && !path.exists());
    let mesh = match known {
        Some(known) => shipped_skin(known),
        None => read_skin(path, &Default::default()),
    }?;
    let bare = shipped(BODY)?;
    let body = with_skin(&bare, &mesh)?;
    Ok((SkinSummary::new(name, &mesh, &bare, &body), body))
}

impl SkinSummary {
    fn new(from: &str, mesh: &SkinMesh, bare: &Humanoid, body: &Humanoid) -> Self {
        let heights = || mesh.vertices.iter().map(|vertex| vertex.z);
        let lowest = |body: &Humanoid| {
            let links: Vec<usize> = (0..body.links.len()).collect();
            body.lowest_point(&body.link_frames(&body.zero_pose()), &links).map_or(0.0, |point| point.z)
        };
        let frames = body.link_frames(&body.zero_pose());
        let held = body.skin.as_ref().and_then(|skin| skin.volume(&frames));
        let centre = held.zip(body.centre_of_mass(&frames)).map(|((_, centre), own)| centre - own);
        let segments = mesh.weights.as_ref().map(|weights| weights.keys().cloned().collect::<Vec<_>>());
        Self {
            schema: INSPECT_SCHEMA,
            what: "skin",
            name: mesh.name.clone(),
            from: from.to_owned(),
            vertices: mesh.vertices.len(),
            triangles: mesh.triangles.len(),
            open_edges: open_edges(mesh),
            height_m: heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min),
            weights: match &segments {
                Some(segments) => format!("from its file, for {} segments", segments.len()),
                None => "by distance to the robot's solids".to_owned(),
            },
            segments: segments.unwrap_or_default(),
            landmarks: mesh.landmarks.keys().cloned().collect(),
            joint_map: mesh.joint_map.clone(),
            body: BODY.to_owned(),
            soles_below_solids_mm: 1000.0 * (lowest(bare) - lowest(body)),
            litres: held.map(|(volume, _)| 1000.0 * volume),
            centre_from_links_mm: centre.map(|centre| (1000.0 * centre).into()),
            motion: None,
            notes: body.notes.iter().skip(bare.notes.len()).chain(&mesh.notes).cloned().collect(),
        }
    }
}

fn open_edges(mesh: &SkinMesh) -> usize {
    let mut edges = BTreeMap::new();
    for triangle in &mesh.triangles {
        for side in 0..3 {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0_usize) += 1;
        }
    }
    edges.values().filter(|count| **count != 2).count()
}
