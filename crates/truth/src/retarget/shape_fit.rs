//! Scales a template body to a subject's segment lengths.

use nalgebra::Vector3;

use super::SegmentLengths;
use skiagraph_core::body::{BodyShape, Humanoid, Landmark, LinkFrames, LinkPoint, LinkShape};

/// Body mass is proportional to stature squared (Quetelet's index), and to length times girth squared, so girth is
/// proportional to the square root of stature.
const GIRTH_EXPONENT: f64 = 0.5;

/// Contributions of a chain of links to a length: link, axis of its frame, and contribution, metres.
type Contributions = Vec<(usize, usize, f64)>;

/// Iterations for limbs oblique to the axes of their links, and the relative tolerance of their lengths.
const ROUNDS: usize = 4;
const TOLERANCE: f64 = 1e-3;

/// The shape that gives `template` the segment lengths of `subject`.
///
/// Links along a chain between two landmarks share one factor along the axis closest to the chain's direction at the
/// template's zero pose: the body's Z for the trunk, Y for widths, X for feet, and the limb's own direction for limbs.
/// If two lengths determine one factor (hips and shoulders of a one-piece trunk), it is their least-squares compromise.
/// Everything else scales with the distance from ankle to crown, and girths with its square root.
pub fn fit_shape(template: &Humanoid, subject: &SegmentLengths) -> BodyShape {
    let own = SegmentLengths::from_body(template);
    let growth = ratio(own.ankle_to_crown(), subject.ankle_to_crown()).unwrap_or(1.0);
    let grown = LinkShape { length: Vector3::repeat(growth), girth: libm::pow(growth, GIRTH_EXPONENT) };
    let mut shape = BodyShape { links: vec![grown; template.links.len()] };
    let mut claims = Claims::new(template);
    let [ahead, left, up] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| template.root_from_body() * axis);
    for side in 0..2 {
        let [hip, _, _, shoulder, ..] = limb_landmarks(side);
        for (from, to, length) in limb_segments(side) {
            claims.limb(from, to, ratio(length(&own)[side], length(subject)[side]));
        }
        claims.length(Landmark::Pelvis, hip, &left, ratio(own.hip_width, subject.hip_width));
        claims.length(Landmark::Pelvis, shoulder, &left, ratio(own.shoulder_width, subject.shoulder_width));
        claims.foot(side, &ahead, ratio(own.foot[side], subject.foot[side]));
    }
    claims.length(Landmark::Pelvis, Landmark::Thorax, &up, ratio(own.trunk, subject.trunk));
    claims.length(Landmark::Thorax, Landmark::HeadTop, &up, ratio(own.head, subject.head));
    claims.set_lengths(&mut shape);
    claims.correct_limbs(&mut shape, subject);
    shape
}

/// Landmarks at the ends of a limb segment, and its lengths on both sides.
type LimbSegment = (Landmark, Landmark, fn(&SegmentLengths) -> [Option<f64>; 2]);

fn limb_segments(side: usize) -> [LimbSegment; 4] {
    let [hip, knee, ankle, shoulder, elbow, wrist] = limb_landmarks(side);
    [
        (shoulder, elbow, |lengths| lengths.upper_arm),
        (elbow, wrist, |lengths| lengths.forearm),
        (hip, knee, |lengths| lengths.thigh),
        (knee, ankle, |lengths| lengths.shank),
    ]
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

/// Requirements on every link's length factors: per axis the sums of weights and of weighted factors.
struct Claims<'a> {
    template: &'a Humanoid,
    /// `root_from_link` of every link at the zero pose.
    root_from_links: LinkFrames,
    sums: Vec<[(f64, f64); 3]>,
}

impl<'a> Claims<'a> {
    fn new(template: &'a Humanoid) -> Self {
        let root_from_links = template.link_frames(&template.zero_pose());
        Self { template, root_from_links, sums: vec![[(0.0, 0.0); 3]; template.links.len()] }
    }

    /// Requires that the distance between two landmarks along a direction of the root's frame is scaled by `factor`.
    fn length(&mut self, from: Landmark, to: Landmark, direction: &Vector3<f64>, factor: Option<f64>) {
        let markers = &self.template.markers;
        let (Some(from), Some(to), Some(factor)) = (markers[from as usize], markers[to as usize], factor) else {
            return;
        };
        let contributions = self.chain(from, to, direction);
        self.claim(&contributions, factor);
    }

