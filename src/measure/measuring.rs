//! Measures a tracker's estimates against the truth of a set.

use rayon::prelude::*;

use super::body_contacts::BodyContacts;
use super::energies::{AskedEnergies, clear_without_images, recorded_energies};
use super::hints::{Hint, hint};
use super::part_rotations::ComparableParts;
use super::tracked::Tracked;
use crate::common::{ExperimentError, Progress, Stage};
use skiagraph_core::body::{BodyRegion, Humanoid, Markers, Pose, Prop, SilhouettePainter};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::contact::ContactTrack;
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_eval::{
    ContactPair, Energies, Evaluation, EvaluationError, MaskQuality, PartRecall, PartRotations, RootRotations, SeedRun,
    SegmentationQuality, Sequence, SilhouetteOutline, Summary, Views, evaluate, intersection_over_union,
    is_part_sampled, mean, summarise,
};
use skiagraph_report::FootStances;
use skiagraph_set::{Articulation, BenchmarkSet, BlindSet, EstimatedSequence};
use skiagraph_truth::observing::Observer;

/// Measures of a run: of every seed, all seeds together, and the frozen tracker.
#[derive(Clone, Debug)]
pub struct Measures {
    pub clip: String,
    pub seeds: Vec<SeedMeasures>,
    pub summary: Summary,
    /// Evaluation of a tracker that never moves, in the frames and by the markers that the run estimates. Means are
    /// over seeds; curves are those of the first seed.
    pub frozen: Evaluation,
    /// Quality of the observed silhouettes; `None` if they are exact.
    pub segmentation: Option<SegmentationQuality>,
    /// An explanation of most of the error by a misread estimate.
    pub hint: Option<Hint>,
}

#[derive(Clone, Debug)]
pub struct SeedMeasures {
    pub seed: u64,
    pub evaluation: Evaluation,
    /// Estimated markers of every frame.
    pub markers: Vec<Markers>,
    /// Energy of the estimates, per frame; empty if unknown.
    pub energy: Vec<Option<f64>>,
    /// Energy of the truth, refitted to the body that the tracker used, per frame; empty if unknown.
    pub truth_energy: Vec<Option<f64>>,
    /// Stances of the true and estimated feet; empty if either body has no feet.
    pub stances: Vec<FootStances>,
}

