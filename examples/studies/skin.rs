//! A skin and capsules as the tracker's body: regenerates `results/skin.md` and `results/skin.json`.
//!
//! `cargo run --release --example studies -- skin`. Five seeds, or as many as `SKIAGRAPH_SEEDS` says; needs no files.
//! About a quarter of an hour on an idle core.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use serde::Serialize;
use skiagraph::artefacts::Destination;
use skiagraph::body::SilhouettePainter;
use skiagraph::common::NoProgress;
use skiagraph::evaluation::{Interval, ValueRange, intersection_over_union, mean_interval};
use skiagraph::experiment::run;
use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;

const SCENARIO: &str = "scenarios/skins/walk.toml";

/// The tracker's robot, skin (empty for capsules) and mismatch, with the row's title. Mismatched bodies are calibrated.
const BODIES: [(&str, &str, &str, &str); 7] = [
    ("actor's own body and skin (matched)", "actor", "person", "none"),
    ("capsules, lengths known", "tracker40", "", "none"),
    ("skin of 1,000 triangles, lengths known", "tracker40", "person_coarse", "none"),
    ("skin of 5,000 triangles, lengths known", "tracker40", "person", "none"),
    ("capsules, standard mismatch, calibrated", "tracker40", "", "standard"),
    ("skin of 1,000 triangles, standard mismatch, calibrated", "tracker40", "person_coarse", "standard"),
    ("skin of 5,000 triangles, standard mismatch, calibrated", "tracker40", "person", "standard"),
];

/// Metric, its title in the table, digits.
const COLUMNS: [(&str, &str, usize); 4] = [
    ("humaneva_mm", "error, mm", 1),
    ("silhouette_iou", "IoU of the estimate", 3),
    ("energy_gap", "energy gap", 4),
    ("body_orientation_deg", "body orientation, degrees", 1),
];

/// Number of frames whose overlap is listed.
const POSES: usize = 6;

/// Overlap of a tracker's body with the actor, in its pose nearest to the truth, mean over the cameras.
#[derive(Clone, Serialize)]
struct Overlap {
    mean: f64,
    least: f64,
    /// Frame and overlap of some poses, evenly over the motion.
    poses: Vec<(usize, f64)>,
}

/// Results of one metric.
#[derive(Clone, Serialize)]
struct Value {
    mean: f64,
    ci95: Option<[f64; 2]>,
    per_seed: Vec<Option<f64>>,
}

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let seeds: u32 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(5), |n| n.parse())?;
    let mut results: BTreeMap<String, BTreeMap<String, Value>> = BTreeMap::new();
    let mut overlaps = BTreeMap::new();
    let mut frames = 0;
    for (title, robot, skin, mismatch) in BODIES {
        let mut overrides = vec![
            format!("seeds={seeds}"),
            format!("tracker_body.robot={robot}"),
            format!("tracker_body.mismatch={mismatch}"),
            format!("tracker_body.calibrate={}", mismatch != "none"),
        ];
        if !skin.is_empty() {
            overrides.push(format!("tracker_body.skin={skin}"));
        }
        let file = ScenarioFile::open(&root.join(SCENARIO), &overrides)?;
        overlaps.insert(title.to_owned(), overlap(&file)?);
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        let out = root.join("runs/skin").join(title.chars().map(plain).collect::<String>());
        let record = run(&file, None, Destination { path: &out, force: true }, &NoProgress)?.record;
        frames = record.frames;
        let value = |(name, ..): &(&str, &str, usize)| {
            let metric = record.summary.metrics.get(*name)?;
            let ci95 = metric.ci95.map(|Interval { low, high }| [low, high]);
            Some(((*name).to_owned(), Value { mean: metric.mean, ci95, per_seed: metric.per_run.clone() }))
        };
        let values: BTreeMap<String, Value> = COLUMNS.iter().filter_map(value).collect();
        eprintln!("{title}: {}", row(&values));
        results.insert(title.to_owned(), values);
    }
    let folder = root.join("results");
    let whole = serde_json::json!({ "tracked": results, "overlap_of_the_true_pose": overlaps });
    std::fs::write(folder.join("skin.json"), serde_json::to_string_pretty(&whole)? + "\n")?;
    let commit = crate::commit(&root.join("runs/skin"))?;
    let text = page(&results, seeds) + &overlap_table(&overlaps) + &gains(&results) + &method(seeds, frames, &commit);
    std::fs::write(folder.join("skin.md"), text)?;
    Ok(())
}

/// The overlap of actor and tracker's body in the refitted true poses.
fn overlap(file: &ScenarioFile) -> Result<Overlap, Box<dyn Error>> {
    let prepared = PreparedScene::new(file, None)?;
    let (actor, body, cameras) = (&prepared.ground_truth.actor, &prepared.start.body, &prepared.rig.rig().cameras);
    let mut painters: Vec<SilhouettePainter> = cameras.iter().map(SilhouettePainter::new).collect();
    let motion = prepared.ground_truth.motion();
    let mut of_frame = |frame: usize| {
        let (own, believed) = (&motion.poses[frame], &prepared.refitted.poses[frame]);
        let (own, believed) = (actor.link_frames(own), body.link_frames(believed));
        let each = painters.iter_mut().filter_map(|painter| {
            intersection_over_union(&painter.silhouette(actor, &own), &painter.silhouette(body, &believed))
        });
        each.sum::<f64>() / cameras.len() as f64
    };
    let all: Vec<f64> = (0..motion.poses.len()).map(&mut of_frame).collect();
    let shown = (0..POSES).map(|i| i * (all.len() - 1) / (POSES - 1)).map(|frame| (frame, all[frame]));
    Ok(Overlap {
        mean: all.iter().sum::<f64>() / all.len() as f64,
        least: all.iter().copied().fold(1.0, f64::min),
        poses: shown.collect(),
    })
}

