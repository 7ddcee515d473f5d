//! Names of what cameras cannot see: angles and directions of markers whose bound is large.

use std::fmt;

use nalgebra::{DMatrix, Point3};
use serde::Serialize;

use skiagraph_core::body::{Humanoid, LANDMARKS, LinkFrames, MarkerCovariances, ROOT_STEP};
use skiagraph_core::camera::CameraRig;

/// An angle with a greater deviation is not seen, degrees.
const UNSEEN_DEG: f64 = 15.0;
/// A marker with a greater deviation in some direction is not seen there, millimetres.
const UNSEEN_MM: f64 = 50.0;
/// Least cosine between that direction and a camera's ray for it to be called depth.
const ALONG_THE_RAY: f64 = 0.9;
/// Stretches of fewer frames are left out.
const SHORTEST: usize = 3;
/// The rotations of the whole body about its own axes.
const ROOT_TURNS: [&str; 3] = ["roll", "pitch", "yaw"];
/// The part of a body that is all of it.
const WHOLE: &str = "whole_body";

/// Something that the cameras cannot see.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnseenDirection {
    /// `shoulder rotation, both`, or `depth of the left ankle`.
    pub name: String,
    /// First and last frame of every stretch of computed frames, from 0.
    pub frames: Vec<[usize; 2]>,
    /// Share of the computed frames.
    pub share: f64,
}

impl UnseenDirection {
    /// `depth of the left ankle in frames 30 to 42`.
    pub fn describe(&self) -> String {
        if self.share > 0.999 {
            return self.name.clone();
        }
        let stretches: Vec<String> = self.frames.iter().take(3).map(|[from, to]| format!("{from} to {to}")).collect();
        let more = match self.frames.len().saturating_sub(3) {
            0 => String::new(),
            more => format!(" and {more} more stretches"),
        };
        format!("{} in frames {}{more}", self.name, stretches.join(", "))
    }
}

/// An angle, or a direction of a part of the body.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Direction {
    /// `roll`, `depth` or `place`; empty for the angle of a joint.
    what: &'static str,
    /// The joint, the marker or the whole body.
    part: String,
}

impl Direction {
    fn new(what: &'static str, part: &str) -> Self {
        Self { what, part: part.to_owned() }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = if self.what.is_empty() { "" } else { " of the " };
        write!(f, "{}{of}{}", self.what, self.part.replace('_', " "))
    }
}

pub(super) struct FrameDirections(Vec<Direction>);

impl FrameDirections {
    /// From the covariance of the pose and those of the markers, for links at `frames`.
    pub(super) fn new(
        body: &Humanoid,
        frames: &LinkFrames,
        rig: &CameraRig,
        covariance: &DMatrix<f64>,
        markers: &MarkerCovariances,
    ) -> Self {
        let is_wide = |number: usize| covariance[(number, number)].max(0.0).sqrt().to_degrees() > UNSEEN_DEG;
        let turns = ROOT_TURNS.iter().enumerate().filter(|(axis, _)| is_wide(3 + axis));
        let turns = turns.map(|(_, what)| Direction::new(what, WHOLE));
        let degrees = body.degrees_of_freedom.iter().enumerate();
        let angles = degrees
            .filter(|(number, _)| is_wide(ROOT_STEP + number))
            .map(|(_, degree)| Direction::new("", &degree.name));
        let places =
            LANDMARKS.iter().zip(markers).zip(body.markers(frames)).filter_map(|((marker, covariance), place)| {
                let eigen = (*covariance)?.symmetric_eigen();
                let widest = eigen.eigenvalues.imax();
                if 1000.0 * eigen.eigenvalues[widest].max(0.0).sqrt() <= UNSEEN_MM {
                    return None;
                }
                let along = eigen.eigenvectors.column(widest);
                let is_depth = rig.cameras.iter().any(|camera| {
                    let centre = camera.camera_from_world.inverse() * Point3::origin();
                    place.is_some_and(|place| (place - centre).normalize().dot(&along).abs() > ALONG_THE_RAY)
                });
                let what = if is_depth { "depth" } else { "place" };
                Some(Direction::new(what, marker.name()))
            });
        let places = of_whole_body(places.collect());
        Self(turns.chain(angles).chain(places).collect())
    }
}

