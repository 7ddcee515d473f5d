//! The page of a set: `inspect SET --out set.html`.

use std::path::Path;

use nalgebra::Point3;

use super::facts::grouped;
use super::layer_pictures::{self, ColourRanges};
use super::set::{SetSides, SetSummary};
use crate::benchmark_set::{BlindSet, KeypointSource, LayerFiles, LayerValues, TruthSet};
use crate::body::LANDMARKS;
use crate::camera::CameraRig;
use crate::common::ExperimentError;
use crate::measure::measuring::Painters;
use crate::measure::playback::plan_of;
use crate::observation::FoundKeypoint;
use crate::parallel;
use crate::report::{
    KeypointMark, LayerPicture, PackedView, Playback, SetKeypointMarks, SetLayers, SetMap, SetPage, describe_bodies,
};

/// Greatest total size of all pictures of layers, bytes of PNG.
const LAYER_BUDGET: usize = 6_000_000;
/// Number of frames whose layers are sampled for size and ranges.
const LAYER_SAMPLES: usize = 3;

/// The page of a set in `directory`.
///
/// # Errors
/// [`ExperimentError`] if an image of the set cannot be read.
pub(super) fn html(directory: &Path, sides: &SetSides, summary: &SetSummary) -> Result<String, ExperimentError> {
    let SetSides { blind, truth } = sides;
    let truth = truth.as_ref();
    let cameras = blind.rig.cameras.len();
    let plan = plan_of(blind.frame_count, cameras, |frame| Ok((blind.observation(frame)?.silhouettes, None)))?;
    let kept: Vec<usize> = plan.kept().collect();
    let pack = |index: usize| -> Result<Vec<PackedView>, ExperimentError> {
        let observed = blind.observation(kept[index])?;
        Ok(observed.silhouettes.iter().map(|mask| plan.pack(mask, None)).collect())
    };
    let views = parallel::map(kept.len(), pack).into_iter().collect::<Result<Vec<_>, _>>()?;
    let rig = truth.map_or(&blind.rig, |truth| truth.rig.rig());
    let props = truth.map_or(&[][..], |truth| &truth.ground_truth.props);
    let no_markers = [None; LANDMARKS.len()];
    let markers = |frame: &usize| truth.map_or(no_markers, |truth| truth.ground_truth.frames[*frame].markers);
    let playback = Playback {
        seed: 0,
        plan,
        views,
        props: if blind.moments.is_some() { Vec::new() } else { Painters::new(blind).props(props) },
        moved: kept.iter().filter_map(|frame| moved(blind, truth, *frame)).collect(),
        truth: kept.iter().map(markers).collect(),
        estimate: vec![no_markers; kept.len()],
    };
    let root = |frame: &usize| -> Option<Point3<f64>> {
        let pose = match truth {
            Some(truth) => &truth.ground_truth.frames.get(*frame)?.pose,
            None => Some(&blind.start.pose).filter(|_| *frame == 0)?,
        };
        Some(pose.world_from_root.translation.vector.into())
    };
    let map = SetMap { roots: kept.iter().map(root).collect(), props: props.to_vec() };
    let films: Vec<String> = summary.cameras.iter().map(|camera| camera.filming.clone().unwrap_or_default()).collect();
    let layers = if summary.layers.is_empty() { None } else { layers(directory, blind, &kept)? };
    let keypoints = keypoints(directory, sides, &kept)?;
    let page = SetPage {
        title: &blind.name,
        pills: &pills(summary),
        rig,
        frames_per_second: blind.frames_per_second,
        playback: &playback,
        map: &map,
        layers: layers.as_ref(),
        keypoints: keypoints.as_ref(),
        films: &films,
        facts: &grouped(summary.heading(), summary.facts(), &[]),
    };
    Ok(page.html()?)
}

/// The cameras of a frame if any camera moves: the true ones if the truth is known.
fn moved(blind: &BlindSet, truth: Option<&TruthSet>, frame: usize) -> Option<CameraRig> {
    blind.moments.as_ref()?;
    let frame_s = frame as f64 / blind.frames_per_second;
    Some(truth.map_or_else(|| blind.rig_at(frame).into_owned(), |truth| truth.rig.rig_at(frame_s)))
}

