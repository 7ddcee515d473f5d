//! Refinement after the last layer: descent of the estimate and a search for lost limbs.

mod limb_joints;
mod limb_memory;

use std::sync::{Mutex, PoisonError};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub(super) use self::limb_joints::arms_and_legs;
use self::limb_joints::limbs;
use self::limb_memory::{MirroredAngles, PoseMemory};
use super::Likelihood;
use super::settings::check_range;
use crate::motion_model::{MotionModel, SettingError};
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::rng::{Purpose, stream};

/// How the estimate of an annealed particle filter is refined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RefinementSettings {
    /// Gauss-Newton steps of each descent, >= 1.
    pub iterations: usize,
    /// Interval of the search for lost limbs in frames, where particles are searched; every eighth frame has it, too; 0
    /// for never. Arms, legs and pairs of them are sampled at random: within their limits, near the estimate and near
    /// training poses.
    pub limb_every: usize,
    /// Poses sampled for each limb and each pair of limbs.
    pub limb_samples: usize,
    /// Gauss-Newton steps from each of the two best samples.
    pub limb_iterations: usize,
    /// Share of the particles that continue from the refined pose, in [0, 1].
    pub share: f64,
    /// Share of the outline, in [0, 1], that must agree with the observation for a frame without particles: if the
    /// descents from the last estimate, and from the pose that continues the motion, find as much in three images or
    /// more, at an energy as low as usual and no joint more than 0.25 m from where it was, nothing is searched. Every
    /// eighth frame, and the first two, are always searched; 1 searches in all.
    pub sure: f64,
}

impl Default for RefinementSettings {
    fn default() -> Self {
        Self { iterations: 6, limb_every: 2, limb_samples: 30, limb_iterations: 4, share: 0.5, sure: 0.95 }
    }
}

impl RefinementSettings {
    /// Mean number of energies evaluated per frame that is searched, for a body with arms and legs.
    pub fn evaluations_per_frame(&self) -> u64 {
        let limb = (self.limb_samples + LIMB_DESCENTS.min(self.limb_samples)) as u64;
        USUAL_STARTS + (USUAL_LIMBS * limb).checked_div(self.limb_every as u64).unwrap_or(0)
    }

    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] for the first setting out of range.
    pub fn validate(&self) -> Result<(), SettingError> {
        let counts = [
            ("refinement.iterations", self.iterations, 1..=100),
            ("refinement.limb_every", self.limb_every, 0..=1_000_000),
            ("refinement.limb_samples", self.limb_samples, 0..=100_000),
            ("refinement.limb_iterations", self.limb_iterations, 0..=100),
        ];
        for (key, found, allowed) in counts {
            if !allowed.contains(&found) {
                let expected = format!("a whole number from {} to {}", allowed.start(), allowed.end());
                return Err(SettingError::new(key, expected, found));
            }
        }
        check_range("refinement.share", self.share, 0.0..=1.0)?;
        check_range("refinement.sure", self.sure, 0.0..=1.0)
    }
}

/// Interval, frames, at which particles are searched however well the outline agrees: a limb that a silhouette hides
/// may have gone elsewhere.
const ALWAYS_SEARCHED: usize = 8;
/// Maximum ratio of a pose's energy to the usual one without a search. Parts of a mask that no limb covers raise the
/// energy, while the body's own outline may still agree.
const SURE_ENERGY: f64 = 1.25;
/// Factor by which the usual energy rises from frame to frame: poses differ in how well a body can fit.
const ENERGY_RISE: f64 = 1.02;
/// Greatest step of a joint between frames without a search, metres: descents from the poses before find limbs that are
/// within their own length, and a limb at 15 m/s moves as far at 60 Hz. Slower recordings have larger steps.
const SURE_STEP_M: f64 = 0.25;
/// Least number of images without a search: the outlines of one or two agree with wrong poses, too.
const SURE_VIEWS: usize = 3;
/// Number of descents in a frame, from the third frame on.
const USUAL_STARTS: u64 = 4;
/// Number of limbs and pairs of limbs of most bodies.
const USUAL_LIMBS: u64 = 6;
/// Share of an outline that disagrees with the observation when tracking succeeds.
const USUAL_MISFIT: f64 = 0.06;
/// Width of the residuals' robust weight in the first and last step of a descent, lengths.
const FIRST_WIDTH: f64 = 8.0;
pub(super) const FINAL_WIDTH: f64 = 1.5;
/// The same in the last step from a sample of a limb, so wide that residuals stay sparse: a limb only has to be found
/// here, and the next frame's descent is exact.
const LIMB_WIDTH: f64 = 3.0;
/// Standard deviation of limb samples around the estimate, radians.
const NEAR_RAD: f64 = 0.4;
/// Standard deviation of limb samples around a training pose or an earlier estimate, radians.
const NEAR_SEEN_RAD: f64 = 0.1;
/// Standard deviation of a limb's other angles when one angle is sampled over its whole range, radians.
const NEAR_OTHERS_RAD: f64 = 0.2;
/// Minimum difference in some angle for the second sample to be descended, radians: the neighbours of a pose in a local
/// minimum have the lowest energies, and all would converge to it.
const DISTINCT_RAD: f64 = 0.7;
/// Sampling range of angles without limits, radians.
const NO_LIMIT_RAD: f64 = std::f64::consts::PI;
const LIMB_DESCENTS: usize = 2;

