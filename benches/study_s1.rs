//! Tracking with learned motion models from one camera, after Tables 2 and 3 of `[GPDM graph]`: regenerates
//! `results/s1.md`, `results/s1.json` and `results/s1-MOTION.svg`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo bench --bench study_s1`, where DIR holds CMU's 49_01, frames 401 to 1100 of 14_14, 14_24 and their
//! skeletons. Ten seeds, or as many as `SKIAGRAPH_SEEDS` says. Without DIR nothing is written.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use faer::Mat;
use rayon::prelude::*;
use serde::Serialize;
use skiagraph::body::{Markers, Pose};
use skiagraph::evaluation::{Interval, Sequence};
use skiagraph::experiment::{Compared, Destination, MethodRecord, Models, Staged, Unwatched, compare};
use skiagraph::motion_model::gpdm_graph::{GpdmGraph, GraphSettings};
use skiagraph::motion_model::pose_chart::PlanarRoot;
use skiagraph::report::error_plot;
use skiagraph::report::plots::Size;
use skiagraph::scenario::ScenarioFile;

/// Motion; from `[GPDM graph]` the reconstruction error of the graph relative to the single GPDM (Fig. 3), %, and Table
/// 3, mm.
const MOTIONS: [(&str, f64, [f64; 3]); 3] = [
    ("walking", 9.7, [44.16, 56.09, 40.88]),
    ("jogging", 61.5, [57.21, 57.55, 53.26]),
    ("gesture", 2.5, [17.80, 16.33, 13.23]),
];
/// The tracker's body: heading of its tables, suffix of its pictures and directories, override of the scenario. The
/// subject of `[GPDM graph]` came with measured limbs; `none` gives the tracker's body those lengths and keeps its
/// geometry.
const BODIES: [(&str, &str, &str); 2] = [
    ("a body with wrong measures", "", "tracker_body.mismatch=standard"),
    ("the subject's measures known", "-subject-measures", "tracker_body.mismatch=none"),
];
/// The methods of which the competitor's row is the best.
const SWITCHING: [&str; 3] = ["switching_p01", "switching_p05", "switching_p20"];

#[derive(Default, Serialize)]
struct Results {
    reconstruction: BTreeMap<String, Reconstruction>,
    tracking_mm: BTreeMap<String, BTreeMap<String, Error3d>>,
    /// As `tracking_mm`, with known lengths of the subject's limbs.
    tracking_subject_measures_mm: BTreeMap<String, BTreeMap<String, Error3d>>,
    /// HumanEva error of the best latent point of every frame at the true root, mm: a lower bound for particles on the
    /// manifold.
    best_latent_mm: BTreeMap<String, BestLatent>,
}

#[derive(Serialize)]
struct BestLatent {
    single: f64,
    graph: f64,
}

/// One motion tracked with one body by all methods.
struct Study {
    motion: &'static str,
    /// Its name in [`BODIES`].
    body: &'static str,
    suffix: &'static str,
    /// Description of both bodies, as in reports.
    bodies: String,
    done: Compared,
}

/// Mean distance between recording and simulation (`[GPDM graph]`, Eq. 9), rad^2 over all joints.
#[derive(Serialize)]
struct Reconstruction {
    single: f64,
    graph: f64,
    models: usize,
    frames: usize,
    seconds: f64,
}

#[derive(Clone, Serialize)]
struct Error3d {
    mean: f64,
    ci95: Option<[f64; 2]>,
    seeds: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!(
            "SKIPPED: set SKIAGRAPH_MOCAP to a directory with CMU's 49_01.amc, 14_14_f0401-1100.amc, 14_24.amc and \
            skeletons"
        );
        return Ok(());
    };
    let seeds: u32 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(10), |n| n.parse())?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut results = Results::default();
    let mut compared = Vec::new();
    for (motion, ..) in MOTIONS {
        let path = root.join(format!("scenarios/s1/{motion}.toml"));
        for (body, suffix, mismatch) in BODIES {
            let file = ScenarioFile::open(&path, &[format!("seeds={seeds}"), mismatch.to_owned()])?;
            let staged = Staged::new(&file, Some(&mocap))?;
            let standard = suffix.is_empty();
            if standard {
                let (reconstruction, best_latent) = learned(&staged)?;
                results.reconstruction.insert(motion.to_owned(), reconstruction);
                results.best_latent_mm.insert(motion.to_owned(), best_latent);
            }
            let out = root.join("runs/s1").join(format!("{motion}{suffix}"));
            let done = compare(&file, Some(&mocap), Destination { path: &out, force: false }, &Unwatched)?;
            let errors = errors(&done);
            for (name, e) in &errors {
                eprintln!("{motion}, {body}, {name}: {:.1} mm", e.mean);
            }
            let tracking = if standard { &mut results.tracking_mm } else { &mut results.tracking_subject_measures_mm };
            tracking.insert(motion.to_owned(), errors);
            compared.push(Study { motion, body, suffix, bodies: staged.facts.mismatch, done });
        }
    }
    let folder = root.join("results");
    for Study { motion, suffix, done, .. } in &compared {
        let plot = error_plot(&done.methods).svg(Size { width: 1000, height: 420 })?;
        std::fs::write(folder.join(format!("s1-{motion}{suffix}.svg")), plot.standalone())?;
    }
    std::fs::write(folder.join("s1.json"), serde_json::to_string_pretty(&results)? + "\n")?;
    std::fs::write(folder.join("s1.md"), page(&results, &compared, seeds))?;
    Ok(())
}

