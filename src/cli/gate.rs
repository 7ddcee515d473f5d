//! `skiagraph gate`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use super::folders::expect_run;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Destination, keep_others_from_junit, put_file};
use crate::common::ExperimentError;
use crate::gating::{BASELINES, Baseline, GATE_FILE, add_missing_seeds, add_seeds, check_metric, gate_run, read_rules};
use crate::runs::MoreOf;
use skiagraph_eval::{GateRules, GateVerdict, IntervalUnit, Margin};
use skiagraph_report::GateReport;

/// Compare a run with a baseline: PASS (exit code 0), FAIL (1) or INCONCLUSIVE (3)
///
/// A metric passes if the 95 % interval of its worsening (increase of an error, or decrease of a score) lies below the
/// margin, fails if it lies above, and is inconclusive in between; the gate then estimates how many more seeds would
/// decide it. Intervals are never over frames. Run and baseline need at least 5 seeds per set; 10 are usual. Seeds that
/// the baseline also has are paired. A tracker without random numbers is gated over 5 noise draws per clip (sets
/// rendered with different values of observation.seed) or over 5 clips; --unit selects which.
///
/// Metrics of the ground truth must not change. Errors are means over markers with an estimate; therefore coverage must
/// not fall by more than 0.01, and the share of runs that lose the body (track_loss above 0, or no error that could be
/// measured) must not be significantly higher. A gate.toml sets budgets for several metrics and clips;
/// scenarios/README.md lists its keys.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph gate runs/walk --baseline walk --margin 2mm\n  \
                        skiagraph gate runs/walk --baseline walk --margin 2mm --add-seeds 10\n  \
                        skiagraph gate runs/walk --baseline walk --metric pck150 --margin 1%\n  \
                        skiagraph gate runs --baseline all --rules gate.toml --junit gate.xml --github\n  \
                        skiagraph gate runs/draw-1 runs/draw-2 runs/draw-3 runs/draw-4 runs/draw-5 --baseline mine --margin 2mm\n  \
                        skiagraph gate runs/walk --baseline walk --margin 2mm --markdown >> $GITHUB_STEP_SUMMARY")]
pub(super) struct Arguments {
    /// Run directories, or directories that contain runs: clips, noise draws, further seeds
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,

    /// Name of the baseline, or its .json file
    #[arg(long, value_name = "NAME")]
    baseline: String,

    /// Directory of baselines
    #[arg(long, value_name = "DIR", default_value = BASELINES)]
    baselines: PathBuf,

    /// Largest allowed worsening of the metric: 2mm, 1.5deg, 0.02, or 5% of the baseline
    #[arg(long, value_name = "MARGIN", allow_hyphen_values = true)]
    margin: Option<Margin>,

    /// Metric that --margin applies to
    #[arg(long, value_name = "NAME", default_value = "humaneva_mm", requires = "margin")]
    metric: String,

    /// File of budgets [default: gate.toml, if it exists and --margin is not given]
    #[arg(long, value_name = "FILE")]
    rules: Option<PathBuf>,

    /// Unit of the intervals: seeds, draws or clips [default: seeds if there are enough (5, or more if gate.toml says
    /// so), else draws, else clips]
    #[arg(long, value_name = "UNIT")]
    unit: Option<IntervalUnit>,

    /// Accept seeds other than the baseline's; they are not paired
    #[arg(long)]
    other_seeds: bool,

    /// Run up to N seeds that the baseline has and the run lacks; if the gate is then inconclusive, run N further seeds
    /// of the same tracker on the same set and repeat the gate
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    add_seeds: Option<u32>,

    /// The run's set, for --add-seeds [default: rendered again from the run's scenario.toml]
    #[arg(long, value_name = "SET", requires = "add_seeds")]
    set: Vec<PathBuf>,

    /// Directory that the paths in the run's scenario.toml are relative to, for --add-seeds
    #[arg(long, value_name = "DIR", requires = "add_seeds")]
    scenario_dir: Option<PathBuf>,

    /// Directory to search recursively for clips, for --add-seeds [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR", requires = "add_seeds")]
    mocap_dir: Option<PathBuf>,

    /// Result of an inconclusive gate: inconclusive (exit code 3), pass (0) or fail (1); also in --junit and --github
    #[arg(long, value_name = "AS", value_enum, default_value_t = InconclusiveAs::Itself)]
    inconclusive: InconclusiveAs,

    /// Also write JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,

    /// Print annotations for GitHub Actions after the result
    #[arg(long)]
    github: bool,

    /// Print one JSON object instead of text
    #[arg(long, conflicts_with_all = ["markdown", "github"])]
    json: bool,

