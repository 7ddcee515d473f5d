//! Names of what cameras cannot see: angles and directions of markers whose bound is large.

use nalgebra::{DMatrix, Point3};
use serde::Serialize;

use crate::body::{Humanoid, LANDMARKS, LinkFrames, MarkerCovariances, ROOT_STEP};
use crate::camera::CameraRig;

/// An angle with a greater deviation is not seen, degrees.
const UNSEEN_DEG: f64 = 15.0;
/// A marker with a greater deviation in some direction is not seen there, millimetres.
const UNSEEN_MM: f64 = 50.0;
/// Least cosine between that direction and a camera's ray for it to be called depth.
const ALONG_THE_RAY: f64 = 0.9;
/// Stretches of fewer frames are left out.
const SHORTEST: usize = 3;
/// Names of the rotations of the whole body about its own axes.
const ROOT_TURNS: [&str; 3] = ["roll of the whole body", "pitch of the whole body", "yaw of the whole body"];

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

/// The names of what is not seen in one frame.
pub(super) struct FrameDirections(Vec<String>);

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
        let turns =
            ROOT_TURNS.iter().enumerate().filter(|(axis, _)| is_wide(3 + axis)).map(|(_, name)| (*name).to_owned());
        let degrees = body.degrees_of_freedom.iter().enumerate();
        let angles = degrees.filter(|(number, _)| is_wide(ROOT_STEP + number)).map(|(_, degree)| words(&degree.name));
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
                Some(format!("{what} of the {}", words(marker.name())))
            });
        let places = of_whole_body(places.collect());
        Self(turns.chain(angles).chain(places).collect())
    }
}

fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// One name in place of those of most markers.
fn of_whole_body(mut places: Vec<String>) -> Vec<String> {
    for what in ["depth", "place"] {
        let of_it = |name: &String| name.starts_with(what);
        if places.iter().filter(|name| of_it(name)).count() >= LANDMARKS.len() - 3 {
            places.retain(|name| !of_it(name));
            places.push(format!("{what} of the whole body"));
        }
    }
    places
}

/// What is not seen in the computed frames, by share of the frames; left and right that agree are one.
pub(super) fn unseen(all: &[FrameDirections], frames: &[usize]) -> Vec<UnseenDirection> {
    let mut names: Vec<&String> = all.iter().flat_map(|FrameDirections(names)| names).collect();
    names.sort();
    names.dedup();
    let mut found: Vec<UnseenDirection> = names.into_iter().filter_map(|name| stretches(name, all, frames)).collect();
    merge_sides(&mut found);
    found.sort_by(|a, b| b.share.total_cmp(&a.share).then_with(|| a.name.cmp(&b.name)));
    found
}

fn stretches(name: &String, all: &[FrameDirections], frames: &[usize]) -> Option<UnseenDirection> {
    let flags: Vec<(usize, bool)> =
        frames.iter().copied().zip(all.iter().map(|FrameDirections(names)| names.contains(name))).collect();
    let runs = flags.chunk_by(|a, b| a.1 == b.1).filter(|run| run[0].1 && run.len() >= SHORTEST.min(flags.len()));
    let (mut stretches, mut count) = (Vec::new(), 0);
    for run in runs {
        stretches.push([run[0].0, run[run.len() - 1].0]);
        count += run.len();
    }
    let share = count as f64 / flags.len().max(1) as f64;
    (count > 0).then(|| UnseenDirection { name: name.clone(), frames: stretches, share })
}

/// Joins left and right that are hidden in the same frames.
fn merge_sides(found: &mut Vec<UnseenDirection>) {
    let lefts: Vec<String> = found.iter().map(|f| f.name.clone()).filter(|name| name.contains("left ")).collect();
    for left in lefts {
        let right = left.replacen("left ", "right ", 1);
        let of = |name: &str| found.iter().position(|direction| direction.name == name);
        let (Some(one), Some(other)) = (of(&left), of(&right)) else { continue };
        if found[one].frames == found[other].frames {
            found[one].name = format!("{}, both", left.replacen("left ", "", 1));
            found.remove(other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(frames: &[&[&str]]) -> Vec<String> {
        let all: Vec<FrameDirections> =
            frames.iter().map(|names| FrameDirections(names.iter().map(|name| (*name).to_owned()).collect())).collect();
        let numbers: Vec<usize> = (0..frames.len()).collect();
        unseen(&all, &numbers).iter().map(UnseenDirection::describe).collect()
    }

    #[test]
    fn sides_that_agree_are_one_and_stretches_are_named_by_their_frames() {
        let twist: &[&str] = &["left shoulder rotation", "right shoulder rotation"];
        let foot: &[&str] = &["left shoulder rotation", "right shoulder rotation", "depth of the left ankle"];
        let found = of(&[twist, foot, foot, foot, twist, foot]);
        assert_eq!(found, ["shoulder rotation, both", "depth of the left ankle in frames 1 to 3"]);
        assert_eq!(of(&[&["left elbow flexion"], &[], &[], &[]]), Vec::<String>::new(), "one frame is too short");
    }

    #[test]
    fn most_markers_are_the_whole_body() {
        let all = LANDMARKS.iter().map(|marker| format!("depth of the {}", words(marker.name()))).collect();
        assert_eq!(of_whole_body(all), ["depth of the whole body"]);
        assert_eq!(of_whole_body(vec!["place of the pelvis".to_owned()]), ["place of the pelvis"]);
    }
}