    /// Requires that the distance between two landmarks is scaled by `factor`.
    fn limb(&mut self, from: Landmark, to: Landmark, factor: Option<f64>) {
        let contributions = self.limb_chain(from, to);
        if let Some(factor) = factor {
            self.claim(&contributions, factor);
        }
    }

    fn limb_chain(&self, from: Landmark, to: Landmark) -> Contributions {
        let markers = &self.template.markers;
        let (Some(from), Some(to)) = (markers[from as usize], markers[to as usize]) else { return Vec::new() };
        let place = |on: &LinkPoint| self.root_from_links[on.link] * on.point_in_link;
        self.chain(from, to, &(place(&to) - place(&from)))
    }

    /// Requires that the foot, from ankle to ball, and its toes are scaled by `factor`.
    fn foot(&mut self, side: usize, ahead: &Vector3<f64>, factor: Option<f64>) {
        let Some(toes) = self.template.find_link(["left_toes", "right_toes"][side]) else { return };
        let (Some(foot), Some(factor)) = (self.template.parent(toes), factor) else { return };
        let along = |link: usize| (link, self.axis(link, ahead).0, 1.0);
        self.claim(&[along(foot), along(toes)], factor);
    }

    fn claim(&mut self, contributions: &[(usize, usize, f64)], factor: f64) {
        let whole: f64 = contributions.iter().map(|(.., share)| share).sum();
        for (link, axis, _) in contributions.iter().filter(|(.., share)| share.abs() > 1e-6) {
            let (weight, weighted) = &mut self.sums[*link][*axis];
            *weight += whole * whole;
            *weighted += whole * whole * factor;
        }
    }

    fn set_lengths(&self, shape: &mut BodyShape) {
        for (link, sums) in shape.links.iter_mut().zip(&self.sums) {
            for (factor, (weight, weighted)) in link.length.iter_mut().zip(sums) {
                if *weight > 0.0 {
                    *factor = weighted / weight;
                }
            }
        }
    }

    /// Scales limbs iteratively to the subject's lengths; oblique limbs need several iterations.
    fn correct_limbs(&self, shape: &mut BodyShape, subject: &SegmentLengths) {
        for _ in 0..ROUNDS {
            let reached = SegmentLengths::from_body(&self.template.reshaped(shape));
            for side in 0..2 {
                for (from, to, length) in limb_segments(side) {
                    let factor = ratio(length(&reached)[side], length(subject)[side]);
                    let Some(factor) = factor.filter(|f| (f - 1.0).abs() > TOLERANCE) else { continue };
                    for (link, axis, _) in self.limb_chain(from, to).iter().filter(|(.., share)| share.abs() > 1e-6) {
                        shape.links[*link].length[*axis] *= factor;
                    }
                }
            }
        }
    }

    /// The axis of a link's frame closest to a direction of the root's frame, and its sign.
    fn axis(&self, link: usize, direction: &Vector3<f64>) -> (usize, f64) {
        let here = self.root_from_links[link].rotation.inverse() * direction;
        let axis = here.iamax();
        (axis, if here[axis] < 0.0 { -1.0 } else { 1.0 })
    }

    /// Each link's contribution to the distance from `from` to `to`, at the zero pose, along its axis closest to a
    /// direction.
    fn chain(&self, from: LinkPoint, to: LinkPoint, direction: &Vector3<f64>) -> Contributions {
        let share = |link: usize, place: &Vector3<f64>, sense: f64| {
            let (axis, sign) = self.axis(link, direction);
            (link, axis, sense * sign * place[axis])
        };
        let above = |link: usize| -> Option<LinkPoint> {
            let joint = &self.template.joints[link.checked_sub(1)?];
            let place = joint.parent_from_joint.translation.vector;
            Some(LinkPoint { link: joint.parent, point_in_link: place.into() })
        };
        let (mut from, mut to) = (from, to);
        let mut contributions = Contributions::new();
        // a parent has the smaller index, so the link with the larger index is never an ancestor of the other
        while from.link != to.link {
            let (end, sense) = if to.link > from.link { (&mut to, 1.0) } else { (&mut from, -1.0) };
            contributions.push(share(end.link, &end.point_in_link.coords, sense));
            let Some(next) = above(end.link) else { break };
            *end = next;
        }
        contributions.push(share(to.link, &(to.point_in_link - from.point_in_link), 1.0));
        contributions
    }
}
