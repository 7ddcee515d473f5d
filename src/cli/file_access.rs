//! `--allow-outside`, shared by several subcommands.

use std::path::Path;

use clap::Args;

use crate::common::ExperimentError;
use crate::input::AllowedFolders;
use crate::scenario::{NamedOnCommandLine, ScenarioFile};
use crate::sweep::PlannedSweep;

/// Which files a scenario or sweep may refer to.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct FileAccess {
    /// Allow files to refer to files anywhere. By default they may refer only to files below their own folder or
    /// project (the nearest parent folder with .git or skiagraph.project) and to files named on the command line
    #[arg(long)]
    pub(super) allow_outside: bool,
}

impl FileAccess {
    /// Folders that a scenario or sweep in `folder` may refer to, including those of these assignments and the mocap
    /// directory.
    pub(super) fn allowed(
        self,
        folder: &Path,
        assignments: &[String],
        mocap_directory: Option<&Path>,
    ) -> AllowedFolders {
        NamedOnCommandLine { assignments, mocap_directory, anywhere: self.allow_outside }.allowed(folder)
    }

    /// Opens a planned sweep.
    pub(super) fn open_sweep(self, root: &Path) -> Result<PlannedSweep, ExperimentError> {
        let sweep = PlannedSweep::open(root)?;
        Ok(if self.allow_outside { sweep.allowing_all_files() } else { sweep })
    }

    /// Allows a scenario to refer to files in the mocap directory; files named in its overrides are always allowed.
    pub(super) fn grant(self, file: &mut ScenarioFile, mocap_directory: Option<&Path>) {
        let allowed = self.allowed(&file.folder, &[], mocap_directory);
        file.allowed.allow_all_of(&allowed);
    }
}
