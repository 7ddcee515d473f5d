//! The start of trackers without truth: where the body is in the first frame, which way it faces, how tall it is.
//!
//! An upright body with the angles of its zero pose is enough: the filter finds the rest by its own descents.

use nalgebra::{Point2, Point3, UnitQuaternion, Vector3, center};

use super::triangulation::triangulated;
use skiagraph_core::body::{Humanoid, Keypoint, KeypointLayout, Landmark, Pose, SilhouettePainter};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::{Mask, overlap};

pub(super) const LEAST_CONFIDENCE: f64 = 0.3;
/// Statures that are estimated; others are those of raised arms or of a body that is cut off, metres.
const STATURES: std::ops::RangeInclusive<f64> = 1.3..=2.1;
/// A given stature is doubted if it differs by more than this share from that by the keypoints.
const FAR_STATURE: f64 = 0.08;
/// The stature of a person of whom nothing is known, metres.
const USUAL_STATURE: f64 = 1.72;
/// Height of the shoulders above the ankles as a share of the stature (`[Drillis 1966]`): shank, thigh and trunk.
const ANKLES_TO_SHOULDERS: f64 = 0.246 + 0.245 + 0.288;
const HEADINGS: usize = 12;

pub(super) struct FirstFrame<'a> {
    pub(super) rig: &'a CameraRig,
    pub(super) masks: &'a [Mask],
    /// By camera.
    pub(super) keypoints: Option<(KeypointLayout, &'a [Vec<Option<FoundKeypoint>>])>,
}

/// Where the hips are, metres, and which way the body faces, radians from X to Y.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    hips: Point3<f64>,
    heading: f64,
}

