//! The sun, and the shadow of a body on the ground.

use nalgebra::{Point2, Point3, Translation3, Vector3};

use skiagraph_core::body::{DepthImage, Humanoid, LinkFrames, SilhouettePainter};
use skiagraph_core::camera::{Camera, DEFAULT_NEAR, Distortion, Pinhole};
use skiagraph_core::raster::Mask;

use std::sync::{Mutex, PoisonError};

/// Elevation of the sun: shadows are as long as bodies are tall.
const ELEVATION: f64 = std::f64::consts::FRAC_PI_4;
/// Distance of the point below the ground where the sun's rays meet, metres: over a body, their directions differ by at
/// most a third of a degree.
const DISTANCE: f64 = 400.0;
/// Half the side of the rendered square around a body, metres, and its resolution.
const HALF_SIDE: f64 = 1.6;
const PIXELS_PER_METRE: f64 = 160.0;

/// The sun, which casts all shadows in one direction.
pub(crate) struct Sun {
    /// Below the ground, looking along the rays towards the sun, so that it sees the lowest part of a body that blocks
    /// a ray.
    camera: Camera,
    idle: Mutex<Vec<SilhouettePainter>>,
}

/// The shadow of a body on the ground, with the height of the part that casts it.
pub(crate) struct CastShadow<'a> {
    sun: &'a Sun,
    /// Translation from the world to the frame of the sun's image.
    shift: Vector3<f64>,
    image: DepthImage,
    /// The body in the sun's image: least and greatest distance from its middle, rightwards and downwards, metres.
    extent: [[f32; 2]; 2],
}

impl Sun {
    /// A sun in the direction of `azimuth`, radians from the world's X towards Y.
    pub(crate) fn new(azimuth: f64) -> Self {
        let (sin, cos) = libm::sincos(azimuth);
        let (up, along) = libm::sincos(ELEVATION);
        let towards = Vector3::new(cos * along, sin * along, up);
        let side = (2.0 * HALF_SIDE * PIXELS_PER_METRE) as u32;
        let right = Vector3::new(-sin, cos, 0.0);
        let down = towards.cross(&right);
        let rows = nalgebra::Matrix3::from_rows(&[right.transpose(), down.transpose(), towards.transpose()]);
        let rotation =
            nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(rows));
        let eye = Vector3::z() - towards * DISTANCE;
        let camera = Camera {
            name: "sun".to_owned(),
            pinhole: Pinhole {
                focal: [DISTANCE * PIXELS_PER_METRE; 2],
                principal_point: [0.5 * f64::from(side); 2],
                width: side,
                height: side,
                near: DEFAULT_NEAR,
            },
            distortion: Distortion::default(),
            camera_from_world: nalgebra::Isometry3::from_parts(Translation3::from(-(rotation * eye)), rotation),
        };
        Self { camera, idle: Mutex::default() }
    }

    /// Unit vector towards the sun.
    pub(crate) fn towards(&self) -> Vector3<f64> {
        self.camera.camera_from_world.inverse_transform_vector(&Vector3::z())
    }

    pub(crate) fn shadow_of(&self, body: &Humanoid, frames: &LinkFrames) -> CastShadow<'_> {
        let root = frames.0.first().map_or(Vector3::zeros(), |root| root.translation.vector);
        // the body is moved to the centre of the sun's image, whose camera is fixed
        let shift = Vector3::new(0.0, 0.0, 1.0) - root;
        let shifted = LinkFrames(frames.0.iter().map(|frame| Translation3::from(shift) * frame).collect());
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let ready = idle().pop();
        let mut painter = ready.unwrap_or_else(|| SilhouettePainter::new(&self.camera));
        let image = painter.depth(body, &shifted);
        idle().push(painter);
        let extent = extent_of(&image);
        CastShadow { sun: self, shift, image, extent }
    }
}

/// Columns and rows of the sun's image with a body, in metres from its middle; an empty range without a body.
fn extent_of(image: &DepthImage) -> [[f32; 2]; 2] {
    let mut extent = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
    let middle = 0.5 * f64::from(image.width);
    let mut widen = |axis: usize, pixel: usize| {
        let at = ((pixel as f64 + 0.5 - middle) / PIXELS_PER_METRE) as f32;
        extent[axis] = [extent[axis][0].min(at), extent[axis][1].max(at)];
    };
    for (y, row) in image.part.chunks_exact(image.width.max(1) as usize).enumerate() {
        // folding the whole row is faster than searching it
        if row.iter().fold(0, |any, part| any | part) > 0 {
            widen(1, y);
            row.iter().position(|part| *part > 0).into_iter().for_each(|x| widen(0, x));
            row.iter().rposition(|part| *part > 0).into_iter().for_each(|x| widen(0, x));
        }
    }
    extent
}

impl CastShadow<'_> {
    /// Position of the ray from a point on the ground to the sun in the sun's image, and the body's depth there.
    fn hit(&self, x: f64, y: f64) -> Option<(Point2<f64>, f32)> {
        let camera = &self.sun.camera;
        let pixel = camera.project(&(Point3::new(x, y, 0.0) + self.shift))?;
        if !camera.pinhole.contains(&pixel) {
            return None;
        }
        let depth = self.image.depth[pixel.y as usize * self.image.width as usize + pixel.x as usize];
        depth.is_finite().then_some((pixel, depth))
    }

    /// Height of the lowest part of the body that shades a point on the ground, metres; `None` outside the shadow.
    pub(crate) fn height_above(&self, x: f64, y: f64) -> Option<f64> {
        let camera = &self.sun.camera;
        let (pixel, depth) = self.hit(x, y)?;
        let (u, v) = camera.pinhole.normalised(&Point2::new(pixel.x, pixel.y));
        let in_camera = Point3::from(Vector3::new(u, v, 1.0) * f64::from(depth));
        Some((camera.camera_from_world.inverse_transform_point(&in_camera) - self.shift).z)
    }
}

