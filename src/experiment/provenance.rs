//! Recognises files written by skiagraph by their content; only these are replaced without --force.

use std::fs;
use std::io::Read;
use std::path::Path;

use super::model_file::is_model;
use super::ownership;
use crate::benchmark_set::{holds_only_a_set, verify_hashes};

/// How much of a file is looked at for the mark of this program.
const HEAD_BYTES: u64 = 1024;

/// How a manual page of this program begins, its version left out.
pub const MANUAL_MARK: &str = ".\\\" skiagraph ";

/// Kinds of directories that this program writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ResultKind {
    /// A run, of one tracker or of several methods.
    Run,
    /// A benchmark set.
    Set,
    /// A set in another format.
    Export,
    /// Figures and their captions.
    Figures,
}

/// Whether `path` is a directory that holds nothing but a result of that kind; an empty one may be replaced too.
pub(crate) fn is_own_output(path: &Path, kind: ResultKind) -> bool {
    if path.is_symlink() || !path.is_dir() {
        return false;
    }
    let is_empty = fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
    is_empty
        || match kind {
            ResultKind::Run | ResultKind::Export => ownership::is_signed(path),
            ResultKind::Figures => ownership::is_signed(path) && holds_figures_alone(path),
            ResultKind::Set => holds_only_a_set(path) && verify_hashes(path).is_ok(),
        }
}

/// Whether a folder holds pictures in SVG, their captions and a listing: a run is no figure, and not replaced by some.
fn holds_figures_alone(folder: &Path) -> bool {
    let is_one = |entry: std::io::Result<fs::DirEntry>| {
        entry.is_ok_and(|entry| {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            name.ends_with(".svg") || name == "README.txt" || name == ownership::LISTING
        })
    };
    fs::read_dir(folder).is_ok_and(|mut entries| entries.all(is_one))
}

/// Whether `path` is a file that this program wrote: a page, a picture, a manual page, a JSON object or a model, by its
/// mark.
pub(crate) fn is_own_file(path: &Path) -> bool {
    let Some(head) = head(path) else { return false };
    let text = String::from_utf8_lossy(&head);
    let marked = match text.trim_start().as_bytes() {
        [b'{', ..] => schema_of(&text).is_some_and(|schema| schema.starts_with("skiagraph.")),
        [b'<', ..] => {
            text.contains("<meta name=\"generator\" content=\"skiagraph ")
                || text.contains("<metadata>skiagraph ")
                || text.starts_with("<!-- skiagraph ")
        }
        [b'.', b'\\', b'"', ..] => text.starts_with(MANUAL_MARK),
        _ if head.starts_with(b"\x89PNG") => text.contains("Software\0skiagraph "),
        _ => false,
    };
    marked || (head.starts_with(b"PK") && is_model(path))
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

    #[test]
    fn a_run_is_ours_once_it_is_listed_and_never_for_its_names() {
        let run = folder(&[("track.json", "{}"), ("poses.npz", "years of work")]);
        assert!(!is_own_output(run.path(), ResultKind::Run));
        ownership::sign(run.path()).unwrap();
        assert!(is_own_output(run.path(), ResultKind::Run) && !is_own_output(run.path(), ResultKind::Set));
        assert!(is_own_output(folder(&[]).path(), ResultKind::Run), "an empty directory is nobody's loss");
    }

    #[test]
    fn files_are_ours_by_their_mark_and_not_by_their_name() {
        let root = folder(&[
            ("page.html", "<!doctype html>\n<meta name=\"generator\" content=\"skiagraph 0.0.1\">"),
            ("chart.svg", "<svg width=\"9\"><metadata>skiagraph 9.0.0</metadata></svg>"),
            ("study.md", "<!-- skiagraph 0.1.0 -->\n# study"),
            ("skiagraph.1", ".\\\" skiagraph 0.1.0\n.TH skiagraph 1"),
            ("run.json", "{\"schema\": \"skiagraph.run/1\"}"),
            ("thesis.html", "<!doctype html><p>skiagraph is a tool"),
            ("other.json", "{\"schema\": \"http://json-schema.org\"}"),
            ("scenario.toml", "schema = \"skiagraph.scenario/1\""),
            ("walk.model", "PK not really"),
            ("empty", ""),
        ]);
        let ours = |name: &str| is_own_file(&root.path().join(name));
        for name in ["page.html", "study.md", "chart.svg", "skiagraph.1", "run.json"] {
            assert!(ours(name), "{name}");
        }
        for name in ["thesis.html", "other.json", "scenario.toml", "walk.model", "empty", "nowhere", "."] {
            assert!(!ours(name), "{name}");
        }
    }
}
