//! Checks of a scene before it is rendered: errors, notes, the actor's path, and the cameras' views.

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::scene_preparation::PreparedScene;
use crate::scenario::{KeyError, RigSettings, RingSettings};
use skiagraph_core::body::{LinkFrames, Ray, Solid};
use skiagraph_core::camera::Camera;
use skiagraph_core::contact::{ContactRule, PropContacts};
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_truth::observing::Observer;

/// At most this many frames are drawn to measure how the cameras see the actor,
const MOST_CHECKED_FRAMES: usize = 120;
/// and at most this many pixels, but never fewer frames than the next constant.
const MOST_CHECKED_PIXELS: usize = 1 << 30;
const FEWEST_CHECKED_FRAMES: usize = 3;

/// Greatest distance of any part of a body from its root, metres: cameras farther away are outside it.
const BODY_REACH: f64 = 3.0;

/// Penetration of a prop up to this depth is not reported, because feet stand on plates and hands lie on tables;
/// metres.
const TOLERATED_PROP_DEPTH: f64 = 0.02;

/// The path of the actor's root over the ground, metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActorPath {
    /// First position, x and y.
    pub start_m: [f64; 2],
    /// Last position.
    pub end_m: [f64; 2],
    /// Length of the path, summed over frames.
    pub length_m: f64,
    pub least_m: [f64; 2],
    pub greatest_m: [f64; 2],
}

/// How one camera sees the actor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraView {
    pub camera: String,
    /// Number of drawn frames, evenly spaced from the first to the last.
    pub frames_looked_at: usize,
    /// Share of them in which at least one pixel of the actor is visible.
    pub in_view: f64,
    /// Share of them in which the silhouette touches the image's border.
    pub at_border: f64,
    /// Height of the silhouette, pixels: least, median, greatest; `null` if it is never visible.
    pub height_px: Option<[u32; 3]>,
}

impl ActorPath {
    pub(crate) fn new(scene: &PreparedScene) -> Self {
        let roots = scene.ground_truth.frames.iter().map(|frame| frame.pose.world_from_root.translation.vector.xy());
        let roots: Vec<_> = roots.collect();
        let [start, end] = [roots.first(), roots.last()].map(|root| root.copied().unwrap_or_default());
        let (least, greatest) = roots.iter().fold((start, start), |(low, high), p| (low.inf(p), high.sup(p)));
        Self {
            start_m: start.into(),
            end_m: end.into(),
            length_m: roots.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum(),
            least_m: least.into(),
            greatest_m: greatest.into(),
        }
    }
}

/// Share of frames in which a camera may be inside the actor: a long walk passes through a ring of cameras.
const SHARE_INSIDE: f64 = 0.01;

#[derive(Default)]
pub(crate) struct CamerasInside {
    /// Errors: a camera is inside the actor in the first frame, or in more than 1 % of the frames.
    pub(crate) errors: Vec<KeyError>,
    pub(crate) notes: Vec<String>,
}

impl CamerasInside {
    pub(crate) fn new(ring: Option<&RingSettings>, scene: &PreparedScene) -> Self {
        let mut found = Self::default();
        let on_ring = ring.map_or(0, |ring| ring.count as usize);
        for (index, camera) in scene.rig.rig().cameras.iter().enumerate() {
            let inside = frames_inside(scene, index);
            let Some((first, link)) = inside.first() else { continue };
            let (name, link) = (&camera.name, &scene.ground_truth.actor.links[*link].name);
            let place = format!(
                "`{name}` is inside the actor's `{link}` in set frame {first} (from 0), and in {} frames in total",
                inside.len()
            );
            if *first > 0 && inside.len() as f64 <= SHARE_INSIDE * scene.frames() as f64 {
                found
                    .notes
                    .push(format!("the actor passes through a camera: {place}; its images there are meaningless"));
                continue;
            }
            let key = if index < on_ring { "rig.ring".to_owned() } else { format!("rig.camera[{}]", index - on_ring) };
            let message = format!("expected every camera outside the actor: {place}; move the camera or the motion");
            found.errors.push(KeyError::new(key, message));
        }
        found
    }
}

