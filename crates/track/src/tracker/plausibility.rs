//! Penalties for implausible poses: ground penetration, self-penetration and exceeded joint limits.

use serde::{Deserialize, Serialize};

use super::placed_body::PlacedBody;
use super::settings::check_range;
use crate::motion_model::SettingError;
use skiagraph_core::body::{Humanoid, LinkFrames, Pose};
use skiagraph_core::camera::Camera;
use skiagraph_core::contact::{Interpenetration, InterpenetrationScratch};

/// Metres that one radian beyond a joint limit counts as.
const LIMIT_LEVER: f64 = 0.1;

/// Weight and thresholds of the plausibility term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlausibilitySettings {
    /// Energy per metre of depth, beyond the tolerance, by which a pose penetrates the ground or itself, 1/m; 0 leaves
    /// only the rejection. Default: 0.5, chosen on CMU 16_15 and 35_02 among 0.5, 2 and 8: higher weights keep a body
    /// with too long legs out of the ground at the expense of the pose.
    pub weight: f64,
    /// Depths up to this are free: recordings penetrate the ground by some millimetres, and the tracker's body is not
    /// the actor's. Metres, >= 0.
    pub tolerance_m: f64,
    /// Poses that penetrate the ground or themselves by more than this beyond the tolerance are rejected before
    /// rendering. Metres, > 0. Default: no pose is rejected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reject_beyond_m: Option<f64>,
}

impl Default for PlausibilitySettings {
    fn default() -> Self {
        Self { weight: 0.5, tolerance_m: 0.01, reject_beyond_m: None }
    }
}

impl PlausibilitySettings {
    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] for the first setting out of range.
    pub fn validate(&self) -> Result<(), SettingError> {
        check_range("plausibility.weight", self.weight, 0.0..=1e6)?;
        if !(self.tolerance_m >= 0.0 && self.tolerance_m.is_finite()) {
            return Err(SettingError::new("plausibility.tolerance_m", "a finite number, 0 or more", self.tolerance_m));
        }
        match self.reject_beyond_m {
            Some(depth) if !(depth > 0.0 && depth.is_finite()) => {
                Err(SettingError::new("plausibility.reject_beyond_m", "a finite number above 0", depth))
            }
            _ => Ok(()),
        }
    }
}

/// The plausibility term `weight (g + s + l)` of a pose's energy, with `g` the depth of the body's lowest point below
/// the ground z = 0, `s` the sum of the depths of all penetrating pairs of solids that must stay apart
/// ([`skiagraph_core::contact::SelfCollision`]), each beyond the tolerance, and `l` the sum of the angles' excesses
/// over their limits, 1 rad counting as 0.1 m.
///
/// `[Balan 2005]` rejects poses whose limbs interpenetrate or exceed their limits ("hard priors");
/// [`PlausibilitySettings::reject_beyond_m`] is that rule. A rejected pose has infinite energy; a filter that has only
/// rejected particles uses [`super::Likelihood::energy_unrejected`].
#[derive(Debug)]
pub(super) struct Plausibility {
    /// Lowest and highest value of every degree of freedom.
    limits: Vec<[f64; 2]>,
    solids: Interpenetration,
    settings: PlausibilitySettings,
}

impl Plausibility {
    pub(super) fn new(body: &Humanoid, settings: PlausibilitySettings) -> Result<Self, SettingError> {
        settings.validate()?;
        let limits = body.degrees_of_freedom.iter().map(|limits| [limits.lower, limits.upper]).collect();
        Ok(Self { solids: Interpenetration::new(body, settings.tolerance_m), limits, settings })
    }

    /// Whether a body with links at `frames` penetrates the ground or itself too deeply.
    pub(super) fn rejects(&self, frames: &LinkFrames, scratch: &mut InterpenetrationScratch) -> bool {
        self.settings.reject_beyond_m.is_some_and(|limit| {
            let depths = self.solids.depths(frames, scratch);
            depths.ground_m.max(depths.own_m) > limit
        })
    }

    /// The penalty added to a pose's energy; `camera` is the one in whose frame the body's capsules are, if any.
    pub(super) fn penalty(
        &self,
        pose: &Pose,
        placed: &PlacedBody,
        camera: Option<&Camera>,
        scratch: &mut InterpenetrationScratch,
    ) -> f64 {
        let depths = match camera {
            Some(camera) => {
                self.solids.depths_in_camera(&placed.frames, &placed.capsules, &camera.camera_from_world, scratch)
            }
            None => self.solids.depths(&placed.frames, scratch),
        };
        let depth = depths.ground_m + depths.own_sum_m;
        self.settings.weight * (depth + LIMIT_LEVER * beyond_limits(&self.limits, pose))
    }
}

