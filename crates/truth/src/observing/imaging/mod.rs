//! Simulated camera images of the scene, from which the actor is segmented.
//!
//! The scene has ground at z = 0 with slabs, four walls behind the cameras, props, a clothed actor, ambient light and a
//! sun at 45 degrees elevation; the actor casts a shadow on the ground (not on walls, props or itself). A sensor adds
//! gain, offset and noise; gain and offset drift between three periods in which the background is recorded. Images may
//! be stored as JPEG. Edges are not blended: a pixel shows the colour at its centre. Brightness is computed in f32,
//! bit-identical for any number of threads.

mod colour;
mod jpeg;
mod looks;
mod segmented;
mod sensor;
mod settings;
mod texture;

pub use colour::ColourCamera;
pub use jpeg::decoded as image_from_jpeg;
pub use segmented::SegmentedObserver;
pub use settings::ImageSettings;

use nalgebra::{Point2, Point3, Vector3};
use rand::RngExt;

use crate::observing::light::{CastShadow, GroundPixels, Sun};
use crate::observing::{Image, Observer};
use crate::scene::{Distractor, GroundTruth, SceneFigure};
use looks::{Clothing, Rgb};
use sensor::{Exposure, Sensor};
use settings::PERIODS;
use skiagraph_core::body::{Humanoid, SurfacePixel};
use skiagraph_core::camera::{Camera, CameraRig, TimedRig};
use skiagraph_core::parallel;
use skiagraph_core::rng::{KeyedSeed, Purpose};
use texture::Textures;

/// Distance of the walls behind the farthest camera, metres.
const WALL_DISTANCE: f64 = 1.5;

/// Takes images of the scene, of any camera and frame, from any thread.
pub struct SceneCamera<'a> {
    truth: &'a GroundTruth,
    observer: Observer<'a>,
    settings: ImageSettings,
    backdrops: Vec<Backdrop>,
    clothing: Clothing,
    other_clothing: Vec<Clothing>,
    sensor: Sensor,
    sun: Sun,
}

/// The scene without figures in one camera.
struct Backdrop {
    width: u32,
    height: u32,
    /// Brightness by plane.
    planes: Vec<Vec<f32>>,
    ground: GroundPixels,
    /// Depths of props; empty without props.
    screen: Vec<f32>,
}

impl<'a> SceneCamera<'a> {
    /// Cameras of `rig`, which do not move, around the actor of `truth`; `seed` determines clothing, the sun's azimuth,
    /// drift and noise, and with a secret key also textures.
    pub fn new(
        truth: &'a GroundTruth,
        rig: impl Into<TimedRig>,
        settings: &ImageSettings,
        seed: impl Into<KeyedSeed>,
    ) -> Self {
        let rig = rig.into();
        let walls = wall_distance(rig.rig());
        Self::in_room(truth, rig, walls, settings, seed.into())
    }

    /// Like [`Self::new`] for camera `index` only; the scene is that of all cameras.
    pub(super) fn from_one(
        truth: &'a GroundTruth,
        rig: &CameraRig,
        index: usize,
        settings: &ImageSettings,
        seed: KeyedSeed,
    ) -> Self {
        let alone = CameraRig { cameras: vec![rig.cameras[index].clone()] };
        Self::in_room(truth, TimedRig::from(&alone), wall_distance(rig), settings, seed)
    }

    fn in_room(
        truth: &'a GroundTruth,
        filming: TimedRig,
        walls: f64,
        settings: &ImageSettings,
        seed: KeyedSeed,
    ) -> Self {
        let observer = Observer::new(truth, filming);
        let rig = observer.filming.rig();
        let azimuth = std::f64::consts::TAU * seed.stream(Purpose::Imaging, 0, 10, 0).random::<f64>();
        let (sun, textures) = (Sun::new(azimuth), Textures::new(seed));
        let props = observer.props_surface(&truth.props);
        let backdrop = |index: usize| {
            let screen = observer.screen(index).map(|screen| screen.depth.clone()).unwrap_or_default();
            let ground = GroundPixels::new(&rig.cameras[index], observer.screen(index));
            let props = props.get(index).map_or(&[][..], Vec::as_slice);
            Backdrop::new(&rig.cameras[index], (walls, textures), &sun, props, ground, screen)
        };
        let mut backdrops = parallel::map(rig.cameras.len(), backdrop);
        if settings.grey {
            backdrops.iter_mut().for_each(|backdrop| backdrop.planes = vec![to_grey(&backdrop.planes)]);
        }
        let clothing = Clothing::new(&truth.actor, settings, seed);
        // every figure has its own clothing; the actor's does not depend on the others
        let other = |(index, other): (u64, &Distractor)| {
            Clothing::new(&other.body, settings, seed.with_seed(seed.seed.wrapping_add(1_000_003 * (index + 1))))
        };
        let other_clothing = (0..).zip(&truth.distractors).map(other).collect();
        let sensor = Sensor::new(settings, seed);
        Self { truth, observer, settings: *settings, backdrops, clothing, other_clothing, sensor, sun }
    }

