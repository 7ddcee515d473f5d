//! The page of a benchmark set: every camera's frames with the true skeleton, the layers, the rig from above, facts.

mod keypoints;
mod layers;
mod map;

use serde::Serialize;

use super::html::{in_page, render_page};
use super::overlay::Whose;
use super::playback::playback_data;
use super::plots::hex;
use super::{FactGroup, Playback, ReportError, cell};
use crate::camera::{Camera, CameraRig};

pub use keypoints::{KeypointMark, SetKeypointMarks};
pub use layers::{LayerPicture, SetLayers};
pub use map::SetMap;

const TEMPLATE: &str = include_str!("set_page.html");
const SCRIPT: &str = concat!(include_str!("set_page.js"), include_str!("../playback.js"));

/// The content of the page.
#[derive(Clone, Copy, Debug)]
pub struct SetPage<'a> {
    /// The set's name.
    pub title: &'a str,
    /// Short descriptions below the name.
    pub pills: &'a [String],
    /// The cameras; moving ones at their position in frame 0.
    pub rig: &'a CameraRig,
    /// Frames per second.
    pub frames_per_second: f64,
    /// The stored frames; estimates are left out.
    pub playback: &'a Playback,
    /// The rig from above.
    pub map: &'a SetMap,
    /// Truth images of some of the stored frames.
    pub layers: Option<&'a SetLayers>,
    /// The keypoints of a set that has some.
    pub keypoints: Option<&'a SetKeypointMarks>,
    /// Description of each camera's motion and timing.
    pub films: &'a [String],
    /// Facts of the set.
    pub facts: &'a [FactGroup],
}

#[derive(Serialize)]
struct SetOnPage<'a> {
    script: &'static str,
    title: &'a str,
    pills: &'a [String],
    sampling: String,
    has_truth: bool,
    moves: bool,
    truth: String,
    silhouette: String,
    /// Empty without props.
    props: String,
    playback: String,
    layers: Option<LayersOnPage<'a>>,
    keypoints: Option<KeypointsOnPage>,
    map: MapOnPage,
    cameras: Vec<SetCameraRow<'a>>,
    facts: &'a [FactGroup],
}

#[derive(Serialize)]
struct LayersOnPage<'a> {
    names: &'a [String],
    sampling: String,
    pictures: String,
}

#[derive(Serialize)]
struct KeypointsOnPage {
    views: String,
    is_told: bool,
}

#[derive(Serialize)]
struct MapOnPage {
    svg: String,
    square: String,
    moving: String,
}

#[derive(Serialize)]
struct SetCameraRow<'a> {
    name: &'a str,
    size: String,
    field: String,
    height: String,
    place: String,
    lens: &'static str,
    films: &'a str,
}

impl SetPage<'_> {
    /// The page: self-contained HTML with inline style, script and pictures.
    ///
    /// # Errors
    /// [`ReportError`] if the stored frames do not fit the cameras or a picture cannot be encoded.
    pub fn html(&self) -> Result<String, ReportError> {
        let has_truth = self.playback.truth.iter().flatten().any(Option::is_some);
        let moves = !self.playback.moved.is_empty();
        let plan = &self.playback.plan;
        let frames = match plan.stride {
            1 => "every frame".to_owned(),
            stride => format!("one frame in {stride} of {}", plan.frames),
        };
        let pixels = match plan.reduction {
            1 => String::new(),
            reduction => format!(", one pixel for {reduction} x {reduction} of the image"),
        };
        let keypoints = |marks: &SetKeypointMarks| -> Result<_, ReportError> {
            Ok(KeypointsOnPage { views: in_page(&marks.views)?, is_told: marks.is_told })
        };
        let films = self.films.iter().map(String::as_str).chain(std::iter::repeat(""));
        let page = SetOnPage {
            script: SCRIPT,
            title: self.title,
            pills: self.pills,
            sampling: format!(", {frames}{pixels}"),
            has_truth,
            moves,
            truth: hex(Whose::Truth.colour()),
            silhouette: hex(cell::BOTH),
            props: if self.playback.props.is_empty() { String::new() } else { hex(cell::PROP) },
            playback: in_page(&playback_data(self.playback, (self.rig, self.frames_per_second), None)?)?,
            layers: self.layers.map(|layers| self.layers_on_page(layers)).transpose()?,
            keypoints: self.keypoints.map(keypoints).transpose()?,
            map: MapOnPage {
                svg: self.map.svg(self.rig, self.playback),
                square: self.map.square_size(self.rig, self.playback),
                moving: in_page(&self.map.moving(self.rig, self.playback))?,
            },
            cameras: self.rig.cameras.iter().zip(films).map(|(camera, films)| camera_row(camera, films)).collect(),
            facts: self.facts,
        };
        render_page(TEMPLATE, &page)
    }

    fn layers_on_page<'a>(&self, layers: &'a SetLayers) -> Result<LayersOnPage<'a>, ReportError> {
        let frames = layers.pictures.len();
        let sampling = match layers.stride {
            1 => String::new(),
            _ => format!("Layers exist for {frames} frames; the latest one up to the slider's frame is shown."),
        };
        let data = layers.data(&self.playback.plan)?;
        Ok(LayersOnPage { names: &layers.names, sampling, pictures: in_page(&data)? })
    }
}

fn camera_row<'a>(camera: &'a Camera, films: &'a str) -> SetCameraRow<'a> {
    let (pinhole, eye) = (&camera.pinhole, camera.centre());
    let angle = |pixels: u32, focal: f64| 2.0 * libm::atan2(0.5 * f64::from(pixels), focal).to_degrees();
    let [across, down] = [angle(pinhole.width, pinhole.focal[0]), angle(pinhole.height, pinhole.focal[1])];
    SetCameraRow {
        name: &camera.name,
        size: format!("{} x {}", pinhole.width, pinhole.height),
        field: format!("{across:.0}° x {down:.0}°"),
        height: format!("{:.2}", eye.z),
        place: format!("{:.2}, {:.2}", eye.x, eye.y),
        lens: if camera.distortion.is_none() { "no distortion" } else { "with distortion" },
        films: if films.is_empty() { "static, every frame" } else { films },
    }
}

#[cfg(test)]
mod tests;