impl Measures {
    /// Measures every seed of a run, and a tracker that never moves.
    pub fn new(set: &BenchmarkSet, tracked: &Tracked, progress: &dyn Progress) -> Result<Self, ExperimentError> {
        let blind = &set.blind;
        progress.begin(Stage::Evaluate, blind.frame_count);
        let frozen =
            EstimatedSequence::from_poses(&blind.start.body, vec![blind.start.pose.clone(); blind.frame_count]);
        let answers: Vec<&EstimatedSequence> = tracked.estimates.sequences.iter().chain([&frozen]).collect();
        let bodies: Vec<&Humanoid> = (0..tracked.estimates.sequences.len())
            .map(|index| tracked.estimates.body(index, &blind.start.body))
            .chain([&blind.start.body])
            .collect();
        let asked = AskedEnergies::new(set, tracked);
        let rig = &set.truth.rig;
        let exact =
            blind.observation.as_ref().filter(|facts| !facts.has_exact_silhouettes()).map(|_| ExactView::new(set));
        let per_frame: Vec<MeasuredFrame> = (0..blind.frame_count)
            .into_par_iter()
            .map_init(
                || (Painters::new(blind), Painters::from_rig(rig.rig()), asked.likelihoods(&blind.rig)),
                |(painters, true_painters, likelihoods), frame| {
                    if progress.interrupted() {
                        return Err(ExperimentError::Interrupted);
                    }
                    let observed = blind.observation(frame)?;
                    let likelihoods = likelihoods.as_mut().map_err(|e| e.clone())?;
                    let energies = asked.of_frame(likelihoods, &observed, frame)?;
                    let poses = || bodies.iter().copied().zip(answers.iter().map(|answer| answer.pose(frame)));
                    let agreements = painters.agreements(&observed, poses());
                    let exact = exact.as_ref().map(|view| (view, view.observer.observe(frame)));
                    let exact = exact.map(|(view, exact)| AgainstExact {
                        overlaps: true_painters.overlaps(&exact, poses()),
                        qualities: qualities(&observed, &exact),
                        parts: view.part_recalls(frame, &observed),
                    });
                    progress.advance();
                    Ok(MeasuredFrame { energies, agreements, exact })
                },
            )
            .collect::<Result<_, ExperimentError>>()?;
        let energies: Vec<Vec<Option<f64>>> = per_frame.iter().map(|frame| frame.energies.clone()).collect();
        let truth = &set.truth.ground_truth;
        let touching = BodyContacts::from_motion(&truth.actor, &truth.motion(), &truth.props);
        let agreements = |answer: usize| Agreements {
            overlaps: per_frame
                .iter()
                .map(|f| f.agreements[answer].iter().map(|view| view.overlap).collect())
                .collect(),
            boundaries: per_frame
                .iter()
                .map(|f| f.agreements[answer].iter().map(|view| view.boundary_f).collect())
                .collect(),
            exact: per_frame.iter().map(|f| Some(f.exact.as_ref()?.overlaps[answer].clone())).collect(),
        };
        let segmentation = exact.is_some().then(|| {
            let of_frames = || per_frame.iter().filter_map(|frame| frame.exact.as_ref());
            let masks: Vec<MaskQuality> = of_frames().flat_map(|exact| exact.qualities.iter().copied()).collect();
            let sampled = || of_frames().filter(|exact| !exact.parts.is_empty());
            let parts: Vec<PartRecall> = sampled().flat_map(|exact| exact.parts.iter().copied()).collect();
            let beside: Vec<MaskQuality> = sampled().flat_map(|exact| exact.qualities.iter().copied()).collect();
            SegmentationQuality::mean(&masks, &parts, &beside)
        });
        let mut seeds = Vec::new();
        for (index, seed) in tracked.estimates.seeds.iter().enumerate() {
            if progress.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            let mut energy = match tracked.record {
                Some(_) => tracked.search.get(index).map(|records| recorded_energies(records)).unwrap_or_default(),
                None => asked.of_program(index, &energies),
            };
            let mut truth_energy = asked.of_truth(index, &energies);
            [&mut energy, &mut truth_energy].into_iter().for_each(|energies| clear_without_images(energies, blind));
            let (body, sequence, agreements) = (bodies[index], answers[index], agreements(index));
            let is_own = tracked.record.is_some();
            let answer = SeedEstimate { body, sequence, agreements: &agreements, energy: &energy, is_own };
            let (evaluation, stances) = answer.evaluate(set, &truth_energy, touching.as_ref())?;
            let markers = answers[index].markers.clone();
            seeds.push(SeedMeasures { seed: *seed, evaluation, markers, energy, truth_energy, stances });
        }
        let (body, agreements) = (&blind.start.body, agreements(seeds.len()));
        let mut floors: Vec<(EstimatedSequence, Evaluation)> = Vec::new();
        for answer in &answers[..seeds.len()] {
            let sequence = where_estimated(&frozen, answer);
            let known = floors.iter().find(|(other, _)| *other == sequence).map(|(_, floor)| floor.clone());
            let floor = SeedEstimate { body, sequence: &sequence, agreements: &agreements, energy: &[], is_own: true };
            let floor = match known {
                Some(floor) => floor,
                None => floor.evaluate(set, &[], touching.as_ref())?.0,
            };
            floors.push((sequence, floor));
        }
        let frozen = mean_floor(floors.into_iter().map(|(_, floor)| floor).collect()).ok_or(EvaluationError::NoRun)?;
        let clip = blind.name.clone();
        let runs: Vec<SeedRun<'_>> =
            seeds.iter().map(|s| SeedRun { clip: &clip, seed: s.seed, evaluation: &s.evaluation }).collect();
        let summary = summarise(&runs)?;
        let hint = hint(set, tracked);
        Ok(Self { seeds, summary, frozen, segmentation, clip, hint })
    }