    /// A background image of a camera.
    pub fn background(&self, camera: usize, period: usize, number: usize) -> Image {
        let Backdrop { width, height, planes, .. } = &self.backdrops[camera];
        let exposure = Exposure::Background(period.min(PERIODS - 1), number);
        self.compressed(self.sensor.expose(*width, *height, planes, camera, exposure))
    }

    /// The images of one frame, which must exist in the truth, by camera.
    pub fn images(&self, frame: usize) -> Vec<Image> {
        let mut images = Vec::with_capacity(self.backdrops.len());
        self.each_image(frame, |_, image| images.push(image));
        images
    }

    /// Calls `take` with every camera's index and image of a frame, one at a time to save memory.
    pub fn each_image(&self, frame: usize, take: impl FnMut(usize, Image)) {
        self.each_shown_image(|_| frame, take);
    }

    /// As [`Self::each_image`], with the image of frame `shown(camera)` of every camera, without cameras that take no
    /// image in that frame.
    pub(super) fn each_shown_image(&self, shown: impl Fn(usize) -> usize, mut take: impl FnMut(usize, Image)) {
        self.each_brightness(&shown, |camera, planes| {
            let exposure = Exposure::Frame(shown(camera), self.truth.frames.len());
            let Backdrop { width, height, .. } = self.backdrops[camera];
            take(camera, self.compressed(self.sensor.expose(width, height, &planes, camera, exposure)));
        });
    }

    fn compressed(&self, image: Image) -> Image {
        match self.settings.jpeg_quality {
            None => image,
            Some(quality) => jpeg::compressed(image, quality),
        }
    }

    /// Brightness before the sensor in one frame, 0 to 255, by camera and plane.
    pub(super) fn brightness(&self, frame: usize) -> Vec<Vec<Vec<f32>>> {
        let mut all = Vec::with_capacity(self.backdrops.len());
        self.each_brightness(&|_| frame, |_, planes| all.push(planes));
        all
    }

    /// Calls `take` with every camera's index and planes in frame `shown(camera)`, one at a time, without cameras that
    /// take no image in that frame. The nearest figure is visible, and overlapping shadows darken once.
    fn each_brightness(&self, shown: &impl Fn(usize) -> usize, mut take: impl FnMut(usize, Vec<Vec<f32>>)) {
        let others = (0..self.truth.distractors.len()).map(SceneFigure::Distractor);
        let clothed = std::iter::once(&self.clothing).chain(&self.other_clothing);
        let figures = std::iter::once(SceneFigure::Actor).chain(others).zip(clothed);
        let figures: Vec<_> =
            figures.map(|(figure, clothing)| (self.observer.surfaces(figure, shown), clothing)).collect();
        let lit = looks::light(&Vector3::z(), &self.sun.towards(), true);
        let share = looks::light(&Vector3::z(), &self.sun.towards(), false) / lit;
        let mut cast: Option<(usize, f64, Vec<CastShadow<'_>>)> = None;
        for (camera, backdrop) in self.backdrops.iter().enumerate() {
            let frame = shown(camera);
            if !self.observer.filming.has_image(camera, frame) {
                continue;
            }
            let mut planes = backdrop.planes.clone();
            let pixels = backdrop.width as usize * backdrop.height as usize;
            let mut shaded = vec![false; pixels];
            // shadows of a rolling shutter are those of its first row
            let time_s = self.observer.filming.row_s(camera, self.truth.frames[frame].time_s, 0);
            let known = cast.take().filter(|(of_frame, of_s, _)| (*of_frame, *of_s) == (frame, time_s));
            let (_, _, shadows) = cast.insert(known.unwrap_or_else(|| (frame, time_s, self.shadows(frame, time_s))));
            for shadow in shadows.iter() {
                backdrop.ground.each_shaded(shadow, |index| {
                    if !std::mem::replace(&mut shaded[index], true) {
                        planes.iter_mut().for_each(|plane| plane[index] *= share);
                    }
                });
            }
            let mut nearest = vec![f32::INFINITY; pixels];
            for (surfaces, clothing) in &figures {
                for pixel in &surfaces[camera] {
                    let depth = &mut nearest[pixel.y as usize * backdrop.width as usize + pixel.x as usize];
                    if (pixel.depth as f32) < *depth {
                        *depth = pixel.depth as f32;
                        self.paint(pixel, backdrop, clothing, &mut planes);
                    }
                }
            }
            take(camera, planes);
        }
    }

    /// The shadows of all figures at `time_s`, close to a frame.
    fn shadows(&self, frame: usize, time_s: f64) -> Vec<CastShadow<'_>> {
        if !self.settings.shadow {
            return Vec::new();
        }
        let shadow = |body: &Humanoid, figure| {
            let links = self.observer.clock.links(figure, frame, time_s);
            (!links.0.is_empty()).then(|| self.sun.shadow_of(body, &links))
        };
        let others = self.truth.distractors.iter().enumerate();
        let others = others.map(|(other, figure)| shadow(&figure.body, SceneFigure::Distractor(other)));
        std::iter::once(shadow(&self.truth.actor, SceneFigure::Actor)).chain(others).flatten().collect()
    }

