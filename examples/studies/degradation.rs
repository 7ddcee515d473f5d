//! How trackers degrade along every axis of corruption: regenerates `results/degradation.md` and `.json`.
//!
//! `cargo run --release --example studies -- degradation`. Five seeds, or as many as `SKIAGRAPH_SEEDS` says; each seed
//! draws both the corruption and the tracker's numbers. What was measured is kept in `runs/degradation/outcomes.jsonl`,
//! so that a study that was stopped goes on where it was; remove that file after a change of the program.
//! `SKIAGRAPH_AXES=a,b` measures some axes only; the page then shows what is known so far.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use skiagraph::camera::{Camera, Distortion};
use skiagraph::evaluation::{ValueRange, mean_interval};
use skiagraph::experiment::{Measures, Models, Staged, Unwatched, draw, track};
use skiagraph::observation::{AXES, CorruptionAxis};
use skiagraph::scenario::ScenarioFile;

/// Name, and override of the tracker's table. The algorithm as printed, and what ships as the default.
const TRACKERS: [(&str, &str); 2] = [("paper", "tracker.annealed_particle_filter.paper=true"), ("default", "")];
/// Seconds of the default walk at 60 Hz.
const SECONDS: &str = "1.5";
/// The lens that is ignored along the axis `lens_ignored`.
const LENS: Distortion = Distortion { k1: -0.2, k2: 0.05, p1: 0.0, p2: 0.0, k3: 0.0 };

/// What came of one tracker on one set.
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
    // seed by seed, so that a study that is stopped has all axes with fewer seeds
    for seed in 0..seeds {
        for axis in AXES.iter().filter(|axis| wanted.is_empty() || wanted.split(',').any(|w| w == axis.name)) {
            for level in [0.0].iter().chain(&axis.levels) {
                measure(axis, *level, seed, &ledger, &mut known)?;
            }
        }
        write_page(&root.join("results"), &known, seed + 1)?;
    }
    Ok(())
}

fn key(axis: &CorruptionAxis, level: f64, tracker: &str, seed: u64) -> String {
    // without corruption all axes are one, but for that of the lens
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
    let (set, _) = draw(&file, None, &Unwatched)?;
    for (name, settings) in missing {
        let settings = scenario(axis, level, seed, settings)?.scenario.tracker();
        let tracked = track(&set.blind, &settings, &[seed], None, &mut Models::default(), &Unwatched)?;
        let measures = Measures::new(&set, &tracked, &Unwatched)?;
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
    if axis.of_masks {
        overrides.push("observation.silhouette=\"corrupted\"".to_owned());
    }
    overrides.push(format!("observation.corruption.{}={level:?}", axis.name));
    overrides.extend((!tracker.is_empty()).then(|| tracker.to_owned()));
    if axis.name != "lens_ignored" {
        return Ok(ScenarioFile::built_in(&overrides)?);
    }
    let staged = Staged::new(&ScenarioFile::built_in(&overrides[..1])?, None)?;
    let cameras: String = staged.rig.cameras.iter().map(with_lens).collect();
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

fn write_page(folder: &Path, known: &Known, seeds: u64) -> Result<(), Box<dyn Error>> {
    let mut page = format!(
        "# Degradation: what each corruption does to tracking\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} cargo run --release --example studies -- degradation` (it resumes; every outcome is in `degradation.json`). \
         The first {SECONDS} s of the default walk at 60 Hz, four cameras of 640 x 480, standard mismatch of bodies; {seeds} seeds, \
         each of which draws the corruption and the tracker's numbers. *Paper* is the algorithm as printed (`paper = true`), *default* \
         what ships. HumanEva error in mm, mean over seeds, with the 95 % interval from three seeds on; *lost* is the share of frames \
         with the track lost; *IoU* is that of the masks with the exact ones, where they differ. *Doubles at* is the strength at which \
         the mean error is twice that without corruption, linear between levels. Formulas: `scenarios/README.md`.\n\n\
         | axis | paper doubles at | default doubles at |\n|---|---|---|\n"
    );
    let mut tables = String::new();
    for axis in &AXES {
        let errors = |tracker: &str, level: f64| values(known, axis, level, tracker, seeds, |o| Some(o.humaneva_mm));
        if errors("paper", axis.levels[0]).is_empty() {
            continue;
        }
        let doubling = TRACKERS.map(|(name, _)| doubles_at(axis, &|level| mean(&errors(name, level))));
        page += &format!("| `{}`{} | {} | {} |\n", axis.name, in_unit(axis), doubling[0], doubling[1]);
        tables += &format!(
            "\n## {}{}\n\n{}.\n\n| {} | paper, mm | lost | default, mm | lost | IoU |\n|---|---|---|---|---|---|\n",
            axis.name,
            in_unit(axis),
            axis.formula,
            axis.name
        );
        for level in [0.0].iter().chain(&axis.levels) {
            let cell = |tracker: &str| {
                let lost = mean(&values(known, axis, *level, tracker, seeds, |o| Some(o.lost)));
                format!("{} | {lost:.2}", with_interval(&errors(tracker, *level)))
            };
            let iou = mean(&values(known, axis, *level, "default", seeds, |o| o.iou));
            let iou = if iou.is_nan() { "-".to_owned() } else { format!("{iou:.3}") };
            tables += &format!("| {level} | {} | {} | {iou} |\n", cell("paper"), cell("default"));
        }
    }
    std::fs::write(folder.join("degradation.md"), page + &tables)?;
    std::fs::write(folder.join("degradation.json"), serde_json::to_string_pretty(known)? + "\n")?;
    Ok(())
}

fn in_unit(axis: &CorruptionAxis) -> String {
    if axis.unit.is_empty() { String::new() } else { format!(" ({})", axis.unit) }
}

fn values(
    known: &Known,
    axis: &CorruptionAxis,
    level: f64,
    tracker: &str,
    seeds: u64,
    of: impl Fn(&Outcome) -> Option<f64>,
) -> Vec<f64> {
    (0..seeds).filter_map(|seed| of(known.get(&key(axis, level, tracker, seed))?)).collect()
}

fn doubles_at(axis: &CorruptionAxis, error: &dyn Fn(f64) -> f64) -> String {
    let twice = 2.0 * error(0.0);
    let levels: Vec<f64> = [0.0].iter().chain(&axis.levels).copied().collect();
    for pair in levels.windows(2) {
        let (low, high) = (error(pair[0]), error(pair[1]));
        if high >= twice {
            return format!("{:.3}", pair[0] + (pair[1] - pair[0]) * (twice - low) / (high - low));
        }
    }
    format!("not up to {}", axis.levels[4])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn with_interval(errors: &[f64]) -> String {
    match mean_interval(&[errors.to_vec()], ValueRange::NonNegative) {
        Some((interval, _)) => format!("{:.1} ({:.1} to {:.1})", mean(errors), interval.low, interval.high),
        None => format!("{:.1}", mean(errors)),
    }
}
