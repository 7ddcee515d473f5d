//! After the layers: descent of the estimate, and a search for limbs that the particles lost.

mod limb_memory;

use std::sync::{Mutex, PoisonError};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::limb_memory::{LEFT_AND_RIGHT_ENDS, MirroredAngles, PoseMemory, landmark_point};
use super::Likelihood;
use crate::body::{Humanoid, Landmark, Pose};
use crate::motion_model::{MotionModel, SettingError};
use crate::rng::{Purpose, stream};

/// How an annealed particle filter's answer is refined.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RefinementSettings {
    /// Gauss-Newton steps of every descent, >= 1.
    pub iterations: usize,
    /// Every how many frames limbs are searched again; 0 for never.
    pub limb_every: usize,
    /// Poses tried for every limb and every mirrored pair of limbs.
    pub limb_samples: usize,
    /// Gauss-Newton steps from each of the two best of them.
    pub limb_iterations: usize,
    /// Share of the particles that goes on from the refined pose, in [0, 1].
    pub share: f64,
}

impl Default for RefinementSettings {
    fn default() -> Self {
        Self { iterations: 6, limb_every: 2, limb_samples: 30, limb_iterations: 4, share: 0.5 }
    }
}

impl RefinementSettings {
    /// How many energies are evaluated in a frame, on average, for a body with arms and legs.
    pub fn evaluations_per_frame(&self) -> u64 {
        let limb = (self.limb_samples + LIMB_DESCENTS.min(self.limb_samples)) as u64;
        3 + (USUAL_LIMBS * limb).checked_div(self.limb_every as u64).unwrap_or(0)
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] that names the first key which is not.
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
        if (0.0..=1.0).contains(&self.share) {
            return Ok(());
        }
        Err(SettingError::new("refinement.share", "a number from 0 to 1", self.share))
    }
}

/// Limbs and pairs of them that most bodies have.
const USUAL_LIMBS: u64 = 6;
/// Share of an outline that does not agree with what was observed where all is well.
const USUAL_MISFIT: f64 = 0.06;
/// Width of the residuals' robust weight in the first and last step of a descent, lengths.
const WIDTHS: [f64; 2] = [8.0, FINAL_WIDTH];
pub(super) const FINAL_WIDTH: f64 = 1.5;
/// Spread of limbs that are tried near the estimate, radians.
const NEAR_RAD: f64 = 0.4;
/// Spread of limbs that are tried near a pose that was seen before, in training or by the filter, radians.
const NEAR_SEEN_RAD: f64 = 0.1;
/// Spread of the other angles of a limb where one of them is tried over its whole range, radians.
const NEAR_OTHERS_RAD: f64 = 0.2;
/// The second of the samples that are descended differs by this in some angle, radians: neighbours of a pose that is
/// stuck have the least energies, and would all end in it.
const ELSEWHERE_RAD: f64 = 0.7;
/// Angle up to which a limb without limits is tried, radians.
const NO_LIMIT_RAD: f64 = std::f64::consts::PI;
/// How many of a limb's samples are descended.
const LIMB_DESCENTS: usize = 2;

/// Refines the estimate of a frame: never to a higher energy.
///
/// 1. *Descent* ([`Likelihood::linearise`], [`MotionModel::descend`]) from the last estimate, from this frame's and
///    from the particle of least energy; the result of least energy is kept.
/// 2. *Limbs*: for each arm, each leg, both arms and both legs, poses of the limb are drawn, by turns near the
///    estimate, near poses of training, near poses that the filter had before, near those of the other side in the
///    mirror, with one angle anywhere within its limits, and with all of them so. The best is descended, and the best
///    of those that differ from it and from the estimate. Legs that were taken for each other come free only together
///    (after the limb crossover of `[Deutscher 2005]` and the partitions of `[MacCormick 2000]`).
#[derive(Debug)]
pub struct Refinement {
    settings: RefinementSettings,
    seed: u64,
    /// Degrees of freedom that are drawn together.
    limbs: Vec<Vec<usize>>,
    /// Joint angles of the body in training.
    training: Vec<Pose>,
    mirrored: MirroredAngles,
    /// `None` before the filter was started.
    memory: Option<PoseMemory>,
    /// Factor on the weight of the prior in descents, from how well the last estimate fitted.
    prior_weight: f64,
}

/// What came of a refinement.
pub(super) struct Refined<S> {
    /// The state of least energy and that energy; `None` where nothing was found below the estimate's.
    pub(super) found: Option<(S, f64)>,
    /// Energies that were evaluated.
    pub(super) evaluations: u64,
}

