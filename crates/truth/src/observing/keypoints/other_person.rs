//! Keypoints of other people, which a detector may take for those of the actor.

use nalgebra::Point2;

use super::KeypointSettings;
use crate::scene::{GroundTruth, SceneClock, SceneFigure};
use skiagraph_core::body::KeypointPlace;
use skiagraph_core::camera::TimedRig;

/// The points of every distractor in the order of the layout; none if the settings never exchange people.
pub(super) struct OtherPeople(Vec<Vec<Option<KeypointPlace>>>);

impl OtherPeople {
    pub(super) fn new(truth: &GroundTruth, settings: &KeypointSettings) -> Self {
        let people = truth.distractors.iter().filter(|_| settings.other_person > 0.0);
        Self(people.map(|other| other.body.keypoint_places(settings.layout)).collect())
    }

    /// The points in the image of a camera and frame of the distractor whose points are nearest to those of the actor
    /// (`exact`) there, pixels; NaN for points that are not in the image. All points are those of the moment when the
    /// first row is exposed.
    pub(super) fn nearest(
        &self,
        clock: &SceneClock<'_>,
        exposed: &TimedRig,
        [camera, frame]: [usize; 2],
        exact: &[[f64; 2]],
    ) -> Vec<[f64; 2]> {
        let nowhere = || vec![[f64::NAN; 2]; exact.len()];
        if self.0.is_empty() || !exposed.has_image(camera, frame) {
            return nowhere();
        }
        let time_s = exposed.row_s(camera, clock.truth().frames[frame].time_s, 0);
        let seen_by = exposed.camera_at(camera, time_s);
        let of_person = |(other, places): (usize, &Vec<Option<KeypointPlace>>)| {
            let links = clock.links(SceneFigure::Distractor(other), frame, time_s);
            let pixel = |place: &Option<KeypointPlace>| {
                let point = place.as_ref()?.point;
                let pixel = seen_by.project(&(links.0.get(point.link)? * point.point_in_link))?;
                seen_by.pinhole.contains(&pixel).then_some(pixel)
            };
            places.iter().map(|place| pixel(place).map_or([f64::NAN; 2], Into::into)).collect::<Vec<[f64; 2]>>()
        };
        let people = self.0.iter().enumerate().map(of_person);
        let near = |points: &Vec<[f64; 2]>| mean_distance(points, exact);
        people.min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or_else(nowhere)
    }
}

/// Mean distance of the points that both have; infinite without any.
fn mean_distance(points: &[[f64; 2]], others: &[[f64; 2]]) -> f64 {
    let apart = points.iter().zip(others).map(|(a, b)| (Point2::from(*a) - Point2::from(*b)).norm());
    let (sum, count) = apart.filter(|d| d.is_finite()).fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
    if count > 0.0 { sum / count } else { f64::INFINITY }
}
