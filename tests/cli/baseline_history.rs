//! The page of a baseline's history, with git and without.

use std::process::Command;

use crate::sandbox::{Sandbox, shipped};

/// The shipped baseline, with another first value.
fn baseline(number: &str) -> String {
    let text = std::fs::read_to_string(shipped("results/baselines/smoke-matched.json")).unwrap();
    let start = text.find("\"humaneva_mm\"").unwrap();
    let mark = "\"per_seed\": [";
    let first = start + text[start..].find(mark).unwrap() + mark.len();
    let end = first + text[first..].find(',').unwrap();
    format!("{}{number}{}", &text[..first], &text[end..])
}

#[test]
fn versions_are_plotted_from_several_files_without_git() {
    let room = Sandbox::new();
    room.write("old.json", baseline("9.0"));
    room.write("new.json", baseline("900.0"));
    let answer = room.succeed("report --history old.json new.json --out history.html");
    assert!(answer.stdout.contains("history.html: 2 versions"), "{}", answer.stdout);
    let page = String::from_utf8(room.read("history.html")).unwrap();
    assert!(page.contains("<td>old</td>") && page.contains("<td>new</td>") && page.contains("<svg"), "{page}");
    assert!(!page.contains("class=\"other\""), "the sets are the same");
    room.write("bad.json", "{}");
    let refused = room.skiagraph(["report", "--history", "old.json", "bad.json"]);
    assert!(refused.code == 2 && refused.stderr.contains("bad.json"), "{}", refused.stderr);
    let ending = room.skiagraph(["report", "--history", "old.json", "new.json", "--out", "history.md"]);
    assert!(ending.code == 2 && ending.stderr.contains("ends in .html or .htm, found .md"), "{}", ending.stderr);
    let alone = room.skiagraph(["report", "--history", "old.json"]);
    assert!(alone.code == 2 && alone.stderr.contains("--history old.json new.json"), "{}", alone.stderr);
    assert_eq!(room.skiagraph(["report"]).code, 2, "neither a sweep nor a baseline");
}

#[test]
fn versions_are_those_of_the_commits_of_a_file() {
    let room = Sandbox::new();
    let git = |arguments: &[&str]| {
        let identity = ["-c", "user.name=n", "-c", "user.email=e@example.com", "-c", "commit.gpgsign=false"];
        let done = Command::new("git").arg("-C").arg(room.path("")).args(identity).args(arguments).output();
        done.is_ok_and(|done| done.status.success())
    };
    if !git(&["init", "-q"]) {
        return;
    }
    for (number, subject) in [("9.0", "first"), ("10.0", "second & better")] {
        room.write("own.json", baseline(number));
        assert!(git(&["add", "own.json"]) && git(&["commit", "-q", "-m", subject]));
    }
    let answer = room.succeed("report --history own.json");
    assert!(answer.stdout.contains("own-history.html: 2 versions"), "{}", answer.stdout);
    let page = String::from_utf8(room.read("own-history.html")).unwrap();
    let places = ["first", "second &amp; better"].map(|subject| page.find(subject).unwrap_or(usize::MAX));
    assert!(places[0] < places[1] && places[1] < usize::MAX, "{page}");
    room.write("own.json", baseline("11.0"));
    let answer = room.succeed("report --history own.json --out later.html");
    assert!(answer.stdout.contains("3 versions"), "{}", answer.stdout);
    assert!(String::from_utf8(room.read("later.html")).unwrap().contains("not committed"));
}
