//! Exact contact of a motion with props.

use nalgebra::{Point3, Vector3};

use super::ground_contacts::{least_speed, material_velocity};
use super::solid_distance::{nearest_point, solid_distance};
use super::{ContactError, ContactRule};
use crate::body::{Humanoid, LinkFrames, Prop};
use crate::parallel;

/// Contact of every link with geometry with every prop, in every frame of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct PropContacts {
    /// Frames a second.
    pub frames_per_second: f64,
    /// One track per prop and link with geometry: all links for the first prop in the body's order, then for the next.
    pub tracks: Vec<PropTrack>,
}

/// Contact of one link with one prop over a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct PropTrack {
    /// Index of the prop.
    pub prop: usize,
    /// Index of the link.
    pub link: usize,
    /// One entry per frame.
    pub frames: Vec<PropContact>,
}

/// Contact of one link with one prop in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PropContact {
    /// Signed distance of the surfaces, metres: negative where the link is inside the prop ([`solid_distance`]).
    /// Infinite beyond 10 m if either is a box, a cylinder or a mesh.
    pub gap_m: f64,
    /// The point of the link nearest to the prop or deepest in it, world, metres, accurate to about 0.1 mm; NaN if the
    /// gap is infinite. If the two touch along an edge or a face, any point of it.
    pub point: Point3<f64>,
    /// Velocity of the material point along the prop's surface, world, m/s: central difference over one frame before
    /// and after (one-sided at the ends; zero in a motion of one frame).
    pub slip: Vector3<f64>,
    /// Whether the link touches the prop by a [`ContactRule`], as a foot stands on the ground.
    pub in_contact: bool,
}

impl PropContact {
    /// Depth of the link inside the prop, metres; 0 outside.
    pub fn penetration_m(&self) -> f64 {
        (-self.gap_m).max(0.0)
    }
}

impl PropContacts {
    /// Contact of `body` with given link frames.
    pub fn from_frames(
        body: &Humanoid,
        props: &[Prop],
        frames: &[LinkFrames],
        frames_per_second: f64,
        rule: &ContactRule,
    ) -> Result<Self, ContactError> {
        rule.check()?;
        let solid_links = (0..body.links.len()).filter(|&link| !body.links[link].solids.is_empty());
        let pairs: Vec<(usize, usize)> =
            solid_links.flat_map(|link| (0..props.len()).map(move |prop| (prop, link))).collect();
        let clip = PropTrackInput { body, frames, frames_per_second, rule };
        let mut tracks = parallel::map(pairs.len(), |pair| {
            let (prop, link) = pairs[pair];
            PropTrack { prop, link, frames: clip.track(&props[prop], link) }
        });
        tracks.sort_by_key(|track| (track.prop, track.link));
        Ok(Self { frames_per_second, tracks })
    }

    /// Greatest depth of any link inside any prop, per frame, metres; 0 outside.
    pub fn deepest_m(&self, frames: usize) -> Vec<f64> {
        let deepest =
            |frame: usize| self.tracks.iter().map(|track| track.frames[frame].penetration_m()).fold(0.0, f64::max);
        (0..frames).map(deepest).collect()
    }
}

struct PropTrackInput<'a> {
    body: &'a Humanoid,
    frames: &'a [LinkFrames],
    frames_per_second: f64,
    rule: &'a ContactRule,
}

