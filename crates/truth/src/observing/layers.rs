//! Exact images of every frame beside the masks: depth, parts, normals, flow, coverage, brightness.

use nalgebra::Point3;

use super::{ImageSettings, Observer, SceneCamera};
use crate::body::{DepthImage, LinkFrames, SurfacePixel};
use crate::camera::{Camera, TimedRig};
use crate::rng::KeyedSeed;
use crate::scene::{GroundTruth, SceneFigure};

/// Samples a pixel's side is divided into for coverage.
const SAMPLES: u32 = 4;

/// Which images are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WantedLayers {
    /// Depth and parts; drawn for normals and flow, too.
    pub depth: bool,
    /// Surface normals.
    pub normals: bool,
    /// Optical flow to the camera's next image.
    pub flow: bool,
    /// Anti-aliased coverage.
    pub coverage: bool,
    /// Brightness of the scene before the sensor, with its looks and their seed.
    pub colour: Option<(ImageSettings, KeyedSeed)>,
}

/// The exact images of one camera and frame, row by row. Images that were not wanted are empty.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerImages {
    /// Depth and part at every pixel's centre, without what props hide. Its size is there in any case.
    pub depth: DepthImage,
    /// Outward unit normal of the surface in the world; zero where there is no body.
    pub normals: Vec<[f32; 3]>,
    /// Where the surface point that a pixel's centre sees is seen in the camera's next image (of the next frame, unless
    /// the camera takes fewer), less where it is seen now, pixels (x right, y down; lens included), whether or not it
    /// is hidden then; a point of a skin moves with the skin. NaN where there is no body, in the last image, and where
    /// the point is then before the near plane.
    pub flow: Vec<[f32; 2]>,
    /// Share of 4 x 4 samples of a pixel that see the body, samples at the centres of its sixteenths.
    pub coverage: Vec<f32>,
    /// Red, green and blue, 0 to 1: brightness before gain, offset and noise; one plane if the images are grey.
    pub colour: Vec<Vec<f32>>,
}

/// Sees the exact images of one camera of a rig, from any thread.
pub struct LayerObserver<'a> {
    truth: &'a GroundTruth,
    wanted: WantedLayers,
    /// Of the camera alone.
    observer: Observer<'a>,
    /// The same camera with 4 x 4 pixels for each.
    fine: Option<Observer<'a>>,
    scene: Option<SceneCamera<'a>>,
}

impl<'a> LayerObserver<'a> {
    /// An observer through camera `index` of a rig, which the rig must have. Flow and coverage are those of a shutter
    /// that exposes all rows at once, brightness of a rig that stands still.
    pub fn new(truth: &'a GroundTruth, rig: impl Into<TimedRig>, index: usize, wanted: WantedLayers) -> Self {
        let filming = rig.into();
        let rig = filming.rig();
        let alone = |camera: Camera| filming.alone(index, camera);
        let scene = wanted.colour.map(|(settings, seed)| SceneCamera::from_one(truth, rig, index, &settings, seed));
        let camera = &rig.cameras[index];
        let fine = wanted.coverage.then(|| Observer::new(truth, alone(magnified(camera))));
        Self { truth, wanted, observer: Observer::new(truth, alone(camera.clone())), fine, scene }
    }

    /// The images of one frame, which the truth must have; `None` where the camera takes none.
    pub fn look(&self, frame: usize) -> Option<LayerImages> {
        let on_surface = self.wanted.normals || self.wanted.flow;
        let depth = match self.wanted.depth || on_surface {
            true => self.observer.depths(frame).remove(0)?,
            false => self.nothing(frame)?,
        };
        let surface = match on_surface {
            true => self.observer.surfaces(SceneFigure::Actor, frame).remove(0),
            false => Vec::new(),
        };
        let mut layers = LayerImages::from(depth);
        let width = layers.depth.width as usize;
        let shown: Vec<(usize, &SurfacePixel)> = surface
            .iter()
            .map(|pixel| (pixel.y as usize * width + pixel.x as usize, pixel))
            .filter(|(index, _)| layers.depth.part[*index] > 0)
            .collect();
        let pixels = width * layers.depth.height as usize;
        if self.wanted.normals {
            layers.normals = vec![[0.0; 3]; pixels];
            for (index, pixel) in &shown {
                layers.normals[*index] = pixel.normal_in_world.map(|c| c as f32).into();
            }
        }
        if self.wanted.flow {
            layers.flow = vec![[f32::NAN; 2]; pixels];
            let next = self.next(frame);
            for (index, pixel) in &shown {
                let flow = next.as_ref().and_then(|next| self.flow(pixel, next));
                layers.flow[*index] = flow.unwrap_or([f32::NAN; 2]);
            }
        }
        if let Some(fine) = &self.fine {
            layers.coverage = coverage(&fine.observe(frame).silhouettes[0], &layers.depth);
        }
        if let Some(scene) = &self.scene {
            let mut planes = scene.brightness(frame).remove(0);
            planes.iter_mut().flatten().for_each(|value| *value /= 255.0);
            layers.colour = planes;
        }
        Some(layers)
    }

