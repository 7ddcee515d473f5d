//! Visibility of joints and markers.

use std::borrow::Cow;

use nalgebra::{Isometry3, Point3, Vector3};

use skiagraph_core::body::{BoundingBall, Humanoid, Link, LinkFrames, Prop, Ray, Skin};
use skiagraph_core::camera::Camera;

/// How a camera sees a point of the body. Points lie inside the body: geometry of their own links and solids that
/// contain them do not hide them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Sight {
    /// In the image and not hidden.
    InView = 0,
    /// In the image but hidden by the body, possibly by other objects too.
    SelfOccluded = 1,
    /// In the image but hidden by a prop or distractor only.
    Occluded = 2,
    /// Outside the image, or in front of the near plane.
    OutOfView = 3,
}

/// Geometry that may hide points of a body from a camera: the body's surface in one pose, props, and other people.
///
/// The surface is the skin of a body that has one, else its solids. A solid hides a point if the line from the point to
/// the camera enters it; a skin does if the line enters the body through a triangle of a link that is not the point's
/// own. Props and other people also hide points inside them.
pub struct Occluders<'a> {
    own: PosedBody<'a>,
    props: &'a [Prop],
    others: Vec<PosedBody<'a>>,
}

/// A body in one pose.
struct PosedBody<'a> {
    body: &'a Humanoid,
    links_from_world: Vec<Isometry3<f64>>,
    /// Balls around the solids of each link, in the world.
    balls: Vec<BoundingBall>,
    /// Vertices of the skin in the world; empty without one.
    vertices: Vec<Point3<f64>>,
    /// Whether the triangles of the skin are counterclockwise from outside.
    outwards: bool,
}

/// Lines of sight of a camera among occluders.
pub struct SightLines<'a> {
    occluders: &'a Occluders<'a>,
    camera: &'a Camera,
    centre: Point3<f64>,
    /// The skin's triangles.
    facets: Cow<'a, ImageFacets>,
}

impl<'a> Occluders<'a> {
    /// A body with link frames `frames`, and props.
    pub fn new(body: &'a Humanoid, frames: &LinkFrames, props: &'a [Prop]) -> Self {
        Self { own: PosedBody::new(body, frames), props, others: Vec::new() }
    }

    /// Adds other people with their link frames.
    pub(super) fn with_others<'l>(mut self, others: impl Iterator<Item = (&'a Humanoid, &'l LinkFrames)>) -> Self {
        self.others.extend(others.map(|(body, links)| PosedBody::new(body, links)));
        self
    }

    /// Lines of sight of a camera.
    pub fn seen_by(&'a self, camera: &'a Camera) -> SightLines<'a> {
        SightLines { occluders: self, camera, centre: camera.centre(), facets: Cow::Owned(self.facets(camera)) }
    }

    /// The skin's triangles in a camera's image.
    pub(super) fn facets(&self, camera: &Camera) -> ImageFacets {
        self.own.facets(camera)
    }

    /// Like [`Self::seen_by`], with known triangles.
    pub(super) fn sight_lines_with(&'a self, camera: &'a Camera, facets: &'a ImageFacets) -> SightLines<'a> {
        SightLines { occluders: self, camera, centre: camera.centre(), facets: Cow::Borrowed(facets) }
    }
}

/// Rows into which the triangles of a skin are sorted.
const ROWS: usize = 64;
/// Twice the area, in ideal image coordinates, below which rounding may decide whether a triangle faces the camera: a
/// millionth of a square pixel.
const EDGE_ON: f64 = 1e-12;

/// A triangle of a skin in an image.
#[derive(Clone, Copy)]
struct ImageFacet {
    index: u32,
    /// In ideal image coordinates: minimum and maximum x, then y.
    bounds: [f64; 4],
}

/// The triangles of a skin by their place in an image.
#[derive(Clone)]
pub(super) struct ImageFacets {
    /// The triangles that reach into each row, row after row.
    facets: Vec<ImageFacet>,
    /// Where the triangles of each row begin in `facets`, and their number.
    begins: [usize; ROWS + 1],
    top: f64,
    rows_per_unit: f64,
}

