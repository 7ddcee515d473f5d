//! `truth/views.npz`: where every camera sees joints and markers, and whether it does, for T frames, C cameras, J
//! joints.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `joints_2d`, `markers_2d` | (T, C, J, 2), (T, C, 15, 2) | pixels, lens included, pixel centres at integers; NaN before the near plane |
//! | `joint_sight`, `marker_sight` | (T, C, J), (T, C, 15) | 0 in view, 1 hidden by the body, 2 hidden by a prop alone, 3 out of view |
//! | `sight_names` | (4) | the same in words |
//!
//! `joint_names`, `marker_names` and `camera_names` are those of `truth.npz`. A joint belongs to the links on both its
//! sides, a marker to its own: their geometry, and solids that hold the point, do not hide it. Everything else hides it
//! that the line from the point to the camera enters; of a body with a skin the skin does, not its solids.

use nalgebra::Point3;

use crate::body::LANDMARKS;
use crate::camera::CameraRig;
use crate::npz::{Array, Npz};
use crate::parallel;
use crate::scene::{GroundTruth, Occluders, Sight};

pub(super) const PATH: &str = "truth/views.npz";
/// Words for the sights 0 to 3.
pub(super) const NAMES: [&str; 4] = ["in_view", "self_occluded", "occluded", "out_of_view"];

/// Pixels and sights of one frame.
#[derive(Default)]
struct FrameViews {
    joints: Vec<f64>,
    joint_sights: Vec<i64>,
    markers: Vec<f64>,
    marker_sights: Vec<i64>,
}

/// The arrays, seen through the true cameras.
pub(super) fn to_npz(truth: &GroundTruth, rig: &CameraRig) -> Npz {
    let frames = parallel::map(truth.frames.len(), |frame| views_of(truth, rig, frame));
    let (count, cameras, joints) = (frames.len(), rig.cameras.len(), truth.actor.joints.len());
    let pixels = |points: usize, of: fn(&FrameViews) -> &Vec<f64>| {
        Array::new(
            &[count, cameras, points, 2],
            frames.iter().flat_map(|f| of(f).iter().copied()).collect::<Vec<f64>>(),
        )
    };
    let sights = |points: usize, of: fn(&FrameViews) -> &Vec<i64>| {
        Array::new(&[count, cameras, points], frames.iter().flat_map(|f| of(f).iter().copied()).collect::<Vec<i64>>())
    };
    Npz::from_iter([
        ("joints_2d", pixels(joints, |f| &f.joints)),
        ("joint_sight", sights(joints, |f| &f.joint_sights)),
        ("joint_names", Array::names(truth.actor.joints.iter().map(|j| j.name.as_str()))),
        ("markers_2d", pixels(LANDMARKS.len(), |f| &f.markers)),
        ("marker_sight", sights(LANDMARKS.len(), |f| &f.marker_sights)),
        ("marker_names", Array::names(LANDMARKS.map(|l| l.name()))),
        ("sight_names", Array::names(NAMES)),
        ("camera_names", Array::names(rig.cameras.iter().map(|c| c.name.as_str()))),
    ])
}

fn views_of(truth: &GroundTruth, rig: &CameraRig, frame: usize) -> FrameViews {
    let (actor, frame) = (&truth.actor, &truth.frames[frame]);
    let mut views = FrameViews::default();
    let occluders = Occluders::new(actor, &frame.link_frames, &truth.props);
    for camera in &rig.cameras {
        let lines = occluders.seen_by(camera);
        let pixel = |point: Option<&Point3<f64>>| match point.and_then(|point| camera.project(point)) {
            // files have pixel centres at integers
            Some(pixel) => [pixel.x - 0.5, pixel.y - 0.5],
            None => [f64::NAN; 2],
        };
        let sight = |point: &Point3<f64>, own: &[usize]| lines.to(point, own) as i64;
        for (index, point) in frame.joint_positions.iter().enumerate() {
            views.joints.extend(pixel(Some(point)));
            views.joint_sights.push(sight(point, &[actor.joints[index].parent, index + 1]));
        }
        for (marker, own) in frame.markers.iter().zip(&actor.markers) {
            views.markers.extend(pixel(marker.as_ref()));
            let seen = marker.as_ref().zip(*own).map(|(point, own)| sight(point, &[own.link]));
            views.marker_sights.push(seen.unwrap_or(Sight::OutOfView as i64));
        }
    }
    views
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};
    use crate::npz::Values;
    use crate::scene::fixture::rig;

    #[test]
    fn sights_and_pixels_stand_at_their_frame_camera_and_joint() {
        let truth = GroundTruth::from_motion(person(), &walk(3), &rig()).unwrap();
        let npz = to_npz(&truth, &rig());
        let joints = truth.actor.joints.len();
        let Values::F64(pixels) = &npz.get("joints_2d").unwrap().values else { panic!() };
        let Values::I64(sights) = &npz.get("marker_sight").unwrap().values else { panic!() };
        let (frame, camera, joint) = (2, 1, 1);
        let expected = rig().cameras[camera].project(&truth.frames[frame].joint_positions[joint]).unwrap();
        let at = ((frame * 3 + camera) * joints + joint) * 2;
        assert_eq!(pixels[at..at + 2], [expected.x - 0.5, expected.y - 0.5]);
        for (index, sight) in sights.iter().enumerate() {
            let (frame, camera, marker) = (index / 45, index / 15 % 3, index % 15);
            assert_eq!(*sight == 0, truth.frames[frame].visible[camera][marker]);
        }
    }
}
