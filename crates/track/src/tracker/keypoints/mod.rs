//! The form in which most trackers of today work: keypoints of several views are triangulated one by one, and the body
//! is fitted to the points by inverse kinematics.

mod point_filter;
mod triangulation;

use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::point_filter::{PointFilter, PointMeasurement, smoothed};
use self::triangulation::{Sighting, TriangulatedPoint, triangulate};
use super::keypoint_likelihood::fitting;
use super::{Estimate, TrackError, Tracker};
use skiagraph_core::body::inverse_kinematics::{AngleGoal, Goals, PointGoal, Solver};
use skiagraph_core::body::{Humanoid, KeypointLayout, KeypointPlace, Pose};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::{FrameKeypoints, Observation};

/// Limit on the steps of inverse kinematics in a frame.
const MOST_STEPS: usize = 50;

/// Keypoints are triangulated one by one: a weighted direct linear transform on the views that agree with most
/// confidence, found from all pairs. The tracker's body is fitted to the points by inverse kinematics, within joint
/// limits. Uses no silhouettes, and needs two cameras or more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct KeypointTrackerSettings {
    /// Keypoints with less confidence are ignored.
    pub least_confidence: f64,
    /// Greatest distance between a keypoint and the image of its point in the views that agree with it, pixels.
    pub inlier_px: f64,
    /// Weight of a radian between a joint angle and that of the last frame, as a distance in metres: it decides where
    /// no keypoint does.
    pub angle_weight_m: f64,
    /// Standard deviation of the points' acceleration in each axis, metres per squared second: a Kalman filter of
    /// nearly constant velocity filters points before the body is fitted. 0 for no filter.
    pub acceleration_m_s2: f64,
    /// Standard deviation of a triangulated point in each axis that all views see with full confidence, millimetres;
    /// for the filter.
    pub point_mm: f64,
    /// Whether, after the last frame, points are smoothed with what was seen after them as well (Rauch-Tung-Striebel).
    /// The body is fitted again to all frames. Needs `acceleration_m_s2` above 0, such as 20; not for trackers that
    /// must answer at once. Default: false.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub smooth: bool,
}

impl Default for KeypointTrackerSettings {
    fn default() -> Self {
        Self {
            least_confidence: 0.1,
            inlier_px: 10.0,
            angle_weight_m: 0.01,
            acceleration_m_s2: 0.0,
            point_mm: 20.0,
            smooth: false,
        }
    }
}

/// Triangulates keypoints and fits the body to them.
pub struct KeypointTracker {
    body: Humanoid,
    rig: CameraRig,
    settings: KeypointTrackerSettings,
    layout: KeypointLayout,
    places: Vec<Option<KeypointPlace>>,
    /// One per point; `None` until it is first seen, and without a filter.
    filters: Vec<Option<PointFilter>>,
    /// By frame, its time and the measurements of all points; only for a smoother.
    measured: Vec<(f64, Vec<Option<PointMeasurement>>)>,
    start: Option<Pose>,
    pose: Option<Pose>,
}

impl KeypointTracker {
    /// A tracker of keypoints in this layout.
    pub fn new(body: Humanoid, rig: &CameraRig, layout: KeypointLayout, settings: KeypointTrackerSettings) -> Self {
        let places = body.keypoint_places(layout);
        let filters = vec![None; places.len()];
        let measured = Vec::new();
        Self { body, rig: rig.clone(), settings, layout, places, filters, measured, start: None, pose: None }
    }

    /// The points that are seen well enough; `None` for all others.
    fn triangulated(&self, rig: &CameraRig, found: &FrameKeypoints) -> Vec<Option<TriangulatedPoint>> {
        let point = |index: usize| {
            let views = rig.cameras.iter().zip(&found.views);
            let seen = views.filter_map(|(camera, points)| {
                let point = points.get(index)?.as_ref()?;
                (point.confidence >= self.settings.least_confidence).then(|| Sighting::new(camera, point))?
            });
            triangulate(&seen.collect::<Vec<_>>(), self.settings.inlier_px)
        };
        (0..self.places.len()).map(point).collect()
    }

