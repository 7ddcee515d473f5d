//! `--quiet` and `--verbose`, the same for all commands.

use std::fs;
use std::io::Write;
use std::path::Path;

use clap::Args;

use skiagraph_core::input::plain;

/// How much a command prints besides its result.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct Volume {
    /// Print results and errors only: no progress, no notes
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(super) quiet: bool,

    /// Also print the time of each stage and the files written
    #[arg(short, long, global = true)]
    pub(super) verbose: bool,
}

impl Volume {
    /// Prints notes on standard error, unless `--quiet` is given.
    pub(super) fn notes(self, notes: &[String]) {
        if !self.quiet {
            notes.iter().for_each(|note| note_on_stderr(note));
        }
    }

    /// With `--verbose`, lists the files at `path` with their sizes.
    pub(super) fn written(self, path: &Path) {
        if self.verbose {
            files(path).iter().for_each(|(file, bytes)| note_on_stderr(&format!("wrote {file}, {}", size(*bytes))));
        }
    }
}

/// A failure to write to standard error is ignored, since it could not be reported anywhere.
pub(super) fn note_on_stderr(note: &str) {
    writeln!(std::io::stderr(), "note: {}", plain(note)).ok();
}

pub(super) fn size(bytes: u64) -> String {
    let value = bytes as f64;
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", value / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", value / 1e6),
        _ => format!("{:.1} GB", value / 1e9),
    }
}

pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// The file at `path`, or the entries of a directory, with sizes; a subdirectory includes everything below it.
fn files(path: &Path) -> Vec<(String, u64)> {
    if !path.is_dir() {
        return vec![(path.display().to_string(), bytes_below(path))];
    }
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    let mut found: Vec<_> = entries.map(|e| (e.path().display().to_string(), bytes_below(&e.path()))).collect();
    found.sort();
    found
}

fn bytes_below(path: &Path) -> u64 {
    match path.symlink_metadata() {
        Ok(found) if found.is_dir() => {
            fs::read_dir(path).into_iter().flatten().flatten().map(|entry| bytes_below(&entry.path())).sum()
        }
        Ok(found) => found.len(),
        Err(_) => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_readable_units() {
        assert_eq!([999, 1_500, 2_340_000, 7_100_000_000].map(size), ["999 B", "1.5 kB", "2.3 MB", "7.1 GB"]);
    }

    #[test]
    fn durations_have_readable_units() {
        assert_eq!([0.04, 19.7, 300.0, 90_000.0].map(duration), ["0.0 s", "20 s", "5 min", "25.0 h"]);
    }

    #[test]
    fn the_size_of_a_subdirectory_includes_everything_below_it() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join("deep")).unwrap();
        fs::write(root.path().join("deep/a"), [0; 5]).unwrap();
        fs::write(root.path().join("b"), [0; 3]).unwrap();
        let sizes: Vec<u64> = files(root.path()).into_iter().map(|(_, bytes)| bytes).collect();
        assert_eq!(sizes, [3, 5]);
    }
}
