//! One measured case, and the ledger of known outcomes.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use skiagraph::benchmark_set::{BenchmarkSet, SetParts};
use skiagraph::body::{Humanoid, Markers, Pose};
use skiagraph::camera::{CameraRig, TimedRig};
use skiagraph::common::NoProgress;
use skiagraph::experiment::track;
use skiagraph::measure::Measures;
use skiagraph::observation::Observer;
use skiagraph::prepare::PreparedScene;
use skiagraph::retarget::{FitOptions, fit_motion_to_markers};
use skiagraph::rng::ObservationKey;
use skiagraph::scenario::ScenarioFile;
use skiagraph::scene::GroundTruth;
use skiagraph::tracker::CalibrationVerdict;
use skiagraph::train::Models;

use super::condition::Condition;
use super::takes::Take;

/// A take under a condition, with a kind of bodies.
pub(crate) struct Case<'a> {
    pub(crate) take: &'a Take,
    pub(crate) bodies: &'a str,
    pub(crate) condition: Condition,
    /// Number of test frames used, at 60 Hz.
    pub(crate) max_frames: usize,
    pub(crate) size_px: [u32; 2],
}

/// The outcome of one tracker on one case. All lists have one entry per seed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) humaneva_mm: Vec<f64>,
    /// Share of the frames in which the track was lost.
    pub(crate) lost: Vec<f64>,
    pub(crate) energy_gap: Vec<f64>,
    pub(crate) metrics: BTreeMap<String, Vec<f64>>,
    pub(crate) frames: usize,
    pub(crate) evaluations_per_frame: f64,
    pub(crate) ms_per_frame: f64,
    /// Error of the truth refitted to the body that the tracker used.
    pub(crate) floor_mm: f64,
    /// Whether the calibrated body was kept; empty without calibration.
    #[serde(default)]
    pub(crate) kept: Vec<bool>,
    /// Mean squared residual and energy, each with the given body and with the calibrated one.
    #[serde(default)]
    pub(crate) gate: Vec<[f64; 4]>,
}

/// A tracker: its name in the results, its settings, and whether it calibrates its body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) settings: &'static str,
    pub(crate) calibrate: bool,
}

/// Overrides of the bodies.
pub(crate) const BODIES: [(&str, &[&str]); 3] = [
    ("matched", &["actor.robot=\"tracker25\"", "tracker_body.robot=\"tracker25\"", "tracker_body.mismatch=\"none\""]),
    ("mismatch", &["actor.robot=\"actor\"", "tracker_body.robot=\"tracker25\"", "tracker_body.mismatch=\"standard\""]),
    (
        "mismatch, tracker40",
        &["actor.robot=\"actor\"", "tracker_body.robot=\"tracker40\"", "tracker_body.mismatch=\"standard\""],
    ),
];

/// Outcomes on disk, one line each, so that an interrupted study resumes.
pub(crate) struct Ledger {
    path: PathBuf,
    known: BTreeMap<String, Outcome>,
}

impl Ledger {
    pub(crate) fn open(path: PathBuf) -> Result<Self, Box<dyn Error>> {
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        let text = if path.is_file() { std::fs::read_to_string(&path)? } else { String::new() };
        let known = text.lines().map(serde_json::from_str::<(String, Outcome)>).collect::<Result<_, _>>()?;
        Ok(Self { path, known })
    }

    /// Known outcomes by the parts of their key: take, bodies, condition, method, settings, seeds, frames, size.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (Vec<&str>, &Outcome)> {
        self.known.iter().map(|(key, outcome)| (key.split('|').collect(), outcome))
    }

    fn add(&mut self, key: String, outcome: Outcome) -> Result<(), Box<dyn Error>> {
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(&self.path)?;
        writeln!(file, "{}", serde_json::to_string(&(&key, &outcome))?)?;
        self.known.insert(key, outcome);
        Ok(())
    }
}

