//! What this program wrote, told by its content: only that is replaced without being asked.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::comparison::{COMPARISON_FILE, COMPARISON_PAGE};
use super::model_file::is_model;
use super::results::{CONTACT_SHEET_FILE, PER_FRAME_FILE, REPORT_FILE, RUN_FILE};
use super::run::SCENARIO_FILE;
use super::tracking::{POSES_FILE, SEARCH_FILE, TRACK_FILE};
use crate::benchmark_set::holds_only_a_set;

/// How much of a file is looked at for the mark of this program.
const HEAD_BYTES: u64 = 1024;

/// How a manual page of this program begins, its version left out.
pub const MANUAL_MARK: &str = ".\\\" skiagraph ";

/// Kinds of directories that this program writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A run, of one tracker or of several methods.
    Run,
    /// A benchmark set.
    Set,
}

/// Whether `path` is a directory that holds nothing but a result of that kind; an empty one is nobody's loss.
pub(crate) fn is_ours(path: &Path, kind: Kind) -> bool {
    if path.is_symlink() || !path.is_dir() {
        return false;
    }
    let Some(entries) = entries(path) else { return false };
    entries.is_empty()
        || match kind {
            Kind::Run => is_run(path, &entries) || is_comparison(path, &entries),
            Kind::Set => holds_only_a_set(path),
        }
}

/// One tracker's run: `run` and `track` write a `track.json` beside the poses. Poses without one are another program's.
fn is_run(path: &Path, entries: &BTreeMap<String, bool>) -> bool {
    let tracked = has_schema(&path.join(TRACK_FILE), "skiagraph.track/");
    let known = |(name, is_directory): (&String, &bool)| match name.as_str() {
        RUN_FILE => has_schema(&path.join(RUN_FILE), "skiagraph.run/"),
        TRACK_FILE | POSES_FILE | SEARCH_FILE => tracked,
        CONTACT_SHEET_FILE | PER_FRAME_FILE | REPORT_FILE | SCENARIO_FILE => !is_directory,
        _ => false,
    };
    tracked && entries.iter().all(known)
}

/// A run of several methods: `comparison.json` names the folders, each of which is a run.
fn is_comparison(path: &Path, entries: &BTreeMap<String, bool>) -> bool {
    #[derive(Deserialize)]
    struct Methods {
        methods: BTreeMap<String, IgnoredAny>,
    }
    let file = path.join(COMPARISON_FILE);
    if !has_schema(&file, "skiagraph.comparison/") {
        return false;
    }
    let Some(found) = fs::read(&file).ok().and_then(|bytes| serde_json::from_slice::<Methods>(&bytes).ok()) else {
        return false;
    };
    let known = |(name, is_directory): (&String, &bool)| match name.as_str() {
        COMPARISON_FILE | COMPARISON_PAGE | SCENARIO_FILE => !is_directory,
        method if found.methods.contains_key(method) => {
            let folder = path.join(method);
            entries_of_directory(&folder).is_some_and(|entries| is_run(&folder, &entries))
        }
        _ => false,
    };
    entries.iter().all(known)
}

/// Whether `path` is a file that this program wrote: a page, a picture, a manual page, a JSON object or a model, by its mark.
pub(crate) fn is_file_of_ours(path: &Path) -> bool {
    let Some(head) = head(path) else { return false };
    let text = String::from_utf8_lossy(&head);
    let marked = match text.trim_start().as_bytes() {
        [b'{', ..] => schema_of(&text).is_some_and(|schema| schema.starts_with("skiagraph.")),
        [b'<', ..] => {
            text.contains("<meta name=\"generator\" content=\"skiagraph ") || text.contains("<metadata>skiagraph ")
        }
        [b'.', b'\\', b'"', ..] => text.starts_with(MANUAL_MARK),
        _ => false,
    };
    marked || (head.starts_with(b"PK") && is_model(path))
}

/// Whether a file is a JSON object that begins with a `schema` of that kind.
fn has_schema(path: &Path, kind: &str) -> bool {
    let head = head(path);
    head.is_some_and(|head| schema_of(&String::from_utf8_lossy(&head)).is_some_and(|schema| schema.starts_with(kind)))
}