    /// The evaluations, one entry per seed.
    pub fn runs(&self) -> Vec<SeedRun<'_>> {
        self.seeds.iter().map(|s| SeedRun { clip: &self.clip, seed: s.seed, evaluation: &s.evaluation }).collect()
    }
}

/// The markers and frames of `whole` that `answer` has too: errors over other markers could not be compared.
pub(super) fn where_estimated(whole: &EstimatedSequence, answer: &EstimatedSequence) -> EstimatedSequence {
    let mut kept = whole.clone();
    for (markers, given) in kept.markers.iter_mut().zip(&answer.markers) {
        for (marker, given) in markers.iter_mut().zip(given) {
            *marker = marker.filter(|_| given.is_some());
        }
    }
    if let Articulation::Poses(poses) = &mut kept.articulation {
        for (pose, given) in poses.iter_mut().zip(&answer.markers) {
            if given.iter().all(Option::is_none) {
                *pose = None;
            }
        }
    }
    kept
}

/// The first evaluation, with the means of all.
pub(super) fn mean_floor(floors: Vec<Evaluation>) -> Option<Evaluation> {
    let mut first = floors.first()?.clone();
    if floors.iter().all(|floor| *floor == first) {
        // a mean of equal numbers may differ from them in its last bit
        return Some(first);
    }
    for floor in &floors {
        for (name, value) in &floor.metrics {
            first.metrics.entry(name.clone()).or_insert_with(|| value.clone());
        }
    }
    for (name, value) in &mut first.metrics {
        let means: Vec<f64> = floors.iter().filter_map(|floor| Some(floor.metrics.get(name)?.mean)).collect();
        value.mean = mean(&means).unwrap_or(value.mean);
    }
    Some(first)
}

struct MeasuredFrame {
    /// Of every motion in [`AskedEnergies`].
    energies: Vec<Option<f64>>,
    agreements: FrameAgreements,
    /// `None` if the observed silhouettes are exact.
    exact: Option<AgainstExact>,
}

/// `[estimate][camera]`: how an estimate's silhouette agrees with the observed one.
pub(super) type FrameAgreements = Vec<Vec<ViewAgreement>>;

/// Agreement of two silhouettes; `None` where both are empty or there is no pose.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ViewAgreement {
    pub(super) overlap: Option<f64>,
    pub(super) boundary_f: Option<f64>,
}

/// `[frame][camera]` of one estimate.
struct Agreements {
    overlaps: Vec<Vec<Option<f64>>>,
    boundaries: Vec<Vec<Option<f64>>>,
    /// Overlaps with the exact silhouettes; `None` if the observed ones are exact.
    exact: Option<Vec<Vec<Option<f64>>>>,
}

/// A frame compared with its exact silhouettes.
struct AgainstExact {
    /// `[estimate][camera]`.
    overlaps: Vec<Vec<Option<f64>>>,
    qualities: Vec<MaskQuality>,
    /// Empty in the frames that [`is_part_sampled`] leaves out.
    parts: Vec<PartRecall>,
}

/// What the true cameras see of the actor.
struct ExactView<'a> {
    observer: Observer<'a>,
    /// The region of every link of the actor.
    regions: Vec<BodyRegion>,
    frames: usize,
}

impl<'a> ExactView<'a> {
    fn new(set: &'a BenchmarkSet) -> Self {
        let truth = &set.truth.ground_truth;
        let regions = BodyRegion::of_links(&truth.actor);
        Self { observer: Observer::new(truth, &set.truth.rig), regions, frames: set.blind.frame_count }
    }