impl Case<'_> {
    fn key(&self, method: &Method, seeds: u32) -> String {
        let Method { name: tracker, settings, .. } = method;
        let [width, height] = self.size_px;
        let (take, condition, frames) = (self.take.name, self.condition.name(), self.max_frames);
        format!("{take}|{}|{condition}|{tracker}|{settings}|{seeds}|{frames}|{width}x{height}", self.bodies)
    }

    /// The outcome of a method, if it is known.
    pub(crate) fn known(&self, method: &Method, seeds: u32, ledger: &Ledger) -> Option<Outcome> {
        ledger.known.get(&self.key(method, seeds)).cloned()
    }

    /// Outcomes of every method; unknown ones are measured.
    pub(crate) fn outcomes(
        &self,
        methods: &[Method],
        seeds: u32,
        mocap: &Path,
        ledger: &mut Ledger,
    ) -> Result<BTreeMap<String, Outcome>, Box<dyn Error>> {
        let mut set = None;
        let mut outcomes = BTreeMap::new();
        for method in methods {
            let key = self.key(method, seeds);
            if !ledger.known.contains_key(&key) {
                let set = match &mut set {
                    Some(set) => set,
                    none => none.insert(self.set(mocap)?),
                };
                set.blind.start.calibrate = method.calibrate;
                let outcome = measured(&self.file(method.settings)?, set, seeds)?;
                let mean = outcome.humaneva_mm.iter().sum::<f64>() / outcome.humaneva_mm.len() as f64;
                eprintln!(
                    "{}, {}, {}, {}: {mean:.1} mm, {:.1} ms, {:.0} evaluations, gap {:+.3}, floor {:.1} {:?} {:.4?}",
                    self.take.name,
                    self.bodies,
                    self.condition.name(),
                    method.name,
                    outcome.ms_per_frame,
                    outcome.evaluations_per_frame,
                    outcome.energy_gap.iter().sum::<f64>() / outcome.energy_gap.len() as f64,
                    outcome.floor_mm,
                    outcome.kept,
                    outcome.gate
                );
                ledger.add(key.clone(), outcome)?;
            }
            outcomes.insert(method.name.to_owned(), ledger.known[&key].clone());
        }
        Ok(outcomes)
    }

    fn file(&self, tracker: &str) -> Result<ScenarioFile, Box<dyn Error>> {
        let [width, height] = self.size_px;
        let text = format!(
            "schema = \"skiagraph.scenario/1\"\nname = \"{}\"\n\n{}\n[rig.ring]\ncount = 4\nradius_m = 4.5\nheight_m = 1.6\n\
             size_px = [{width}, {height}]\n\n[tracker.annealed_particle_filter]\n{tracker}\n",
            self.take.name,
            self.take.tables(self.condition.frames_per_second())
        );
        let bodies = BODIES.iter().find(|(name, _)| *name == self.bodies).map_or(&[][..], |(_, overrides)| overrides);
        let overrides: Vec<String> = bodies.iter().map(ToString::to_string).chain(self.condition.overrides()).collect();
        Ok(ScenarioFile::parse(&text, "study", PathBuf::new(), &overrides)?)
    }

    /// The benchmark set, in memory.
    fn set(&self, mocap: &Path) -> Result<BenchmarkSet, Box<dyn Error>> {
        let mut prepared = PreparedScene::new(&self.file("")?, Some(mocap))?;
        let frames = (self.max_frames as f64 * self.condition.frames_per_second() / 60.0) as usize;
        let cameras = &prepared.rig.rig().cameras;
        let rig = CameraRig { cameras: cameras.iter().take(self.condition.cameras()).cloned().collect() };
        prepared.rig = TimedRig::from(&rig);
        let mut motion = prepared.ground_truth.motion();
        motion.poses.truncate(frames);
        prepared.refitted.poses.truncate(frames);
        let GroundTruth { actor, props, .. } = prepared.ground_truth;
        prepared.ground_truth = GroundTruth::among(actor, &motion, &prepared.rig, props, Vec::new())?;
        let seed = self.take.name.bytes().fold(7, |hash: u64, byte| hash * 31 + u64::from(byte));
        prepared.start.pose = self.condition.start(&prepared.start.body, &prepared.start.pose, seed);
        let parts = SetParts {
            name: self.take.name,
            rig: &prepared.rig,
            start: &prepared.start,
            ground_truth: &prepared.ground_truth,
            refitted: Some(&prepared.refitted),
            facts: &prepared.facts,
            recordings: &[],
            observation: None,
            key: ObservationKey::default(),
        };
        let observer = Observer::new(&prepared.ground_truth, &prepared.rig);
        Ok(BenchmarkSet::assemble(&parts, |frame| self.condition.corrupt(observer.observe(frame)))?)
    }
}

