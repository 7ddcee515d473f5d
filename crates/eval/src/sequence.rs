//! The input of metrics: one estimated sequence with its truth.

use std::ops::Range;

use nalgebra::{Point3, UnitQuaternion};

use super::MarkerList;
use skiagraph_core::body::LANDMARKS;
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::contact::GroundContacts;

/// Truth and estimate of one clip, frame by frame. All slices have one entry per frame and the same length.
#[derive(Clone, Copy, Debug)]
pub struct Sequence<'a> {
    /// Frames per second, > 0.
    pub frames_per_second: f64,
    /// The first scored frame. Every metric leaves out the frames before it. This is 1 if the tracker was given the
    /// pose of frame 0, else 0.
    pub first_scored: usize,
    /// Whether there is a truth. Without one, as of a recording, `truth_markers` has no marker, and only metrics of the
    /// images and of the estimate alone are measured.
    pub has_truth: bool,
    /// HumanEva's markers on the actor, metres.
    pub truth_markers: MarkerList<'a>,
    /// The estimated markers, metres; all `None` in a frame without an estimate.
    pub estimate_markers: MarkerList<'a>,
    /// Rotations of the root link, if known.
    pub roots: Option<RootRotations<'a>>,
    /// `[frame][view]`: overlap of the estimate's silhouette with the observed one
    /// ([`super::intersection_over_union`]), if known.
    pub view_overlaps: Option<&'a [Vec<Option<f64>>]>,
    /// `[frame][view]`: overlap of the estimate's silhouette with the actor's exact one, both in the true cameras, if
    /// the observed ones are not exact.
    pub exact_overlaps: Option<&'a [Vec<Option<f64>>]>,
    /// `[frame][view]`: agreement of the outlines of those silhouettes ([`super::SilhouetteOutline::agreement`]), if
    /// known.
    pub view_boundaries: Option<&'a [Vec<Option<f64>>]>,
    /// Distance of the estimate's points from the keypoints found in the images, pixels, by frame; `None` in a frame
    /// without any, and altogether if they are not compared.
    pub keypoint_residuals_px: Option<&'a [Option<f64>]>,
    /// The cameras and the markers that they see, if known.
    pub views: Option<Views<'a>>,
    /// Rotations of the parts of the body, if known.
    pub parts: Option<PartRotations<'a>>,
    /// Energies under the tracker's own likelihood or skiagraph's, if known.
    pub energies: Option<Energies<'a>>,
    /// Contact in truth and estimate, if known.
    pub contacts: Option<ContactPair<'a>>,
}

/// Cameras and the actor's markers in their images.
#[derive(Clone, Copy, Debug)]
pub struct Views<'a> {
    /// The true cameras; moving ones in their state of frame 0.
    pub cameras: &'a [Camera],
    /// The cameras of every frame if any moves, else empty.
    pub moved: &'a [CameraRig],
    /// `[frame][camera][marker]`: inside the image.
    pub in_view: &'a [&'a [[bool; LANDMARKS.len()]]],
    /// `[frame][camera][marker]`: inside the image and not hidden.
    pub visible: &'a [&'a [[bool; LANDMARKS.len()]]],
}

impl Views<'_> {
    pub(super) fn camera(&self, camera: usize, frame: usize) -> &Camera {
        self.moved.get(frame).and_then(|rig| rig.cameras.get(camera)).unwrap_or(&self.cameras[camera])
    }
}

/// Number of body parts with rotations: the root, both thighs, shanks, upper arms and forearms.
pub const PARTS: usize = 9;

/// World rotations of parts relative to their rotation at the zero pose, one list per frame, in the order root, left
/// and right thigh, left and right shank, left and right upper arm, left and right forearm; `None` for parts that a
/// body lacks and frames without a pose.
#[derive(Clone, Copy, Debug)]
pub struct PartRotations<'a> {
    /// Of the actor.
    pub truth: &'a [[Option<UnitQuaternion<f64>>; PARTS]],
    /// Of the estimate.
    pub estimate: &'a [[Option<UnitQuaternion<f64>>; PARTS]],
}

/// Contact of actor and estimate.
#[derive(Clone, Copy, Debug)]
pub struct ContactPair<'a> {
    /// Of the actor.
    pub truth: ContactMeasures<'a>,
    /// Of the estimate, if its poses are known.
    pub estimate: Option<ContactMeasures<'a>>,
}

/// Contact of one body, computed with its own solids. All lists have one entry per frame.
#[derive(Clone, Copy, Debug)]
pub struct ContactMeasures<'a> {
    /// The ground.
    pub ground: &'a GroundContacts,
    /// Deepest self-collision, metres.
    pub self_depth_m: &'a [f64],
    /// Depth inside the props, metres, if there are any.
    pub prop_depth_m: Option<&'a [f64]>,
    /// Frames in which its pose is known and the other lists are valid; `None`: all. Stretches between frames without a
    /// pose are measured separately.
    pub known: Option<&'a [bool]>,
}

