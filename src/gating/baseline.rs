//! Baselines: small files with the values of measured runs, to be committed and compared with later runs.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use serde_json::ser::{Formatter, PrettyFormatter, Serializer};

use crate::artefacts::{Destination, put_file};
use crate::common::{ExperimentError, read_file};
use crate::runs::read_runs;
use crate::runs::reading::hints_of_runs;
use crate::scenario::json_tree;
use skiagraph_core::input::{excerpt, foreign, is_own_output, limits, unquoted};
use skiagraph_eval::{FEWEST_SEEDS, IntervalUnit, MeasuredRuns};

pub const BASELINES: &str = "results/baselines";

const SCHEMA: &str = "skiagraph.baseline/1";
const LONGEST_NAME: usize = 64;

/// Values of measured runs: `results/baselines/NAME.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// `skiagraph.baseline/1`.
    pub schema: String,
    pub name: String,
    /// Version of the program that saved it.
    pub version: String,
    /// Hints of its runs about estimates that may have been misread, each with its clip.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misread: Vec<String>,
    /// Values per clip x seed, with set hashes, protocols and settings.
    #[serde(flatten)]
    pub runs: MeasuredRuns,
}

/// A baseline's name, and its content or the error of reading it.
pub type Listed = (String, Result<Baseline, ExperimentError>);

#[derive(Clone, Debug, PartialEq)]
pub struct Saved {
    pub baseline: Baseline,
    pub path: PathBuf,
    pub replaced: Option<Baseline>,
}

impl Baseline {
    /// `skiagraph baseline save`.
    pub fn save(name: &str, runs: &[PathBuf], folder: &Path, force: bool) -> Result<Saved, ExperimentError> {
        check_name(name)?;
        let path = folder.join(format!("{name}.json"));
        let measured = read_runs(runs)?;
        if let Some(detail) = too_few(&measured) {
            return Err(ExperimentError::Argument { argument: "RUN", detail });
        }
        let replaced = Self::read_file(&path).ok();
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let misread = runs.iter().flat_map(|run| hints_of_runs(run)).collect();
        let baseline = Self { schema: SCHEMA.to_owned(), name: name.to_owned(), version, misread, runs: measured };
        put_file(Destination { path: &path, force }, &baseline.to_bytes()?)?;
        Ok(Saved { baseline, path, replaced })
    }

    /// The baseline with this name, or in this `.json` file.
    pub fn read(name: &str, folder: &Path) -> Result<Self, ExperimentError> {
        let as_file = Path::new(name);
        if name.ends_with(".json") && as_file.is_file() {
            return Self::read_file(as_file);
        }
        check_name(name)?;
        let path = folder.join(format!("{name}.json"));
        if path.exists() {
            return Self::read_file(&path);
        }
        let there: Vec<String> = Self::list(folder)?.into_iter().map(|(name, _)| name).collect();
        let known = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
        let elsewhere = folder != Path::new(BASELINES);
        let to = if elsewhere { format!(" --baselines {}", folder.display()) } else { String::new() };
        let detail =
            format!("no baseline has this name (known: {known}); save one with skiagraph baseline save {name} RUN{to}");
        Err(ExperimentError::Malformed { path, detail })
    }