    fn goals(&mut self, points: &[Option<TriangulatedPoint>], time_s: f64) -> Vec<PointGoal> {
        let cameras = self.rig.cameras.len() as f64;
        if self.settings.smooth {
            let measured = |point: &Option<_>| {
                let TriangulatedPoint { place, support } = (*point)?;
                Some((place, self.settings.variance(support / cameras)))
            };
            self.measured.push((time_s, points.iter().map(measured).collect()));
        }
        let known = self.places.iter().zip(points).zip(&mut self.filters);
        let goal = |((place, point), filter): ((&Option<KeypointPlace>, &Option<TriangulatedPoint>), &mut _)| {
            let TriangulatedPoint { place: seen, support } = (*point)?;
            let share = support / cameras;
            let target = filtered(&self.settings, filter, &seen, share, time_s);
            Some(PointGoal { on: place.as_ref()?.point, target, weight: share.sqrt() })
        };
        known.filter_map(goal).collect()
    }

    /// The pose that fits the points best, near the last one.
    fn fitted(&self, points: Vec<PointGoal>, last: &Pose) -> Pose {
        let angle = |target: &f64| AngleGoal { target: *target, metres_per_unit: self.settings.angle_weight_m };
        let angles = last.joint_angles.iter().map(angle).collect();
        Solver::new(&self.body).solve(&Goals { points, angles, ..Goals::default() }, last, MOST_STEPS).pose
    }

    /// By frame, the points of the body with their smoothed goals.
    fn smoothed_goals(&self) -> Vec<Vec<PointGoal>> {
        let mut goals: Vec<Vec<PointGoal>> = vec![Vec::new(); self.measured.len()];
        for (index, place) in self.places.iter().enumerate() {
            let Some(place) = place else { continue };
            let of_point = |(time_s, points): &(f64, Vec<_>)| (*time_s, points.get(index).copied().flatten());
            let measured: Vec<_> = self.measured.iter().map(of_point).collect();
            let found = smoothed(&measured, self.settings.acceleration_m_s2);
            for (goals, (target, deviation)) in goals.iter_mut().zip(found).filter_map(|(own, at)| Some((own, at?))) {
                let weight = 1e-3 * self.settings.point_mm / deviation.max(f64::MIN_POSITIVE);
                goals.push(PointGoal { on: place.point, target, weight });
            }
        }
        goals
    }
}

impl KeypointTrackerSettings {
    /// Variance of a triangulated point in each axis, square metres, which a `share` of the greatest support has.
    fn variance(&self, share: f64) -> f64 {
        (1e-3 * self.point_mm).powi(2) / share.max(f64::MIN_POSITIVE)
    }
}

/// A point that a `share` of the greatest support has, filtered if the settings say so.
fn filtered(
    settings: &KeypointTrackerSettings,
    filter: &mut Option<PointFilter>,
    seen: &Point3<f64>,
    share: f64,
    time_s: f64,
) -> Point3<f64> {
    let variance = settings.variance(share);
    match filter {
        _ if settings.acceleration_m_s2 == 0.0 => *seen,
        Some(filter) => filter.measured(seen, variance, time_s, settings.acceleration_m_s2),
        None => {
            *filter = Some(PointFilter::new(*seen, variance, time_s));
            *seen
        }
    }
}

impl Tracker for KeypointTracker {
    fn name(&self) -> &str {
        "keypoints"
    }

