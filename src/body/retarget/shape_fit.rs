//! A template body scaled to a subject's segment lengths.

use nalgebra::{Point3, Vector3};

use super::SegmentLengths;
use crate::body::{BodyShape, Humanoid, Landmark, LinkPoint, LinkShape};

/// Body mass grows with stature squared (Quetelet's index), and mass is length times girth squared: girth grows with the
/// square root of stature.
const GIRTH_EXPONENT: f64 = 0.5;

const X: usize = 0;
const Y: usize = 1;
const Z: usize = 2;

/// What a chain of links adds to a length along one axis: each link and its share, metres.
type Contributions = Vec<(usize, f64)>;

/// The shape that gives `template` the lengths `subject`.
///
/// Links along a chain between two landmarks share one factor along the axis in which the template's zero pose lays the
/// chain out: trunk, head, arms and legs along Z, widths along Y, feet along X. Where two lengths claim one factor (hips and
/// shoulders of a one-piece trunk) it is their least-squares compromise. What no length speaks for grows with the
/// distance from ankle to crown, and girths with its square root.
pub fn fit_shape(template: &Humanoid, subject: &SegmentLengths) -> BodyShape {
    let own = SegmentLengths::of(template);
    let growth = ratio(own.ankle_to_crown(), subject.ankle_to_crown()).unwrap_or(1.0);
    let grown = LinkShape { length: Vector3::repeat(growth), girth: libm::pow(growth, GIRTH_EXPONENT) };
    let mut shape = BodyShape { links: vec![grown; template.links.len()] };
    let mut claims = Claims::new(template);
    for side in 0..2 {
        let [hip, knee, ankle, shoulder, elbow, wrist] = limb_landmarks(side);
        claims.length(shoulder, elbow, Z, ratio(own.upper_arm[side], subject.upper_arm[side]));
        claims.length(elbow, wrist, Z, ratio(own.forearm[side], subject.forearm[side]));
        claims.length(hip, knee, Z, ratio(own.thigh[side], subject.thigh[side]));
        claims.length(knee, ankle, Z, ratio(own.shank[side], subject.shank[side]));
        claims.length(Landmark::Pelvis, hip, Y, ratio(own.hip_width, subject.hip_width));
        claims.length(Landmark::Pelvis, shoulder, Y, ratio(own.shoulder_width, subject.shoulder_width));
        claims.foot(side, ratio(own.foot[side], subject.foot[side]));
    }
    claims.length(Landmark::Pelvis, Landmark::Thorax, Z, ratio(own.trunk, subject.trunk));
    claims.length(Landmark::Thorax, Landmark::HeadTop, Z, ratio(own.head, subject.head));
    claims.settle(&mut shape);
    shape
}

fn ratio(own: Option<f64>, subject: Option<f64>) -> Option<f64> {
    Some(subject? / own.filter(|own| *own > 1e-6)?)
}

fn limb_landmarks(side: usize) -> [Landmark; 6] {
    use Landmark as L;
    match side {
        0 => [L::LeftHip, L::LeftKnee, L::LeftAnkle, L::LeftShoulder, L::LeftElbow, L::LeftWrist],
        _ => [L::RightHip, L::RightKnee, L::RightAnkle, L::RightShoulder, L::RightElbow, L::RightWrist],
    }
}

/// What is asked of every link's factors: per axis the sum of weights and of weighted factors.
struct Claims<'a> {
    template: &'a Humanoid,
    sums: Vec<[(f64, f64); 3]>,
}

impl<'a> Claims<'a> {
    fn new(template: &'a Humanoid) -> Self {
        Self { template, sums: vec![[(0.0, 0.0); 3]; template.links.len()] }
    }

    /// The way from one landmark to the other shall grow by `factor` along `axis`.
    fn length(&mut self, from: Landmark, to: Landmark, axis: usize, factor: Option<f64>) {
        let markers = &self.template.markers;
        let (Some(from), Some(to), Some(factor)) = (markers[from as usize], markers[to as usize], factor) else {
            return;
        };
        let contributions = chain(self.template, from, to, axis).unwrap_or_default();
        self.claim(&contributions, axis, factor);
    }

    /// The way from ankle to ball shall grow by `factor`, and the toes with it.
    fn foot(&mut self, side: usize, factor: Option<f64>) {
        let Some(toes) = self.template.find_link(["left_toes", "right_toes"][side]) else { return };
        let (Some(foot), Some(factor)) = (self.template.parent(toes), factor) else { return };
        self.claim(&[(foot, 1.0), (toes, 1.0)], X, factor);
    }

    fn claim(&mut self, contributions: &[(usize, f64)], axis: usize, factor: f64) {
        let whole: f64 = contributions.iter().map(|(_, share)| share).sum();
        for (link, _) in contributions.iter().filter(|(_, share)| share.abs() > 1e-6) {
            let (weight, weighted) = &mut self.sums[*link][axis];
            *weight += whole * whole;
            *weighted += whole * whole * factor;
        }
    }

    fn settle(&self, shape: &mut BodyShape) {
        for (link, sums) in shape.links.iter_mut().zip(&self.sums) {
            for (factor, (weight, weighted)) in link.length.iter_mut().zip(sums) {
                if *weight > 0.0 {
                    *factor = weighted / weight;
                }
            }
        }
    }
}

/// What each link adds, at the zero pose and along one axis, to the way from `from` up the tree's branch to `to`; `None`
/// where `to` does not hang on `from`'s link.
fn chain(template: &Humanoid, from: LinkPoint, to: LinkPoint, axis: usize) -> Option<Contributions> {
    let mut contributions = Contributions::new();
    let (mut link, mut point) = (to.link, to.point_in_link);
    while link != from.link {
        contributions.push((link, point[axis]));
        let joint = &template.joints[link.checked_sub(1)?];
        (link, point) = (joint.parent, Point3::from(joint.parent_from_joint.translation.vector));
    }
    contributions.push((link, point[axis] - from.point_in_link[axis]));
    Some(contributions)
}
