//! `skiagraph inspect`: summarises a file or directory of any known kind.

mod body_picture;
mod clip;
mod contact_chart;
mod contacts;
mod edited;
mod facts;
mod model;
mod robot;
mod set;
mod set_page;
mod skin;

use std::path::Path;

use serde::Serialize;

use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination, Inputs};
use crate::common::ExperimentError;
use crate::prepare::{EMBEDDED_CLIPS, clip_file};
use crate::scenario::SolidsSource;
use crate::train::LearnedModel;
use skiagraph_core::body::{SHIPPED_ROBOTS, SHIPPED_SKINS, gltf_contents};
use skiagraph_core::input::{self, limits};
use skiagraph_truth::mocap::ReadOptions;

pub use clip::{ClipSummary, FitSummary};
pub use contacts::{ContactSummary, StanceSummary, WorstContact, inspect_contacts};
pub use edited::{EditedContact, EditedSummary, FastestAngle, SeamSummary, inspect_scenario};
pub use facts::Facts;
pub use model::{Against, GraphModelFacts, MeanAndMost, ModelSummary};
pub use robot::RobotSummary;
use set::SetSides;
pub use set::{CameraSummary, SetSummary};
pub use skin::{SkinSummary, is_skin_file};

const INSPECT_SCHEMA: &str = "skiagraph.inspect/1";

/// The summary of an inspected file or directory.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Inspected {
    Model(Box<ModelSummary>),
    Clip(ClipSummary),
    Robot(RobotSummary),
    Skin(SkinSummary),
    Set(Box<SetSummary>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InspectedKind {
    Model,
    Clip,
    Robot,
    Skin,
    Set,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InspectOptions<'a> {
    /// Length of a recording's unit, metres.
    pub metres_per_unit: Option<f64>,
    /// Whose motion is read from a recording of several subjects, or which of several animations.
    pub subject: Option<&'a str>,
    /// Another model of the same motions.
    pub against: Option<&'a Path>,
    pub solids: SolidsSource,
    /// Whether the page of a set is coarse, below 200 kB, for a page within another.
    pub small: bool,
}

/// Summarises `path`: a file, a set's directory, `embedded:NAME`, or the name of a built-in robot or skin. Pictures are
/// written to `page`; for a recording that cannot be retargeted there are none, with a note.
pub fn inspect(
    path: &Path,
    options: &InspectOptions<'_>,
    page: Option<Destination<'_>>,
) -> Result<Inspected, ExperimentError> {
    let InspectOptions { metres_per_unit, subject, against, solids, small } = *options;
    let kind = kind_of(path)?;
    let name = path.display().to_string();
    if kind != InspectedKind::Model && against.is_some() {
        let detail = format!("is only valid for models of skiagraph train, and {name} is not one");
        return Err(ExperimentError::Argument { argument: "--against", detail });
    }
    if kind != InspectedKind::Robot && solids != SolidsSource::default() {
        let detail = format!("is only valid for robots, and {name} is not one");
        return Err(ExperimentError::Argument { argument: "--solids", detail });
    }
    let is_animated = kind == InspectedKind::Skin
        && input::read(path, limits::MESH).is_ok_and(|bytes| gltf_contents(&bytes).animations > 0);
    for (argument, is_given) in [("--metres-per-unit", metres_per_unit.is_some()), ("--subject", subject.is_some())] {
        if is_given && kind != InspectedKind::Clip && !is_animated {
            let detail = format!("is only valid for recordings, and {name} is not one");
            return Err(ExperimentError::Argument { argument, detail });
        }
    }
    let reading = ReadOptions { metres_per_unit, subject: subject.map(str::to_owned), ..ReadOptions::default() };
    Ok(match kind {
        InspectedKind::Clip => {
            let place = body_picture::place_of(page, path)?;
            let clip = clip_file::read_whole(path, &reading)?;
            let (mut summary, retargeted) = ClipSummary::with_motion(&clip)?;
            match retargeted {
                Ok(retargeted) => body_picture::put(place, || body_picture::of_clip(&summary, &retargeted))?,
                Err(_) if place.is_some() => {
                    summary.notes.push("there is no picture, because it cannot be retargeted".to_owned())
                }
                Err(_) => {}
            }
            Inspected::Clip(summary)
        }
        InspectedKind::Robot => {
            let place = body_picture::place_of(page, path)?;
            let body = robot::read(&name, path, solids)?;
            let summary = RobotSummary::new(&name, &body);
            body_picture::put(place, || body_picture::of_body(&summary.name, &body))?;
            Inspected::Robot(summary)
        }
        InspectedKind::Skin => {
            let place = body_picture::place_of(page, path)?;
            let (mut summary, body) = skin::read(&name, path)?;
            if is_animated {
                match clip_file::read_whole(path, &reading) {
                    Ok(clip) => summary.motion = Some(Box::new(ClipSummary::with_motion(&clip)?.0)),
                    Err(error) => summary.notes.push(format!("its animation is not read: {error}")),
                }
            }
            body_picture::put(place, || body_picture::of_body(&summary.name, &body))?;
            Inspected::Skin(summary)
        }
        InspectedKind::Set => {
            let place = page.map(|to| page_place(to, path)).transpose()?;
            let sides = SetSides::read(path)?;
            let summary = SetSummary::new(path, &sides)?;
            if let Some(place) = place {
                place.put(set_page::html(path, &sides, &summary, small)?.as_bytes())?;
            }
            Inspected::Set(Box::new(summary))
        }
        InspectedKind::Model => {
            let model = LearnedModel::read(path)?;
            let other = against.map(|other| model::read_other(other, &model)).transpose()?;
            if let Some(to) = page {
                expect_kind(to.path, "svg", "an .svg file for a model")?;
                let picture = place_for(to, [Some(path), against])?;
                picture.put(model::picture(&model, against.zip(other.as_ref()))?.as_bytes())?;
            }
            Inspected::Model(Box::new(ModelSummary::new(&model, other.as_ref())))
        }
    })
}

/// Prepares the file of a picture; it must not replace a file that was `read`.
fn place_for<'a>(
    to: Destination<'_>,
    read: impl IntoIterator<Item = Option<&'a Path>>,
) -> Result<Artefact, ArtefactError> {
    Inputs::new(read.into_iter().flatten().map(Path::to_owned)).keep_from(to.path)?;
    Artefact::begin(to, ArtefactKind::File)
}

