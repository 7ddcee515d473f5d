//! `SCENARIO [KEY=VALUE...] [--mocap-dir DIR]`, as several subcommands take it.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::experiment::{ExperimentError, ScenarioFile};

#[derive(Args, Debug)]
pub(super) struct ScenarioArguments {
    /// Scenario file; the built-in walk if left out
    #[arg(value_name = "SCENARIO")]
    scenario: Option<String>,

    /// Changes to the scenario: a dotted key and a TOML value
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Where to look, at any depth, for clips that the scenario names [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,
}

impl ScenarioArguments {
    /// The scenario with its overrides.
    pub(super) fn open(&self) -> Result<ScenarioFile, ExperimentError> {
        self.open_with(Vec::new())
    }

    /// The scenario with its overrides and then `more` of them.
    pub(super) fn open_with(&self, more: Vec<String>) -> Result<ScenarioFile, ExperimentError> {
        let mut overrides = self.overrides.clone();
        overrides.extend(more);
        let file = match &self.scenario {
            Some(first) if first.contains('=') && !Path::new(first).exists() => {
                overrides.insert(0, first.clone());
                ScenarioFile::built_in(&overrides)
            }
            Some(path) => ScenarioFile::open(Path::new(path), &overrides),
            None => ScenarioFile::built_in(&overrides),
        };
        Ok(file?)
    }

    /// Where to look for clips.
    pub(super) fn mocap_directory(&self) -> Option<PathBuf> {
        self.mocap_dir.clone().or_else(|| std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from))
    }
}
