//! Takes joined by transitions: the edges of a motion graph (`[Kovar 2002]`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::blending::go_on;
use super::{Closest, EditError, PoseClouds};
use crate::body::{Humanoid, Motion};

/// Most frames on either side whose distances are all computed; of longer takes some first, then those around the best.
const MOST_COMPARED: usize = 300;

/// Of the transitions whose distance is at most this multiple of the least, the one that keeps most frames is taken.
const AS_GOOD: f64 = 1.25;

/// How takes are joined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JoinSettings {
    /// Duration of a blend, seconds.
    pub blend_s: f64,
    /// The greatest distance of two poses that are blended: root mean square over the landmarks during the blend, after
    /// the best turn and shift over the ground. Millimetres.
    pub within_mm: f64,
}

impl Default for JoinSettings {
    fn default() -> Self {
        Self { blend_s: 0.3, within_mm: 120.0 }
    }
}

/// A motion to be joined, with the name it has in messages.
#[derive(Clone, Debug, PartialEq)]
pub struct Take {
    /// Its name.
    pub name: String,
    /// Continuous, of the body that all takes share, at the rate they share.
    pub motion: Motion,
}

/// Where one take goes over into another.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// First blended frame of the joined motion.
    pub first: usize,
    /// The frame after the last blended one.
    pub end: usize,
    /// Distance of the two poses, metres ([`PoseClouds`]).
    pub distance_m: f64,
    /// The take that is left, and at which of its frames.
    pub from: (String, usize),
    /// The take that follows, and at which of its frames it is entered.
    pub to: (String, usize),
}

/// A motion made of takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Joined {
    /// The motion, continuous.
    pub motion: Motion,
    /// Its seams, in order.
    pub seams: Vec<Seam>,
}

/// The takes one after another, each turned and moved over the ground to where the one before is left. A take is left
/// in its second half and entered in its first half, where the poses of both are nearest; of nearly equal places, the
/// one that keeps most frames.
///
/// # Errors
/// [`EditError`] that names the takes that are nowhere alike, or too short.
pub fn joined(body: &Humanoid, takes: &[Take], settings: &JoinSettings) -> Result<Joined, EditError> {
    let Some(first) = takes.first() else {
        return Ok(Joined { motion: Motion { frames_per_second: 1.0, poses: Vec::new() }, seams: Vec::new() });
    };
    let mut joined = Joined { motion: first.motion.clone(), seams: Vec::new() };
    // frame of the joined motion at which the present take's frame 0 would be
    let mut begin = 0_isize;
    for (index, pair) in takes.windows(2).enumerate() {
        let transition = Transition::between(body, [(index, &pair[0]), (index + 1, &pair[1])], settings)?;
        begin = joined.append(body, begin, &pair[0], &pair[1], &transition);
    }
    joined.motion = joined.motion.made_continuous(body);
    Ok(joined)
}

/// A take repeated by the best transition from its second half back into its first that shows a third of it at least,
/// until it lasts `duration_s` or, by less than a frame, more.
///
/// # Errors
/// [`EditError`] where its end is nowhere like its beginning, or the take is too short.
pub fn repeated(body: &Humanoid, take: &Take, duration_s: f64, settings: &JoinSettings) -> Result<Joined, EditError> {
    let frames = libm::ceil(duration_s * take.motion.frames_per_second - 1e-6).max(1.0) as usize + 1;
    let mut joined = Joined { motion: take.motion.clone(), seams: Vec::new() };
    if joined.motion.poses.len() < frames {
        let transition = Transition::between(body, [(0, take), (0, take)], settings)?;
        let mut begin = 0_isize;
        while joined.motion.poses.len() < frames {
            begin = joined.append(body, begin, take, take, &transition);
        }
    }
    joined.cut(frames);
    joined.motion = joined.motion.made_continuous(body);
    Ok(joined)
}

