//! Tracking without and with the plausibility term: regenerates `results/plausibility.md` and
//! `results/plausibility.json`.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- plausibility`, where DIR holds CMU's 49_01 and 02_01
//! and their skeletons. Ten seeds, or as many as `SKIAGRAPH_SEEDS` says; with `SKIAGRAPH_TUNE=DIR`, where DIR holds
//! 16_15 and 35_02, the candidate weights of the default are run on those and printed, and nothing is written. Without
//! any DIR nothing is run.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use serde::Serialize;
use skiagraph::artefacts::Destination;
use skiagraph::common::NoProgress;
use skiagraph::evaluation::Interval;
use skiagraph::experiment::{MethodRecord, compare};
use skiagraph::scenario::ScenarioFile;

const SCENARIO: &str = "scenarios/plausibility/walk.toml";
/// Name in the results; clip, skeleton, last frame of the test, frames of the training.
const MOTIONS: [(&str, &str, &str, u32, [u32; 2]); 2] =
    [("CMU 49_01", "49_01", "49", 240, [481, 652]), ("CMU 02_01", "02_01", "02", 220, [221, 343])];
/// The same, for the recordings on which the default weight was chosen.
const TUNING: [(&str, &str, &str, u32, [u32; 2]); 2] =
    [("CMU 16_15", "16_15", "16", 180, [181, 300]), ("CMU 35_02", "35_02", "35", 180, [181, 300])];
const VIEWS: [usize; 2] = [4, 1];
/// Metric, its title in the table, digits.
const COLUMNS: [(&str, &str, usize); 7] = [
    ("humaneva_mm", "error, mm", 1),
    ("foot_skate_mm_per_s", "skate, mm/s", 0),
    ("ground_penetration_mm", "ground penetration, mm", 1),
    ("foot_float_mm", "float in stance, mm", 1),
    ("self_penetration_mm", "self-penetration, mm", 1),
    ("contact_f1", "contact F1", 2),
    ("silhouette_iou", "IoU", 3),
];
const PLAIN: &str = "without";

/// Results of one metric and method.
#[derive(Clone, Serialize)]
struct Value {
    mean: f64,
    ci95: Option<[f64; 2]>,
    per_seed: Vec<Option<f64>>,
    /// Value of the ground truth, if the metric exists for it.
    truth: Option<f64>,
}

/// `[motion, views][method][metric]`.
type Results = BTreeMap<String, BTreeMap<String, BTreeMap<String, Value>>>;

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    if let Some(mocap) = std::env::var_os("SKIAGRAPH_TUNE").map(PathBuf::from) {
        return tune(root, &mocap);
    }
    let Some(mocap) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a directory with CMU's 49_01.amc, 02_01.amc and their .asf files");
        return Ok(());
    };
    let seeds: u32 = std::env::var("SKIAGRAPH_SEEDS").map_or(Ok(10), |n| n.parse())?;
    let mut results = Results::new();
    for motion in MOTIONS {
        for views in VIEWS {
            let name = format!("{}, {views} {}", motion.0, if views == 1 { "view" } else { "views" });
            results.insert(name.clone(), run(root, &name, &overrides(motion, views, seeds), &mocap)?);
        }
    }
    let folder = root.join("results");
    std::fs::write(folder.join("plausibility.json"), serde_json::to_string_pretty(&results)? + "\n")?;
    std::fs::write(folder.join("plausibility.md"), page(&results, seeds))?;
    Ok(())
}

fn run(
    root: &Path,
    name: &str,
    overrides: &[String],
    mocap: &Path,
) -> Result<BTreeMap<String, BTreeMap<String, Value>>, Box<dyn Error>> {
    let file = ScenarioFile::open(&root.join(SCENARIO), overrides)?;
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
    let out = root.join("runs/plausibility").join(name.chars().map(plain).collect::<String>());
    let done = compare(&file, Some(mocap), Destination { path: &out, force: true }, &NoProgress)?;
    let methods: BTreeMap<_, _> = done.comparison.methods.iter().map(|(n, m)| (n.clone(), values(m))).collect();
    for (method, values) in &methods {
        eprintln!("{name}, {method}: {}", COLUMNS.map(|(metric, title, n)| cell(values, metric, title, n)).join(", "));
    }
    Ok(methods)
}

fn cell(values: &BTreeMap<String, Value>, metric: &str, title: &str, digits: usize) -> String {
    values.get(metric).map_or_else(|| format!("{title} -"), |v| format!("{title} {:.digits$}", v.mean))
}

fn values(method: &MethodRecord) -> BTreeMap<String, Value> {
    let metrics = &method.summary.metrics;
    let value = |(name, ..): &(&str, &str, usize)| {
        let metric = metrics.get(*name)?;
        let value = Value {
            mean: metric.mean,
            ci95: metric.ci95.map(|Interval { low, high }| [low, high]),
            per_seed: metric.per_run.clone(),
            truth: metrics.get(&format!("truth_{name}")).map(|truth| truth.mean),
        };
        Some(((*name).to_owned(), value))
    };
    COLUMNS.iter().filter_map(value).collect()
}