impl PropTrackInput<'_> {
    fn track(&self, prop: &Prop, link: usize) -> Vec<PropContact> {
        let near: Vec<Near> = self.frames.iter().map(|frames| self.near(prop, frames, link)).collect();
        let slip_about = |centre: usize, frame: usize, reach: usize| {
            let Near { point, normal, .. } = &near[frame];
            let in_link = self.frames[frame][link].inverse_transform_point(point);
            let velocity = material_velocity(self.frames, self.frames_per_second, centre, link, &in_link, reach);
            velocity - normal * normal.dot(&velocity)
        };
        let reach = self.rule.speed_reach(self.frames_per_second);
        let speed =
            |frame: usize| least_speed(frame, near.len(), reach, |centre| slip_about(centre, frame, reach).norm());
        let measures: Vec<(f64, f64)> =
            near.iter().enumerate().map(|(frame, near)| (near.gap_m, speed(frame))).collect();
        let labels = self.rule.label(&measures, self.frames_per_second);
        let contact = |(frame, in_contact): (usize, bool)| PropContact {
            gap_m: near[frame].gap_m,
            point: near[frame].point,
            slip: slip_about(frame, frame, 1),
            in_contact,
        };
        labels.into_iter().enumerate().map(contact).collect()
    }

    fn near(&self, prop: &Prop, frames: &LinkFrames, link: usize) -> Near {
        let solid = self.body.links[link].solids.iter();
        let apart = solid.map(|solid| (solid_distance(&prop.solid, solid, &frames[link]), solid));
        let nowhere = Near { gap_m: f64::INFINITY, point: Vector3::repeat(f64::NAN).into(), normal: Vector3::zeros() };
        let nearest = apart.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(gap_m, _)| gap_m.is_finite());
        let found = nearest.and_then(|(gap_m, solid)| {
            let (point, normal) = nearest_point(&prop.solid, solid, &frames[link])?;
            Some(Near { gap_m, point, normal })
        });
        found.unwrap_or(nowhere)
    }
}

/// The point of a link nearest to a prop, and the prop's outward normal there.
struct Near {
    gap_m: f64,
    point: Point3<f64>,
    normal: Vector3<f64>,
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::super::ground_contacts::tests::balls;
    use super::*;
    use crate::body::Solid;

    const FPS: f64 = 60.0;

    /// A box of 1 m with its upper face at z = 0.5.
    fn table() -> Prop {
        let solid = Solid::Box { link_from_box: Isometry3::identity(), half_extents: [0.5; 3] };
        Prop { name: "table".to_owned(), solid }
    }

    fn moved(place: impl Fn(f64) -> Isometry3<f64>) -> Vec<PropContact> {
        let frames: Vec<LinkFrames> = (0..30).map(|frame| LinkFrames(vec![place(f64::from(frame) / FPS)])).collect();
        let found = PropContacts::from_frames(&balls(0.0), &[table()], &frames, FPS, &ContactRule::default()).unwrap();
        assert_eq!(found.tracks.len(), 1);
        found.tracks[0].frames.clone()
    }

    #[test]
    fn a_ball_rolling_on_a_table_touches_it_without_slip() {
        // 0.3 m/s at a radius of 0.1 m: 3 rad/s about y
        let roll = |t: f64| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 3.0 * t);
            Isometry3::from_parts(nalgebra::Translation3::new(0.3 * t, 0.0, 0.6), turn)
        };
        for contact in moved(roll) {
            assert!(contact.gap_m.abs() < 1e-4 && contact.in_contact, "{contact:?}");
            assert!((contact.point.z - 0.5).abs() < 1e-3 && contact.slip.norm() < 2e-3, "{contact:?}");
        }
    }

    #[test]
    fn a_sliding_ball_slips_and_a_pressed_ball_penetrates() {
        for contact in moved(|t| Isometry3::translation(0.2 * t, 0.0, 0.59)) {
            assert!((contact.penetration_m() - 0.01).abs() < 1e-4, "{contact:?}");
            assert!((contact.slip - Vector3::new(0.2, 0.0, 0.0)).norm() < 1e-3, "{contact:?}");
        }
    }

    #[test]
    fn a_ball_sinking_along_a_wall_or_flying_past_does_not_touch() {
        assert!(moved(|t| Isometry3::translation(0.6, 0.0, -t)).iter().all(|contact| !contact.in_contact), "too fast");
        let far = moved(|_| Isometry3::translation(40.0, 0.0, 0.0));
        assert!(far.iter().all(|contact| !contact.in_contact && contact.gap_m > 30.0));
    }
}
