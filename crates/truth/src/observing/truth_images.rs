//! Exact per-pixel truth images of every frame besides masks: depth, parts, normals, flow, coverage, brightness.

use nalgebra::Point3;

use super::{ImageSettings, Observer, SceneCamera};
use crate::scene::{GroundTruth, SceneFigure};
use skiagraph_core::body::{DepthImage, LinkFrames, SurfacePixel};
use skiagraph_core::camera::{Camera, TimedRig};
use skiagraph_core::rng::KeyedSeed;

/// Samples per pixel side for coverage.
const SAMPLES: u32 = 4;

/// The requested truth images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WantedTruthImages {
    /// Depth and parts; also rendered for normals and flow.
    pub depth: bool,
    /// Surface normals.
    pub normals: bool,
    /// Optical flow to the camera's next image.
    pub flow: bool,
    /// Anti-aliased coverage.
    pub coverage: bool,
    /// Brightness of the scene before the sensor, with appearance settings and their seed.
    pub colour: Option<(ImageSettings, KeyedSeed)>,
}

/// The exact images of one camera and frame, row by row. Images that were not requested are empty.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthImages {
    /// Depth and part at every pixel's centre, without what props hide. Its size is always set.
    pub depth: DepthImage,
    /// Outward unit normal of the surface in the world; zero outside the body.
    pub normals: Vec<[f32; 3]>,
    /// Displacement of the surface point at a pixel's centre to its position in the camera's next image (of the next
    /// frame, unless the camera takes fewer), pixels (x right, y down, lens distortion included), whether or not it is
    /// hidden there; a point on a skin moves with the skin. NaN outside the body, in the last image, and if the point
    /// is then in front of the near plane.
    pub flow: Vec<[f32; 2]>,
    /// Share of 4 x 4 regularly spaced samples per pixel that see the body.
    pub coverage: Vec<f32>,
    /// Red, green and blue, 0 to 1: brightness before gain, offset and noise; one plane if the images are grey.
    pub colour: Vec<Vec<f32>>,
}

/// Renders the exact images of one camera of a rig, from any thread.
pub struct TruthImageObserver<'a> {
    truth: &'a GroundTruth,
    wanted: WantedTruthImages,
    /// Observer of this camera only.
    observer: Observer<'a>,
    /// The same camera with 4 x 4 pixels per pixel.
    fine: Option<Observer<'a>>,
    scene: Option<SceneCamera<'a>>,
}

impl<'a> TruthImageObserver<'a> {
    /// An observer of camera `index`, which must exist in the rig. Flow and coverage require a global shutter,
    /// brightness requires a rig that does not move.
    pub fn new(truth: &'a GroundTruth, rig: impl Into<TimedRig>, index: usize, wanted: WantedTruthImages) -> Self {
        let filming = rig.into();
        let rig = filming.rig();
        let alone = |camera: Camera| filming.alone(index, camera);
        let scene = wanted.colour.map(|(settings, seed)| SceneCamera::from_one(truth, rig, index, &settings, seed));
        let camera = &rig.cameras[index];
        let fine = wanted.coverage.then(|| Observer::new(truth, alone(magnified(camera))));
        Self { truth, wanted, observer: Observer::new(truth, alone(camera.clone())), fine, scene }
    }

