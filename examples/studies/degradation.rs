//! Tracking error along every corruption axis: regenerates `results/degradation.md`, its plots and `.json`.
//!
//! `cargo run --release --example studies -- degradation`. Five seeds, or as many as `SKIAGRAPH_SEEDS` says; each seed
//! draws both the corruption and the tracker's numbers. Outcomes are kept in `runs/degradation/outcomes.jsonl`, so that
//! an interrupted study resumes; remove that file after a change of the program. `SKIAGRAPH_AXES=a,b` measures some
//! axes only; the page then shows what is known so far.

mod page;

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use skiagraph::camera::{Camera, Distortion};
use skiagraph::common::NoProgress;
use skiagraph::experiment::{draw, track};
use skiagraph::measure::Measures;
use skiagraph::observation::{AXES, CorruptionAxis};
use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;
use skiagraph::train::Models;

/// Name, and override of the tracker's table: the algorithm as printed, and the default.
const TRACKERS: [(&str, &str); 2] = [("paper", "tracker.annealed_particle_filter.paper=true"), ("default", "")];
/// Seconds of the default walk at 60 Hz.
const SECONDS: &str = "1.5";
/// The images of the ring, in pixels, and its radius in metres.
const RIG: [&str; 2] = ["rig.ring.size_px=[320, 240]", "rig.ring.radius_m=4.5"];
/// The lens distortion for the axis `lens_ignored`.
const LENS: Distortion = Distortion { k1: -0.2, k2: 0.05, p1: 0.0, p2: 0.0, k3: 0.0 };

/// The outcome of one tracker on one set.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Outcome {
    humaneva_mm: f64,
    lost: f64,
    iou: Option<f64>,
}

type Known = BTreeMap<String, Outcome>;

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let seeds: u64 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(5), |n| n.parse())?;
    let wanted = std::env::var("SKIAGRAPH_AXES").unwrap_or_default();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ledger = root.join("runs/degradation/outcomes.jsonl");
    std::fs::create_dir_all(ledger.parent().ok_or("a folder")?)?;
    let text = if ledger.is_file() { std::fs::read_to_string(&ledger)? } else { String::new() };
    let mut known: Known =
        text.lines().map(serde_json::from_str::<(String, Outcome)>).collect::<Result<_, serde_json::Error>>()?;
    // by seed, so that an interrupted study covers all axes with fewer seeds
    for seed in 0..seeds {
        for axis in AXES.iter().filter(|axis| wanted.is_empty() || wanted.split(',').any(|w| w == axis.name)) {
            for level in [0.0].iter().chain(&axis.levels) {
                measure(axis, *level, seed, &ledger, &mut known)?;
            }
        }
        let commit = crate::commit(&root.join("runs/degradation"))?;
        page::write(&root.join("results"), &known, seed + 1, &commit)?;
    }
    Ok(())
}

fn key(axis: &CorruptionAxis, level: f64, tracker: &str, seed: u64) -> String {
    // without corruption all axes are equal, except that of the lens
    let name = if level == 0.0 && axis.name != "lens_ignored" { "exact" } else { axis.name };
    format!("{name}|{level}|{tracker}|{seed}|{SECONDS} s")
}

fn measure(
    axis: &CorruptionAxis,
    level: f64,
    seed: u64,
    ledger: &PathBuf,
    known: &mut Known,
) -> Result<(), Box<dyn Error>> {
    let missing: Vec<_> =
        TRACKERS.iter().filter(|(name, _)| !known.contains_key(&key(axis, level, name, seed))).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let file = scenario(axis, level, seed, "")?;
    let (set, _) = draw(&file, None, &NoProgress)?;
    for (name, settings) in missing {
        let settings = scenario(axis, level, seed, settings)?.scenario.tracker();
        let tracked = track(&set.blind, &settings, &[seed], None, &mut Models::default(), &NoProgress)?;
        let measures = Measures::new(&set, &tracked, &NoProgress)?;
        let metrics = &measures.seeds[0].evaluation.metrics;
        let outcome = Outcome {
            humaneva_mm: metrics["humaneva_mm"].mean,
            lost: metrics["track_loss"].mean,
            iou: measures.segmentation.and_then(|quality| quality.iou),
        };
        let key = key(axis, level, name, seed);
        eprintln!("{key}: {:.1} mm, lost {:.2}, IoU {:?}", outcome.humaneva_mm, outcome.lost, outcome.iou);
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(ledger)?;
        writeln!(file, "{}", serde_json::to_string(&(&key, &outcome))?)?;
        known.insert(key, outcome);
    }
    Ok(())
}

/// The default walk, shortened, at one level of one axis.
fn scenario(axis: &CorruptionAxis, level: f64, seed: u64, tracker: &str) -> Result<ScenarioFile, Box<dyn Error>> {
    let mut overrides = vec![format!("motion.loop_to_s={SECONDS}"), format!("observation.seed={seed}")];
    let own_cameras = axis.name == "lens_ignored";
    if !own_cameras {
        overrides.extend(RIG.map(str::to_owned));
    }
    if axis.of_masks {
        overrides.push("observation.silhouette=\"corrupted\"".to_owned());
    }
    overrides.push(format!("observation.corruption.{}={level:?}", axis.name));
    overrides.extend((!tracker.is_empty()).then(|| tracker.to_owned()));
    if !own_cameras {
        return Ok(ScenarioFile::built_in(&overrides)?);
    }
    let prepared = PreparedScene::new(&ScenarioFile::built_in(&RIG.map(str::to_owned))?, None)?;
    let cameras: String = prepared.rig.rig().cameras.iter().map(with_lens).collect();
    let walk = skiagraph::scenario::DEFAULT_SCENARIO;
    let (before, ring) = walk.split_once("[rig.ring]").ok_or("a ring")?;
    let (_, after) = ring.split_once("[tracker").ok_or("a tracker")?;
    let text = format!("{before}{cameras}\n[tracker{after}");
    Ok(ScenarioFile::parse(&text, "study", PathBuf::new(), &overrides)?)
}

/// A camera of the ring as `[[rig.camera]]`, with a lens.
fn with_lens(camera: &Camera) -> String {
    let rotation = camera.camera_from_world.rotation.to_rotation_matrix();
    let rows: Vec<[f64; 3]> = (0..3).map(|i| [rotation[(i, 0)], rotation[(i, 1)], rotation[(i, 2)]]).collect();
    let t: [f64; 3] = camera.camera_from_world.translation.vector.into();
    format!(
        "[[rig.camera]]\nname = {:?}\nsize_px = {:?}\nmatrix = {:?}\nrotation = {rows:?}\ntranslation_m = {t:?}\ndistortion = {:?}\n\n",
        camera.name,
        [camera.pinhole.width, camera.pinhole.height],
        camera.opencv_matrix(),
        LENS.coefficients()
    )
}
