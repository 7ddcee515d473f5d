//! Exact contact of a motion with the ground z = 0.

use nalgebra::{Point3, Vector3};

use super::{ContactError, ContactRule, FOOT_NAMES, Pace, Stance, stances};
use crate::body::{Humanoid, LinkFrames, Motion, Pose};
use crate::input::excerpt;
use crate::parallel;

/// Contact of every link with geometry, and of the two feet, in every frame of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundContacts {
    /// Frames a second.
    pub frames_per_second: f64,
    /// The rule that labelled the contacts.
    pub rule: ContactRule,
    /// One track per link with geometry, in the body's order.
    pub links: Vec<ContactTrack>,
    /// The left and the right foot, each the link with the ankle and its descendants, combined into one surface.
    pub feet: [ContactTrack; 2],
}

/// Contact of one body part over a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactTrack {
    /// The link's name, or one of [`FOOT_NAMES`].
    pub name: String,
    /// Indices of its links.
    pub links: Vec<usize>,
    /// One entry per frame.
    pub frames: Vec<GroundContact>,
}

/// A link up to this height touches the ground even if it moves too fast to be standing, metres: a striking heel, toes
/// pushing off.
const TOUCHES: f64 = 0.002;

/// Contact of one body part with the ground in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundContact {
    /// Height of the lowest point of its surface, metres; negative under the ground.
    pub gap_m: f64,
    /// The lowest point, world, metres.
    pub point: Point3<f64>,
    /// The link with the lowest point.
    pub link: usize,
    /// Velocity of the lowest material point, world, m/s: central difference over one frame before and after (one-sided
    /// at the ends; zero in a motion of one frame). It is zero for a rolling sole.
    pub velocity: Vector3<f64>,
    /// Whether the part stands on the ground by a [`ContactRule`].
    pub in_contact: bool,
}

impl GroundContact {
    /// Depth under the ground, metres; 0 above.
    pub fn penetration_m(&self) -> f64 {
        (-self.gap_m).max(0.0)
    }

    /// Speed along the ground, m/s.
    pub fn slip_m_per_s(&self) -> f64 {
        self.velocity.xy().norm()
    }
}

impl ContactTrack {
    /// The uninterrupted contacts.
    pub fn stances(&self) -> Vec<Stance> {
        stances(&self.frames.iter().map(|frame| frame.in_contact).collect::<Vec<_>>())
    }
}

impl GroundContacts {
    /// The links that touch the ground in a frame, whether standing, striking or pushing off, with the heights of
    /// their lowest points, metres.
    #[doc(hidden)]
    pub fn touching(&self, frame: usize) -> impl Iterator<Item = (usize, f64)> {
        let tracks = self.links.iter().map(move |track| (track, &track.frames[frame]));
        let touching = tracks.filter(|(_, contact)| contact.in_contact || contact.gap_m <= TOUCHES);
        touching.flat_map(|(track, contact)| track.links.iter().map(|&link| (link, contact.gap_m)))
    }

    /// Contact of `body` in `motion`, from its solids.
    ///
    /// # Errors
    /// [`ContactError`] for invalid thresholds, a motion that is empty, belongs to another body or is not finite, and
    /// a body whose feet have no geometry.
    pub fn from_motion(body: &Humanoid, motion: &Motion, rule: &ContactRule) -> Result<Self, ContactError> {
        Self::from_motion_at_pace(body, motion, rule, Pace::default())
    }

    /// As [`Self::from_motion`], with stances found at the speed of the recording, which the motion plays back at
    /// `pace`. Velocities are those of the motion.
    ///
    /// # Errors
    /// As [`Self::from_motion`].
    pub fn from_motion_at_pace(
        body: &Humanoid,
        motion: &Motion,
        rule: &ContactRule,
        pace: Pace<'_>,
    ) -> Result<Self, ContactError> {
        let frames = link_frames(body, motion)?;
        let frames_per_second = motion.frames_per_second;
        Self::from_track_input(&GroundTrackInput { body, frames: &frames, frames_per_second, rule, pace })
    }