    fn paint(&self, pixel: &SurfacePixel, backdrop: &Backdrop, clothing: &Clothing, planes: &mut [Vec<f32>]) {
        let index = pixel.y as usize * backdrop.width as usize + pixel.x as usize;
        if backdrop.screen.get(index).is_some_and(|screen| *screen < pixel.depth as f32) {
            return;
        }
        let light = looks::light(&pixel.normal_in_world, &self.sun.towards(), true);
        let colour = clothing.at(pixel.part, &pixel.point_in_link).map(|c| (c * light).clamp(0.0, 255.0));
        match planes {
            [grey] => grey[index] = grey_value(colour),
            _ => planes.iter_mut().zip(colour).for_each(|(plane, value)| plane[index] = value),
        }
    }
}

/// Distance of the walls from the origin such that all cameras are inside, metres.
fn wall_distance(rig: &CameraRig) -> f64 {
    let reach = |camera: &Camera| camera.centre().coords.xy().amax();
    WALL_DISTANCE + rig.cameras.iter().map(reach).fold(0.0, f64::max)
}

impl Backdrop {
    fn new(
        camera: &Camera,
        (walls, textures): (f64, Textures),
        sun: &Sun,
        props: &[SurfacePixel],
        ground: GroundPixels,
        screen: Vec<f32>,
    ) -> Self {
        let (width, height, centre) = (camera.pinhole.width, camera.pinhole.height, camera.centre());
        let mut planes: Vec<Vec<f32>> = (0..3).map(|_| Vec::with_capacity(width as usize * height as usize)).collect();
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let ray = camera.ray_through(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            let colour = ray.map_or([0.0; 3], |ray| room(&centre, &ray, (walls, textures), &sun.towards()));
            planes.iter_mut().zip(colour).for_each(|(plane, value)| plane.push(value));
        }
        for pixel in props {
            let index = pixel.y as usize * width as usize + pixel.x as usize;
            let light = looks::light(&pixel.normal_in_world, &sun.towards(), true);
            let colour = looks::prop(textures, pixel.part, &pixel.point_in_link).map(|c| (c * light).clamp(0.0, 255.0));
            planes.iter_mut().zip(colour).for_each(|(plane, value)| plane[index] = value);
        }
        Self { width, height, planes, ground, screen }
    }
}

/// Brightness of the ground or wall first hit by a ray from inside the room.
fn room(centre: &Point3<f64>, ray: &Vector3<f64>, (walls, textures): (f64, Textures), sun: &Vector3<f64>) -> Rgb {
    let to_ground = if ray.z < 0.0 { centre.z / -ray.z } else { f64::INFINITY };
    let to_wall = |axis: usize| match ray[axis] {
        0.0 => f64::INFINITY,
        speed => (walls.copysign(speed) - centre[axis]) / speed,
    };
    let (axis, wall) = if to_wall(0) < to_wall(1) { (0, to_wall(0)) } else { (1, to_wall(1)) };
    let (colour, normal) = if to_ground < wall {
        let point = centre + ray * to_ground;
        (looks::ground(textures, point.x as f32, point.y as f32), Vector3::z())
    } else {
        let point = centre + ray * wall;
        let mut normal = Vector3::zeros();
        normal[axis] = -ray[axis].signum();
        (looks::wall(textures, &point, point[1 - axis]), normal)
    };
    let light = looks::light(&normal, sun, true);
    colour.map(|c| (c * light).clamp(0.0, 255.0))
}

