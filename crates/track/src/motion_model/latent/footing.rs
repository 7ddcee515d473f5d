//! Foot contact learned from training: how firmly a foot stands at a given height; and footholds: positions of a
//! particle's feet on the ground, remembered from frame to frame.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector2, Vector3};

use super::super::gpdm_graph::GpdmGraph;
use super::super::pose_chart::PlanarRoot;
use skiagraph_core::body::{Humanoid, LinkPoint, Pose, rotation_about};

/// Number of height groups with equally many training frames.
const GROUPS: usize = 10;

/// Standard deviation of a foot about its foothold within one frame, metres: comparable to a particle's noise. Errors
/// are the same from 3 to 30 mm.
const NOISE_OF_PLACE: f64 = 0.01;

/// Standard deviation of its heading, radians.
const NOISE_OF_HEADING: f64 = 0.03;

/// The feet of a body and how firmly they stand.
///
/// A foot's position is the middle of its sole's solid: the lowest of the foot's solids while the body stands at its
/// zero pose. If a foot is rigidly connected to its shank, as in bodies without ankles, heel and toe swing about that
/// middle with the shank, and it slides two to six times less than the lowest point (measured on the takes of
/// `results/monocular-notes.md`).
#[derive(Clone, Debug)]
pub(super) struct Footing {
    feet: [LinkPoint; 2],
    /// In order of increasing height.
    knots: Vec<Knot>,
    /// The greatest height of a foot in training, metres.
    highest: f64,
}

/// Looseness of feet at one height.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    /// Height of the foot's middle above z = 0, metres.
    height: f64,
    loose: Looseness,
}

/// Movement of a foot in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Looseness {
    /// Mean square of its slide along a horizontal axis, m^2.
    pub(super) slide: f64,
    /// Mean square of its rotation about the vertical, rad^2.
    pub(super) turn: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Feet(pub(super) [Isometry3<f64>; 2]);

#[derive(Clone, Copy, Debug)]
pub(super) struct FootStep {
    /// Position before, world, metres.
    pub(super) before: Point3<f64>,
    /// Position after, world, metres.
    pub(super) after: Point3<f64>,
    /// Rotation about the vertical, radians.
    pub(super) turned: f64,
}

impl Feet {
    pub(super) fn lower_height(&self) -> f64 {
        self.0[0].translation.z.min(self.0[1].translation.z)
    }

    /// Movements of the left and the right foot from here to `after`.
    pub(super) fn steps_to(&self, after: &Self) -> [FootStep; 2] {
        [0, 1].map(|foot| {
            let (here, there) = (&self.0[foot], &after.0[foot]);
            FootStep {
                before: here.translation.vector.into(),
                after: there.translation.vector.into(),
                turned: heading(&(there.rotation * here.rotation.inverse())),
            }
        })
    }
}

impl FootStep {
    /// Mean height of the foot's middle, metres.
    fn height(&self) -> f64 {
        0.5 * (self.before.z + self.after.z)
    }
}

#[cfg(test)]
impl Feet {
    /// Frames of the left and the right foot: the middles of their soles with the orientations of their links.
    pub(super) fn places(&self) -> [Isometry3<f64>; 2] {
        self.0
    }
}

#[cfg(test)]
impl Footing {
    /// Feet of `body` with looseness given by the knots `(height, mean square)`.
    pub(super) fn with_knots(body: &Humanoid, knots: &[(f64, f64)]) -> Option<Self> {
        let [left, right] = [0, 1].map(|foot| sole(body, foot));
        let knot = |&(height, square): &(f64, f64)| Knot { height, loose: Looseness { slide: square, turn: square } };
        let knots: Vec<Knot> = knots.iter().map(knot).collect();
        Some(Self { feet: [left?, right?], highest: knots.last()?.height, knots })
    }
}