impl ContactMeasures<'_> {
    /// Whether the pose is known in `frame` and in all frames of the sequence within `reach` of it.
    pub fn is_known(&self, frame: usize, reach: usize) -> bool {
        self.known.is_none_or(|known| {
            let end = known.len().min(frame + reach + 1);
            known[frame.saturating_sub(reach).min(end)..end].iter().all(|known| *known)
        })
    }

    fn lengths(&self) -> Vec<usize> {
        let tracks = self.ground.links.iter().chain(&self.ground.feet);
        let mut lengths: Vec<usize> = tracks.map(|track| track.frames.len()).collect();
        lengths.push(self.self_depth_m.len());
        lengths.extend(self.prop_depth_m.map(<[f64]>::len));
        lengths.extend(self.known.map(<[bool]>::len));
        lengths
    }
}

/// World rotations of actor and estimate: of the body's axes X forward, Y left, Z up, which are fixed to the root
/// ([`skiagraph_core::body::Humanoid::root_from_body`]), whatever the axes of the root link.
#[derive(Clone, Copy, Debug)]
pub struct RootRotations<'a> {
    /// Of the actor.
    pub truth: &'a [UnitQuaternion<f64>],
    /// Of the estimate; `None` in a frame without an estimate.
    pub estimate: &'a [Option<UnitQuaternion<f64>>],
}

/// Energies of one likelihood; lower is a better fit.
#[derive(Clone, Copy, Debug)]
pub struct Energies<'a> {
    /// At the truth refitted to the tracker's body.
    pub truth: &'a [Option<f64>],
    /// At the estimate.
    pub estimate: &'a [Option<f64>],
    /// Whether it is the tracker's own likelihood; else skiagraph's, with its default settings, on the set's body.
    pub is_own: bool,
}

/// Errors of evaluation.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum EvaluationError {
    /// The sequence cannot be measured.
    #[error("{0}")]
    Sequence(String),
    /// There is no run to summarise.
    #[error("no run to summarise")]
    NoRun,
    /// A table of values could not be written.
    #[error("cannot write the table of frames: {0}")]
    Write(String),
}

impl<'a> Sequence<'a> {
    /// A sequence with marker positions only; frame 0 is left out.
    pub fn from_markers(
        frames_per_second: f64,
        truth: impl Into<MarkerList<'a>>,
        estimate: impl Into<MarkerList<'a>>,
    ) -> Self {
        Self {
            frames_per_second,
            first_scored: 1,
            has_truth: true,
            truth_markers: truth.into(),
            estimate_markers: estimate.into(),
            roots: None,
            view_overlaps: None,
            exact_overlaps: None,
            view_boundaries: None,
            keypoint_residuals_px: None,
            views: None,
            parts: None,
            energies: None,
            contacts: None,
        }
    }

    /// Number of frames, including those left out.
    pub fn frames(&self) -> usize {
        self.truth_markers.len()
    }

    /// The scored frames.
    pub fn scored(&self) -> Range<usize> {
        self.first_scored..self.frames()
    }

    /// Markers that both truth and estimate have at `frame`: landmark index, truth, estimate; metres.
    pub fn pairs(&self, frame: usize) -> impl Iterator<Item = (usize, Point3<f64>, Point3<f64>)> {
        let (truth, estimate) = (self.truth_markers, self.estimate_markers);
        let pair = move |landmark| Some((landmark, truth.get(frame, landmark)?, estimate.get(frame, landmark)?));
        (0..LANDMARKS.len()).filter_map(pair)
    }

    /// Whether `frame` has no estimate.
    pub fn is_lost(&self, frame: usize) -> bool {
        (0..LANDMARKS.len()).all(|landmark| self.estimate_markers.get(frame, landmark).is_none())
    }

    /// Distance of every common marker at `frame`, millimetres.
    pub fn distances_mm(&self, frame: usize) -> impl Iterator<Item = f64> {
        self.pairs(frame).map(|(_, truth, estimate)| 1000.0 * (estimate - truth).norm())
    }

    /// One value per frame: `value(frame)` for scored frames, `None` for others.
    pub fn per_scored_frame(&self, value: impl Fn(usize) -> Option<f64>) -> Vec<Option<f64>> {
        (0..self.frames()).map(|frame| if frame < self.first_scored { None } else { value(frame) }).collect()
    }

    /// Checks that the lists have the same length, and that markers, overlaps, agreements and energies are finite.
    ///
    /// # Errors
    /// The first disagreement, as an [`EvaluationError`].
    pub fn check(&self) -> Result<(), EvaluationError> {
        if !(self.frames_per_second.is_finite() && self.frames_per_second > 0.0) {
            let rate = self.frames_per_second;
            return refused(format!("frame rate {rate} is not a positive number of frames per second"));
        }
        self.check_lengths()?;
        self.check_finite()?;
        let in_common = self.scored().any(|frame| self.pairs(frame).next().is_some());
        // an estimate that lost every frame can be measured; one with other markers cannot
        let lost = self.scored().all(|frame| self.is_lost(frame));
        let asked = self.scored().any(|frame| self.truth_markers.count(frame) > 0);
        if !self.has_truth || in_common || (lost && asked) {
            return Ok(());
        }
        refused("truth and estimate have no common marker in any frame: nothing can be compared".to_owned())
    }