/// Refuses a picture whose file does not end in this kind; `expected` describes it.
fn expect_kind(to: &Path, kind: &str, expected: &str) -> Result<(), ExperimentError> {
    if to.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(kind)) {
        return Ok(());
    }
    let detail = format!("expected the name of {expected}, found {}", to.display());
    Err(ExperimentError::Argument { argument: "--out", detail })
}

/// Prepares the page of a set, which must not be inside the set.
fn page_place(to: Destination<'_>, set: &Path) -> Result<Artefact, ExperimentError> {
    expect_kind(to.path, "html", "an .html file for a set")?;
    Ok(place_for(to, [Some(set)])?)
}

fn kind_of(path: &Path) -> Result<InspectedKind, ExperimentError> {
    if path.as_os_str().as_encoded_bytes().starts_with(b"embedded:") {
        return Ok(InspectedKind::Clip);
    }
    if path.is_dir() {
        return Ok(InspectedKind::Set);
    }
    if SHIPPED_ROBOTS.iter().any(|(known, _)| path == Path::new(known)) && !path.exists() {
        return Ok(InspectedKind::Robot);
    }
    if SHIPPED_SKINS.iter().any(|known| path == Path::new(known)) && !path.exists() {
        return Ok(InspectedKind::Skin);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("bvh" | "amc" | "asf" | "c3d" | "trc" | "txt" | "json" | "npz" | "vrma" | "fbx") => {
            return Ok(InspectedKind::Clip);
        }
        Some("urdf" | "xml") => return Ok(InspectedKind::Robot),
        Some("model") => return Ok(InspectedKind::Model),
        Some("toml" | "vrm") => return Ok(InspectedKind::Skin),
        Some("glb" | "gltf") => {
            let bytes = input::read(path, limits::MESH);
            let is_clip =
                bytes.map(|bytes| gltf_contents(&bytes)).is_ok_and(|has| has.animations > 0 && has.skins == 0);
            return Ok(if is_clip { InspectedKind::Clip } else { InspectedKind::Skin });
        }
        _ => {}
    }
    // models may have any name; all of them are archives
    if starts_with(path, b"PK")? {
        return Ok(InspectedKind::Model);
    }
    let clips = EMBEDDED_CLIPS.map(|(name, _)| format!("embedded:{name}")).join(", ");
    let robots = SHIPPED_ROBOTS.map(|(name, _)| name).join(", ");
    let skins = SHIPPED_SKINS.join(", ");
    let detail = format!(
        "expected a model of skiagraph train, a recording (.bvh, .amc, .c3d, .trc, DeepMimic .txt or .json, AMASS .npz, an animation in .glb, .gltf, .vrm or .vrma, {clips}), a robot (.urdf, {robots}), a skin (.glb, \
         .gltf, .vrm, .toml, {skins}), a scenario (.toml) or a benchmark set's directory"
    );
    Err(ExperimentError::Malformed { path: path.to_owned(), detail })
}

fn starts_with(path: &Path, wanted: &[u8; 2]) -> Result<bool, ExperimentError> {
    use std::io::Read;
    let mut found = Vec::new();
    let read = input::open(path, limits::ARRAYS).and_then(|file| file.take(2).read_to_end(&mut found));
    read.map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })?;
    Ok(found == wanted)
}
