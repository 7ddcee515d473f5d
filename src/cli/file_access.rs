//! `--allow-outside`, shared by several subcommands.

use std::path::Path;

use clap::Args;

use crate::common::ExperimentError;
use crate::input::AllowedFolders;
use crate::scenario::{NamedOnCommandLine, ScenarioFile};
use crate::sweep::PlannedSweep;

/// Where files that a file names may lie.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct FileAccess {
    /// Allow files to refer to files anywhere. By default they may refer only to files below their own folder or
    /// project (the nearest parent folder with .git or skiagraph.project) and to files named on the command line
    #[arg(long)]
    pub(super) allow_outside: bool,
}

impl FileAccess {
    /// What a scenario or sweep in `folder` may name because of these assignments and this directory.
    pub(super) fn allowed(
        self,
        folder: &Path,
        assignments: &[String],
        mocap_directory: Option<&Path>,
    ) -> AllowedFolders {
        NamedOnCommandLine { assignments, mocap_directory, anywhere: self.allow_outside }.allowed(folder)
    }

    /// A planned sweep.
    pub(super) fn open_sweep(self, root: &Path) -> Result<PlannedSweep, ExperimentError> {
        let sweep = PlannedSweep::open(root)?;
        Ok(if self.allow_outside { sweep.allowing_all_files() } else { sweep })
    }

    /// Lets a scenario name what this directory holds; what its overrides name, it may name anyway.
    pub(super) fn give(self, file: &mut ScenarioFile, mocap_directory: Option<&Path>) {
        let allowed = self.allowed(&file.folder, &[], mocap_directory);
        file.allowed.allow_all_of(&allowed);
    }
}
