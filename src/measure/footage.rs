//! Measures runs on a recording, of which no truth is known: how well estimates explain the images.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::energies::recorded_energies;
use super::measuring::{Measures, Painters, SeedMeasures, mean_floor, where_estimated};
use super::per_frame;
use super::playback::plan_of;
use super::reference::RunAgainstReference;
use super::results::{
    LeftOutOverlap, PER_FRAME_FILE, REPORT_FILE, RUN_FILE, RunRecord, RunResults, describe_camera, describe_tracker,
    record, report_runs, this_run, tracker_facts,
};
use super::tracked::{POSES_FILE, Tracked};
use crate::common::{ExperimentError, NamedFiles, Progress, Stage, frame_ranges, median, to_json};
use skiagraph_core::body::{Humanoid, KeypointPlace, LANDMARKS, Pose};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::observation::Observation;
use skiagraph_eval::{Evaluation, EvaluationError, SeedRun, Sequence, Views, evaluate, find_metric, mean, summarise};
use skiagraph_report::{FactGroup, PackedView, Playback, PlaybackBudget, ReportInput, SetPage, Verdict, verdict};
use skiagraph_set::{BlindSet, EstimatedSequence};

const LEAST_CONFIDENCE: f64 = 0.3;

/// Images whose overlap is nearer to the camera's median are not named.
const LEAST_FALL: f64 = 0.05;

/// What the numbers of a recording mean, and what they do not.
const HOW_FAR: [(&str, &str); 3] = [
    (
        "overlap",
        "how well the estimate explains images that the tracker saw; a wrong pose behind the body, or a wrong depth with few \
         cameras, can explain them too",
    ),
    (
        "masks",
        "an overlap above about 0.9 cannot be expected: masks of real images are off by some pixels at their edges",
    ),
    (
        "joints",
        "images do not say how near the estimate's joints are to the person's; a synthetic set of like cameras does, and a \
         reference does up to its own error",
    ),
];

pub(crate) struct FootageMeasures {
    measures: Measures,
    /// The cameras through which each seed is measured: those it corrected, or the given ones.
    rigs: Vec<CameraRig>,
    /// Mean overlap of each seed through the given cameras, if it corrected them.
    through_given: Vec<Option<f64>>,
    /// Overlap of the first seed, `[frame][camera]`, in the cameras that the tracker saw.
    overlaps: Vec<Vec<Option<f64>>>,
    /// Overlap of all seeds and frames in each camera that the tracker did not see, by its name.
    pub(crate) left_out: Vec<(String, Vec<f64>)>,
    pub(crate) reference: Option<RunAgainstReference>,
}

struct Answer<'a> {
    body: &'a Humanoid,
    sequence: &'a EstimatedSequence,
    rig: &'a CameraRig,
    /// Cameras that the tracker did not see.
    unseen: &'a [usize],
}

/// What one estimate has in all frames.
struct Agreed {
    overlaps: Vec<Vec<Option<f64>>>,
    boundaries: Vec<Vec<Option<f64>>>,
    residuals: Vec<Option<f64>>,
}