impl ImageFacets {
    /// Triangles between `top` and `bottom`; those beyond are in the first or last row.
    fn new(facets: &[ImageFacet], [top, bottom]: [f64; 2]) -> Self {
        let rows_per_unit = ROWS as f64 / (bottom - top).max(f64::MIN_POSITIVE);
        let mut sorted = Self { facets: Vec::new(), begins: [0; ROWS + 1], top, rows_per_unit };
        let rows = |facet: &ImageFacet| sorted.row(facet.bounds[2])..=sorted.row(facet.bounds[3]);
        // twice the same walk: first the number of triangles of each row, then the triangles
        let mut ends = [0; ROWS + 1];
        facets.iter().flat_map(rows).for_each(|row| ends[row + 1] += 1);
        (0..ROWS).for_each(|row| ends[row + 1] += ends[row]);
        let begins = ends;
        let nothing = ImageFacet { index: 0, bounds: [0.0; 4] };
        let mut placed = vec![nothing; begins[ROWS]];
        for facet in facets {
            for row in rows(facet) {
                placed[ends[row]] = *facet;
                ends[row] += 1;
            }
        }
        sorted.facets = placed;
        sorted.begins = begins;
        sorted
    }

    /// The row of a coordinate; the first or last one beyond the triangles.
    fn row(&self, y: f64) -> usize {
        // the cast saturates
        (((y - self.top) * self.rows_per_unit) as usize).min(ROWS - 1)
    }

    /// The triangles whose bounds contain a point.
    fn around(&self, x: f64, y: f64) -> impl Iterator<Item = usize> {
        let row = self.row(y);
        let near = self.facets[self.begins[row]..self.begins[row + 1]].iter();
        let contains = move |facet: &&ImageFacet| {
            let [left, right, top, bottom] = facet.bounds;
            (left..=right).contains(&x) && (top..=bottom).contains(&y)
        };
        near.filter(contains).map(|facet| facet.index as usize)
    }
}

impl<'a> PosedBody<'a> {
    fn new(body: &'a Humanoid, frames: &LinkFrames) -> Self {
        let mut vertices = Vec::new();
        if let Some(skin) = &body.skin {
            skin.deform_into(frames, &mut vertices);
        }
        let outwards = body.skin.as_ref().is_none_or(|skin| signed_volume(skin, &vertices) >= 0.0);
        let links_from_world = frames.0.iter().map(Isometry3::inverse).collect();
        let ball = |(link, world_from_link): (&Link, &Isometry3<f64>)| {
            let ball = BoundingBall::around(&link.solids);
            BoundingBall { centre: world_from_link * ball.centre, ..ball }
        };
        let balls = body.links.iter().zip(&frames.0).map(ball).collect();
        Self { body, links_from_world, balls, vertices, outwards }
    }

    /// The skin's triangles in a camera's image, without those that face the camera, because a line that ends in the
    /// camera never enters the body through them.
    fn facets(&self, camera: &Camera) -> ImageFacets {
        let turn = camera.camera_from_world.rotation.to_rotation_matrix();
        let from_origin = camera.camera_from_world.translation.vector;
        // not finite next to the camera's plane and behind it
        let project = |vertex: &Point3<f64>| {
            let p = turn * vertex + from_origin;
            if p.z > 1e-6 { [p.x / p.z, p.y / p.z] } else { [f64::NAN; 2] }
        };
        let projected: Vec<[f64; 2]> = self.vertices.iter().map(project).collect();
        // comparisons leave out what is not a number
        let extent = projected.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[top, bottom], [_, y]| {
            [if *y < top { *y } else { top }, if *y > bottom { *y } else { bottom }]
        });
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY];
        let facet = |(index, triangle): (usize, &[u32; 3])| {
            let [a, b, c] = triangle.map(|corner| projected[corner as usize]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let facing = if self.outwards { -area } else { area };
            let least = |i: usize| a[i].min(b[i]).min(c[i]);
            let most = |i: usize| a[i].max(b[i]).max(c[i]);
            let bounds = if facing.is_nan() { everywhere } else { [least(0), most(0), least(1), most(1)] };
            (facing.is_nan() || facing <= EDGE_ON).then_some(ImageFacet { index: index as u32, bounds })
        };
        let triangles = self.body.skin.iter().flat_map(|skin| skin.triangles().iter().enumerate());
        ImageFacets::new(&triangles.filter_map(facet).collect::<Vec<_>>(), extent)
    }
}

