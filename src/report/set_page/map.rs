//! The rig from above: cameras with their fields of view, the path of the root, props.

use std::fmt::Write;

use nalgebra::{Point2, Point3, Vector2, Vector3};
use serde::Serialize;

use crate::body::{Prop, Solid};
use crate::camera::{Camera, CameraRig};
use crate::report::Playback;

/// Maximum number of grid squares across the map.
const MOST_SQUARES: f64 = 14.0;
/// Minimum length of a drawn field of view, m.
const LEAST_FIELD: f64 = 0.5;
/// Length of a drawn field of view, as a multiple of the distance to the middle of the path.
const BEYOND: f64 = 1.15;
/// Number of segments of the far side of a field of view.
const FIELD_PIECES: usize = 8;
/// Number of points of a prop's outline.
const CORNERS: usize = 24;

/// The path and the props on the ground.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetMap {
    /// The root's position in every stored frame; without ground truth, only the start position given to the tracker.
    pub roots: Vec<Option<Point3<f64>>>,
    /// Fixed solids.
    pub props: Vec<Prop>,
}

/// The moving parts, for the script.
#[derive(Serialize)]
pub(super) struct MovingMap {
    /// `[frame]`: x and y on the map.
    roots: Vec<Option<[f64; 2]>>,
    /// `[frame][camera]`: corners of the field of view, the camera first; empty if all cameras are static.
    fields: Vec<Vec<Option<String>>>,
}

/// The visible part of the ground, m; Y up on the page.
struct Window {
    low: Point2<f64>,
    high: Point2<f64>,
    square: f64,
}

impl SetMap {
    pub(super) fn svg(&self, rig: &CameraRig, playback: &Playback) -> String {
        let window = self.window(rig, playback);
        let (size, square) = (window.high - window.low, window.square);
        let line = 0.004 * size.x.max(size.y);
        let letters = 0.03 * size.x.max(size.y);
        let mut svg = format!(
            "<svg class=\"map\" viewBox=\"{:.3} {:.3} {:.3} {:.3}\" role=\"img\" aria-label=\"{} cameras from above\">",
            window.low.x,
            -window.high.y,
            size.x,
            size.y,
            rig.cameras.len()
        );
        for [from, to] in window.grid() {
            let (x1, y1, x2, y2) = (from.x, -from.y, to.x, -to.y);
            svg += &format!(
                "<line class=\"grid\" stroke-width=\"{:.4}\" \
                 x1=\"{x1:.3}\" y1=\"{y1:.3}\" x2=\"{x2:.3}\" y2=\"{y2:.3}\"/>",
                0.4 * line
            );
        }
        for prop in &self.props {
            let outline = points(&footprint(&prop.solid));
            svg += &format!("<polygon class=\"prop\" stroke-width=\"{line:.4}\" points=\"{outline}\"/>");
        }
        for (index, camera) in rig.cameras.iter().enumerate() {
            let field = points(&self.field(camera));
            let (x, y) = (camera.centre().x, -camera.centre().y);
            let [anchor, dx] = if x < window.low.x + 0.5 * size.x {
                ["start".to_owned(), format!("{:.4}", 3.0 * line)]
            } else {
                ["end".to_owned(), format!("{:.4}", -3.0 * line)]
            };
            svg += &format!(
                "<g data-camera=\"{index}\"><polygon class=\"field\" stroke-width=\"{:.4}\" points=\"{field}\"/>\
                 <circle class=\"eye\" cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"{:.4}\"/>\
                 <text x=\"{x:.3}\" y=\"{y:.3}\" text-anchor=\"{anchor}\" \
                 dx=\"{dx}\" dy=\"{:.4}\" font-size=\"{letters:.4}\">{}</text></g>",
                0.6 * line,
                2.4 * line,
                -2.4 * line,
                minijinja::HtmlEscape(&camera.name)
            );
        }
        let walked: Vec<Point2<f64>> = self.roots.iter().flatten().map(Point3::xy).collect();
        if walked.len() > 1 {
            svg += &format!(
                "<polyline class=\"walked\" stroke-width=\"{:.4}\" points=\"{}\"/>",
                1.5 * line,
                points(&walked)
            );
        }
        if let Some(root) = walked.first() {
            svg += &format!(
                "<circle class=\"root\" data-is=\"root\" \
                 cx=\"{:.3}\" cy=\"{:.3}\" r=\"{:.4}\" stroke-width=\"{:.4}\"/>",
                root.x,
                -root.y,
                3.0 * line,
                0.6 * line
            );
        }
        let at = window.low + Vector2::repeat(0.5 * letters);
        svg += &format!(
            "<text x=\"{:.3}\" y=\"{:.3}\" font-size=\"{letters:.4}\">one square: {}</text></svg>",
            at.x,
            -at.y,
            metres(square)
        );
        svg
    }

    /// The size of a grid square with its unit.
    pub(super) fn square_size(&self, rig: &CameraRig, playback: &Playback) -> String {
        metres(self.window(rig, playback).square)
    }

