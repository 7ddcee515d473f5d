//! `skiagraph completions`.

use std::process::ExitCode;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{CommandError, CommandLine, output};

/// Print a shell completion script
#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  skiagraph completions bash > ~/.local/share/bash-completion/completions/skiagraph\n  \
                        skiagraph completions zsh > ~/.zfunc/_skiagraph\n  \
                        skiagraph completions fish > ~/.config/fish/completions/skiagraph.fish"
)]
pub(super) struct Arguments {
    /// Shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut CommandLine::command(), "skiagraph", &mut script);
    output::print(String::from_utf8_lossy(&script).trim_end())?;
    Ok(ExitCode::SUCCESS)
}
