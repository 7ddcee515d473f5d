//! `skiagraph place`: where cameras should stand to see a motion.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use serde::Serialize;
use serde_json::json;

use super::noise::outline_noise;
use super::scene::BoundScene;
use crate::artefacts::{Artefact, ArtefactKind, Destination, MadeBy};
use crate::common::{ExperimentError, Progress, Stage, to_json};
use crate::prepare::rig::middle_of_path;
use crate::prepare::scenario_copy::{SCENARIO_FILE, scenario_text};
use crate::scenario::{CameraSettings, RigSettings, Scenario, is_default};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::parallel;
use skiagraph_track::tracker::{InformedBody, covariance, mean_length};

const PLACEMENT_FILE: &str = "placement.json";
pub(super) const MOST_CANDIDATES: usize = 2000;
/// Rounds of exchanging cameras after the greedy choice.
const MOST_ROUNDS: usize = 20;
/// Least distance of a new camera from the body in any frame, metres.
const CLEARANCE_M: f64 = 0.5;
/// Share of the error without any camera above which cameras tell next to nothing.
const TELLING: f64 = 0.1;
const LOOK_AT_M: f64 = 0.95;

/// Places where a camera may stand.
#[derive(Clone, Debug, PartialEq)]
pub enum Candidates {
    /// On circles around the middle of the path, with the lens and image of the scenario's first camera.
    Ring {
        /// Radius, metres; by default the mean distance of the scenario's cameras.
        radius_m: Option<f64>,
        /// Heights of the circles, metres.
        heights_m: Vec<f64>,
        /// Number of places on each circle.
        azimuths: u32,
    },
    /// On the square of twice that radius around the middle of the path, except inside the circle of half that radius.
    Grid {
        /// As for a ring.
        radius_m: Option<f64>,
        /// Heights, metres.
        heights_m: Vec<f64>,
        /// Distance between neighbours, metres.
        spacing_m: f64,
    },
    /// The scenario's own cameras.
    Own,
}

/// What cameras are chosen by.
#[derive(Clone, Debug)]
pub struct PlacementOptions {
    pub cameras: usize,
    /// Where they may stand.
    pub candidates: Candidates,
    /// Number of frames of the motion that are considered, spread evenly.
    pub frames: usize,
    /// Standard deviation and correlation length of the outlines, pixels; by default those of the scenario.
    pub outline_px: Option<[f64; 2]>,
}

/// The chosen cameras: `placement.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Placement {
    /// `skiagraph.placement/1`.
    pub schema: String,
    pub name: String,
    pub noise: String,
    /// Frames of the motion that were considered.
    pub frames: Vec<usize>,
    pub candidates: usize,
    /// Number of places that are no candidates, because the body comes too near to them.
    #[serde(skip_serializing_if = "is_default")]
    pub too_near: usize,
    /// Expected error of the chosen cameras together, mean over markers and frames, mm.
    pub expected_mm: f64,
    /// The same of the scenario's own cameras, and how many they are.
    pub own: (usize, f64),
    /// The chosen cameras, the most useful first.
    pub chosen: Vec<ChosenCamera>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    #[serde(skip)]
    pub(super) cameras: Vec<Camera>,
    /// All candidates and the scenario's own cameras, for the picture.
    #[serde(skip)]
    pub(super) others: [Vec<Camera>; 2],
    #[serde(skip)]
    pub(super) path: Vec<[f64; 2]>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenCamera {
    pub name: String,
    /// Its centre in the world.
    pub centre_m: [f64; 3],
    /// Expected error of this and all cameras above it, mm.
    pub expected_mm: f64,
    /// Expected error of all chosen cameras but this one, mm.
    pub without_mm: f64,
}