impl SightLines<'_> {
    /// How the camera sees `point`, which belongs to the links `own` of the body.
    pub fn to(&self, point: &Point3<f64>, own: &[usize]) -> Sight {
        if !self.camera.sees(point) {
            return Sight::OutOfView;
        }
        let sight = Ray { origin: *point, direction: self.centre - point };
        let body_in_pose = &self.occluders.own;
        let by_body = match &body_in_pose.body.skin {
            Some(skin) => self.is_behind_skin(skin, &sight, own),
            None => body_in_pose.is_behind_solid(&sight, own),
        };
        if by_body {
            Sight::SelfOccluded
        } else if self.occluders.is_occluded_by_others(&sight) {
            Sight::Occluded
        } else {
            Sight::InView
        }
    }

    /// Whether the line from a point to the camera enters the skin through a triangle of another link.
    fn is_behind_skin(&self, skin: &Skin, sight: &Ray, own: &[usize]) -> bool {
        let seen = self.camera.camera_from_world * sight.origin;
        let (x, y) = (seen.x / seen.z, seen.y / seen.z);
        self.facets.around(x, y).any(|facet| {
            let figure = &self.occluders.own;
            let corners = skin.triangles()[facet].map(|corner| figure.vertices[corner as usize]);
            enters(&corners, figure.outwards, sight) && !own.contains(&(skin.part_of(facet) as usize))
        })
    }
}

impl PosedBody<'_> {
    /// Whether the line from a point to the camera enters a solid of another link that does not contain the point.
    fn is_behind_solid(&self, sight: &Ray, own: &[usize]) -> bool {
        self.near_links(sight).filter(|(link, ..)| !own.contains(link)).any(|(_, link, sight)| {
            // an entry at 0 means that the solid contains the point, one beyond 1 is behind the camera
            link.solids.iter().any(|solid| solid.ray_entry(&sight).is_some_and(|s| s > 0.0 && s <= 1.0))
        })
    }

    /// The links that a line comes near, with the line in their frames.
    fn near_links(&self, line: &Ray) -> impl Iterator<Item = (usize, &Link, Ray)> {
        let links = self.body.links.iter().zip(&self.links_from_world).zip(&self.balls).enumerate();
        let near = links.filter(|(_, (_, ball))| ball.is_met(line));
        near.map(|(index, ((link, link_from_world), _))| (index, link, line.transformed(link_from_world)))
    }

    /// Whether the line from a point to the camera intersects the body.
    fn is_hit(&self, sight: &Ray) -> bool {
        if let Some(skin) = &self.body.skin {
            return skin.triangles().iter().any(|triangle| {
                let corners = triangle.map(|corner| self.vertices[corner as usize]);
                enters(&corners, true, sight) || enters(&corners, false, sight)
            });
        }
        self.near_links(sight)
            .any(|(_, link, sight)| link.solids.iter().any(|solid| solid.ray_entry(&sight).is_some_and(|s| s <= 1.0)))
    }
}

impl Occluders<'_> {
    /// Whether a prop or another person hides a point from the camera.
    fn is_occluded_by_others(&self, sight: &Ray) -> bool {
        let by_prop = self.props.iter().any(|prop| prop.solid.ray_entry(sight).is_some_and(|s| s <= 1.0));
        by_prop || self.others.iter().any(|other| other.is_hit(sight))
    }
}

/// Six times the volume of a skin, negative if its triangles are clockwise from outside.
fn signed_volume(skin: &Skin, vertices: &[Point3<f64>]) -> f64 {
    let about = vertices.first().map_or(Vector3::zeros(), |v| v.coords);
    let corner = |index: u32| vertices[index as usize].coords - about;
    skin.triangles().iter().map(|[a, b, c]| corner(*a).cross(&corner(*b)).dot(&corner(*c))).sum()
}

