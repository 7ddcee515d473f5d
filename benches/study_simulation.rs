//! How long simulated walks stay up, and with how much help: regenerates `results/simulation.md` and `results/simulation.json`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo bench --bench study_simulation`, where DIR (or `DIR/cmu_asf_amc`) holds CMU's walks and their
//! skeletons. Nothing in it is random. Without DIR nothing is written.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;
use skiagraph::body::retarget::{RetargetOptions, Retargeted, retarget};
use skiagraph::body::shipped;
use skiagraph::contact::{SimulationReport, SimulationSettings, simulate};
use skiagraph::mocap::{ReadOptions, read};

const WALKS: [&str; 6] = ["49_01", "16_15", "16_17", "16_22", "35_02", "02_01"];
/// Motions on which the control was worked out.
const CHOSEN_ON: [&str; 4] = ["humanoid3d_walk", "49_01", "16_15", "16_22"];
/// Bounds of the residual root wrench, body weights.
const BOUNDS: [f64; 4] = [0.2, 0.1, 0.05, 0.0];
/// No more of a recording, frames at 60 a second.
const LONGEST: usize = 601;

#[derive(Serialize)]
struct Outcome {
    motion: String,
    /// Whether the control was worked out on it.
    chosen_on: bool,
    bound_percent: f64,
    duration_s: f64,
    /// `null` if it stayed up.
    fell_at_s: Option<f64>,
    root_wrench_percent_mean: f64,
    root_wrench_percent_most: f64,
    skate_mm_per_s: f64,
    joints_moved_mm_mean: f64,
    joints_moved_mm_most: f64,
    /// What the simulation took on this machine, settling included.
    running_s: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a folder with CMU's {} and their .asf files", WALKS.join(", "));
        return Ok(());
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut clips = vec![(root.join("scenarios/motions/humanoid3d_walk.txt"), Some(5.0))];
    clips.extend(WALKS.iter().map(|name| (find(&mocap, &format!("{name}.amc")), None)));
    let mut outcomes = Vec::new();
    for (path, loop_to_s) in clips {
        let performed = performed(&path, loop_to_s)?;
        for bound in BOUNDS {
            let settings = SimulationSettings { root_wrench: bound, ..SimulationSettings::default() };
            let start = Instant::now();
            let report = simulate(&performed.humanoid, &performed.motion, &settings)?.report;
            let running_s = start.elapsed().as_secs_f64();
            let motion = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            eprintln!("{motion}, bound {bound}: {report}");
            outcomes.push(outcome(motion, bound, &report, running_s));
        }
    }
    let folder = root.join("results");
    std::fs::write(folder.join("simulation.json"), serde_json::to_string_pretty(&outcomes)? + "\n")?;
    std::fs::write(folder.join("simulation.md"), page(&outcomes)?)?;
    Ok(())
}

fn find(folder: &Path, name: &str) -> PathBuf {
    let below = folder.join("cmu_asf_amc").join(name);
    if below.exists() { below } else { folder.join(name) }
}

/// A recording on the actor at 60 frames a second.
fn performed(path: &Path, loop_to_s: Option<f64>) -> Result<Retargeted, Box<dyn Error>> {
    let mut clip = read(path, &ReadOptions::default())?.without_inserted_rest_pose();
    if let Some(seconds) = loop_to_s {
        clip = clip.looped(seconds)?;
    }
    let mut found = retarget(&clip, &shipped("actor")?, &RetargetOptions::default())?;
    found.motion = found.motion.resampled(&found.humanoid, 60.0).ok_or("a motion without poses")?;
    found.motion.poses.truncate(LONGEST);
    Ok(found)
}

fn outcome(motion: String, bound: f64, report: &SimulationReport, running_s: f64) -> Outcome {
    Outcome {
        chosen_on: CHOSEN_ON.contains(&motion.as_str()),
        motion,
        bound_percent: 100.0 * bound,
        duration_s: report.duration_s,
        fell_at_s: report.fell_at_s,
        root_wrench_percent_mean: 100.0 * report.root_wrench_mean,
        root_wrench_percent_most: 100.0 * report.root_wrench_most,
        skate_mm_per_s: report.quality.skate_mm_per_s,
        joints_moved_mm_mean: report.moved_mm,
        joints_moved_mm_most: report.moved_most_mm,
        running_s,
    }
}

fn page(outcomes: &[Outcome]) -> Result<String, std::fmt::Error> {
    let mut page = String::from(
        "# Walks that happen\n\n\
         Made by `SKIAGRAPH_MOCAP=DIR cargo bench --bench study_simulation`; all digits are in `simulation.json`. What `[actor] contact = \
         \"simulate\"` makes of recordings on the `actor`, at 60 frames a second (480 steps a second), friction 0.8; the walk of \
         DeepMimic is repeated to 5 s. Nothing in it is random. The residual root wrench is the norm of its force and of its moment \
         over the height of the centre of mass at the start, in % of body weight; it never exceeds its bound. Joints are compared with the \
         recording, not with the settled motion. A body has fallen when its centre of mass is below three quarters of the motion's; the \
         figures go on after a fall. The control was worked out on the motions with a star, which therefore are no test of it; the others were \
         run for this table only. The last column is what a simulation took on two cores that others used too, settling included. What was \
         learned stands in `contact.md`.\n\n\
         | motion | bound % | kept up s | residual root wrench % (mean, most) | skate mm/s | joints from the recording mm (mean, most) | running s |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for o in outcomes {
        writeln!(
            page,
            "| {}{} | {:.0} | {} | {:.1}, {:.1} | {:.1} | {:.1}, {:.1} | {:.1} |",
            o.motion,
            if o.chosen_on { " *" } else { "" },
            o.bound_percent,
            kept_up(o),
            o.root_wrench_percent_mean,
            o.root_wrench_percent_most,
            o.skate_mm_per_s,
            o.joints_moved_mm_mean,
            o.joints_moved_mm_most,
            o.running_s
        )?;
    }
    Ok(page)
}

fn kept_up(o: &Outcome) -> String {
    match o.fell_at_s {
        Some(at) => format!("{at:.2} of {:.2}, fell", o.duration_s),
        None => format!("**{0:.2}** of {0:.2}", o.duration_s),
    }
}