/// The value of `schema`, the first key of every JSON file of ours.
fn schema_of(text: &str) -> Option<&str> {
    let rest = text.trim_start().strip_prefix('{')?.trim_start().strip_prefix("\"schema\"")?;
    rest.trim_start().strip_prefix(':')?.trim_start().strip_prefix('"')?.split('"').next()
}

/// The first bytes of a regular file.
fn head(path: &Path) -> Option<Vec<u8>> {
    if !path.symlink_metadata().ok()?.is_file() {
        return None;
    }
    let mut head = Vec::new();
    fs::File::open(path).ok()?.take(HEAD_BYTES).read_to_end(&mut head).ok()?;
    Some(head)
}

fn entries_of_directory(path: &Path) -> Option<BTreeMap<String, bool>> {
    if path.is_symlink() { None } else { entries(path) }
}

/// Names of all entries, and whether each is a directory; `None` if one cannot be read or named, or is neither that nor a file.
fn entries(path: &Path) -> Option<BTreeMap<String, bool>> {
    let entry = |entry: std::io::Result<fs::DirEntry>| {
        let entry = entry.ok()?;
        let kind = entry.file_type().ok()?;
        let name = entry.file_name().into_string().ok()?;
        (kind.is_dir() || kind.is_file()).then_some((name, kind.is_dir()))
    };
    fs::read_dir(path).ok()?.map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    const TRACK: (&str, &str) = ("track.json", "{\n  \"schema\": \"skiagraph.track/1\"\n}");
    const RUN: (&str, &str) = ("run.json", "{\"schema\": \"skiagraph.run/1\"}");

    #[test]
    fn runs_of_one_tracker_and_of_several_methods_are_ours() {
        let comparison =
            ("comparison.json", "{\"schema\": \"skiagraph.comparison/1\", \"methods\": {\"a\": {\"mean\": 1}}}");
        let track = ("a/track.json", TRACK.1);
        for files in [&[TRACK][..], &[TRACK, RUN, ("poses.npz", ""), ("scenario.toml", "")], &[comparison, track], &[]]
        {
            assert!(is_ours(folder(files).path(), Kind::Run), "{files:?}");
        }
        let foreign: [&[(&str, &str)]; 8] = [
            &[("poses.npz", "years of work")],
            &[RUN, ("poses.npz", "years of work")],
            &[("scenario.toml", "schema = \"skiagraph.scenario/1\"")],
            &[("track.json", "{\"schema\": \"other\"}")],
            &[TRACK, ("notes.txt", "")],
            &[TRACK, ("run.json", "[]")],
            &[comparison, track, ("b/track.json", TRACK.1)],
            &[comparison, track, ("a/notes.txt", "")],
        ];
        for files in foreign {
            assert!(!is_ours(folder(files).path(), Kind::Run), "{files:?}");
        }
        assert!(!is_ours(folder(&[TRACK]).path(), Kind::Set));
    }

    #[test]
    fn files_are_ours_by_their_mark_and_not_by_their_name() {
        let root = folder(&[
            ("page.html", "<!doctype html>\n<meta name=\"generator\" content=\"skiagraph 0.0.1\">"),
            ("chart.svg", "<svg width=\"9\"><metadata>skiagraph 9.0.0</metadata></svg>"),
            ("skiagraph.1", ".\\\" skiagraph 0.1.0\n.TH skiagraph 1"),
            ("run.json", RUN.1),
            ("thesis.html", "<!doctype html><p>skiagraph is a tool"),
            ("other.json", "{\"schema\": \"http://json-schema.org\"}"),
            ("scenario.toml", "schema = \"skiagraph.scenario/1\""),
            ("walk.model", "PK not really"),
            ("empty", ""),
        ]);
        let ours = |name: &str| is_file_of_ours(&root.path().join(name));
        for name in ["page.html", "chart.svg", "skiagraph.1", "run.json"] {
            assert!(ours(name), "{name}");
        }
        for name in ["thesis.html", "other.json", "scenario.toml", "walk.model", "empty", "nowhere", "."] {
            assert!(!ours(name), "{name}");
        }
    }
}