/// The frames in which a camera is inside one of the actor's solids, each with the link.
fn frames_inside(scene: &PreparedScene, camera: usize) -> Vec<(usize, usize)> {
    let (truth, rig) = (&scene.ground_truth, &scene.rig);
    let link_around = |index: usize| {
        let frame = &truth.frames[index];
        let point = &rig.camera_at(camera, rig.row_s(camera, frame.time_s, 0)).centre();
        if (frame.pose.world_from_root.translation.vector - point.coords).norm() > BODY_REACH {
            return None;
        }
        let contains = |(link, world_from_link): (usize, &nalgebra::Isometry3<f64>)| {
            let at = world_from_link.inverse_transform_point(point);
            truth.actor.links[link].solids.iter().any(|solid| is_inside(solid, at)).then_some(link)
        };
        frame.link_frames.0.iter().enumerate().find_map(contains)
    };
    parallel::map(truth.frames.len(), link_around)
        .into_iter()
        .enumerate()
        .filter_map(|(i, link)| Some((i, link?)))
        .collect()
}

/// Whether a point in the frame of a solid's link is inside the solid; a mesh has no inside.
fn is_inside(solid: &Solid, origin: Point3<f64>) -> bool {
    let convex = !matches!(solid, Solid::Mesh { .. });
    convex && solid.ray_entry(&Ray { origin, direction: Vector3::z() }) == Some(0.0)
}

/// Notes about props that the actor penetrates and cameras inside a prop.
pub(crate) fn prop_notes(scene: &PreparedScene) -> Vec<String> {
    let truth = &scene.ground_truth;
    let checked = frames_to_check(scene.frames(), MOST_CHECKED_FRAMES);
    let frames: Vec<LinkFrames> = checked.iter().map(|frame| truth.frames[*frame].link_frames.clone()).collect();
    let contacts = PropContacts::from_frames(
        &truth.actor,
        &truth.props,
        &frames,
        truth.frames_per_second,
        &ContactRule::default(),
    );
    let tracks = contacts.map(|contacts| contacts.tracks).unwrap_or_default();
    let mut notes = Vec::new();
    for (index, prop) in truth.props.iter().enumerate() {
        let deepest = |frame: usize| {
            let of_prop = tracks.iter().filter(|track| track.prop == index);
            of_prop.map(|track| track.frames[frame].penetration_m()).fold(0.0, f64::max)
        };
        let depths: Vec<f64> = (0..frames.len()).map(deepest).collect();
        let entered = depths.iter().filter(|depth| **depth > TOLERATED_PROP_DEPTH).count();
        if entered > 0 {
            notes.push(format!(
                "the actor is inside the prop `{}` by up to {:.0} mm, by more than {:.0} mm in {entered} of {} checked \
                frames",
                prop.name,
                1000.0 * depths.iter().copied().fold(0.0, f64::max),
                1000.0 * TOLERATED_PROP_DEPTH,
                frames.len(),
            ));
        }
        for (index, camera) in scene.rig.rig().cameras.iter().enumerate() {
            let at = |time_s| is_inside(&prop.solid, scene.rig.camera_at(index, time_s).centre());
            let seconds = truth.frames.iter().map(|frame| scene.rig.row_s(index, frame.time_s, 0));
            let inside = match scene.rig.path(index) {
                None => at(0.0).then(|| "and sees nothing else".to_owned()),
                Some(_) => Some(seconds.filter(|time_s| at(*time_s)).count())
                    .filter(|count| *count > 0)
                    .map(|count| format!("in {count} of {} frames", truth.frames.len())),
            };
            notes.extend(
                inside.map(|how| format!("the camera `{}` is inside the prop `{}` {how}", camera.name, prop.name)),
            );
        }
    }
    notes
}

