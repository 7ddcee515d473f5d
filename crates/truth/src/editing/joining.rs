//! Joins takes by transitions, as the edges of a motion graph (`[Kovar 2002]`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::blending::continue_with;
use super::{Closest, EditError, PoseClouds};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::input::plain;

/// Up to this many frames on either side are compared exhaustively; longer takes are subsampled, then searched around
/// the best pair.
const MAX_COMPARED: usize = 300;

/// Among transitions with at most this multiple of the least distance, the one that keeps most frames is chosen.
const ACCEPTED_RATIO: f64 = 1.25;

/// How takes are joined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JoinSettings {
    /// Duration of a blend, seconds.
    pub blend_s: f64,
    /// Greatest distance of two blended poses, millimetres: root mean square over the landmarks during the blend, after
    /// the best rotation and translation on the ground.
    pub within_mm: f64,
}

impl Default for JoinSettings {
    fn default() -> Self {
        Self { blend_s: 0.3, within_mm: 120.0 }
    }
}

/// A named motion to be joined.
#[derive(Clone, Debug, PartialEq)]
pub struct Take {
    /// Name, used in messages.
    pub name: String,
    /// A continuous motion; all takes have the same body and frame rate.
    pub motion: Motion,
}

/// A transition from one take to another in a joined motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// First blended frame of the joined motion.
    pub first: usize,
    /// The frame after the last blended one.
    pub end: usize,
    /// Distance between the two poses, metres, after the best rotation and translation on the ground.
    pub distance_m: f64,
    /// Name of the first take, and its frame at the transition.
    pub from: (String, usize),
    /// Name of the following take, and its frame at the transition.
    pub to: (String, usize),
}

/// A motion joined from takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Joined {
    /// The continuous motion.
    pub motion: Motion,
    /// Its seams, in order.
    pub seams: Vec<Seam>,
}

/// Joins takes in order, each rotated and translated on the ground to continue the previous one. Transitions lead from
/// the second half of a take to the first half of the next, where their poses are closest; among nearly equal ones, the
/// transition that keeps most frames is chosen.
pub fn joined(body: &Humanoid, takes: &[Take], settings: &JoinSettings) -> Result<Joined, EditError> {
    let Some(first) = takes.first() else {
        return Ok(Joined { motion: Motion { frames_per_second: 1.0, poses: Vec::new() }, seams: Vec::new() });
    };
    let mut joined = Joined { motion: first.motion.clone(), seams: Vec::new() };
    // frame of the joined motion that corresponds to the current take's frame 0
    let mut begin = 0_isize;
    for (index, pair) in takes.windows(2).enumerate() {
        let transition = Transition::between(body, [(index, &pair[0]), (index + 1, &pair[1])], settings)?;
        begin = joined.append(body, begin, &pair[0], &pair[1], &transition);
    }
    joined.motion = joined.motion.made_continuous(body);
    Ok(joined)
}

