//! One NumPy archive of the whole truth with the cameras, and a short reader.

use nalgebra::Point3;

use super::folder::Folder;
use crate::format::{truth_file, views_file};
use crate::{BenchmarkSet, RigMoments, SetError};
use skiagraph_core::body::LANDMARKS;
use skiagraph_core::camera::{Camera, CameraRig, TimedRig};
use skiagraph_core::npz::{Array, Npz};
use skiagraph_truth::scene::{GroundTruth, TruthFrame};

const README: &str = "\
truth.npz       all arrays of the set's truth/truth.npz; joints_2d (T, C, J, 2) and markers_2d (T, C, 15, 2), pixels, lens included, in
                the image or not, NaN before the near plane; and for the cameras: K (C, 3, 3), R (C, 3, 3), t (C, 3), distortion (C, 5:
                k1 k2 p1 p2 k3), image_size (C, 2: width, height); 64-bit floats, no pickles
read_truth.py   a reader of it: python3 read_truth.py .

Metres, radians, seconds. The world is right-handed, Z up, ground at z = 0. x_camera = R x_world + t, x right, y down, z forward;
pixel (0, 0) is the centre of the top-left pixel. Frame f is at time f / fps, and all arrays and images of one number belong to
that instant. If cameras move or have their own exposure times, there are also: frame_R (T, C, 3, 3) and frame_t (T, C, 3), the
cameras when the first row of their images was exposed (R and t are those of frame 0), exposed_s (T, C), when that was, NaN where
a camera took no image for the frame, and line_delay_s (C), the delay from row to row; joints_2d and markers_2d are then at the
exposure times of the true cameras, NaN without an image.";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(&set.blind, README)?;
    let (truth, rig) = (&set.truth, &set.blind.rig);
    let refitted = truth.refitted.as_ref().map(|motion| (&set.blind.start.body, motion));
    let mut npz = truth_file::to_npz(&truth.ground_truth, refitted, rig);
    let (joints, markers) = (truth.ground_truth.actor.joints.len(), LANDMARKS.len());
    let of_joints = |f: &TruthFrame| f.joint_positions.iter().copied().map(Some).collect();
    if truth.rig.is_still() {
        npz.push("joints_2d", pixels(&truth.ground_truth, rig, joints, of_joints));
        npz.push("markers_2d", pixels(&truth.ground_truth, rig, markers, |f| f.markers.to_vec()));
    }
    if let Some(moments) = &set.blind.moments {
        push_moments(&mut npz, &truth.ground_truth, moments, &truth.rig);
    }
    let cameras = rig.cameras.as_slice();
    let of = |shape: &[usize], numbers: &dyn Fn(&Camera) -> Vec<f64>| {
        Array::new(&[&[cameras.len()], shape].concat(), cameras.iter().flat_map(numbers).collect::<Vec<_>>())
    };
    npz.push("K", of(&[3, 3], &|camera| camera.opencv_matrix().as_flattened().to_vec()));
    npz.push("R", of(&[3, 3], &|camera| camera.opencv_rotation().as_flattened().to_vec()));
    npz.push("t", of(&[3], &|camera| camera.opencv_translation().to_vec()));
    npz.push("distortion", of(&[5], &|camera| camera.distortion.coefficients().to_vec()));
    let sizes = cameras.iter().flat_map(|camera| [camera.pinhole.width, camera.pinhole.height].map(i64::from));
    npz.push("image_size", Array::new(&[cameras.len(), 2], sizes.collect::<Vec<_>>()));
    folder.write("truth.npz", &npz.to_bytes("truth.npz")?)?;
    folder.write("read_truth.py", truth_file::READER.as_bytes())
}

/// The cameras of every frame, and the points at their time of exposure.
fn push_moments(npz: &mut Npz, truth: &GroundTruth, moments: &RigMoments, filming: &TimedRig) {
    let views = views_file::to_npz(truth, filming);
    for array in ["joints_2d", "markers_2d"] {
        if let Some(pixels) = views.get(array) {
            npz.push(array, pixels.clone());
        }
    }
    let (frames, cameras) = (moments.frames.len(), filming.cameras());
    let placed = || moments.frames.iter().flat_map(|moment| moment.camera_from_world.iter());
    let placed = || placed().map(|placement| filming.rig().cameras[0].placed(*placement));
    let rotations = placed().flat_map(|camera| camera.opencv_rotation()).flatten().collect::<Vec<_>>();
    npz.push("frame_R", Array::new(&[frames, cameras, 3, 3], rotations));
    let translations = placed().flat_map(|camera| camera.opencv_translation()).collect::<Vec<_>>();
    npz.push("frame_t", Array::new(&[frames, cameras, 3], translations));
    let times = moments.frames.iter().flat_map(|moment| &moment.exposed_s);
    let times = times.map(|time| time.unwrap_or(f64::NAN)).collect::<Vec<_>>();
    npz.push("exposed_s", Array::new(&[frames, cameras], times));
    npz.push("line_delay_s", Array::new(&[cameras], moments.line_delay_s.clone()));
}

/// Pixels of `points` points of every frame and camera.
fn pixels(
    truth: &GroundTruth,
    rig: &CameraRig,
    points: usize,
    of: impl Fn(&TruthFrame) -> Vec<Option<Point3<f64>>>,
) -> Array {
    let mut values = Vec::with_capacity(truth.frames.len() * rig.cameras.len() * points * 2);
    for frame in &truth.frames {
        let places = of(frame);
        for camera in &rig.cameras {
            let pixel = |place: &Option<Point3<f64>>| place.and_then(|place| camera.project(&place));
            values
                .extend(places.iter().flat_map(|place| pixel(place).map_or([f64::NAN; 2], |p| [p.x - 0.5, p.y - 0.5])));
        }
    }
    Array::new(&[truth.frames.len(), rig.cameras.len(), points, 2], values)
}
