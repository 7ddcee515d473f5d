//! `truth/views.npz`: pixels and visibility of joints and markers in every camera, for T frames, C cameras, J joints.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `joints_2d`, `markers_2d` | (T, C, J, 2), (T, C, 15, 2) | pixels, lens included, pixel centres at integers; NaN before the near plane, beyond the fold of a lens model, and without an image of the frame |
//! | `joint_sight`, `marker_sight` | (T, C, J), (T, C, 15) | 0 in view, 1 occluded by the body, 2 occluded only by a prop or a distractor, 3 out of view |
//! | `sight_names` | (4) | names of these values |
//!
//! Pixels and sights are those at the time of exposure; without an image of the frame the sight is 3. `joint_names`,
//! `marker_names` and `camera_names` are those of `truth.npz`. A joint belongs to its parent and child links, a marker
//! to its own link: the geometry of these links, and solids that contain the point, do not occlude it. Everything else
//! on the line from the point to the camera does. In a body with a skin the skin occludes and the solids do not.

use skiagraph_core::body::LANDMARKS;
use skiagraph_core::camera::TimedRig;
use skiagraph_core::npz::{Array, Npz};
use skiagraph_core::parallel;
use skiagraph_truth::scene::{GroundTruth, SceneClock, Shot, ShotPoint, Sight};

pub(crate) const PATH: &str = "truth/views.npz";
/// Names of the sights 0 to 3.
pub(crate) const NAMES: [&str; 4] = ["in_view", "self_occluded", "occluded", "out_of_view"];

/// Frames processed together.
///
/// Holding all frames twice would take most of the memory of a long set.
const FRAMES_AT_A_TIME: usize = 256;

/// Pixels and sights of the joints or of the markers of one frame, or of many one after another.
#[derive(Default)]
struct PointViews {
    pixels: Vec<f64>,
    sights: Vec<i64>,
}

impl PointViews {
    fn push(&mut self, shot: &mut Shot<'_>, camera: usize, point: Option<ShotPoint>) {
        let pixel = point.as_ref().and_then(|point| point.pixel);
        // pixel centres are at integers
        self.pixels.extend(pixel.map_or([f64::NAN; 2], |pixel| [pixel.x - 0.5, pixel.y - 0.5]));
        self.sights.push(point.map_or(Sight::OutOfView, |point| shot.sight(camera, &point)) as i64);
    }
}

/// The arrays, seen through the true cameras.
pub(crate) fn to_npz(truth: &GroundTruth, filming: &TimedRig) -> Npz {
    let rig = filming.rig();
    let clock = SceneClock::new(truth, filming);
    let (count, cameras, joints) = (truth.frames.len(), rig.cameras.len(), truth.actor.joints.len());
    let mut all = [joints, LANDMARKS.len()].map(|points| PointViews {
        pixels: Vec::with_capacity(count * cameras * points * 2),
        sights: Vec::with_capacity(count * cameras * points),
    });
    for first in (0..count).step_by(FRAMES_AT_A_TIME) {
        let here = FRAMES_AT_A_TIME.min(count - first);
        for views in parallel::map(here, |frame| views_of(&clock, filming, first + frame)) {
            for (all, own) in all.iter_mut().zip(views) {
                all.pixels.extend(own.pixels);
                all.sights.extend(own.sights);
            }
        }
    }
    let [of_joints, of_markers] = all;
    let pixels = |points: usize, values: Vec<f64>| Array::new(&[count, cameras, points, 2], values);
    let sights = |points: usize, values: Vec<i64>| Array::new(&[count, cameras, points], values);
    Npz::from_iter([
        ("joints_2d", pixels(joints, of_joints.pixels)),
        ("joint_sight", sights(joints, of_joints.sights)),
        ("joint_names", Array::names(truth.actor.joints.iter().map(|j| j.name.as_str()))),
        ("markers_2d", pixels(LANDMARKS.len(), of_markers.pixels)),
        ("marker_sight", sights(LANDMARKS.len(), of_markers.sights)),
        ("marker_names", Array::names(LANDMARKS.map(|l| l.name()))),
        ("sight_names", Array::names(NAMES)),
        ("camera_names", Array::names(rig.cameras.iter().map(|c| c.name.as_str()))),
    ])
}

fn views_of(clock: &SceneClock<'_>, rig: &TimedRig, frame: usize) -> [PointViews; 2] {
    let mut views = <[PointViews; 2]>::default();
    let mut shot = Shot::new(clock, rig, frame);
    for camera in 0..rig.cameras() {
        for joint in 0..clock.truth().actor.joints.len() {
            let seen = shot.joint(camera, joint);
            views[0].push(&mut shot, camera, seen);
        }
        for marker in 0..LANDMARKS.len() {
            let seen = shot.marker(camera, marker);
            views[1].push(&mut shot, camera, seen);
        }
    }
    views
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use skiagraph_core::npz::Values;

    #[test]
    fn sights_are_at_the_index_of_their_frame_camera_and_marker() {
        let truth = GroundTruth::from_motion(person(), &walk(3), &rig()).unwrap();
        let npz = to_npz(&truth, &TimedRig::from(&rig()));
        let Values::I64(sights) = &npz.get("marker_sight").unwrap().values else { panic!() };
        for (index, sight) in sights.iter().enumerate() {
            let (frame, camera, marker) = (index / 45, index / 15 % 3, index % 15);
            assert_eq!(*sight == 0, truth.frames[frame].visible[camera][marker]);
        }
    }
}