pub(crate) fn views(scene: &PreparedScene) -> Vec<CameraView> {
    let observer = Observer::new(&scene.ground_truth, &scene.rig);
    let pixels = |camera: &Camera| camera.pinhole.width as usize * camera.pinhole.height as usize;
    let pixels_per_frame = scene.rig.rig().cameras.iter().map(pixels).sum::<usize>().max(1);
    let frames = frames_to_check(
        scene.frames(),
        (MOST_CHECKED_PIXELS / pixels_per_frame).clamp(FEWEST_CHECKED_FRAMES, MOST_CHECKED_FRAMES),
    );
    let seen: Vec<Observation> = parallel::map(frames.len(), |i| observer.observe(frames[i]));
    let mut views = Vec::new();
    for (index, camera) in scene.rig.rig().cameras.iter().enumerate() {
        let taken = seen.iter().filter(|observation| observation.has_image(index));
        let looked_at = taken.clone().count();
        let bounds: Vec<_> = taken.map(|o| o.silhouettes[index].bounds()).filter(|b| !b.is_empty()).collect();
        let (width, height) = (camera.pinhole.width, camera.pinhole.height);
        let at_border = bounds.iter().filter(|b| b.left == 0 || b.top == 0 || b.right == width || b.bottom == height);
        let mut heights: Vec<u32> = bounds.iter().map(|b| b.bottom - b.top).collect();
        heights.sort_unstable();
        let share = |count: usize| count as f64 / looked_at.max(1) as f64;
        views.push(CameraView {
            camera: camera.name.clone(),
            frames_looked_at: looked_at,
            in_view: share(bounds.len()),
            at_border: share(at_border.count()),
            height_px: heights.first().zip(heights.last()).map(|(low, high)| [*low, heights[heights.len() / 2], *high]),
        });
    }
    views
}

/// The error that `run` reports after rendering if no camera sees the actor in any frame.
pub(crate) fn unseen(rig: &RigSettings, scene: &PreparedScene, views: &[CameraView]) -> Option<KeyError> {
    if views.iter().any(|view| view.height_px.is_some()) {
        return None;
    }
    let observer = Observer::new(&scene.ground_truth, &scene.rig);
    let is_seen = |frame: &usize| observer.observe(*frame).silhouettes.iter().any(|silhouette| !silhouette.is_empty());
    (0..scene.frames()).find(is_seen).is_none().then(|| unseen_in(rig, scene.frames()))
}

/// The error that no camera sees the actor in any of `frames` frames.
pub(crate) fn unseen_in(rig: &RigSettings, frames: usize) -> KeyError {
    let unit = match rig.file.is_empty() {
        true => "",
        false => "; for a translation in millimetres, set metres_per_unit = 0.001 in its [[rig.file]]",
    };
    let message = format!(
        "expected a camera that sees the subject, found no pixel of it in {frames} frames; props hide it or the cameras \
        are too far away{unit}"
    );
    KeyError::new("rig", message)
}

/// At most `most` evenly spaced frames of the set, including the first and the last.
fn frames_to_check(frames: usize, most: usize) -> Vec<usize> {
    let count = frames.min(most);
    (0..count).map(|i| if count < 2 { 0 } else { i * (frames - 1) / (count - 1) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checked_frames_begin_with_the_first_and_end_with_the_last() {
        assert_eq!(frames_to_check(0, 120), Vec::<usize>::new());
        assert_eq!(frames_to_check(1, 120), [0]);
        assert_eq!(frames_to_check(4, 120), [0, 1, 2, 3]);
        assert_eq!(frames_to_check(11, 3), [0, 5, 10]);
        let many = frames_to_check(1001, 120);
        assert_eq!((many.len(), many[0], many[119]), (120, 0, 1000));
        assert!(many.windows(2).all(|pair| (8..=9).contains(&(pair[1] - pair[0]))));
    }

    #[test]
    fn a_point_is_inside_a_solid_that_contains_it() {
        let place = nalgebra::Isometry3::translation(1.0, 0.0, 0.0);
        let solid = Solid::Box { link_from_box: place, half_extents: [0.1, 0.1, 0.1] };
        assert!(is_inside(&solid, Point3::new(1.05, 0.0, -0.05)));
        assert!(!is_inside(&solid, Point3::new(1.0, 0.0, -0.2)), "below, and the ray upwards meets it");
    }
}