/// Refines the estimate of a frame; its energy never rises.
///
/// 1. *Descent* ([`Likelihood::linearise`], [`MotionModel::descend`]) from the last estimate, from this frame's
///    estimate, from the pose that continues the motion of the last two, and from the particle of lowest energy; the
///    result of lowest energy is kept. Without the third, a stride between two frames ends in the other leg.
/// 2. *Limbs*: for each arm, each leg, both arms and both legs, poses of the limb are sampled: in turn near the
///    estimate, near training poses, near earlier estimates, near their mirror images, with one angle anywhere within
///    its limits, and with all angles anywhere within theirs. The best sample is descended, and the best of those that
///    differ from it and from the estimate. Swapped legs are recovered only together (compare the limb crossover of
///    `[Deutscher 2005]` and the partitions of `[MacCormick 2000]`).
#[derive(Debug)]
pub struct Refinement {
    settings: RefinementSettings,
    seed: u64,
    /// Groups of degrees of freedom that are sampled together.
    limbs: Vec<Vec<usize>>,
    training: Vec<Pose>,
    mirrored: MirroredAngles,
    /// `None` before the filter is started.
    memory: Option<PoseMemory>,
    /// Factor on the prior's weight in descents, from the fit of the last estimate.
    prior_weight: f64,
    /// The least energy of recent estimates.
    usual_energy: f64,
}

pub(super) struct Refined<S> {
    /// The state of lowest energy and that energy; `None` if none is lower than the estimate's.
    pub(super) found: Option<(S, f64)>,
    pub(super) evaluations: u64,
}

impl Refinement {
    /// A refinement for a body; `training` holds its training poses and may be empty.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of its range or a training pose belongs to a different body.
    pub fn new(
        settings: RefinementSettings,
        body: &Humanoid,
        training: Vec<Pose>,
        seed: u64,
    ) -> Result<Self, SettingError> {
        settings.validate()?;
        let degrees = body.degrees_of_freedom.len();
        if let Some(other) = training.iter().find(|pose| pose.joint_angles.len() != degrees) {
            let expected = format!("training poses of {degrees} joint angles");
            return Err(SettingError::new("refinement", expected, other.joint_angles.len()));
        }
        let mirrored = MirroredAngles::of_body(body);
        Ok(Self {
            settings,
            seed,
            limbs: limbs(body),
            training,
            mirrored,
            memory: None,
            prior_weight: 1.0,
            usual_energy: f64::INFINITY,
        })
    }

    /// Forgets all earlier estimates and stores the start pose.
    pub(super) fn start(&mut self, start: &Pose) {
        self.memory = Some(PoseMemory::new(start));
        self.prior_weight = 1.0;
        self.usual_energy = f64::INFINITY;
    }

    pub(super) fn remember(&mut self, estimate: &Pose, energy: Option<f64>) {
        self.usual_energy = energy.unwrap_or(f64::INFINITY).min(ENERGY_RISE * self.usual_energy);
        if let Some(memory) = &mut self.memory {
            memory.remember(estimate);
        }
    }

    /// Sets the prior's weight for the next frame from the agreement, in [0, 1], of this estimate's outline with the
    /// observation.
    pub(super) fn weigh(&mut self, agreement: f64) {
        self.prior_weight = prior_weight(agreement);
    }

