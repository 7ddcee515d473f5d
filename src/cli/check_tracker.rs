//! `skiagraph check-tracker`.

use std::process::ExitCode;

use clap::Args;

use super::program_arguments::{ProgramOptionArguments, command_line};
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::volume::Volume;
use super::{CommandError, output};
use crate::common::ExperimentError;
use crate::conformance::{RelationCheck, TrackerCheck, check_tracker};
use crate::scenario::{Scenario, ScenarioError, TrackerSettings};
use skiagraph_eval::{GateVerdict, Margin};

/// The scene by default: it takes seconds, and is the same for left and right.
const USUAL_SCENE: [&str; 6] = [
    "actor={ robot = \"tracker25\" }",
    "tracker_body={ robot = \"tracker25\", mismatch = \"none\" }",
    "motion.frames_per_second=30.0",
    "motion.loop_to_s=1.0",
    "rig.ring.size_px=[320, 240]",
    "rig.ring.radius_m=3.5",
];

/// Errors that differ by less are alike.
const ALIKE_MM: f64 = 0.1;

/// Check that a tracker does as well in scenes that are the same in another form: PASS, FAIL or INCONCLUSIVE
///
/// Tracks a short scene (without SCENARIO, a walk of a second by the tracker's own body) and the same scene mirrored,
/// turned, moved, with its cameras in another order, with a camera twice and with a frame twice. A relation passes if
/// the 95 % interval of the difference of the mean errors over seeds lies within the margin on both sides, fails if it
/// lies beyond, and is inconclusive in between. It also fails if the share of frames with an estimate changes by more
/// than 2 %; the repetition of a frame may be lost. Silhouettes and keypoints are exact.
///
/// PASS means that the mean error over all frames and markers is the same, and nothing else: the estimates themselves
/// are not compared. A mistake that does not change the mean error passes, such as one that is as large in every form
/// of the scene, or one that moves an error to another marker or side.
///
/// A tracker is not judged without whole runs of the original scene: if a program did not answer in a frame, or a seed
/// has no estimate in more than a tenth of the frames.
///
/// Exit code 1 if a relation fails, 3 if none fails and one is inconclusive, or if the tracker is not judged.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph check-tracker --exec \"python my_tracker.py\" --inline\n  \
                        skiagraph check-tracker --tracker annealed_particle_filter --seeds 10\n  \
                        skiagraph check-tracker scenarios/walk.toml --exec \"python my_tracker.py\" --margin 5%")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Built-in tracker, with the scenario's settings if it has that tracker; or use --exec
    #[arg(long, value_name = "NAME", conflicts_with = "exec")]
    tracker: Option<String>,

    /// Program to run as the tracker: a shell command line
    #[arg(long, value_name = "COMMAND", value_parser = command_line)]
    exec: Option<String>,

    #[command(flatten)]
    options: ProgramOptionArguments,

    /// Number of seeds; a tracker without random numbers is judged by the difference alone
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(3..=1000))]
    seeds: u32,

    /// Greatest difference of the mean error that does not matter: 10mm, or 5% of the error
    #[arg(long, value_name = "MARGIN", default_value = "10mm", allow_hyphen_values = true)]
    margin: Margin,

    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    arguments.options.check(arguments.tracker.as_deref(), arguments.exec.as_deref())?;
    let usual = if arguments.scenario.is_default() { USUAL_SCENE.map(str::to_owned).to_vec() } else { Vec::new() };
    let file = arguments.scenario.open_with(usual)?;
    let settings = arguments.tracker(&file.scenario)?;
    let seeds: Vec<u64> = (0..u64::from(arguments.seeds)).collect();
    let progress = TerminalProgress::new(volume);
    let mocap = arguments.scenario.mocap_directory();
    let found = check_tracker(&file, mocap.as_deref(), &settings, &seeds, arguments.margin, &progress)
        .map_err(|error| error.about(&file.origin))?;
    drop(progress);
    output::print_as(arguments.json, &found, describe)?;
    Ok(ExitCode::from(match found.verdict {
        GateVerdict::Pass => 0,
        GateVerdict::Fail => 1,
        GateVerdict::Inconclusive => 3,
    }))
}

impl Arguments {
    fn tracker(&self, scenario: &Scenario) -> Result<TrackerSettings, ExperimentError> {
        if let Some(command) = &self.exec {
            let program = self.options.program(command);
            return match program.unset_placeholder() {
                Some(detail) => Err(ExperimentError::Argument { argument: "--exec", detail }),
                None => Ok(TrackerSettings::Program(program)),
            };
        }
        let name = self.tracker.as_deref().unwrap_or_default();
        let own = scenario.trackers().into_iter().map(|(_, own)| own).find(|own| own.name() == name);
        Ok(own.map_or_else(|| TrackerSettings::named(name), Ok).map_err(ScenarioError::from)?)
    }
}

fn describe(found: &TrackerCheck) -> String {
    let mut lines = vec![
        format!(
            "{}: {} on {}, {}; error {:.1} mm, coverage {:.0} %, margin {:.1} mm",
            found.verdict.word(),
            found.tracker,
            found.scenario,
            output::counted(found.seeds, "seed"),
            found.error_mm,
            100.0 * found.coverage,
            found.margin_mm
        ),
        String::new(),
    ];
    // such a tracker passes every relation
    lines.extend(
        found
            .frozen_mm
            .filter(|floor| found.error_mm >= *floor - ALIKE_MM)
            .map(|floor| format!("  no better than a tracker that never moves from its start pose: {floor:.1} mm\n")),
    );
    lines.extend(found.not_judged.as_ref().map(|reason| format!("  not judged: {reason}")));
    lines.extend(found.relations.iter().map(line));
    lines.join("\n")
}

fn line(check: &RelationCheck) -> String {
    let difference = check.difference.as_ref().map(|found| match found.ci95 {
        Some(ends) => {
            format!("{:+.1} mm (95 % interval {:+.1} to {:+.1})", found.difference, ends.low, ends.high)
        }
        None => format!("{:+.1} mm", found.difference),
    });
    let coverage = check.coverage.map(|share| format!("coverage {:.0} %", 100.0 * share));
    let found = [difference, coverage, check.reason.clone()].into_iter().flatten().collect::<Vec<_>>().join("; ");
    format!("  {:<12}  {:<30}  {found}", check.verdict.word(), check.relation.describe())
}
