//! Advice on running the further seeds, draws or clips that would decide a gate.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::Baseline;
use super::run_reading::{MORE_SEEDS, read_runs, run_folders};
use crate::evaluation::{IntervalUnit, MeasuredClip, MoreSeeds, describe_seeds};
use crate::external::{EXTERNAL_FILE, ExternalRecord, ProgramOptions};
use crate::input::{self, limits, shell_word};
use crate::measure::tracked::TRACK_FILE;

/// Greatest number of commands in the advice.
const MOST_COMMANDS: usize = 3;

/// Advice on the draws or clips that checks lack; `None` if more would not help. Draws and clips are sets, so both
/// sides need them.
pub(super) fn set_advice(
    unit: IntervalUnit,
    baseline: &Baseline,
    lacking: impl IntoIterator<Item = MoreSeeds>,
) -> Option<String> {
    let count = |more| match more {
        MoreSeeds::OfRun(more) | MoreSeeds::OfBoth(more) => Some(more),
        MoreSeeds::TooMany => None,
    };
    let more = lacking.into_iter().filter_map(count).max()?;
    let sets = match unit {
        IntervalUnit::Draws => {
            format!(
                "{more} more draw(s) of every clip: skiagraph render SCENARIO observation.seed=N --out SET, with a new N for \
                 each"
            )
        }
        _ => format!("{more} more clip(s): skiagraph render SCENARIO --out SET, with another motion for each"),
    };
    Some(format!(
        "for {sets}; run both trackers on them (skiagraph track SET ... --out RUN, skiagraph evaluate SET RUN), and save \
         the baseline again: skiagraph baseline save {} RUN...",
        baseline.name
    ))
}

/// Advice on the seeds that checks of the runs at these paths lack; `None` if more would not help.
pub(super) fn seed_advice(
    runs: &[PathBuf],
    baseline: &Baseline,
    lacking: impl IntoIterator<Item = MoreSeeds>,
) -> Option<String> {
    let (mut of_run, mut of_both) = (0, 0);
    for more in lacking {
        match more {
            MoreSeeds::OfRun(more) => of_run = of_run.max(more),
            MoreSeeds::OfBoth(more) => of_both = of_both.max(more),
            MoreSeeds::TooMany => {}
        }
    }
    let more = of_run.max(of_both);
    match (more, of_both) {
        (0, _) => None,
        (_, 0) => Some(format!("for {more} more seed(s) of the run: {}", run_commands(runs, baseline, more))),
        _ => Some(format!(
            "run and baseline need {more} more seed(s) each, and --add-seeds only adds those of the run; first add those of \
             the baseline, with its own tracker and settings: {}; then those of the run: {}",
            baseline_commands(baseline, more),
            run_commands(runs, baseline, more)
        )),
    }
}

fn run_commands(runs: &[PathBuf], baseline: &Baseline, more: usize) -> String {
    let folders: Vec<PathBuf> = runs.iter().flat_map(|run| run_folders(run)).collect();
    let by_hand = folders.iter().filter(|folder| !folder.join(TRACK_FILE).is_file());
    let commands: Vec<String> = by_hand.map(|folder| commands_by_hand(folder, more)).collect();
    match commands.len() {
        0 => {
            let runs = runs.iter().map(|run| shown(run)).collect::<Vec<_>>().join(" ");
            format!("skiagraph gate {runs} --baseline {} --add-seeds {more}", baseline.name)
        }
        count if count > MOST_COMMANDS => {
            format!("{}; likewise for {} further runs", commands[..MOST_COMMANDS].join("; "), count - MOST_COMMANDS)
        }
        _ => commands.join("; "),
    }
}

fn commands_by_hand(folder: &Path, more: usize) -> String {
    let clips = read_runs(&[folder.to_owned()]).map(|runs| runs.clips).unwrap_or_default();
    let last = clips.values().flat_map(|clip| &clip.seeds).max().copied();
    let first = last.map_or(0, |last| last.saturating_add(1));
    let seeds: Vec<u64> = (first..first.saturating_add(more as u64)).collect();
    format!("--add-seeds {}", by_hand(folder, &seeds))
}

