//! Checks of a scene before it is drawn: refusals, the actor's path, and the cameras' views.

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::scene_preparation::PreparedScene;
use crate::body::{LinkFrames, Ray, Solid};
use crate::camera::Camera;
use crate::common::{ExperimentError, scenario_error};
use crate::contact::{ContactRule, PropContacts};
use crate::observation::{Observation, Observer};
use crate::parallel;
use crate::scenario::ScenarioFile;

/// At most so many frames are drawn to say how the cameras see the actor,
const FRAMES_LOOKED_AT: usize = 120;
/// and at most so many pixels, unless a few frames have more.
const PIXELS_LOOKED_AT: usize = 1 << 30;
/// The fewest frames.
const FEWEST_LOOKED_AT: usize = 3;

/// No part of a body is farther from its root, metres: cameras beyond are outside it.
const BODY_REACH: f64 = 3.0;

/// A body that enters a prop by less is told nothing: feet stand on plates, hands lie on tables. Metres.
const PROP_DEPTH_TOLD: f64 = 0.02;

/// Where the actor's root goes, along the ground; metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ActorPath {
    /// Where it begins, x and y.
    pub start_m: [f64; 2],
    /// Where it ends.
    pub end_m: [f64; 2],
    /// Length of the path, frame by frame.
    pub length_m: f64,
    /// Least x and y.
    pub least_m: [f64; 2],
    /// Greatest x and y.
    pub greatest_m: [f64; 2],
}

/// How one camera sees the actor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraView {
    /// The camera's name.
    pub camera: String,
    /// How many frames were drawn, at equal distances from the first to the last.
    pub frames_looked_at: usize,
    /// Share of them in which at least a pixel of the actor is seen.
    pub in_view: f64,
    /// Share of them in which the figure touches the image's border.
    pub at_border: f64,
    /// Height of what is seen of the figure, pixels: least, median, greatest; `null` where nothing is.
    pub height_px: Option<[u32; 3]>,
}

