//! Measuring a tracker's answers against the truth of a set.

use rayon::prelude::*;

use super::tracking::Tracked;
use super::watch::{Stage, Watch};
use super::{ExperimentError, SearchRecord};
use crate::benchmark_set::{BenchmarkSet, BlindSet};
use crate::body::{Humanoid, LinkFrames, Markers, Motion, Pose, Prop, SilhouettePainter};
use crate::contact::{
    ContactRule, ContactTrack, Dynamics, GROUND_FRICTION, GroundContacts, PropContacts, SelfCollision,
};
use crate::evaluation::{
    ContactPair, Energies, Evaluation, RootRotations, Run, Sequence, Summary, evaluate, intersection_over_union,
    summarise,
};
use crate::observation::Observation;
use crate::parallel;
use crate::raster::Mask;
use crate::report::FootStances;
use crate::tracker::{Likelihood, PlausibleLikelihood, SilhouetteLikelihood};

/// The measures of a run: every seed, all seeds together, and the floor.
#[derive(Clone, Debug)]
pub struct Measures {
    /// The clip's name.
    pub clip: String,
    /// One entry a seed.
    pub seeds: Vec<SeedMeasures>,
    /// All seeds together.
    pub summary: Summary,
    /// What an answer that never moves gets.
    pub frozen: Evaluation,
    /// Energy of the truth, refitted to the tracker's body, per frame; empty where unknown.
    pub truth_energy: Vec<Option<f64>>,
}

/// The measures of one seed.
#[derive(Clone, Debug)]
pub struct SeedMeasures {
    /// The seed.
    pub seed: u64,
    /// What was measured.
    pub evaluation: Evaluation,
    /// Where the answers put the markers.
    pub markers: Vec<Markers>,
    /// Energy of the answers, per frame; empty where unknown.
    pub energy: Vec<Option<f64>>,
    /// When the actor's and the answers' feet stand; empty where either body has none.
    pub stances: Vec<FootStances>,
}

impl Measures {
    /// Measures every seed of a run, and a tracker that never moves.
    ///
    /// # Errors
    /// [`ExperimentError`] if run and set do not fit together or an observation cannot be read.
    pub fn new(set: &BenchmarkSet, tracked: &Tracked, watch: &dyn Watch) -> Result<Self, ExperimentError> {
        let blind = &set.blind;
        watch.begin(Stage::Evaluate, blind.frame_count);
        let frozen = vec![blind.start.pose.clone(); blind.frame_count];
        let answers: Vec<&[Pose]> =
            tracked.poses.estimates.iter().map(Vec::as_slice).chain([frozen.as_slice()]).collect();
        let truth_energy = truth_energy(tracked, blind, set.truth.refitted.as_ref())?;
        let per_frame: Vec<Vec<Vec<Option<f64>>>> = (0..blind.frame_count)
            .into_par_iter()
            .map_init(
                || Painters::new(blind),
                |painters, frame| {
                    if watch.interrupted() {
                        return Err(ExperimentError::Interrupted);
                    }
                    let overlaps =
                        painters.overlaps(&blind.observation(frame)?, answers.iter().map(|poses| &poses[frame]));
                    watch.advance();
                    Ok(overlaps)
                },
            )
            .collect::<Result<_, _>>()?;
        let touching = Touching::of_truth(set);
        let overlaps = |answer: usize| per_frame.iter().map(|f| f[answer].clone()).collect::<Vec<_>>();
        let mut seeds = Vec::new();
        for (index, seed) in tracked.poses.seeds.iter().enumerate() {
            if watch.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            let energy = tracked.search.get(index).map(|records| energies(records)).unwrap_or_default();
            let answer = Answer { poses: answers[index], overlaps: &overlaps(index), energy: &energy };
            let (evaluation, markers, stances) = answer.evaluate(set, &truth_energy, touching.as_ref())?;
            seeds.push(SeedMeasures { seed: *seed, evaluation, markers, energy, stances });
        }
        let floor = Answer { poses: &frozen, overlaps: &overlaps(seeds.len()), energy: &[] };
        let (frozen, ..) = floor.evaluate(set, &truth_energy, touching.as_ref())?;
        let clip = blind.name.clone();
        let runs: Vec<Run<'_>> =
            seeds.iter().map(|s| Run { clip: &clip, seed: s.seed, evaluation: &s.evaluation }).collect();
        let summary = summarise(&runs)?;
        Ok(Self { seeds, summary, frozen, truth_energy, clip })
    }