    /// Indices of those of `count` particles that continue from the refined pose, evenly spaced.
    pub(super) fn moved(&self, count: usize) -> impl Iterator<Item = usize> {
        let moved = (self.settings.share * count as f64).round() as usize;
        (0..moved).map(move |i| i * count / moved.max(1))
    }

    /// Whether a frame may do without particles, if its outline agrees by as much in so many images, its pose has
    /// such an energy, and its joints moved by `step_m`, metres, at most.
    pub(super) fn is_sure(&self, frame: usize, agreement: f64, energy: f64, views: usize, step_m: f64) -> bool {
        let sure = self.settings.sure;
        let fits = agreement >= sure && energy <= SURE_ENERGY * self.usual_energy && step_m <= SURE_STEP_M;
        sure < 1.0 && views >= SURE_VIEWS && !frame.is_multiple_of(ALWAYS_SEARCHED) && fits
    }

    /// The state of lowest energy that descents from `starts` find, and the number of energies evaluated. `anchor` is
    /// the last estimate.
    pub(super) fn descend<M: MotionModel, L: Likelihood>(
        &self,
        model: &M,
        likelihood: &L,
        anchor: &Pose,
        starts: &[M::State],
    ) -> Refined<M::State> {
        let prior_weight = self.prior_weight;
        let mut search = Search { model, likelihood, anchor, prior_weight, evaluations: 0, idle: Mutex::default() };
        let starts: Vec<&M::State> = starts.iter().collect();
        let found = lowest(search.descend_all(&starts, self.settings.iterations, FINAL_WIDTH));
        Refined { found, evaluations: search.evaluations }
    }

    /// Searches for a state of lower energy than `energy`, the estimate's: descends from all `starts`, compares with
    /// what was `found` by others, then samples limbs. `anchor` is the last estimate.
    #[expect(clippy::too_many_arguments, reason = "a frame's data, and what was found before")]
    pub(super) fn refine<M: MotionModel, L: Likelihood>(
        &self,
        model: &M,
        likelihood: &L,
        frame: usize,
        anchor: &Pose,
        found: Option<(M::State, f64)>,
        starts: &[M::State],
        energy: f64,
    ) -> Refined<M::State> {
        let prior_weight = self.prior_weight;
        let mut search = Search { model, likelihood, anchor, prior_weight, evaluations: 0, idle: Mutex::default() };
        let starts: Vec<&M::State> = starts.iter().collect();
        let descended = search.descend_all(&starts, self.settings.iterations, FINAL_WIDTH);
        // ties go to the first, which is from the last estimate: the order of threads must not decide
        let mut best = lowest(found.into_iter().chain(descended).collect());
        let every = self.settings.limb_every;
        if every > 0 && (frame.is_multiple_of(every) || frame.is_multiple_of(ALWAYS_SEARCHED)) {
            for group in 0..self.limbs.len() {
                let Some((state, least)) = &best else { break };
                let found = search.limb(self, group, frame, state).filter(|found| found.1 < *least);
                best = found.or(best);
            }
        }
        let found = best.filter(|best| best.1 < energy);
        Refined { found, evaluations: search.evaluations }
    }
}

/// Factor on the prior's weight for a share of the last estimate's outline that agrees with the observation.
///
/// Correct bodies, and incorrect ones that follow a person, agree by 0.92 or more, even with blobs in the masks. The
/// agreement is 0.6 to 0.85 if the silhouettes include a second person, and 0.5 if outlines jitter by 8 pixels: there,
/// free descents find poses of lower energy that are farther from the truth than the particles, and the prior prevents
/// it.
fn prior_weight(agreement: f64) -> f64 {
    let misfit = ((1.0 - agreement) / USUAL_MISFIT).max(1.0);
    misfit * misfit * misfit * misfit
}

struct Search<'a, M: MotionModel, L: Likelihood> {
    model: &'a M,
    likelihood: &'a L,
    anchor: &'a Pose,
    /// Factor on the prior's weight in descents.
    prior_weight: f64,
    evaluations: u64,
    /// Unused buffers, kept because allocating them for every few poses would take as long as the search.
    idle: Mutex<Vec<L::Scratch>>,
}

