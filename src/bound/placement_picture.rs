//! Placed cameras from above, as SVG.

use nalgebra::{Point2, Vector3};
use serde::Serialize;

use super::placement::Placement;
use skiagraph_core::camera::Camera;
use skiagraph_report::ReportError;
use skiagraph_report::html::render_page;

const TEMPLATE: &str = include_str!("placement.svg");
/// Width of the map and length of a line of sight, pixels.
const SIDE: f64 = 900.0;
const SIGHT: f64 = 55.0;

#[derive(Serialize)]
struct PlacementPicture<'a> {
    placement: &'a Placement,
    side: f64,
    /// Pixels of a metre, and the place of the world's origin.
    metre: f64,
    origin: [f64; 2],
    path: Vec<[f64; 2]>,
    candidates: Vec<PlacedCamera<'a>>,
    own: Vec<PlacedCamera<'a>>,
    chosen: Vec<PlacedCamera<'a>>,
}

#[derive(Serialize)]
struct PlacedCamera<'a> {
    name: &'a str,
    height_m: f64,
    place: [f64; 2],
    /// The end of its line of sight.
    ahead: [f64; 2],
}

/// The map of a picture from above: X to the right, Y upwards.
#[derive(Clone, Copy)]
struct MapScale {
    middle: Point2<f64>,
    metre: f64,
}

impl MapScale {
    fn of_points(points: impl Iterator<Item = Point2<f64>>) -> Self {
        let mut ends: Option<[Point2<f64>; 2]> = None;
        for point in points {
            let [low, high] = ends.unwrap_or([point; 2]);
            ends = Some([low.inf(&point), high.sup(&point)]);
        }
        let [low, high] = ends.unwrap_or([Point2::origin(); 2]);
        Self { middle: nalgebra::center(&low, &high), metre: SIDE / (1.15 * (high - low).amax().max(1.0)) }
    }

    fn place(&self, point: Point2<f64>) -> [f64; 2] {
        let from_middle = (point - self.middle) * self.metre;
        // tenths of a pixel
        [0.5 * SIDE + from_middle.x, 0.5 * SIDE - from_middle.y].map(|pixel| (10.0 * pixel).round() / 10.0)
    }

    fn cameras<'a>(&self, cameras: &'a [Camera]) -> Vec<PlacedCamera<'a>> {
        let mut placed = Vec::new();
        for camera in cameras {
            let (at, axis) = (camera.centre(), camera.camera_from_world.inverse_transform_vector(&Vector3::z()).xy());
            let sight = axis.try_normalize(1e-9).unwrap_or_default() * (SIGHT / self.metre);
            let (place, ahead) = (self.place(at.xy()), self.place(at.xy() + sight));
            placed.push(PlacedCamera { name: &camera.name, height_m: at.z, place, ahead });
        }
        placed
    }
}

impl Placement {
    pub(super) fn picture(&self) -> Result<String, ReportError> {
        let [candidates, own] = &self.others;
        let cameras = [candidates, own, &self.cameras].into_iter().flatten();
        let path = self.path.iter().map(|place| Point2::from(*place));
        let map = MapScale::of_points(cameras.map(|camera| camera.centre().xy()).chain(path.clone()));
        let picture = PlacementPicture {
            placement: self,
            side: SIDE,
            metre: map.metre,
            origin: map.place(Point2::origin()),
            path: path.map(|point| map.place(point)).collect(),
            candidates: map.cameras(candidates),
            own: map.cameras(own),
            chosen: map.cameras(&self.cameras),
        };
        render_page(TEMPLATE, &picture)
    }
}
