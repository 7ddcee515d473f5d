//! The command line: one file per subcommand, each a thin call into the other rooms.
//!
//! Results go to stdout, progress and notes to stderr. Exit codes: 0 done; 1 check failed; 2 usage or bad input; 3
//! inconclusive; 75 try again later; 101 internal error; 130 interrupted.

mod baseline;
mod bound;
mod caller;
mod check;
mod check_tracker;
mod compare;
mod completions;
mod evaluate;
mod explain;
mod export;
mod faults;
mod folders;
mod gate;
mod import;
mod inspect;
mod inspect_contacts;
mod inspect_scenario;
mod inspect_text;
mod interrupt;
mod manual;
mod output;
mod output_arguments;
mod parameters;
mod place;
mod plan_seeds;
mod program_arguments;
mod progress;
mod render;
mod report;
mod retired;
mod run;
mod scenario_arguments;
mod schema;
mod segment;
mod summary;
mod sweep;
mod track;
mod train;
mod twin;
mod verify;
mod volume;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::artefacts::ArtefactError;
use crate::common::ExperimentError;
use crate::scenario::ScenarioError;
pub use caller::print_failure;

/// Generates exact ground truth and measures markerless human motion trackers against it.
#[derive(Debug, Parser)]
#[command(
    name = "skiagraph",
    version,
    about = "Makes exact synthetic ground truth for markerless human motion trackers, and measures them against it",
    after_help = EXIT_CODES,
    arg_required_else_help = true,
    propagate_version = true
)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,

    /// Number of threads [default: all cores]; results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,

    #[command(flatten)]
    volume: volume::Volume,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 check failed, 2 usage or bad input, 3 inconclusive, 75 try again later, \
    101 internal error, 130 interrupted.";

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::Arguments),
    Check(check::Arguments),
    Schema(schema::Arguments),
    Render(render::Arguments),
    Import(import::Arguments),
    Twin(twin::Arguments),
    Track(track::Arguments),
    Evaluate(evaluate::Arguments),
    Explain(explain::Arguments),
    Compare(compare::Arguments),
    Gate(gate::Arguments),
    PlanSeeds(plan_seeds::Arguments),
    Bound(bound::Arguments),
    Place(place::Arguments),
    CheckTracker(Box<check_tracker::Arguments>),
    Baseline(baseline::Arguments),
    Segment(segment::Arguments),
    Train(train::Arguments),
    Sweep(Box<sweep::Arguments>),
    Faults(faults::Arguments),
    Report(report::Arguments),
    Inspect(inspect::Arguments),
    Verify(verify::Arguments),
    Export(export::Arguments),
    Completions(completions::Arguments),
    Man(manual::Arguments),
}

#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// A result cannot be written.
    #[error(transparent)]
    Artefact(#[from] ArtefactError),
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A command or an option of an earlier version.
    #[error("{0}")]
    Retired(String),
    #[error("cannot start the threads: {0}; try fewer with --threads")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// Standard output cannot be written.
    #[error("cannot write the result to standard output: {0}")]
    Stdout(#[from] std::io::Error),
}

impl CommandError {
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Experiment(error) => error.exit_code(),
            Self::Artefact(error) => error.exit_code(),
            Self::Scenario(_) | Self::Retired(_) | Self::Stdout(_) => 2,
            Self::Threads(_) => 75,
        }
    }
}

/// All commands. A negative number after an option is parsed as its value, so that the option's range check reports it.
fn command_line() -> clap::Command {
    fn with_negative_numbers(command: clap::Command) -> clap::Command {
        let takes_value = |argument: &clap::Arg| argument.get_long().is_some() && argument.get_action().takes_values();
        command
            .mut_args(|argument| if takes_value(&argument) { argument.allow_negative_numbers(true) } else { argument })
            .mut_subcommands(with_negative_numbers)
    }
    with_negative_numbers(CommandLine::command())
}

/// Parses the process's arguments and runs the command. Usage errors and `--help` end the process here.
pub fn run_command() -> Result<ExitCode, CommandError> {
    let arguments: Vec<String> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    let retired = retired::message(&arguments);
    let matches = match (command_line().try_get_matches(), retired) {
        // `sweep WORD` takes any other word for a file
        (Ok(_), Some(message)) if matches!(&arguments[..], [command, word, ..] if command == "sweep" && !std::path::Path::new(word).exists()) =>
        {
            return Err(CommandError::Retired(message));
        }
        (Err(error), Some(message)) if error.use_stderr() => return Err(CommandError::Retired(message)),
        (Ok(matches), _) => matches,
        (Err(error), _) => {
            caller::print_usage_error(&error);
            error.exit()
        }
    };
    let line = CommandLine::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    interrupt::install();
    interrupt::outlive_file_limit();
    if let Some(threads) = line.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    match line.command {
        Command::Run(arguments) => run::run(&arguments, line.volume),
        Command::Check(arguments) => check::run(&arguments, line.volume),
        Command::Schema(arguments) => schema::run(&arguments),
        Command::Render(arguments) => render::run(&arguments, line.volume),
        Command::Import(arguments) => import::run(&arguments, line.volume),
        Command::Twin(arguments) => twin::run(&arguments, line.volume),
        Command::Track(arguments) => track::run(&arguments, line.volume),
        Command::Evaluate(arguments) => evaluate::run(&arguments, line.volume),
        Command::Explain(arguments) => explain::run(&arguments, line.volume),
        Command::Compare(arguments) => compare::run(&arguments, line.volume),
        Command::Gate(arguments) => gate::run(&arguments, line.volume),
        Command::PlanSeeds(arguments) => plan_seeds::run(&arguments),
        Command::Bound(arguments) => bound::run(&arguments, line.volume),
        Command::Place(arguments) => place::run(&arguments, line.volume),
        Command::CheckTracker(arguments) => check_tracker::run(&arguments, line.volume),
        Command::Baseline(arguments) => baseline::run(&arguments, line.volume),
        Command::Segment(arguments) => segment::run(&arguments, line.volume),
        Command::Train(arguments) => train::run(&arguments, line.volume),
        Command::Sweep(arguments) => sweep::run(&arguments, line.volume),
        Command::Faults(arguments) => faults::run(&arguments, line.volume),
        Command::Report(arguments) => report::run(&arguments, line.volume),
        Command::Inspect(arguments) => inspect::run(&arguments, line.volume),
        Command::Verify(arguments) => verify::run(&arguments, line.volume),
        Command::Export(arguments) => export::run(&arguments, line.volume),
        Command::Completions(arguments) => completions::run(&arguments),
        Command::Man(arguments) => manual::run(&arguments, line.volume),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        command_line().debug_assert();
    }

    #[test]
    fn a_negative_number_is_refused_by_the_range_of_its_option() {
        for (arguments, words) in [
            ("run --seeds -1", "-1 is not in 1..=100000"),
            ("track set --tracker frozen --out a --seeds -1", "-1 is not in 1..=100000"),
            ("sweep walk.toml --seeds -1", "-1 is not in 1..=100000"),
            ("sweep run a -j -2", "-2 is not in 1..=1024"),
        ] {
            let line = std::iter::once("skiagraph").chain(arguments.split(' '));
            let error = command_line().try_get_matches_from(line).unwrap_err().to_string();
            assert!(error.contains(words), "{arguments}: {error}");
        }
    }

    #[test]
    fn every_subcommand_shows_examples() {
        for command in CommandLine::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("Examples:\n  skiagraph "), "{} has no examples", command.get_name());
        }
    }
}