    /// An image without pixels; `None` where the camera takes none.
    fn nothing(&self, frame: usize) -> Option<DepthImage> {
        let filming = self.observer.filming();
        let pinhole = &filming.rig().cameras[0].pinhole;
        let (width, height) = (pinhole.width, pinhole.height);
        filming.has_image(0, frame).then(|| DepthImage { width, height, depth: Vec::new(), part: Vec::new() })
    }

    /// The body and the camera at the camera's next image.
    fn next(&self, frame: usize) -> Option<NextImage> {
        let filming = self.observer.filming();
        let next = frame + filming.timing(0).every;
        let time_s = filming.row_s(0, self.truth.frames.get(next)?.time_s, 0);
        let links = self.observer.clock().links(SceneFigure::Actor, next, time_s);
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

/// Where the camera, the links and the vertices of a skin are when an image is taken, in the world.
struct NextImage {
    camera: Camera,
    links: LinkFrames,
    vertices: Vec<Point3<f64>>,
}

impl From<DepthImage> for LayerImages {
    fn from(depth: DepthImage) -> Self {
        Self { depth, normals: Vec::new(), flow: Vec::new(), coverage: Vec::new(), colour: Vec::new() }
    }
}

/// A camera whose image shows the same with 4 x 4 pixels for each.
fn magnified(camera: &Camera) -> Camera {
    let mut fine = camera.clone();
    let times = f64::from(SAMPLES);
    fine.pinhole.focal = camera.pinhole.focal.map(|f| f * times);
    fine.pinhole.principal_point = camera.pinhole.principal_point.map(|c| c * times);
    fine.pinhole.width *= SAMPLES;
    fine.pinhole.height *= SAMPLES;
    fine
}

fn coverage(fine: &crate::raster::Mask, image: &DepthImage) -> Vec<f32> {
    let width = image.width as usize;
    let mut counts = vec![0_u8; width * image.height as usize];
    for y in 0..fine.height() {
        for x in fine.runs(y).flatten() {
            counts[(y / SAMPLES) as usize * width + (x / SAMPLES) as usize] += 1;
        }
    }
    counts.into_iter().map(|count| f32::from(count) / (SAMPLES * SAMPLES) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Prop, Ray, Solid};
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use nalgebra::{Isometry3, Point2, Point3};

    const ALL: WantedLayers = WantedLayers { depth: true, normals: true, flow: true, coverage: true, colour: None };

    fn truth() -> GroundTruth {
        let solid = Solid::Box { link_from_box: Isometry3::translation(1.5, 0.1, 0.4), half_extents: [0.05, 0.2, 0.4] };
        let props = vec![Prop { name: "box".into(), solid }];
        GroundTruth::among(person(), &walk(4), &rig(), props, Vec::new()).unwrap()
    }

    /// The first solid that a ray meets: link, distance, by asking every solid.
    fn cast(truth: &GroundTruth, frame: usize, ray: &Ray) -> Option<(usize, f64)> {
        let hits = truth.actor.links.iter().zip(&truth.frames[frame].link_frames.0).enumerate();
        let hits = hits.flat_map(|(link, (body, world_from_link))| {
            let ray = ray.transformed(&world_from_link.inverse());
            body.solids.iter().filter_map(move |solid| Some((link, solid.ray_entry(&ray)?)))
        });
        let (link, s) = hits.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let hidden = truth.props.iter().any(|prop| prop.solid.ray_entry(ray).is_some_and(|prop| prop < s));
        (!hidden).then_some((link, s))
    }

    fn ray(camera: &Camera, x: f64, y: f64) -> Option<Ray> {
        Some(Ray { origin: camera.centre(), direction: camera.ray_through(&Point2::new(x, y))?.into_inner() })
    }

    #[test]
    fn depth_parts_normals_and_flow_are_what_casting_rays_finds() {
        let (truth, frame) = (truth(), 1);
        for (index, camera) in rig().cameras.iter().enumerate() {
            let layers = LayerObserver::new(&truth, &rig(), index, ALL).look(frame).unwrap();
            let (mut seen, mut differing) = (0, 0);
            for (y, x) in (0..240).flat_map(|y| (0..320).map(move |x| (y, x))).step_by(3) {
                let pixel = y * 320 + x;
                let (u, v) = (x as f64 + 0.5, y as f64 + 0.5);
                let hit = ray(camera, u, v).and_then(|ray| Some((cast(&truth, frame, &ray)?, ray)));
                let Some(((link, s), ray)) = hit else {
                    differing += usize::from(layers.depth.part[pixel] > 0);
                    continue;
                };
                if layers.depth.part[pixel] as usize != link + 1 {
                    differing += 1;
                    continue;
                }
                seen += 1;
                let point = ray.origin + ray.direction * s;
                let depth = (camera.camera_from_world * point).z;
                assert!((f64::from(layers.depth.depth[pixel]) - depth).abs() < 1e-5);
                // the normal: across two neighbouring rays that meet the same link
                let near = |du: f64, dv: f64| {
                    let ray = self::ray(camera, u + du, v + dv)?;
                    let (other, s) = cast(&truth, frame, &ray)?;
                    (other == link).then(|| ray.origin + ray.direction * s)
                };
                if let (Some(a), Some(b), Some(c), Some(d)) =
                    (near(1e-3, 0.0), near(-1e-3, 0.0), near(0.0, 1e-3), near(0.0, -1e-3))
                {
                    let normal = (a - b).cross(&(c - d)).normalize();
                    let found = nalgebra::Vector3::from(layers.normals[pixel]).cast::<f64>();
                    let grazing = normal.dot(&ray.direction).abs() < 0.05;
                    let angle = found.dot(&normal).abs().clamp(0.0, 1.0).acos().to_degrees();
                    assert!(grazing || angle < 0.5, "{angle} degrees at {x}, {y}");
                }
                // the flow: the same point of the link a frame later
                let in_link = truth.frames[frame].link_frames[link].inverse() * point;
                let then = camera.project(&(truth.frames[frame + 1].link_frames[link] * in_link)).unwrap();
                let [du, dv] = layers.flow[pixel].map(f64::from);
                assert!((du - (then.x - u)).abs() < 1e-3 && (dv - (then.y - v)).abs() < 1e-3);
            }
            assert!(seen > 300, "{seen}");
            assert!(differing <= 3, "{differing} pixels on outlines, up to rounding");
        }
    }

    #[test]
    fn coverage_is_the_share_of_sixteen_rays_and_the_last_frame_has_no_flow() {
        let truth = truth();
        let camera = &rig().cameras[1];
        let layers = LayerObserver::new(&truth, &rig(), 1, ALL).look(3).unwrap();
        let (mut partly, mut differing) = (0, 0);
        for (y, x) in (60..200).flat_map(|y| (0..320).map(move |x| (y, x))).step_by(5) {
            let found = layers.coverage[y * 320 + x];
            partly += usize::from(found > 0.0 && found < 1.0);
            let at = |i: usize| (i as f64 + 0.5) / 4.0;
            let samples = (0..4).flat_map(|j| (0..4).map(move |i| (x as f64 + at(i), y as f64 + at(j))));
            let hits = samples.filter(|(u, v)| ray(camera, *u, *v).is_some_and(|ray| cast(&truth, 3, &ray).is_some()));
            differing += usize::from((hits.count() as f32 / 16.0 - found).abs() > 0.07);
        }
        assert!(partly > 30, "{partly}");
        assert!(differing <= 1, "{differing}");
        assert!(layers.flow.iter().all(|flow| flow[0].is_nan()));
        let origin = Point3::origin();
        assert!(camera.project(&origin).is_some());
    }
}
