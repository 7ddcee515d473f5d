//! `skiagraph verify`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::CommandError;
use super::folders::expect_set;
use super::output::{self, counted};
use super::progress::TerminalProgress;
use super::volume::Volume;
use crate::common::{ExperimentError, Progress, Stage};
use skiagraph_set::{
    BlindSet, Checked, FULL_HASH_COVERS, SET_HASH_COVERS, SetPlace, Verification, VerifyOptions, verify_place,
};

/// Number of faults printed per check; `--json` and `--verbose` list all.
const MOST_PRINTED: usize = 8;

/// Verify a benchmark set: make again what follows from its truth, and compare it byte by byte
///
/// Checks the hashes; that every file can be read; that outside truth/ are only the files that trackers may read;
/// every file that follows from bodies, poses, cameras, settings and key, by making it again; projections by OpenCV's
/// formula; and joints against silhouettes. Facts known only from the scenario or the recording are not checked;
/// docs/sets.md lists them. A set without its truth is verified as far as its files go, and the output says what was
/// not checked. Exit code 1 if anything is wrong, 2 if the directory is not a set.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph verify sets/walk\n  \
                        skiagraph verify sets/walk --every 10    # draw every tenth frame only\n  \
                        skiagraph verify sets/walk --json > proof.json")]
pub(super) struct Arguments {
    /// Directory of the set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Directory of the complete set, if the set was rendered with --truth
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,

    /// Draw images of every Nth frame again; everything else is checked in all frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: u32,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    expect_set(&arguments.set)?;
    let progress = TerminalProgress::new(volume);
    let set = SetPlace { folder: &arguments.set, truth: arguments.truth.as_deref() };
    let every = arguments.every as usize;
    // no progress for a set whose frames cannot be counted
    let frames = BlindSet::read(set.folder).map_or(0, |set| set.frame_count.div_ceil(every.max(1)));
    progress.begin(Stage::Verify, frames);
    let how = VerifyOptions { every, tick: &|| progress.advance(), stop: &|| progress.interrupted() };
    let found = verify_place(set, how);
    drop(progress);
    let found = found.map_err(|e| ExperimentError::from(e).about(&arguments.set))?;
    let place = arguments.set.display().to_string();
    if arguments.json {
        output::print_json(&json!({
            "schema": "skiagraph.verify/1",
            "set": place,
            "name": found.name,
            "set_hash": found.set_hash,
            "full_hash": found.full_hash,
            "sound": found.is_sound(),
            "complete": found.is_complete(),
            "checks": found.checks,
        }))?;
    } else {
        let most = if volume.verbose { usize::MAX } else { MOST_PRINTED };
        let partly = match arguments.every {
            0 | 1 => String::new(),
            every => format!("; images were drawn again in one frame of {every} only"),
        };
        output::print(&(describe(&place, &found, most) + &partly))?;
    }
    Ok(if found.is_sound() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn describe(place: &str, found: &Verification, most: usize) -> String {
    let mut lines: Vec<String> = found.checks.iter().flat_map(|check| describe_check(check, most)).collect();
    let (faults, broken) = (found.faults().count(), found.checks.iter().filter(|c| !c.faults.is_empty()).count());
    let left_out = found.checks.iter().filter(|check| !check.made).count();
    lines.push(format!("  set hash    {} ({SET_HASH_COVERS})", found.set_hash));
    lines.push(format!("  full hash   {} ({FULL_HASH_COVERS})", found.full_hash));
    lines.push(match (faults, left_out) {
        (0, 0) => format!("{place} is sound: {}, no fault", counted(found.checks.len(), "check")),
        (0, _) => format!(
            "{place} is sound as far as its files go: {}, no fault; {left_out} not made",
            counted(found.checks.len() - left_out, "check")
        ),
        _ => format!("{place} is NOT sound: {} in {}", counted(faults, "fault"), counted(broken, "check")),
    });
    lines.join("\n")
}

fn describe_check(check: &Checked, most: usize) -> Vec<String> {
    let verdict = match (check.made, check.faults.is_empty()) {
        (false, _) => "-",
        (true, true) => "ok",
        (true, false) => "FAULT",
    };
    let mut lines = vec![format!("  {verdict:<6}{:<12} {}", check.name, check.looked_at)];
    for fault in check.faults.iter().take(most) {
        let file = if fault.file.is_empty() { String::new() } else { format!("{}: ", fault.file) };
        lines.push(format!("        {file}{}", fault.detail));
    }
    if check.faults.len() > most {
        lines.push(format!("        and {} more; --verbose or --json lists all", check.faults.len() - most));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_set::Fault;

    #[test]
    fn faults_and_checks_not_made_are_counted() {
        let fault = |i: usize| Fault { file: format!("f{i}"), detail: "is wrong".into() };
        let checked = |made, faults| Checked { name: "masks", proves: "", looked_at: "9 masks".into(), made, faults };
        let of = |check| Verification {
            name: "x".into(),
            set_hash: "aa".into(),
            full_hash: "bb".into(),
            checks: vec![check],
        };
        let words = describe("s", &of(checked(true, (0..11).map(fault).collect())), 8);
        assert!(words.contains("FAULT masks") && words.contains("f7: is wrong") && !words.contains("f8"), "{words}");
        assert!(words.contains("and 3 more") && words.ends_with("s is NOT sound: 11 faults in 1 check"), "{words}");
        let not_made = of(checked(false, Vec::new()));
        assert!(!not_made.is_complete() && describe("s", &not_made, 8).ends_with("0 checks, no fault; 1 not made"));
        assert!(describe("s", &of(checked(true, Vec::new())), 8).ends_with("s is sound: 1 check, no fault"));
    }
}