    /// One entry a seed.
    pub fn runs(&self) -> Vec<Run<'_>> {
        self.seeds.iter().map(|s| Run { clip: &self.clip, seed: s.seed, evaluation: &s.evaluation }).collect()
    }
}

/// What of a body touches, frame by frame.
struct Touching {
    ground: GroundContacts,
    self_depth_m: Vec<f64>,
    prop_depth_m: Vec<f64>,
    /// `None` for a body without mass.
    dynamics: Option<Dynamics>,
}

impl Touching {
    /// `None` for a body whose feet have no geometry: then nothing is said about contact.
    fn new(body: &Humanoid, motion: &Motion, props: &[Prop]) -> Option<Self> {
        let rule = ContactRule::default();
        let frames: Vec<LinkFrames> = motion.poses.iter().map(|pose| body.link_frames(pose)).collect();
        let ground = GroundContacts::of_motion(body, motion, &rule).ok()?;
        let among = PropContacts::of_frames(body, props, &frames, motion.frames_per_second, &rule).ok()?;
        let prop_depth_m = among.deepest_m(frames.len());
        let own = SelfCollision::new(body);
        let self_depth_m = parallel::map(frames.len(), |frame| own.deepest_m(&frames[frame]));
        let dynamics = Dynamics::of_motion(body, motion, &ground, GROUND_FRICTION).ok();
        Some(Self { ground, self_depth_m, prop_depth_m, dynamics })
    }

    fn of_truth(set: &BenchmarkSet) -> Option<Self> {
        let truth = &set.truth.ground_truth;
        Self::new(&truth.actor, &truth.motion(), &truth.props)
    }
}

/// The answers of one seed and what is known about them.
struct Answer<'a> {
    poses: &'a [Pose],
    overlaps: &'a [Vec<Option<f64>>],
    energy: &'a [Option<f64>],
}

impl Answer<'_> {
    fn evaluate(
        &self,
        set: &BenchmarkSet,
        truth_energy: &[Option<f64>],
        truth_touching: Option<&Touching>,
    ) -> Result<(Evaluation, Vec<Markers>, Vec<FootStances>), ExperimentError> {
        let truth = &set.truth.ground_truth;
        let body = &set.blind.start.body;
        let markers: Vec<Markers> = self.poses.iter().map(|pose| body.markers(&body.link_frames(pose))).collect();
        let truth_markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
        let truth_roots: Vec<_> = truth.frames.iter().map(|frame| frame.pose.world_from_root.rotation).collect();
        let roots: Vec<_> = self.poses.iter().map(|pose| Some(pose.world_from_root.rotation)).collect();
        let both = !truth_energy.is_empty() && !self.energy.is_empty();
        let motion = Motion { frames_per_second: truth.frames_per_second, poses: self.poses.to_vec() };
        let touching = truth_touching.and_then(|_| Touching::new(body, &motion, &truth.props));
        let stand_about = !truth.props.is_empty();
        let contacts = truth_touching.zip(touching.as_ref()).map(|(truth, estimate)| ContactPair {
            truth: &truth.ground,
            estimate: &estimate.ground,
            truth_self_depth_m: &truth.self_depth_m,
            estimate_self_depth_m: &estimate.self_depth_m,
            prop_depth_m: stand_about.then_some([&truth.prop_depth_m[..], &estimate.prop_depth_m]),
            dynamics: truth
                .dynamics
                .as_ref()
                .zip(estimate.dynamics.as_ref())
                .map(|(truth, estimate)| [truth, estimate]),
        });
        let evaluation = evaluate(&Sequence {
            frames_per_second: truth.frames_per_second,
            first_scored: 1,
            truth_markers: &truth_markers,
            estimate_markers: &markers,
            roots: Some(RootRotations { truth: &truth_roots, estimate: &roots }),
            view_overlaps: Some(self.overlaps),
            energies: both.then_some(Energies { truth: truth_energy, estimate: self.energy }),
            contacts,
        })?;
        let stances = contacts.map(|pair| foot_stances(&pair)).unwrap_or_default();
        Ok((evaluation, markers, stances))
    }
}

fn foot_stances(pair: &ContactPair<'_>) -> Vec<FootStances> {
    let stances = |foot: &ContactTrack| foot.stances().into_iter().map(|stance| [stance.start, stance.end]).collect();
    let of_foot = |(truth, estimate): (&ContactTrack, &ContactTrack)| FootStances {
        foot: truth.name.clone(),
        truth: stances(truth),
        estimate: stances(estimate),
    };
    pair.truth.feet.iter().zip(&pair.estimate.feet).map(of_foot).collect()
}

