//! Tracking with learned motion models from one camera, after the paper's Tables 2 and 3: regenerates
//! `results/monocular.md`, `results/monocular.json` and `results/monocular-MOTION.svg`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- monocular`, where DIR holds the CMU recordings that
//! `scenarios/monocular/*.toml` name and their skeletons. Five seeds, or as many as `SKIAGRAPH_SEEDS` says. Without DIR
//! nothing is written.
//!
//! Every motion with every protocol is a part, kept in `runs/monocular/parts`, so that an interrupted study resumes.
//! The page is written again after each part. A part is made again if its scenario has changed; after a change of the
//! program, remove the folder.

mod best_latent;
mod learning;
mod page;
mod parts;
mod units;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use learning::{Learning, learning};
use page::{ERROR, Measured, page};
use parts::{Method, kept_or, tracked};
use serde::Serialize;
use skiagraph::evaluation::Interval;
use skiagraph::report::error_plot;
use skiagraph::report::plots::Size;
use units::Unit;

/// `monocular.json`.
#[derive(Serialize)]
struct Results<'a> {
    seeds: u32,
    learning: &'a BTreeMap<String, Learning>,
    /// By motion, protocol and method.
    tracking: BTreeMap<&'a str, BTreeMap<&'a str, BTreeMap<&'a str, InNumbers>>>,
}

/// One method of one motion under one protocol.
#[derive(Serialize)]
struct InNumbers {
    humaneva_mm: Option<f64>,
    ci95: Option<Interval>,
    by_seed: Vec<f64>,
    root_relative_mm: Option<f64>,
    energy_gap: Option<f64>,
    track_loss: Option<f64>,
    models: Option<usize>,
    brought_back: u64,
}

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!(
            "SKIPPED: set SKIAGRAPH_MOCAP to a directory with the CMU recordings of scenarios/monocular/*.toml and their skeletons"
        );
        return Ok(());
    };
    let seeds: u32 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(5), |n| n.parse())?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let runs = root.join("runs/monocular");
    let parts = runs.join("parts");
    let mut measured = Measured { commit: crate::commit(&parts)?, ..Measured::default() };
    for unit in Unit::all().iter().filter(|unit| unit.is_standard()) {
        let subject = unit.subject.name;
        let file = unit.file(root, seeds)?;
        let learned = kept_or(&parts, &format!("learning-{subject}"), &file, || learning(&file, &mocap))?;
        measured.learning.insert(subject.to_owned(), learned);
    }
    for unit in Unit::all() {
        let (subject, protocol) = (unit.subject, unit.protocol);
        let file = unit.file(root, seeds)?;
        let part = kept_or(&parts, &unit.name(), &file, || tracked(&unit, &file, &mocap, &runs))?;
        if unit.is_standard() {
            let plot = error_plot(&part.compared()).svg(Size { width: 1000, height: 420 })?;
            std::fs::write(root.join(format!("results/monocular-{}.svg", subject.name)), plot.standalone())?;
        }
        measured.tracked.insert((subject.name.to_owned(), protocol.name.to_owned()), part);
        write(root, &measured, seeds)?;
    }
    Ok(())
}

fn write(root: &Path, measured: &Measured, seeds: u32) -> Result<(), Box<dyn Error>> {
    let mut results = Results { seeds, learning: &measured.learning, tracking: BTreeMap::new() };
    for ((subject, protocol), tracked) in &measured.tracked {
        let methods = tracked.methods.iter().map(|(name, method)| (name.as_str(), in_numbers(method))).collect();
        results.tracking.entry(subject).or_default().insert(protocol, methods);
    }
    std::fs::write(root.join("results/monocular.json"), serde_json::to_string_pretty(&results)? + "\n")?;
    std::fs::write(root.join("results/monocular.md"), page(measured, seeds))?;
    Ok(())
}

fn in_numbers(method: &Method) -> InNumbers {
    InNumbers {
        humaneva_mm: method.mean(ERROR),
        ci95: method.summary.metrics.get(ERROR).and_then(|m| m.ci95),
        by_seed: method.by_seed(ERROR),
        root_relative_mm: method.mean("mpjpe_root_mm"),
        energy_gap: method.mean("energy_gap"),
        track_loss: method.mean("track_loss"),
        models: method.models,
        brought_back: method.brought_back,
    }
}
