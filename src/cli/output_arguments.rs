//! Options shared by commands that write results.

use std::path::Path;

use clap::Args;

use crate::artefacts::Destination;

/// How a command treats existing files.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct OutputArguments {
    /// Replace existing output of the same command; move any other output aside, to NAME~
    #[arg(long)]
    force: bool,

    /// Print one JSON object instead of text
    #[arg(long)]
    pub(super) json: bool,
}

impl OutputArguments {
    pub(super) fn destination(self, path: &Path) -> Destination<'_> {
        Destination { path, force: self.force }
    }
}