    /// Recall of the actor's parts in every camera that took an image; empty in frames that are left out.
    fn part_recalls(&self, frame: usize, observed: &Observation) -> Vec<PartRecall> {
        if !is_part_sampled(frame, self.frames) {
            return Vec::new();
        }
        let exact = self.observer.depths(frame);
        let seen = exact.iter().zip(&observed.silhouettes).enumerate();
        seen.filter(|(camera, _)| observed.has_image(*camera))
            .filter_map(|(_, (exact, mask))| Some(PartRecall::new(mask, exact.as_ref()?, &self.regions)))
            .collect()
    }
}

fn qualities(observed: &Observation, exact: &Observation) -> Vec<MaskQuality> {
    let both = observed.silhouettes.iter().zip(&exact.silhouettes).enumerate();
    both.filter(|(camera, _)| observed.has_image(*camera))
        .map(|(_, (mask, exact))| MaskQuality::new(mask, exact))
        .collect()
}

struct SeedEstimate<'a> {
    body: &'a Humanoid,
    sequence: &'a EstimatedSequence,
    agreements: &'a Agreements,
    energy: &'a [Option<f64>],
    /// Whether energies come from the tracker's own likelihood.
    is_own: bool,
}

impl SeedEstimate<'_> {
    fn evaluate(
        &self,
        set: &BenchmarkSet,
        truth_energy: &[Option<f64>],
        truth_touching: Option<&BodyContacts>,
    ) -> Result<(Evaluation, Vec<FootStances>), ExperimentError> {
        let truth = &set.truth.ground_truth;
        let rate = truth.frames_per_second;
        let truth_markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
        let axes = [&truth.actor, self.body].map(|body| body.root_from_body());
        let truth_roots: Vec<_> = truth.frames.iter().map(|f| f.pose.world_from_root.rotation * axes[0]).collect();
        let turned = |root: &Option<nalgebra::Isometry3<f64>>| Some(root.as_ref()?.rotation * axes[1]);
        let roots: Option<Vec<_>> = self.sequence.roots().map(|roots| roots.iter().map(turned).collect());
        let both = !truth_energy.is_empty() && !self.energy.is_empty();
        let poses = self.sequence.poses().filter(|_| truth_touching.is_some());
        let touching = poses.and_then(|poses| BodyContacts::from_poses(self.body, poses, rate, &truth.props));
        let contacts = truth_touching.map(|truth| ContactPair {
            truth: truth.touching(),
            estimate: touching.as_ref().map(BodyContacts::touching),
        });
        let comparable = ComparableParts::new(&truth.actor, self.body);
        let poses = self.sequence.poses().filter(|_| !comparable.is_root_alone());
        let parts = poses.map(|_| {
            let estimate = (0..truth.frames.len()).map(|frame| self.sequence.pose(frame));
            let actor = truth.frames.iter().map(|frame| Some(&frame.pose));
            [comparable.rotations(&truth.actor, actor), comparable.rotations(self.body, estimate)]
        });
        let rig = &set.truth.rig;
        let moved: Vec<CameraRig> = if rig.is_still() {
            Vec::new()
        } else {
            truth.frames.iter().map(|frame| rig.rig_at(frame.time_s)).collect()
        };
        let cameras = &rig.rig().cameras;
        let in_view: Vec<_> = truth.frames.iter().map(|frame| frame.in_view.as_slice()).collect();
        let visible: Vec<_> = truth.frames.iter().map(|frame| frame.visible.as_slice()).collect();
        let evaluation = evaluate(&Sequence {
            frames_per_second: rate,
            first_scored: 1,
            has_truth: true,
            truth_markers: (&truth_markers).into(),
            estimate_markers: (&self.sequence.markers).into(),
            roots: roots.as_ref().map(|estimate| RootRotations { truth: &truth_roots, estimate }),
            view_overlaps: self.sequence.poses().map(|_| self.agreements.overlaps.as_slice()),
            exact_overlaps: self.sequence.poses().and(self.agreements.exact.as_deref()),
            view_boundaries: self.sequence.poses().map(|_| self.agreements.boundaries.as_slice()),
            keypoint_residuals_px: None,
            views: Some(Views { cameras, moved: &moved, in_view: &in_view, visible: &visible }),
            parts: parts.as_ref().map(|[truth, estimate]| PartRotations { truth, estimate }),
            energies: both.then_some(Energies { truth: truth_energy, estimate: self.energy, is_own: self.is_own }),
            contacts,
        })?;
        let stances = contacts.map(|pair| foot_stances(&pair)).unwrap_or_default();
        Ok((evaluation, stances))
    }
}