impl Refinement {
    /// A refinement for a body that has been seen in the poses of `training`, which may be none.
    ///
    /// # Errors
    /// [`SettingError`] where a setting is out of its range or a pose is of another body.
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
        Ok(Self { settings, seed, limbs: limbs(body), training, mirrored, memory: None, prior_weight: 1.0 })
    }

    /// Forgets all poses but the start.
    pub(super) fn start(&mut self, start: &Pose) {
        self.memory = Some(PoseMemory::new(start));
        self.prior_weight = 1.0;
    }

    /// Limbs of later frames are looked for near this estimate too.
    pub(super) fn remember(&mut self, estimate: &Pose) {
        if let Some(memory) = &mut self.memory {
            memory.remember(estimate);
        }
    }

    /// Weighs the next frame's observation by how far the outline of this frame's estimate agrees with what was
    /// observed, in [0, 1].
    pub(super) fn weigh(&mut self, agreement: f64) {
        self.prior_weight = prior_weight(agreement);
    }

    /// Of `count` particles, the numbers of those that go on from the refined pose: evenly spread.
    pub(super) fn moved(&self, count: usize) -> impl Iterator<Item = usize> {
        let moved = (self.settings.share * count as f64).round() as usize;
        (0..moved).map(move |i| i * count / moved.max(1))
    }

    /// Looks for a state of less energy than `energy`, the estimate's: descends from all `starts`, then draws limbs.
    /// `anchor` is the last estimate.
    pub(super) fn refine<M: MotionModel, L: Likelihood>(
        &self,
        model: &M,
        likelihood: &L,
        frame: usize,
        anchor: &Pose,
        starts: &[M::State],
        energy: f64,
    ) -> Refined<M::State> {
        let mut search = Search {
            model,
            likelihood,
            anchor,
            prior_weight: self.prior_weight,
            evaluations: 0,
            idle: Mutex::default(),
        };
        let starts: Vec<&M::State> = starts.iter().collect();
        let descended = search.descend_all(&starts, self.settings.iterations);
        let mut best = lowest(descended);
        if self.settings.limb_every > 0 && frame.is_multiple_of(self.settings.limb_every) {
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

/// Factor on the weight of the prior where this share of the last estimate's outline agreed with what was observed.
///
/// Right bodies and wrong ones that follow a person agree by 0.92 and more, also among blobs.
/// Where a second person stands in the silhouettes it is 0.6 to 0.85, where outlines waver by 8 pixels 0.5: there free
/// descents find poses of less energy farther from the truth than the particles are, and the prior holds them.
fn prior_weight(agreement: f64) -> f64 {
    let misfit = ((1.0 - agreement) / USUAL_MISFIT).max(1.0);
    misfit * misfit * misfit * misfit
}

/// One frame's search.
struct Search<'a, M: MotionModel, L: Likelihood> {
    model: &'a M,
    likelihood: &'a L,
    anchor: &'a Pose,
    /// Factor on the weight of the prior in descents.
    prior_weight: f64,
    evaluations: u64,
    /// Buffers that no thread uses: making them anew for every few poses would take as long as the search.
    idle: Mutex<Vec<L::Scratch>>,
}

impl<M: MotionModel, L: Likelihood> Search<'_, M, L> {
    /// The best of the descents from poses of a limb that were drawn on `state`.
    fn limb(&mut self, of: &Refinement, group: usize, frame: usize, state: &M::State) -> Option<(M::State, f64)> {
        let count = of.settings.limb_samples;
        let draw = |sample: usize| {
            let mut rng = stream(of.seed, Purpose::Refinement, frame as u64, 0, (group * count + sample) as u64);
            let pose = of.drawn(self.model.body(), self.model.pose(state), group, sample, &mut rng);
            self.model.with_pose(state, &pose)
        };
        let samples: Vec<M::State> = (0..count).filter_map(draw).collect();
        let tried = self.energies(&samples);
        let mut order: Vec<usize> = (0..tried.len()).filter(|i| tried[*i].is_finite()).collect();
        order.sort_by(|a, b| tried[*a].total_cmp(&tried[*b]));
        let poses: Vec<&Pose> = order.iter().map(|i| self.model.pose(&samples[*i])).collect();
        let chosen = chosen(&poses, self.model.pose(state), &of.limbs[group]);
        let chosen: Vec<&M::State> = chosen.into_iter().map(|place| &samples[order[place]]).collect();
        lowest(self.descend_all(&chosen, of.settings.limb_iterations))
    }

    /// Descends from each of several states; what came of it, with energies.
    fn descend_all(&mut self, starts: &[&M::State], iterations: usize) -> Vec<(M::State, f64)> {
        let descend = |start: &&M::State| {
            self.with_scratch(|scratch| {
                let state = self.descend(start, iterations, scratch);
                let energy = self.likelihood.energy(self.model.pose(&state), scratch);
                (state, energy)
            })
        };
        let descended: Vec<_> = starts.par_iter().map(descend).collect();
        self.evaluations += descended.len() as u64;
        descended
    }

    fn descend(&self, start: &M::State, iterations: usize, scratch: &mut L::Scratch) -> M::State {
        let mut state = start.clone();
        for iteration in 0..iterations {
            let share = if iterations > 1 { iteration as f64 / (iterations - 1) as f64 } else { 1.0 };
            let width = WIDTHS[0] * libm::pow(WIDTHS[1] / WIDTHS[0], share);
            let evidence = self.likelihood.linearise(self.model.pose(&state), width, scratch);
            let evidence = evidence.map(|evidence| evidence.with_prior(self.prior_weight));
            match evidence.and_then(|evidence| self.model.descend(&state, self.anchor, evidence)) {
                Some(next) => state = next,
                None => break,
            }
        }
        state
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

/// Which of the samples are descended, of `poses` in the order of their energies: the first, and the first of those
/// that are elsewhere than that and than the `present` pose, or else the second.
fn chosen(poses: &[&Pose], present: &Pose, limb: &[usize]) -> Vec<usize> {
    let is_elsewhere = |pose: &Pose, from: &Pose| {
        limb.iter().any(|number| (pose.joint_angles[*number] - from.joint_angles[*number]).abs() > ELSEWHERE_RAD)
    };
    let Some(first) = poses.first() else { return Vec::new() };
    let second = poses.iter().position(|pose| is_elsewhere(pose, present) && is_elsewhere(pose, first)).unwrap_or(1);
    [0, second].into_iter().filter(|place| *place < poses.len()).collect()
}

/// The first of those of least energy; none of those that cannot be.
fn lowest<S>(states: Vec<(S, f64)>) -> Option<(S, f64)> {
    states.into_iter().filter(|(_, energy)| energy.is_finite()).reduce(|a, b| if b.1 < a.1 { b } else { a })
}

/// Where a sample of a limb is drawn.
#[derive(Clone, Copy)]
enum LimbDraw {
    /// Near the estimate.
    Near,
    /// Near a pose of training; near the estimate where there is none.
    Training,
    /// Near a pose that the filter had before.
    Remembered,
    /// Near such a pose of the other side, in the mirror.
    RememberedMirrored,
    /// One angle anywhere within its limits, the others near the estimate.
    OneAngle,
    /// All angles anywhere within their limits.
    Anywhere,
}

/// The kinds of samples take turns.
const LIMB_DRAWS: [LimbDraw; 6] = [
    LimbDraw::Remembered,
    LimbDraw::Near,
    LimbDraw::Training,
    LimbDraw::RememberedMirrored,
    LimbDraw::OneAngle,
    LimbDraw::Anywhere,
];

impl Refinement {
    /// `pose` with a limb drawn anew, in the way that is `sample`'s turn.
    fn drawn(&self, body: &Humanoid, pose: &Pose, group: usize, sample: usize, rng: &mut ChaCha8Rng) -> Pose {
        let (draw, limb) = (LIMB_DRAWS[sample % LIMB_DRAWS.len()], &self.limbs[group]);
        let seen = match draw {
            LimbDraw::Training => any_of(&self.training, rng),
            LimbDraw::Remembered | LimbDraw::RememberedMirrored => {
                self.memory.as_ref().and_then(|memory| any_of(memory.poses(), rng))
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

fn any_of<'a>(poses: &'a [Pose], rng: &mut ChaCha8Rng) -> Option<&'a Pose> {
    (!poses.is_empty()).then(|| &poses[rng.random_range(0..poses.len())])
}

/// The degrees of freedom of each arm and leg, and of both arms and both legs.
fn limbs(body: &Humanoid) -> Vec<Vec<usize>> {
    let alone = arms_and_legs(body);
    let pairs = [(0, 1), (2, 3)].map(|(left, right)| [alone[left].as_slice(), &alone[right]].concat());
    alone.into_iter().chain(pairs).filter(|limb| !limb.is_empty()).collect()
}

/// The degrees of freedom of the left and right arm and the left and right leg: those that move its end and no other
/// limb's end nor the head. Empty for a limb without an end.
pub(super) fn arms_and_legs(body: &Humanoid) -> Vec<Vec<usize>> {
    let ends = LEFT_AND_RIGHT_ENDS.concat().into_iter().chain([Landmark::HeadTop]);
    let moving: Vec<Vec<usize>> =
        ends.map(|end| landmark_point(body, end).map(|end| moved_by(body, end.link)).unwrap_or_default()).collect();
    let own = |limb: usize| -> Vec<usize> {
        let others = |number: &usize| moving.iter().enumerate().any(|(i, m)| i != limb && m.contains(number));
        moving[limb].iter().copied().filter(|number| !others(number)).collect()
    };
    (0..4).map(own).collect()
}

/// The degrees of freedom that move a link, ascending.
fn moved_by(body: &Humanoid, link: usize) -> Vec<usize> {
    let mut twists = Vec::new();
    let frames = body.link_frames(&body.zero_pose());
    body.step_twists(&frames, link, &nalgebra::Point3::origin(), &mut twists);
    let mut numbers: Vec<usize> =
        twists.iter().filter_map(|(index, _)| index.checked_sub(crate::body::ROOT_STEP)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

#[cfg(test)]
mod tests;
