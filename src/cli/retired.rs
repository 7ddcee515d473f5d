//! Commands and options of earlier versions: what to use instead.

/// The words of a command line that is no longer valid, and what to use instead. The first is the command; empty: any.
const RETIRED: [(&[&str], &str); 24] = [
    (
        &["ladder"],
        "a ladder is a sweep: skiagraph sweep scenarios/sweeps/ladder.toml, or `skiagraph sweep SCENARIO \
                   observation.corruption.AXIS=0,1,2 --draws --seeds 5`",
    ),
    (&["suite"], "a suite is a sweep: skiagraph sweep scenarios/sweeps/quick.toml --exec COMMAND"),
    (
        &["render", "--ladder"],
        "render one set per level (skiagraph render SCENARIO observation.corruption.AXIS=LEVEL \
                               --key HEX), or measure trackers by level: skiagraph sweep scenarios/sweeps/ladder.toml",
    ),
    (&["render", "--levels"], "as for --ladder: skiagraph sweep scenarios/sweeps/ladder.toml"),
    (
        &["render", "--shards"],
        "render the set without --shards, and write shards of it for training: skiagraph export SET \
                               --to webdataset",
    ),
    (&["report", "--history"], "git log shows the versions of a baseline, and skiagraph baseline show NAME its values"),
    (
        &["report", "--png"],
        "a sweep has a page and plots: skiagraph report DIR --figures FOLDER; a run has its report.html",
    ),
    (&["report", "--ask"], "runs.jsonl in the folder of the sweep has all settings with their values"),
    (&["report", "--set"], "skiagraph compare RUN RUN --html FILE writes the page of several runs of one set"),
    (&["report", "--scenario-dir"], "skiagraph compare RUN RUN --html FILE needs no scenario"),
    (&["report", "--mocap-dir"], "skiagraph compare RUN RUN --html FILE needs no recordings"),
    (&["schema", "--suite"], "a suite is a sweep: skiagraph schema --sweep"),
    (
        &["sweep", "submit"],
        "one task of a job array runs one part: skiagraph sweep run DIR --part 3/20 (scenarios/README.md)",
    ),
    (&["sweep", "cell"], "skiagraph sweep run DIR --part 3/20, or --report CELL for the report of one cell"),
    (&["sweep", "gather"], "skiagraph sweep run DIR writes the tables once all cells have results"),
    (&["sweep", "check"], "skiagraph check SWEEP"),
    (&["export", "--to", "apng"], "use --to video, or the frame player of skiagraph inspect SET"),
    (&["export", "--to", "bodytrack"], "use --to humaneva for its cameras; silhouettes are in the set"),
    (&["evaluate", "--from", "bodytrack"], "write the ends of its cylinders as .csv (docs/estimates.md)"),
    (&["evaluate", "--model"], "write the model's positions as .trc (docs/estimates.md, OpenSim)"),
    (&["segment", "--method"], "the mixture is the only method; leave the option out"),
    (&["segment", "--rate"], "only the online method had it; leave the option out"),
    (&["", "--allow-outside"], "files may name every file that you may read; leave the option out"),
    (&["sweep", "--keep"], "list the settings to keep in a sweep file: method = \"list\" with [[points]]"),
];

/// The message for a refused command line; `None` if it never was valid.
pub(super) fn message(arguments: &[String]) -> Option<String> {
    let name = |argument: &String| argument.split('=').next().unwrap_or_default().to_owned();
    let given: Vec<String> = arguments.iter().map(name).collect();
    for (words, instead) in RETIRED {
        let [command, rest @ ..] = words else { continue };
        let is_command = command.is_empty() || given.first().is_some_and(|first| first == command);
        // a subcommand directly follows its command; an option and its value, also in a list, may be anywhere
        let has_option = rest.iter().any(|word| word.starts_with('-'));
        let has_rest = rest.iter().all(|word| match has_option {
            true => arguments.iter().any(|given| given.split(['=', ',']).any(|part| part == *word)),
            false => given.get(1).is_some_and(|second| second == word),
        });
        if is_command && has_rest {
            return Some(format!("`{}` is of an earlier version; {instead}", words.join(" ").trim()));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retired_words_are_answered_and_others_are_not() {
        let said = |line: &str| message(&line.split(' ').map(str::to_owned).collect::<Vec<_>>());
        assert!(said("suite scenarios/suites/quick.toml").unwrap().contains("skiagraph sweep"));
        assert!(said("render walk.toml --shards=8 --out set").unwrap().contains("--to webdataset"));
        assert!(said("export set --to tum,apng --out all").unwrap().contains("--to video"));
        assert!(said("sweep submit sweeps/mine").unwrap().contains("--part 3/20"));
        for other in ["render walk.toml --sharts 8", "sweep submitted", "run --keep", ""] {
            assert_eq!(said(other), None, "{other}");
        }
    }
}