impl<M: MotionModel, L: Likelihood> Search<'_, M, L> {
    /// The best result of the descents from samples of a limb, drawn from `state`.
    fn limb(&mut self, of: &Refinement, group: usize, frame: usize, state: &M::State) -> Option<(M::State, f64)> {
        let count = of.settings.limb_samples;
        let draw = |sample: usize| {
            let mut rng = stream(of.seed, Purpose::Refinement, frame as u64, 0, (group * count + sample) as u64);
            let pose = of.drawn(self.model.body(), self.model.pose(state), group, sample, &mut rng);
            self.model.with_pose(state, &pose)
        };
        // All samples are judged by energy, and only one or two of them descended: a descent costs as much as dozens of
        // energies.
        let samples: Vec<M::State> = (0..count).filter_map(draw).collect();
        let tried = self.energies(&samples);
        let mut order: Vec<usize> = (0..tried.len()).filter(|i| tried[*i].is_finite()).collect();
        order.sort_by(|a, b| tried[*a].total_cmp(&tried[*b]));
        let poses: Vec<&Pose> = order.iter().map(|i| self.model.pose(&samples[*i])).collect();
        let chosen = chosen(&poses, self.model.pose(state), &of.limbs[group]);
        let chosen: Vec<&M::State> = chosen.into_iter().map(|place| &samples[order[place]]).collect();
        lowest(self.descend_all(&chosen, of.settings.limb_iterations, LIMB_WIDTH))
    }

    /// Descends from each of several states; returns the results with their energies.
    fn descend_all(&mut self, starts: &[&M::State], iterations: usize, width: f64) -> Vec<(M::State, f64)> {
        let descend = |start: &&M::State| {
            self.with_scratch(|scratch| {
                let state = self.descend(start, iterations, width, scratch);
                let energy = self.likelihood.energy(self.model.pose(&state), scratch);
                (state, energy)
            })
        };
        let descended: Vec<_> = starts.par_iter().map(descend).collect();
        self.evaluations += descended.len() as u64;
        descended
    }

    fn descend(&self, start: &M::State, iterations: usize, width: f64, scratch: &mut L::Scratch) -> M::State {
        let steps = DescentSteps { iterations, width, prior_weight: self.prior_weight };
        descend(self.model, self.likelihood, start, self.anchor, steps, scratch)
    }

    fn energies(&mut self, states: &[M::State]) -> Vec<f64> {
        self.evaluations += states.len() as u64;
        let energy =
            |state: &M::State| self.with_scratch(|scratch| self.likelihood.energy(self.model.pose(state), scratch));
        states.par_iter().map(energy).collect()
    }

    fn with_scratch<T>(&self, work: impl FnOnce(&mut L::Scratch) -> T) -> T {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let ready = idle().pop();
        let mut scratch = ready.unwrap_or_else(|| self.likelihood.scratch());
        let done = work(&mut scratch);
        idle().push(scratch);
        done
    }
}

/// How a state is descended.
#[derive(Clone, Copy, Debug)]
pub struct DescentSteps {
    /// Number of Gauss-Newton steps.
    pub iterations: usize,
    /// Width of the residuals' robust weight in the last step, lengths (1/240 of the image height).
    pub width: f64,
    /// Factor on the weight of the model's prior about the anchor.
    pub prior_weight: f64,
}

impl DescentSteps {
    /// Steps to the end of a descent.
    pub fn exact(iterations: usize, prior_weight: f64) -> Self {
        Self { iterations, width: FINAL_WIDTH, prior_weight }
    }
}

/// Descends from a state by a number of Gauss-Newton steps with ever narrower robust weights. The model's prior about
/// `anchor` is multiplied by the given weight.
pub fn descend<M: MotionModel, L: Likelihood>(
    model: &M,
    likelihood: &L,
    start: &M::State,
    anchor: &Pose,
    DescentSteps { iterations, width: last, prior_weight }: DescentSteps,
    scratch: &mut L::Scratch,
) -> M::State {
    let mut state = start.clone();
    for iteration in 0..iterations {
        let share = if iterations > 1 { iteration as f64 / (iterations - 1) as f64 } else { 1.0 };
        // geometrically narrower: graduated non-convexity, so that the first steps see limbs that are far off
        let width = FIRST_WIDTH * libm::pow(last / FIRST_WIDTH, share);
        let evidence = likelihood.linearise(model.pose(&state), width, scratch);
        let evidence = evidence.map(|evidence| evidence.with_prior(prior_weight));
        match evidence.and_then(|evidence| model.descend(&state, anchor, evidence)) {
            Some(next) => state = next,
            None => break,
        }
    }
    state
}

