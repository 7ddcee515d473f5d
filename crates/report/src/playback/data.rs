//! The data for the page's script.

use nalgebra::Point3;
use serde::Serialize;

use super::Playback;
use crate::overlay::{MARKER_BONES, Whose};
use crate::plots::hex;
use crate::{ReportError, base64, cell};
use skiagraph_core::body::Markers;
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_eval::{mean, quantile};

/// Positions in images are stored in quarters of a pixel.
const PARTS_OF_A_PIXEL: f64 = 4.0;
const NOWHERE: i16 = i16::MIN;

/// Everything that the script draws, as JSON in the page.
#[derive(Serialize)]
pub(crate) struct PlaybackData {
    seed: u64,
    /// Whether an estimate is shown: frames have errors, views have overlaps.
    scored: bool,
    fps: f64,
    /// Image pixels per stored pixel.
    reduction: u32,
    stride: usize,
    /// Number of frames of the run, stored or not.
    frames: usize,
    cameras: Vec<CameraData>,
    /// Pairs of markers.
    bones: Vec<[usize; 2]>,
    colours: Colours,
    /// `[frame]`: mean marker error, mm, in tenths.
    error: Vec<Option<f64>>,
    /// `[frame][camera]`: per cent.
    overlap: Vec<Vec<Option<f64>>>,
    /// `[frame][camera]`: mean 2-D error of the markers, pixels.
    pixels: Vec<Vec<Option<f64>>>,
    /// `PackedView`s by frame and camera, in Base64.
    views: String,
    /// Views of props, one per camera; empty without props.
    props: String,
    /// `[frame][camera][truth, estimate][marker][x, y]` in quarters of a pixel, 16 bits, in Base64.
    points: String,
}

#[derive(Serialize)]
struct CameraData {
    name: String,
    width: u32,
    height: u32,
    /// Width of the part of the image that contains the body, pixels.
    span: f64,
}

#[derive(Serialize)]
struct Colours {
    ground: String,
    labels: [[u8; 3]; 4],
    prop: [u8; 3],
    truth: String,
    estimate: String,
}

/// The data for the script; `errors` are the HumanEva errors of the seed's frames, if there is an estimate.
pub(crate) fn playback_data(
    playback: &Playback,
    (rig, frames_per_second): (&CameraRig, f64),
    errors: Option<&[Option<f64>]>,
) -> Result<PlaybackData, ReportError> {
    let cameras = &rig.cameras;
    if let Some((views, frame)) =
        playback.views.iter().zip(playback.plan.kept()).find(|(v, _)| v.len() != cameras.len())
    {
        return Err(ReportError::Views { frame, found: views.len(), cameras: cameras.len() });
    }
    let (mut points, mut pixels) = (Vec::new(), Vec::new());
    for (index, (truth, estimate)) in playback.truth.iter().zip(&playback.estimate).enumerate() {
        let cameras = playback.moved.get(index).map_or(cameras, |rig| &rig.cameras);
        for markers in cameras.iter().flat_map(|camera| [truth, estimate].map(|m| projected(camera, m))) {
            points.extend(markers.iter().flat_map(|place| place.map_or([NOWHERE; 2], |[x, y]| [packed(x), packed(y)])));
        }
        pixels.push(cameras.iter().map(|camera| error_px(camera, truth, estimate)).collect());
    }
    let round = |value: f64, parts: f64| (value * parts).round() / parts;
    let overlaps = |views: &Vec<super::PackedView>| {
        views.iter().map(|view| view.overlap.map(|overlap| round(100.0 * overlap, 10.0))).collect()
    };
    let all: Vec<u8> = playback.views.iter().flatten().flat_map(|view| view.bytes.iter().copied()).collect();
    let props: Vec<u8> = playback.props.iter().flat_map(|mask| playback.plan.pack(mask, None).bytes).collect();
    Ok(PlaybackData {
        seed: playback.seed,
        scored: errors.is_some(),
        fps: frames_per_second,
        reduction: playback.plan.reduction,
        stride: playback.plan.stride,
        frames: playback.plan.frames,
        cameras: cameras.iter().enumerate().map(|(index, camera)| camera_data(playback, index, camera)).collect(),
        bones: MARKER_BONES.map(|bone| bone.map(|landmark| landmark as usize)).to_vec(),
        colours: Colours {
            ground: hex(cell::GROUND),
            labels: [cell::GROUND, cell::ONLY_OBSERVED, cell::ONLY_ESTIMATED, cell::BOTH],
            prop: cell::PROP,
            truth: hex(Whose::Truth.colour()),
            estimate: hex(Whose::Estimate.colour()),
        },
        error: playback
            .plan
            .kept()
            .map(|f| errors.and_then(|errors| errors.get(f).copied().flatten()).map(|e| round(e, 10.0)))
            .collect(),
        overlap: playback.views.iter().map(overlaps).collect(),
        pixels,
        views: base64::encode(&all),
        props: base64::encode(&props),
        points: base64::encode(&points.iter().flat_map(|place: &i16| place.to_le_bytes()).collect::<Vec<u8>>()),
    })
}

/// A camera, with the width of the part of its image that contains the body in 95 % of the frames.
fn camera_data(playback: &Playback, index: usize, camera: &Camera) -> CameraData {
    let bounds = playback.views.iter().filter_map(|views| views.get(index)).map(|view| view.bounds);
    let mut spans: Vec<f64> = bounds.filter(|bounds| !bounds.is_empty()).map(|bounds| cell::span(&bounds)).collect();
    spans.sort_by(f64::total_cmp);
    let (width, height) = (camera.pinhole.width, camera.pinhole.height);
    let span = quantile(&spans, 0.95).unwrap_or(f64::from(width)).max(8.0);
    CameraData { name: camera.name.clone(), width, height, span }
}

fn projected(camera: &Camera, markers: &Markers) -> Vec<Option<[f64; 2]>> {
    let limit = f64::from(i16::MAX - 1) / PARTS_OF_A_PIXEL;
    let place = |point: Point3<f64>| {
        let pixel = camera.project(&point)?;
        (pixel.x.abs() < limit && pixel.y.abs() < limit).then_some([pixel.x, pixel.y])
    };
    markers.iter().map(|marker| place((*marker)?)).collect()
}

fn packed(pixels: f64) -> i16 {
    (PARTS_OF_A_PIXEL * pixels).round() as i16
}

/// Mean 2-D error of the markers whose true position is inside the image, rounded to 0.1 px.
fn error_px(camera: &Camera, truth: &Markers, estimate: &Markers) -> Option<f64> {
    let of = |(truth, estimate): (&Option<Point3<f64>>, &Option<Point3<f64>>)| {
        let (truth, estimate) = (camera.project(&(*truth)?)?, camera.project(&(*estimate)?)?);
        camera.pinhole.contains(&truth).then(|| (estimate - truth).norm())
    };
    let errors: Vec<f64> = truth.iter().zip(estimate).filter_map(of).collect();
    mean(&errors).map(|error| (10.0 * error).round() / 10.0)
}