/// One direction in place of those of most markers.
fn of_whole_body(mut places: Vec<Direction>) -> Vec<Direction> {
    for what in ["depth", "place"] {
        if places.iter().filter(|direction| direction.what == what).count() >= LANDMARKS.len() - 3 {
            places.retain(|direction| direction.what != what);
            places.push(Direction::new(what, WHOLE));
        }
    }
    places
}

/// What is not seen in the computed frames, by share of the frames; left and right that agree are one.
pub(super) fn unseen(all: &[FrameDirections], frames: &[usize]) -> Vec<UnseenDirection> {
    let mut directions: Vec<&Direction> = all.iter().flat_map(|FrameDirections(directions)| directions).collect();
    directions.sort();
    directions.dedup();
    let mut found: Vec<(&Direction, UnseenDirection)> = Vec::new();
    for direction in directions {
        found.extend(stretches(direction, all, frames).map(|unseen| (direction, unseen)));
    }
    merge_sides(&mut found);
    let mut found: Vec<UnseenDirection> = found.into_iter().map(|(_, unseen)| unseen).collect();
    found.sort_by(|a, b| b.share.total_cmp(&a.share).then_with(|| a.name.cmp(&b.name)));
    found
}

fn stretches(direction: &Direction, all: &[FrameDirections], frames: &[usize]) -> Option<UnseenDirection> {
    let flags: Vec<(usize, bool)> =
        frames.iter().copied().zip(all.iter().map(|FrameDirections(of)| of.contains(direction))).collect();
    let runs = flags.chunk_by(|a, b| a.1 == b.1).filter(|run| run[0].1 && run.len() >= SHORTEST.min(flags.len()));
    let (mut stretches, mut count) = (Vec::new(), 0);
    for run in runs {
        stretches.push([run[0].0, run[run.len() - 1].0]);
        count += run.len();
    }
    let share = count as f64 / flags.len().max(1) as f64;
    (count > 0).then(|| UnseenDirection { name: direction.to_string(), frames: stretches, share })
}

/// Joins left and right that are hidden in the same frames.
fn merge_sides(found: &mut Vec<(&Direction, UnseenDirection)>) {
    for right in (0..found.len()).rev() {
        let Some(part) = found[right].0.part.strip_prefix("right_") else { continue };
        let (both, left) = (Direction::new(found[right].0.what, part), format!("left_{part}"));
        let is_left = |direction: &Direction| direction.what == both.what && direction.part == left;
        let same = found.iter().position(|(of, unseen)| is_left(of) && unseen.frames == found[right].1.frames);
        if let Some(same) = same {
            found[same].1.name = format!("{both}, both");
            found.remove(right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(frames: &[&[Direction]]) -> Vec<String> {
        let all: Vec<FrameDirections> = frames.iter().map(|of| FrameDirections(of.to_vec())).collect();
        let numbers: Vec<usize> = (0..frames.len()).collect();
        unseen(&all, &numbers).iter().map(UnseenDirection::describe).collect()
    }

    #[test]
    fn sides_that_agree_are_one_and_stretches_are_named_by_their_frames() {
        let [left, right] =
            ["left_shoulder_rotation", "right_shoulder_rotation"].map(|joint| Direction::new("", joint));
        let twist = [left.clone(), right.clone()];
        let foot = [left, right, Direction::new("depth", "left_ankle")];
        let found = of(&[&twist, &foot, &foot, &foot, &twist, &foot]);
        assert_eq!(found, ["shoulder rotation, both", "depth of the left ankle in frames 1 to 3"]);
        assert_eq!(
            of(&[&[Direction::new("", "left_elbow_flexion")], &[], &[], &[]]),
            Vec::<String>::new(),
            "one frame is too short"
        );
    }

    #[test]
    fn most_markers_are_the_whole_body() {
        let all = LANDMARKS.iter().map(|marker| Direction::new("depth", marker.name())).collect();
        assert_eq!(of_whole_body(all)[0].to_string(), "depth of the whole body");
        let one = vec![Direction::new("place", "pelvis")];
        assert_eq!(of_whole_body(one.clone()), one);
    }
}