impl FootageMeasures {
    /// Measures every seed of a run, and a tracker that never moves.
    pub(crate) fn new(set: &BlindSet, tracked: &Tracked, progress: &dyn Progress) -> Result<Self, ExperimentError> {
        let estimates = &tracked.estimates;
        progress.begin(Stage::Evaluate, set.frame_count * (estimates.sequences.len() + 1));
        let body = &set.start.body;
        let still = EstimatedSequence::from_poses(body, vec![set.start.pose.clone(); set.frame_count]);
        let (mut seeds, mut rigs, mut through_given, mut floors) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut shown = Vec::new();
        let names = tracked.record.iter().flat_map(|record| &record.left_out);
        let unseen: Vec<usize> =
            names.filter_map(|name| set.rig.cameras.iter().position(|camera| camera.name == *name)).collect();
        let mut left_out: Vec<(String, Vec<f64>)> =
            unseen.iter().map(|camera| (set.rig.cameras[*camera].name.clone(), Vec::new())).collect();
        let unseen = unseen.as_slice();
        let (of_still, _) = Answer { body, sequence: &still, rig: &set.rig, unseen }.agreed(set, progress)?;
        for (index, seed) in estimates.seeds.iter().enumerate() {
            let (own, sequence) = (estimates.body(index, body), &estimates.sequences[index]);
            let corrected = tracked.corrected_rig(set, index);
            let rig = corrected.clone().unwrap_or_else(|| set.rig.clone());
            let answer = Answer { body: own, sequence, rig: &rig, unseen };
            let (agreed, apart) = answer.agreed(set, progress)?;
            left_out.iter_mut().zip(apart).for_each(|((_, all), apart)| all.extend(apart));
            let evaluation = answer.evaluation(set, &agreed)?;
            let given = Answer { rig: &set.rig, ..answer };
            through_given.push(match corrected {
                Some(_) => {
                    mean(&given.agreed(set, progress)?.0.overlaps.concat().into_iter().flatten().collect::<Vec<_>>())
                }
                None => None,
            });
            let floor = where_estimated(&still, sequence);
            floors.push(Answer { body, sequence: &floor, rig: &set.rig, unseen }.evaluation(set, &of_still)?);
            let energy = tracked.search.get(index).map(|records| recorded_energies(records)).unwrap_or_default();
            let markers = sequence.markers.clone();
            let (truth_energy, stances) = (Vec::new(), Vec::new());
            seeds.push(SeedMeasures { seed: *seed, evaluation, markers, energy, truth_energy, stances });
            if index == 0 {
                shown = agreed.overlaps;
            }
            rigs.push(rig);
        }
        let clip = set.name.clone();
        let runs: Vec<SeedRun<'_>> =
            seeds.iter().map(|s| SeedRun { clip: &clip, seed: s.seed, evaluation: &s.evaluation }).collect();
        let summary = summarise(&runs)?;
        let frozen = mean_floor(floors).ok_or(EvaluationError::NoRun)?;
        let measures = Measures { clip, seeds, summary, frozen, segmentation: None, hint: None };
        Ok(Self { measures, rigs, through_given, overlaps: shown, left_out, reference: None })
    }

    /// The files of the measured run; its page names the `command`.
    pub(crate) fn results(
        &self,
        set: &BlindSet,
        tracked: &Tracked,
        command: Option<String>,
    ) -> Result<RunResults, ExperimentError> {
        let (measures, body) = (&self.measures, &set.start.body);
        let poses = tracked.estimates.to_bytes(POSES_FILE, body, None)?;
        let facts = self.facts(set, tracked);
        let runs = report_runs(tracked, measures);
        let tracker = describe_tracker(tracked);
        let input = ReportInput {
            frozen: Some(&measures.frozen),
            ..ReportInput::of_runs(&set.name, &tracker, &runs, &measures.summary)
        };
        // nobody knows the true pose, so nothing is good or poor
        let line = "No grade: nobody knows the true pose.".to_owned();
        let verdict = Verdict { grade: None, line, rows: Vec::new(), ..verdict(&input) };
        let mut shown = vec![self.measured()];
        shown.extend(facts.iter().cloned());
        let of_run = this_run(tracked, command);
        shown.push(FactGroup { title: "This run".to_owned(), facts: of_run });
        let page = self.page(set, tracked, &tracker, &shown)?;
        let (left_out, reference) = (self.left_out(), self.reference.clone());
        let record = RunRecord { left_out, reference, ..record(set, tracked, measures, facts, verdict) };
        let files: NamedFiles = vec![
            (PER_FRAME_FILE.into(), per_frame::to_csv(tracked, measures)?),
            (POSES_FILE.into(), poses),
            (REPORT_FILE.into(), page.into_bytes()),
            (RUN_FILE.into(), to_json(&record)?),
        ];
        Ok(RunResults { record, files })
    }

