//! The catalogue of faults: what goes wrong between cameras and trackers, each as a change of what trackers are given.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::{Camera, Distortion};
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::raster::Mask;
use skiagraph_set::BlindSet;

#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) frames: usize,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct KeypointImage {
    pub(super) layout: KeypointLayout,
    pub(super) camera: usize,
    /// Pixels.
    pub(super) width: f64,
}

type Found = [Option<FoundKeypoint>];

#[derive(Clone, Copy)]
pub(super) enum FaultChange {
    Camera(fn(usize, &mut Camera)),
    /// The camera and frame whose image, with its keypoints, is given instead of that of a camera and frame.
    Shown(fn(Extent, [usize; 2]) -> [usize; 2]),
    Silhouette(fn(&Mask) -> Mask),
    Keypoints(fn(KeypointImage, &mut Found)),
    Image(fn(&Mask) -> Mask, fn(KeypointImage, &mut Found)),
}

/// What a set must have for a fault.
#[derive(Clone, Copy)]
enum Needs {
    Nothing,
    Keypoints,
    MissingKeypoints,
    Lens,
    /// At least two cameras with images of one size.
    CamerasAlike,
}

#[derive(Clone, Copy)]
pub(super) struct CatalogueFault {
    pub(super) name: &'static str,
    /// What is wrong, in a few words.
    pub(super) what: &'static str,
    pub(super) change: FaultChange,
    needs: Needs,
}

const fn fault(name: &'static str, what: &'static str, change: FaultChange) -> CatalogueFault {
    let needs = match change {
        FaultChange::Keypoints(_) => Needs::Keypoints,
        _ => Needs::Nothing,
    };
    CatalogueFault { name, what, change, needs }
}

pub(super) static FAULTS: [CatalogueFault; 24] = [
    fault("focal-length", "all focal lengths are 10 % too long", FaultChange::Camera(longer_focus)),
    fault("lens-ignored", "the lens coefficients are 0", FaultChange::Camera(without_lens)).needing(Needs::Lens),
    fault("moved-camera", "the first camera was turned by 2 degrees later", FaultChange::Camera(turned)),
    fault("millimetres", "positions of cameras are in millimetres", FaultChange::Camera(in_millimetres)),
    fault("y-up", "the world of the cameras has Y up", FaultChange::Camera(y_up)),
    fault("axis-order", "y and z of cameras are exchanged", FaultChange::Camera(exchanged_axes)),
    fault("exchanged-cameras", "two cameras have each other's images", FaultChange::Shown(exchanged))
        .needing(Needs::CamerasAlike),
    fault("late-camera", "the first camera is one frame late", FaultChange::Shown(late)),
    fault("drifting-clock", "the first camera's clock is 2 % slow", FaultChange::Shown(drifting)),
    fault("frames-from-1", "frame numbers from 1 are read as from 0", FaultChange::Shown(from_one)),
    fault("resampled", "the rate of images is 20 % too low", FaultChange::Shown(resampled)),
    fault("duplicated-frames", "every fifth frame repeats the one before", FaultChange::Shown(duplicated)),
    fault("frozen-camera", "the first camera stops half way", FaultChange::Shown(frozen)),
    fault("mixed-takes", "the first camera shows another half of the take", FaultChange::Shown(mixed)),
    fault("other-person", "half way, a person elsewhere is seen instead", FaultChange::Shown(elsewhere)),
    fault("mirrored-floor", "the floor mirrors the person", FaultChange::Silhouette(with_reflection)),
    fault("mirrored-image", "images are mirrored", FaultChange::Image(mirrored, mirrored_points)),
    fault("transposed", "rows and columns are exchanged", FaultChange::Image(transposed, transposed_points)),
    fault("lost-detections", "nothing is found in any image", FaultChange::Image(emptied, lost)),
    fault("half-resolution", "keypoints are in pixels of half the size", FaultChange::Keypoints(halved)),
    fault("left-right", "left and right of the first camera are exchanged", FaultChange::Keypoints(sides)),
    fault("keypoint-order", "keypoints are in another order", FaultChange::Keypoints(reordered)),
    fault("confidence-inverted", "the confidence is 1 minus itself", FaultChange::Keypoints(inverted)),
    fault("nan-as-0", "missing keypoints are found at (0, 0)", FaultChange::Keypoints(zeroed))
        .needing(Needs::MissingKeypoints),
];

impl CatalogueFault {
    const fn needing(self, needs: Needs) -> Self {
        Self { needs, ..self }
    }

    /// Why a set cannot have this fault; `None` if it can.
    pub(super) fn obstacle(&self, set: &BlindSet) -> Option<&'static str> {
        let cameras = &set.rig.cameras;
        let found = || set.keypoints.iter().flat_map(|own| (0..set.frame_count).map(|frame| own.frame(frame)));
        let (holds, otherwise) = match self.needs {
            Needs::Nothing => (true, ""),
            Needs::Keypoints => (set.keypoints.is_some(), "the set has no keypoints"),
            Needs::MissingKeypoints => {
                (found().any(|frame| frame.views.iter().flatten().any(Option::is_none)), "no keypoint is missing")
            }
            Needs::Lens => {
                let has_lens = cameras.iter().any(|camera| camera.distortion != Distortion::default());
                (has_lens, "no camera has lens coefficients")
            }
            Needs::CamerasAlike => {
                let size = |camera: &Camera| (camera.pinhole.width, camera.pinhole.height);
                let alike = cameras.len() > 1 && size(&cameras[0]) == size(&cameras[1]);
                (alike, "there are no two cameras with images of one size")
            }
        };
        // an image that is shown too early or too late must exist
        let shows_the_same = |change: fn(Extent, [usize; 2]) -> [usize; 2]| {
            let extent = Extent { frames: set.frame_count };
            let images = (0..cameras.len()).flat_map(|camera| (0..set.frame_count).map(move |frame| [camera, frame]));
            images.into_iter().all(|image| change(extent, image) == image)
        };
        match self.change {
            _ if !holds => Some(otherwise),
            FaultChange::Shown(change) if shows_the_same(change) => Some("the recording is too short for it"),
            _ => None,
        }
    }
}

