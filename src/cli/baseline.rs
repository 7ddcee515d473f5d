//! `skiagraph baseline`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use super::caller::print_written;
use super::folders::expect_run;
use super::summary::partly_covered;
use super::volume::Volume;
use super::{CommandError, output};
use crate::gating::{BASELINES, Baseline};
use skiagraph_eval::{METRICS, MeasuredClip, describe_seeds, mean};

/// Save, list and show baselines for skiagraph gate
///
/// A baseline is a small file to commit to version control: the values of every metric per clip, noise draw and seed,
/// with set hashes, protocols, settings and versions.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph baseline save walk runs/walk\n  skiagraph baseline list\n  \
                        skiagraph baseline show walk\n  skiagraph baseline show walk --json")]
pub(super) struct Arguments {
    #[command(subcommand)]
    action: BaselineAction,

    /// Directory of baselines
    #[arg(long, global = true, value_name = "DIR", default_value = BASELINES)]
    baselines: PathBuf,
}

#[derive(Subcommand, Debug)]
enum BaselineAction {
    /// Save measured runs as a baseline, replacing an existing baseline of that name
    #[command(
        after_help = "Examples:\n  skiagraph baseline save walk runs/walk\n  skiagraph baseline save all runs\n  \
                            skiagraph baseline save mine runs/mine-draw-1 runs/mine-draw-2 runs/mine-draw-3 runs/mine-draw-4 \
                            runs/mine-draw-5"
    )]
    Save {
        /// Name of the baseline: letters, digits, dots, - and _
        #[arg(value_name = "NAME")]
        name: String,
        /// Run directories, or directories that contain runs, with at least 5 seeds per set, 5 noise draws per clip, or
        /// 5 clips
        #[arg(value_name = "RUN", required = true)]
        runs: Vec<PathBuf>,
        /// Rename an existing file to NAME.json~ if skiagraph did not write it
        #[arg(long)]
        force: bool,
    },
    /// List all baselines
    #[command(after_help = "Examples:\n  skiagraph baseline list")]
    List {
        /// Print one JSON object instead of a table
        #[arg(long)]
        json: bool,
    },
    /// Show the values of a baseline
    #[command(after_help = "Examples:\n  skiagraph baseline show walk")]
    Show {
        /// Name of the baseline, or its .json file
        #[arg(value_name = "NAME")]
        name: String,
        /// Print the baseline itself
        #[arg(long)]
        json: bool,
    },
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let folder = &arguments.baselines;
    match &arguments.action {
        BaselineAction::Save { name, runs, force } => {
            runs.iter().try_for_each(|run| expect_run(run))?;
            let saved = Baseline::save(name, runs, folder, *force)?;
            volume.written(&saved.path);
            let before = saved.replaced.as_ref().and_then(|old| old.runs.mean_of("humaneva_mm"));
            let before = before.map(|error| format!(" (was {error:.1})")).unwrap_or_default();
            output::print(&format!(
                "{}{}: {}{before}",
                misread_warnings(&saved.baseline),
                saved.path.display(),
                summary_line(&saved.baseline)
            ))?;
            print_written(&saved.path, &[]);
        }
        BaselineAction::List { json } => list(folder, *json)?,
        BaselineAction::Show { name, json: true } => output::print_json(&Baseline::read(name, folder)?)?,
        BaselineAction::Show { name, json: false } => output::print(&describe(&Baseline::read(name, folder)?))?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Warnings about estimates that may have been misread; they precede the values.
fn misread_warnings(baseline: &Baseline) -> String {
    baseline.misread.iter().map(|hint| format!("The estimate may have been misread: {hint}.\n\n")).collect()
}

fn list(folder: &std::path::Path, json: bool) -> Result<(), CommandError> {
    let all = Baseline::list(folder)?;
    if json {
        let readable: Vec<Baseline> = all.into_iter().filter_map(|(_, baseline)| baseline.ok()).collect();
        return Ok(output::print_json(&serde_json::json!({
            "schema": "skiagraph.baselines/1", "baselines": readable,
        }))?);
    }
    if all.is_empty() {
        return Ok(output::print(&format!("no baselines in {}", folder.display()))?);
    }
    for (name, baseline) in all {
        match baseline {
            Ok(baseline) => output::print(&format!("{name:<24} {}", summary_line(&baseline)))?,
            Err(error) => output::print(&format!("{name:<24} cannot be read: {error}"))?,
        }
    }
    Ok(())
}

/// `walk (seeds 0 to 9), annealed_particle_filter, version 0.1.0, 31.2 mm`
fn summary_line(baseline: &Baseline) -> String {
    let of_clip = |(name, clip): (&String, &MeasuredClip)| {
        let draws = match baseline.runs.sets_of(name).len() {
            1 => String::new(),
            draws => format!("{draws} draws, "),
        };
        format!("{name} ({draws}seeds {})", describe_seeds(&clip.seeds))
    };
    let clips: Vec<String> = baseline.runs.clips.iter().map(of_clip).collect();
    let mut trackers: Vec<&str> = baseline.runs.clips.values().map(|clip| clip.tracker.as_str()).collect();
    trackers.dedup();
    let error = baseline.runs.mean_of("humaneva_mm").map(|error| format!(", {error:.1} mm")).unwrap_or_default();
    let covered = baseline.runs.mean_of("coverage").filter(|share| *share < 1.0);
    let covered = covered.map(|share| format!("; {}", partly_covered(share))).unwrap_or_default();
    format!("{}, {}, version {}{error}{covered}", clips.join(", "), trackers.join(", "), baseline.version)
}

fn describe(baseline: &Baseline) -> String {
    let mut lines = vec![format!("{}{}: {}", misread_warnings(baseline), baseline.name, summary_line(baseline))];
    for (name, clip) in baseline.runs.sets() {
        lines.push(format!("\n{name}: {} frames at {} Hz, set {}", clip.frames, clip.frames_per_second, clip.set_hash));
        lines.push(format!("  {:<32} {:>12} {:>12} {:>12}  seeds", "", "mean", "min", "max"));
        for metric in METRICS {
            let values: Vec<f64> = clip.values(metric.name).into_iter().map(|(_, value)| value).collect();
            let Some(average) = mean(&values) else { continue };
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            lines.push(format!(
                "  {:<32} {average:>12.4} {least:>12.4} {greatest:>12.4}  {}",
                metric.name,
                values.len()
            ));
        }
    }
    lines.join("\n")
}