impl ActorPath {
    pub(crate) fn new(staged: &PreparedScene) -> Self {
        let roots = staged.ground_truth.frames.iter().map(|frame| frame.pose.world_from_root.translation.vector.xy());
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

/// Share of frames in which a camera may be inside the actor before the scene is refused: a long walk passes through a
/// ring of cameras.
const SHARE_INSIDE: f64 = 0.01;

/// Cameras inside the actor.
#[derive(Default)]
pub(crate) struct CamerasInside {
    /// What `run` and `render` refuse: a camera inside the actor in the first frame, or in more than one of a hundred.
    pub(crate) refused: Vec<ExperimentError>,
    /// The others, for notes.
    pub(crate) told: Vec<String>,
}

impl CamerasInside {
    pub(crate) fn new(file: &ScenarioFile, staged: &PreparedScene) -> Self {
        let mut found = Self::default();
        let on_ring = file.scenario.rig.ring.as_ref().map_or(0, |ring| ring.count as usize);
        for (index, camera) in staged.rig.rig().cameras.iter().enumerate() {
            let inside = frames_inside(staged, index);
            let Some((first, link)) = inside.first() else { continue };
            let (name, link) = (&camera.name, &staged.ground_truth.actor.links[*link].name);
            let place = format!(
                "`{name}` is inside the actor's `{link}` in set frame {first} (from 0), and in {} frames in total",
                inside.len()
            );
            if *first > 0 && inside.len() as f64 <= SHARE_INSIDE * staged.frames() as f64 {
                found
                    .told
                    .push(format!("the actor passes through a camera: {place}; its images there are meaningless"));
                continue;
            }
            let key = if index < on_ring { "rig.ring".to_owned() } else { format!("rig.camera[{}]", index - on_ring) };
            let message = format!("expected every camera outside the actor: {place}; move the camera or the motion");
            found.refused.push(scenario_error(file, &key, message));
        }
        found
    }
}

/// The frames in which a camera is inside one of the actor's solids, each with the link.
fn frames_inside(staged: &PreparedScene, camera: usize) -> Vec<(usize, usize)> {
    let (truth, filming) = (&staged.ground_truth, &staged.rig);
    let within = |index: usize| {
        let frame = &truth.frames[index];
        let point = &filming.camera_at(camera, filming.row_s(camera, frame.time_s, 0)).centre();
        if (frame.pose.world_from_root.translation.vector - point.coords).norm() > BODY_REACH {
            return None;
        }
        let holds = |(link, world_from_link): (usize, &nalgebra::Isometry3<f64>)| {
            let at = world_from_link.inverse_transform_point(point);
            truth.actor.links[link].solids.iter().any(|solid| is_inside(solid, at)).then_some(link)
        };
        frame.link_frames.0.iter().enumerate().find_map(holds)
    };
    parallel::map(truth.frames.len(), within).into_iter().enumerate().filter_map(|(i, link)| Some((i, link?))).collect()
}

/// Whether a solid holds a point of its link's frame; a mesh has no inside.
fn is_inside(solid: &Solid, origin: Point3<f64>) -> bool {
    let convex = !matches!(solid, Solid::Mesh { .. });
    convex && solid.ray_entry(&Ray { origin, direction: Vector3::z() }) == Some(0.0)
}

/// What a user should know of props and cameras: props that the actor enters, cameras inside a prop.
pub(crate) fn doubts(staged: &PreparedScene) -> Vec<String> {
    let truth = &staged.ground_truth;
    let looked_at = frames_to_look_at(staged.frames(), FRAMES_LOOKED_AT);
    let frames: Vec<LinkFrames> = looked_at.iter().map(|frame| truth.frames[*frame].link_frames.clone()).collect();
    let contacts = PropContacts::from_frames(
        &truth.actor,
        &truth.props,
        &frames,
        truth.frames_per_second,
        &ContactRule::default(),
    );
    let tracks = contacts.map(|contacts| contacts.tracks).unwrap_or_default();
    let mut doubts = Vec::new();
    for (index, prop) in truth.props.iter().enumerate() {
        let deepest = |frame: usize| {
            let of_prop = tracks.iter().filter(|track| track.prop == index);
            of_prop.map(|track| track.frames[frame].penetration_m()).fold(0.0, f64::max)
        };
        let depths: Vec<f64> = (0..frames.len()).map(deepest).collect();
        let entered = depths.iter().filter(|depth| **depth > PROP_DEPTH_TOLD).count();
        if entered > 0 {
            doubts.push(format!(
                "the actor is inside the prop `{}` by up to {:.0} mm, by more than {:.0} mm in {entered} of {} checked \
                frames",
                prop.name,
                1000.0 * depths.iter().copied().fold(0.0, f64::max),
                1000.0 * PROP_DEPTH_TOLD,
                frames.len(),
            ));
        }
        for (index, camera) in staged.rig.rig().cameras.iter().enumerate() {
            let at = |time_s| is_inside(&prop.solid, staged.rig.camera_at(index, time_s).centre());
            let seconds = truth.frames.iter().map(|frame| staged.rig.row_s(index, frame.time_s, 0));
            let inside = match staged.rig.path(index) {
                None => at(0.0).then(|| "and sees nothing else".to_owned()),
                Some(_) => Some(seconds.filter(|time_s| at(*time_s)).count())
                    .filter(|count| *count > 0)
                    .map(|count| format!("in {count} of {} frames", truth.frames.len())),
            };
            let told = |how: String| format!("the camera `{}` is inside the prop `{}` {how}", camera.name, prop.name);
            doubts.extend(inside.map(told));
        }
    }
    doubts
}

/// How every camera sees the actor.
pub(crate) fn views(staged: &PreparedScene) -> Vec<CameraView> {
    let observer = Observer::new(&staged.ground_truth, &staged.rig);
    let pixels = |camera: &Camera| camera.pinhole.width as usize * camera.pinhole.height as usize;
    let a_frame = staged.rig.rig().cameras.iter().map(pixels).sum::<usize>().max(1);
    let frames =
        frames_to_look_at(staged.frames(), (PIXELS_LOOKED_AT / a_frame).clamp(FEWEST_LOOKED_AT, FRAMES_LOOKED_AT));
    let seen: Vec<Observation> = parallel::map(frames.len(), |i| observer.observe(frames[i]));
    let view = |(index, camera): (usize, &Camera)| {
        let taken = seen.iter().filter(|observation| observation.has_image(index));
        let looked_at = taken.clone().count();
        let bounds: Vec<_> = taken.map(|o| o.silhouettes[index].bounds()).filter(|b| !b.is_empty()).collect();
        let (width, height) = (camera.pinhole.width, camera.pinhole.height);
        let at_border = bounds.iter().filter(|b| b.left == 0 || b.top == 0 || b.right == width || b.bottom == height);
        let mut heights: Vec<u32> = bounds.iter().map(|b| b.bottom - b.top).collect();
        heights.sort_unstable();
        let share = |count: usize| count as f64 / looked_at.max(1) as f64;
        CameraView {
            camera: camera.name.clone(),
            frames_looked_at: looked_at,
            in_view: share(bounds.len()),
            at_border: share(at_border.count()),
            height_px: heights.first().zip(heights.last()).map(|(low, high)| [*low, heights[heights.len() / 2], *high]),
        }
    };
    staged.rig.rig().cameras.iter().enumerate().map(view).collect()
}

/// What `run` refuses once it has drawn everything: not a pixel of the actor in any frame of any camera.
pub(crate) fn unseen(file: &ScenarioFile, staged: &PreparedScene, views: &[CameraView]) -> Option<ExperimentError> {
    if views.iter().any(|view| view.height_px.is_some()) {
        return None;
    }
    let observer = Observer::new(&staged.ground_truth, &staged.rig);
    let is_seen = |frame: &usize| observer.observe(*frame).silhouettes.iter().any(|silhouette| !silhouette.is_empty());
    (0..staged.frames()).find(is_seen).is_none().then(|| unseen_in(file, staged.frames()))
}

/// The error that no camera sees the actor in any of so many frames.
pub(crate) fn unseen_in(file: &ScenarioFile, frames: usize) -> ExperimentError {
    let message = format!(
        "expected a camera that sees the subject, found no pixel of it in {frames} frames; props hide it or the cameras \
        are too far away"
    );
    scenario_error(file, "rig", message)
}

/// At most `most` set frames at equal distances, the first and the last among them.
fn frames_to_look_at(frames: usize, most: usize) -> Vec<usize> {
    let count = frames.min(most);
    (0..count).map(|i| if count < 2 { 0 } else { i * (frames - 1) / (count - 1) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_are_looked_at_begin_with_the_first_and_end_with_the_last() {
        assert_eq!(frames_to_look_at(0, 120), Vec::<usize>::new());
        assert_eq!(frames_to_look_at(1, 120), [0]);
        assert_eq!(frames_to_look_at(4, 120), [0, 1, 2, 3]);
        assert_eq!(frames_to_look_at(11, 3), [0, 5, 10]);
        let many = frames_to_look_at(1001, 120);
        assert_eq!((many.len(), many[0], many[119]), (120, 0, 1000));
        assert!(many.windows(2).all(|pair| (8..=9).contains(&(pair[1] - pair[0]))));
    }

    #[test]
    fn a_point_is_inside_a_solid_that_holds_it() {
        let place = nalgebra::Isometry3::translation(1.0, 0.0, 0.0);
        let solid = Solid::Box { link_from_box: place, half_extents: [0.1, 0.1, 0.1] };
        assert!(is_inside(&solid, Point3::new(1.05, 0.0, -0.05)));
        assert!(!is_inside(&solid, Point3::new(1.0, 0.0, -0.2)), "below, and the ray upwards meets it");
    }
}
