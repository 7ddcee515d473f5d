//! Finds the keypoints of the actor in the images of all cameras.

use nalgebra::{Point3, Vector3};

use super::other_person::OtherPeople;
use super::point_draws::{PointConditions, PointDraws, PointError};
use super::stretches::Stretches;
use super::{KeypointDraw, KeypointSettings, draws};
use crate::observing::Corruption;
use crate::observing::corruption::timing;
use crate::scene::{GroundTruth, SceneClock, Shot, Sight};
use skiagraph_core::body::{Humanoid, Keypoint, KeypointPlace, Landmark, LinkPoint, Markers, PairedLimb};
use skiagraph_core::camera::TimedRig;
use skiagraph_core::parallel;
use skiagraph_core::rng::{KeyedSeed, normal};

/// Frames projected together: their projections are held in memory at once.
const FRAMES_AT_A_TIME: usize = 256;
/// Parts whose left and right may be exchanged.
const LIMBS: [PairedLimb; 3] = [PairedLimb::Face, PairedLimb::Arms, PairedLimb::Legs];

/// A detector of the actor's keypoints.
pub struct KeypointDetector<'a> {
    truth: &'a GroundTruth,
    /// The nominal timed cameras.
    filming: TimedRig,
    /// The cameras at their real exposure times.
    exposed: TimedRig,
    settings: KeypointSettings,
    corruption: Corruption,
    seed: KeyedSeed,
    /// The true points.
    places: Vec<Option<KeypointPlace>>,
    /// The points as this detector defines them.
    biased: Vec<Option<KeypointPlace>>,
    /// The points of other people; none if they are never found.
    others: OtherPeople,
    /// Metres.
    stature: f64,
}

/// One point in one image: the truth, and what the detector says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointView {
    /// The exact projection at the time of exposure, pixels; NaN in front of the near plane, and without an image.
    pub exact: [f64; 2],
    /// How the camera sees the true point; out of view without an image.
    pub sight: Sight,
    /// The detected position, pixels; NaN if missing.
    pub found: [f64; 2],
    /// From 0 to 1; 0 if missing.
    pub confidence: f64,
    /// Whether the detector missed a point that is in the image.
    pub is_missed: bool,
    /// Whether left and right are exchanged: position and confidence are those of the other side's point.
    pub is_inverted: bool,
    /// Whether the position has a gross error.
    pub is_gross: bool,
    /// Whether the position is that of another person's point.
    pub is_others: bool,
}

/// The keypoints of a sequence, for T frames, C cameras and K points, each list in this order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SequenceKeypoints {
    /// World positions of the true points at the frames' times, metres (T, K); NaN for a point that the body lacks.
    pub places: Vec<[f64; 3]>,
    /// Points in images (T, C, K).
    pub views: Vec<KeypointView>,
}

/// A projected point before errors.
#[derive(Clone, Copy)]
struct Projected {
    exact: [f64; 2],
    biased: [f64; 2],
    sight: Sight,
    height_px: f64,
    /// The same point of another person; NaN if it is not in the image.
    others: [f64; 2],
}

/// The projections of one frame: (C, K), and how much each camera sees the body in profile.
struct FrameProjections {
    points: Vec<Projected>,
    profiles: Vec<f64>,
}

/// The state of the errors of one camera.
struct CameraDraws {
    points: Vec<PointDraws>,
    inversions: [Stretches; LIMBS.len()],
    other_person: Stretches,
}

const NOWHERE: [f64; 2] = [f64::NAN; 2];
const UNSEEN: Projected =
    Projected { exact: NOWHERE, biased: NOWHERE, sight: Sight::OutOfView, height_px: 0.0, others: NOWHERE };

impl<'a> KeypointDetector<'a> {
    /// A detector in images of the true cameras, with the errors of `settings`; `corruption` shifts the exposure times
    /// and drops images, as it does for silhouettes.
    pub fn new(
        truth: &'a GroundTruth,
        rig: &TimedRig,
        settings: KeypointSettings,
        corruption: Corruption,
        seed: KeyedSeed,
    ) -> Self {
        let places = truth.actor.keypoint_places(settings.layout);
        Self {
            truth,
            filming: rig.clone(),
            exposed: timing::exposed(rig, &corruption, seed),
            biased: biased(&truth.actor, &settings, &places, seed),
            others: OtherPeople::new(truth, &settings),
            places,
            settings,
            corruption,
            seed,
            stature: truth.actor.stature_or_usual(),
        }
    }