fn foot_stances(pair: &ContactPair<'_>) -> Vec<FootStances> {
    let stances = |foot: &ContactTrack| foot.stances().into_iter().map(|stance| [stance.start, stance.end]).collect();
    let of_foot = |(index, truth): (usize, &ContactTrack)| FootStances {
        foot: truth.name.clone(),
        truth: stances(truth),
        estimate: pair.estimate.map(|body| stances(&body.ground.feet[index])).unwrap_or_default(),
    };
    pair.truth.ground.feet.iter().enumerate().map(of_foot).collect()
}

pub(crate) struct Painters {
    cameras: Vec<SilhouettePainter>,
}

impl Painters {
    pub(crate) fn new(set: &BlindSet) -> Self {
        Self::from_rig(&set.rig)
    }

    pub(crate) fn from_rig(rig: &CameraRig) -> Self {
        Self { cameras: rig.cameras.iter().map(SilhouettePainter::new).collect() }
    }

    /// Moves the cameras to their poses at the time of the images. Returns whether the observation has such poses.
    pub(crate) fn place(&mut self, observed: &Observation) -> bool {
        let placements = observed.moment.iter().flat_map(|moment| &moment.camera_from_world);
        self.cameras.iter_mut().zip(placements).for_each(|(painter, placement)| painter.place(placement));
        observed.moment.is_some()
    }

    /// As [`Self::silhouettes`], with the cameras at their poses; empty masks for cameras that took no image.
    pub(crate) fn seen(&mut self, observed: &Observation, body: &Humanoid, pose: &Pose) -> Vec<Mask> {
        self.place(observed);
        let mut masks = self.silhouettes(body, pose);
        masks.iter_mut().enumerate().filter(|(camera, _)| !observed.has_image(*camera)).for_each(|(_, m)| m.clear());
        masks
    }

    pub(crate) fn silhouettes(&mut self, body: &Humanoid, pose: &Pose) -> Vec<Mask> {
        let frames = body.link_frames(pose);
        self.cameras.iter_mut().map(|painter| painter.silhouette(body, &frames)).collect()
    }

    pub(crate) fn props(&mut self, props: &[Prop]) -> Vec<Mask> {
        let seen = if props.is_empty() { &mut [][..] } else { &mut self.cameras };
        seen.iter_mut().map(|painter| painter.depth_of_props(props).mask()).collect()
    }

