//! What every command that leaves results behind takes.

use std::path::Path;

use clap::Args;

use crate::experiment::Destination;

/// How a command treats what is there already.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct OutputArguments {
    /// Replace a set that is there; move aside to NAME~ what is there and is not ours
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