/// Sum of the excesses over the limits, radians (metres for prismatic joints).
fn beyond_limits(limits: &[[f64; 2]], pose: &Pose) -> f64 {
    let angles = pose.joint_angles.as_slice().iter().zip(limits);
    let broken = angles.filter(|&(angle, [lower, upper])| angle < lower || angle > upper);
    broken.map(|(angle, [lower, upper])| (lower - angle).max(angle - upper)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings, fixture};
    use skiagraph_core::body::shipped;

    fn standing(body: &Humanoid, height: f64) -> Pose {
        let mut pose = body.zero_pose();
        pose.world_from_root.translation.z = height;
        pose
    }

    /// A body, the height at which its soles touch the ground, and likelihoods without and with plausibility.
    fn likelihoods(settings: PlausibilitySettings) -> (Humanoid, f64, SilhouetteLikelihood, SilhouetteLikelihood) {
        let body = shipped("tracker25").unwrap();
        let links: Vec<usize> = (0..body.links.len()).collect();
        let height = -body.lowest_point(&body.link_frames(&body.zero_pose()), &links).unwrap().z;
        let rig = fixture::ring(2, 4.5, [160, 120]);
        let seen = fixture::seen(&body, &standing(&body, height), &rig, 0);
        let silhouettes = || {
            let mut likelihood = SilhouetteLikelihood::new(body.clone(), &rig, SilhouetteSettings::default()).unwrap();
            likelihood.prepare(&seen).unwrap();
            likelihood
        };
        let plausible = silhouettes().with_plausibility(settings).unwrap();
        (body.clone(), height, silhouettes(), plausible)
    }

    fn added(with: &SilhouetteLikelihood, without: &SilhouetteLikelihood, pose: &Pose) -> f64 {
        with.energy(pose, &mut with.scratch()) - without.energy(pose, &mut without.scratch())
    }

    #[test]
    fn a_plausible_pose_has_no_penalty_and_one_in_the_ground_has_one() {
        let settings = PlausibilitySettings { weight: 3.0, tolerance_m: 0.01, reject_beyond_m: None };
        let (body, height, without, with) = likelihoods(settings);
        assert_eq!(added(&with, &without, &standing(&body, height)), 0.0);
        assert_eq!(added(&with, &without, &standing(&body, height - 0.009)), 0.0);
        let sunk = added(&with, &without, &standing(&body, height - 0.06));
        assert!((sunk - 3.0 * 0.05).abs() < 1e-9, "{sunk}");
    }

    #[test]
    fn crossed_legs_and_a_hyperextended_knee_are_penalised() {
        let (body, height, without, with) =
            likelihoods(PlausibilitySettings { tolerance_m: 0.0, ..Default::default() });
        let mut crossed = standing(&body, height + 0.1);
        crossed.joint_angles[body.find_degree_of_freedom("left_hip_abduction").unwrap()] = -0.3;
        assert!(added(&with, &without, &crossed) > 0.005, "{}", added(&with, &without, &crossed));
        let mut bent = standing(&body, height + 0.1);
        bent.joint_angles[body.find_degree_of_freedom("left_knee_flexion").unwrap()] = -0.2;
        assert!((added(&with, &without, &bent) - 0.5 * 0.1 * 0.2).abs() < 1e-9);
    }

    #[test]
    fn poses_that_penetrate_too_deeply_are_rejected_but_have_an_unrejected_energy() {
        let settings = PlausibilitySettings { weight: 1.0, tolerance_m: 0.01, reject_beyond_m: Some(0.05) };
        let (body, height, without, with) = likelihoods(settings);
        let deep = standing(&body, height - 0.2);
        assert_eq!(with.energy(&deep, &mut with.scratch()), f64::INFINITY);
        let unrejected = with.energy_unrejected(&deep, &mut with.scratch());
        assert!((unrejected - without.energy(&deep, &mut without.scratch()) - 0.19).abs() < 1e-9);
        assert!(with.energy(&standing(&body, height - 0.05), &mut with.scratch()).is_finite());
        let nowhere = standing(&body, f64::NAN);
        assert!(with.energy(&nowhere, &mut with.scratch()).is_nan());
    }

    #[test]
    fn batched_energies_equal_single_energies() {
        for reject_beyond_m in [None, Some(0.05)] {
            let settings = PlausibilitySettings { weight: 3.0, tolerance_m: 0.0, reject_beyond_m };
            let (body, height, _, with) = likelihoods(settings);
            let depths = [0.0, 0.02, f64::NAN, 0.2, 0.01, 0.0, 0.03, 0.04, 0.001, 0.3];
            let poses: Vec<Pose> = depths.iter().map(|depth| standing(&body, height - depth)).collect();
            let mut scratch = with.scratch();
            for size in [1, 3, 8, 10] {
                let mut together = vec![0.0; poses.len()];
                for (poses, energies) in poses.chunks(size).zip(together.chunks_mut(size)) {
                    with.energies(&poses.iter().collect::<Vec<_>>(), energies, &mut scratch);
                }
                let alone: Vec<f64> = poses.iter().map(|pose| with.energy(pose, &mut with.scratch())).collect();
                let bits = |energies: &[f64]| energies.iter().map(|energy| energy.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&together), bits(&alone), "{size}");
                assert!(alone[1] > alone[0] && alone[2].is_nan());
                assert_eq!(alone[3].is_infinite(), reject_beyond_m.is_some());
            }
        }
    }
}