fn measured(file: &ScenarioFile, set: &BenchmarkSet, seeds: u32) -> Result<Outcome, Box<dyn Error>> {
    let all: Vec<u64> = (0..u64::from(seeds)).collect();
    let settings = file.scenario.tracker();
    let tracked = track(&set.blind, &settings, &all, None, &mut Models::default(), &NoProgress)?;
    let measures = Measures::new(set, &tracked, &NoProgress)?;
    let mut metrics: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for seed in &measures.seeds {
        for (name, metric) in &seed.evaluation.metrics {
            metrics.entry((*name).to_owned()).or_default().push(metric.mean);
        }
    }
    let floors: Vec<f64> = (0..all.len()).map(|seed| floor(set, tracked.estimates.bodies.get(seed))).collect();
    let record = tracked.record.ok_or("a record")?;
    let timing = record.timing;
    let frames = set.blind.frame_count;
    let answers = (frames * all.len()) as f64;
    let mut take = |name: &str| metrics.remove(name).ok_or_else(|| format!("no {name}"));
    Ok(Outcome {
        humaneva_mm: take("humaneva_mm")?,
        lost: take("track_loss")?,
        energy_gap: take("energy_gap")?,
        frames,
        evaluations_per_frame: timing.likelihood_evaluations as f64 / answers,
        ms_per_frame: 1000.0 * timing.seconds / answers,
        floor_mm: mean(&floors),
        metrics,
        kept: record.calibration.iter().map(|report| report.verdict == CalibrationVerdict::Kept).collect(),
        gate: record
            .calibration
            .iter()
            .map(|report| {
                let ([a, b], [c, d]) = (report.cost.unwrap_or_default(), report.energy.unwrap_or_default());
                [a, b, c, d]
            })
            .collect(),
    })
}

/// Mean error of the markers of the truth refitted to the tracker's body or to a calibrated one, without frame 0.
fn floor(set: &BenchmarkSet, calibrated: Option<&Humanoid>) -> f64 {
    let poses: Vec<Pose> = match (calibrated, &set.truth.refitted) {
        (Some(body), _) => {
            let markers: Vec<Markers> = set.truth.ground_truth.frames.iter().map(|frame| frame.markers).collect();
            let fits = fit_motion_to_markers(body, &markers, &body.zero_pose(), &FitOptions::default());
            fits.into_iter().map(|fit| fit.pose).collect()
        }
        (None, Some(refitted)) => refitted.poses.clone(),
        (None, None) => return f64::NAN,
    };
    let body = calibrated.unwrap_or(&set.blind.start.body);
    let pairs = poses.iter().zip(&set.truth.ground_truth.frames).skip(1);
    let of_frame = pairs.map(|(pose, frame)| {
        let markers = body.markers(&body.link_frames(pose));
        let both = markers.iter().zip(&frame.markers).filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm()));
        let distances: Vec<f64> = both.collect();
        1000.0 * distances.iter().sum::<f64>() / distances.len() as f64
    });
    let all: Vec<f64> = of_frame.collect();
    all.iter().sum::<f64>() / all.len() as f64
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
