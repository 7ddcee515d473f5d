//! The ends of a body: feet with toes, hands with fingers, and other end links.

use nalgebra::{Point3, Vector3};

use super::super::bodily_links::ANKLE;
use super::thickness::STATURE;
use super::{CapsuleBuilder, LIMB_ENDS, SAME_JOINT, SAME_PLACE};

/// Volume of a body of [`STATURE`], litres (at the density of water).
const LITRES: f64 = 73.0;

/// Lengths as shares of the stature: a hand from wrist to fingers; a foot behind the ankle, and from the ankle to the
/// ball; toes.
const HAND: f64 = 0.09;
const HEEL: f64 = 0.022;
const BALL: f64 = 0.085;
const TOES: f64 = 0.035;
/// Length of the longest other end link.
const LONGEST_END: f64 = 0.12;
/// Centres of mass nearer to their joint than this define no direction.
const NEAR_JOINT: f64 = 0.01;

/// Radii, metres at [`STATURE`].
const PALM_RADII: [f64; 2] = [0.034, 0.020];
const HEEL_RADIUS: f64 = 0.036;
const BALL_RADIUS: f64 = 0.030;
const TOES_RADII: [f64; 2] = [0.024, 0.020];
const LEAST_RADIUS: f64 = 0.008;
/// Greatest radius of an end link relative to its length.
const STOUTEST: f64 = 0.4;

impl CapsuleBuilder<'_> {
    /// From heel to ball at the height of a person's sole, with toes if they have a joint.
    pub(super) fn add_feet(&mut self) {
        for [_, landmark] in LIMB_ENDS[1] {
            let Some(ankle) = self.last_at(landmark) else { continue };
            let girth = self.thickness.girth;
            let sole = ankle.place.z - self.share(ANKLE);
            let toes = self.toes(ankle.link, &ankle.place);
            let to_ball = toes.map_or(Vector3::x() * self.share(BALL), |toes| self.standing.origin(toes) - ankle.place);
            let on_sole = |ahead: f64, side: f64, radius: f64| {
                Point3::new(ankle.place.x + ahead, ankle.place.y + side, sole + radius * girth)
            };
            let ball = on_sole(to_ball.x, to_ball.y, BALL_RADIUS);
            let heel = on_sole(-self.share(HEEL), 0.0, HEEL_RADIUS);
            self.add(ankle.link, [heel, ball], [HEEL_RADIUS, BALL_RADIUS].map(|radius| radius * girth));
            let instep = on_sole(0.4 * to_ball.x, 0.4 * to_ball.y, BALL_RADIUS);
            let radii = [self.thickness.radius_at(&ankle.place), BALL_RADIUS * girth];
            self.add(ankle.link, [ankle.place, instep], radii);
            if let Some(toes) = toes {
                let tip = on_sole(to_ball.x + self.share(TOES), to_ball.y, TOES_RADII[1]);
                let joint = on_sole(to_ball.x, to_ball.y, TOES_RADII[0]);
                self.add(toes, [joint, tip], TOES_RADII.map(|radius| radius * girth));
            }
        }
    }

    /// The link below the foot with its joint in front of the ankle.
    fn toes(&self, foot: usize, ankle: &Point3<f64>) -> Option<usize> {
        self.standing.children(foot).find(|&toes| {
            let offset = self.standing.origin(toes) - ankle;
            offset.x > self.share(SAME_JOINT) && offset.norm() < self.share(2.0 * BALL)
        })
    }

    /// Towards the joints of the fingers, else along the forearm or towards the hand's centre of mass.
    pub(super) fn add_hands(&mut self) {
        for [elbow, wrist] in LIMB_ENDS[0] {
            let (Some(elbow), Some(wrist)) = (self.landmark(elbow), self.last_at(wrist)) else { continue };
            let Some(forearm) = (wrist.place - elbow.place).try_normalize(1e-9) else { continue };
            let is_hand = self.is_end[wrist.link];
            let fingers = self.standing.children(wrist.link).map(|finger| self.standing.origin(finger));
            let mut tips: Vec<Point3<f64>> =
                fingers.filter(|tip| is_hand && (tip - wrist.place).norm() > self.share(SAME_JOINT)).collect();
            if tips.is_empty() {
                let ahead = self.centre_of_mass(wrist.link).filter(|_| is_hand).map(|centre| centre - wrist.place);
                let ahead = ahead.and_then(|ahead| ahead.try_normalize(self.share(NEAR_JOINT)));
                let ahead = ahead.filter(|ahead| ahead.dot(&forearm) > 0.5).unwrap_or(forearm);
                tips.push(wrist.place + ahead * self.share(HAND));
            }
            let radii = PALM_RADII.map(|radius| radius * self.thickness.girth);
            tips.into_iter().for_each(|tip| self.add(wrist.link, [wrist.place, tip], radii));
        }
    }

    /// Links with mass and no capsule so far (fingers, ears, shields): to their next joint, else to twice the distance
    /// of their centre of mass, with a thickness by their share of the body's mass.
    pub(super) fn add_other_ends(&mut self) {
        let standing = self.standing;
        let ankles = LIMB_ENDS[1].into_iter().filter_map(|[_, ankle]| self.last_at(ankle));
        let sole = ankles.map(|ankle| ankle.place.z - self.share(ANKLE)).fold(f64::INFINITY, f64::min);
        for link in 0..standing.body.links.len() {
            let Some(centre) = self.centre_of_mass(link) else { continue };
            if !standing.is_bodily[link] || !self.capsules[link].is_empty() {
                continue;
            }
            let origin = standing.origin(link);
            let mut joints = standing.children(link).map(|child| standing.origin(child) - origin);
            let next = joints.find(|offset| offset.norm() > self.share(SAME_PLACE));
            let offset = next.unwrap_or((centre - origin) * 2.0);
            let length = offset.norm().min(self.share(LONGEST_END));
            let along = offset.try_normalize(1e-9).unwrap_or(Vector3::z());
            let radius = self.radius_by_mass(link, length);
            let lowest = origin.z.min(origin.z + along.z * length);
            // parts of a foot do not reach below its sole
            let above_sole = if sole.is_finite() { (lowest - sole).max(0.0) } else { f64::INFINITY };
            let radius = radius.min(above_sole.max(LEAST_RADIUS * self.thickness.girth));
            self.add(link, [origin, origin + along * (length - radius).max(0.0)], [radius; 2]);
        }
    }

    /// Radius of a capsule of this length with the link's share of a person's volume.
    fn radius_by_mass(&self, link: usize, length: f64) -> f64 {
        let (body, girth) = (self.standing.body, self.thickness.girth);
        let share = body.links[link].inertia.as_ref().map_or(0.0, |own| own.mass / body.total_mass());
        let volume = 0.001 * LITRES * share * girth * girth * self.standing.stature / STATURE;
        let of_ball = libm::cbrt(0.75 * volume / std::f64::consts::PI);
        let of_rod = libm::sqrt(volume / (std::f64::consts::PI * length.max(self.share(SAME_PLACE))));
        let stoutest = if length > self.share(SAME_PLACE) { STOUTEST * length } else { f64::INFINITY };
        of_ball.min(of_rod).min(stoutest).clamp(LEAST_RADIUS * girth, HEEL_RADIUS * girth)
    }
}