/// Errors of every method; `switching` is the best of the three probabilities.
fn errors(done: &Compared) -> BTreeMap<String, Error3d> {
    let mut errors: BTreeMap<String, Error3d> =
        done.comparison.methods.iter().filter_map(|(name, m)| Some((name.clone(), error(m)?))).collect();
    let kindest = SWITCHING.iter().filter_map(|name| errors.get(*name)).min_by(|a, b| a.mean.total_cmp(&b.mean));
    if let Some(kindest) = kindest.cloned() {
        errors.insert("switching".to_owned(), kindest);
    }
    errors
}

fn learned(staged: &Staged) -> Result<(Reconstruction, BestLatent), Box<dyn Error>> {
    let start = &staged.start;
    let begin = Instant::now();
    let learn = |single| {
        let settings = GraphSettings { single, ..GraphSettings::default() };
        Models::default().learn(&settings, &start.body, &start.training, &Unwatched)
    };
    let (single, graph) = (learn(true)?, learn(false)?);
    let reconstruction = Reconstruction {
        single: single.mean_reconstruction_error(),
        graph: graph.mean_reconstruction_error(),
        models: graph.segments.len(),
        frames: start.training.frames(),
        seconds: begin.elapsed().as_secs_f64(),
    };
    Ok((reconstruction, BestLatent { single: best_latent(staged, &single), graph: best_latent(staged, &graph) }))
}

/// Mean over frames of the least error that a latent point of `models` has at the true root: from the three best training
/// latents of every model, down the true error along the axes, steps from a tenth of the latents' spread to a thousandth.
fn best_latent(staged: &Staged, models: &GpdmGraph) -> f64 {
    let body = &staged.start.body;
    let frames: Vec<usize> = (1..staged.frames()).collect();
    let of_frame = |&frame: &usize| {
        let (truth, root) = (&staged.ground_truth.frames[frame].markers, staged.refitted.poses[frame].world_from_root);
        let error = |segment: usize, latent: &[f64]| {
            let point = Mat::from_fn(1, latent.len(), |_, c| latent[c]);
            let row = models.segments[segment].gpdm.map_mean(point.as_ref());
            let observation: Vec<f64> = row.row(0).iter().copied().collect();
            let pose = models.chart.place(&observation, &PlanarRoot { x: 0.0, y: 0.0, yaw: 0.0 });
            let mut pose = Pose { world_from_root: root, ..pose };
            body.clamp_to_limits(&mut pose);
            mean_error(truth, &body.markers(&body.link_frames(&pose)))
        };
        let of_model = |segment: usize| {
            let gpdm = &models.segments[segment].gpdm;
            let latents =
                (0..gpdm.latents().nrows()).map(|i| gpdm.latents().row(i).iter().copied().collect::<Vec<f64>>());
            let mut starts: Vec<(f64, Vec<f64>)> = latents.map(|z| (error(segment, &z), z)).collect();
            starts.sort_by(|a, b| a.0.total_cmp(&b.0));
            let spread = gpdm.latent_spread();
            let descend = |(start, z): (f64, Vec<f64>)| descended(&|z| error(segment, z), start, z, spread);
            starts.into_iter().take(3).map(descend).fold(f64::INFINITY, f64::min)
        };
        (0..models.segments.len()).map(of_model).fold(f64::INFINITY, f64::min)
    };
    let errors: Vec<f64> = frames.par_iter().map(of_frame).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// The least value that pattern search finds from `z`, where `error` is `least`.
fn descended(error: &dyn Fn(&[f64]) -> f64, mut least: f64, mut z: Vec<f64>, spread: f64) -> f64 {
    let mut step = 0.1 * spread;
    while step > 1e-3 * spread {
        let before = least;
        for (axis, sign) in (0..z.len()).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let mut near = z.clone();
            near[axis] += sign * step;
            let found = error(&near);
            if found < least {
                (least, z) = (found, near);
            }
        }
        if least == before {
            step *= 0.5;
        }
    }
    least
}