/// Chooses cameras: the one that lowers the expected error most, again and again, then exchanges single cameras as long
/// as that lowers it further.
///
/// The expected error is the least mean error of an estimate from one frame alone, as in [`super::bound()`]: the mean
/// length over frames and markers of deviates with the covariance `A (F + L)^-1 A^T`. `F` is the information of all
/// chosen cameras, `L` the little that is known without images, `A` moves the markers. The next view is chosen in a
/// similar way in `[Kiciroglu 2020]`.
///
/// # Errors
/// [`ExperimentError`] if there are too few or too many candidates, or no candidate sees the body.
pub fn place(
    scene: &BoundScene,
    options: &PlacementOptions,
    progress: &dyn Progress,
) -> Result<Placement, ExperimentError> {
    let places = options.candidates.cameras(scene)?;
    let (all_places, candidates) = (places.len(), clear_of(scene, &options.candidates, places));
    let refused = |argument, detail| Err(ExperimentError::Argument { argument, detail });
    let (count, wanted) = (candidates.len(), options.cameras);
    let too_near = all_places - count;
    if wanted > count && too_near > 0 {
        let detail = format!(
            "{too_near} of {all_places} places are nearer than {CLEARANCE_M} m to the body in some frame, so only {count} are \
             left for {wanted} cameras; choose a larger radius"
        );
        return refused("--radius", detail);
    }
    if wanted > count {
        return refused("--cameras", format!("expected at most the number of candidates, {count}; found {wanted}"));
    }
    if count > MOST_CANDIDATES {
        return refused("--candidates", format!("expected at most {MOST_CANDIDATES} candidates, found {count}"));
    }
    let own = scene.rig.rig().cameras.clone();
    let (noise, words) = outline_noise(&scene.observation, options.outline_px);
    let informed = InformedBody::new(&scene.body);
    let poses = scene.motion.poses.len();
    let frames: BTreeSet<usize> =
        (0..options.frames.max(1)).map(|k| (2 * k + 1) * poses / (2 * options.frames.max(1))).collect();
    let frames: Vec<usize> = frames.into_iter().filter(|frame| *frame < poses).collect();
    let all: Vec<&Camera> = candidates.iter().chain(&own).collect();
    progress.begin(Stage::Evaluate, all.len() * frames.len());
    let told = parallel::map(all.len() * frames.len(), |index| {
        let (camera, frame) = (all[index / frames.len()], frames[index % frames.len()]);
        if progress.interrupted() {
            return None;
        }
        let links = scene.body.link_frames(&scene.motion.poses[frame]);
        let found = informed.of_silhouette(&links, camera, noise);
        progress.advance();
        Some(found)
    });
    let told: Vec<DMatrix<f64>> = told.into_iter().collect::<Option<_>>().ok_or(ExperimentError::Interrupted)?;
    if told.iter().all(|of| of.iter().all(|value| *value == 0.0)) {
        return refused(
            "SCENARIO",
            format!("no candidate sees {}; choose another --radius or height", scene.body.name),
        );
    }
    let ignorance = informed.ignorance();
    let rig = CandidateRig { scene, frames: &frames, told: &told, ignorance: &ignorance };
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < wanted {
        chosen.extend(rig.best_of((0..count).filter(|c| !chosen.contains(c)).collect(), &chosen));
    }
    exchange(&rig, &mut chosen, count);
    let chosen = rig.ordered(&chosen);
    let cameras: Vec<Camera> = chosen.iter().map(|index| candidates[*index].clone()).collect();
    let own_indices: Vec<usize> = (count..count + own.len()).collect();
    let [expected_mm, unknown_mm] = [&chosen[..], &[]].map(|cameras| rig.expected_mm(cameras));
    let useless = (expected_mm > TELLING * unknown_mm).then(|| {
        format!(
            "these cameras tell next to nothing: {unknown_mm:.0} mm without any camera; choose a smaller --radius, or a lens \
             that shows the body larger"
        )
    });
    let described = |(place, camera): (usize, &Camera)| {
        let without: Vec<usize> = chosen.iter().copied().filter(|index| *index != chosen[place]).collect();
        ChosenCamera {
            name: camera.name.clone(),
            centre_m: camera.centre().coords.into(),
            expected_mm: rig.expected_mm(&chosen[..=place]),
            without_mm: rig.expected_mm(&without),
        }
    };
    Ok(Placement {
        schema: "skiagraph.placement/1".to_owned(),
        name: scene.name.clone(),
        noise: words,
        candidates: count,
        too_near,
        expected_mm,
        notes: useless.into_iter().chain(scene.occlusion_note()).collect(),
        own: (own.len(), rig.expected_mm(&own_indices)),
        chosen: cameras.iter().enumerate().map(described).collect(),
        cameras,
        others: [candidates.clone(), own],
        path: scene
            .motion
            .poses
            .iter()
            .map(|pose| [pose.world_from_root.translation.x, pose.world_from_root.translation.y])
            .collect(),
        frames,
    })
}

