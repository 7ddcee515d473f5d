//! The simplest motion model: a pose with constant position or velocity and Gaussian diffusion of each degree of
//! freedom.

use rand_chacha::ChaCha8Rng;

use super::{MotionModel, NormalEquations, SettingError};
use skiagraph_core::body::{DegreeOfFreedom, Humanoid, Pose, Prediction, ProposalScales, ROOT_STEP};
use skiagraph_core::rng::normal;

/// Settings of [`Diffusion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffusionSettings {
    /// Expected pose in the next frame.
    pub prediction: Prediction,
    /// Factor on every standard deviation of the proposal, > 0.
    pub scale: f64,
}

impl Default for DiffusionSettings {
    fn default() -> Self {
        Self { prediction: Prediction::None, scale: 1.0 }
    }
}

/// Weight of the last estimate in a descent, in squared lengths of the residuals: weak, because it only has to
/// determine what the images do not show. A weight a hundred times as large loses track of a walk.
const DESCENT_PULL: f64 = 0.005;
/// Greatest translation of the root in one step of a descent, metres.
const DESCENT_SLIDE_M: f64 = 0.1;
/// Greatest rotation of the root or change of a joint angle in one step of a descent, radians.
const DESCENT_TURN_RAD: f64 = 0.3;

/// `x_t = x_{t-1} (+ velocity) + N(0, P_0)` with `P_0` diagonal: the temporal model of `[Skinned APF]`. A particle is
/// a pose.
///
/// Joint angles beyond a limit are reflected at it, and clamped if they are then beyond the other limit. With clamping
/// alone, particles would accumulate at the limits.
#[derive(Clone, Debug)]
pub struct Diffusion {
    body: Humanoid,
    deviations: Vec<f64>,
    prediction: Prediction,
}

impl Diffusion {
    /// A diffusion of `body` with standard deviations `settings.scale * scales` per frame.
    ///
    /// # Errors
    /// [`SettingError`] if a scale is negative or not finite, or their number is not that of the degrees of freedom.
    pub fn new(body: Humanoid, scales: &ProposalScales, settings: &DiffusionSettings) -> Result<Self, SettingError> {
        if !(settings.scale > 0.0 && settings.scale.is_finite()) {
            return Err(SettingError::new("diffusion.scale", "a number > 0", settings.scale));
        }
        if scales.joints.len() != body.degrees_of_freedom.len() {
            let expected = format!("{} numbers, one per degree of freedom", body.degrees_of_freedom.len());
            return Err(SettingError::new("proposal.joints", expected, scales.joints.len()));
        }
        let deviations: Vec<f64> = scales.in_step_order().iter().map(|d| d * settings.scale).collect();
        if let Some(bad) = deviations.iter().find(|d| !(d.is_finite() && **d >= 0.0)) {
            return Err(SettingError::new("proposal", "standard deviations >= 0", bad));
        }
        Ok(Self { body, deviations, prediction: settings.prediction })
    }

    fn noise(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        self.deviations.iter().map(|d| d * normal(rng)).collect()
    }

    /// Allowed range of each number of a step of descent from `state`, down and up.
    fn descent_room(&self, state: &Pose) -> Vec<[f64; 2]> {
        let slide = [[-DESCENT_SLIDE_M, DESCENT_SLIDE_M]; 3];
        let turn = [[-DESCENT_TURN_RAD, DESCENT_TURN_RAD]; 3];
        let within = |(angle, limits): (&f64, &DegreeOfFreedom)| {
            [(limits.lower - angle).max(-DESCENT_TURN_RAD), (limits.upper - angle).min(DESCENT_TURN_RAD)]
        };
        let joints = state.joint_angles.iter().zip(&self.body.degrees_of_freedom).map(within);
        slide.into_iter().chain(turn).chain(joints).collect()
    }

    /// Brings every angle within its limits. A reflection keeps the density of a symmetric step continuous up to the
    /// limit; a step longer than the whole range would leave it again on the other side, and is clamped there.
    fn reflect_at_limits(&self, pose: &mut Pose) {
        for (angle, dof) in pose.joint_angles.iter_mut().zip(&self.body.degrees_of_freedom) {
            if *angle < dof.lower {
                *angle = (2.0 * dof.lower - *angle).min(dof.upper);
            } else if *angle > dof.upper {
                *angle = (2.0 * dof.upper - *angle).max(dof.lower);
            }
        }
    }
}

impl MotionModel for Diffusion {
    type State = Pose;

    fn body(&self) -> &Humanoid {
        &self.body
    }

    fn sample_initial(&self, start: &Pose, _particle: usize, _particles: usize, rng: &mut ChaCha8Rng) -> Pose {
        self.step(start, &self.noise(rng))
    }

    fn propagate(&self, state: &Pose, past: &[Pose], rng: &mut ChaCha8Rng) -> Pose {
        let mut step = self.noise(rng);
        if let (Prediction::ConstantVelocity, [.., before, last]) = (self.prediction, past) {
            let mut velocity = vec![0.0; ROOT_STEP + state.joint_angles.len()];
            self.body.difference(before, last, &mut velocity);
            step.iter_mut().zip(&velocity).for_each(|(s, v)| *s += v);
        }
        self.step(state, &step)
    }