impl Footing {
    /// Measured on the training frames of `graph`; `None` for a body without feet, or if there are no two consecutive
    /// frames.
    pub(super) fn learn(body: &Humanoid, graph: &GpdmGraph) -> Option<Self> {
        let [left, right] = [0, 1].map(|foot| sole(body, foot));
        let mut footing = Self { feet: [left?, right?], knots: Vec::new(), highest: f64::NEG_INFINITY };
        let mut steps: Vec<FootStep> = Vec::new();
        for segment in &graph.segments {
            let mut before: Option<(PlanarRoot, Feet)> = None;
            for row in 0..segment.rotations.len() {
                before = before.filter(|_| row != segment.sequence_of(row).start);
                let observation = segment.gpdm.observation(row);
                let start = PlanarRoot { x: 0.0, y: 0.0, yaw: 0.0 };
                let root =
                    before.as_ref().map_or(start, |(root, _)| root.after(&graph.chart.planar_step(&observation)));
                let feet = footing.feet(body, &graph.chart.place(&observation, &root));
                steps.extend(before.into_iter().flat_map(|(_, before)| before.steps_to(&feet)));
                before = Some((root, feet));
            }
        }
        footing.highest = steps.iter().map(FootStep::height).fold(f64::NEG_INFINITY, f64::max);
        footing.knots = knots(steps);
        (!footing.knots.is_empty()).then_some(footing)
    }

    pub(super) fn feet(&self, body: &Humanoid, pose: &Pose) -> Feet {
        let frames = body.link_frames(pose);
        let place = |foot: LinkPoint| {
            let frame = &frames[foot.link];
            Isometry3::from_parts((frame * foot.point_in_link).coords.into(), frame.rotation)
        };
        Feet(self.feet.map(place))
    }

    /// Looseness of a foot: linearly interpolated between the heights of training, constant below them. A foot higher
    /// than any in training has moved by at least the excess height, and turned by a radian per metre of it.
    pub(super) fn looseness(&self, step: &FootStep) -> Looseness {
        let height = step.height();
        let above = self.knots.partition_point(|knot| knot.height <= height);
        let (low, high) = (&self.knots[above.saturating_sub(1)], &self.knots[above.min(self.knots.len() - 1)]);
        let span = high.height - low.height;
        let share = if span > 0.0 { ((height - low.height) / span).clamp(0.0, 1.0) } else { 0.0 };
        let excess = (height - self.highest).max(0.0);
        let between = |low: f64, high: f64| low + share * (high - low) + excess * excess;
        Looseness { slide: between(low.loose.slide, high.loose.slide), turn: between(low.loose.turn, high.loose.turn) }
    }

    /// The footholds after a frame that ended with the feet at `feet`.
    ///
    /// A foothold is the state of a Kalman filter without memory of its variance: in one frame a foot at this height
    /// moves by its looseness (variance `q`), and is observed with a particle's noise (variance `r`). So the foothold
    /// moves towards the foot by `q / (q + r)`, separately for position and heading. A firmly standing foot keeps its
    /// foothold, however large the root's noise; a foot in flight takes it along and is planted where it lands. Height
    /// and tilt are the foot's.
    pub(super) fn updated(&self, footholds: &Feet, feet: &Feet) -> Feet {
        let steps = footholds.steps_to(feet);
        let update = |foot: usize| {
            let (step, place) = (&steps[foot], &feet.0[foot]);
            let loose = self.looseness(step);
            let left = (step.before - step.after).xy() * kept(loose.slide, NOISE_OF_PLACE);
            let turned = -step.turned * kept(loose.turn, NOISE_OF_HEADING);
            let translation = place.translation.vector + Vector3::new(left.x, left.y, 0.0);
            Isometry3::from_parts(translation.into(), rotation_about(&Vector3::z_axis(), turned) * place.rotation)
        };
        Feet([update(0), update(1)])
    }

    /// Looseness of feet at the lowest heights of training.
    pub(super) fn firmest(&self) -> Looseness {
        self.knots[0].loose
    }
}

/// The share of the difference between foothold and foot that remains after a frame.
fn kept(variance: f64, noise: f64) -> f64 {
    noise * noise / (variance + noise * noise)
}