    fn measured(&self) -> FactGroup {
        let summary = &self.measures.summary;
        let mut facts = Vec::new();
        for (name, value) in &summary.metrics {
            let title = find_metric(name).map_or(name.as_str(), |metric| metric.title);
            facts.push((title.to_owned(), format!("{:.3} {}", value.mean, value.unit.symbol())));
        }
        for camera in &summary.per_camera {
            let overlap = camera.overlap.map_or_else(|| "-".to_owned(), |overlap| format!("{overlap:.3}"));
            facts.push((format!("overlap in {}", camera.camera), overlap));
        }
        facts.extend(self.worst_image().map(|words| ("worst image".to_owned(), words)));
        FactGroup { title: "How well the estimate explains the images".to_owned(), facts }
    }

    /// The overlap in the cameras that the tracker did not see.
    fn left_out(&self) -> BTreeMap<String, LeftOutOverlap> {
        let worst = |overlaps: &[f64]| overlaps.iter().copied().fold(f64::INFINITY, f64::min);
        let of = |(camera, overlaps): &(String, Vec<f64>)| {
            Some((camera.clone(), LeftOutOverlap { mean: mean(overlaps)?, worst: worst(overlaps) }))
        };
        self.left_out.iter().filter_map(of).collect()
    }

    fn worst_image(&self) -> Option<String> {
        let mut worst: Option<(f64, usize, usize)> = None;
        for (frame, views) in self.overlaps.iter().enumerate() {
            for (camera, overlap) in views.iter().enumerate() {
                let Some(overlap) = *overlap else { continue };
                if worst.is_none_or(|(least, ..)| overlap < least) {
                    worst = Some((overlap, frame, camera));
                }
            }
        }
        let (overlap, frame, camera) = worst?;
        let name = &self.rigs.first()?.cameras.get(camera)?.name;
        Some(format!("overlap {overlap:.3}, {name}, frame {frame}"))
    }

    /// Images of each camera whose overlap with the first seed is far below the camera's own median: their masks show
    /// something else than the body, or the estimate is wrong there.
    fn doubtful_images(&self) -> impl Iterator<Item = (&str, String)> {
        let cameras = self.rigs.first().into_iter().flat_map(|rig| rig.cameras.iter().enumerate());
        cameras.filter_map(|(index, camera)| {
            let seen = self.overlaps.iter().enumerate();
            let seen: Vec<(usize, f64)> = seen.filter_map(|(frame, views)| Some((frame, views[index]?))).collect();
            let usual = median(seen.iter().map(|(_, overlap)| *overlap).collect())?;
            let spread = median(seen.iter().map(|(_, overlap)| (overlap - usual).abs()).collect())?;
            let limit = usual - (5.0 * spread).max(LEAST_FALL);
            let frames: Vec<usize> = seen.iter().filter(|own| own.1 < limit).map(|own| own.0).collect();
            let words = format!("overlap below {limit:.3} (median {usual:.3}) in {}", frame_ranges(&frames));
            (!frames.is_empty()).then_some((camera.name.as_str(), words))
        })
    }

