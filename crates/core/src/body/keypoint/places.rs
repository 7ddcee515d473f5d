//! Where keypoints are on a body: defined once, on its standing pose, by its landmarks and its surface.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::{Keypoint, KeypointLayout};
use crate::body::{Humanoid, LANDMARKS, Landmark, LinkFrames, LinkPoint, Markers, Ray, Solid};

/// Heights below the top of the head, as shares of the stature: eyes (`[Drillis 1966]`), ears and nose (ours).
const EYES_BELOW_TOP: f64 = 0.064;
const EARS_BELOW_TOP: f64 = 0.075;
const NOSE_BELOW_TOP: f64 = 0.085;
/// Distance of an eye from the middle of the face, as a share of the stature (ours).
const EYE_FROM_MIDDLE: f64 = 0.018;
/// Distance from the middle of an eye to its lids, as a share of the stature (ours).
const LIDS_FROM_MIDDLE: f64 = 0.006;
/// A start of rays outside any head, as a share of the stature.
const OUTSIDE: f64 = 0.5;
/// Stature of a body that does not define one, metres.
const USUAL_STATURE: f64 = 1.75;
/// Distance of points of the surface from it, metres: the body hides them from behind, but not from in front.
const OFF_SURFACE_M: f64 = 0.001;

/// A keypoint of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointPlace {
    /// The point, fixed to a link.
    pub point: LinkPoint,
    /// Whether it is on the surface. Then its own link hides it from behind; a point inside the body, such as a joint,
    /// is not hidden by its own link.
    pub is_on_surface: bool,
}

/// A body at its standing pose: X forward, Y left, Z up.
struct StandingFigure<'a> {
    body: &'a Humanoid,
    frames: LinkFrames,
    markers: Markers,
    /// Metres.
    stature: f64,
}

impl Humanoid {
    /// The keypoints of a layout on this body; `None` for one that the body's markers do not define.
    ///
    /// Shoulders, elbows, wrists, hips, knees, ankles and the top of the head are the body's markers; the others are
    /// found once on the body at its standing pose, as `docs/sets.md` says, and stay fixed to their link.
    pub fn keypoint_places(&self, layout: KeypointLayout) -> Vec<Option<KeypointPlace>> {
        let figure = StandingFigure::new(self);
        layout.keypoints().iter().map(|point| figure.place(*point)).collect()
    }

    /// Stature for the scale of a person in images: that of the body, or a usual one, metres.
    pub fn stature_or_usual(&self) -> f64 {
        self.stature().filter(|stature| stature.is_finite() && *stature > 0.0).unwrap_or(USUAL_STATURE)
    }
}

impl<'a> StandingFigure<'a> {
    fn new(body: &'a Humanoid) -> Self {
        let frames = body.link_frames(&body.standing_pose());
        Self { body, markers: body.markers(&frames), frames, stature: body.stature_or_usual() }
    }

    fn place(&self, point: Keypoint) -> Option<KeypointPlace> {
        use Keypoint as K;
        use Landmark as L;
        match point {
            K::Head => self.marker(L::HeadTop),
            K::Neck => self.marker(L::Thorax),
            K::MidHip => self.marker(L::Pelvis),
            K::Nose => self.on_head(NOSE_BELOW_TOP, 0.0, Vector3::x()),
            K::LeftEye => self.eye(EYE_FROM_MIDDLE),
            K::RightEye => self.eye(-EYE_FROM_MIDDLE),
            K::LeftEar => self.on_head(EARS_BELOW_TOP, 0.0, Vector3::y()),
            K::RightEar => self.on_head(EARS_BELOW_TOP, 0.0, -Vector3::y()),
            K::LeftHeel => self.on_foot(0, Vector3::new(-1.0, 0.0, -0.5)),
            K::RightHeel => self.on_foot(1, Vector3::new(-1.0, 0.0, -0.5)),
            K::LeftBigToe => self.on_foot(0, Vector3::new(1.0, -0.5, -0.3)),
            K::RightBigToe => self.on_foot(1, Vector3::new(1.0, 0.5, -0.3)),
            K::LeftSmallToe => self.on_foot(0, Vector3::new(0.6, 1.0, -0.3)),
            K::RightSmallToe => self.on_foot(1, Vector3::new(0.6, -1.0, -0.3)),
            // the joints of arms and legs have the names of their landmarks
            joint => self.marker(LANDMARKS.into_iter().find(|landmark| landmark.name() == joint.name())?),
        }
    }

    fn marker(&self, landmark: Landmark) -> Option<KeypointPlace> {
        let point = self.body.markers[landmark as usize]?;
        Some(KeypointPlace { point, is_on_surface: false })
    }

    /// Where the surface of the head is first met from outside, coming from `side`: `below` the top of the head and
    /// `left` of it, both as shares of the stature. Without such a surface, the point below the top itself.
    fn on_head(&self, below: f64, left: f64, side: Vector3<f64>) -> Option<KeypointPlace> {
        self.on_head_or_beside(below, left, side, &[0.0])
    }

    /// An eye. A skin has sockets instead, in which a point would hardly ever be seen: there, the eye is as far ahead
    /// as the foremost of socket and lids.
    fn eye(&self, left: f64) -> Option<KeypointPlace> {
        let lids: &[f64] = if self.body.skin.is_some() { &[LIDS_FROM_MIDDLE, -LIDS_FROM_MIDDLE] } else { &[] };
        self.on_head_or_beside(EYES_BELOW_TOP, left, Vector3::x(), &[&[0.0], lids].concat())
    }

