//! A walking stick figure, and trackers that follow it more or less closely: input for tests and for viewing the page.

use nalgebra::{Point2, Point3, UnitQuaternion, Vector3};

use crate::test_figure::{SWING, standing, translated};
use skiagraph_core::body::{LANDMARKS, Landmark, Markers};
use skiagraph_core::camera::{Camera, CameraRig, FieldOfView};
use skiagraph_core::raster::Mask;
use skiagraph_eval::{
    Energies, Evaluation, RootRotations, SeedRun, Sequence, Views, evaluate, intersection_over_union, summarise,
};
use skiagraph_track::motion_model::ModelOccupancy;
use skiagraph_track::tracker::LayerRecord;

use super::overlay::marker_bones;
use super::{
    FactGroup, FootStances, Playback, PlaybackPlan, ReportInput, ReportRun, Sheet, SheetFrame, Shown, frames_to_show,
    typical_run, worst_frames,
};

const FRAMES: usize = 121;
const FPS: f64 = 60.0;

/// Properties of a made-up run.
pub(super) struct Story {
    pub(super) title: &'static str,
    pub(super) seeds: u64,
    pub(super) matched: bool,
    pub(super) frozen: bool,
    pub(super) layers: usize,
    pub(super) models: usize,
    pub(super) energies: bool,
    /// Energy of the truth minus energy of the estimate.
    pub(super) gap: f64,
    /// First frame whose images are empty, so that they fit every pose alike.
    pub(super) empty_from: Option<usize>,
    /// First frame in which the body is lost.
    pub(super) lost_from: Option<usize>,
    /// Constant sideways offset of the estimate, m.
    pub(super) beside_m: f64,
    /// Size of the varying error; 1 means centimetres.
    pub(super) wander: f64,
    /// First frame in which the left wrist is half a metre off.
    pub(super) wrist_lost_from: Option<usize>,
    /// First frame in which the left wrist has no estimate.
    pub(super) wrist_missing_from: Option<usize>,
    /// Overlap with the exact silhouettes, if the observed ones are corrupted.
    pub(super) exact_overlap: Option<f64>,
    /// Frames on the sheet, to which the worst is added; empty for no sheet.
    pub(super) shown: &'static [usize],
}

impl Default for Story {
    fn default() -> Self {
        Self {
            title: "Walk",
            seeds: 1,
            matched: false,
            frozen: true,
            layers: 5,
            models: 0,
            energies: true,
            gap: -0.02,
            empty_from: None,
            lost_from: None,
            beside_m: 0.0,
            wander: 1.0,
            wrist_lost_from: None,
            wrist_missing_from: None,
            exact_overlap: None,
            shown: &[],
        }
    }
}