    fn facts(&self, set: &BlindSet, tracked: &Tracked) -> Vec<FactGroup> {
        let group = |title: &str, facts: Vec<(String, String)>| FactGroup { title: title.to_owned(), facts };
        let named = |name: &str, value: String| (name.to_owned(), value);
        let seconds = set.frame_count as f64 / set.frames_per_second;
        let mut of_set = vec![
            named("length", format!("{} frames at {} Hz, {seconds:.2} s", set.frame_count, set.frames_per_second)),
            named("silhouettes", set.observation.as_ref().map(|facts| facts.describe()).unwrap_or_default()),
            named("tracker's body", set.start.body.name.clone()),
            named("set", set.set_hash.clone()),
        ];
        of_set.extend(self.worst_image().map(|words| named("worst image", words)));
        of_set.extend(
            self.doubtful_images().map(|(camera, words)| named(&format!("far below the rest, {camera}"), words)),
        );
        for (camera, LeftOutOverlap { mean, worst }) in self.left_out() {
            let how = match tracked.record.as_ref().is_some_and(|record| !record.left_out.is_empty()) {
                true => "in images that the tracker did not see",
                false => "tracked again without it",
            };
            let words = format!("overlap {mean:.3}, worst image {worst:.3}, {how}");
            of_set.push(named(&format!("left out, {camera}"), words));
        }
        let mut of_cameras = Vec::new();
        for (index, (seed, through)) in tracked.estimates.seeds.iter().zip(&self.through_given).enumerate() {
            let words = match through {
                None => "the given ones".to_owned(),
                Some(given) => {
                    let (mut moved, mut turned): (f64, f64) = (0.0, 0.0);
                    for (own, given) in self.rigs[index].cameras.iter().zip(&set.rig.cameras) {
                        let angle = own.camera_from_world.rotation.angle_to(&given.camera_from_world.rotation);
                        moved = moved.max(1000.0 * (own.centre() - given.centre()).norm());
                        turned = turned.max(angle.to_degrees());
                    }
                    format!(
                        "those that the tracker corrected (centres moved by up to {moved:.0} mm, turned by up to \
                         {turned:.2} degrees); through the given ones the overlap is {given:.3}"
                    )
                }
            };
            of_cameras.push(named(&format!("measured through, seed {seed}"), words));
        }
        of_cameras.extend(set.rig.cameras.iter().map(|camera| (camera.name.clone(), describe_camera(camera))));
        let mut groups = vec![
            group("How far to believe", HOW_FAR.map(|(name, words)| named(name, words.to_owned())).to_vec()),
            group("Recording", of_set),
            group("Cameras", of_cameras),
        ];
        groups.extend(self.reference.as_ref().map(RunAgainstReference::facts));
        groups.extend(tracker_facts(tracked));
        groups
    }

    /// The page: the frames of the first seed over its masks, and the facts.
    fn page(
        &self,
        set: &BlindSet,
        tracked: &Tracked,
        tracker: &str,
        facts: &[FactGroup],
    ) -> Result<String, ExperimentError> {
        let body = tracked.estimates.body(0, &set.start.body);
        let rig = &self.rigs[0];
        let sequence = &tracked.estimates.sequences[0];
        let seen = |painters: &mut Painters, frame: usize| -> Result<_, ExperimentError> {
            let observed = set.observation(frame)?;
            let estimated = sequence.pose(frame).map(|pose| painters.seen(&observed, body, pose));
            Ok((observed.silhouettes, estimated))
        };
        let mut painters = Painters::from_rig(rig);
        let plan =
            plan_of(set.frame_count, rig.cameras.len(), PlaybackBudget::PAGE, |frame| seen(&mut painters, frame))?;
        let kept: Vec<usize> = plan.kept().collect();
        let pack = |painters: &mut Painters, frame: &usize| -> Result<Vec<PackedView>, ExperimentError> {
            let (observed, estimated) = seen(painters, *frame)?;
            let estimate = |index: usize| estimated.as_ref().and_then(|masks| masks.get(index));
            Ok(observed.iter().enumerate().map(|(index, mask)| plan.pack(mask, estimate(index))).collect())
        };
        let views = kept.par_iter().map_init(|| Painters::from_rig(rig), pack).collect::<Result<_, _>>()?;
        let playback = Playback {
            seed: tracked.estimates.seeds[0],
            plan,
            views,
            props: Vec::new(),
            moved: Vec::new(),
            truth: vec![[None; LANDMARKS.len()]; kept.len()],
            estimate: kept.iter().map(|frame| self.measures.seeds[0].markers[*frame]).collect(),
        };
        let pills = [tracker.to_owned(), "a recording: no ground truth".to_owned()];
        let page = SetPage {
            title: &set.name,
            pills: &pills,
            rig,
            frames_per_second: set.frames_per_second,
            playback: &playback,
            has_estimate: true,
            keypoints: None,
            facts,
        };
        Ok(page.html()?)
    }
}