/// The places that the body never comes near to. The scenario's own cameras are kept: they are there.
fn clear_of(scene: &BoundScene, candidates: &Candidates, places: Vec<Camera>) -> Vec<Camera> {
    if *candidates == Candidates::Own {
        return places;
    }
    let markers = |pose: &Pose| scene.body.markers(&scene.body.link_frames(pose)).into_iter().flatten();
    let points: Vec<Point3<f64>> = scene.motion.poses.iter().flat_map(markers).collect();
    let is_clear = |camera: &Camera| {
        let place = camera.centre();
        points.iter().all(|point| (point - place).norm() >= CLEARANCE_M)
    };
    places.into_iter().filter(is_clear).collect()
}

/// Replaces single cameras while that lowers the expected error.
fn exchange(rig: &CandidateRig<'_>, chosen: &mut [usize], count: usize) {
    for _ in 0..MOST_ROUNDS {
        let before = rig.expected_mm(chosen);
        for place in 0..chosen.len() {
            let rest: Vec<usize> = chosen.iter().copied().filter(|index| *index != chosen[place]).collect();
            let free = (0..count).filter(|index| !rest.contains(index)).collect();
            if let Some(better) = rig.best_of(free, &rest) {
                chosen[place] = better;
            }
        }
        if rig.expected_mm(chosen) > before * (1.0 - 1e-9) {
            return;
        }
    }
}

/// Information of every camera in every considered frame.
struct CandidateRig<'a> {
    scene: &'a BoundScene,
    frames: &'a [usize],
    /// `[camera][frame]`, flat.
    told: &'a [DMatrix<f64>],
    /// Precision of what is known without any image.
    ignorance: &'a DVector<f64>,
}

impl CandidateRig<'_> {
    /// The camera that together with `with` has the least expected error; the first of equals.
    fn best_of(&self, free: Vec<usize>, with: &[usize]) -> Option<usize> {
        let expected = parallel::map(free.len(), |place| self.expected_mm(&[with, &[free[place]]].concat()));
        free.into_iter().zip(expected).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }

    /// The same cameras, the most useful first.
    fn ordered(&self, chosen: &[usize]) -> Vec<usize> {
        let mut sorted = Vec::new();
        while sorted.len() < chosen.len() {
            let left = chosen.iter().copied().filter(|index| !sorted.contains(index)).collect();
            let Some(next) = self.best_of(left, &sorted) else { break };
            sorted.push(next);
        }
        sorted
    }

    /// Mean over markers and frames; infinite if the information is singular.
    fn expected_mm(&self, cameras: &[usize]) -> f64 {
        let body: &Humanoid = &self.scene.body;
        let (mut sum, mut count) = (0.0, 0_usize);
        for (place, frame) in self.frames.iter().enumerate() {
            let start = DMatrix::zeros(body.step_len(), body.step_len());
            let of_all = cameras.iter().map(|camera| &self.told[camera * self.frames.len() + place]);
            let Some(known) = covariance(&of_all.fold(start, |sum, of| sum + of), self.ignorance) else {
                return f64::INFINITY;
            };
            let links = body.link_frames(&self.scene.motion.poses[*frame]);
            let markers = body.marker_covariances(&links, &known);
            sum += markers.iter().flatten().map(mean_length).sum::<f64>();
            count += markers.iter().flatten().count();
        }
        1000.0 * sum / count.max(1) as f64
    }
}