    /// As [`Self::from_motion`], with given link frames.
    ///
    /// # Errors
    /// [`ContactError`] for invalid thresholds, and for feet without a surface.
    pub fn from_frames(
        body: &Humanoid,
        frames: &[LinkFrames],
        frames_per_second: f64,
        rule: &ContactRule,
    ) -> Result<Self, ContactError> {
        let pace = Pace::default();
        Self::from_track_input(&GroundTrackInput { body, frames, frames_per_second, rule, pace })
    }

    /// Contact from prepared input.
    #[doc(hidden)]
    pub fn from_track_input(clip: &GroundTrackInput<'_>) -> Result<Self, ContactError> {
        let body = clip.body;
        clip.rule.check()?;
        let [left, right] = body.foot_links();
        let foot = |name, links| clip.track(name, links).ok_or_else(|| no_foot(body, name));
        let links = parallel::map(body.links.len(), |link| clip.track(&body.links[link].name, vec![link]));
        Ok(Self {
            frames_per_second: clip.frames_per_second,
            rule: *clip.rule,
            links: links.into_iter().flatten().collect(),
            feet: [foot(FOOT_NAMES[0], left)?, foot(FOOT_NAMES[1], right)?],
        })
    }
}

/// Checks that both feet of a body have geometry.
pub fn check_feet(body: &Humanoid) -> Result<(), ContactError> {
    let bare = |links: &Vec<usize>| links.iter().all(|&link| body.links[link].solids.is_empty());
    let feet = body.foot_links();
    match FOOT_NAMES.into_iter().zip(&feet).find(|(_, links)| bare(links)) {
        Some((foot, _)) => Err(no_foot(body, foot)),
        None => Ok(()),
    }
}

fn no_foot(body: &Humanoid, foot: &str) -> ContactError {
    ContactError::Refused(format!(
        "{:?} has no {foot}: the link with the ankle marker and all links below it have no geometry; give them a \
         <visual>, or the robot links named marker_left_ankle and marker_right_ankle",
        excerpt(&body.name)
    ))
}

/// The frames of all links in a motion, with checks.
pub fn link_frames(body: &Humanoid, motion: &Motion) -> Result<Vec<LinkFrames>, ContactError> {
    let rate = motion.frames_per_second;
    if motion.poses.is_empty() || !(rate > 0.0 && rate.is_finite()) {
        return Err(ContactError::of_empty(motion));
    }
    motion.poses.iter().enumerate().map(|(frame, pose)| checked_link_frames(body, frame, pose)).collect()
}

fn checked_link_frames(body: &Humanoid, frame: usize, pose: &Pose) -> Result<LinkFrames, ContactError> {
    let (found, expected) = (pose.joint_angles.len(), body.degrees_of_freedom.len());
    if found != expected {
        return Err(ContactError::Refused(format!(
            "frame {frame} (from 0): the pose has {found} joint angles, {:?} has {expected} degrees of freedom",
            excerpt(&body.name)
        )));
    }
    let frames = body.link_frames(pose);
    let is_finite = |f: &nalgebra::Isometry3<f64>| {
        f.translation.vector.iter().chain(f.rotation.coords.iter()).all(|x| x.is_finite())
    };
    match frames.0.iter().position(|f| !is_finite(f)) {
        Some(invalid) => Err(ContactError::Refused(format!(
            "frame {frame} (from 0): the position of link {:?} is not finite; check the motion for NaN or huge numbers",
            excerpt(&body.links[invalid].name)
        ))),
        None => Ok(frames),
    }
}

/// The input from which contact tracks are computed.
#[derive(Clone, Copy)]
pub struct GroundTrackInput<'a> {
    /// The body's surface.
    pub body: &'a Humanoid,
    /// The frames of every link.
    pub frames: &'a [LinkFrames],
    /// The frame rate.
    pub frames_per_second: f64,
    /// The rule for contact.
    pub rule: &'a ContactRule,
    /// Speed of the motion relative to its recording.
    pub pace: Pace<'a>,
}