/// Luma with the weights of ITU-R BT.601.
fn grey_value([red, green, blue]: Rgb) -> f32 {
    0.299 * red + 0.587 * green + 0.114 * blue
}

fn to_grey(planes: &[Vec<f32>]) -> Vec<f32> {
    (0..planes[0].len()).map(|index| grey_value([planes[0][index], planes[1][index], planes[2][index]])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observing::observe;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;

    fn truth() -> GroundTruth {
        GroundTruth::from_motion(person(), &walk(4), &rig()).unwrap()
    }

    pub(super) const QUIET: ImageSettings = ImageSettings {
        jpeg_quality: None,
        grey: false,
        clothing_contrast: 100.0,
        shadow: false,
        read_noise: 0.0,
        shot_noise: 0.0,
        gain_drift: 0.0,
        offset_drift: 0.0,
        background_frames: 2,
    };

    #[test]
    fn without_noise_and_shadow_images_differ_from_the_background_only_in_the_silhouette() {
        let truth = truth();
        let camera = SceneCamera::new(&truth, &rig(), &QUIET, 4);
        for (index, (image, mask)) in camera.images(2).iter().zip(&observe(&truth, &rig())[2].silhouettes).enumerate() {
            let background = camera.background(index, 1, 0);
            let differs = |i: usize| (0..3).any(|c| image.planes()[c][i] != background.planes()[c][i]);
            let changed = (0..320 * 240).filter(|i| differs(*i)).count();
            let outside = (0..320 * 240).filter(|i| differs(*i) && !mask.get(*i as u32 % 320, *i as u32 / 320)).count();
            assert!(outside <= 5, "{outside} pixels on the outline, up to rounding");
            assert!(changed as f64 > 0.95 * mask.count() as f64, "{changed} of {}", mask.count());
        }
    }

    #[test]
    fn a_shadow_darkens_the_ground_by_the_share_of_the_direct_light() {
        let truth = truth();
        let (lit, shaded) = (QUIET, ImageSettings { shadow: true, ..QUIET });
        let images = |settings| SceneCamera::new(&truth, &rig(), &settings, 4).images(2);
        let mask = &observe(&truth, &rig())[2].silhouettes[2];
        let (lit, shaded) = (&images(lit)[2], &images(shaded)[2]);
        let ratio = |i: usize| f64::from(shaded.planes()[1][i]) / f64::from(lit.planes()[1][i]);
        let darker: Vec<usize> = (0..320 * 240).filter(|i| shaded.planes()[1][*i] < lit.planes()[1][*i]).collect();
        assert!(darker.len() > 300, "{}", darker.len());
        let expected = 0.5 / (0.5 + 0.5 * std::f64::consts::FRAC_1_SQRT_2);
        assert!(darker.iter().all(|i| (ratio(*i) - expected).abs() < 0.02), "all by the same factor");
        let on_body = darker.iter().filter(|i| mask.get(**i as u32 % 320, **i as u32 / 320)).count();
        assert!(on_body <= 5, "{on_body} pixels on the outline, up to rounding");
    }

    #[test]
    fn images_are_reproducible_on_any_thread_and_grey_ones_have_one_plane() {
        let truth = truth();
        let camera = SceneCamera::new(&truth, &rig(), &ImageSettings::default(), 4);
        let one_by_one: Vec<_> = (0..4).map(|frame| camera.images(frame)).collect();
        assert_eq!(parallel::map(4, |frame| camera.images(frame)), one_by_one);
        let grey = SceneCamera::new(&truth, &rig(), &ImageSettings { grey: true, ..QUIET }, 4);
        let (grey, colour) =
            (grey.images(1).remove(0), SceneCamera::new(&truth, &rig(), &QUIET, 4).images(1).remove(0));
        assert_eq!(grey.planes().len(), 1);
        let off = |i: usize| {
            let value = grey_value(std::array::from_fn(|c| f32::from(colour.planes()[c][i])));
            (value - f32::from(grey.planes()[0][i])).abs()
        };
        assert!((0..320 * 240).all(|i| off(i) < 1.01));
    }
}