impl Candidates {
    fn cameras(&self, scene: &BoundScene) -> Result<Vec<Camera>, ExperimentError> {
        let own = scene.rig.rig();
        let middle = middle_of_path(&scene.motion);
        let usual = |given: Option<f64>| given.unwrap_or_else(|| mean_distance(own, &middle));
        let places: Vec<Point3<f64>> = match self {
            Self::Own => return Ok(own.cameras.clone()),
            Self::Ring { radius_m, heights_m, azimuths } => {
                let radius = usual(*radius_m);
                let on_circle = |height: f64| {
                    (0..*azimuths).map(move |k| {
                        let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(k) / f64::from(*azimuths));
                        Point3::new(middle.x + radius * cos, middle.y + radius * sin, height)
                    })
                };
                heights_m.iter().flat_map(|height| on_circle(*height)).collect()
            }
            Self::Grid { radius_m, heights_m, spacing_m } => {
                let radius = usual(*radius_m);
                let steps = (radius / spacing_m).floor();
                if (2.0 * steps + 1.0).powi(2) * heights_m.len() as f64 > 4.0 * MOST_CANDIDATES as f64 {
                    let detail = format!("expected at most {MOST_CANDIDATES} candidates; choose a wider spacing");
                    return Err(ExperimentError::Argument { argument: "--spacing", detail });
                }
                let steps = steps as i32;
                let across = || (-steps..=steps).map(move |k| f64::from(k) * spacing_m);
                let flat = across().flat_map(|x| across().map(move |y| (x, y)));
                let far = flat.filter(|(x, y)| x.hypot(*y) >= 0.5 * radius).collect::<Vec<_>>();
                let at = |height: f64| far.iter().map(move |(x, y)| Point3::new(middle.x + x, middle.y + y, height));
                heights_m.iter().flat_map(|height| at(*height)).collect()
            }
        };
        let Some(like) = own.cameras.first() else { return Ok(Vec::new()) };
        let target = Point3::new(middle.x, middle.y, LOOK_AT_M);
        places.iter().enumerate().map(|(index, place)| facing(like, index, place, &target)).collect()
    }
}

/// A camera with the lens and image of `like` that looks at `target`.
fn facing(like: &Camera, index: usize, place: &Point3<f64>, target: &Point3<f64>) -> Result<Camera, ExperimentError> {
    let [width, height] = [like.pinhole.width, like.pinhole.height];
    let view = skiagraph_core::camera::FieldOfView::Horizontal(1.0);
    let aimed = Camera::look_at(&format!("place{index:03}"), *place, *target, Vector3::z(), view, width, height);
    let aimed = aimed.map_err(|error| ExperimentError::Argument { argument: "--radius", detail: error.to_string() })?;
    Ok(Camera { pinhole: like.pinhole, distortion: like.distortion, ..aimed })
}

fn mean_distance(rig: &CameraRig, middle: &Point3<f64>) -> f64 {
    let distances = rig.cameras.iter().map(|camera| (camera.centre() - middle).xy().norm());
    distances.sum::<f64>() / rig.cameras.len().max(1) as f64
}

/// Writes `placement.json`, a picture from above, and the scenario with the chosen cameras.
pub fn write_placement(placement: &Placement, scenario: &Scenario, to: Destination<'_>) -> Result<(), ExperimentError> {
    let Placement { name, noise, frames, candidates, chosen, .. } = placement;
    let settings = json!({
        "name": name, "noise": noise, "frames": frames, "candidates": candidates, "--cameras": chosen.len(),
    });
    let made_by = MadeBy::new("skiagraph place", settings);
    let folder = Artefact::begin_folder(to, ArtefactKind::Folder, made_by)?;
    folder.write(PLACEMENT_FILE, &to_json(placement)?)?;
    folder.write("placement.svg", placement.picture()?.as_bytes())?;
    let placed = Scenario {
        rig: RigSettings {
            ring: None,
            file: Vec::new(),
            camera: placement.cameras.iter().map(settings_of).collect(),
            leave_out: Vec::new(),
            motion: Vec::new(),
            timing: Vec::new(),
        },
        ..scenario.clone()
    };
    folder.write(SCENARIO_FILE, scenario_text(&placed)?.as_bytes())?;
    folder.finish()?;
    Ok(())
}

/// A camera as in a scenario.
fn settings_of(camera: &Camera) -> CameraSettings {
    let lens = camera.distortion;
    CameraSettings {
        name: Some(camera.name.clone()),
        size_px: [camera.pinhole.width, camera.pinhole.height],
        matrix: camera.opencv_matrix(),
        rotation: camera.opencv_rotation(),
        translation_m: camera.opencv_translation(),
        distortion: [lens.k1, lens.k2, lens.p1, lens.p2, lens.k3],
    }
}