impl Answer<'_> {
    /// How the estimate agrees with what the tracker saw, frame by frame, and its overlap in each unseen camera.
    fn agreed(&self, set: &BlindSet, progress: &dyn Progress) -> Result<(Agreed, Vec<Vec<f64>>), ExperimentError> {
        let layout = set.keypoints.as_ref().map(|found| found.layout);
        let places = layout.map(|layout| self.body.keypoint_places(layout)).unwrap_or_default();
        let of_frame = |painters: &mut Painters, frame: usize| -> Result<_, ExperimentError> {
            if progress.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            let observed = set.observation(frame)?;
            let pose = self.sequence.pose(frame);
            let mut views = painters.agreements(&observed, std::iter::once((self.body, pose)));
            progress.advance();
            Ok((views.pop().unwrap_or_default(), pose.and_then(|pose| self.residual(&places, pose, &observed))))
        };
        let frames = (0..set.frame_count).into_par_iter();
        let all: Vec<(Vec<_>, Option<f64>)> =
            frames.map_init(|| Painters::from_rig(self.rig), of_frame).collect::<Result<_, _>>()?;
        let mut agreed = Agreed {
            overlaps: all.iter().map(|(views, _)| views.iter().map(|view| view.overlap).collect()).collect(),
            boundaries: all.iter().map(|(views, _)| views.iter().map(|view| view.boundary_f).collect()).collect(),
            residuals: all.into_iter().map(|(_, residual)| residual).collect(),
        };
        let mut apart = Vec::new();
        for camera in self.unseen {
            apart.push(agreed.overlaps.iter_mut().filter_map(|views| views[*camera].take()).collect());
            agreed.boundaries.iter_mut().for_each(|views| views[*camera] = None);
        }
        Ok((agreed, apart))
    }

    /// Median distance of the pose's points from the keypoints of a frame, pixels.
    fn residual(&self, places: &[Option<KeypointPlace>], pose: &Pose, observed: &Observation) -> Option<f64> {
        let frames = self.body.link_frames(pose);
        let mut off: Vec<f64> = Vec::new();
        let views = self.rig.cameras.iter().zip(&observed.keypoints.as_ref()?.views).enumerate();
        for (_, (camera, view)) in views.filter(|(index, _)| !self.unseen.contains(index)) {
            for (place, found) in places.iter().zip(view) {
                let (Some(place), Some(found)) = (place, found.filter(|found| found.confidence >= LEAST_CONFIDENCE))
                else {
                    continue;
                };
                let point = frames.0[place.point.link] * place.point.point_in_link;
                let projected = camera.project(&point);
                off.extend(projected.map(|pixel| (pixel.x - found.pixel[0]).hypot(pixel.y - found.pixel[1])));
            }
        }
        off.sort_by(f64::total_cmp);
        off.get(off.len() / 2).copied()
    }

    fn evaluation(&self, set: &BlindSet, agreed: &Agreed) -> Result<Evaluation, ExperimentError> {
        let cameras: &[Camera] = &self.rig.cameras;
        let nothing = vec![[None; LANDMARKS.len()]; set.frame_count];
        let unseen = vec![[false; LANDMARKS.len()]; cameras.len()];
        let in_view = vec![unseen.as_slice(); set.frame_count];
        let has_poses = self.sequence.poses().is_some();
        Ok(evaluate(&Sequence {
            first_scored: 0,
            has_truth: false,
            view_overlaps: has_poses.then_some(agreed.overlaps.as_slice()),
            view_boundaries: has_poses.then_some(agreed.boundaries.as_slice()),
            keypoint_residuals_px: (has_poses && set.keypoints.is_some()).then_some(agreed.residuals.as_slice()),
            views: Some(Views { cameras, moved: &[], in_view: &in_view, visible: &in_view }),
            ..Sequence::from_markers(set.frames_per_second, &nothing, &self.sequence.markers)
        })?)
    }
}