    /// As [`Self::on_head`], as far out as the outermost surface at these heights above the point, shares of the
    /// stature.
    fn on_head_or_beside(&self, below: f64, left: f64, side: Vector3<f64>, heights: &[f64]) -> Option<KeypointPlace> {
        let link = self.body.markers[Landmark::HeadTop as usize]?.link;
        let top = self.markers[Landmark::HeadTop as usize]?;
        let inside = top + self.stature * Vector3::new(0.0, left, -below);
        let outside = inside + OUTSIDE * self.stature * side;
        let met = |height: &f64| {
            let origin = outside + height * self.stature * Vector3::z();
            self.first_met(link, &Ray { origin, direction: -side })
        };
        let nearest = heights.iter().filter_map(met).reduce(f64::min);
        let found = nearest.map_or(inside, |s| outside - (s - OFF_SURFACE_M) * side);
        Some(KeypointPlace { point: self.on_link(link, &found), is_on_surface: true })
    }

    /// The point of a foot (0 is the left one) farthest in a direction.
    fn on_foot(&self, side: usize, direction: Vector3<f64>) -> Option<KeypointPlace> {
        let links = &self.body.foot_links()[side];
        let turn = UnitQuaternion::rotation_between(&direction, &-Vector3::z())?;
        let turned = LinkFrames(self.frames.0.iter().map(|frame| turn * frame).collect());
        let (link, farthest) = self.body.lowest_on_link(&turned, links)?;
        let outside = turn.inverse() * farthest + OFF_SURFACE_M * direction.normalize();
        Some(KeypointPlace { point: self.on_link(link, &outside), is_on_surface: true })
    }

    fn first_met(&self, link: usize, ray: &Ray) -> Option<f64> {
        let meets = match &self.body.skin {
            Some(skin) => {
                let mut vertices = Vec::new();
                skin.deform_into(&self.frames, &mut vertices);
                let own = |(facet, _): &(usize, &[u32; 3])| skin.part_of(*facet) as usize == link;
                let triangles = skin.triangles().iter().enumerate().filter(own).map(|(_, corners)| *corners).collect();
                vec![Solid::Mesh { vertices, triangles }.ray_entry(ray)]
            }
            None => {
                let of_link = ray.transformed(&self.frames[link].inverse());
                self.body.links[link].solids.iter().map(|solid| solid.ray_entry(&of_link)).collect()
            }
        };
        meets.into_iter().flatten().reduce(f64::min)
    }

    fn on_link(&self, link: usize, place: &Point3<f64>) -> LinkPoint {
        LinkPoint { link, point_in_link: self.frames[link].inverse_transform_point(place) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    /// Places of the keypoints of HALPE-26 on a standing body, by name.
    fn standing(body: &Humanoid, name: &str) -> Point3<f64> {
        let frames = body.link_frames(&body.standing_pose());
        let layout = KeypointLayout::Halpe26;
        let index = layout.keypoints().iter().position(|point| point.name() == name).unwrap();
        let place = body.keypoint_places(layout)[index].unwrap();
        frames[place.point.link] * place.point.point_in_link
    }

    #[test]
    fn points_of_the_face_and_the_feet_are_where_anatomy_has_them_on_every_body() {
        for name in ["actor", "tracker25", "tracker40"] {
            let body = shipped(name).unwrap();
            let at = |point: &str| standing(&body, point);
            assert!(at("nose").x > at("left_ear").x + 0.04, "{name}: {} {}", at("nose"), at("left_ear"));
            assert!(at("left_eye").z > at("nose").z && at("head").z > at("left_eye").z + 0.05, "{name}");
            assert!(at("left_ear").y > at("left_eye").y && at("left_eye").y > at("nose").y, "{name}");
            assert!((at("left_ear").y - at("right_ear").y).abs() > 0.1, "{name}");
            assert!((at("left_heel") - at("left_big_toe")).norm() > 0.15, "{name}");
            assert!(at("left_heel").x < at("left_ankle").x, "{name}");
            assert!(at("left_big_toe").x > at("left_ankle").x + 0.1, "{name}");
            assert!(at("left_small_toe").y > at("left_big_toe").y + 0.02, "{name}");
            assert!(at("left_small_toe").z < 0.25 * at("left_knee").z + 0.75 * at("left_heel").z, "{name}");
            let middle = nalgebra::center(&at("left_shoulder"), &at("right_shoulder"));
            assert!((at("neck") - middle).norm() < 0.08 && at("neck").z > middle.z - 0.02, "{name}");
        }
    }

    #[test]
    fn left_and_right_mirror_each_other_on_a_symmetric_body() {
        let body = shipped("actor").unwrap();
        for point in KeypointLayout::Halpe26.keypoints() {
            let (own, other) = (standing(&body, point.name()), standing(&body, point.mirrored().name()));
            assert!((own - Point3::new(other.x, -other.y, other.z)).norm() < 1e-3, "{point:?}: {own} {other}");
        }
    }

    #[test]
    fn a_body_without_markers_has_no_keypoints() {
        let mut body = shipped("tracker25").unwrap();
        body.markers = [None; crate::body::LANDMARKS.len()];
        assert!(body.keypoint_places(KeypointLayout::Body25).iter().all(Option::is_none));
    }
}