fn overlap_table(overlaps: &BTreeMap<String, Overlap>) -> String {
    let Some(any) = overlaps.values().next() else { return String::new() };
    let heads: Vec<String> = any.poses.iter().map(|(frame, _)| format!("frame {frame}")).collect();
    let mut text = format!(
        "\n## How well each body can match\n\n\
         After figure 4 of [Skinned APF]: intersection over union of the actor's silhouettes and those of the body as given, not calibrated, in the \
         pose whose markers are nearest to the true ones, mean over the four cameras.\n\n\
         | tracker's body | mean | least | {} |\n|---|---|---|{}\n",
        heads.join(" | "),
        "---|".repeat(heads.len())
    );
    for (title, ..) in BODIES {
        if let Some(found) = overlaps.get(title) {
            let poses: Vec<String> = found.poses.iter().map(|(_, overlap)| format!("{overlap:.3}")).collect();
            text += &format!("| {title} | {:.3} | {:.3} | {} |\n", found.mean, found.least, poses.join(" | "));
        }
    }
    text
}

/// Error reduction by skins compared with capsules, for each seed.
fn gains(results: &BTreeMap<String, BTreeMap<String, Value>>) -> String {
    let errors =
        |title: &str| results.get(title).and_then(|values| values.get("humaneva_mm")).map(|v| v.per_seed.clone());
    let mut text =
        "\n## Error reduction by a skin\n\nCompared with capsules of the same lengths, for each seed:\n\n".to_owned();
    for (skin, capsules) in [(2, 1), (3, 1), (5, 4), (6, 4)] {
        let (Some(with), Some(without)) = (errors(BODIES[skin].0), errors(BODIES[capsules].0)) else { continue };
        let each = without.iter().zip(&with).filter_map(|(a, b)| Some(((*a)? - (*b)?).to_owned()));
        let each: Vec<f64> = each.collect();
        let shown: Vec<String> = each.iter().map(|gain| format!("{gain:+.1}")).collect();
        let (mean, shown) = (each.iter().sum::<f64>() / each.len().max(1) as f64, shown.join(", "));
        let interval = mean_interval(&[each], ValueRange::Any)
            .map_or(String::new(), |(ends, _)| format!(", 95 % interval {:+.1} to {:+.1}", ends.low, ends.high));
        text += &format!("* {}: {mean:+.1} mm on average{interval} ({shown})\n", BODIES[skin].0);
    }
    text
}

fn row(values: &BTreeMap<String, Value>) -> String {
    let cell = |(metric, _, digits): &(&str, &str, usize)| {
        let Some(value) = values.get(*metric) else { return "-".to_owned() };
        let interval =
            value.ci95.map(|[low, high]| format!(" ({low:.digits$} to {high:.digits$})")).unwrap_or_default();
        format!("{:.digits$}{interval}", value.mean)
    };
    COLUMNS.iter().map(cell).collect::<Vec<_>>().join(" | ")
}

fn page(results: &BTreeMap<String, BTreeMap<String, Value>>, seeds: u32) -> String {
    let error = |body: usize| {
        let value = results.get(BODIES[body].0).and_then(|values| values.get("humaneva_mm"));
        value.map_or("-".to_owned(), |value| format!("{:.1} mm", value.mean))
    };
    let mut text = format!(
        "# A skin and capsules as the tracker's body\n\n\
         A skin as the tracker's body reduces the error: from {} with capsules to {} with a skin of 1,000 triangles if segment lengths are \
         known, and from {} to {} with the standard mismatch and calibration. With the actor's own body and skin the error is {}.\n\n\
         Means over frames and {seeds} seeds, with 95 % intervals over the seeds:\n\n| tracker's body | ",
        error(1),
        error(2),
        error(4),
        error(5),
        error(0),
    );
    text += &COLUMNS.map(|(_, title, _)| title).join(" | ");
    text += " |\n|---|---|---|---|---|\n";
    for (title, ..) in BODIES {
        let values = results.get(title).map(row).unwrap_or_default();
        text += &format!("| {title} | {values} |\n");
    }
    text += "\nThe energy gap is the energy of the true pose on the tracker's body minus that of the estimate. Above 0, the \
             estimate fits the silhouettes better than the true pose does; below 0, the search missed a better pose.\n";
    text
}

fn method(seeds: u32, frames: usize, commit: &str) -> String {
    format!(
        "\n## Method\n\n\
         `{SCENARIO}`: the built-in walk, {frames} frames at 60 Hz with planted feet, performed by `actor` with the skin `person` (5,000 \
         triangles), seen by four cameras of 320 x 240 pixels, with clean silhouettes and the annealed particle filter at its defaults \
         on `tracker40`. \
         [Skinned APF] (section 4, figure 4) claims that a skinned body matches silhouettes better than cylinders.\n\n\
         Made at commit {commit} by `SKIAGRAPH_SEEDS={seeds} cargo run --release --example studies -- skin`; all digits, for every seed, are in `skin.json`.\n"
    )
}