impl Joined {
    /// Adds the seams that each take has within itself, in frames of that take, as far as the transitions between the
    /// takes leave them in.
    #[must_use]
    pub fn with_seams_of_takes(mut self, of_takes: Vec<Vec<Seam>>) -> Self {
        let between = std::mem::take(&mut self.seams);
        for (index, seams) in of_takes.into_iter().enumerate() {
            let before = index.checked_sub(1).and_then(|before| between.get(before));
            let begin = before.map_or(0, |seam| seam.first.cast_signed() - seam.to.1.cast_signed());
            let present = before.map_or(0, |seam| seam.end);
            let end = between.get(index).map_or(self.motion.poses.len(), |seam| seam.first);
            let moved = |frame: usize| {
                begin.saturating_add_unsigned(frame).clamp(present.cast_signed(), end.max(present).cast_signed())
            };
            for mut seam in seams {
                (seam.first, seam.end) = (moved(seam.first).unsigned_abs(), moved(seam.end).unsigned_abs());
                if seam.first < seam.end {
                    self.seams.push(seam);
                }
            }
        }
        self.seams.extend(between);
        self.seams.sort_by_key(|seam| seam.first);
        self
    }

    /// Which take each frame is of, as long as the seams are those between takes: in a blend, up to its middle the one
    /// that is left.
    pub fn takes_of_frames(&self) -> Vec<usize> {
        let middles: Vec<usize> = self.seams.iter().map(|seam| usize::midpoint(seam.first, seam.end)).collect();
        (0..self.motion.poses.len()).map(|frame| middles.iter().filter(|middle| **middle <= frame).count()).collect()
    }

    /// Leaves out all frames from `frames` on, and seams that begin there.
    pub fn cut(&mut self, frames: usize) {
        self.motion.poses.truncate(frames);
        self.seams.retain(|seam| seam.first < frames);
        self.seams.iter_mut().for_each(|seam| seam.end = seam.end.min(frames));
    }

    /// Goes over from `from`, whose frame 0 is at `begin`, to `to`; where that one's frame 0 is.
    fn append(&mut self, body: &Humanoid, begin: isize, from: &Take, to: &Take, transition: &Transition) -> isize {
        let Closest { leaves, enters, distance_m } = transition.closest;
        let first = begin.saturating_add_unsigned(leaves).max(0).unsigned_abs();
        let here = self.motion.poses[first].world_from_root;
        let there = from.motion.poses[leaves].world_from_root;
        // where the take that is left has itself been moved to
        let world_from_take = here * there.inverse();
        let world_from_next = super::transfer::on_ground(&world_from_take) * transition.alignment;
        go_on(body, &mut self.motion, first, &to.motion, enters, &world_from_next, transition.blend);
        self.seams.push(Seam {
            first,
            end: first + transition.blend,
            distance_m,
            from: (from.name.clone(), leaves),
            to: (to.name.clone(), enters),
        });
        first.cast_signed() - enters.cast_signed()
    }
}

/// The best way from one take to another.
struct Transition {
    closest: Closest,
    /// Brings the second take to the first.
    alignment: nalgebra::Isometry3<f64>,
    /// Frames that are blended.
    blend: usize,
}

impl Transition {
    /// The takes with their numbers, from 0.
    fn between(body: &Humanoid, takes: [(usize, &Take); 2], settings: &JoinSettings) -> Result<Self, EditError> {
        let [(_, from), (to_index, to)] = takes;
        let rate = from.motion.frames_per_second;
        let blend = libm::round(settings.blend_s * rate).max(1.0) as usize;
        for (index, take) in takes {
            let (frames, needed) = (take.motion.poses.len(), 2 * blend + 2);
            if frames < needed {
                let take = take.name.clone();
                return Err(EditError::Short { index, take, frames_per_second: rate, frames, needed });
            }
        }
        let own = PoseClouds::new(body, &from.motion, blend);
        let other = PoseClouds::new(body, &to.motion, blend);
        let leaving = (from.motion.poses.len() / 2).max(blend).min(own.len() - 1)..own.len();
        let entering = 0..(to.motion.poses.len() / 2 - blend / 2).clamp(1, other.len());
        // a take that follows itself shows a third of itself at least: else two frames beside its middle would be the
        // most alike, and what moves slowly would stutter between them
        let least_shown = if std::ptr::eq(from, to) { from.motion.poses.len() / 3 } else { 0 };
        let closest = nearest((&own, leaving), (&other, entering), least_shown);
        if closest.distance_m > settings.within_mm / 1000.0 {
            return Err(EditError::Apart {
                index: to_index,
                from: from.name.clone(),
                to: to.name.clone(),
                closest_mm: 1000.0 * closest.distance_m,
                leaves_s: closest.leaves as f64 / rate,
                enters_s: closest.enters as f64 / rate,
                limit_mm: settings.within_mm,
            });
        }
        let alignment = own.alignment(closest.leaves, &other, closest.enters);
        Ok(Self { closest, alignment, blend })
    }
}