    /// Print Markdown instead of text
    #[arg(long)]
    markdown: bool,

    /// Move an existing JUnit FILE aside, to FILE~, if skiagraph did not write it
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum InconclusiveAs {
    Pass,
    Fail,
    #[value(name = "inconclusive")]
    Itself,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    arguments.runs.iter().try_for_each(|run| expect_run(run))?;
    let rules = arguments.rules()?;
    if let Some(path) = &arguments.junit {
        keep_others_from_junit(Destination { path, force: arguments.force })?;
    }
    let baseline = Baseline::read(&arguments.baseline, &arguments.baselines)?;
    let environment = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
    let from = MoreOf {
        sets: &arguments.set,
        scenario_folder: arguments.scenario_dir.as_deref(),
        mocap_directory: arguments.mocap_dir.as_deref().or(environment.as_deref()),
    };
    if let Some(most) = arguments.add_seeds {
        let progress = TerminalProgress::new(volume);
        let written = add_missing_seeds(&arguments.runs, &baseline, &rules, most, from, &progress)?;
        drop(progress);
        written.iter().for_each(|folder| volume.written(folder));
    }
    let mut outcome = gate_run(&arguments.runs, &baseline, &rules)?;
    let is_open = outcome.verdict == GateVerdict::Inconclusive && outcome.unit == IntervalUnit::Seeds;
    if let Some(count) = arguments.add_seeds.filter(|_| is_open) {
        let progress = TerminalProgress::new(volume);
        let written = add_seeds(&arguments.runs, count, from, &progress);
        drop(progress);
        match written {
            Ok(written) => {
                written.iter().for_each(|folder| volume.written(folder));
                outcome = gate_run(&arguments.runs, &baseline, &rules)?;
            }
            // the first result stands if no seeds can be added
            Err(refusal @ ExperimentError::Argument { .. }) => outcome.notes.push(refusal.to_string()),
            Err(error) => return Err(error.into()),
        }
    }
    let run = arguments.runs.iter().map(|run| run.display().to_string()).collect::<Vec<_>>().join(" ");
    let inconclusive = arguments.inconclusive.verdict();
    let report = GateReport { run: &run, baseline: &baseline.name, outcome: &outcome, inconclusive };
    if let Some(path) = &arguments.junit {
        let text = report.junit().map_err(ExperimentError::from)?;
        put_file(Destination { path, force: arguments.force }, text.as_bytes())?;
        volume.written(path);
    }
    if arguments.json {
        output::print_json(&outcome)?;
    } else if arguments.markdown {
        output::print(&report.markdown())?;
    } else {
        output::print(&report.text())?;
    }
    if arguments.github {
        output::print(&report.annotations())?;
    }
    Ok(ExitCode::from(match outcome.verdict {
        GateVerdict::Inconclusive => exit_code(inconclusive),
        verdict => exit_code(verdict),
    }))
}

fn exit_code(verdict: GateVerdict) -> u8 {
    match verdict {
        GateVerdict::Pass => 0,
        GateVerdict::Fail => 1,
        GateVerdict::Inconclusive => 3,
    }
}

impl InconclusiveAs {
    fn verdict(self) -> GateVerdict {
        match self {
            Self::Pass => GateVerdict::Pass,
            Self::Fail => GateVerdict::Fail,
            Self::Itself => GateVerdict::Inconclusive,
        }
    }
}

impl Arguments {
    /// Budgets from the rules file and from the command line.
    fn rules(&self) -> Result<GateRules, ExperimentError> {
        if self.margin.is_some() {
            check_metric(&self.metric).map_err(|detail| ExperimentError::Argument { argument: "--metric", detail })?;
        }
        let found = Path::new(GATE_FILE).is_file() && self.margin.is_none();
        let file = self.rules.as_deref().or(found.then_some(Path::new(GATE_FILE)));
        let of_margin = self.margin.map(|margin| GateRules::from_metric(&self.metric, margin));
        let mut rules = match (file.map(read_rules).transpose()?, of_margin) {
            (Some(rules), None) if !rules.budgets.is_empty() => rules,
            (Some(mut rules), Some(more)) => {
                rules.budgets.extend(more.budgets);
                rules
            }
            (None, Some(rules)) => rules,
            _ => {
                let detail = format!("no margin is given: use --margin 2mm, for example, or budgets in {GATE_FILE}");
                return Err(ExperimentError::Argument { argument: "--margin", detail });
            }
        };
        rules.other_seeds |= self.other_seeds;
        rules.unit = self.unit.or(rules.unit);
        Ok(rules)
    }
}