/// HumanEva error, mm.
fn mean_error(truth: &Markers, estimate: &Markers) -> f64 {
    let pair = Sequence::of_markers(60.0, std::slice::from_ref(truth), std::slice::from_ref(estimate));
    let distances: Vec<f64> = pair.distances_mm(0).collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}

fn error(method: &MethodRecord) -> Option<Error3d> {
    let error = method.summary.metrics.get("humaneva_mm")?;
    let ci95 = error.ci95.map(|Interval { low, high }| [low, high]);
    Some(Error3d { mean: error.mean, ci95, seeds: method.summary.runs.len() })
}

fn page(results: &Results, compared: &[Study], seeds: u32) -> String {
    let mut text = format!(
        "# Learned motion models, one camera\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} SKIAGRAPH_MOCAP=DIR cargo bench --bench study_s1`; all digits are in `s1.json`. {seeds} seeds. \
         The scenarios are `scenarios/s1/*.toml`: CMU recordings instead of HumanEva's, resampled to 60 Hz, separate \
         training and test frames, clean silhouettes. The figures of [GPDM graph] are listed for reference only: \
         subject, recording and images differ.\n\n\
         ## Learning ([GPDM graph], Fig. 3)\n\n\
         Mean distance between recording and simulation (Eq. 9), rad^2 over all joints of the tracker's body.\n\n\
         | motion | training frames | models of the graph | single GPDM | graph | graph / single | [GPDM graph] | \
         learning both, s |\n\
         |---|---|---|---|---|---|---|---|\n"
    );
    for (motion, paper, _) in MOTIONS {
        if let Some(r) = results.reconstruction.get(motion) {
            text += &format!(
                "| {motion} | {} | {} | {:.4} | {:.4} | **{:.1} %** | {paper} % | {:.1} |\n",
                r.frames,
                r.models,
                r.single,
                r.graph,
                100.0 * r.graph / r.single,
                r.seconds
            );
        }
    }
    text += "\n## Tracking ([GPDM graph], Table 3)\n\nHumanEva error, mm, mean over seeds and 95 % interval. `graph`, \
        `original` and `switching_*` have 1000 \
             particles and one layer; `graph_annealed` is the graph with 5 layers of 200; `apf` has 5 layers of 200 \
             and no learned model except its proposal. `nearest_training_pose` and \
             `truth_refitted` use ground truth, and `frozen` never moves: they are references.\n\n\
             Every motion is tracked twice: with a body whose lengths are up to 3 % and girths up to 10 % wrong (standard mismatch: the \
             scenarios as they are), and with known lengths of the subject's segments, as [GPDM graph] had them from \
             HumanEva (`tracker_body.mismatch = \
             \"none\"`; the actor is another robot with other geometry and joints, so silhouettes still do not match \
                 exactly).\n\n";
    for Study { motion, body, suffix, bodies, done } in compared {
        let s1 = MOTIONS.iter().find(|m| m.0 == *motion).map_or([f64::NAN; 3], |m| m.2);
        text += &format!(
            "### {motion}, {body}\n\nBodies: {bodies}. {} test frames. [GPDM graph]: original {}, switching {}, graph \
            {}.\n\n\
             | method | error, mm | 95 % interval | root-relative, mm | energy gap | frames lost | models | particles \
             reset |\n\
             |---|---|---|---|---|---|---|---|\n",
            done.comparison.frames, s1[0], s1[1], s1[2]
        );
        for (name, method) in &done.comparison.methods {
            text += &row(name, method);
        }
        if let Some(best) = results.best_latent_mm.get(*motion).filter(|_| suffix.is_empty()) {
            text += &format!(
                "\nBest latent point of every frame at the true root: {:.1} mm on the single GPDM, {:.1} mm on the \
                graph's models.\n",
                best.single, best.graph
            );
        }
        text += &format!("\n![Error of every method over the frames of {motion}, {body}](s1-{motion}{suffix}.svg)\n\n");
    }
    text + "In `s1.json`, `switching` is the best of the three probabilities.\n"
}

fn row(name: &str, method: &MethodRecord) -> String {
    let mean = |metric: &str, digits: usize| {
        method.summary.metrics.get(metric).map_or_else(|| "-".to_owned(), |m| format!("{:.digits$}", m.mean))
    };
    let ends = error(method).and_then(|e| e.ci95).map_or("-".to_owned(), |[l, h]| format!("{l:.1} to {h:.1}"));
    let models = method.models.map_or("-".to_owned(), |n| n.to_string());
    format!(
        "| {name} | **{}** | {ends} | {} | {} | {} | {models} | {} |\n",
        mean("humaneva_mm", 1),
        mean("mpjpe_root_mm", 1),
        mean("energy_gap", 4),
        mean("track_loss", 3),
        method.recovered_particles,
    )
}