pub(super) fn with_input<T>(story: &Story, read: impl FnOnce(&ReportInput<'_>) -> T) -> T {
    let rig = rig(4);
    let truth: Vec<Markers> = (0..FRAMES).map(walking).collect();
    let estimates: Vec<Vec<Markers>> = (0..story.seeds).map(|seed| estimate(&truth, story, seed)).collect();
    let energies: Vec<[Vec<Option<f64>>; 2]> = (0..story.seeds).map(|seed| energies(story, seed)).collect();
    let evaluations: Vec<Evaluation> = estimates
        .iter()
        .zip(&energies)
        .map(|(estimate, energies)| measured(story, &truth, estimate, energies))
        .collect();
    let stances = ["left foot", "right foot"].map(|foot| FootStances {
        foot: foot.to_owned(),
        truth: vec![[0, 40], [60, 100]],
        estimate: vec![[0, 35], [62, 104]],
    });
    let runs: Vec<SeedRun<'_>> =
        evaluations.iter().zip(0..).map(|(evaluation, seed)| SeedRun { clip: "walk", seed, evaluation }).collect();
    let in_model = |f: usize, m: usize| ModelOccupancy { particles: ((f + m) % 7) as u32, weight: 0.1, recovered: 0 };
    let occupancy: Vec<Vec<ModelOccupancy>> =
        (0..FRAMES).map(|f| (0..story.models).map(|m| in_model(f, m)).collect()).collect();
    let layers: Vec<Vec<Vec<LayerRecord>>> = (0..story.seeds).map(|seed| layers(story, seed)).collect();
    let report_runs: Vec<ReportRun<'_>> = runs
        .iter()
        .zip(&energies)
        .zip(&layers)
        .map(|((run, [truth_energy, estimate_energy]), layers)| ReportRun {
            run: *run,
            truth_energy,
            estimate_energy,
            layers: layers.iter().map(Vec::as_slice).collect(),
            occupancy: occupancy.iter().map(Vec::as_slice).collect(),
            stances: &stances,
        })
        .collect();
    let still = vec![truth[0]; FRAMES];
    let frozen = evaluate(&Sequence::from_markers(FPS, &truth, &still)).unwrap();
    let typical = typical_run(&runs).unwrap();
    let mut shown: Vec<Shown> = story.shown.iter().map(|&frame| Shown { run: typical, frame }).collect();
    shown.extend(frames_to_show(&runs, 0));
    let on_sheet = |Shown { run, frame }: Shown| sheet_frame(&rig, run as u64, frame, &truth, &estimates[run]);
    let frames = shown.into_iter().map(on_sheet).collect();
    let sheet = Sheet { rig: &rig, frames_per_second: FPS, props: Vec::new(), frames };
    let plan = PlaybackPlan { reduction: 1, stride: 1, frames: FRAMES };
    let worst_run = worst_frames(&runs, 1).first().map(|worst| worst.run).filter(|worst| *worst != typical);
    let playback = |run: usize| Playback {
        seed: run as u64,
        plan,
        views: (0..FRAMES)
            .map(|frame| {
                let shown = sheet_frame(&rig, 0, frame, &truth, &estimates[run]);
                let estimated = shown.estimated.unwrap_or_default();
                shown.observed.iter().zip(&estimated).map(|(a, b)| plan.pack(a, Some(b))).collect()
            })
            .take(if story.shown.is_empty() { 0 } else { FRAMES })
            .collect(),
        props: Vec::new(),
        moved: Vec::new(),
        truth: truth.clone(),
        estimate: estimates[run].clone(),
    };
    let playbacks: Vec<Playback> = std::iter::once(typical).chain(worst_run).map(playback).collect();
    read(&ReportInput {
        title: story.title,
        tracker: "annealed particle filter, 200 particles x 5 layers",
        matched: story.matched,
        facts: &[FactGroup { title: "Bodies".into(), facts: vec![("Actor".into(), "actor, with a skin".into())] }],
        runs: &report_runs,
        summary: &summarise(&runs).unwrap(),
        own_likelihood: true,
        frozen: story.frozen.then_some(&frozen),
        sheet: (!story.shown.is_empty()).then_some(&sheet),
        picture: b"a picture",
        playbacks: if story.shown.is_empty() { &[] } else { &playbacks },
        this_run: &[("command".to_owned(), "skiagraph run walk.toml".to_owned())],
        hint: None,
    })
}

/// A camera 4 m in front of the figure, on the +X side, looking at it.
pub(super) fn camera_in_front() -> Camera {
    rig(1).cameras.remove(0)
}

/// Cameras on a circle around the figure's path.
pub(super) fn rig(count: usize) -> CameraRig {
    let cameras = (0..count).map(|index| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * index as f64 / count as f64);
        let eye = Point3::new(4.2 * cos, 4.2 * sin, 1.4);
        let view = FieldOfView::Vertical(2.0 * libm::atan(120.0 / 260.0));
        let target = Point3::new(0.0, 0.0, 0.9);
        Camera::look_at(&format!("cam{index:02}"), eye, target, Vector3::z(), view, 320, 240).unwrap()
    });
    CameraRig { cameras: cameras.collect() }
}