/// Advice on running these seeds of a run that another program tracked.
pub(super) fn by_hand(folder: &Path, seeds: &[u64]) -> String {
    let cannot = format!("cannot run the tracker of {}", folder.display());
    let record = input::read(&folder.join(EXTERNAL_FILE), limits::RECORD).ok();
    let record = record.and_then(|bytes| serde_json::from_slice::<ExternalRecord>(&bytes).ok());
    let Some(record) = record else {
        return format!("{cannot}; run it with the seeds {}, and evaluate them again", describe_seeds(seeds));
    };
    let blocks = seeds.chunk_by(|seed, next| seed.saturating_add(1) == *next);
    let commands: Vec<String> = blocks
        .take(MOST_COMMANDS)
        .map(|block| {
            let (first, count) = (block[0], block.len());
            let place = shown(&folder.join(format!("{MORE_SEEDS}{first}-{}", block[count - 1])));
            let program = format!("{}{}", shell_word(&record.command), record.options.as_arguments());
            let truth = if record.without_truth { " --truth DIR" } else { "" };
            format!(
                "skiagraph track SET --exec {program} --seed {first} --seeds {count} --out {place}, then skiagraph \
                 evaluate SET {place}{truth}"
            )
        })
        .collect();
    format!("{cannot}; run the program: {}", commands.join("; "))
}

fn baseline_commands(baseline: &Baseline, more: usize) -> String {
    let clips = &baseline.runs.clips;
    let Some(clip) = clips.values().next() else { return String::new() };
    let first = clip.seeds.iter().min().copied().unwrap_or_default();
    let seed = if first > 0 { format!(" --seed {first}") } else { String::new() };
    let seeds = clip.seeds.len() + more;
    let run = match program(clip) {
        Some(command) => {
            let program = format!("{}{}", shell_word(command), options(clip).as_arguments());
            format!("skiagraph track SET --exec {program}{seed} --seeds {seeds} --out DIR, skiagraph evaluate SET DIR")
        }
        None => format!("skiagraph run SCENARIO{seed} --seeds {seeds} --out DIR"),
    };
    let each = if clips.len() > 1 { ", one folder per clip," } else { "" };
    format!("{run}{each} and skiagraph baseline save {} DIR", baseline.name)
}

/// The command line of the measured program, if it was an external one.
fn program(clip: &MeasuredClip) -> Option<&str> {
    clip.settings.as_ref()?.get("command").and_then(Value::as_str)
}

/// The options with which the program was run.
fn options(clip: &MeasuredClip) -> ProgramOptions {
    let options = clip.settings.as_ref().and_then(|settings| settings.get("options")).cloned();
    options.and_then(|options| serde_json::from_value(options).ok()).unwrap_or_default()
}

