//! `inspect SET --out set.html`: a set on the page of runs.

use std::path::Path;

use super::facts::grouped;
use super::set::{SetSides, SetSummary};
use crate::common::ExperimentError;
use crate::measure::measuring::Painters;
use crate::measure::playback::plan_of;
use skiagraph_core::body::LANDMARKS;
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_report::{
    FactGroup, KeypointMark, PackedView, Playback, PlaybackBudget, SetKeypointMarks, SetPage, describe_bodies,
};
use skiagraph_set::{BlindSet, KeypointSource, TruthSet};

/// The page of a set in `directory`; `small` for a page within another.
pub(super) fn html(
    directory: &Path,
    sides: &SetSides,
    summary: &SetSummary,
    small: bool,
) -> Result<String, ExperimentError> {
    let SetSides { blind, truth } = sides;
    let truth = truth.as_ref();
    let cameras = blind.rig.cameras.len();
    let budget = if small { PlaybackBudget::CELL } else { PlaybackBudget::PAGE };
    let plan = plan_of(blind.frame_count, cameras, budget, |frame| Ok((blind.observation(frame)?.silhouettes, None)))?;
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
    let keypoints = keypoints(directory, sides, &kept)?;
    let mut facts = grouped(summary.heading(), summary.facts(), &[]);
    facts.push(cameras_in_words(rig, summary));
    let page = SetPage {
        title: &blind.name,
        pills: &pills(summary),
        rig,
        frames_per_second: blind.frames_per_second,
        playback: &playback,
        has_estimate: false,
        keypoints: keypoints.as_ref(),
        facts: &facts,
    };
    Ok(page.html()?)
}

/// The cameras of a frame if any camera moves: the true ones if the truth is known.
fn moved(blind: &BlindSet, truth: Option<&TruthSet>, frame: usize) -> Option<CameraRig> {
    blind.moments.as_ref()?;
    let frame_s = frame as f64 / blind.frames_per_second;
    Some(truth.map_or_else(|| blind.rig_at(frame).into_owned(), |truth| truth.rig.rig_at(frame_s)))
}

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

/// Size, field of view, place, lens and motion of every camera.
fn cameras_in_words(rig: &CameraRig, summary: &SetSummary) -> FactGroup {
    let angle = |pixels: u32, focal: f64| 2.0 * libm::atan2(0.5 * f64::from(pixels), focal).to_degrees();
    let words = |camera: &Camera, filming: Option<&String>| {
        let (pinhole, eye) = (&camera.pinhole, camera.centre());
        let [across, down] = [angle(pinhole.width, pinhole.focal[0]), angle(pinhole.height, pinhole.focal[1])];
        let lens = if camera.distortion.is_none() { "no distortion" } else { "with distortion" };
        let filming = filming.map_or("static, every frame", String::as_str);
        format!(
            "{} x {} px, field of view {across:.0}° x {down:.0}°, at ({:.2}, {:.2}, {:.2}) m, {lens}, {filming}",
            pinhole.width, pinhole.height, eye.x, eye.y, eye.z
        )
    };
    let cameras = rig.cameras.iter().zip(&summary.cameras);
    let facts = cameras.map(|(camera, about)| (camera.name.clone(), words(camera, about.filming.as_ref())));
    FactGroup { title: "Cameras".to_owned(), facts: facts.collect() }
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