/// A sheet of the walking figure with an estimate that is 3 cm off.
pub(super) fn walking_sheet<'a>(rig: &'a CameraRig, frames: &[usize]) -> Sheet<'a> {
    let truth: Vec<Markers> = (0..FRAMES).map(walking).collect();
    let beside: Vec<Markers> = truth.iter().map(|m| translated(m, Vector3::new(0.0, 0.03, 0.0))).collect();
    let frames = frames.iter().map(|&frame| sheet_frame(rig, 0, frame, &truth, &beside)).collect();
    Sheet { rig, frames_per_second: FPS, props: Vec::new(), frames }
}

fn sheet_frame(rig: &CameraRig, seed: u64, frame: usize, truth: &[Markers], estimate: &[Markers]) -> SheetFrame {
    SheetFrame {
        seed,
        frame,
        images: Vec::new(),
        moved: None,
        observed: rig.cameras.iter().map(|camera| shadow(camera, &truth[frame], 0.065)).collect(),
        estimated: Some(rig.cameras.iter().map(|camera| shadow(camera, &estimate[frame], 0.060)).collect()),
        truth: truth[frame],
        estimate: estimate[frame],
    }
}

/// Every pixel within `radius` metres (at the bone's distance) of a bone.
fn shadow(camera: &Camera, markers: &Markers, radius: f64) -> Mask {
    let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
    for bone in marker_bones(markers) {
        for step in 0..=40 {
            let point = bone[0] + (bone[1] - bone[0]) * (f64::from(step) / 40.0);
            let Some(centre) = camera.project(&point) else { continue };
            let depth = (camera.camera_from_world * point).z;
            fill_disc(&mut mask, centre, radius * camera.pinhole.focal[0] / depth);
        }
    }
    mask
}

fn fill_disc(mask: &mut Mask, centre: Point2<f64>, radius: f64) {
    for y in (centre.y - radius).max(0.0) as u32..(centre.y + radius + 1.0).max(0.0) as u32 {
        for x in (centre.x - radius).max(0.0) as u32..(centre.x + radius + 1.0).max(0.0) as u32 {
            if (Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - centre).norm() <= radius {
                mask.set(x, y, true);
            }
        }
    }
}

fn walking(frame: usize) -> Markers {
    let phase = std::f64::consts::TAU * frame as f64 / 60.0;
    let mut markers = translated(&standing(), Vector3::new(0.012 * frame as f64 - 0.7, 0.0, 0.0));
    for (landmark, metres) in SWING {
        let marker = &mut markers[landmark as usize];
        *marker = marker.map(|p| p + Vector3::new(metres * libm::sin(phase), 0.0, 0.05 * libm::fabs(libm::sin(phase))));
    }
    markers
}

/// The truth with a varying error, which is largest at the hands and feet and grows from zero in the first frames.
fn estimate(truth: &[Markers], story: &Story, seed: u64) -> Vec<Markers> {
    let of_frame = |(frame, markers): (usize, &Markers)| {
        let beside = Vector3::new(0.0, story.beside_m, 0.0);
        let lost = story.lost_from.filter(|from| frame >= *from).map_or(0.0, |from| 0.02 * (frame - from + 10) as f64);
        let mut estimate = *markers;
        for (index, marker) in estimate.iter_mut().enumerate() {
            let size = if [4, 7, 10, 13].contains(&index) { 0.024 } else { 0.011 } * (frame as f64 / 12.0).min(1.0);
            let error = Vector3::from_fn(|axis, _| story.wander * size * wander(frame, index, axis, seed));
            *marker = marker.map(|p| p + error + beside + Vector3::new(0.0, lost, 0.0));
        }
        if story.wrist_lost_from.is_some_and(|from| frame >= from) {
            let wrist = &mut estimate[Landmark::LeftWrist as usize];
            *wrist = wrist.map(|p| p + Vector3::new(0.0, 0.5, 0.0));
        }
        if story.wrist_missing_from.is_some_and(|from| frame >= from) {
            estimate[Landmark::LeftWrist as usize] = None;
        }
        estimate
    };
    truth.iter().enumerate().map(of_frame).collect()
}