/// The keypoints of the kept frames; `None` in a set without keypoints.
fn keypoints(directory: &Path, sides: &SetSides, kept: &[usize]) -> Result<Option<SetKeypointMarks>, ExperimentError> {
    let Some(found) = &sides.blind.keypoints else { return Ok(None) };
    let sources = sides.truth.as_ref().map(|_| found.sources(directory)).transpose()?;
    let (cameras, points) = (sides.blind.rig.cameras.len(), found.layout.keypoints().len());
    let mark = |index: usize| match sources.as_ref().and_then(|sources| sources.get(index)) {
        None | Some(KeypointSource::Visible) => 0,
        Some(KeypointSource::Hidden) => 1,
        Some(KeypointSource::Exchanged) => 2,
    };
    let of_frame = |frame: &usize| -> Vec<Vec<KeypointMark>> {
        let views = found.frame(*frame).views.into_iter().enumerate();
        let of_view = |(camera, view): (usize, Vec<Option<FoundKeypoint>>)| {
            let first = (frame * cameras + camera) * points;
            let indexed = view.into_iter().zip(first..);
            indexed.filter_map(|(point, index)| Some(KeypointMark::new(point?.pixel, mark(index)))).collect()
        };
        views.map(of_view).collect()
    };
    Ok(Some(SetKeypointMarks { views: kept.iter().map(of_frame).collect(), is_told: sources.is_some() }))
}

/// The layers of as many of the kept frames as fit the budget.
fn layers(directory: &Path, blind: &BlindSet, kept: &[usize]) -> Result<Option<SetLayers>, ExperimentError> {
    let files = LayerFiles::open(directory)?;
    let sizes: Vec<[u32; 2]> =
        blind.rig.cameras.iter().map(|camera| [camera.pinhole.width, camera.pinhole.height]).collect();
    let read = |frame: usize| -> Result<Vec<Option<Vec<LayerValues>>>, ExperimentError> {
        let cameras = sizes.iter().enumerate();
        cameras.map(|(camera, size)| Ok(files.read(camera, frame, *size)?)).collect()
    };
    let pictures = |views: &[Option<Vec<LayerValues>>], ranges: &ColourRanges| -> Vec<Vec<Option<LayerPicture>>> {
        let of_view = |(values, size): (&Option<Vec<LayerValues>>, &[u32; 2])| match values {
            Some(values) => values.iter().map(|layer| layer_pictures::picture(layer, *size, ranges)).collect(),
            None => vec![None; files.layers().len()],
        };
        views.iter().zip(&sizes).map(of_view).collect()
    };
    let samples = LAYER_SAMPLES.min(kept.len());
    let sample = |index: usize| kept[index * (kept.len() - 1) / (samples - 1).max(1)];
    let sampled = (0..samples).map(|index| read(sample(index))).collect::<Result<Vec<_>, _>>()?;
    let ranges = sampled.iter().flatten().flatten().flatten().fold(ColourRanges::NONE, |ranges, v| ranges.with(v));
    let mut bytes = 0;
    for picture in sampled.iter().flat_map(|views| pictures(views, &ranges)).flatten().flatten() {
        bytes += picture.png()?.len();
    }
    let all = bytes.div_ceil(samples.max(1)).saturating_mul(kept.len());
    let stride = all.div_ceil(LAYER_BUDGET).max(1);
    let shown: Vec<usize> = kept.iter().copied().step_by(stride).collect();
    let of_frame = |index: usize| read(shown[index]).map(|views| pictures(&views, &ranges));
    let pictures = parallel::map(shown.len(), of_frame).into_iter().collect::<Result<Vec<_>, _>>()?;
    let names = files.layers().iter().map(|layer| layer_pictures::name(*layer)).collect();
    let meanings = files.layers().iter().map(|layer| ranges.meaning(*layer)).collect();
    Ok(Some(SetLayers { names, meanings, stride, pictures }))
}

fn pills(summary: &SetSummary) -> Vec<String> {
    let seconds = summary.frames as f64 / summary.frames_per_second;
    let truth = if summary.motion.is_some() { "with truth" } else { "without truth" };
    let matched = summary.matched.filter(|matched| *matched).map(|matched| describe_bodies(matched).to_owned());
    let cameras = summary.cameras.len();
    [
        format!("{} frames at {} Hz, {seconds:.2} s", summary.frames, summary.frames_per_second),
        format!("{cameras} camera{}", if cameras == 1 { "" } else { "s" }),
        truth.to_owned(),
    ]
    .into_iter()
    .chain(matched)
    .collect()
}
