//! A skin against capsules as the tracker's body: regenerates `results/skin.md` and `results/skin.json`.
//!
//! `cargo run --release --example studies -- skin`. Five seeds, or as many as `SKIAGRAPH_SEEDS` says; needs no files.
//! About a quarter of an hour on an idle core.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use serde::Serialize;
use skiagraph::evaluation::Interval;
use skiagraph::experiment::{Destination, Unwatched, run};
use skiagraph::scenario::ScenarioFile;

const SCENARIO: &str = "scenarios/skins/walk.toml";

/// The tracker's robot, skin (empty for capsules) and mismatch, with the row's title.
const BODIES: [(&str, &str, &str, &str); 7] = [
    ("actor's own body and skin (matched)", "actor", "person", "none"),
    ("capsules, lengths known", "tracker25", "", "none"),
    ("skin of 1,000 triangles, lengths known", "tracker25", "person_coarse", "none"),
    ("skin of 5,000 triangles, lengths known", "tracker25", "person", "none"),
    ("capsules, standard mismatch", "tracker25", "", "standard"),
    ("skin of 1,000 triangles, standard mismatch", "tracker25", "person_coarse", "standard"),
    ("skin of 5,000 triangles, standard mismatch", "tracker25", "person", "standard"),
];

/// Metric, its title in the table, digits.
const COLUMNS: [(&str, &str, usize); 4] = [
    ("humaneva_mm", "error, mm", 1),
    ("silhouette_iou", "IoU of the estimate", 3),
    ("energy_gap", "energy gap", 4),
    ("body_orientation_deg", "body orientation, degrees", 1),
];

/// Of one metric.
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
    let mut frames = 0;
    for (title, robot, skin, mismatch) in BODIES {
        let mut overrides = vec![
            format!("seeds={seeds}"),
            format!("tracker_body.robot={robot}"),
            format!("tracker_body.mismatch={mismatch}"),
        ];
        if !skin.is_empty() {
            overrides.push(format!("tracker_body.skin={skin}"));
        }
        let file = ScenarioFile::open(&root.join(SCENARIO), &overrides)?;
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        let out = root.join("runs/skin").join(title.chars().map(plain).collect::<String>());
        let record = run(&file, None, Destination { path: &out, force: true }, &Unwatched)?.record;
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
    std::fs::write(folder.join("skin.json"), serde_json::to_string_pretty(&results)? + "\n")?;
    std::fs::write(folder.join("skin.md"), page(&results, seeds, frames))?;
    Ok(())
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

fn page(results: &BTreeMap<String, BTreeMap<String, Value>>, seeds: u32, frames: usize) -> String {
    let mut text = format!(
        "# A skin against capsules as the tracker's body\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} cargo run --release --example studies -- skin`; all digits, seed by seed, are in \
         `skin.json`. `{SCENARIO}`: the built-in walk, {frames} frames at 60 Hz with planted feet, performed by `actor` in \
         the skin `person` (5,000 triangles) before four cameras of 320 x 240 pixels, clean silhouettes, the annealed \
         particle filter with its defaults. [Skinned APF] (section 4, figure 4) claims that a skinned body matches \
         silhouettes better than cylinders. Means over frames and {seeds} seeds, with 95 % intervals over the seeds.\n\n| \
         tracker's body | "
    );
    text += &COLUMNS.map(|(_, title, _)| title).join(" | ");
    text += " |\n|---|---|---|---|---|\n";
    for (title, ..) in BODIES {
        let values = results.get(title).map(row).unwrap_or_default();
        text += &format!("| {title} | {values} |\n");
    }
    text += "\nThe energy gap is the energy of the estimate less that of the true pose on the tracker's body: below 0, the \
             tracker found a pose that fits the silhouettes better than the true one.\n";
    text
}