fn energies(records: &[SearchRecord]) -> Vec<Option<f64>> {
    if records.iter().all(|r| r.energy.is_none()) { Vec::new() } else { records.iter().map(|r| r.energy).collect() }
}

/// The energy that the tracker's own likelihood gives the truth; empty for trackers without a likelihood.
fn truth_energy(
    tracked: &Tracked,
    set: &BlindSet,
    refitted: Option<&Motion>,
) -> Result<Vec<Option<f64>>, ExperimentError> {
    let settings = tracked.record.as_ref().and_then(|record| record.tracker.likelihood());
    let (Some(settings), Some(refitted)) = (settings, refitted) else { return Ok(Vec::new()) };
    let likelihood = SilhouetteLikelihood::new(set.start.body.clone(), &set.rig, settings)?;
    match tracked.record.as_ref().and_then(|record| record.tracker.plausibility()) {
        None => energies_of(refitted, likelihood, set),
        Some(plausibility) => energies_of(refitted, PlausibleLikelihood::new(likelihood, plausibility)?, set),
    }
}

fn energies_of(
    motion: &Motion,
    mut likelihood: impl Likelihood,
    set: &BlindSet,
) -> Result<Vec<Option<f64>>, ExperimentError> {
    let mut scratch = likelihood.scratch();
    let mut energies = Vec::with_capacity(set.frame_count);
    for (observation, pose) in set.observations().zip(&motion.poses) {
        likelihood.prepare(&observation?)?;
        energies.push(Some(likelihood.energy_unrejected(pose, &mut scratch)));
    }
    Ok(energies)
}

/// Draws the tracker's body in every camera.
pub(super) struct Painters<'a> {
    body: &'a Humanoid,
    cameras: Vec<SilhouettePainter>,
}

impl<'a> Painters<'a> {
    pub(super) fn new(set: &'a BlindSet) -> Self {
        Self { body: &set.start.body, cameras: set.rig.cameras.iter().map(SilhouettePainter::new).collect() }
    }

    /// The body's silhouette in every camera.
    pub(super) fn silhouettes(&mut self, pose: &Pose) -> Vec<Mask> {
        let frames = self.body.link_frames(pose);
        self.cameras.iter_mut().map(|painter| painter.silhouette(self.body, &frames)).collect()
    }

    /// Where props are in every camera's image; empty without any.
    pub(super) fn props(&mut self, props: &[Prop]) -> Vec<Mask> {
        let seen = if props.is_empty() { &mut [][..] } else { &mut self.cameras };
        seen.iter_mut().map(|painter| painter.depth_of_props(props).mask()).collect()
    }

    /// `[answer][camera]`: intersection over union of each pose's silhouettes with those observed.
    fn overlaps<'p>(&mut self, observed: &Observation, poses: impl Iterator<Item = &'p Pose>) -> Vec<Vec<Option<f64>>> {
        let overlap = |pose| {
            let drawn = self.silhouettes(pose);
            drawn.iter().zip(&observed.silhouettes).map(|(a, b)| intersection_over_union(a, b)).collect()
        };
        poses.map(overlap).collect()
    }
}

/// Refuses answers that are not about this set.
pub(super) fn check_fit(set: &BenchmarkSet, tracked: &Tracked) -> Result<(), String> {
    if let Some(record) = tracked.record.as_ref().filter(|record| record.set_hash != set.blind.set_hash) {
        return Err(format!("the run's set has the hash {}, this set {}", record.set_hash, set.blind.set_hash));
    }
    let (rate, expected) = (tracked.poses.frames_per_second, set.blind.frames_per_second);
    // another program may have written its rate in single precision
    if (rate - expected).abs() > 1e-4 * expected {
        return Err(format!("its poses are {rate} a second, the set's frames {expected}"));
    }
    let mut seeds = tracked.poses.seeds.clone();
    seeds.sort_unstable();
    if let Some(twice) = seeds.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("it has seed {} twice", twice[0]));
    }
    let (frames, angles) = (set.blind.frame_count, set.blind.start.body.degrees_of_freedom.len());
    for (seed, poses) in tracked.poses.seeds.iter().zip(&tracked.poses.estimates) {
        if poses.len() != frames {
            return Err(format!("seed {seed} has {} frames, the set {frames}", poses.len()));
        }
        if let Some(pose) = poses.iter().find(|pose| pose.joint_angles.len() != angles) {
            return Err(format!("its poses have {} angles, the set's body {angles}", pose.joint_angles.len()));
        }
    }
    if tracked.poses.seeds.is_empty() { Err("it has no seed".to_owned()) } else { Ok(()) }
}