/// Repeats a take until it lasts at least `duration_s`, rounded up to a frame, by the best transition from its second
/// half back to its first that keeps at least a third of it.
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
    /// Adds each take's own seams, given in frames of that take, where they are kept by the transitions between takes.
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

    /// Index of the take of each frame; the take changes at the middle of a blend. Requires that all seams are between
    /// takes.
    pub fn takes_of_frames(&self) -> Vec<usize> {
        let middles: Vec<usize> = self.seams.iter().map(|seam| usize::midpoint(seam.first, seam.end)).collect();
        (0..self.motion.poses.len()).map(|frame| middles.iter().filter(|middle| **middle <= frame).count()).collect()
    }

    /// Truncates to `frames` frames, and drops seams that begin later.
    pub fn cut(&mut self, frames: usize) {
        self.motion.poses.truncate(frames);
        self.seams.retain(|seam| seam.first < frames);
        self.seams.iter_mut().for_each(|seam| seam.end = seam.end.min(frames));
    }

    /// Continues from take `from`, whose frame 0 is at frame `begin`, with take `to`. Returns the frame of its frame 0.
    fn append(&mut self, body: &Humanoid, begin: isize, from: &Take, to: &Take, transition: &Transition) -> isize {
        let Closest { leaves, enters, distance_m } = transition.closest;
        let first = begin.saturating_add_unsigned(leaves).max(0).unsigned_abs();
        let here = self.motion.poses[first].world_from_root;
        let there = from.motion.poses[leaves].world_from_root;
        // the first take may itself have been moved
        let world_from_take = here * there.inverse();
        let world_from_next = super::transfer::on_ground(&world_from_take) * transition.alignment;
        continue_with(body, &mut self.motion, first, &to.motion, enters, &world_from_next, transition.blend);
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

/// The best transition from one take to another.
struct Transition {
    closest: Closest,
    /// Aligns the second take with the first.
    alignment: nalgebra::Isometry3<f64>,
    /// Number of blended frames.
    blend: usize,
}

impl Transition {
    /// Finds the best transition between two takes, given with their indices.
    fn between(body: &Humanoid, takes: [(usize, &Take); 2], settings: &JoinSettings) -> Result<Self, EditError> {
        let [(_, from), (to_index, to)] = takes;
        let rate = from.motion.frames_per_second;
        let blend = libm::round(settings.blend_s * rate).max(1.0) as usize;
        for (index, take) in takes {
            let (frames, needed) = (take.motion.poses.len(), 2 * blend + 2);
            if frames < needed {
                let problem = format!(
                    "`{}` is too short to be joined: expected at least {:.2} s ({needed} frames at {rate} Hz), twice the \
                     duration of a blend, found {:.2} s ({frames} frames); use a longer part of it, or reduce `join.blend_s`",
                    plain(&take.name),
                    needed as f64 / rate,
                    frames as f64 / rate
                );
                return Err(EditError::Take { index, problem });
            }
        }
        let own = PoseClouds::new(body, &from.motion, blend);
        let other = PoseClouds::new(body, &to.motion, blend);
        let leaving = (from.motion.poses.len() / 2).max(blend).min(own.len() - 1)..own.len();
        let entering = 0..(to.motion.poses.len() / 2 - blend / 2).clamp(1, other.len());
        // a repeated take must show at least a third of itself: otherwise two frames near its middle would be the
        // closest, and a slow motion would stutter between them
        let min_shown = if std::ptr::eq(from, to) { from.motion.poses.len() / 3 } else { 0 };
        let closest = nearest((&own, leaving), (&other, entering), min_shown);
        if closest.distance_m > settings.within_mm / 1000.0 {
            let (from, to) = (plain(&from.name), plain(&to.name));
            let problem = format!(
                "`{to}` cannot follow `{from}`: their closest poses, at {:.2} s of `{from}` and {:.2} s of `{to}`, are \
                 {:.0} mm apart, expected at most {:.0} mm; use more similar takes or parts of takes, insert another take \
                 between them, or increase `join.within_mm`",
                closest.leaves as f64 / rate,
                closest.enters as f64 / rate,
                1000.0 * closest.distance_m,
                settings.within_mm
            );
            return Err(EditError::Take { index: to_index, problem });
        }
        let alignment = own.alignment(closest.leaves, &other, closest.enters);
        Ok(Self { closest, alignment, blend })
    }
}

/// Among the pairs of frames nearly as close as the closest, the one that keeps most frames.
fn nearest(
    (own, leaving): (&PoseClouds, std::ops::Range<usize>),
    (other, entering): (&PoseClouds, std::ops::Range<usize>),
    min_shown: usize,
) -> Closest {
    let is_allowed = |leaves: usize, enters: usize| min_shown == 0 || leaves >= enters + min_shown;
    let step = |range: &std::ops::Range<usize>| range.len().div_ceil(MAX_COMPARED).max(1);
    let (over, under) = (step(&leaving), step(&entering));
    let mut pairs: Vec<Closest> = Vec::new();
    for leaves in leaving.clone().step_by(over) {
        for enters in entering.clone().step_by(under).filter(|enters| is_allowed(leaves, *enters)) {
            pairs.push(Closest { leaves, enters, distance_m: own.distance_m(leaves, other, enters) });
        }
    }
    let smallest_m = pairs.iter().map(|pair| pair.distance_m).fold(f64::INFINITY, f64::min);
    let kept = |pair: &&Closest| pair.leaves.cast_signed() - pair.enters.cast_signed();
    let good = pairs.iter().filter(|pair| pair.distance_m <= ACCEPTED_RATIO * smallest_m);
    let best = good.max_by_key(kept).copied();
    let mut best = best.unwrap_or(Closest { leaves: leaving.start, enters: entering.start, distance_m: f64::INFINITY });
    // refine between the compared frames
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
    fn overlapping_parts_of_a_walk_are_joined_to_that_walk() {
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
            // a walk in place is periodic, so the transition may lead to another period
            let of = if frame < seam.first { frame } else { 60 + seam.to.1 + frame - seam.first };
            let expected = &whole.motion.poses[of];
            assert!((&pose.joint_angles - &expected.joint_angles).norm() < 1e-6, "frame {frame}");
        }
    }

    #[test]
    fn a_repeated_take_has_the_requested_duration_and_no_jumps() {
        let (body, part) = (person(), take("part", 0..150));
        let duration = 4.0 * part.motion.duration_s();
        let made = repeated(&body, &part, duration, &JoinSettings::default()).unwrap();
        let frames = (duration * part.motion.frames_per_second).ceil() as usize + 1;
        assert_eq!(made.motion.poses.len(), frames);
        assert!(made.seams.len() >= 3, "{}", made.seams.len());
        let step = |pair: &[skiagraph_core::body::Pose]| (&pair[1].joint_angles - &pair[0].joint_angles).amax();
        let greatest = |motion: &Motion| motion.poses.windows(2).map(step).fold(0.0, f64::max);
        assert!(greatest(&made.motion) < 1.2 * greatest(&part.motion));
    }

    /// In a slow take, frames near the middle are closer than its end and its beginning.
    #[test]
    fn a_repeated_slow_take_shows_at_least_a_third_of_itself() {
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
    fn seams_within_takes_are_mapped_to_the_joined_motion() {
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
    fn dissimilar_takes_are_refused_with_the_closest_distance() {
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
