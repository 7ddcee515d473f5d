//! Studies: long measurements, each of which regenerates a page of `results/`.
//!
//! ```sh
//! cargo run --release --example studies                  # lists them
//! cargo run --release --example studies -- intervals     # runs one
//! ```
//!
//! A study is a function `study` in its own file, whose comment states what it needs, how long it takes, and what it
//! writes. The longest ones keep what they have measured under `runs/`, and continue after an interruption.

mod apf;
mod background;
mod contact;
mod degradation;
mod error_shapes;
mod gate;
mod hints;
mod interval_rules;
mod intervals;
mod monocular;
mod plausibility;
mod scoring;
mod search;
mod simulation;
mod skin;
mod skinned_body;
mod tune_monocular;

use std::error::Error;
use std::path::Path;
use std::process::{Command, ExitCode};

/// The commit with which the measurements in this folder were begun.
pub(crate) fn commit(folder: &Path) -> Result<String, Box<dyn Error>> {
    let path = folder.join("commit");
    if let Ok(kept) = std::fs::read_to_string(&path) {
        return Ok(kept.trim().to_owned());
    }
    let git = Command::new("git").args(["rev-parse", "--short=8", "HEAD"]).output()?;
    let commit = String::from_utf8(git.stdout)?.trim().to_owned();
    std::fs::create_dir_all(folder)?;
    std::fs::write(&path, &commit)?;
    Ok(commit)
}

type Study = fn() -> Result<(), Box<dyn Error>>;

/// Name, what it measures, and the study.
const STUDIES: [(&str, &str, Study); 15] = [
    ("apf", "the annealed particle filter as printed: results/apf.md", apf::study),
    ("background", "background subtraction compared with OpenCV: results/background.md", background::study),
    (
        "contact",
        "stances and planted feet of real walks at three rates: the tables of results/contact.md",
        contact::study,
    ),
    ("degradation", "trackers on corrupted observations: results/degradation.md", degradation::study),
    ("gate", "reliability of the regression gate: results/gate.md", gate::study),
    ("hints", "false alarms that a run was misread: results/hints.md", hints::study),
    ("intervals", "coverage of 95 % intervals: results/intervals.md", intervals::study),
    ("plausibility", "ground and self-penetration in the energy: results/plausibility.md", plausibility::study),
    ("monocular", "learned motion models with one camera: results/monocular.md", monocular::study),
    ("scoring", "how long a million frames take to score; prints only", scoring::study),
    ("search", "refinement and calibration of the annealed particle filter: results/search.md", search::study),
    ("simulation", "simulated recordings that stay upright: results/simulation.md", simulation::study),
    (
        "skinned_body",
        "a skin compared with capsules on a long walk in segmented images: results/skinned-body.md",
        skinned_body::study,
    ),
    ("skin", "a skin compared with capsules as the tracker's body: results/skin.md", skin::study),
    (
        "tune_monocular",
        "settings of learned motion models, tried on recordings that are not reported; prints only",
        tune_monocular::study,
    ),
];

fn main() -> ExitCode {
    let asked = std::env::args().nth(1);
    let found = STUDIES.iter().find(|(name, ..)| Some(*name) == asked.as_deref());
    let Some((_, _, study)) = found else {
        if let Some(asked) = &asked {
            eprintln!("error: there is no study `{asked}`");
        }
        STUDIES.iter().for_each(|(name, what, _)| println!("{name:14} {what}"));
        return if asked.is_some() { ExitCode::from(2) } else { ExitCode::SUCCESS };
    };
    match study() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
