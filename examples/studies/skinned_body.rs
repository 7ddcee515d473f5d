//! A skinned and a cylindrical body on a long walk, as in both experiments of `[Skinned APF]`: regenerates
//! `results/skinned-body.md`, `results/skinned-body.json` and `results/skinned-body-*.svg`.
//!
//! `cargo run --release --example studies -- skinned_body`. Five seeds, or as many as `SKIAGRAPH_SEEDS` says; needs no
//! files. Outcomes are kept in `runs/skinned-body/outcomes.jsonl`, so that an interrupted study resumes; remove that
//! file after a change of the program.

mod measure;
mod page;

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};
use skiagraph::benchmark_set::BenchmarkSet;
use skiagraph::common::NoProgress;
use skiagraph::experiment::draw;
use skiagraph::scenario::ScenarioFile;

const SCENARIO: &str = "scenarios/skins/long_walk.toml";

/// One tracker with one rig.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) views: u32,
    /// Name and override of the tracker's body.
    pub(crate) body: &'static str,
    /// `paper` or `default`.
    pub(crate) method: &'static str,
}

/// Name of a body, and its overrides of the scenario.
const BODIES: [(&str, &[&str]); 2] = [("capsules", &[]), ("skin", &["tracker_body.skin=person_coarse"])];

/// All cases, in order of importance.
pub(crate) const CASES: [Case; 6] = [
    Case { views: 4, body: "capsules", method: "paper" },
    Case { views: 4, body: "skin", method: "paper" },
    Case { views: 4, body: "capsules", method: "default" },
    Case { views: 4, body: "skin", method: "default" },
    Case { views: 7, body: "capsules", method: "default" },
    Case { views: 7, body: "skin", method: "default" },
];

/// The outcome of one seed of a case. Lists have one entry per frame; frame 0, the start, has zeros.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) error_mm: Vec<f32>,
    pub(crate) orientation_deg: Vec<f32>,
    /// Error of the head's heading, with its sign, degrees.
    pub(crate) head_deg: Vec<f32>,
    /// The same for the body, without sign.
    pub(crate) body_deg: Vec<f32>,
    /// Mean error of the two outer markers of left arm, right arm, left leg and right leg, millimetres.
    pub(crate) limbs_mm: [Vec<f32>; 4],
    /// Mean of the overlap of estimated and observed silhouettes.
    pub(crate) silhouette_iou: f64,
    /// Overlap of the observed silhouettes with the exact ones.
    pub(crate) segmentation_iou: Option<f64>,
    pub(crate) energy_gap: Option<f64>,
    pub(crate) evaluations: u64,
    pub(crate) seconds: f64,
    pub(crate) set_hash: String,
}

/// Increase of the energy when the head or a shoulder is turned away from the true pose: views, body, angle in degrees,
/// increase for the head's rotation and for an arm's abduction.
pub(crate) type Turns = Vec<(u32, String, f64, f64, f64)>;

/// By [`Case::key`] and seed.
pub(crate) type Known = BTreeMap<String, Outcome>;

impl Case {
    pub(crate) fn key(&self, seed: u64) -> String {
        format!("{} views, {}, {}, seed {seed}", self.views, self.body, self.method)
    }

    fn file(&self, root: &Path) -> Result<ScenarioFile, Box<dyn Error>> {
        let mut overrides = vec![format!("rig.ring.count={}", self.views)];
        let body = BODIES.iter().filter(|(name, _)| *name == self.body).flat_map(|(_, set)| set.iter());
        overrides.extend(body.map(|set| (*set).to_owned()));
        overrides.push(if self.method == "paper" { "paper=true" } else { "tracker_body.robot=tracker40" }.to_owned());
        Ok(ScenarioFile::open(&root.join(SCENARIO), &overrides)?)
    }
}

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let seeds: u64 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(5), |n| n.parse())?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ledger = root.join("runs/skinned-body/outcomes.jsonl");
    std::fs::create_dir_all(ledger.parent().ok_or("a folder")?)?;
    let text = if ledger.is_file() { std::fs::read_to_string(&ledger)? } else { String::new() };
    let commit = crate::commit(ledger.parent().ok_or("a folder")?)?;
    let mut known: Known =
        text.lines().map(serde_json::from_str::<(String, Outcome)>).collect::<Result<_, serde_json::Error>>()?;
    let mut turns = Turns::new();
    for case in CASES {
        // the same images for every tracker; the set of a case has its tracker's body
        let mut set: Option<BenchmarkSet> = None;
        let missing: Vec<u64> = (0..seeds).filter(|seed| !known.contains_key(&case.key(*seed))).collect();
        let file = case.file(root)?;
        if !missing.is_empty() || case.method == "default" {
            set = Some(draw(&file, None, &NoProgress)?.0);
        }
        for seed in missing {
            let Some(set) = &set else { continue };
            let outcome = measure::track_once(set, &file, seed)?;
            let key = case.key(seed);
            let mean = |values: &[f32]| values.iter().skip(1).sum::<f32>() / (values.len() - 1) as f32;
            eprintln!(
                "{key}: {:.1} mm, {:.1} degrees, {:.0} s",
                mean(&outcome.error_mm),
                mean(&outcome.orientation_deg),
                outcome.seconds
            );
            let mut file = std::fs::OpenOptions::new().create(true).append(true).open(&ledger)?;
            writeln!(file, "{}", serde_json::to_string(&(&key, &outcome))?)?;
            known.insert(key, outcome);
        }
        if let Some(set) = set.filter(|_| case.method == "default") {
            turns.extend(
                measure::turns(&set)?
                    .into_iter()
                    .map(|(angle, head, arm)| (case.views, case.body.to_owned(), angle, head, arm)),
            );
        }
        page::write(&root.join("results"), &known, &turns, (seeds, &commit))?;
    }
    Ok(())
}