    /// Names of all baselines in a folder, in alphabetical order, each with its content or the error of reading it.
    pub fn list(folder: &Path) -> Result<Vec<Listed>, ExperimentError> {
        if !folder.exists() {
            return Ok(Vec::new());
        }
        let unreadable = |source| ExperimentError::Unreadable { path: folder.to_owned(), source };
        let entries = fs::read_dir(folder).map_err(unreadable)?;
        let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|extension| extension == "json") && path.is_file());
        files.sort();
        let name = |path: &PathBuf| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(files.iter().map(|path| (name(path), Self::read_file(path))).collect())
    }

    pub(super) fn read_file(path: &Path) -> Result<Self, ExperimentError> {
        Self::from_bytes(path, &read_file(path, limits::RECORD)?)
    }

    /// The baseline with this content; `path` is named in errors.
    pub(super) fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ExperimentError> {
        let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
        let tree: Value = serde_json::from_slice(bytes).map_err(|e| malformed(unquoted(e)))?;
        match tree.get("schema").and_then(Value::as_str) {
            Some(SCHEMA) => {}
            Some(newer) if newer.starts_with("skiagraph.baseline/") => {
                return Err(malformed(format!(
                    "expected the schema {SCHEMA}, found {}: a newer version of skiagraph saved it; save it again with \
                     this one, or update",
                    excerpt(newer)
                )));
            }
            other => {
                let found = other.filter(|_| is_own_output(bytes)).map_or_else(|| "none".to_owned(), excerpt);
                return Err(malformed(format!("expected the schema {SCHEMA}, found {found}")));
            }
        }
        let baseline: Self = json_tree::value(tree).map_err(|e| malformed(foreign(e)))?;
        for (name, clip) in baseline.runs.sets() {
            let seeds = clip.seeds.len();
            let lists = clip.metrics.iter().map(|(metric, m)| (metric, m.per_seed.len()));
            let joints = clip.joints.iter().map(|(joint, values)| (joint, values.len()));
            if let Some((list, found)) = lists.chain(joints).find(|(_, found)| *found != seeds) {
                return Err(malformed(format!(
                    "clips.{name}: {list}: expected one value per seed ({seeds}), found {found}"
                )));
            }
        }
        Ok(baseline)
    }

    fn to_bytes(&self) -> Result<Vec<u8>, ExperimentError> {
        let mut bytes = Vec::new();
        let mut serializer = Serializer::with_formatter(&mut bytes, ListsOnOneLine::default());
        self.serialize(&mut serializer)?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}

/// A message if gates cannot use these runs, because they have too few seeds, draws and clips.
fn too_few(runs: &MeasuredRuns) -> Option<String> {
    if IntervalUnit::ALL.into_iter().any(|unit| runs.has_at_least(FEWEST_SEEDS, unit)) {
        return None;
    }
    let (clip, few) = runs.sets().find(|(_, set)| set.seeds.len() < FEWEST_SEEDS || set.are_copies())?;
    let found = few.seeds.len();
    Some(if few.are_copies() {
        format!(
            "the {found} runs of `{clip}` are identical, because the tracker draws no random numbers; copies count as one \
             observation, so a baseline needs {FEWEST_SEEDS} draws of the observation's noise or {FEWEST_SEEDS} clips \
             instead (docs/ci.md)"
        )
    } else {
        format!(
            "expected {FEWEST_SEEDS} or more seeds of `{clip}`, found {found}; run it with --seeds 10, or, if the tracker \
             draws no random numbers, on {FEWEST_SEEDS} draws of the observation's noise or {FEWEST_SEEDS} clips \
             (docs/ci.md)"
        )
    })
}

fn check_name(name: &str) -> Result<(), ExperimentError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let is_name = !name.is_empty() && name.len() <= LONGEST_NAME && !name.starts_with('.') && name.chars().all(allowed);
    if is_name {
        return Ok(());
    }
    let detail =
        format!("`{}`: expected at most {LONGEST_NAME} letters, digits, -, _ and . (not first)", excerpt(name));
    Err(ExperimentError::Argument { argument: "NAME", detail })
}

