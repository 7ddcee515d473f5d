//! `skiagraph man`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory};
use clap_mangen::Man;

use super::volume::Volume;
use super::{CommandError, CommandLine, output};
use crate::artefacts::{Destination, MANUAL_MARK, put_file};

/// Print the manual page, or write one page per command
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph man | man -l -\n  skiagraph man --out ~/.local/share/man/man1")]
pub(super) struct Arguments {
    /// Directory for skiagraph.1 and one page per command; replaces existing pages that skiagraph wrote
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Move existing files that skiagraph did not write aside, to NAME~
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let pages = pages()?;
    let Some(directory) = &arguments.out else {
        output::print(pages.first().map_or("", |(_, page)| page.trim_end()))?;
        return Ok(ExitCode::SUCCESS);
    };
    for (name, page) in &pages {
        let path = directory.join(name);
        put_file(Destination { path: &path, force: arguments.force }, page.as_bytes())?;
        volume.written(&path);
    }
    output::print(&format!("{}: {}", directory.display(), output::counted(pages.len(), "page")))?;
    Ok(ExitCode::SUCCESS)
}

/// File names and pages: the program's page, then one page per command.
fn pages() -> Result<Vec<(String, String)>, CommandError> {
    let mut program = CommandLine::command();
    program.build();
    let commands = program.get_subcommands().filter(|command| command.get_name() != "help").cloned();
    let commands: Vec<clap::Command> = commands.collect();
    let page = |command: clap::Command| {
        let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
        let mut page = format!("{MANUAL_MARK}{}\n", env!("CARGO_PKG_VERSION")).into_bytes();
        Man::new(command).render(&mut page)?;
        Ok((format!("{name}.1"), String::from_utf8_lossy(&page).into_owned()))
    };
    std::iter::once(program).chain(commands).map(page).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_that_names_it_and_its_options() {
        let pages = pages().unwrap();
        let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names[0], "skiagraph.1");
        for command in CommandLine::command().get_subcommands() {
            let (_, page) = pages.iter().find(|(n, _)| *n == format!("skiagraph-{}.1", command.get_name())).unwrap();
            assert!(page.starts_with(MANUAL_MARK) && page.contains(".TH"), "{page}");
            let shown = command.get_arguments().filter(|argument| !argument.is_hide_set());
            for argument in shown.filter_map(|argument| argument.get_long()) {
                let dashed = argument.replace('-', "\\-");
                assert!(page.contains(&dashed), "{}: --{argument}", command.get_name());
            }
        }
    }
}