    fn check_lengths(&self) -> Result<(), EvaluationError> {
        let expected = self.frames();
        if self.scored().is_empty() {
            let left_out = self.first_scored;
            return refused(format!(
                "no frame to score: {expected} frames, of which the first {left_out} are left out"
            ));
        }
        let lengths = [
            ("estimated markers", Some(self.estimate_markers.len())),
            ("true root rotations", self.roots.map(|r| r.truth.len())),
            ("estimated root rotations", self.roots.map(|r| r.estimate.len())),
            ("silhouette overlaps", self.view_overlaps.map(<[_]>::len)),
            ("overlaps with the exact silhouettes", self.exact_overlaps.map(<[_]>::len)),
            ("agreement of outlines", self.view_boundaries.map(<[_]>::len)),
            ("residuals of keypoints", self.keypoint_residuals_px.map(<[_]>::len)),
            ("markers in the images", self.views.map(|v| v.in_view.len())),
            ("visible markers", self.views.map(|v| v.visible.len())),
            ("cameras that move", self.views.map(|v| v.moved.len()).filter(|frames| *frames > 0)),
            ("true rotations of parts", self.parts.map(|p| p.truth.len())),
            ("estimated rotations of parts", self.parts.map(|p| p.estimate.len())),
            ("energies at the truth", self.energies.map(|e| e.truth.len())),
            ("energies at the estimate", self.energies.map(|e| e.estimate.len())),
        ];
        let truth = self.contacts.map(|pair| ("true contacts", pair.truth));
        let estimate = self.contacts.and_then(|pair| Some(("estimated contacts", pair.estimate?)));
        let bodies = truth.into_iter().chain(estimate);
        let contacts = bodies.flat_map(|(what, body)| body.lengths().into_iter().map(move |found| (what, Some(found))));
        for (what, found) in lengths.into_iter().chain(contacts) {
            if let Some(found) = found.filter(|found| *found != expected) {
                return refused(format!(
                    "{what}: {found} frames, but the truth has {expected}; give one entry per frame of the truth"
                ));
            }
        }
        Ok(())
    }

    fn check_finite(&self) -> Result<(), EvaluationError> {
        for frame in 0..self.frames() {
            let broken = |what: String| refused(format!("set frame {frame} (from 0): {what} is not a finite number"));
            for (who, markers) in [("true", self.truth_markers), ("estimated", self.estimate_markers)] {
                for (index, landmark) in LANDMARKS.iter().enumerate() {
                    if markers.get(frame, index).is_some_and(|p| !p.iter().all(|x| x.is_finite())) {
                        return broken(format!("the {who} {}", landmark.name()));
                    }
                }
            }
            let views = [self.view_overlaps, self.exact_overlaps, self.view_boundaries].into_iter().flatten();
            let numbers = views.flat_map(|views| &views[frame]).copied();
            let energies = self.energies.map_or([None, None], |e| [e.truth[frame], e.estimate[frame]]);
            if numbers.chain(energies).flatten().any(|x| !x.is_finite()) {
                return broken("an overlap, an agreement of outlines or an energy".to_owned());
            }
        }
        Ok(())
    }
}

fn refused(message: String) -> Result<(), EvaluationError> {
    Err(EvaluationError::Sequence(message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::Markers;

    fn still(frames: usize) -> Vec<Markers> {
        vec![[Some(Point3::origin()); 15]; frames]
    }

    fn refusal(frames_per_second: f64, truth: &[Markers], estimate: &[Markers]) -> String {
        Sequence::from_markers(frames_per_second, truth, estimate).check().unwrap_err().to_string()
    }

    #[test]
    fn lists_rates_and_numbers_that_cannot_be_measured_are_named() {
        let mut estimate = still(3);
        estimate[2][1] = Some(Point3::new(0.0, f64::NAN, 0.0));
        for (refused, message) in [
            (
                refusal(60.0, &still(4), &still(3)),
                "estimated markers: 3 frames, but the truth has 4; give one entry per frame of the truth",
            ),
            (refusal(60.0, &still(1), &still(1)), "no frame to score: 1 frames, of which the first 1 are left out"),
            (refusal(60.0, &still(3), &estimate), "set frame 2 (from 0): the estimated pelvis is not a finite number"),
            (refusal(0.0, &still(3), &still(3)), "frame rate 0 is not a positive number of frames per second"),
        ] {
            assert_eq!(refused, message);
        }
    }

    #[test]
    fn an_estimate_of_other_markers_cannot_be_compared_and_a_completely_lost_one_can() {
        let (mut truth, mut other, nothing) = (still(3), vec![[None; 15]; 3], vec![[None; 15]; 3]);
        truth.iter_mut().for_each(|markers| markers[4] = None);
        other.iter_mut().for_each(|markers| markers[4] = Some(Point3::origin()));
        for (truth, estimate) in [(&truth, &other), (&nothing, &truth)] {
            assert!(refusal(60.0, truth, estimate).contains("no common marker in any frame: nothing can be compared"));
        }
        assert_eq!(Sequence::from_markers(60.0, &truth, &nothing).check(), Ok(()));
    }
}