/// The middle of a foot's lowest solid at the zero pose.
fn sole(body: &Humanoid, foot: usize) -> Option<LinkPoint> {
    let frames = body.link_frames(&body.zero_pose());
    let links = &body.foot_links()[foot];
    let solids = links.iter().flat_map(|&link| body.links[link].solids.iter().map(move |solid| (link, solid)));
    let lowest = solids.filter_map(|(link, solid)| Some((link, solid, solid.lowest_point(&frames[link])?.z)));
    let (link, solid, _) = lowest.min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(LinkPoint { link, point_in_link: solid.middle()? })
}

/// The angle of a rotation about the vertical (swing-twist).
fn heading(rotation: &UnitQuaternion<f64>) -> f64 {
    let angle = 2.0 * libm::atan2(rotation.k, rotation.w);
    angle - std::f64::consts::TAU * libm::round(angle / std::f64::consts::TAU)
}

/// Mean squares for groups of equally many frames by height, made non-decreasing with height: where a group is looser
/// than a higher one, both get their mean (isotonic regression by pooling adjacent violators; `[Barlow 1972]`).
fn knots(mut steps: Vec<FootStep>) -> Vec<Knot> {
    steps.sort_by(|a, b| a.height().total_cmp(&b.height()));
    let size = steps.len().div_ceil(GROUPS).max(1);
    let groups: Vec<&[FootStep]> = steps.chunks(size).collect();
    let sums = |of: &dyn Fn(&FootStep) -> f64| -> Vec<(f64, f64)> {
        groups.iter().map(|group| (group.iter().map(of).sum(), group.len() as f64)).collect()
    };
    let slides = isotonic(&sums(&|s| 0.5 * (s.after - s.before).xy().norm_squared()));
    let turns = isotonic(&sums(&|s| s.turned * s.turned));
    let heights = sums(&FootStep::height).into_iter().map(|(sum, count)| sum / count);
    let looseness = slides.into_iter().zip(turns).map(|(slide, turn)| Looseness { slide, turn });
    heights.zip(looseness).map(|(height, loose)| Knot { height, loose }).collect()
}

/// The non-decreasing sequence nearest to the means of groups `(sum, count)` in the least-squares sense.
fn isotonic(groups: &[(f64, f64)]) -> Vec<f64> {
    let mut pools: Vec<(f64, f64, usize)> = Vec::new();
    for &(sum, count) in groups {
        let mut pool = (sum, count, 1);
        while let Some(last) = pools.pop_if(|last| last.0 * pool.1 > pool.0 * last.1) {
            pool = (pool.0 + last.0, pool.1 + last.1, pool.2 + last.2);
        }
        pools.push(pool);
    }
    pools.into_iter().flat_map(|(sum, count, groups)| std::iter::repeat_n(sum / count, groups)).collect()
}