    pub(super) fn moving(&self, rig: &CameraRig, playback: &Playback) -> MovingMap {
        let round = |value: f64| (1000.0 * value).round() / 1000.0;
        let root = |place: &Option<Point3<f64>>| place.map(|place| [round(place.x), round(-place.y)]);
        let place_of = |rig: &CameraRig, camera: usize| rig.cameras.get(camera).map(|c| c.camera_from_world);
        // a static camera in a moving rig is not redrawn
        let moves = |camera: usize| playback.moved.iter().any(|at| place_of(at, camera) != place_of(rig, camera));
        let moving: Vec<bool> = (0..rig.cameras.len()).map(moves).collect();
        let field = |(camera, moves): (&Camera, &bool)| moves.then(|| points(&self.field(camera)));
        let fields = playback.moved.iter().map(|rig| rig.cameras.iter().zip(&moving).map(field).collect());
        MovingMap { roots: self.roots.iter().map(root).collect(), fields: fields.collect() }
    }

    /// Corners of the field of view at the middle row of the image: the camera, then the far side, a little beyond the
    /// middle of the path. Only the camera if it looks up or down.
    fn field(&self, camera: &Camera) -> Vec<Point2<f64>> {
        let eye = camera.centre().xy();
        let places: Vec<Point2<f64>> = self.roots.iter().flatten().map(Point3::xy).collect();
        let sum: Vector2<f64> = places.iter().map(|place| place.coords).sum();
        let middle = Point2::from(sum / places.len().max(1) as f64);
        let reach = (BEYOND * (middle - eye).norm()).max(LEAST_FIELD);
        let (width, height) = (f64::from(camera.pinhole.width), f64::from(camera.pinhole.height));
        let edge = |x: f64| {
            let ray = camera.ray_through(&Point2::new(x, 0.5 * height))?;
            let flat = ray.into_inner().xy();
            (flat.norm() > 0.1).then(|| eye + flat.normalize() * reach)
        };
        let edges: Option<Vec<Point2<f64>>> =
            (0..=FIELD_PIECES).map(|piece| edge(width * piece as f64 / FIELD_PIECES as f64)).collect();
        std::iter::once(eye).chain(edges.unwrap_or_default()).collect()
    }

    fn window(&self, rig: &CameraRig, playback: &Playback) -> Window {
        let rigs = std::iter::once(rig).chain(&playback.moved);
        let fields = rigs.flat_map(|rig| &rig.cameras).flat_map(|camera| self.field(camera));
        let roots = self.roots.iter().flatten().map(Point3::xy);
        let props = self.props.iter().flat_map(|prop| footprint(&prop.solid));
        let mut places = fields.chain(roots).chain(props).filter(|place| place.coords.iter().all(|v| v.is_finite()));
        let first = places.next().unwrap_or(Point2::origin());
        let (low, high) = places.fold((first, first), |(low, high), place| (low.inf(&place), high.sup(&place)));
        let margin = 0.08 * (high - low).amax() + 0.2;
        let (low, high) = (low - Vector2::repeat(margin), high + Vector2::repeat(margin));
        Window { low, high, square: square((high - low).amax()) }
    }
}

impl Window {
    fn grid(&self) -> Vec<[Point2<f64>; 2]> {
        let steps = |low: f64, high: f64| {
            let (first, last) = ((low / self.square).ceil() as i64, (high / self.square).floor() as i64);
            (first..=last).map(|step| step as f64 * self.square)
        };
        let upright = steps(self.low.x, self.high.x).map(|x| [Point2::new(x, self.low.y), Point2::new(x, self.high.y)]);
        let level = steps(self.low.y, self.high.y).map(|y| [Point2::new(self.low.x, y), Point2::new(self.high.x, y)]);
        upright.chain(level).collect()
    }
}

/// Size of a grid square: 1, 2 or 5 times a power of ten, so that at most [`MOST_SQUARES`] fit into the extent.
fn square(extent: f64) -> f64 {
    let least = (extent / MOST_SQUARES).max(1e-3);
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= least).unwrap_or(10.0 * power)
}

fn metres(length: f64) -> String {
    format!("{} m", (1000.0 * length).round() / 1000.0)
}

/// SVG coordinates of corners; Y points down.
fn points(corners: &[Point2<f64>]) -> String {
    let mut text = String::new();
    for (index, corner) in corners.iter().enumerate() {
        let gap = if index == 0 { "" } else { " " };
        write!(text, "{gap}{:.3},{:.3}", corner.x, -corner.y).ok();
    }
    text
}

/// The approximate outline of a prop from above, from the extent of its hull in every direction.
fn footprint(solid: &Solid) -> Vec<Point2<f64>> {
    let Some(middle) = solid.middle() else { return Vec::new() };
    let reach = |direction: Vector3<f64>| {
        // the lowest point of the solid if this direction is turned down
        let turn = nalgebra::UnitQuaternion::rotation_between(&direction, &-Vector3::z());
        let turned = nalgebra::Isometry3::from_parts(Default::default(), turn?);
        let point = solid.lowest_point(&turned)?;
        Some(-point.z)
    };
    let corner = |index: usize| {
        let angle = std::f64::consts::TAU * index as f64 / CORNERS as f64;
        let next = angle + std::f64::consts::TAU / CORNERS as f64;
        let [one, other] = [angle, next].map(|a| Vector3::new(libm::cos(a), libm::sin(a), 0.0));
        let (a, b) = (reach(one)?, reach(other)?);
        // the intersection of the two supporting lines
        let determinant = one.x * other.y - one.y * other.x;
        Some(Point2::new((a * other.y - b * one.y) / determinant, (one.x * b - other.x * a) / determinant))
    };
    let outline: Option<Vec<Point2<f64>>> = (0..CORNERS).map(corner).collect();
    outline.unwrap_or_else(|| vec![middle.xy()])
}
