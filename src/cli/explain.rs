//! `skiagraph explain`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_run;
use super::output_arguments::OutputArguments;
use super::program_arguments::command_line;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::sibling;
use crate::explain::{Cause, EXPLAIN_PAGE, ExplainOptions, Explanation, WorstSecond, again, explain, notes};
use crate::runs::MoreOf;

/// Explain the error of a run: how much comes from body, cameras, time, observations, start pose and search
///
/// The run is repeated with the truth in place of each input that is wrong, with the same seeds and the same random
/// numbers for whatever stays wrong, for every subset of these inputs. A cause's part is its Shapley value: the mean
/// over all orders of correction of how much its correction reduces the error. The parts add up to the error. The
/// search comes last: its part is what a descent from the truth saves when all inputs are true.
///
/// --quick replaces only single inputs and all together; what these effects lack of the whole is shown as interaction.
///
/// Any tracker can be explained, programs included; name the program again with --exec.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph explain runs/walk --quick\n  \
                        skiagraph explain runs/walk --out runs/walk-explained\n  \
                        skiagraph explain runs/mine --set sets/walk --exec \"python my_tracker.py\" --seeds 3")]
pub(super) struct Arguments {
    /// Directory of a measured run
    #[arg(value_name = "RUN")]
    run: PathBuf,

    /// Replace only single inputs and all together, instead of all subsets
    #[arg(long)]
    quick: bool,

    /// The run's set, with its truth [default: rendered again from the run's scenario.toml]
    #[arg(long, value_name = "SET")]
    set: Vec<PathBuf>,

    /// The program of the run, if another program tracked: the same command line as then
    #[arg(long, value_name = "COMMAND", value_parser = command_line)]
    exec: Option<String>,

    /// Use only the first N seeds of the run [default: all; with --quick, two]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,

    /// Also write the N worst seconds, which do not overlap, as sets of their own on which the tracker fails again
    ///
    /// Each set has a second of observations, and the run's estimate before it as start pose. The tracker is run on it
    /// once, and the output says whether it fails to the bit as in the run.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=100))]
    worst: u32,

    /// Let the sets of the worst seconds begin with the run's first frame: particle filters then fail again to the bit
    #[arg(long, requires = "worst")]
    from_start: bool,

    /// Explain a tracker that gives another result when it is repeated with nothing replaced
    #[arg(long)]
    accept_chance: bool,

    /// Directory that the paths in the run's scenario.toml are relative to
    #[arg(long, value_name = "DIR")]
    scenario_dir: Option<PathBuf>,

    /// Directory to search recursively for clips [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,

    /// Directory of the explanation [default: RUN-explained]
    ///
    /// Finished repetitions are kept in NAME.partial until all are done; the same command resumes after an
    /// interruption.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    expect_run(&arguments.run)?;
    let environment = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
    let options = ExplainOptions {
        quick: arguments.quick,
        accepts_chance: arguments.accept_chance,
        seeds: arguments.seeds.map(|seeds| seeds as usize),
        worst: (arguments.worst as usize, arguments.from_start),
        exec: arguments.exec.as_deref(),
        from: MoreOf {
            sets: &arguments.set,
            scenario_folder: arguments.scenario_dir.as_deref(),
            mocap_directory: arguments.mocap_dir.as_deref().or(environment.as_deref()),
        },
    };
    let place = arguments.out.clone().unwrap_or_else(|| sibling(&arguments.run, "", "-explained"));
    let progress = TerminalProgress::new(volume);
    let explanation = explain(&arguments.run, arguments.output.destination(&place), &options, &progress)?;
    drop(progress);
    volume.written(&place);
    let told = |found: &Explanation| format!("{}\n\n  {}", text(found), place.join(EXPLAIN_PAGE).display());
    output::print_as(arguments.output.json, &explanation, told)?;
    Ok(ExitCode::SUCCESS)
}

fn text(of: &Explanation) -> String {
    let interval = |cause: &Cause| {
        cause.interval.map(|interval| format!("{:.1} to {:.1}", interval.low, interval.high)).unwrap_or_default()
    };
    let longest = of.causes.iter().map(|cause| cause.name.len()).fold(14, usize::max);
    let row = |name: &str, part: f64, interval: &str, fault: &str| {
        let share = if of.error_mm > 0.0 { 100.0 * part / of.error_mm } else { 0.0 };
        format!("  {name:<longest$} {part:>8.1} {share:>7.0} %  {interval:<16} {fault}").trim_end().to_owned()
    };
    let mut lines = vec![of.sentence.clone(), String::new()];
    lines.push(format!(
        "  {:<longest$} {:>8} {:>9}  {:<16} {}",
        "cause", "mm", "share", "95 % over seeds", "what is wrong"
    ));
    lines.extend(of.causes.iter().map(|cause| row(cause.name, cause.error_mm, &interval(cause), &cause.fault)));
    lines.extend(of.interaction_mm.map(|part| row("interaction", part, "", "")));
    lines.push(row("what remains", of.rest_mm, "", ""));
    lines.push(row("error", of.error_mm, "", ""));
    lines.push(String::new());
    lines.extend(notes(of).iter().map(|note| format!("  {note}")));
    lines.extend(of.worst.iter().map(worst_second));
    lines.join("\n")
}

/// One of the worst seconds, in a line.
fn worst_second(of: &WorstSecond) -> String {
    let WorstSecond { folder, seed, first_frame, last_frame, error_mm, .. } = of;
    format!("  {folder}: seed {seed}, frames {first_frame} to {last_frame}, {error_mm:.1} mm; {}", again(of))
}
