//! Thickness of a person around bones.

use nalgebra::Point3;

use super::super::Landmark;
use super::super::bodily_links::StandingBody;

/// Bones between landmarks with a person's radii at both ends, metres at [`STATURE`]; limbs first.
const BONES: [(Landmark, Landmark, f64, f64); 14] = {
    use Landmark as L;
    [
        (L::LeftHip, L::LeftKnee, 0.080, 0.056),
        (L::RightHip, L::RightKnee, 0.080, 0.056),
        (L::LeftKnee, L::LeftAnkle, 0.055, 0.037),
        (L::RightKnee, L::RightAnkle, 0.055, 0.037),
        (L::LeftShoulder, L::LeftElbow, 0.054, 0.041),
        (L::RightShoulder, L::RightElbow, 0.054, 0.041),
        (L::LeftElbow, L::LeftWrist, 0.042, 0.028),
        (L::RightElbow, L::RightWrist, 0.042, 0.028),
        (L::Thorax, L::HeadTop, 0.055, 0.085),
        (L::Pelvis, L::Thorax, 0.125, 0.085),
        (L::Pelvis, L::LeftHip, 0.110, 0.090),
        (L::Pelvis, L::RightHip, 0.110, 0.090),
        (L::Thorax, L::LeftShoulder, 0.075, 0.056),
        (L::Thorax, L::RightShoulder, 0.075, 0.056),
    ]
};

/// Stature at which radii are stated, metres.
pub(super) const STATURE: f64 = 1.75;

/// As a share of the stature: bones whose distances to a point differ by less than this are equally near.
const SAME_PLACE: f64 = 0.005;
/// The end of a capsule farther than this from its bone gets the bone's radius there.
const OFF_BONE: f64 = 0.03;

/// Radii of a bone of a body without landmarks: relative to its length, and the least and greatest, metres at
/// [`STATURE`].
const LONE_STOUTNESS: f64 = 0.16;
const LONE_RADII: [f64; 2] = [0.028, 0.085];

/// A person's thickness around the bones of a standing body.
pub(super) struct Thickness {
    bones: Vec<StoutBone>,
    stature: f64,
    /// Scale factor relative to [`STATURE`]: girths grow with the square root of the stature.
    pub(super) girth: f64,
}

impl Thickness {
    pub(super) fn new(standing: &StandingBody<'_>) -> Self {
        let bones = BONES.into_iter().filter_map(|(from, to, radius_from, radius_to)| {
            let markers = &standing.markers;
            Some(StoutBone { from: markers[from as usize]?, to: markers[to as usize]?, radius_from, radius_to })
        });
        Self { bones: bones.collect(), stature: standing.stature, girth: libm::sqrt(standing.stature / STATURE) }
    }

    /// Radii at both ends of a capsule: those of the bone nearest to its middle.
    pub(super) fn radii(&self, from: &Point3<f64>, to: &Point3<f64>) -> [f64; 2] {
        let middle = nalgebra::center(from, to);
        let Some(bone) = self.bones.iter().min_by(|a, b| a.distance(&middle).total_cmp(&b.distance(&middle))) else {
            return [self.lone_radius((to - from).norm()); 2];
        };
        [from, to].map(|end| {
            if bone.distance(end) <= OFF_BONE * self.stature {
                bone.radius(end) * self.girth
            } else {
                self.radius_at(end)
            }
        })
    }

    /// Radius of the bone nearest to a point; the thinner one of equally near bones.
    pub(super) fn radius_at(&self, point: &Point3<f64>) -> f64 {
        let nearest = self.bones.iter().map(|bone| bone.distance(point)).fold(f64::INFINITY, f64::min);
        let near = self.bones.iter().filter(|bone| bone.distance(point) <= nearest + SAME_PLACE * self.stature);
        let radius = near.map(|bone| bone.radius(point)).fold(f64::INFINITY, f64::min);
        if radius.is_finite() { radius * self.girth } else { self.lone_radius(0.0) }
    }

    /// Radius of a bone of a body without landmarks.
    fn lone_radius(&self, length: f64) -> f64 {
        let [least, most] = LONE_RADII.map(|radius| radius * self.girth);
        (LONE_STOUTNESS * length).clamp(least, most)
    }
}

/// A bone between two landmarks, metres at [`STATURE`].
struct StoutBone {
    from: Point3<f64>,
    to: Point3<f64>,
    radius_from: f64,
    radius_to: f64,
}

impl StoutBone {
    fn along(&self, point: &Point3<f64>) -> f64 {
        let axis = self.to - self.from;
        ((point - self.from).dot(&axis) / axis.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    fn distance(&self, point: &Point3<f64>) -> f64 {
        (point - (self.from + (self.to - self.from) * self.along(point))).norm()
    }

    fn radius(&self, point: &Point3<f64>) -> f64 {
        self.radius_from + self.along(point) * (self.radius_to - self.radius_from)
    }
}