impl GroundTrackInput<'_> {
    /// `None` if the links have no surface.
    #[doc(hidden)]
    pub fn track(&self, name: &str, links: Vec<usize>) -> Option<ContactTrack> {
        let lowest = self.frames.iter().map(|frames| self.body.lowest_on_link(frames, &links));
        let lowest = lowest.collect::<Option<Vec<_>>>()?;
        let measures: Vec<(f64, f64)> = lowest
            .iter()
            .enumerate()
            .map(|(frame, &(link, point))| {
                let pace = self.pace.at(frame);
                let reach = self.rule.speed_reach(self.frames_per_second / pace);
                let speed = |centre| self.velocity_about(centre, frame, (link, point), reach).norm();
                let least = least_speed(frame, self.frames.len(), reach, speed);
                (point.z, if self.rule.looks_ahead { least } else { speed(frame) } / pace)
            })
            .collect();
        let labels = self.rule.label_at_pace(&measures, self.frames_per_second, self.pace);
        let frames = lowest.iter().zip(labels).enumerate().map(|(frame, (&(link, point), in_contact))| GroundContact {
            gap_m: point.z,
            point,
            link,
            velocity: self.velocity_about(frame, frame, (link, point), 1),
            in_contact,
        });
        Some(ContactTrack { name: name.to_owned(), frames: frames.collect(), links })
    }

    /// Velocity of the material point at `point` of a link in `frame`.
    fn velocity_about(
        &self,
        centre: usize,
        frame: usize,
        (link, point): (usize, Point3<f64>),
        reach: usize,
    ) -> Vector3<f64> {
        let in_link = self.frames[frame][link].inverse_transform_point(&point);
        material_velocity(self.frames, self.frames_per_second, centre, link, &in_link, reach)
    }
}

/// The speed for the contact rule: that of the window around `frame`. Where the window extends beyond an end of the
/// motion, the smaller of this speed and that of the nearest complete window. Half a window has twice the noise of a
/// complete one, and a complete one, further from the end, may include a heel strike.
pub(super) fn least_speed(frame: usize, frames: usize, reach: usize, speed: impl Fn(usize) -> f64) -> f64 {
    let nearest_whole = frame.max(reach).min((frames - 1).saturating_sub(reach));
    let own = speed(frame);
    if nearest_whole == frame { own } else { own.min(speed(nearest_whole)) }
}