pub(super) fn shown(path: &Path) -> String {
    shell_word(&path.to_string_lossy())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::MeasuredRuns;

    fn baseline(settings: Option<Value>) -> Baseline {
        let clip = MeasuredClip { seeds: (0..5).collect(), settings, ..MeasuredClip::default() };
        let runs = MeasuredRuns { clips: [("walk".to_owned(), clip)].into(), ..MeasuredRuns::default() };
        Baseline { schema: String::new(), name: "walk".to_owned(), version: String::new(), misread: Vec::new(), runs }
    }

    #[test]
    fn seeds_of_the_run_need_one_command_and_those_of_both_need_two() {
        let run = [PathBuf::from("nowhere")];
        let advice = |lacking: &[MoreSeeds]| seed_advice(&run, &baseline(None), lacking.iter().copied());
        assert_eq!(advice(&[]), None);
        assert_eq!(advice(&[MoreSeeds::TooMany]), None);
        let of_run = advice(&[MoreSeeds::OfRun(2), MoreSeeds::OfRun(3)]).unwrap();
        assert!(of_run.contains("skiagraph gate nowhere --baseline walk --add-seeds 3"), "{of_run}");
        let of_both = advice(&[MoreSeeds::OfRun(2), MoreSeeds::OfBoth(7)]).unwrap();
        assert!(of_both.contains("run and baseline need 7 more seed(s) each"), "{of_both}");
        let first = "skiagraph run SCENARIO --seeds 12 --out DIR and skiagraph baseline save walk DIR";
        assert!(of_both.contains(first) && of_both.contains("--add-seeds 7"), "{of_both}");
        let program = serde_json::json!({"command": "python t.py"});
        let of_both = seed_advice(&run, &baseline(Some(program)), [MoreSeeds::OfBoth(1)]).unwrap();
        assert!(of_both.contains("skiagraph track SET --exec 'python t.py' --seeds 6 --out DIR"), "{of_both}");
        let program = serde_json::json!({"command": "python t.py", "options": {"inline": true}});
        let of_both = seed_advice(&run, &baseline(Some(program)), [MoreSeeds::OfBoth(1)]).unwrap();
        assert!(of_both.contains("--exec 'python t.py' --inline --seeds 6"), "{of_both}");
    }

    #[test]
    fn draws_and_clips_are_rendered_for_run_and_baseline() {
        let advice = |unit| set_advice(unit, &baseline(None), [MoreSeeds::OfBoth(4), MoreSeeds::TooMany]);
        let draws = advice(IntervalUnit::Draws).unwrap();
        assert!(draws.contains("4 more draw(s)") && draws.contains("observation.seed=N"), "{draws}");
        assert!(advice(IntervalUnit::Clips).unwrap().contains("4 more clip(s)"));
        assert_eq!(set_advice(IntervalUnit::Clips, &baseline(None), [MoreSeeds::TooMany]), None);
    }

    #[test]
    fn the_advice_for_a_program_has_its_exact_command() {
        let folder = tempfile::tempdir().unwrap();
        let mut record = serde_json::json!({
            "schema": "skiagraph.program/1", "command": "sh t.sh", "name": null, "version": null, "set_hash": "",
            "skiagraph": "", "answers": {"poses": 0, "lost": 0, "failed": 0}, "incidents": [],
            "timing": {"seconds": 1.0, "frames_per_second": 1.0, "likelihood_evaluations": 0, "threads": 1},
        });
        std::fs::write(folder.path().join(EXTERNAL_FILE), record.to_string()).unwrap();
        let words = by_hand(folder.path(), &[5, 6, 9]);
        let place = |seeds: &str| folder.path().join(seeds).display().to_string();
        let [first, second] = [place("seeds-5-6"), place("seeds-9-9")];
        let command = format!(
            "skiagraph track SET --exec 'sh t.sh' --seed 5 --seeds 2 --out {first}, then skiagraph evaluate SET {first}"
        );
        assert!(words.contains(&command), "{words}");
        assert!(words.contains(&format!("--seed 9 --seeds 1 --out {second}")), "{words}");
        record["options"] = serde_json::json!({"inline": true, "start_limit_s": 90.0});
        record["without_truth"] = true.into();
        std::fs::write(folder.path().join(EXTERNAL_FILE), record.to_string()).unwrap();
        let words = by_hand(folder.path(), &[9]);
        let options = "--exec 'sh t.sh' --inline --start-limit 90 --seed 9";
        assert!(words.contains(options) && words.ends_with(&format!("SET {second} --truth DIR")), "{words}");
    }

    #[test]
    fn the_advice_for_unknown_programs_names_the_seeds() {
        let words = by_hand(Path::new("theirs"), &[5, 6]);
        assert!(words.starts_with("cannot run the tracker of theirs; run it with"), "{words}");
        assert!(words.contains("seeds 5 to 6"), "{words}");
    }
}