    /// The truth images of one frame, which must exist in the truth; `None` if the camera takes no image.
    pub fn look(&self, frame: usize) -> Option<TruthImages> {
        let on_surface = self.wanted.normals || self.wanted.flow;
        let depth = if self.wanted.depth || on_surface {
            self.observer.depths(frame).remove(0)?
        } else {
            self.empty_image(frame)?
        };
        let surface =
            if on_surface { self.observer.surfaces(SceneFigure::Actor, |_| frame).remove(0) } else { Vec::new() };
        let mut images = TruthImages::from(depth);
        let width = images.depth.width as usize;
        let shown: Vec<(usize, &SurfacePixel)> = surface
            .iter()
            .map(|pixel| (pixel.y as usize * width + pixel.x as usize, pixel))
            .filter(|(index, _)| images.depth.part[*index] > 0)
            .collect();
        let pixels = width * images.depth.height as usize;
        if self.wanted.normals {
            images.normals = vec![[0.0; 3]; pixels];
            for (index, pixel) in &shown {
                images.normals[*index] = pixel.normal_in_world.map(|c| c as f32).into();
            }
        }
        if self.wanted.flow {
            images.flow = vec![[f32::NAN; 2]; pixels];
            let next = self.next(frame);
            for (index, pixel) in &shown {
                let flow = next.as_ref().and_then(|next| self.flow(pixel, next));
                images.flow[*index] = flow.unwrap_or([f32::NAN; 2]);
            }
        }
        if let Some(fine) = &self.fine {
            images.coverage = coverage(&fine.observe(frame).silhouettes[0], &images.depth);
        }
        if let Some(scene) = &self.scene {
            let mut planes = scene.brightness(frame).remove(0);
            planes.iter_mut().flatten().for_each(|value| *value /= 255.0);
            images.colour = planes;
        }
        Some(images)
    }

    /// A depth image without pixels; `None` if the camera takes no image.
    fn empty_image(&self, frame: usize) -> Option<DepthImage> {
        let filming = &self.observer.filming;
        let pinhole = &filming.rig().cameras[0].pinhole;
        let (width, height) = (pinhole.width, pinhole.height);
        filming.has_image(0, frame).then(|| DepthImage { width, height, depth: Vec::new(), part: Vec::new() })
    }

    /// The body and the camera at the time of the camera's next image.
    fn next(&self, frame: usize) -> Option<NextImage> {
        let filming = &self.observer.filming;
        let next = frame + filming.timing(0).every;
        let time_s = filming.row_s(0, self.truth.frames.get(next)?.time_s, 0);
        let links = self.observer.clock.links(SceneFigure::Actor, next, time_s);
        let mut vertices = Vec::new();
        if let Some(skin) = &self.truth.actor.skin {
            skin.deform_into(&links, &mut vertices);
        }
        Some(NextImage { camera: filming.camera_at(0, time_s), links, vertices })
    }

    fn flow(&self, pixel: &SurfacePixel, next: &NextImage) -> Option<[f32; 2]> {
        let point = match (pixel.on_skin, &self.truth.actor.skin) {
            (Some(on_skin), Some(skin)) => on_skin.at(skin, &next.vertices)?,
            _ => next.links[pixel.part] * pixel.point_in_link,
        };
        let then = next.camera.project(&point)?;
        Some([(then.x - f64::from(pixel.x) - 0.5) as f32, (then.y - f64::from(pixel.y) - 0.5) as f32])
    }
}

/// The camera, the links and the vertices of a skin at the time of an image, in the world.
struct NextImage {
    camera: Camera,
    links: LinkFrames,
    vertices: Vec<Point3<f64>>,
}

impl From<DepthImage> for TruthImages {
    fn from(depth: DepthImage) -> Self {
        Self { depth, normals: Vec::new(), flow: Vec::new(), coverage: Vec::new(), colour: Vec::new() }
    }
}

/// The camera with 4 x 4 pixels per pixel.
fn magnified(camera: &Camera) -> Camera {
    let mut fine = camera.clone();
    let times = f64::from(SAMPLES);
    fine.pinhole.focal = camera.pinhole.focal.map(|f| f * times);
    fine.pinhole.principal_point = camera.pinhole.principal_point.map(|c| c * times);
    fine.pinhole.width *= SAMPLES;
    fine.pinhole.height *= SAMPLES;
    fine
}

fn coverage(fine: &skiagraph_core::raster::Mask, image: &DepthImage) -> Vec<f32> {
    let width = image.width as usize;
    let mut counts = vec![0_u8; width * image.height as usize];
    for y in 0..fine.height() {
        for x in fine.runs(y).flatten() {
            counts[(y / SAMPLES) as usize * width + (x / SAMPLES) as usize] += 1;
        }
    }
    counts.into_iter().map(|count| f32::from(count) / (SAMPLES * SAMPLES) as f32).collect()
}
