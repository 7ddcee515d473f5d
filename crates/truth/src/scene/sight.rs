//! Visibility of joints and markers.

use std::borrow::Cow;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::body::{Humanoid, LinkFrames, Prop, Ray, Skin};
use crate::camera::Camera;

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
        ImageFacets::new(self.own.bounds(camera))
    }

    /// Like [`Self::seen_by`], with known triangles.
    pub(super) fn sight_lines_with(&'a self, camera: &'a Camera, facets: &'a ImageFacets) -> SightLines<'a> {
        SightLines { occluders: self, camera, centre: camera.centre(), facets: Cow::Borrowed(facets) }
    }
}

/// Rows into which the triangles of a skin are sorted.
const ROWS: usize = 64;
/// Bounds that contain no point.
const NOWHERE: [f64; 4] = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
/// Twice the area, in ideal image coordinates, below which rounding may decide whether a triangle faces the camera: a
/// millionth of a square pixel.
const EDGE_ON: f64 = 1e-12;

/// The triangles of a skin by their place in an image.
#[derive(Clone)]
pub(super) struct ImageFacets {
    /// In ideal image coordinates: minimum and maximum x, then y.
    bounds: Vec<[f64; 4]>,
    /// The triangles that reach into each row.
    rows: Vec<Vec<u32>>,
    top: f64,
    rows_per_unit: f64,
}

impl ImageFacets {
    fn new(bounds: Vec<[f64; 4]>) -> Self {
        let finite = || bounds.iter().flat_map(|[_, _, top, bottom]| [*top, *bottom]).filter(|y| y.is_finite());
        let (top, bottom) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        let rows_per_unit = ROWS as f64 / (bottom - top).max(f64::MIN_POSITIVE);
        let mut facets = Self { bounds: Vec::new(), rows: vec![Vec::new(); ROWS], top, rows_per_unit };
        for (index, [_, _, top, bottom]) in bounds.iter().enumerate() {
            for row in facets.row(*top)..=facets.row(*bottom) {
                facets.rows[row].push(index as u32);
            }
        }
        facets.bounds = bounds;
        facets
    }

    /// The row of a coordinate; the first or last one beyond the triangles.
    fn row(&self, y: f64) -> usize {
        // the cast saturates
        (((y - self.top) * self.rows_per_unit) as usize).min(ROWS - 1)
    }

    /// The triangles whose bounds contain a point.
    fn around(&self, x: f64, y: f64) -> impl Iterator<Item = usize> {
        let near = self.rows[self.row(y)].iter().map(|index| *index as usize);
        near.filter(move |index| {
            let [left, right, top, bottom] = self.bounds[*index];
            (left..=right).contains(&x) && (top..=bottom).contains(&y)
        })
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
        Self { body, links_from_world, vertices, outwards }
    }