/// Selects the samples to descend; `poses` are in order of energy. The first one, and the first that differs from it
/// and from the `present` pose, or else the second one.
fn chosen(poses: &[&Pose], present: &Pose, limb: &[usize]) -> Vec<usize> {
    let is_distinct = |pose: &Pose, from: &Pose| {
        limb.iter().any(|number| (pose.joint_angles[*number] - from.joint_angles[*number]).abs() > DISTINCT_RAD)
    };
    let Some(first) = poses.first() else { return Vec::new() };
    let second = poses.iter().position(|pose| is_distinct(pose, present) && is_distinct(pose, first)).unwrap_or(1);
    [0, second].into_iter().filter(|place| *place < poses.len()).collect()
}

/// The first state of lowest finite energy; `None` if all energies are not finite.
pub(super) fn lowest<S>(states: Vec<(S, f64)>) -> Option<(S, f64)> {
    states.into_iter().filter(|(_, energy)| energy.is_finite()).reduce(|a, b| if b.1 < a.1 { b } else { a })
}

#[derive(Clone, Copy)]
enum LimbDraw {
    Near,
    /// Near a training pose; near the estimate if there is none.
    Training,
    /// Near an earlier estimate.
    Remembered,
    /// Near the mirror image of an earlier estimate.
    RememberedMirrored,
    /// One angle anywhere within its limits, the others near the estimate.
    OneAngle,
    /// All angles anywhere within their limits.
    Anywhere,
}

/// The order in which samples use the kinds of draws.
const LIMB_DRAWS: [LimbDraw; 6] = [
    LimbDraw::Remembered,
    LimbDraw::Near,
    LimbDraw::Training,
    LimbDraw::RememberedMirrored,
    LimbDraw::OneAngle,
    LimbDraw::Anywhere,
];

impl Refinement {
    /// `pose` with a limb resampled by the draw that `sample` selects.
    fn drawn(&self, body: &Humanoid, pose: &Pose, group: usize, sample: usize, rng: &mut ChaCha8Rng) -> Pose {
        let (draw, limb) = (LIMB_DRAWS[sample % LIMB_DRAWS.len()], &self.limbs[group]);
        let seen = match draw {
            LimbDraw::Training => random_pose(&self.training, rng),
            LimbDraw::Remembered | LimbDraw::RememberedMirrored => {
                self.memory.as_ref().and_then(|memory| random_pose(memory.poses(), rng))
            }
            LimbDraw::Near | LimbDraw::OneAngle | LimbDraw::Anywhere => None,
        };
        let one = limb[rng.random_range(0..limb.len())];
        let mut drawn = pose.clone();
        for &number in limb {
            let limits = &body.degrees_of_freedom[number];
            let (lower, upper) = (limits.lower.max(-NO_LIMIT_RAD), limits.upper.min(NO_LIMIT_RAD));
            let noise: f64 = StandardNormal.sample(rng);
            let anywhere = lower + (upper - lower) * rng.random::<f64>();
            let angle = match (draw, seen) {
                (LimbDraw::Anywhere, _) => anywhere,
                (LimbDraw::OneAngle, _) if number == one => anywhere,
                (LimbDraw::OneAngle, _) => pose.joint_angles[number] + NEAR_OTHERS_RAD * noise,
                (LimbDraw::RememberedMirrored, Some(seen)) => self.mirrored.angle(seen, number) + NEAR_SEEN_RAD * noise,
                (_, Some(seen)) => seen.joint_angles[number] + NEAR_SEEN_RAD * noise,
                (_, None) => pose.joint_angles[number] + NEAR_RAD * noise,
            };
            drawn.joint_angles[number] = angle.clamp(limits.lower, limits.upper);
        }
        drawn
    }
}

fn random_pose<'a>(poses: &'a [Pose], rng: &mut ChaCha8Rng) -> Option<&'a Pose> {
    (!poses.is_empty()).then(|| &poses[rng.random_range(0..poses.len())])
}

#[cfg(test)]
mod tests;
