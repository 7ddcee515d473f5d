//! Projects points of the actor into the cameras' images of one frame.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use nalgebra::{Point2, Point3};

use super::clock::SceneFigure;
use super::sight::ImageFacets;
use super::{Occluders, SceneClock, Sight};
use skiagraph_core::body::{KeypointPlace, LinkFrames};
use skiagraph_core::camera::{Camera, TimedRig};

/// Limit on the iterations that find the row of a point: bodies move so little between rows that two or three suffice.
const MAX_ITERATIONS: usize = 12;

/// The links of a point that every link may hide.
const NO_LINKS: [usize; 2] = [usize::MAX; 2];

/// A point of the actor in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotPoint {
    /// World position of the point when its row was exposed, metres.
    pub place: Point3<f64>,
    /// The camera at that time.
    pub camera: Camera,
    /// Image position, with lens distortion; may be outside the image. `None` in front of the near plane.
    pub pixel: Option<Point2<f64>>,
    /// The row that shows the point.
    row: u32,
    /// The links that the point belongs to.
    own: [usize; 2],
}

/// The images of one frame, processed camera by camera. With a rolling shutter, a point's row and its exposure time
/// depend on each other and are found by fixed-point iteration. A point above or below the image takes the time of the
/// first or last row.
pub struct Shot<'a> {
    clock: &'a SceneClock<'a>,
    rig: &'a TimedRig,
    frame: usize,
    /// The camera of the last query; `rows` caches its rows.
    camera: usize,
    rows: BTreeMap<u32, ExposedRow<'a>>,
    /// The scene of the last query: cameras that expose at the same time share it.
    scene: Option<Rc<ExposedScene<'a>>>,
}

/// All figures at one time.
struct ExposedScene<'a> {
    time_s: f64,
    links: LinkFrames,
    occluders: OnceCell<Occluders<'a>>,
}

/// A camera while a row is exposed.
struct ExposedRow<'a> {
    camera: Camera,
    scene: Rc<ExposedScene<'a>>,
    /// The triangles of the body's surface.
    facets: OnceCell<ImageFacets>,
}

impl<'a> Shot<'a> {
    /// The images of a frame, which must exist in the truth.
    pub fn new(clock: &'a SceneClock<'a>, rig: &'a TimedRig, frame: usize) -> Self {
        Self { clock, rig, frame, camera: 0, rows: BTreeMap::new(), scene: None }
    }

    /// A joint of the actor in a camera's image, both of which must exist; `None` if the camera takes no image.
    pub fn joint(&mut self, camera: usize, joint: usize) -> Option<ShotPoint> {
        let parent = self.clock.truth().actor.joints[joint].parent;
        self.point(camera, [parent, joint + 1], |links| links[joint + 1].translation.vector.into())
    }

    /// A marker of the actor; `None` if the body lacks it or the camera takes no image.
    pub fn marker(&mut self, camera: usize, marker: usize) -> Option<ShotPoint> {
        let own = self.clock.truth().actor.markers[marker]?;
        self.point(camera, [own.link; 2], |links| links[own.link] * own.point_in_link)
    }

    /// A keypoint of the actor; `None` if the camera takes no image.
    pub fn keypoint(&mut self, camera: usize, place: &KeypointPlace) -> Option<ShotPoint> {
        let own = place.point;
        let links = if place.is_on_surface { NO_LINKS } else { [own.link; 2] };
        self.point(camera, links, |links| links[own.link] * own.point_in_link)
    }

    /// How a camera sees a point returned by [`Self::joint`], [`Self::marker`] or [`Self::keypoint`].
    pub fn sight(&mut self, camera: usize, point: &ShotPoint) -> Sight {
        let (clock, frame) = (self.clock, self.frame);
        let seen = self.row(camera, point.row);
        let occluders = seen.scene.occluders.get_or_init(|| occluders_in(clock, frame, &seen.scene));
        let facets = seen.facets.get_or_init(|| occluders.facets(&seen.camera));
        occluders.sight_lines_with(&seen.camera, facets).to(&point.place, &point.own)
    }

    /// A point that belongs to links `own` of the actor.
    fn point(
        &mut self,
        camera: usize,
        own: [usize; 2],
        place: impl Fn(&LinkFrames) -> Point3<f64>,
    ) -> Option<ShotPoint> {
        if !self.rig.has_image(camera, self.frame) {
            return None;
        }
        let last = self.rig.exposures(camera) - 1;
        let mut row = 0;
        for _ in 0..if last == 0 { 0 } else { MAX_ITERATIONS } {
            let seen = self.row(camera, row);
            let Some(pixel) = seen.camera.project(&place(&seen.scene.links)) else { break };
            let next = pixel.y.clamp(0.0, f64::from(last)) as u32;
            if next == row {
                break;
            }
            row = next;
        }
        let seen = self.row(camera, row);
        let place = place(&seen.scene.links);
        Some(ShotPoint { place, pixel: seen.camera.project(&place), camera: seen.camera.clone(), row, own })
    }

    fn row(&mut self, camera: usize, row: u32) -> &ExposedRow<'a> {
        if camera != self.camera {
            self.rows.clear();
            self.camera = camera;
        }
        let time_s = self.rig.row_s(camera, self.clock.truth().frames[self.frame].time_s, row);
        let (clock, frame, rig, scene) = (self.clock, self.frame, self.rig, &mut self.scene);
        self.rows.entry(row).or_insert_with(|| {
            let known = scene.take().filter(|scene| scene.time_s == time_s);
            let exposed = known.unwrap_or_else(|| {
                let links = clock.links(SceneFigure::Actor, frame, time_s);
                Rc::new(ExposedScene { time_s, links, occluders: OnceCell::new() })
            });
            *scene = Some(exposed.clone());
            ExposedRow { camera: rig.camera_at(camera, time_s), scene: exposed, facets: OnceCell::new() }
        })
    }
}

/// Everything that may hide points of the actor.
fn occluders_in<'a>(clock: &'a SceneClock<'a>, frame: usize, scene: &ExposedScene<'a>) -> Occluders<'a> {
    let truth = clock.truth();
    let links = |other| clock.links(SceneFigure::Distractor(other), frame, scene.time_s);
    let others: Vec<LinkFrames> = (0..truth.distractors.len()).map(links).collect();
    Occluders::new(&truth.actor, &scene.links, &truth.props)
        .with_others(truth.distractors.iter().map(|other| &other.body).zip(&others))
}
