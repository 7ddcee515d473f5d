//! The command line: one file per subcommand, each a thin call into experiment/.
//!
//! Results go to stdout, progress and notes to stderr. Exit codes: 0 done; 1 a check said no; 2 usage or bad input;
//! 3 inconclusive; 75 try again; 101 a bug of ours; 130 interrupted.

mod check;
mod output;
mod scenario_arguments;
mod schema;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::experiment::ExperimentError;

/// Truth and measure for markerless human motion trackers.
#[derive(Debug, Parser)]
#[command(
    name = "skiagraph",
    version,
    about = "Makes the truth for markerless human motion trackers and measures them against it",
    after_help = EXIT_CODES,
    arg_required_else_help = true,
    propagate_version = true
)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 a check said no, 2 usage or bad input, 3 inconclusive, 75 try again, \
                          101 a bug of ours, 130 interrupted.";

#[derive(Debug, Subcommand)]
enum Command {
    Check(check::Arguments),
    Schema(schema::Arguments),
}

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// The experiment could not be done.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// Standard output cannot be written.
    #[error("cannot write the result to standard output: {0}")]
    Stdout(#[from] std::io::Error),
}

impl CommandError {
    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Experiment(error) => error.exit_code(),
            Self::Stdout(_) => 2,
        }
    }
}

/// Parses the process's arguments and runs the command; usage errors and `--help` end the process here.
///
/// # Errors
/// [`CommandError`] if the command fails.
pub fn run() -> Result<ExitCode, CommandError> {
    match CommandLine::parse().command {
        Command::Check(arguments) => check::run(&arguments),
        Command::Schema(arguments) => schema::run(&arguments),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_well_formed() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn every_subcommand_shows_examples() {
        for command in CommandLine::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("Examples:\n  skiagraph "), "{} has no examples", command.get_name());
        }
    }
}