/// A smooth function of the frame of size one, different for every marker, axis and seed.
fn wander(frame: usize, marker: usize, axis: usize, seed: u64) -> f64 {
    let (t, place) = (frame as f64, (3 * marker + axis) as f64 + 11.3 * seed as f64);
    libm::sin(0.13 * t + 1.7 * place) + 0.6 * libm::sin(0.41 * t + 2.9 * place) + 0.3 * libm::sin(1.9 * t + 4.1 * place)
}

fn measured(
    story: &Story,
    truth: &[Markers],
    estimate: &[Markers],
    [at_truth, at_estimate]: &[Vec<Option<f64>>; 2],
) -> Evaluation {
    let cameras = [camera_in_front()];
    let overlaps: Vec<Vec<Option<f64>>> = (0..FRAMES)
        .map(|f| {
            let [a, b] = [&truth[f], &estimate[f]].map(|markers| shadow(&cameras[0], markers, 0.06));
            vec![intersection_over_union(&a, &b)]
        })
        .collect();
    let seen = [[true; LANDMARKS.len()]];
    let seen = vec![seen.as_slice(); FRAMES];
    let roots = vec![UnitQuaternion::identity(); FRAMES];
    let turned: Vec<_> = (0..FRAMES)
        .map(|f| Some(UnitQuaternion::from_euler_angles(0.02, 0.03 * libm::sin(f as f64 / 9.0), 0.05)))
        .collect();
    let mut sequence = Sequence::from_markers(FPS, truth, estimate);
    let exact = story.exact_overlap.map(|overlap| vec![vec![Some(overlap)]; FRAMES]);
    sequence.view_overlaps = Some(&overlaps);
    sequence.exact_overlaps = exact.as_deref();
    sequence.views = Some(Views { cameras: &cameras, moved: &[], in_view: &seen, visible: &seen });
    sequence.roots = Some(RootRotations { truth: &roots, estimate: &turned });
    sequence.energies =
        (!at_truth.is_empty()).then_some(Energies { truth: at_truth, estimate: at_estimate, is_own: true });
    evaluate(&sequence).unwrap()
}

/// Energy at the truth and at the estimate.
fn energies(story: &Story, seed: u64) -> [Vec<Option<f64>>; 2] {
    if !story.energies {
        return [vec![], vec![]];
    }
    let at_estimate = |f: usize| 0.16 + 0.02 * libm::sin((f as f64 + 3.0 * seed as f64) / 7.0);
    let estimate: Vec<_> = (0..FRAMES).map(|f| Some(at_estimate(f))).collect();
    let gap = |f: usize| if story.empty_from.is_some_and(|from| f >= from) { 0.0 } else { story.gap };
    let wiggle = |f: usize| 1.0 + 0.4 * libm::cos(f as f64 / 5.0);
    [(0..FRAMES).map(|f| Some(at_estimate(f) + gap(f) * wiggle(f))).collect(), estimate]
}

fn layers(story: &Story, seed: u64) -> Vec<Vec<LayerRecord>> {
    let record = |frame: usize, layer: usize| {
        let wave = libm::sin((frame + 5 * layer + seed as usize) as f64 / 8.0);
        LayerRecord {
            lambda: 4.0 * libm::pow(1.7, layer as f64) * (1.0 + 0.15 * wave),
            effective_sample_size: 100.0 - 14.0 * layer as f64 + 3.0 * wave,
            energy_min: 0.1,
            energy_mean: 0.2,
            energy_std: 0.02,
            degenerate: false,
        }
    };
    (0..FRAMES).map(|f| (0..if f == 0 { 0 } else { story.layers }).map(|layer| record(f, layer)).collect()).collect()
}
