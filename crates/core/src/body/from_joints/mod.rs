//! Solids from the skeleton alone: tapered capsules from every link's joint to the joints of its children.
//!
//! Radii are those of a person ([`thickness`]). End links get a foot, a hand, toes or a head ([`ends`]).

mod ends;
mod thickness;

use nalgebra::{Point3, Vector3};

use super::bodily_links::StandingBody;
use super::{Humanoid, Landmark, LinkPoint, Solid};
use crate::raster::TaperedCapsule;
use thickness::Thickness;

/// As a share of the stature: nearer joints are treated as one.
const SAME_PLACE: f64 = 0.005;
/// Joints nearer to a landmark than this coincide with it.
const SAME_JOINT: f64 = 0.03;

/// Middle and end landmarks of the left and right arm, and of the legs.
const LIMB_ENDS: [[[Landmark; 2]; 2]; 2] = {
    use Landmark as L;
    [
        [[L::LeftElbow, L::LeftWrist], [L::RightElbow, L::RightWrist]],
        [[L::LeftKnee, L::LeftAnkle], [L::RightKnee, L::RightAnkle]],
    ]
};

/// Landmarks at the end of a bone without a joint: a wrist without a hand, a trunk without a neck.
const BONE_ENDS: [Landmark; 5] =
    [Landmark::LeftWrist, Landmark::RightWrist, Landmark::LeftAnkle, Landmark::RightAnkle, Landmark::Thorax];

impl Humanoid {
    /// The same skeleton with its solids replaced by tapered capsules from joint to joint; masses, inertias, joints
    /// and markers are kept, a skin is removed. For a robot without its meshes or with few solids.
    pub fn with_solids_from_joints(&self) -> Self {
        let standing = StandingBody::new(self);
        let capsules = CapsuleBuilder::new(&standing).build();
        let mut body = Self { skin: None, ..self.clone() };
        for (link, own) in body.links.iter_mut().zip(capsules) {
            link.solids = own.into_iter().map(Solid::TaperedCapsule).collect();
        }
        body
    }
}

struct CapsuleBuilder<'a> {
    standing: &'a StandingBody<'a>,
    thickness: Thickness,
    /// Capsules of every link, in its frame.
    capsules: Vec<Vec<TaperedCapsule>>,
    /// For every link, whether it is a hand or a foot, or below one.
    is_end: Vec<bool>,
}

/// A point of a standing body and its link.
#[derive(Clone, Copy)]
struct CarriedPoint {
    link: usize,
    place: Point3<f64>,
}

impl<'a> CapsuleBuilder<'a> {
    fn new(standing: &'a StandingBody<'a>) -> Self {
        let links = standing.body.links.len();
        let thickness = Thickness::new(standing);
        let mut limner = Self { standing, thickness, capsules: vec![Vec::new(); links], is_end: vec![false; links] };
        for [_, landmark] in LIMB_ENDS.into_iter().flatten() {
            let Some(end) = limner.last_at(landmark) else { continue };
            limner.is_end[end.link] |= limner.is_at(end.link, &end.place);
        }
        for link in 1..links {
            limner.is_end[link] |= limner.is_end[standing.body.joints[link - 1].parent];
        }
        limner
    }

    fn build(mut self) -> Vec<Vec<TaperedCapsule>> {
        self.add_bones();
        self.add_head();
        self.add_feet();
        self.add_hands();
        self.add_other_ends();
        self.capsules
    }

    /// Converts a share of the stature to metres.
    fn share(&self, share: f64) -> f64 {
        share * self.standing.stature
    }

    fn add(&mut self, link: usize, [from, to]: [Point3<f64>; 2], [radius_a, radius_b]: [f64; 2]) {
        let frame = &self.standing.frames[link];
        let [a, b] = [from, to].map(|point| frame.inverse_transform_point(&point));
        self.capsules[link].push(TaperedCapsule { a, b, radius_a, radius_b });
    }

    /// Capsules from every joint to those below it.
    fn add_bones(&mut self) {
        let standing = self.standing;
        for link in (0..standing.body.links.len()).filter(|&link| standing.is_bodily[link]) {
            if self.is_end[link] {
                continue;
            }
            let origin = standing.origin(link);
            let mut targets: Vec<Point3<f64>> = standing.children(link).map(|child| standing.origin(child)).collect();
            targets.extend(self.bone_ends_on(link, &targets));
            targets.retain(|target| (target - origin).norm() > self.share(SAME_PLACE));
            for target in &targets {
                self.add(link, [origin, *target], self.thickness.radii(&origin, target));
            }
            let is_hinge = targets.is_empty() && standing.children(link).next().is_some();
            if is_hinge && standing.has_mass(link) {
                self.add(link, [origin, origin], [self.thickness.radius_at(&origin); 2]);
            }
        }
    }

    /// Landmarks of a link that have no joint.
    fn bone_ends_on(&self, link: usize, joints: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let ends = BONE_ENDS.into_iter().filter_map(|landmark| self.landmark(landmark));
        let apart = |place: &Point3<f64>| joints.iter().all(|joint| (joint - place).norm() > self.share(SAME_JOINT));
        ends.filter(|end| end.link == link && apart(&end.place)).map(|end| end.place).collect()
    }

    /// From the neck, or the head's own joint, to the crown.
    fn add_head(&mut self) {
        let (Some(crown), Some(neck)) = (self.landmark(Landmark::HeadTop), self.landmark(Landmark::Thorax)) else {
            return;
        };
        let own = self.standing.origin(crown.link);
        let lowest = neck.place.z - self.share(SAME_JOINT);
        let has_joint = crown.link != neck.link && (lowest..crown.place.z).contains(&own.z);
        let base = if has_joint { own } else { neck.place };
        let radii = self.thickness.radii(&base, &crown.place);
        let up = (crown.place - base).try_normalize(1e-9).unwrap_or(Vector3::z());
        let middle = crown.place - up * radii[1].min(0.5 * (crown.place - base).norm());
        self.add(crown.link, [base, middle], radii);
    }

    fn landmark(&self, landmark: Landmark) -> Option<CarriedPoint> {
        let LinkPoint { link, .. } = self.standing.body.markers[landmark as usize]?;
        Some(CarriedPoint { link, place: self.standing.markers[landmark as usize]? })
    }

    /// A landmark on the last link whose joint is there.
    fn last_at(&self, landmark: Landmark) -> Option<CarriedPoint> {
        let mut found = self.landmark(landmark)?;
        while let Some(next) = self.standing.children(found.link).find(|&child| self.is_at(child, &found.place)) {
            found.link = next;
        }
        Some(found)
    }

    fn is_at(&self, link: usize, place: &Point3<f64>) -> bool {
        (self.standing.origin(link) - place).norm() <= self.share(SAME_JOINT)
    }

    fn centre_of_mass(&self, link: usize) -> Option<Point3<f64>> {
        let inertia = self.standing.body.links[link].inertia.as_ref()?;
        Some(self.standing.frames[link] * inertia.centre_of_mass)
    }
}

#[cfg(test)]
mod tests;
