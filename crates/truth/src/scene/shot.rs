//! Where a camera's image of one frame shows points of the actor.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use nalgebra::{Point2, Point3};

use super::clock::SceneFigure;
use super::{Occluders, SceneClock, Sight};
use crate::body::LinkFrames;
use crate::camera::{Camera, TimedRig};

/// How often the row in which a point is seen is looked for anew: the motion of a body between rows is so small that
/// two or three times suffice.
const MOST_LOOKS: usize = 12;

/// A point of the actor in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct ShotPoint {
    /// Where the point was in the world when its row was exposed, metres.
    pub place: Point3<f64>,
    /// The camera as it was then.
    pub camera: Camera,
    /// Where it is in the image, lens included; `None` before the near plane. It may lie outside the image.
    pub pixel: Option<Point2<f64>>,
    /// How the camera saw it.
    pub sight: Sight,
}

/// One camera's image of one frame. A rolling shutter shows a point in the row that is exposed when the point is in
/// it: row and time are found by turns. A point above or below the image is shown when the first or last row is
/// exposed.
pub struct Shot<'a> {
    clock: &'a SceneClock<'a>,
    filming: &'a TimedRig,
    camera: usize,
    frame: usize,
    /// What was needed so far, by rows.
    rows: BTreeMap<u32, ExposedRow<'a>>,
}

/// The scene while a row is exposed.
struct ExposedRow<'a> {
    camera: Camera,
    links: LinkFrames,
    occluders: Occluders<'a>,
    /// Those of the body's surface as the camera sees it.
    bounds: Vec<[f64; 4]>,
}

impl<'a> Shot<'a> {
    /// The image of a camera and a frame, which rig and truth must have; `None` where the camera takes none.
    pub fn new(clock: &'a SceneClock<'a>, filming: &'a TimedRig, camera: usize, frame: usize) -> Option<Self> {
        filming.has_image(camera, frame).then(|| Self { clock, filming, camera, frame, rows: BTreeMap::new() })
    }

    /// A joint of the actor, which the body must have.
    pub fn joint(&mut self, joint: usize) -> ShotPoint {
        let parent = self.clock.truth().actor.joints[joint].parent;
        self.point(&[parent, joint + 1], |links| links[joint + 1].translation.vector.into())
    }

    /// A marker of the actor; `None` where the body has none.
    pub fn marker(&mut self, marker: usize) -> Option<ShotPoint> {
        let actor = &self.clock.truth().actor;
        let own = actor.markers[marker]?;
        actor.markers(&self.row(0).links)[marker]?;
        let place = |links: &LinkFrames| actor.markers(links)[marker].unwrap_or(Point3::origin());
        Some(self.point(&[own.link], place))
    }

    /// A point that belongs to the links `own` of the actor.
    fn point(&mut self, own: &[usize], place: impl Fn(&LinkFrames) -> Point3<f64>) -> ShotPoint {
        let last = self.filming.exposures(self.camera) - 1;
        let mut row = 0;
        for _ in 0..if last == 0 { 0 } else { MOST_LOOKS } {
            let seen = self.row(row);
            let Some(pixel) = seen.camera.project(&place(&seen.links)) else { break };
            let next = pixel.y.clamp(0.0, f64::from(last)) as u32;
            if next == row {
                break;
            }
            row = next;
        }
        let seen = self.row(row);
        let place = place(&seen.links);
        let sight = seen.occluders.seen_within(&seen.camera, &seen.bounds).to(&place, own);
        ShotPoint { place, pixel: seen.camera.project(&place), camera: seen.camera.clone(), sight }
    }

    fn row(&mut self, row: u32) -> &ExposedRow<'a> {
        match self.rows.entry(row) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(unknown) => {
                let truth = self.clock.truth();
                let time_s = self.filming.row_s(self.camera, truth.frames[self.frame].time_s, row);
                let links = self.clock.links(SceneFigure::Actor, self.frame, time_s);
                let others = (0..truth.distractors.len())
                    .map(|other| self.clock.links(SceneFigure::Distractor(other), self.frame, time_s));
                let others: Vec<LinkFrames> = others.collect();
                let occluders = Occluders::new(&truth.actor, &links, &truth.props)
                    .with_others(truth.distractors.iter().map(|other| &other.body).zip(&others));
                let camera = self.filming.camera_at(self.camera, time_s);
                let bounds = occluders.bounds(&camera);
                unknown.insert(ExposedRow { camera, links, occluders, bounds })
            }
        }
    }
}