/// The transition of these frames that keeps most frames among those nearly as near as the nearest.
fn nearest(
    (own, leaving): (&PoseClouds, std::ops::Range<usize>),
    (other, entering): (&PoseClouds, std::ops::Range<usize>),
    least_shown: usize,
) -> Closest {
    let is_allowed = |leaves: usize, enters: usize| least_shown == 0 || leaves >= enters + least_shown;
    let step = |range: &std::ops::Range<usize>| range.len().div_ceil(MOST_COMPARED).max(1);
    let (over, under) = (step(&leaving), step(&entering));
    let mut pairs: Vec<Closest> = Vec::new();
    for leaves in leaving.clone().step_by(over) {
        for enters in entering.clone().step_by(under).filter(|enters| is_allowed(leaves, *enters)) {
            pairs.push(Closest { leaves, enters, distance_m: own.distance_m(leaves, other, enters) });
        }
    }
    let least = pairs.iter().map(|pair| pair.distance_m).fold(f64::INFINITY, f64::min);
    let kept = |pair: &&Closest| pair.leaves.cast_signed() - pair.enters.cast_signed();
    let good = pairs.iter().filter(|pair| pair.distance_m <= AS_GOOD * least);
    let best = good.max_by_key(kept).copied();
    let mut best = best.unwrap_or(Closest { leaves: leaving.start, enters: entering.start, distance_m: f64::INFINITY });
    // the frames between those that were compared
    let around = |at: usize, step: usize, range: &std::ops::Range<usize>| {
        at.saturating_sub(step).max(range.start)..(at + step).min(range.end)
    };
    for leaves in around(best.leaves, over, &leaving) {
        for enters in around(best.enters, under, &entering).filter(|enters| is_allowed(leaves, *enters)) {
            let distance_m = own.distance_m(leaves, other, enters);
            if distance_m < best.distance_m {
                best = Closest { leaves, enters, distance_m };
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::editing::blending::moved;
    use crate::test_bodies::{person, walk};

    fn take(name: &str, frames: std::ops::Range<usize>) -> Take {
        let mut motion = walk(frames.end);
        motion.poses.drain(..frames.start);
        Take { name: name.to_owned(), motion: motion.made_continuous(&person()) }
    }

    #[test]
    fn two_overlapping_parts_of_one_walk_are_joined_to_that_walk() {
        let (body, whole) = (person(), take("whole", 0..200));
        let (first, mut second) = (take("first", 0..120), take("second", 60..200));
        let elsewhere = Isometry3::new(Vector3::new(5.0, 1.0, 0.0), Vector3::z() * 1.2);
        second.motion.poses.iter_mut().for_each(|pose| *pose = moved(pose, &elsewhere));
        let made = joined(&body, &[first, second], &JoinSettings::default()).unwrap();
        let [seam] = &made.seams[..] else { panic!("one seam") };
        assert!(seam.distance_m < 1e-6, "{seam:?}");
        assert_eq!((seam.from.0.as_str(), seam.to.0.as_str()), ("first", "second"));
        assert!(seam.from.1 >= 60 && seam.end - seam.first > 1);
        for (frame, pose) in made.motion.poses.iter().enumerate() {
            // a walk in place repeats itself, so another phase of it may have been entered
            let of = if frame < seam.first { frame } else { 60 + seam.to.1 + frame - seam.first };
            let expected = &whole.motion.poses[of];
            assert!((&pose.joint_angles - &expected.joint_angles).norm() < 1e-6, "frame {frame}");
        }
    }

    #[test]
    fn a_repeated_take_lasts_as_long_as_asked_and_never_jumps() {
        let (body, part) = (person(), take("part", 0..150));
        let duration = 4.0 * part.motion.duration_s();
        let made = repeated(&body, &part, duration, &JoinSettings::default()).unwrap();
        let frames = (duration * part.motion.frames_per_second).ceil() as usize + 1;
        assert_eq!(made.motion.poses.len(), frames);
        assert!(made.seams.len() >= 3, "{}", made.seams.len());
        let step = |pair: &[crate::body::Pose]| (&pair[1].joint_angles - &pair[0].joint_angles).amax();
        let greatest = |motion: &Motion| motion.poses.windows(2).map(step).fold(0.0, f64::max);
        assert!(greatest(&made.motion) < 1.2 * greatest(&part.motion));
    }

    /// Frames beside the middle of a slow take are more alike than its end and its beginning.
    #[test]
    fn a_slow_take_is_repeated_by_a_third_of_itself_at_least_and_does_not_stutter() {
        let body = person();
        let mut slow = take("slow", 0..150);
        let first = slow.motion.poses[0].clone();
        for (frame, pose) in slow.motion.poses.iter_mut().enumerate() {
            *pose = first.clone();
            pose.joint_angles[0] += 0.001 * frame as f64;
        }
        let made = repeated(&body, &slow, 3.0 * slow.motion.duration_s(), &JoinSettings::default()).unwrap();
        for seam in &made.seams {
            assert!(seam.from.1 >= seam.to.1 + 50, "{seam:?}");
        }
        assert!((2..=8).contains(&made.seams.len()), "{}", made.seams.len());
    }

    #[test]
    fn seams_within_takes_are_where_their_frames_are_in_the_joined_motion() {
        let (body, part) = (person(), take("part", 0..150));
        let repeats = |times: f64, name: &str| {
            let made = repeated(&body, &part, times * part.motion.duration_s(), &JoinSettings::default()).unwrap();
            (Take { name: name.to_owned(), motion: made.motion }, made.seams)
        };
        let ((first, of_first), (second, of_second)) = (repeats(3.0, "first"), repeats(4.0, "second"));
        let takes = [first, second];
        let made = joined(&body, &takes, &JoinSettings::default()).unwrap();
        let between = made.seams[0].clone();
        let of_frames = made.takes_of_frames();
        assert_eq!((of_frames[between.first], of_frames[between.end]), (0, 1));
        let made = made.with_seams_of_takes(vec![of_first, of_second.clone()]);
        assert!(made.seams.windows(2).all(|pair| pair[0].end <= pair[1].first), "{:?}", made.seams);
        let later: Vec<&Seam> = made.seams.iter().filter(|seam| seam.first > between.first).collect();
        assert!(later.len() >= 2, "{:?}", made.seams);
        for (seam, own) in later.iter().rev().zip(of_second.iter().rev()) {
            let (there, here) = (&takes[1].motion.poses[own.first], &made.motion.poses[seam.first]);
            assert!((&there.joint_angles - &here.joint_angles).amax() < 1e-9);
            assert_eq!(seam.end - seam.first, own.end - own.first);
        }
    }

    #[test]
    fn takes_that_are_nowhere_alike_are_refused_with_the_closest_distance() {
        let (body, first) = (person(), take("stand", 0..100));
        let mut second = take("handstand", 0..100);
        let over = Isometry3::rotation(Vector3::x() * 3.0);
        second.motion.poses.iter_mut().for_each(|pose| pose.world_from_root *= over);
        let error = joined(&body, &[first.clone(), second], &JoinSettings::default()).unwrap_err().to_string();
        assert!(error.starts_with("`handstand` cannot follow `stand`") && error.contains("at most 120 mm"), "{error}");
        let mut short = first.clone();
        short.motion.poses.truncate(8);
        let error = joined(&body, &[first, short], &JoinSettings::default()).unwrap_err().to_string();
        assert!(error.contains("too short to be joined") && error.contains("found 0.13 s (8 frames)"), "{error}");
    }
}