/// The candidate weights of the default, on recordings that are not in the test.
fn tune(root: &Path, mocap: &Path) -> Result<(), Box<dyn Error>> {
    for motion in TUNING {
        for views in VIEWS {
            let mut overrides = overrides(motion, views, 3);
            for weight in ["0.5", "2", "8"] {
                let method = format!("methods.with_{}", weight.replace('.', "p"));
                overrides.push(format!("{method}.annealed_particle_filter.paper=true"));
                overrides.push(format!("{method}.annealed_particle_filter.plausibility.weight={weight}"));
            }
            run(root, &format!("tuning {} {views}", motion.0), &overrides, mocap)?;
        }
    }
    Ok(())
}

fn overrides(
    (_, clip, skeleton, last, training): (&str, &str, &str, u32, [u32; 2]),
    views: usize,
    seeds: u32,
) -> Vec<String> {
    let part = |[first, last]: [u32; 2]| {
        format!(
            "{{ clip = \"{clip}.amc\", skeleton = \"{skeleton}.asf\", source_hz = 120.0, first_frame = {first}, last_frame = {last} }}"
        )
    };
    vec![
        format!("motion={}", part([1, last])),
        format!("training.clips=[{}]", part(training)),
        format!("rig.ring.count={views}"),
        format!("seeds={seeds}"),
    ]
}

/// Least and greatest change of a metric by the term, over the settings whose name has this ending.
fn range(results: &Results, ending: &str, metric: &str, digits: usize) -> String {
    let settings = results.iter().filter(|(name, _)| name.ends_with(ending)).map(|(_, methods)| methods);
    let change = |methods: &BTreeMap<String, BTreeMap<String, Value>>| {
        let mean = |method: &str| methods.get(method).and_then(|values| values.get(metric)).map(|value| value.mean);
        Some(mean("with")? - mean(PLAIN)?)
    };
    let all: Vec<f64> = settings.filter_map(change).collect();
    let (low, high) = (all.iter().copied().reduce(f64::min), all.iter().copied().reduce(f64::max));
    format!("{:+.digits$} to {:+.digits$}", low.unwrap_or(f64::NAN), high.unwrap_or(f64::NAN))
}

fn page(results: &Results, seeds: u32) -> String {
    let mut text = format!(
        "# Tracking with the plausibility term\n\n\
         The plausibility term changes ground penetration by {} mm and self-penetration by {} mm (range over the settings below). With four \
         views, it changes the position error by {} mm; with one view, by {} mm. Foot skate changes by {} mm/s.\n\n\
         The term is off by default. Every cell is the mean over {seeds} seeds. *Change* is the change from *without* the term, with the \
         number of seeds whose value is lower. *With*: `plausibility = {{}}`, the default weight. *With rejection*: also `reject_beyond_m = 0.05`. Skate is the speed along the ground \
         of the lowest point of the estimate's foot during the actor's stances; ground and self-penetration are the greatest depth in a \
         frame, mean over frames.\n",
        range(results, "", "ground_penetration_mm", 1),
        range(results, "", "self_penetration_mm", 1),
        range(results, "4 views", "humaneva_mm", 1),
        range(results, "1 view", "humaneva_mm", 1),
        range(results, "", "foot_skate_mm_per_s", 0),
    );
    for (name, methods) in results {
        text += &format!("\n## {name}\n\n| method | {} |\n|---|", COLUMNS.map(|c| c.1).join(" | "));
        text += &"---|".repeat(COLUMNS.len());
        text.push('\n');
        let Some(plain) = methods.get(PLAIN) else { continue };
        text += &row("ground truth", |(metric, _, digits)| {
            plain.get(*metric).and_then(|v| v.truth).map_or("".to_owned(), |t| format!("{t:.digits$}"))
        });
        for method in [PLAIN, "with", "with_rejection"] {
            let Some(values) = methods.get(method) else { continue };
            text += &row(&method.replace('_', " "), |(metric, _, digits)| {
                values.get(*metric).map_or("-".to_owned(), |v| format!("{:.digits$}", v.mean))
            });
            if method != PLAIN {
                text += &row("change, seeds lower", |(metric, _, digits)| change(values, plain, metric, *digits));
            }
        }
    }
    text + &format!(
        "\n## Method\n\n\
         `{SCENARIO}` with two takes (49_01, frames 1 to 240; 02_01, frames 1 to 220; training on later frames of the take) at 60 Hz, \
         320 x 240 pixels, clean silhouettes, actor with planted feet (`contact = \"fix\"`), tracked as `tracker25` with the standard \
         mismatch, 200 particles x 5 layers, {seeds} seeds. All methods have the same observations and seeds.\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- plausibility`; all digits, for every \
         seed, are in `plausibility.json`.\n"
    )
}

fn row(name: &str, cell: impl Fn(&(&str, &str, usize)) -> String) -> String {
    format!("| {name} | {} |\n", COLUMNS.iter().map(cell).collect::<Vec<_>>().join(" | "))
}

fn change(values: &BTreeMap<String, Value>, plain: &BTreeMap<String, Value>, metric: &str, digits: usize) -> String {
    let (Some(with), Some(without)) = (values.get(metric), plain.get(metric)) else { return "-".to_owned() };
    let pairs = || with.per_seed.iter().zip(&without.per_seed).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    let lower = pairs().filter(|(a, b)| a < b).count();
    format!("{:+.digits$}, {lower} of {}", with.mean - without.mean, pairs().count())
}