    fn start(&mut self, start: &Pose) {
        self.pose = Some(start.clone());
        self.start = Some(start.clone());
        self.measured.clear();
    }

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let frame = observation.frame;
        let last = self.pose.clone().ok_or(TrackError::NotStarted { frame })?;
        let (expected, found) = (self.body.degrees_of_freedom.len(), last.joint_angles.len());
        if expected != found {
            return Err(TrackError::StartMismatch { expected, found });
        }
        let found = fitting(observation, self.layout, self.rig.cameras.len())?;
        let points = self.triangulated(&observation.rig(&self.rig), found);
        let points = self.goals(&points, observation.time_s);
        let pose = self.fitted(points, &last);
        self.pose = Some(pose.clone());
        Ok(Estimate::without_search(frame, pose))
    }

    fn look_back(&mut self, estimates: &mut [Estimate]) {
        let (true, Some(mut last)) = (self.settings.smooth, self.start.clone()) else { return };
        for (estimate, goals) in estimates.iter_mut().zip(self.smoothed_goals()) {
            last = self.fitted(goals, &last);
            estimate.pose = last.clone();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::fixture::{March, apart_mm, ring, seen_keypoints};
    use skiagraph_core::body::shipped;
    use skiagraph_core::rng::{Purpose, normal, stream};

    const MARCH: March = March { cycle: 20, advance: 0.03, hip: 0.1, knee: 0.6, abduction: 0.3, elbow: 0.5 };
    const LAYOUT: KeypointLayout = KeypointLayout::Halpe26;

    fn worst_marker_m(body: &Humanoid, a: &Pose, b: &Pose) -> f64 {
        let places = |pose: &Pose| body.markers(&body.link_frames(pose));
        let pairs = places(a).into_iter().flatten().zip(places(b).into_iter().flatten());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn exact_keypoints_of_its_own_body_are_followed_to_the_millimetre_also_with_outliers() {
        let (body, rig) = (shipped("tracker25").unwrap(), ring(4, 4.0, [640, 480]));
        let mut tracker = KeypointTracker::new(body.clone(), &rig, LAYOUT, KeypointTrackerSettings::default());
        tracker.start(&MARCH.pose(&body, 0));
        for frame in 0..30 {
            let pose = MARCH.pose(&body, frame);
            let mut observation = seen_keypoints(&body, LAYOUT, &pose, &rig, frame);
            if frame % 3 == 2 {
                let views = &mut observation.keypoints.as_mut().unwrap().views;
                views[frame % 4][13].as_mut().unwrap().pixel[0] += 100.0;
                views[(frame + 1) % 4][10] = None;
            }
            let found = tracker.track(&observation).unwrap();
            let worst = worst_marker_m(&body, &found.pose, &pose);
            assert!(worst < 0.001, "frame {frame}: {worst} m");
        }
    }

    #[test]
    fn a_smoother_lowers_the_error_of_noisy_keypoints_and_keeps_exact_ones() {
        let (body, rig) = (shipped("tracker25").unwrap(), ring(4, 4.0, [640, 480]));
        let mean_mm = |settings: KeypointTrackerSettings, noise_px: f64| {
            let mut random = stream(5, Purpose::Keypoints, 0, 0, 0);
            let mut tracker = KeypointTracker::new(body.clone(), &rig, LAYOUT, settings);
            tracker.start(&MARCH.pose(&body, 0));
            let mut estimates = Vec::new();
            for frame in 0..40 {
                let exact = seen_keypoints(&body, LAYOUT, &MARCH.pose(&body, frame), &rig, frame);
                let mut observation = Observation { time_s: frame as f64 / 30.0, ..exact };
                let views = &mut observation.keypoints.as_mut().unwrap().views;
                for found in views.iter_mut().flatten().flatten() {
                    found.pixel.iter_mut().for_each(|x| *x += noise_px * normal(&mut random));
                }
                estimates.push(tracker.track(&observation).unwrap());
            }
            tracker.look_back(&mut estimates);
            let apart = |found: &Estimate| apart_mm((&body, &found.pose), (&body, &MARCH.pose(&body, found.frame)));
            estimates.iter().map(apart).sum::<f64>() / 40.0
        };
        let raw = KeypointTrackerSettings::default();
        let filter = KeypointTrackerSettings { acceleration_m_s2: 20.0, point_mm: 12.0, ..raw };
        let smoother = KeypointTrackerSettings { smooth: true, ..filter };
        let [raw, filtered, smooth] = [raw, filter, smoother].map(|settings| mean_mm(settings, 3.0));
        assert!(smooth < 0.85 * filtered && smooth < 0.75 * raw, "{raw} {filtered} {smooth}");
        let exact = mean_mm(KeypointTrackerSettings { point_mm: 0.1, ..smoother }, 0.0);
        assert!(exact < 1.0, "{exact}");
    }

    #[test]
    fn without_points_it_stays_and_without_keypoints_or_a_start_it_says_so() {
        let (body, rig) = (shipped("tracker25").unwrap(), ring(3, 4.0, [320, 240]));
        let start = MARCH.pose(&body, 3);
        let mut tracker = KeypointTracker::new(body.clone(), &rig, LAYOUT, KeypointTrackerSettings::default());
        let mut observation = seen_keypoints(&body, LAYOUT, &start, &rig, 0);
        assert!(matches!(tracker.track(&observation), Err(TrackError::NotStarted { frame: 0 })));
        tracker.start(&start);
        observation.keypoints.as_mut().unwrap().views.iter_mut().flatten().for_each(|point| *point = None);
        assert!(worst_marker_m(&body, &tracker.track(&observation).unwrap().pose, &start) < 1e-9);
        observation.keypoints = None;
        let refused = tracker.track(&observation).unwrap_err().to_string();
        assert!(refused.contains("it has no keypoints"), "{refused}");
    }
}