/// A point rotated about the vertical through `pivot`.
pub(super) fn turned_about(pivot: &Vector3<f64>, angle: f64, point: &Point3<f64>) -> Vector2<f64> {
    let (sin, cos) = libm::sincos(angle);
    let arm = point.coords - pivot;
    Vector2::new(pivot.x + cos * arm.x - sin * arm.y, pivot.y + sin * arm.x + cos * arm.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::rotation_from_vector;

    #[test]
    fn isotonic_regression_pools_decreasing_means() {
        // by hand: 3 and three of 1 pool to 1.5; 5 and 4 to 4.5; 6 and 2 to 4, which is less, so all four to 4.25
        let groups = [(3.0, 1.0), (3.0, 3.0), (5.0, 1.0), (4.0, 1.0), (6.0, 1.0), (2.0, 1.0)];
        assert_eq!(isotonic(&groups), [1.5, 1.5, 4.25, 4.25, 4.25, 4.25]);
        assert_eq!(isotonic(&[(1.0, 1.0), (4.0, 2.0), (9.0, 3.0)]), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_foot_is_the_middle_of_its_sole_and_flat_at_the_zero_pose() {
        let body = Humanoid::tracker25().unwrap();
        let feet = [0, 1].map(|foot| sole(&body, foot).unwrap());
        // half-way between (-0.032, 0, -0.4557) and (0.155, 0, -0.4717), from robots/tracker25.urdf
        for (foot, link) in feet.iter().zip(["left_shank", "right_shank"]) {
            assert_eq!(foot.link, body.find_link(link).unwrap());
            assert!((foot.point_in_link - Point3::new(0.0615, 0.0, -0.4637)).norm() < 1e-12);
        }
    }

    #[test]
    fn looseness_is_interpolated_by_height_and_grows_beyond_the_training_range() {
        let body = Humanoid::tracker25().unwrap();
        let footing = Footing { highest: 0.4, ..Footing::with_knots(&body, &[(0.1, 1.0), (0.3, 5.0)]).unwrap() };
        let at = |height: f64| {
            let place = Point3::new(1.0, 2.0, height);
            footing.looseness(&FootStep { before: place, after: place, turned: 0.0 })
        };
        for (height, slide) in [(-1.0, 1.0), (0.1, 1.0), (0.2, 3.0), (0.3, 5.0), (0.4, 5.0), (0.9, 5.25)] {
            assert!((at(height).slide - slide).abs() < 1e-12, "{height}: {:?}", at(height));
        }
        assert!((at(0.2).turn - 3.0).abs() < 1e-12);
    }

    /// Feet with this mean square of slide and turn below 0.2 m, loose above 0.3 m.
    fn feet_of(square: f64) -> Footing {
        let knots = [(0.0, square), (0.2, square), (0.3, 1e6)];
        Footing::with_knots(&Humanoid::tracker25().unwrap(), &knots).unwrap()
    }

    fn foot(x: f64, y: f64, z: f64, yaw: f64) -> Isometry3<f64> {
        let tilt = rotation_from_vector(&Vector3::new(0.4, -0.9, 0.0));
        Isometry3::from_parts(Vector3::new(x, y, z).into(), rotation_about(&Vector3::z_axis(), yaw) * tilt)
    }

    #[test]
    fn a_foothold_moves_by_the_ratio_of_slide_to_slide_plus_noise() {
        // by hand: a slide of 5 mm against 10 mm of noise, 25 / (25 + 100) = 0.2; turns of 5 mrad against 30, 25 / 925
        let footing = feet_of(0.005 * 0.005);
        let (before, now) = (foot(1.0, 2.0, 0.1, 0.3), foot(1.05, 1.98, 0.12, 0.35));
        let footholds = footing.updated(&Feet([before, before]), &Feet([now, before]));
        let updated = footholds.0[0];
        assert!((updated.translation.vector - Vector3::new(1.01, 1.996, 0.12)).norm() < 1e-12, "{updated}");
        let heading = rotation_about(&Vector3::z_axis(), 0.3 + 0.05 * 25.0 / 925.0);
        let tilt = rotation_about(&Vector3::z_axis(), 0.35).inverse() * now.rotation;
        assert!(updated.rotation.angle_to(&(heading * tilt)) < 1e-9);
        assert!((footholds.0[1].translation.vector - before.translation.vector).norm() < 1e-15, "no movement");
    }

    #[test]
    fn a_foot_in_flight_takes_its_foothold_along() {
        let footing = feet_of(1e-9);
        let (before, now) = (foot(0.0, 0.0, 0.5, 0.0), foot(0.8, -0.3, 0.5, 1.0));
        let updated = footing.updated(&Feet([before; 2]), &Feet([now; 2]));
        for place in updated.0 {
            assert!((place.translation.vector - now.translation.vector).norm() < 1e-9);
            assert!(place.rotation.angle_to(&now.rotation) < 1e-8);
        }
    }

    #[test]
    fn an_undisturbed_foothold_converges_geometrically() {
        // the remainder after n frames is (r / (q + r))^n of the initial difference, here 0.8^n
        let footing = feet_of(0.005 * 0.005);
        let now = foot(0.1, 0.0, 0.1, 0.0);
        let mut footholds = Feet([foot(0.0, 0.0, 0.1, 0.0); 2]);
        for n in 1..20 {
            footholds = footing.updated(&footholds, &Feet([now; 2]));
            let apart = 0.1 - footholds.0[0].translation.x;
            assert!((apart - 0.1 * 0.8_f64.powi(n)).abs() < 1e-12, "frame {n}: {apart}");
        }
    }
}