/// Mean velocity of a link's point over `reach` frames before and after `centre`, world, m/s.
pub(super) fn material_velocity(
    frames: &[LinkFrames],
    frames_per_second: f64,
    centre: usize,
    link: usize,
    in_link: &Point3<f64>,
    reach: usize,
) -> Vector3<f64> {
    let (before, after) = (centre.saturating_sub(reach), (centre + reach).min(frames.len() - 1));
    if before == after {
        return Vector3::zeros();
    }
    let moved = frames[after][link] * in_link - frames[before][link] * in_link;
    moved * (frames_per_second / (after - before) as f64)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::body::{Humanoid, Landmark, LinkPoint, Pose, Solid};
    use crate::raster::TaperedCapsule;
    use crate::test_bodies::person;
    use nalgebra::{DVector, Isometry3, UnitQuaternion};

    /// Two spheres of 0.1 m on one link, twice `away` apart along y.
    pub(in crate::contact) fn balls(away: f64) -> Humanoid {
        let mut body = person();
        let (a, b) = (Point3::new(0.0, -away, 0.0), Point3::new(0.0, away, 0.0));
        body.links.truncate(1);
        body.joints.clear();
        body.degrees_of_freedom.clear();
        body.links[0].solids = vec![Solid::TaperedCapsule(TaperedCapsule { a, b, radius_a: 0.1, radius_b: 0.1 })];
        body.markers = [None; 15];
        body
    }

    /// A body that is its own feet.
    fn roller() -> Humanoid {
        let mut body = balls(0.1);
        for ankle in [Landmark::LeftAnkle, Landmark::RightAnkle] {
            body.markers[ankle as usize] = Some(LinkPoint { link: 0, point_in_link: Point3::origin() });
        }
        body
    }

    fn moved(fps: f64, frames: usize, place: impl Fn(f64) -> Isometry3<f64>) -> Motion {
        let pose = |frame| Pose { world_from_root: place(frame as f64 / fps), joint_angles: DVector::zeros(0) };
        Motion { frames_per_second: fps, poses: (0..frames).map(pose).collect() }
    }

    fn contacts(motion: &Motion) -> Vec<GroundContact> {
        GroundContacts::from_motion(&roller(), motion, &ContactRule::default()).unwrap().feet[0].frames.clone()
    }

    #[test]
    fn a_rolling_ball_does_not_slip_and_a_sliding_one_does() {
        // 0.2 m/s: 2 rad/s about y at a radius of 0.1 m
        let roll = |t: f64| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 2.0 * t);
            Isometry3::from_parts(nalgebra::Translation3::new(0.2 * t, 0.0, 0.1), turn)
        };
        for contact in contacts(&moved(120.0, 30, roll)) {
            assert!(contact.slip_m_per_s() < 1e-3, "{contact:?}");
            assert!(contact.in_contact && contact.gap_m.abs() < 1e-12);
        }
        for contact in contacts(&moved(120.0, 30, |t| Isometry3::translation(0.2 * t, 0.0, 0.08))) {
            assert!((contact.slip_m_per_s() - 0.2).abs() < 1e-12 && contact.in_contact);
            assert!((contact.penetration_m() - 0.02).abs() < 1e-12);
        }
    }

    #[test]
    fn a_falling_ball_touches_when_it_has_stopped() {
        let fall = |t: f64| Isometry3::translation(0.0, 0.0, 0.1 + (0.5 - t).max(0.0));
        let found = contacts(&moved(60.0, 60, fall));
        let first = found.iter().position(|contact| contact.in_contact).unwrap();
        // at 30 frames it is at rest; the speed over two frames on either side falls below 0.25 m/s one frame later
        assert_eq!(first, 31, "{:?}", found[first]);
        assert!((found[15].velocity.z + 1.0).abs() < 1e-9 && !found[15].in_contact);
    }

    #[test]
    fn unsuitable_motions_and_bodies_are_refused_by_name() {
        let refused = |body: &Humanoid, motion: &Motion| {
            GroundContacts::from_motion(body, motion, &ContactRule::default()).unwrap_err().to_string()
        };
        let still = moved(60.0, 2, |_| Isometry3::identity());
        assert!(refused(&roller(), &moved(60.0, 0, |_| Isometry3::identity())).contains("0 poses"));
        assert!(refused(&roller(), &Motion { frames_per_second: 0.0, ..still.clone() }).contains("0 frames a second"));
        let nowhere = moved(60.0, 2, |t| Isometry3::translation(t / 0.0, 0.0, 0.0));
        assert!(refused(&roller(), &nowhere).starts_with("frame 0 (from 0): the position of link \"torso\""));
        assert!(refused(&person(), &still).contains("0 joint angles"));
        let mut bare = roller();
        bare.links[0].solids.clear();
        assert!(refused(&bare, &still).contains("no left foot"));
        assert!(check_feet(&bare).unwrap_err().to_string().contains("no left foot"));
        assert_eq!(check_feet(&roller()), Ok(()));
    }

    #[test]
    fn one_frame_has_contact_and_no_velocity() {
        let found = contacts(&moved(60.0, 1, |_| Isometry3::translation(0.0, 0.0, 0.1)));
        assert_eq!((found.len(), found[0].velocity), (1, Vector3::zeros()));
    }
}
