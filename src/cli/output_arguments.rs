//! What every command that leaves a directory behind takes.

use std::path::Path;

use clap::Args;

use super::progress::Progress;
use crate::experiment::Destination;

/// How a command treats what is there already, and how much it says.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct OutputArguments {
    /// Replace a set that is there; move aside to NAME~ what is there and is not ours
    #[arg(long)]
    force: bool,

    /// Print one JSON object instead of text
    #[arg(long)]
    pub(super) json: bool,

    /// No progress, no notes
    #[arg(long)]
    pub(super) quiet: bool,
}

impl OutputArguments {
    pub(super) fn destination(self, path: &Path) -> Destination<'_> {
        Destination { path, force: self.force }
    }

    pub(super) fn progress(self) -> Progress {
        Progress::new(self.quiet)
    }
}