impl FirstFrame<'_> {
    /// The cameras that see the person, with their masks.
    fn seen(&self) -> impl Iterator<Item = (&Camera, &Mask)> {
        self.rig.cameras.iter().zip(self.masks).filter(|(_, mask)| !mask.is_empty())
    }

    fn point(&self, keypoint: Keypoint) -> Option<Point3<f64>> {
        let (layout, views) = self.keypoints?;
        let index = layout.keypoints().iter().position(|own| *own == keypoint)?;
        let views = self.rig.cameras.iter().zip(views);
        triangulated(views.filter_map(|(camera, view)| {
            let point = (*view.get(index)?)?;
            (point.confidence >= LEAST_CONFIDENCE).then_some((camera, point.pixel))
        }))
    }

    /// By hips and shoulders.
    fn by_keypoints(&self) -> Option<Place> {
        use Keypoint as K;
        let (left, right) = (self.point(K::LeftHip)?, self.point(K::RightHip)?);
        let shoulders = self.point(K::LeftShoulder).zip(self.point(K::RightShoulder));
        let across = left - right + shoulders.map_or(Vector3::zeros(), |(left, right)| left - right);
        // the body's left is Y where X is ahead
        let heading = (across.x.hypot(across.y) > 0.05).then(|| libm::atan2(-across.x, across.y))?;
        Some(Place { hips: center(&left, &right), heading })
    }

    /// The point that all cameras see in the middle of their masks.
    fn middle(&self) -> Option<Point3<f64>> {
        triangulated(self.seen().map(|(camera, mask)| {
            let (mut sum, mut count) = (Vector3::zeros(), 0.0);
            for (x, y) in mask.pixels() {
                sum += Vector3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, 0.0);
                count += 1.0;
            }
            (camera, [sum.x / count, sum.y / count])
        }))
    }

    /// Height of the person, who stands upright, by the uppermost and lowest rows of the masks; metres. `None` if no
    /// camera sees the whole person.
    pub(super) fn stature(&self) -> Option<f64> {
        let middle = self.by_keypoints().map(|place| place.hips).or_else(|| self.middle())?;
        let mut statures: Vec<f64> = Vec::new();
        for (camera, mask) in self.seen() {
            let bounds = mask.bounds();
            if bounds.top == 0 || bounds.bottom == mask.height() {
                continue;
            }
            let ends = [bounds.top, bounds.bottom].map(|row| height_at(camera, &middle, f64::from(row)));
            if let [Some(top), Some(bottom)] = ends {
                statures.push(top - bottom);
            }
        }
        statures.sort_by(f64::total_cmp);
        statures.get(statures.len() / 2).copied().filter(|stature| STATURES.contains(stature))
    }

    /// The length of shank, thigh and trunk of one side by the keypoints, metres.
    pub(super) fn length(&self, [ankle, knee, hip, shoulder]: [Keypoint; 4]) -> Option<f64> {
        let [ankle, knee, hip, shoulder] = [ankle, knee, hip, shoulder].map(|keypoint| self.point(keypoint));
        let (knee, hip) = (knee?, hip?);
        Some((ankle? - knee).norm() + (knee - hip).norm() + (hip - shoulder?).norm())
    }

    /// The stature, given or estimated, with a note if it was not given. `lengths` are those of [`Self::length`] in
    /// several frames.
    pub(super) fn stature_or_usual(&self, given: Option<f64>, mut lengths: Vec<f64>) -> (f64, Option<String>) {
        lengths.sort_by(f64::total_cmp);
        let by_keypoints = lengths.get(lengths.len() / 2).map(|length| length / ANKLES_TO_SHOULDERS);
        let by_keypoints = by_keypoints.filter(|stature| STATURES.contains(stature));
        if let (Some(given), Some(found)) = (given, by_keypoints) {
            let is_far = (given / found - 1.0).abs() > FAR_STATURE;
            let note = format!("stature: {given:.2} m as given, but {found:.2} m by the keypoints: check it");
            return (given, is_far.then_some(note));
        }
        if let Some(found) = by_keypoints {
            let note = format!("stature: {found:.2} m by the keypoints; tracker_body.stature_m sets it");
            return (found, Some(note));
        }
        match (given, self.stature()) {
            (Some(given), _) => (given, None),
            (None, Some(found)) => (
                found,
                Some(format!("stature: {found:.2} m by the masks of the first frame; tracker_body.stature_m sets it")),
            ),
            (None, None) => {
                let note =
                    format!("stature: {USUAL_STATURE} m is assumed, because no mask of the first frame tells it");
                (USUAL_STATURE, Some(note + "; tracker_body.stature_m sets it"))
            }
        }
    }

    /// The start pose of a body, and a note about how it was found; `None` if no two cameras agree about where it is.
    pub(super) fn pose(&self, body: &Humanoid, heading: Option<f64>) -> Option<(Pose, String)> {
        let by_keypoints = self.by_keypoints();
        let place = match by_keypoints {
            Some(place) => Place { heading: heading.unwrap_or(place.heading), ..place },
            None => self.by_masks(body, heading)?,
        };
        let source = if by_keypoints.is_some() { "keypoints" } else { "masks" };
        let pose = pose_at(body, place);
        let share = 100.0 * self.fit(body, &pose);
        let ambiguous = by_keypoints.is_none() && heading.is_none();
        let warning = if ambiguous { "; front and back look alike in masks: start.heading_deg sets it" } else { "" };
        let note = format!(
            "start: hips at ({:.2}, {:.2}, {:.2}) m, facing {:.0} degrees, by the {source} of the first frame; the upright \
             body covers {share:.0} % (IoU){warning}",
            place.hips.x,
            place.hips.y,
            place.hips.z,
            place.heading.to_degrees()
        );
        Some((pose, note))
    }

    /// The place whose silhouettes fit the masks best.
    fn by_masks(&self, body: &Humanoid, heading: Option<f64>) -> Option<Place> {
        let hips = self.middle()?;
        let headings: Vec<f64> = match heading {
            Some(heading) => vec![heading],
            None => (0..HEADINGS).map(|turn| std::f64::consts::TAU * turn as f64 / HEADINGS as f64).collect(),
        };
        let tried = parallel::map(headings.len(), |index| {
            self.refined(body, Place { hips, heading: headings[index] }, heading.is_none())
        });
        tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(place, _)| place)
    }

    /// A better place near this one, by a search along its coordinates, with its fit.
    fn refined(&self, body: &Humanoid, mut best: Place, turns: bool) -> (Place, f64) {
        let mut fit = self.fit(body, &pose_at(body, best));
        for step in [0.16, 0.08, 0.04, 0.02] {
            let moves = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
            for [x, y, z, turn] in moves.into_iter().take(if turns { 4 } else { 3 }) {
                for sign in [-step, step] {
                    let hips = best.hips + sign * Vector3::new(x, y, z);
                    let other = Place { hips, heading: best.heading + sign * turn };
                    let found = self.fit(body, &pose_at(body, other));
                    if found > fit {
                        (best, fit) = (other, found);
                    }
                }
            }
        }
        (best, fit)
    }

    /// Mean overlap of the body's silhouettes with the masks.
    fn fit(&self, body: &Humanoid, pose: &Pose) -> f64 {
        let frames = body.link_frames(pose);
        let of_view = |(camera, mask): (&Camera, &Mask)| {
            overlap(&SilhouettePainter::new(camera).silhouette(body, &frames), mask).iou()
        };
        self.seen().map(of_view).sum::<f64>() / self.seen().count().max(1) as f64
    }
}

/// The upright body with its hips at a place.
fn pose_at(body: &Humanoid, place: Place) -> Pose {
    let mut pose = body.standing_pose();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), place.heading);
    pose.world_from_root.rotation = turn * pose.world_from_root.rotation;
    let markers = body.markers(&body.link_frames(&pose));
    let hips = markers[Landmark::LeftHip as usize].zip(markers[Landmark::RightHip as usize]);
    let hips =
        hips.map_or(Point3::from(pose.world_from_root.translation.vector), |(left, right)| center(&left, &right));
    pose.world_from_root.translation.vector += place.hips - hips;
    pose
}

/// The height above the ground at which the vertical line through a point crosses a row of an image, metres.
fn height_at(camera: &Camera, through: &Point3<f64>, row: f64) -> Option<f64> {
    let row_of = |z: f64| camera.project(&Point3::new(through.x, through.y, z)).map(|pixel: Point2<f64>| pixel.y);
    let (mut low, mut high) = (through.z - 2.0, through.z + 2.0);
    // rows count downwards
    let is_between = row_of(low)? > row && row_of(high)? < row;
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if row_of(middle)? > row { low = middle } else { high = middle }
    }
    is_between.then_some(0.5 * (low + high))
}