    fn pose<'a>(&self, state: &'a Pose) -> &'a Pose {
        state
    }

    fn deviations(&self) -> &[f64] {
        &self.deviations
    }

    fn step(&self, state: &Pose, step: &[f64]) -> Pose {
        let mut pose = self.body.step(state, step);
        self.reflect_at_limits(&mut pose);
        pose
    }

    fn difference(&self, from: &Pose, to: &Pose, step: &mut [f64]) {
        self.body.difference(from, to, step);
    }

    fn descends(&self) -> bool {
        true
    }

    fn descend(&self, state: &Pose, anchor: &Pose, mut evidence: NormalEquations) -> Option<Pose> {
        let mut towards = vec![0.0; self.body.step_len()];
        self.body.difference(state, anchor, &mut towards);
        let pull = |d: &f64| DESCENT_PULL / (d * d).max(1e-8) * evidence.prior_weight;
        let precision: Vec<f64> = self.deviations.iter().map(pull).collect();
        evidence.pull(&towards, &precision);
        let step = evidence.step_within(&self.descent_room(state))?;
        let mut pose = self.body.step(state, step.as_slice());
        self.body.clamp_to_limits(&mut pose);
        Some(pose)
    }

    fn with_pose(&self, _state: &Pose, pose: &Pose) -> Option<Pose> {
        Some(pose.clone())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DVector, Vector3};

    use super::*;
    use skiagraph_core::rng::{Purpose, stream};

    fn scales(body: &Humanoid) -> ProposalScales {
        ProposalScales {
            root_translation_m: [0.01, 0.02, 0.03],
            root_rotation_rad: [0.04, 0.05, 0.06],
            joints: DVector::from_fn(body.degrees_of_freedom.len(), |i, _| 0.001 * (i + 1) as f64),
        }
    }

    fn diffusion(prediction: Prediction, scale: f64) -> Diffusion {
        let body = Humanoid::tracker25().unwrap();
        Diffusion::new(body.clone(), &scales(&body), &DiffusionSettings { prediction, scale }).unwrap()
    }

    /// The zero pose with every angle in the middle of its range, far from all limits.
    fn relaxed(body: &Humanoid) -> Pose {
        let mut pose = body.zero_pose();
        for (angle, dof) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
            *angle = 0.5 * (dof.lower + dof.upper);
        }
        pose
    }

    #[test]
    fn particles_spread_by_the_given_deviations_times_the_scale() {
        let model = diffusion(Prediction::None, 2.0);
        let start = relaxed(&model.body);
        let count = 4000_u32;
        let mut mean_square = vec![0.0; model.body.step_len()];
        let mut step = mean_square.clone();
        for i in 0..count {
            let state = model.sample_initial(&start, 0, 1, &mut stream(1, Purpose::Initialisation, 0, 0, i.into()));
            model.difference(&start, &state, &mut step);
            mean_square.iter_mut().zip(&step).for_each(|(q, s)| *q += s * s / f64::from(count));
        }
        for (square, planted) in mean_square.iter().zip(scales(&model.body).in_step_order()) {
            // The standard deviation of a standard deviation over 4000 draws is 1.1 %.
            assert!((square.sqrt() / (2.0 * planted) - 1.0).abs() < 0.06, "{} for {planted}", square.sqrt());
        }
    }

    #[test]
    fn constant_velocity_continues_the_motion_of_the_estimates() {
        let mut model = diffusion(Prediction::ConstantVelocity, 1.0);
        model.deviations.fill(0.0);
        let before = relaxed(&model.body);
        let velocity: Vec<f64> = (0..model.body.step_len()).map(|i| 0.002 * i as f64).collect();
        let last = model.body.step(&before, &velocity);
        let mut particle = last.clone();
        particle.world_from_root.translation.vector += Vector3::new(1.0, 0.0, 0.0);
        let mut rng = stream(1, Purpose::Perturbation, 0, 0, 0);
        let found = model.propagate(&particle, &[before, last], &mut rng);
        let mut step = vec![0.0; velocity.len()];
        model.difference(&particle, &found, &mut step);
        for (found, planted) in step.iter().zip(&velocity) {
            assert!((found - planted).abs() < 1e-12);
        }
        assert_eq!(model.propagate(&particle, &[], &mut rng), particle, "there is no velocity without a past");
    }

    #[test]
    fn a_step_beyond_a_limit_is_reflected_and_one_beyond_both_is_clamped() {
        let model = diffusion(Prediction::None, 1.0);
        let knee = model.body.find_degree_of_freedom("left_knee_flexion").unwrap();
        let limits = model.body.degrees_of_freedom[knee].clone();
        let mut pose = relaxed(&model.body);
        pose.joint_angles[knee] = limits.lower + 0.1;
        let stepped = |change: f64| {
            let mut step = vec![0.0; model.body.step_len()];
            step[ROOT_STEP + knee] = change;
            model.step(&pose, &step).joint_angles[knee]
        };
        assert!((stepped(-0.3) - (limits.lower + 0.2)).abs() < 1e-12);
        assert_eq!(stepped(-9.0), limits.upper);
        assert_eq!(stepped(9.0), limits.lower);
    }

    #[test]
    fn invalid_deviations_are_refused_by_key() {
        let body = Humanoid::tracker25().unwrap();
        let good = scales(&body);
        let refusal = |scales: &ProposalScales, scale| {
            let settings = DiffusionSettings { scale, ..DiffusionSettings::default() };
            Diffusion::new(body.clone(), scales, &settings).unwrap_err().to_string()
        };
        assert_eq!(refusal(&good, 0.0), "diffusion.scale: expected a number > 0, found 0");
        assert_eq!(refusal(&good, f64::NAN), "diffusion.scale: expected a number > 0, found NaN");
        let short = ProposalScales { joints: DVector::zeros(2), ..good.clone() };
        assert_eq!(refusal(&short, 1.0), "proposal.joints: expected 19 numbers, one per degree of freedom, found 2");
        let negative = ProposalScales { root_translation_m: [-1.0; 3], ..good };
        assert_eq!(refusal(&negative, 1.0), "proposal: expected standard deviations >= 0, found -1");
    }
}