const FOCUS: f64 = 1.1;
const TURNED_RAD: f64 = 0.035;
/// Frames that a clock loses a frame: 2 %.
const DRIFT: usize = 50;

fn longer_focus(_: usize, camera: &mut Camera) {
    camera.pinhole.focal = camera.pinhole.focal.map(|f| FOCUS * f);
}

fn without_lens(_: usize, camera: &mut Camera) {
    camera.distortion = Distortion::default();
}

fn turned(number: usize, camera: &mut Camera) {
    if number == 0 {
        let turn = UnitQuaternion::from_scaled_axis(TURNED_RAD * Vector3::y());
        camera.camera_from_world = turn * camera.camera_from_world;
    }
}

fn in_millimetres(_: usize, camera: &mut Camera) {
    camera.camera_from_world.translation.vector *= 1000.0;
}

fn y_up(_: usize, camera: &mut Camera) {
    camera.camera_from_world *= UnitQuaternion::from_scaled_axis(std::f64::consts::FRAC_PI_2 * Vector3::x());
}

fn exchanged_axes(_: usize, camera: &mut Camera) {
    let centre = camera.centre();
    let rotation = camera.camera_from_world.rotation;
    let moved = rotation * Point3::new(centre.x, centre.z, centre.y);
    camera.camera_from_world.translation.vector = -moved.coords;
}

fn exchanged(_: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [if camera < 2 { 1 - camera } else { camera }, frame]
}

fn late(_: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, if camera == 0 { frame.saturating_sub(1) } else { frame }]
}

fn drifting(_: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, if camera == 0 { frame - frame / DRIFT } else { frame }]
}

fn from_one(_: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, frame + 1]
}

fn resampled(_: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, frame * 4 / 5]
}

fn duplicated(_: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, if frame % 5 == 4 { frame - 1 } else { frame }]
}

fn frozen(of: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, if camera == 0 { frame.min(of.frames / 2) } else { frame }]
}

fn mixed(of: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    [camera, if camera == 0 { (frame + of.frames / 2) % of.frames } else { frame }]
}

/// The person as they were half the take before: another walk, elsewhere.
fn elsewhere(of: Extent, [camera, frame]: [usize; 2]) -> [usize; 2] {
    let half = of.frames.div_ceil(2);
    [camera, if frame >= half { frame - half } else { frame }]
}

/// With its mirror image below its lowest row.
fn with_reflection(mask: &Mask) -> Mask {
    let Some(lowest) = mask.pixels().map(|(_, y)| y).max() else { return mask.clone() };
    let mirrored = |y: u32| (2 * u64::from(lowest) + 1).checked_sub(y.into()).and_then(|row| u32::try_from(row).ok());
    Mask::from_fn(mask.width(), mask.height(), |x, y| {
        if y <= lowest { mask.get(x, y) } else { mirrored(y).is_some_and(|row| mask.get(x, row)) }
    })
}

fn mirrored(mask: &Mask) -> Mask {
    Mask::from_fn(mask.width(), mask.height(), |x, y| mask.get(mask.width() - 1 - x, y))
}

fn mirrored_points(image: KeypointImage, found: &mut Found) {
    found.iter_mut().flatten().for_each(|point| point.pixel[0] = image.width - point.pixel[0]);
}

fn transposed(mask: &Mask) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    Mask::from_fn(width, height, |x, y| y < width && x < height && mask.get(y, x))
}

fn transposed_points(_: KeypointImage, found: &mut Found) {
    found.iter_mut().flatten().for_each(|point| point.pixel.reverse());
}

fn emptied(mask: &Mask) -> Mask {
    Mask::new(mask.width(), mask.height())
}

fn lost(_: KeypointImage, found: &mut Found) {
    found.fill(None);
}

fn halved(_: KeypointImage, found: &mut Found) {
    found.iter_mut().flatten().for_each(|point| point.pixel = point.pixel.map(|x| 0.5 * x));
}

fn sides(image: KeypointImage, found: &mut Found) {
    let before = found.to_vec();
    let mirrored = image.layout.mirrored();
    for (point, other) in found.iter_mut().zip(mirrored).filter(|_| image.camera == 0) {
        *point = before.get(other).copied().flatten();
    }
}

/// By one place, as when a name is left out.
fn reordered(_: KeypointImage, found: &mut Found) {
    found.rotate_left(1);
}

fn inverted(_: KeypointImage, found: &mut Found) {
    found.iter_mut().flatten().for_each(|point| point.confidence = 1.0 - point.confidence);
}

/// The centre of the first pixel, with full confidence.
fn zeroed(_: KeypointImage, found: &mut Found) {
    for point in found.iter_mut().filter(|point| point.is_none()) {
        *point = Some(FoundKeypoint { pixel: [0.5; 2], confidence: 1.0 });
    }
}
