//! What descent on outlines and the search for limbs find: regenerates `results/search.md` and `results/search.json`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- search`, where DIR holds the CMU takes that `takes.rs` names and
//! their skeletons. Five seeds, or as many as `SKIAGRAPH_SEEDS` says. What was measured is kept in
//! `runs/search/outcomes.jsonl`, so that a study that was stopped goes on where it was; remove that file after a change
//! of the program. With `SKIAGRAPH_TUNE=SETTINGS` the tuning takes are tracked with these settings (lines of
//! `[tracker.annealed_particle_filter]`, parted by `;`) in small pictures and printed, and nothing is written;
//! `SKIAGRAPH_TAKES` names some of them, `SKIAGRAPH_CONDITION` a condition. Without DIR nothing is run.

mod page;
mod spoiled;
mod takes;
mod units;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use page::Results;
use spoiled::Condition;
use units::{BODIES, Case, Ledger};

/// Name in the results, settings. The algorithm as printed, and what ships as the default.
const TRACKERS: [(&str, &str); 2] = [("paper", "paper = true"), ("refined", "")];
/// Frames at 60 Hz of the reported takes, and of those that are seen under stress.
const MOST_FRAMES: usize = 120;
const STRESS_FRAMES: usize = 60;
/// Takes that are seen under stress.
const STRESSED: [&str; 4] = ["49_01", "02_04", "16_36", "35_08"];
const SIZE_PX: [u32; 2] = [640, 480];

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a folder with CMU's takes and their .asf files");
        return Ok(());
    };
    let seeds: u32 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(5), |n| n.parse())?;
    if let Ok(settings) = std::env::var("SKIAGRAPH_TUNE") {
        return tune(&settings.replace(';', "\n"), seeds, &mocap);
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut ledger = Ledger::open(root.join("runs/search/outcomes.jsonl"))?;
    let mut results = Results::default();
    for take in &takes::REPORTED {
        for (bodies, _) in BODIES {
            let case = Case { take, bodies, condition: Condition::Clean, most_frames: MOST_FRAMES, size_px: SIZE_PX };
            let outcomes = case.outcomes(&TRACKERS, seeds, &mocap, &mut ledger)?;
            results.clean.entry(bodies.to_owned()).or_default().insert(take.name.to_owned(), outcomes);
        }
    }
    for condition in Condition::STRESS {
        for take in takes::REPORTED.iter().filter(|take| STRESSED.contains(&take.name)) {
            let case = Case { take, bodies: "matched", condition, most_frames: STRESS_FRAMES, size_px: SIZE_PX };
            let outcomes = case.outcomes(&TRACKERS, seeds, &mocap, &mut ledger)?;
            results.stress.entry(condition.name().to_owned()).or_default().insert(take.name.to_owned(), outcomes);
        }
    }
    let folder = root.join("results");
    std::fs::write(folder.join("search.json"), serde_json::to_string_pretty(&results)? + "\n")?;
    std::fs::write(folder.join("search.md"), page::page(&results, seeds))?;
    Ok(())
}

/// The tuning takes in small pictures.
fn tune(settings: &str, seeds: u32, mocap: &Path) -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut ledger = Ledger::open(root.join("runs/search/tuning.jsonl"))?;
    let said = |name: &str| std::env::var(name).unwrap_or_default();
    let (wanted, condition) = (said("SKIAGRAPH_TAKES"), said("SKIAGRAPH_CONDITION"));
    let condition = Condition::STRESS.into_iter().find(|c| c.name() == condition).unwrap_or(Condition::Clean);
    let mut means: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (bodies, _) in BODIES {
        for take in takes::TUNING.iter().filter(|take| wanted.is_empty() || wanted.split(',').any(|w| w == take.name)) {
            let case = Case { take, bodies, condition, most_frames: MOST_FRAMES, size_px: [320, 240] };
            let outcome = &case.outcomes(&[("tuned", settings)], seeds, mocap, &mut ledger)?["tuned"];
            means.entry(bodies).or_default().push(units::mean(&outcome.humaneva_mm));
        }
    }
    for (bodies, errors) in means {
        eprintln!("{bodies}: mean {:.2} mm", units::mean(&errors));
    }
    Ok(())
}
