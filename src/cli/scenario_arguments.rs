//! `SCENARIO [KEY=VALUE...] [--mocap-dir DIR]`, shared by several subcommands.

use std::path::{Path, PathBuf};

use clap::Args;

use super::program_arguments::TrackerArguments;
use crate::common::ExperimentError;
use crate::scenario::{ScenarioFile, Survey, survey};

#[derive(Args, Debug)]
pub(super) struct ScenarioArguments {
    /// Scenario file [default: the built-in walk]
    #[arg(value_name = "SCENARIO")]
    scenario: Option<PathBuf>,

    /// Overrides of scenario keys: a dotted key, or its last parts if they are unambiguous, and a TOML value
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Directory to search recursively for clips of the scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,
}

impl ScenarioArguments {
    pub(super) fn open(&self) -> Result<ScenarioFile, ExperimentError> {
        self.open_with(Vec::new())
    }

    pub(super) fn open_with(&self, more: Vec<String>) -> Result<ScenarioFile, ExperimentError> {
        self.open_tracked_by(&TrackerArguments::default(), more)
    }

    /// As [`Self::open_with`], with these trackers, whose settings the overrides may name.
    pub(super) fn open_tracked_by(
        &self,
        trackers: &TrackerArguments,
        more: Vec<String>,
    ) -> Result<ScenarioFile, ExperimentError> {
        let (path, overrides) = self.parts();
        let own = || path.map_or_else(|| ScenarioFile::built_in(&[]), |path| ScenarioFile::open(path, &[]));
        let chosen = if trackers.is_empty() { None } else { trackers.assignment(&own()?.scenario)? };
        let before = usize::from(chosen.is_some());
        let overrides = overrides.into_iter().flat_map(|assignment| of_all_programs(trackers, assignment));
        let overrides: Vec<String> = chosen.into_iter().chain(overrides).chain(more).collect();
        let file = match path {
            Some(path) => ScenarioFile::open(path, &overrides),
            None => ScenarioFile::built_in(&overrides),
        }?;
        self.repeated(&file, trackers, before).map_or(Ok(()), Err)?;
        Ok(file)
    }

    /// The error of a key that is given twice: the first value would have no effect. `before` is the number of
    /// overrides of `file` before those that are given.
    fn repeated(&self, file: &ScenarioFile, trackers: &TrackerArguments, before: usize) -> Option<ExperimentError> {
        let given = self.parts().1;
        let mut full = file.overridden_keys().skip(before);
        let mut earlier: Vec<(&str, Vec<&str>)> = Vec::new();
        for assignment in &given {
            // one value may be for all programs and the other for one of them
            let count = of_all_programs(trackers, assignment.clone()).len();
            let keys: Vec<&str> = full.by_ref().take(count).collect();
            if let Some((other, _)) = earlier.iter().find(|(_, known)| *known == keys) {
                let keys = keys.join(" and ");
                let detail =
                    format!("`{other}` and `{assignment}` both set {keys}, so one would be lost; give it once");
                return Some(ExperimentError::Argument { argument: "KEY=VALUE", detail });
            }
            earlier.push((assignment.as_str(), keys));
        }
        None
    }

    pub(super) fn repeated_key(&self, file: &ScenarioFile) -> Option<ExperimentError> {
        self.repeated(file, &TrackerArguments::default(), 0)
    }

    pub(super) fn survey(&self) -> Result<Survey, ExperimentError> {
        let (path, overrides) = self.parts();
        Ok(survey(path, &overrides)?)
    }

    pub(super) fn file(&self) -> Option<&Path> {
        self.parts().0
    }

    pub(super) fn assignments(&self) -> Vec<String> {
        self.parts().1
    }

    /// Whether neither a file nor an override is given.
    pub(super) fn is_default(&self) -> bool {
        self.file().is_none() && !self.has_overrides()
    }

    pub(super) fn has_overrides(&self) -> bool {
        !self.parts().1.is_empty()
    }

    fn parts(&self) -> (Option<&Path>, Vec<String>) {
        parts(self.scenario.as_deref(), &self.overrides)
    }

    /// Directory to search for clips.
    pub(super) fn mocap_directory(&self) -> Option<PathBuf> {
        self.mocap_dir.clone().or_else(|| std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from))
    }
}

/// The file, if one is named, and the overrides.
pub(super) fn parts<'a>(first: Option<&'a Path>, others: &[String]) -> (Option<&'a Path>, Vec<String>) {
    match first.and_then(Path::to_str).filter(|text| text.contains('=') && !Path::new(text).exists()) {
        Some(assignment) => (None, [&[assignment.to_owned()][..], others].concat()),
        None => (first, others.to_vec()),
    }
}

/// An override, once for each program that has its key as a placeholder.
fn of_all_programs(trackers: &TrackerArguments, assignment: String) -> Vec<String> {
    let Some((key, value)) = assignment.split_once('=') else { return vec![assignment] };
    let keys = trackers.shared_setting(key.trim());
    if keys.is_empty() { vec![assignment] } else { keys.iter().map(|key| format!("{key}={value}")).collect() }
}
