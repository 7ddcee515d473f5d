//! The versions of a baseline: of the commits of its file, or of several files.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::Baseline;
use crate::common::ExperimentError;
use crate::evaluation::{Metric, find_metric, mean, mean_interval};
use crate::input::{excerpt, hex_sha256};
use crate::report::{BaselineVersion, VersionValue};

/// Greatest number of commits.
const MOST: &str = "500";
/// The metrics of the history.
const METRICS: [&str; 4] = ["humaneva_mm", "lost_limb", "pck150", "track_loss"];
/// Digits of a commit that are shown.
const DIGITS: usize = 10;

/// Reads the versions of a baseline, the oldest first: of several files in their order, without git; of a single one
/// from the commits of its file, and the file itself if it was changed since.
///
/// # Errors
/// [`ExperimentError`] for a file that is no baseline, and for a single file that git does not have.
pub fn baseline_versions(files: &[PathBuf]) -> Result<Vec<BaselineVersion>, ExperimentError> {
    let [file] = files else {
        return files.iter().map(|path| Ok(version(name_of(path), &Baseline::read_file(path)?))).collect();
    };
    let own = Baseline::read_file(file)?;
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let log = git(folder, &["log", "-n", MOST, "--reverse", "--format=%H%x09%cs%x09%s", "--", &name])?;
    let (mut versions, mut last) = (Vec::new(), None);
    for line in log.lines() {
        let mut words = line.splitn(3, '\t');
        let [Some(commit), Some(date), subject] = [words.next(), words.next(), words.next()] else { continue };
        // the commit that removed the file has none
        let Ok(text) = git(folder, &["show", &format!("{commit}:./{name}")]) else { continue };
        let label = format!("{date} {}", commit.get(..DIGITS).unwrap_or(commit));
        let about = excerpt(subject.unwrap_or_default());
        versions.push(match Baseline::from_bytes(file, text.as_bytes()) {
            Ok(baseline) => BaselineVersion { about, ..version(label, &baseline) },
            Err(error) => BaselineVersion { label, about: format!("{about} ({error})"), ..BaselineVersion::default() },
        });
        last = Some(text);
    }
    if versions.is_empty() {
        return Err(refused(&format!("git has no commit of {}", file.display())));
    }
    if last.is_none_or(|last| Baseline::from_bytes(file, last.as_bytes()).ok().as_ref() != Some(&own)) {
        versions.push(BaselineVersion { about: "not committed".to_owned(), ..version(name, &own) });
    }
    Ok(versions)
}

fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The values of a baseline.
fn version(label: String, baseline: &Baseline) -> BaselineVersion {
    let sets: Vec<&str> = baseline.runs.sets().map(|(_, set)| set.set_hash.as_str()).collect();
    let values = METRICS.iter().filter_map(|name| find_metric(name));
    BaselineVersion {
        label,
        about: String::new(),
        version: baseline.version.clone(),
        clips: baseline.runs.clips.len(),
        runs: baseline.runs.runs(),
        sets: hex_sha256(sets.concat().as_bytes()),
        values: values.map(|metric| value(baseline, metric)).collect(),
    }
}

/// The mean over clips of a metric, with its interval.
fn value(baseline: &Baseline, metric: &'static Metric) -> VersionValue {
    let of_clip = |name: &String| -> Vec<f64> {
        let sets = baseline.runs.sets_of(name).into_iter();
        sets.flat_map(|set| set.values(metric.name)).map(|(_, value)| value).collect()
    };
    let clips: Vec<Vec<f64>> = baseline.runs.clips.keys().map(of_clip).filter(|values| !values.is_empty()).collect();
    let means: Vec<f64> = clips.iter().filter_map(|values| mean(values)).collect();
    let interval = mean_interval(&clips, metric.value_range()).map(|(interval, _)| interval);
    VersionValue { metric, mean: mean(&means), ends: interval.map(|ends| [ends.low, ends.high]) }
}

/// What git prints.
fn git(folder: &Path, arguments: &[&str]) -> Result<String, ExperimentError> {
    let done = Command::new("git").arg("-C").arg(folder).args(arguments).output();
    let done = done.map_err(|error| refused(&format!("git cannot be started ({error})")))?;
    if done.status.success() {
        return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
    }
    Err(refused(&format!("git says: {}", excerpt(String::from_utf8_lossy(&done.stderr).trim()))))
}

fn refused(why: &str) -> ExperimentError {
    let detail = format!(
        "{why}; expected the file of a baseline with commits, or several versions of it in their order: --history \
         old.json new.json"
    );
    ExperimentError::Argument { argument: "--history", detail }
}