    /// `[estimate][camera]`: overlap of each pose's silhouettes with the observed ones.
    fn overlaps<'p>(
        &mut self,
        observed: &Observation,
        poses: impl Iterator<Item = (&'p Humanoid, Option<&'p Pose>)>,
    ) -> Vec<Vec<Option<f64>>> {
        self.place(observed);
        let of_pose = |(body, pose): (&Humanoid, Option<&Pose>)| {
            let Some(pose) = pose else { return vec![None; self.cameras.len()] };
            let drawn = self.silhouettes(body, pose);
            let views = drawn.iter().zip(&observed.silhouettes).enumerate();
            views
                .map(|(camera, (drawn, mask))| {
                    observed.has_image(camera).then(|| intersection_over_union(drawn, mask)).flatten()
                })
                .collect()
        };
        poses.map(of_pose).collect()
    }

    /// `[estimate][camera]`: agreement of each pose's silhouettes with the observed ones.
    pub(super) fn agreements<'p>(
        &mut self,
        observed: &Observation,
        poses: impl Iterator<Item = (&'p Humanoid, Option<&'p Pose>)>,
    ) -> FrameAgreements {
        self.place(observed);
        let outlines: Vec<SilhouetteOutline> = observed.silhouettes.iter().map(SilhouetteOutline::new).collect();
        let agreement = |(body, pose): (&Humanoid, Option<&Pose>)| {
            let Some(pose) = pose else { return vec![ViewAgreement::default(); self.cameras.len()] };
            let drawn = self.silhouettes(body, pose);
            let views = drawn.iter().zip(&observed.silhouettes).zip(&outlines).enumerate();
            let of_view = |(camera, ((drawn, mask), outline)): (usize, ((&Mask, &Mask), &SilhouetteOutline))| {
                if !observed.has_image(camera) {
                    return ViewAgreement::default();
                }
                let overlap = intersection_over_union(drawn, mask);
                ViewAgreement { overlap, boundary_f: outline.agreement(&SilhouetteOutline::new(drawn)) }
            };
            views.map(of_view).collect()
        };
        poses.map(agreement).collect()
    }
}

/// Refuses estimates that do not belong to this set.
pub(crate) fn check_fit(set: &BlindSet, tracked: &Tracked) -> Result<(), String> {
    let of_program = tracked.program.as_ref().map(|program| &program.set_hash);
    let of_run = tracked.record.as_ref().map(|record| &record.set_hash).or(of_program);
    if let Some(hash) = of_run.filter(|hash| **hash != set.set_hash) {
        return Err(format!("the run's set has hash {hash}, this set has {}", set.set_hash));
    }
    let estimates = &tracked.estimates;
    let (rate, expected) = (estimates.frames_per_second, set.frames_per_second);
    // another program may have written its rate in single precision; NaN must fail
    let is_same = (rate - expected).abs() <= 1e-4 * expected;
    if !is_same {
        return Err(format!("the run has {rate} frames a second, the set {expected}"));
    }
    let mut seeds = estimates.seeds.clone();
    seeds.sort_unstable();
    if let Some(twice) = seeds.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("it has seed {} twice", twice[0]));
    }
    let (found, frames) = (estimates.frames(), set.frame_count);
    if found != frames {
        let hint = if tracked.read_as.is_some() {
            let other = other_rate(found, frames, expected);
            let rate = other.map(|rate| format!(", or resample its rows if they have {rate:.0} frames a second"));
            let shift = "; if that is right, use --shift with the set's frame of the file's first frame";
            shift.to_owned() + &rate.unwrap_or_default()
        } else {
            String::new()
        };
        return Err(format!("it has {found} frames, the set {frames}{hint}"));
    }
    if estimates.sequences.iter().any(EstimatedSequence::has_any) {
        return Ok(());
    }
    Err("every frame of every seed is NaN, or at 0, 0, 0, which counts as missing: it has no estimate".to_owned())
}

/// The rate at which `found` rows take the time of the set's frames, if it is a multiple or a fraction of the set's.
fn other_rate(found: usize, frames: usize, rate: f64) -> Option<f64> {
    let (fewer, more) = (found.min(frames), found.max(frames));
    for factor in 2..=8 {
        if (fewer * factor).abs_diff(more) < factor {
            let factor = factor as f64;
            return Some(if found < frames { rate / factor } else { rate * factor });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_rows_have_half_the_rate() {
        assert_eq!(other_rate(46, 91, 60.0), Some(30.0));
        assert_eq!(other_rate(181, 91, 60.0), Some(120.0));
        assert_eq!([other_rate(80, 91, 60.0), other_rate(91, 91, 60.0)], [None; 2]);
    }
}
