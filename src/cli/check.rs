//! `skiagraph check`.

use std::io::Write;
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};

use super::scenario_arguments::ScenarioArguments;
use super::sweep::check_file;
use super::volume::{Volume, duration, size};
use super::{CommandError, output};
use crate::checking::{CheckReport, RunCost, check, unusable_files};
use crate::common::ExperimentError;
use crate::prepare::CameraView;
use crate::scenario::{ScenarioError, Survey};
use crate::sweep::SweepFile;
use skiagraph_core::body::DrawnShares;

/// Check a scenario: list every error, or estimate the cost of a run
///
/// If SCENARIO is a sweep file, counts its cells (one setting with one seed each) and estimates their time.
///
/// Reads every file that the scenario names, builds the scene, tests what each camera sees, and tracks for about a
/// second to estimate the run time.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph check scenarios/walk.toml\n  \
                        skiagraph check scenarios/cmu/walk4.toml --mocap-dir ~/cmu\n  \
                        skiagraph check scenarios/walk.toml rig.ring.count=2 --json")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let mocap = arguments.scenario.mocap_directory();
    if let Some(sweep) = arguments.scenario.file().filter(|path| SweepFile::is_one(path)) {
        return check_file(sweep, mocap, arguments.json);
    }
    let Survey { file, diagnostics } = arguments.scenario.survey()?;
    let mut errors: Vec<ExperimentError> =
        diagnostics.into_iter().map(|error| ScenarioError::from(error).into()).collect();
    if errors.is_empty() {
        errors.extend(file.as_ref().and_then(|file| arguments.scenario.repeated_key(file)));
    }
    match file {
        Some(file) if errors.is_empty() => match check(&file, mocap.as_deref()) {
            Ok(check_report) => return print_report(arguments, &file.origin, &check_report, volume),
            Err(found) => errors = found.into_iter().map(|error| error.about(&file.origin)).collect(),
        },
        Some(file) => errors.extend(unusable_files(&file, mocap.as_deref())),
        None => {}
    }
    if arguments.json {
        let errors: Vec<Value> = errors.iter().map(error_as_json).collect();
        output::print_json(&json!({ "schema": "skiagraph.check/1", "sound": false, "errors": errors }))?;
    } else {
        for error in &errors {
            writeln!(std::io::stderr(), "error: {error}").ok();
        }
    }
    Ok(ExitCode::from(2))
}

fn print_report(
    arguments: &Arguments,
    origin: &str,
    check_report: &CheckReport,
    volume: Volume,
) -> Result<ExitCode, CommandError> {
    if arguments.json {
        output::print_json(check_report)?;
    } else {
        output::print(&describe(origin, check_report))?;
        volume.notes(&check_report.notes);
    }
    Ok(ExitCode::SUCCESS)
}

fn error_as_json(error: &ExperimentError) -> Value {
    match error {
        ExperimentError::Scenario(ScenarioError::Unsound(complaint)) => json!({
            "file": complaint.origin,
            "line": complaint.place.as_ref().map(|place| place.line),
            "column": complaint.place.as_ref().map(|place| place.column),
            "key": complaint.key,
            "message": complaint.message,
        }),
        other => json!({ "message": other.to_string() }),
    }
}

fn describe(origin: &str, s: &CheckReport) -> String {
    let model = if s.matched { "matched" } else { "mismatched" };
    let cost = match s.likelihood_evaluations {
        0 => String::new(),
        n => format!(", {n} likelihood evaluations"),
    };
    let ([x0, y0], [x1, y1]) = (s.path.start_m, s.path.end_m);
    let ([low_x, low_y], [high_x, high_y]) = (s.path.least_m, s.path.greatest_m);
    let mut text = format!(
        "{origin} is valid\n  motion   {}: {} frames at {} Hz, {:.2} s; landmarks {:.1} mm from the recorded ones on average\n  \
         path     from ({x0:.2}, {y0:.2}) to ({x1:.2}, {y1:.2}) m, {:.2} m long; \
         x {low_x:.2} to {high_x:.2}, y {low_y:.2} to {high_y:.2} m\n  \
         bodies   actor {}, tracker {}: {model}\n  surface  actor {}; tracker {}\n  tracker  {}, {}{cost}",
        s.clip,
        s.frames,
        s.frames_per_second,
        s.duration_s,
        s.retarget_residual_mm,
        s.path.length_m,
        s.actor,
        s.tracker_body,
        describe_drawn(s.actor_drawn.as_ref()),
        describe_drawn(s.tracker_body_drawn.as_ref()),
        s.tracker,
        output::counted(s.seeds as usize, "seed"),
    );
    s.views.iter().for_each(|view| text.push_str(&describe_view(view)));
    text + &describe_cost(&s.cost)
}

fn describe_drawn(shares: Option<&DrawnShares>) -> String {
    shares.map_or("has a skin".to_owned(), |shares| format!("has solids on {}", shares.describe()))
}

fn describe_view(view: &CameraView) -> String {
    let seen = match view.height_px {
        None => "never sees the actor".to_owned(),
        Some([least, median, greatest]) => {
            format!(
                "in view in {:.0} % of the frames, {least} to {greatest} px high, median {median}",
                100.0 * view.in_view
            )
        }
    };
    let cut = if view.at_border > 0.0 {
        format!(", cut by the image border in {:.0} %", 100.0 * view.at_border)
    } else {
        String::new()
    };
    format!("\n  camera   {}: {seen}{cut}", view.camera)
}

fn describe_cost(cost: &RunCost) -> String {
    let threads = output::counted(cost.threads, "thread");
    let learning = match cost.models_to_learn {
        0 => String::new(),
        count => format!(", plus the time to learn motion models for {}", output::counted(count, "tracker")),
    };
    format!(
        "\n  cost     run: about {} on {threads} (reading {}, drawing {}, tracking {}, measuring {}){learning}\n  \
         cost     run: about {} of memory and {} on the disk; render: {} and {}",
        duration(cost.run_s),
        duration(cost.staging_s),
        duration(cost.render_s),
        duration(cost.track_s),
        duration(cost.measure_s),
        size(cost.memory_bytes),
        size(cost.run_bytes),
        size(cost.render_memory_bytes),
        size(cost.set_bytes),
    )
}