/// Pretty JSON with every list of values on one line, so that a changed value changes one line.
#[derive(Default)]
struct ListsOnOneLine(PrettyFormatter<'static>);

impl Formatter for ListsOnOneLine {
    fn begin_array_value<W: ?Sized + std::io::Write>(&mut self, writer: &mut W, first: bool) -> std::io::Result<()> {
        writer.write_all(if first { b"" } else { b", " })
    }

    fn begin_object<W: ?Sized + std::io::Write>(&mut self, writer: &mut W) -> std::io::Result<()> {
        self.0.begin_object(writer)
    }

    fn end_object<W: ?Sized + std::io::Write>(&mut self, writer: &mut W) -> std::io::Result<()> {
        self.0.end_object(writer)
    }

    fn begin_object_key<W: ?Sized + std::io::Write>(&mut self, writer: &mut W, first: bool) -> std::io::Result<()> {
        self.0.begin_object_key(writer, first)
    }

    fn begin_object_value<W: ?Sized + std::io::Write>(&mut self, writer: &mut W) -> std::io::Result<()> {
        self.0.begin_object_value(writer)
    }

    fn end_object_value<W: ?Sized + std::io::Write>(&mut self, writer: &mut W) -> std::io::Result<()> {
        self.0.end_object_value(writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_eval::{MeasuredClip, MeasuredMetric, Unit};
    use std::collections::BTreeMap;

    fn baseline() -> Baseline {
        let per_seed = vec![Some(30.1), Some(1.0 / 3.0), None, Some(2.0), Some(1e-12)];
        let metric = MeasuredMetric { unit: Unit::Millimetre, protocol: "none".to_owned(), per_seed: per_seed.clone() };
        let clip = MeasuredClip {
            set_hash: "ab".to_owned(),
            scene_hash: None,
            frames: 4,
            frames_per_second: 60.0,
            tracker: "frozen".to_owned(),
            settings: Some(serde_json::json!({"frozen": {}})),
            version: "0.1.0".to_owned(),
            seeds: (0..5).collect(),
            metrics: BTreeMap::from([("humaneva_mm".to_owned(), metric)]),
            joints: BTreeMap::from([("pelvis".to_owned(), per_seed)]),
        };
        let runs = MeasuredRuns { clips: BTreeMap::from([("walk".to_owned(), clip)]), ..MeasuredRuns::default() };
        Baseline {
            schema: SCHEMA.to_owned(),
            name: "walk".to_owned(),
            version: "0.1.0".to_owned(),
            misread: Vec::new(),
            runs,
        }
    }

    #[test]
    fn a_baseline_keeps_every_bit_and_has_one_line_per_metric() {
        let folder = tempfile::tempdir().unwrap();
        let bytes = baseline().to_bytes().unwrap();
        fs::write(folder.path().join("walk.json"), &bytes).unwrap();
        assert_eq!(Baseline::read("walk", folder.path()).unwrap(), baseline());
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains("\"per_seed\": [30.1, 0.3333333333333333, null, 2.0, 1e-12]\n"), "{text}");
    }

    #[test]
    fn newer_damaged_and_missing_baselines_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let text = String::from_utf8(baseline().to_bytes().unwrap()).unwrap();
        let refused = |text: &str| {
            fs::write(folder.path().join("walk.json"), text).unwrap();
            Baseline::read("walk", folder.path()).unwrap_err().to_string()
        };
        assert!(refused(&text.replace("baseline/1", "baseline/2")).contains("newer version"));
        assert!(refused(&text.replace("baseline/1", "run/1")).contains("found skiagraph.run/1"));
        assert!(refused(&text.replace("null, 2.0, ", "")).contains("expected one value per seed (5), found 3"));
        assert!(refused(&text.replace("30.1", "NaN")).contains("walk.json"));
        fs::write(folder.path().join("walk.json"), &text).unwrap();
        let missing = Baseline::read("jump", folder.path()).unwrap_err().to_string();
        assert!(missing.contains("known: walk") && missing.contains("baseline save jump"), "{missing}");
        for name in ["", "../walk", "a b", ".hidden", &"x".repeat(65)] {
            assert!(Baseline::read(name, folder.path()).is_err(), "{name}");
        }
        assert_eq!(Baseline::list(folder.path()).unwrap().len(), 1);
        assert!(Baseline::list(&folder.path().join("nowhere")).unwrap().is_empty());
    }
}
