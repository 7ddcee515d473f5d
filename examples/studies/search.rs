//! Effect of descent on outlines, limb search and body calibration: regenerates `results/search.md` and
//! `results/search.json`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- search`, where DIR holds the CMU takes that `takes.rs`
//! names and their skeletons. Three seeds, or as many as `SKIAGRAPH_SEEDS` says. Outcomes are kept in
//! `runs/search/outcomes.jsonl`, so that an interrupted study resumes; remove that file after a change of the program.
//! With `SKIAGRAPH_PAGE=1` nothing is measured, and the page is written from the outcomes. With
//! `SKIAGRAPH_TUNE=SETTINGS` the tuning takes are tracked with these settings (lines of
//! `[tracker.annealed_particle_filter]`, separated by `;`) in small images, with and without calibration; the results
//! are printed, and nothing is written. `SKIAGRAPH_TAKES` selects takes, `SKIAGRAPH_BODIES` kinds of bodies,
//! `SKIAGRAPH_CONDITION` a condition, and `SKIAGRAPH_SIZE` the height of the images. Without DIR nothing is run.

mod condition;
mod page;
mod takes;
mod units;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use condition::Condition;
use page::Results;
use units::{BODIES, Case, Ledger, Method};

/// The algorithm as printed.
const PAPER: Method = Method { name: "paper", settings: "paper = true", calibrate: false };
/// The default.
const REFINED: Method = Method { name: "refined", settings: "", calibrate: false };
/// The default with calibration of the tracker's body.
const CALIBRATED: Method = Method { name: "calibrated", settings: "", calibrate: true };
/// Frames at 60 Hz of the reported takes, and under stress.
const MAX_FRAMES: usize = 120;
const STRESS_FRAMES: usize = 60;
/// Takes that are tracked under stress.
const STRESSED: [&str; 4] = ["49_01", "02_04", "16_36", "35_08"];
const SIZE_PX: [u32; 2] = [640, 480];

/// All measurements in order of importance: condition, kind of bodies, method.
fn plan() -> Vec<(Condition, &'static str, Method)> {
    let [matched, mismatch, alike] = BODIES.map(|(name, _)| name);
    let clean = [
        (alike, CALIBRATED),
        (matched, CALIBRATED),
        (mismatch, CALIBRATED),
        (alike, REFINED),
        (matched, REFINED),
        (mismatch, REFINED),
    ];
    let clean = clean.map(|(bodies, method)| (Condition::Clean, bodies, method));
    let stress = Condition::STRESS.map(|condition| (condition, matched, REFINED));
    let paper = [matched, mismatch].map(|bodies| (Condition::Clean, bodies, PAPER));
    let beside = Condition::STRESS.map(|condition| (condition, matched, PAPER));
    [&clean[..], &stress, &paper, &beside].concat()
}

/// The takes of an entry of the plan, and how many of their frames are used. Clean views of matched bodies are in both
/// tables.
fn cases(condition: Condition, bodies: &'static str) -> Vec<Case<'static>> {
    let stressed = condition != Condition::Clean;
    let takes = takes::REPORTED.iter().filter(|take| !stressed || STRESSED.contains(&take.name));
    let max_frames = if stressed { STRESS_FRAMES } else { MAX_FRAMES };
    takes.map(|take| Case { take, bodies, condition, max_frames, size_px: SIZE_PX }).collect()
}

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a folder with CMU's takes and their .asf files");
        return Ok(());
    };
    let seeds: u32 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(3), |n| n.parse())?;
    if let Ok(settings) = std::env::var("SKIAGRAPH_TUNE") {
        return tune(settings.replace(';', "\n").leak(), seeds, &mocap);
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut ledger = Ledger::open(root.join("runs/search/outcomes.jsonl"))?;
    let measures = std::env::var_os("SKIAGRAPH_PAGE").is_none();
    for (condition, bodies, method) in plan().into_iter().filter(|_| measures) {
        for case in cases(condition, bodies) {
            case.outcomes(&[method], seeds, &mocap, &mut ledger)?;
        }
    }
    let commit = crate::commit(&root.join("runs/search"))?;
    let mut results = Results::default();
    for (condition, bodies, method) in plan() {
        for case in cases(condition, bodies) {
            let Some(outcome) = case.known(&method, seeds, &ledger) else { continue };
            results.add(condition, bodies, case.take.name, method.name, outcome);
        }
    }
    let tuning = Ledger::open(root.join("runs/search/tuning.jsonl"))?;
    results.tuning = page::tuning_rows(&tuning);
    let folder = root.join("results");
    std::fs::write(folder.join("search.json"), serde_json::to_string_pretty(&results)? + "\n")?;
    std::fs::write(folder.join("search.md"), page::page(&results, seeds, &commit))?;
    Ok(())
}

/// The tuning takes in small images.
fn tune(settings: &'static str, seeds: u32, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut ledger = Ledger::open(root.join("runs/search/tuning.jsonl"))?;
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let (wanted, condition, kinds) =
        (variable("SKIAGRAPH_TAKES"), variable("SKIAGRAPH_CONDITION"), variable("SKIAGRAPH_BODIES"));
    let condition = Condition::STRESS.into_iter().find(|c| c.name() == condition).unwrap_or(Condition::Clean);
    let height: u32 = variable("SKIAGRAPH_SIZE").parse().unwrap_or(240);
    let is_wanted = |wanted: &str, name: &str| wanted.is_empty() || wanted.split(';').any(|w| w == name);
    let methods = [false, true].map(|calibrate| Method {
        name: if calibrate { "calibrated" } else { "tuned" },
        settings,
        calibrate,
    });
    let mut means: BTreeMap<(&str, &str), Vec<f64>> = BTreeMap::new();
    for (bodies, _) in BODIES.iter().filter(|(name, _)| is_wanted(&kinds, name)) {
        for take in takes::TUNING.iter().filter(|take| is_wanted(&wanted, take.name)) {
            let size_px = [height / 3 * 4, height];
            let case = Case { take, bodies, condition, max_frames: MAX_FRAMES, size_px };
            let outcomes = case.outcomes(&methods, seeds, mocap, &mut ledger)?;
            for method in &methods {
                let error = units::mean(&outcomes[method.name].humaneva_mm);
                means.entry((*bodies, method.name)).or_default().push(error);
            }
        }
    }
    for ((bodies, method), errors) in means {
        eprintln!("{bodies}, {method}: mean {:.2} mm", units::mean(&errors));
    }
    Ok(())
}