    /// The keypoints of all frames.
    pub fn detect(&self) -> SequenceKeypoints {
        let (frames, points) = (self.truth.frames.len(), self.places.len());
        let clock = SceneClock::new(self.truth, &self.exposed);
        let mut cameras: Vec<CameraDraws> = (0..self.filming.cameras()).map(|camera| self.draws(camera)).collect();
        let mut found = SequenceKeypoints::default();
        found.views.reserve(frames * cameras.len() * points);
        for first in (0..frames).step_by(FRAMES_AT_A_TIME) {
            let here = FRAMES_AT_A_TIME.min(frames - first);
            for (index, of_frame) in
                parallel::map(here, |frame| self.projections(&clock, first + frame)).iter().enumerate()
            {
                for (camera, draws) in cameras.iter_mut().enumerate() {
                    let own = &of_frame.points[camera * points..(camera + 1) * points];
                    let seen = self.detected(draws, own, of_frame.profiles[camera]);
                    found.views.extend(seen);
                    self.show_again(&mut found.views, first + index, camera);
                }
            }
        }
        found.places =
            self.truth.frames.iter().flat_map(|frame| places_of(&self.places, &frame.link_frames.0)).collect();
        found
    }

    fn draws(&self, camera: usize) -> CameraDraws {
        let points = self.settings.layout.keypoints().iter();
        let stretches = |limb| Stretches::new(draws(self.seed, KeypointDraw::Inversion, camera, limb as u64));
        CameraDraws {
            points: points.map(|point| PointDraws::new(self.seed, camera, *point)).collect(),
            inversions: LIMBS.map(stretches),
            other_person: Stretches::new(draws(self.seed, KeypointDraw::OtherPerson, camera, 0)),
        }
    }

    fn projections(&self, clock: &SceneClock<'_>, frame: usize) -> FrameProjections {
        let (cameras, mut shot) = (self.filming.cameras(), Shot::new(clock, &self.exposed, frame));
        let known = &self.truth.frames[frame];
        let mut of_frame = FrameProjections {
            points: Vec::with_capacity(cameras * self.places.len()),
            profiles: Vec::with_capacity(cameras),
        };
        for camera in 0..cameras {
            let pairs = self.places.iter().zip(&self.biased);
            let first = of_frame.points.len();
            of_frame.points.extend(pairs.map(|(place, biased)| self.projected(&mut shot, camera, place, biased)));
            let own = &mut of_frame.points[first..];
            let exact: Vec<[f64; 2]> = own.iter().map(|point| point.exact).collect();
            let others = self.others.nearest(clock, &self.exposed, [camera, frame], &exact);
            own.iter_mut().zip(others).for_each(|(point, pixel)| point.others = pixel);
            let centre = self.exposed.camera_at(camera, self.exposed.row_s(camera, known.time_s, 0)).centre();
            of_frame.profiles.push(profile(&known.markers, &centre));
        }
        of_frame
    }

    fn projected(
        &self,
        shot: &mut Shot<'_>,
        camera: usize,
        place: &Option<KeypointPlace>,
        biased: &Option<KeypointPlace>,
    ) -> Projected {
        let seen = place.as_ref().and_then(|place| shot.keypoint(camera, place));
        let Some((seen, pixel)) = seen.and_then(|seen| seen.pixel.map(|pixel| (seen, pixel))) else { return UNSEEN };
        let off = if place == biased {
            Some(pixel)
        } else {
            biased.as_ref().and_then(|biased| shot.keypoint(camera, biased)).and_then(|seen| seen.pixel)
        };
        let depth = (seen.camera.camera_from_world * seen.place).z;
        Projected {
            exact: pixel.into(),
            biased: off.map_or([f64::NAN; 2], Into::into),
            sight: shot.sight(camera, &seen),
            height_px: seen.camera.pinhole.focal[1] * self.stature / depth,
            others: NOWHERE,
        }
    }

    /// What the detector says of one image, whose errors follow those of the camera's last frame.
    fn detected(&self, draws: &mut CameraDraws, points: &[Projected], profile: f64) -> Vec<KeypointView> {
        let (settings, step_s) = (&self.settings, 1.0 / self.truth.frames_per_second);
        let hidden = |point: &Projected| matches!(point.sight, Sight::SelfOccluded | Sight::Occluded);
        let is_others = draws.other_person.step(settings.other_person, settings.stretch_s, step_s);
        let of_point = |(point, draws): (&Projected, &mut PointDraws)| {
            let conditions = PointConditions { height_px: point.height_px, is_hidden: hidden(point) };
            view(point, &draws.draw(settings, conditions, step_s), is_others)
        };
        let mut views: Vec<KeypointView> = points.iter().zip(&mut draws.points).map(of_point).collect();
        let is_absent = |view: &KeypointView| match is_others {
            true => view.found[0].is_nan(),
            false => view.sight == Sight::OutOfView,
        };
        for view in views.iter_mut().filter(|view| view.is_missed || is_absent(view)) {
            view.found = [f64::NAN; 2];
            view.confidence = 0.0;
        }
        let limbs = settings.layout.keypoints().iter().map(|point| point.limb());
        for (limb, stretches) in LIMBS.into_iter().zip(&mut draws.inversions) {
            let is_hidden = limbs.clone().zip(points).any(|(own, point)| own == Some(limb) && hidden(point));
            let rate = if is_hidden { 1.0 + settings.occluded_rate } else { 1.0 };
            let share = (settings.inversion * profile * rate).min(1.0);
            if stretches.step(share, settings.stretch_s, step_s) {
                self.exchange(&mut views, limb);
            }
        }
        views
    }

