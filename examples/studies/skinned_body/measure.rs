//! A single tracking run and its measurements.

use std::error::Error;

use nalgebra::{Unit, Vector3};
use skiagraph::benchmark_set::BenchmarkSet;
use skiagraph::body::{Humanoid, LANDMARKS, Landmark, LinkFrames, Markers, Pose};
use skiagraph::common::NoProgress;
use skiagraph::evaluation::Evaluation;
use skiagraph::experiment::track;
use skiagraph::measure::Measures;
use skiagraph::scenario::ScenarioFile;
use skiagraph::scene::TruthFrame;
use skiagraph::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};
use skiagraph::train::Models;

use super::Outcome;

/// The outer markers of each limb.
const LIMBS: [[Landmark; 2]; 4] = [
    [Landmark::LeftElbow, Landmark::LeftWrist],
    [Landmark::RightElbow, Landmark::RightWrist],
    [Landmark::LeftKnee, Landmark::LeftAnkle],
    [Landmark::RightKnee, Landmark::RightAnkle],
];
/// Rotation angles of joints away from the truth, degrees.
const TURNS: [f64; 7] = [-45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0];
/// Interval of the frames in which the energy of rotated joints is computed.
const EVERY: usize = 23;

pub(super) fn track_once(set: &BenchmarkSet, file: &ScenarioFile, seed: u64) -> Result<Outcome, Box<dyn Error>> {
    let tracked = track(&set.blind, &file.scenario.tracker(), &[seed], None, &mut Models::default(), &NoProgress)?;
    let measures = Measures::new(set, &tracked, &NoProgress)?;
    let (evaluation, markers) = (&measures.seeds[0].evaluation, &measures.seeds[0].markers);
    let timing = tracked.record.as_ref().ok_or("a record")?.timing;
    let poses = tracked.estimates.sequences[0].poses().ok_or("poses")?;
    let (actor, own) = (&set.truth.ground_truth.actor, &set.blind.start.body);
    let truth = &set.truth.ground_truth.frames;
    let (true_heading, heading) = (Heading::of_head(actor)?, Heading::of_head(own)?);
    let head = |(truth, pose): (&TruthFrame, &Option<Pose>)| {
        let estimate = pose.as_ref().map_or(f64::NAN, |pose| heading.of(&own.link_frames(pose)));
        within_half_a_turn(estimate - true_heading.of(&truth.link_frames)).to_degrees() as f32
    };
    let limb = |limb: [Landmark; 2]| -> Vec<f32> {
        let error = |(truth, estimate): (&Markers, &Markers)| {
            let of = |landmark: Landmark| {
                let at = LANDMARKS.iter().position(|known| *known == landmark)?;
                Some(1000.0 * (estimate[at]? - truth[at]?).norm())
            };
            (0.5 * (of(limb[0]).unwrap_or(f64::NAN) + of(limb[1]).unwrap_or(f64::NAN))) as f32
        };
        truth.iter().map(|frame| &frame.markers).zip(markers).map(error).collect()
    };
    let mean = |name: &str| evaluation.metrics.get(name).map(|metric| metric.mean);
    Ok(Outcome {
        error_mm: per_frame(evaluation, "humaneva_mm")?,
        orientation_deg: per_frame(evaluation, "body_orientation_deg")?,
        head_deg: truth.iter().zip(poses).map(head).collect(),
        body_deg: per_frame(evaluation, "heading_deg")?,
        limbs_mm: LIMBS.map(limb),
        silhouette_iou: mean("silhouette_iou").ok_or("an overlap")?,
        segmentation_iou: measures.segmentation.as_ref().and_then(|quality| quality.iou),
        energy_gap: mean("energy_gap"),
        evaluations: timing.likelihood_evaluations,
        seconds: timing.seconds,
        set_hash: set.blind.set_hash.clone(),
    })
}

fn per_frame(evaluation: &Evaluation, name: &str) -> Result<Vec<f32>, Box<dyn Error>> {
    let metric = evaluation.metrics.get(name).ok_or("a metric")?;
    Ok(metric.per_frame.iter().map(|value| value.unwrap_or(0.0) as f32).collect())
}

fn within_half_a_turn(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

/// The heading of the head.
struct Heading {
    link: usize,
    /// The head's axis that is the body's +X at the zero pose.
    forward: Unit<Vector3<f64>>,
}

impl Heading {
    fn of_head(body: &Humanoid) -> Result<Self, Box<dyn Error>> {
        let link = body.links.iter().position(|link| link.name == "head").ok_or("a head")?;
        let at_rest = body.link_frames(&body.zero_pose())[link].rotation;
        Ok(Self { link, forward: Unit::new_normalize(at_rest.inverse() * Vector3::x()) })
    }

    /// The angle about the vertical, radians.
    fn of(&self, frames: &LinkFrames) -> f64 {
        let forward = frames[self.link].rotation * self.forward.into_inner();
        forward.y.atan2(forward.x)
    }
}

/// An angle in degrees, and the mean increase of the energy for the head's rotation and for the left arm's abduction.
pub(super) type TurnRises = (f64, f64, f64);

/// Mean increase of the energy, over some frames, when a joint of the true pose (refitted to the tracker's body) is
/// rotated.
pub(super) fn turns(set: &BenchmarkSet) -> Result<Vec<TurnRises>, Box<dyn Error>> {
    let body = &set.blind.start.body;
    let refitted = set.truth.refitted.as_ref().ok_or("a refitted truth")?;
    let mut likelihood = SilhouetteLikelihood::new(body.clone(), &set.blind.rig, SilhouetteSettings::default())?;
    let mut scratch = likelihood.scratch();
    let degree =
        |name: &str| body.degrees_of_freedom.iter().position(|dof| dof.name == name).ok_or("a degree of freedom");
    let degrees = [degree("head_rotation")?, degree("left_shoulder_abduction")?];
    let mut rises = vec![(0.0, [0.0; 2]); TURNS.len()];
    let mut count = 0.0;
    for (observation, pose) in set.blind.observations().zip(&refitted.poses).step_by(EVERY) {
        likelihood.prepare(&observation?)?;
        let base = likelihood.energy(pose, &mut scratch);
        for (rise, angle) in rises.iter_mut().zip(TURNS) {
            rise.0 = angle;
            for (sum, degree) in rise.1.iter_mut().zip(degrees) {
                let mut turned = pose.clone();
                turned.joint_angles[degree] += angle.to_radians();
                *sum += likelihood.energy(&turned, &mut scratch) - base;
            }
        }
        count += 1.0;
    }
    Ok(rises.into_iter().map(|(angle, [head, arm])| (angle, head / count, arm / count)).collect())
}
