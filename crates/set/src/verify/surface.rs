//! Compares normals, flow, coverage and brightness of truth images with newly rendered ones.

use nalgebra::Vector3;

use crate::camera::Camera;
use crate::exr_layers::LayerImage;
use crate::observing::LayerImages;

/// Channels of a layer.
pub(super) const NORMALS: [&str; 3] = ["normal.X", "normal.Y", "normal.Z"];
pub(super) const FLOW: [&str; 2] = ["forward.u", "forward.v"];
pub(super) const COVERAGE: [&str; 1] = ["A"];
pub(super) const COLOUR: [&str; 3] = ["R", "G", "B"];
pub(super) const GREY: [&str; 1] = ["Y"];

/// Number of pixels that may differ: the numbers of cameras are rounded once in `cameras.json`, which can change pixels
/// on an outline.
const TOLERANCE_PX: usize = 2;

/// Tolerances: component of a unit vector; flow in pixels plus a share of it, for single precision; half of one of a
/// pixel's 16 samples; a quarter of a grey value, for half precision.
const NORMAL: f32 = 1e-4;
const FLOW_PX: f32 = 1e-4;
const FLOW_SHARE: f32 = 1e-6;
const SHARE: f32 = 1.0 / 32.0;
const BRIGHTNESS: f32 = 1e-3;

/// Faults of the geometry of an image whose size, depth and parts are right.
pub(super) fn faults(image: &LayerImage, expected: &LayerImages, camera: &Camera) -> Vec<String> {
    let mut faults = Vec::new();
    if !expected.normals.is_empty() {
        faults.extend(normals(image, &expected.normals, camera));
    }
    if !expected.flow.is_empty() {
        faults.extend(flow(image, &expected.flow));
    }
    if !expected.coverage.is_empty() {
        faults.extend(coverage(image, &expected.coverage));
    }
    faults
}

fn missing(name: &str) -> Option<String> {
    Some(format!("{name}: the channel is missing, but earlier images have it"))
}

/// Number of pixels that are off.
fn count(pixels: usize, is_off: impl Fn(usize) -> bool) -> usize {
    (0..pixels).filter(|pixel| is_off(*pixel)).count()
}

fn normals(image: &LayerImage, expected: &[[f32; 3]], camera: &Camera) -> Option<String> {
    let Some(found) = image.floats(NORMALS) else { return missing("normal.X, .Y, .Z") };
    let at = |pixel: usize| Vector3::from(found.map(|channel| channel[pixel]));
    let own = |pixel: usize| Vector3::from(expected[pixel]);
    let differs = |a: Vector3<f32>, b: Vector3<f32>| (a - b).amax() > NORMAL || a.iter().any(|c| c.is_nan());
    let all = |change: &dyn Fn(Vector3<f32>) -> Vector3<f32>| {
        count(expected.len(), |pixel| differs(at(pixel), change(own(pixel)))) <= TOLERANCE_PX
    };
    let wrong = count(expected.len(), |pixel| differs(at(pixel), own(pixel)));
    let in_camera = |normal: Vector3<f32>| (camera.camera_from_world.rotation * normal.cast::<f64>()).cast::<f32>();
    (wrong > TOLERANCE_PX).then(|| {
        let why = if all(&|normal| -normal) {
            "; they point inwards"
        } else if all(&in_camera) {
            "; they are in the camera's axes, not in the world's"
        } else if all(&|normal| if normal == Vector3::zeros() { normal } else { normal.add_scalar(1.0) * 0.5 }) {
            "; they are packed into 0 to 1"
        } else {
            ""
        };
        format!("normal: {wrong} of {} pixels differ from the normals of the body{why}", expected.len())
    })
}

fn flow(image: &LayerImage, expected: &[[f32; 2]]) -> Option<String> {
    let Some([u, v]) = image.floats(FLOW) else { return missing("forward.u, .v") };
    let differs = |found: [f32; 2], own: [f32; 2]| {
        let limit = |i: usize| FLOW_PX + FLOW_SHARE * own[i].abs();
        let off = |i: usize| found[i].is_nan() != own[i].is_nan() || (found[i] - own[i]).abs() > limit(i);
        off(0) || off(1)
    };
    let all = |change: &dyn Fn([f32; 2]) -> [f32; 2]| {
        count(expected.len(), |i| differs([u[i], v[i]], change(expected[i]))) <= TOLERANCE_PX
    };
    let wrong = count(expected.len(), |i| differs([u[i], v[i]], expected[i]));
    (wrong > TOLERANCE_PX).then(|| {
        let why = if all(&|[u, v]| [-u, -v]) {
            "; it has the opposite sign"
        } else if all(&|[u, v]| [v, u]) {
            "; u and v are swapped"
        } else if all(&|[u, v]| [u, -v]) {
            "; v points upwards"
        } else {
            ""
        };
        format!("forward: {wrong} of {} pixels differ from the flow of the surface{why}", expected.len())
    })
}

fn coverage(image: &LayerImage, expected: &[f32]) -> Option<String> {
    let Some([found]) = image.floats(COVERAGE) else { return missing("A") };
    let all = |change: &dyn Fn(f32) -> f32| {
        count(expected.len(), |i| (found[i] - change(expected[i])).abs() > SHARE || found[i].is_nan()) <= TOLERANCE_PX
    };
    let wrong = count(expected.len(), |i| (found[i] - expected[i]).abs() > SHARE || found[i].is_nan());
    (wrong > TOLERANCE_PX).then(|| {
        // outside its data window a file has 0, whatever its values mean
        let is_inverse =
            |i: usize| (found[i] == 0.0 && expected[i] == 0.0) || (found[i] + expected[i] - 1.0).abs() <= SHARE;
        let why = if count(expected.len(), |i| !is_inverse(i)) <= TOLERANCE_PX {
            "; it is that of the background"
        } else if all(&f32::ceil) || all(&f32::round) || all(&f32::floor) {
            "; it is not anti-aliased"
        } else {
            ""
        };
        format!("A: {wrong} of {} pixels differ from the coverage of the body{why}", expected.len())
    })
}

/// The fault of the brightness of an image, if brightness is expected.
pub(super) fn colour_fault(image: &LayerImage, expected: &[Vec<f32>]) -> Option<String> {
    if expected.is_empty() {
        return None;
    }
    let found: Option<Vec<&[f32]>> = match expected.len() {
        1 => image.floats(GREY).map(Vec::from),
        _ => image.floats(COLOUR).map(Vec::from),
    };
    let Some(found) = found else { return missing("R, G, B or Y") };
    let pixels = expected.first().map_or(0, Vec::len);
    let differs = |a: f32, b: f32| (a - b).abs() > BRIGHTNESS || a.is_nan();
    let off = |pixel: usize| found.iter().zip(expected).any(|(a, b)| differs(a[pixel], b[pixel]));
    let wrong = count(pixels, off);
    (wrong > TOLERANCE_PX).then(|| {
        let turned = |pixel: usize| found.iter().zip(expected.iter().rev()).any(|(a, b)| differs(a[pixel], b[pixel]));
        let wide = |pixel: usize| found.iter().zip(expected).any(|(a, b)| differs(a[pixel] / 255.0, b[pixel]));
        let why = if count(pixels, turned) <= TOLERANCE_PX {
            "; red and blue are swapped"
        } else if count(pixels, wide) <= TOLERANCE_PX {
            "; its maximum is 255 instead of 1"
        } else {
            ""
        };
        format!("R, G, B: {wrong} of {pixels} pixels differ from the brightness of the scene{why}")
    })
}