/// Points on the ground seen by the pixels of a camera.
pub(crate) struct GroundPixels {
    width: u32,
    height: u32,
    /// World x and y, row by row; NaN for pixels that do not see the ground.
    points: Vec<[f32; 2]>,
}

impl GroundPixels {
    /// Ground points of `camera`, except where the props in `screen` hide the ground.
    pub(crate) fn new(camera: &Camera, screen: Option<&DepthImage>) -> Self {
        let (width, height) = (camera.pinhole.width, camera.pinhole.height);
        let centre = camera.centre();
        let mut points = Vec::with_capacity(width as usize * height as usize);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let direction = camera.ray_through(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            let seen = direction
                .filter(|ray| ray.z < 0.0 && centre.z > 0.0)
                .map(|ray| centre + ray.into_inner() * (centre.z / -ray.z));
            let is_hidden = |point: &Point3<f64>| {
                let depth = (camera.camera_from_world * point).z;
                screen.is_some_and(|screen| f64::from(screen.depth[points.len()]) < depth)
            };
            let point = seen.filter(|point| !is_hidden(point));
            points.push(point.map_or([f32::NAN; 2], |point| [point.x as f32, point.y as f32]));
        }
        Self { width, height, points }
    }

    /// The ground pixels in a shadow cast by parts at a height of at most `highest` metres.
    pub(crate) fn shadow(&self, shadow: &CastShadow<'_>, highest: f64) -> Mask {
        let mut mask = Mask::new(self.width, self.height);
        self.each_near(shadow, |index, x, y| {
            if shadow.height_above(x, y).is_some_and(|height| height <= highest) {
                mask.set(index as u32 % self.width, index as u32 / self.width, true);
            }
        });
        mask
    }

    /// Calls `visit` with the index, in row order, of every ground pixel in a shadow.
    pub(crate) fn each_shaded(&self, shadow: &CastShadow<'_>, mut visit: impl FnMut(usize)) {
        self.each_near(shadow, |index, x, y| {
            if shadow.hit(x, y).is_some() {
                visit(index);
            }
        });
    }

    /// Calls `visit` with the index and position of every ground pixel that a shadow may reach.
    fn each_near(&self, shadow: &CastShadow<'_>, mut visit: impl FnMut(usize, f64, f64)) {
        let axes = shadow.sun.camera.camera_from_world.rotation.inverse();
        let (right, down) = (axes * Vector3::x(), axes * Vector3::y());
        // from the centre of the rendered square, at a height of 1 m
        let middle = shadow.shift - Vector3::z();
        let offsets = [right.dot(&middle) as f32, down.dot(&middle) as f32];
        let [right, down] = [right, down].map(|axis| [axis.x as f32, axis.y as f32]);
        // slightly more than the body, for rays that are not quite parallel and for rounding
        let margin = 0.05 * HALF_SIDE as f32;
        let [across_body, along_body] = shadow.extent.map(|[low, high]| low - margin..high + margin);
        for (index, &[x, y]) in self.points.iter().enumerate() {
            let across = right[0] * x + right[1] * y + offsets[0];
            let along = down[0] * x + down[1] * y + offsets[1];
            if across_body.contains(&across) && along_body.contains(&along) {
                visit(index, f64::from(x), f64::from(y));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use skiagraph_core::body::{Ray, Solid};

    #[test]
    fn a_point_is_in_the_shadow_if_its_ray_to_the_sun_hits_the_body() {
        let body = person();
        let frames = body.link_frames(&walk(3).poses[2]);
        let sun = Sun::new(0.7);
        let shadow = sun.shadow_of(&body, &frames);
        let (mut in_shadow, mut differing) = (0, 0);
        for (i, j) in (0..80).flat_map(|i| (0..80).map(move |j| (i, j))) {
            let (x, y) = (f64::from(i) * 0.05 - 2.0, f64::from(j) * 0.05 - 2.0);
            let ray = Ray { origin: Point3::new(x, y, 0.0), direction: sun.towards() };
            let lowest = body.links.iter().zip(&frames.0).flat_map(|(link, frame)| {
                let ray = ray.transformed(&frame.inverse());
                link.solids.iter().filter_map(move |solid: &Solid| solid.ray_entry(&ray))
            });
            let expected = lowest.reduce(f64::min).map(|s| s * sun.towards().z);
            let found = shadow.height_above(x, y);
            in_shadow += usize::from(expected.is_some());
            match (expected, found) {
                (Some(a), Some(b)) if (a - b).abs() < 0.03 => {}
                (None, None) => {}
                _ => differing += 1,
            }
        }
        assert!(in_shadow > 100, "{in_shadow}");
        assert!(differing * 20 < in_shadow, "{differing} of {in_shadow}: more than pixels at the shadow's outline");
    }

    #[test]
    fn the_ground_of_a_pixel_projects_onto_the_pixel() {
        for camera in &rig().cameras {
            let ground = GroundPixels::new(camera, None);
            let mut seen = 0;
            for (index, [x, y]) in ground.points.iter().enumerate().filter(|(_, [x, _])| x.is_finite()) {
                let Some(pixel) = camera.project(&Point3::new(f64::from(*x), f64::from(*y), 0.0)) else { continue };
                let (u, v) = ((index % 320) as f64 + 0.5, (index / 320) as f64 + 0.5);
                // f32 has a relative precision of a millionth, and ground points may be far away
                assert!((pixel - Point2::new(u, v)).norm() < 1e-2, "{pixel}");
                seen += 1;
            }
            assert!(seen > 10_000, "{seen}");
        }
    }
}