    /// Bounds of the skin's triangles in a camera's ideal image coordinates; [`NOWHERE`] for those that face the
    /// camera, because a line that ends in the camera never enters the body through them.
    fn bounds(&self, camera: &Camera) -> Vec<[f64; 4]> {
        let projected: Vec<Option<[f64; 2]>> = self
            .vertices
            .iter()
            .map(|vertex| camera.camera_from_world * vertex)
            .map(|p| (p.z > 1e-6).then(|| [p.x / p.z, p.y / p.z]))
            .collect();
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY];
        let bounds = |triangle: &[u32; 3]| {
            let [Some(a), Some(b), Some(c)] = triangle.map(|corner| projected[corner as usize]) else {
                return everywhere;
            };
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let facing = if self.outwards { -area } else { area };
            if facing > EDGE_ON {
                return NOWHERE;
            }
            let least = |i: usize| a[i].min(b[i]).min(c[i]);
            let most = |i: usize| a[i].max(b[i]).max(c[i]);
            [least(0), most(0), least(1), most(1)]
        };
        self.body.skin.iter().flat_map(|skin| skin.triangles()).map(bounds).collect()
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
        let others = self.body.links.iter().zip(&self.links_from_world).enumerate();
        others.filter(|(link, _)| !own.contains(link)).any(|(_, (link, link_from_world))| {
            let sight = sight.transformed(link_from_world);
            // an entry at 0 means that the solid contains the point, one beyond 1 is behind the camera
            link.solids.iter().any(|solid| solid.ray_entry(&sight).is_some_and(|s| s > 0.0 && s <= 1.0))
        })
    }

    /// Whether the line from a point to the camera intersects the body.
    fn is_hit(&self, sight: &Ray) -> bool {
        if let Some(skin) = &self.body.skin {
            return skin.triangles().iter().any(|triangle| {
                let corners = triangle.map(|corner| self.vertices[corner as usize]);
                enters(&corners, true, sight) || enters(&corners, false, sight)
            });
        }
        self.body.links.iter().zip(&self.links_from_world).any(|(link, link_from_world)| {
            let sight = sight.transformed(link_from_world);
            link.solids.iter().any(|solid| solid.ray_entry(&sight).is_some_and(|s| s <= 1.0))
        })
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
    use crate::body::{LANDMARKS, Landmark, Solid};
    use crate::camera::{CameraRig, TimedRig};
    use crate::scene::{Distractor, GroundTruth, SceneClock, Shot};
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::camera_at;

    fn visible(from: Point3<f64>, landmark: Landmark) -> bool {
        let rig = CameraRig { cameras: vec![camera_at("only", from)] };
        let truth = GroundTruth::from_motion(person(), &walk(1), &rig).unwrap();
        truth.frames[0].visible[0][landmark as usize]
    }

    #[test]
    fn the_torso_hides_the_far_hand_and_nothing_hides_the_near_one() {
        let (left, right) = (Point3::new(0.0, 4.0, 1.0), Point3::new(0.0, -4.0, 1.0));
        assert!(visible(left, Landmark::LeftWrist) && !visible(left, Landmark::RightWrist));
        assert!(visible(right, Landmark::RightWrist) && !visible(right, Landmark::LeftWrist));
        let front = Point3::new(4.0, 0.0, 1.0);
        assert!(visible(front, Landmark::LeftWrist) && visible(front, Landmark::RightWrist));
    }

    #[test]
    fn a_solid_around_a_marker_does_not_hide_it() {
        // the elbow is inside both upper arm and forearm
        assert!(visible(Point3::new(4.0, 0.0, 1.0), Landmark::LeftElbow));
        assert!(visible(Point3::new(-4.0, 0.0, 1.0), Landmark::LeftElbow));
    }

    #[test]
    fn a_prop_around_a_marker_hides_it_and_one_behind_it_does_not() {
        let rig = CameraRig { cameras: vec![camera_at("only", Point3::new(4.0, 0.0, 1.0))] };
        let among = |x: f64| {
            let solid =
                Solid::Box { link_from_box: Isometry3::translation(x, 0.0, 1.0), half_extents: [1.0, 1.0, 1.5] };
            let props = vec![Prop { name: "box".into(), solid }];
            let truth = GroundTruth::among(person(), &walk(1), &rig, props, Vec::new()).unwrap();
            truth.frames[0].visible[0][Landmark::LeftElbow as usize]
        };
        assert!(visible(Point3::new(4.0, 0.0, 1.0), Landmark::LeftElbow));
        assert!(!among(0.0) && among(-3.0));
    }

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
        let facets = ImageFacets::new(bounds.clone());
        for _ in 0..500 {
            let (x, y) = (1.6 * next() - 0.3, 1.6 * next() - 0.3);
            let has = |[left, right, top, bottom]: &[f64; 4]| left <= &x && &x <= right && top <= &y && &y <= bottom;
            let expected: Vec<usize> = (0..bounds.len()).filter(|index| has(&bounds[*index])).collect();
            assert_eq!(facets.around(x, y).collect::<Vec<_>>(), expected, "{x} {y}");
        }
        assert_eq!(ImageFacets::new(Vec::new()).around(0.0, 0.0).count(), 0);
    }

    #[test]
    fn a_ray_enters_a_triangle_only_from_its_front() {
        let corners = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let ray = |z: f64, to: f64| Ray { origin: Point3::new(0.2, 0.2, z), direction: Vector3::new(0.0, 0.0, to) };
        assert!(enters(&corners, true, &ray(1.0, -2.0)), "its normal is +Z");
        assert!(!enters(&corners, true, &ray(-1.0, 2.0)) && enters(&corners, false, &ray(-1.0, 2.0)));
        assert!(!enters(&corners, true, &ray(1.0, -0.9)), "it ends before the triangle");
        assert!(!enters(&corners, true, &ray(-0.1, -2.0)), "the triangle is behind its start");
    }
}