    /// Exchanges what the detector says of left and right.
    fn exchange(&self, views: &mut [KeypointView], limb: PairedLimb) {
        let points = self.settings.layout.keypoints();
        let before = views.to_vec();
        for (own, other) in self.settings.layout.mirrored().into_iter().enumerate() {
            if points[own].limb() == Some(limb) {
                let said = before[other];
                views[own] =
                    KeypointView { exact: before[own].exact, sight: before[own].sight, is_inverted: true, ..said };
            }
        }
    }

    /// If the image of this frame, the last one of `views`, was lost: what the detector said of the image shown again.
    fn show_again(&self, views: &mut [KeypointView], frame: usize, camera: usize) {
        if !self.filming.has_image(camera, frame) {
            return;
        }
        let every = self.filming.timing(camera).every;
        let shown = timing::shown_frame(&self.corruption, self.seed, frame, camera, every);
        let points = self.places.len();
        let at = |frame: usize| (frame * self.filming.cameras() + camera) * points;
        let (old, new) = (at(shown), at(frame));
        for point in 0..if old == new { 0 } else { points } {
            let KeypointView { exact, sight, .. } = views[new + point];
            views[new + point] = KeypointView { exact, sight, ..views[old + point] };
        }
    }
}

fn view(point: &Projected, error: &PointError, is_others: bool) -> KeypointView {
    let seen = if is_others { point.others } else { point.biased };
    KeypointView {
        exact: point.exact,
        sight: point.sight,
        found: [0, 1].map(|i| seen[i] + error.offset_px[i]),
        confidence: error.confidence,
        is_missed: error.is_missed && point.sight != Sight::OutOfView,
        is_inverted: false,
        is_gross: error.is_gross,
        is_others,
    }
}

/// The points as a detector with a bias defines them.
fn biased(
    actor: &Humanoid,
    settings: &KeypointSettings,
    places: &[Option<KeypointPlace>],
    seed: KeyedSeed,
) -> Vec<Option<KeypointPlace>> {
    if settings.bias_mm == 0.0 {
        return places.to_vec();
    }
    let body_from_links = actor.body_from_links();
    let moved = |(point, place): (&Keypoint, &Option<KeypointPlace>)| {
        let place = (*place)?;
        let LinkPoint { link, point_in_link } = place.point;
        let by = body_from_links[link].inverse() * bias_m(settings, *point, seed);
        Some(KeypointPlace { point: LinkPoint { link, point_in_link: point_in_link + by }, ..place })
    };
    settings.layout.keypoints().iter().zip(places).map(moved).collect()
}

/// The offset of a detector's definition of a point, in the axes of the standing body, metres.
fn bias_m(settings: &KeypointSettings, point: Keypoint, seed: KeyedSeed) -> Vector3<f64> {
    let left = point.min(point.mirrored());
    let mut random = draws(seed, KeypointDraw::Bias, 0, left as u64);
    let mut drawn = Vector3::from_fn(|_, _| normal(&mut random));
    if point.limb().is_none() {
        drawn.y = 0.0;
    } else if point != left {
        drawn.y = -drawn.y;
    }
    1e-3 * settings.bias_mm * point.relative_deviation() * drawn
}

/// Twice the squared cosine of the angle between the line of the hips and the line of sight: 0 from in front, 2 in
/// profile, 1 in the mean of a turning body. 1 for a body without hips.
fn profile(markers: &Markers, centre: &Point3<f64>) -> f64 {
    let place = |landmark: Landmark| markers[landmark as usize];
    let (Some(left), Some(right)) = (place(Landmark::LeftHip), place(Landmark::RightHip)) else { return 1.0 };
    let sight = centre - nalgebra::center(&left, &right);
    let cosine = (left - right).dot(&sight) / ((left - right).norm() * sight.norm());
    if cosine.is_finite() { 2.0 * cosine * cosine } else { 1.0 }
}

fn places_of<'p>(
    places: &'p [Option<KeypointPlace>],
    links: &'p [nalgebra::Isometry3<f64>],
) -> impl Iterator<Item = [f64; 3]> + 'p {
    let place = |place: &KeypointPlace| (links[place.point.link] * place.point.point_in_link).into();
    places.iter().map(move |known| known.as_ref().map_or([f64::NAN; 3], place))
}

#[cfg(test)]
mod tests;
