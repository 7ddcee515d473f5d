//! Two measured runs compared.

use std::path::{Path, PathBuf};

use super::Measured;
use crate::common::ExperimentError;
use crate::runs::reading::ComparedSide;
use skiagraph_eval::{RunComparison, compare_runs};

/// One side of a comparison: a measured run in memory, or folders of measured runs on disk.
#[derive(Clone, Copy, Debug)]
pub enum RunSide<'a> {
    /// What [`measure`](fn@crate::measure) returned.
    Measured(&'a Measured),
    /// A run's folder, or a folder with runs: clips, draws of their noise, or seeds.
    Folder(&'a Path),
}

impl<'a> From<&'a Measured> for RunSide<'a> {
    fn from(measured: &'a Measured) -> Self {
        Self::Measured(measured)
    }
}

impl<'a> From<&'a Path> for RunSide<'a> {
    fn from(folder: &'a Path) -> Self {
        Self::Folder(folder)
    }
}

/// Compares two measured runs on the same sets, as `skiagraph compare`: the difference `other - base` of every metric
/// with its 95 % interval over clips, draws of the noise, or seeds.
///
/// ```
/// use skiagraph::{ScenarioFile, TrackerSettings, compare, measure, render, track};
/// let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &["last_frame=4".to_owned()])?;
/// let (set, _notes) = render(&scenario, None)?;
/// let filter = TrackerSettings::named("annealed_particle_filter")?;
/// let filter = filter.overridden(&["particles=20".to_owned(), "layers=2".to_owned()])?;
/// let seeds = [0, 1, 2];
/// let filtered = measure(&set, &track(&set.blind, &filter, &seeds)?)?;
/// let still = measure(&set, &track(&set.blind, &TrackerSettings::named("frozen")?, &seeds)?)?;
/// let comparison = compare(&still, &filtered)?;
/// assert!(comparison.others[0].metrics.iter().any(|metric| metric.metric == "humaneva_mm"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ExperimentError`] naming the file that cannot be read, or the difference that makes the sides incomparable, such
/// as different sets of the same name.
pub fn compare<'a>(
    base: impl Into<RunSide<'a>>,
    other: impl Into<RunSide<'a>>,
) -> Result<RunComparison, ExperimentError> {
    let (base, other) = (base.into().read("base")?, other.into().read("other")?);
    let mut comparison = compare_runs((&base.name, &base.runs), &[(&other.name, &other.runs)], false, None)?;
    comparison.base.misread = base.misread;
    for facts in &mut comparison.others {
        facts.side.misread.clone_from(&other.misread);
    }
    Ok(comparison)
}

impl RunSide<'_> {
    /// Its runs; one in memory is called `name`.
    fn read(self, name: &str) -> Result<ComparedSide, ExperimentError> {
        match self {
            Self::Measured(measured) => Ok(ComparedSide {
                name: name.to_owned(),
                runs: measured.runs(),
                misread: measured.hint.iter().cloned().collect(),
            }),
            Self::Folder(folder) => ComparedSide::new(folder.display().to_string(), &[PathBuf::from(folder)]),
        }
    }
}