/// Whether the ray crosses a triangle from outside to inside between its origin and the end of its direction
/// (`[Möller 1997]`).
fn enters([a, b, c]: &[Point3<f64>; 3], outwards: bool, ray: &Ray) -> bool {
    let (p, q) = (b - a, c - a);
    let across = ray.direction.cross(&q);
    // the determinant is minus the dot product of direction and normal: positive where the ray hits the front
    let determinant = p.dot(&across);
    if determinant == 0.0 || (determinant > 0.0) != outwards {
        return false;
    }
    let from = ray.origin - a;
    let turned = from.cross(&p);
    let (u, v, s) = (from.dot(&across), ray.direction.dot(&turned), q.dot(&turned));
    let [u, v, s] = [u, v, s].map(|value| value / determinant);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && s > 0.0 && s <= 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Distractor, GroundTruth, SceneClock, Shot};
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::camera_at;
    use skiagraph_core::body::LANDMARKS;
    use skiagraph_core::camera::{CameraRig, TimedRig};

    #[test]
    fn a_distractor_hides_the_actor_like_a_prop_and_does_not_change_its_truth() {
        let rig = CameraRig { cameras: vec![camera_at("only", Point3::new(4.0, 0.0, 1.0))] };
        let among = |x: f64| {
            let mut poses = walk(2).poses;
            poses.iter_mut().for_each(|pose| pose.world_from_root.translation.x += x);
            let distractor = Distractor { name: "passer-by".into(), body: person(), poses };
            GroundTruth::among(person(), &walk(2), &rig, Vec::new(), vec![distractor]).unwrap()
        };
        let alone = GroundTruth::from_motion(person(), &walk(2), &rig).unwrap();
        let sights = |truth: &GroundTruth| {
            let rig = TimedRig::from(&rig);
            let clock = SceneClock::new(truth, &rig);
            let mut shot = Shot::new(&clock, &rig, 1);
            let sight = |marker| shot.marker(0, marker).map(|point| shot.sight(0, &point));
            (0..LANDMARKS.len()).filter_map(sight).collect::<Vec<_>>()
        };
        let (before, behind, without) = (among(1.0), among(-1.0), sights(&alone));
        assert_eq!(sights(&behind), without, "a distractor behind hides nothing");
        for (hidden, free) in sights(&before).into_iter().zip(without) {
            assert!(hidden == free || (free, hidden) == (Sight::InView, Sight::Occluded), "{free:?} {hidden:?}");
        }
        assert!(sights(&before).iter().filter(|sight| **sight == Sight::Occluded).count() > 3);
        assert_eq!(before.frames[1].pose, alone.frames[1].pose);
        assert_ne!(before.frames[1].visible, alone.frames[1].visible);
    }

    #[test]
    fn triangles_around_a_point_are_those_whose_bounds_contain_it() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut bounds: Vec<[f64; 4]> = (0..300)
            .map(|_| {
                let (x, y) = (next(), next());
                [x, x + 0.2 * next(), y, y + 0.2 * next()]
            })
            .collect();
        bounds.push([f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY]);
        let sorted = |bounds: &[[f64; 4]], extent| {
            let facets = bounds.iter().zip(0..).map(|(bounds, index)| ImageFacet { index, bounds: *bounds });
            ImageFacets::new(&facets.collect::<Vec<_>>(), extent)
        };
        let facets = sorted(&bounds, [0.0, 1.2]);
        for _ in 0..500 {
            let (x, y) = (1.6 * next() - 0.3, 1.6 * next() - 0.3);
            let has = |[left, right, top, bottom]: &[f64; 4]| left <= &x && &x <= right && top <= &y && &y <= bottom;
            let expected: Vec<usize> = (0..bounds.len()).filter(|index| has(&bounds[*index])).collect();
            assert_eq!(facets.around(x, y).collect::<Vec<_>>(), expected, "{x} {y}");
        }
        assert_eq!(sorted(&[], [f64::INFINITY, f64::NEG_INFINITY]).around(0.0, 0.0).count(), 0);
    }
}
