//! Sweeps: the same bytes however cells are run and processes killed; and bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;

use crate::sandbox::{Sandbox, TINY};

const TABLES: [&str; 2] = ["runs.csv", "runs.jsonl"];

/// Four settings on two sets, two seeds: eight cells.
const GRID: &str = "particles=6,12 rig.ring.count=1,2";

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room
}

fn tables(room: &Sandbox, sweep: &str) -> Vec<Vec<u8>> {
    TABLES.iter().map(|name| room.read(&format!("{sweep}/{name}"))).collect()
}

/// An uninterrupted sweep in `DIR`.
fn undisturbed(room: &Sandbox, dir: &str) -> Vec<Vec<u8>> {
    room.succeed(&format!("sweep tiny.toml {GRID} --out {dir} -j 2"));
    tables(room, dir)
}

fn rows(room: &Sandbox, sweep: &str) -> Vec<Vec<String>> {
    let bytes = room.read(&format!("{sweep}/runs.csv"));
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(bytes.as_slice());
    reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect()
}

fn column(rows: &[Vec<String>], name: &str) -> Vec<String> {
    let at = rows[0].iter().position(|title| title == name).unwrap_or_else(|| panic!("no column {name}"));
    rows[1..].iter().map(|row| row[at].clone()).collect()
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(files_below(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

fn assert_refused(room: &Sandbox, arguments: &str, code: i32, words: &[&str]) {
    let answer = room.skiagraph(arguments.split(' '));
    assert_eq!(answer.code, code, "{arguments}: {}", answer.stderr);
    for word in words {
        assert!(answer.stderr.contains(word), "{arguments}: no {word:?} in {}", answer.stderr);
    }
    assert!(!answer.stderr.contains("panicked"), "{}", answer.stderr);
}

#[test]
fn a_sweep_gives_the_same_bytes_in_one_run_by_cells_and_by_shards() {
    let room = room();
    let whole = undisturbed(&room, "whole");
    let answer = room.succeed(&format!("sweep plan tiny.toml {GRID} --out cells --json"));
    assert!(answer.stdout.contains("\"cells\": 8") && answer.stdout.contains("\"sets\": 2"), "{}", answer.stdout);
    assert_eq!(room.succeed("sweep status cells --missing").stdout, "0-7\n");
    // in any order, one of them twice
    for index in [3, 0, 7, 3, 1] {
        room.succeed(&format!("sweep cell cells --index {index}"));
    }
    assert!(room.succeed("sweep cell cells --index 3").stdout.contains("cached"));
    assert_eq!(room.succeed("sweep status cells --missing").stdout, "2,4-6\n");
    assert_refused(&room, "sweep gather cells", 1, &["4 of 8 cells have results, missing 2,4-6", "--allow-partial"]);
    assert!(!room.path("cells/runs.csv").exists());
    room.succeed("sweep gather cells --allow-partial");
    assert_eq!(rows(&room, "cells").len(), 1 + 4);
    for part in 1..=3 {
        room.succeed(&format!("sweep cell cells --shard {part}/3"));
    }
    room.succeed("sweep gather cells");
    assert_eq!(tables(&room, "cells"), whole);
    // each set was rendered once, and there are no other files
    assert_eq!(fs::read_dir(room.path("cells/sets")).unwrap().count(), 2);
    assert!(files_below(&room.path("cells")).iter().all(|path| !path.to_string_lossy().contains("writing")));
    let rows = rows(&room, "cells");
    assert_eq!(column(&rows, "particles"), ["6", "6", "12", "12", "6", "6", "12", "12"]);
    assert_eq!(column(&rows, "rig.ring.count"), ["1", "1", "1", "1", "2", "2", "2", "2"]);
    assert_eq!(column(&rows, "seed"), ["0", "1", "0", "1", "0", "1", "0", "1"]);
}

#[test]
fn a_cell_has_the_numbers_of_skiagraph_run() {
    let room = room();
    undisturbed(&room, "sweep");
    let run = room.succeed("run tiny.toml particles=12 rig.ring.count=2 --out run --json").stdout;
    let run: serde_json::Value = serde_json::from_str(&run).unwrap();
    let lines = String::from_utf8(room.read("sweep/runs.jsonl")).unwrap();
    let cells: Vec<serde_json::Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of_setting: Vec<&serde_json::Value> =
        cells.iter().filter(|cell| cell["axes"]["particles"] == 12 && cell["axes"]["rig.ring.count"] == 2).collect();
    assert_eq!(of_setting.len(), 2);
    for (seed, cell) in of_setting.iter().enumerate() {
        let metrics = run["metrics"].as_object().unwrap();
        assert!(metrics.len() > 10);
        for (name, metric) in metrics {
            assert_eq!(cell["metrics"][name], metric["per_run"][seed], "{name}");
        }
    }
    assert_eq!(of_setting[0]["set_hash"], run["set_hash"]);
}

#[test]
fn processes_share_a_motion_model_that_is_learned_once() {
    let room = room();
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    let training = "[[training.clips]]\nclip = \"embedded:run\"\nfirst_frame = 1\nlast_frame = 20\n";
    room.write("latent.toml", format!("{before}{training}[tracker.gpdm]\nparticles = 10\nmodel.training.rounds = 1\n"));
    // two rigs, so two sets, and two seeds
    room.succeed("sweep plan latent.toml rig.ring.count=1,2 --out apart");
    room.succeed("sweep cell apart --index 0");
    let models = || files_below(&room.path("apart/models"));
    let [first] = &models()[..] else { panic!("one model: {:?}", models()) };
    let written = fs::metadata(first).unwrap().modified().unwrap();
    (1..4).for_each(|index| drop(room.succeed(&format!("sweep cell apart --index {index}"))));
    assert_eq!(models(), std::slice::from_ref(first), "every process uses the one that is there");
    assert_eq!(fs::metadata(first).unwrap().modified().unwrap(), written);
    room.succeed("sweep gather apart");
    room.succeed("sweep latent.toml rig.ring.count=1,2 --out together -j 2");
    assert_eq!(tables(&room, "apart"), tables(&room, "together"));
    // the numbers equal those of a run, which shares nothing
    room.succeed("run latent.toml rig.ring.count=1 seeds=1 --out alone");
    let run: serde_json::Value = serde_json::from_slice(&room.read("alone/run.json")).unwrap();
    let rows = rows(&room, "apart");
    let cell: f64 = column(&rows, "humaneva_mm")[0].parse().unwrap();
    assert_eq!(run["metrics"]["humaneva_mm"]["mean"].as_f64(), Some(cell));
    // a damaged model is named and not used
    fs::write(first, "no model").unwrap();
    fs::remove_dir_all(room.path("apart/results")).unwrap();
    assert_refused(&room, "sweep cell apart --index 0", 2, &[".model", "not a complete"]);
}

#[test]
fn a_sweep_has_a_picture_and_the_command_that_repeats_it() {
    let room = room();
    room.succeed(&format!("sweep tiny.toml {GRID} --keep particles>2 --out s"));
    assert_refused(
        &room,
        "report nowhere --png s.png",
        2,
        &["expected the directory of a sweep or of a run", "nowhere"],
    );
    let refused = room.skiagraph(["report", "s", "--png", "s.jpg"]);
    assert!(refused.code == 2 && refused.stderr.contains("ends in .png, found .jpg"), "{}", refused.stderr);
    room.succeed("report s --png s.png");
    assert!(room.read("s.png").starts_with(b"\x89PNG"));
    room.succeed("report s --out s.md");
    let text = String::from_utf8(room.read("s.md")).unwrap();
    let command = "skiagraph sweep tiny.toml particles=6,12 rig.ring.count=1,2 --keep 'particles>2' --out s\n";
    assert!(text.contains(command), "{text}");
    assert!(text.contains("range over seeds") && !text.contains("95 % interval"), "2 seeds: {text}");
}

#[test]
fn a_cell_may_keep_the_report_of_a_run() {
    let room = room();
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out s"));
    room.succeed("sweep cell s --index 5 --report");
    let reports: Vec<PathBuf> = files_below(&room.path("s/reports"));
    assert!(
        reports.iter().any(|path| path.ends_with("report.html"))
            && reports.iter().any(|path| path.ends_with("run.json"))
    );
}

#[test]
fn a_sweep_killed_twenty_times_gives_the_bytes_of_an_uninterrupted_one() {
    let room = room();
    let whole = undisturbed(&room, "whole");
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out s"));
    // kill times from a fixed pseudo-random sequence; killed cells are run again, and all cells if none is missing
    let mut moment = 17_u64;
    let mut killed = 0;
    for _ in 0..20 {
        moment = moment * 37 % 101;
        if room.succeed("sweep status s --missing").stdout.trim().is_empty() {
            files_below(&room.path("s/results")).iter().for_each(|file| fs::remove_file(file).unwrap());
        }
        killed += usize::from(room.run_and_kill("sweep run s -j 2", Duration::from_millis(5 + 2 * moment)));
        let answer = room.succeed("sweep status s --json").stdout;
        assert!(answer.contains("\"failed\": 0"), "{answer}");
    }
    assert!(killed >= 3, "of 20 runs only {killed} were killed before their end");
    for index in [0, 3, 6] {
        room.run_and_kill(&format!("sweep cell s --index {index} --again"), Duration::from_millis(2 * moment));
        moment = moment * 37 % 101;
    }
    room.succeed("sweep run s -j 2");
    assert_eq!(tables(&room, "s"), whole);
    let left: Vec<PathBuf> = files_below(&room.path("s/results"))
        .into_iter()
        .filter(|p| {
            !p.to_string_lossy().ends_with(".json") || p.file_name().unwrap().to_string_lossy().starts_with('.')
        })
        .collect();
    assert_eq!(left, Vec::<PathBuf>::new(), "what killed processes left is removed");
}

#[test]
fn damaged_results_and_modification_times_do_not_matter() {
    let room = room();
    let whole = undisturbed(&room, "s");
    let results = files_below(&room.path("s/results"));
    assert_eq!(results.len(), 8);
    // modification times in the past and in the future
    for (path, time) in results.iter().zip([0, 4_000_000_000_u64].iter().cycle()) {
        let file = fs::File::options().write(true).open(path).unwrap();
        file.set_modified(std::time::UNIX_EPOCH + Duration::from_secs(*time)).unwrap();
    }
    assert!(room.succeed("sweep run s").stdout.contains("ran 0 cells, 8 had results"));
    // a modified result, a truncated one, and one of another cell
    let text = fs::read_to_string(&results[0]).unwrap();
    fs::write(&results[0], text.replacen("\"cameras\": ", "\"cameras\": 1", 1)).unwrap();
    fs::write(&results[1], &text.as_bytes()[..100]).unwrap();
    fs::copy(&results[3], &results[2]).unwrap();
    assert_refused(&room, "sweep gather s", 1, &["5 of 8 cells have results"]);
    assert!(room.succeed("sweep run s").stdout.contains("ran 3 cells, 5 had results"));
    assert_eq!(tables(&room, "s"), whole);
}

#[test]
fn a_sweep_file_is_checked_planned_and_run_like_the_command_line() {
    let room = room();
    let text = "schema = \"skiagraph.sweep/1\"\nname = \"small\"\nbase = \"tiny.toml\"\n[axes]\nparticles = [6, 12]\nrig.ring.count = [1, 2]\n";
    room.write("sweep.toml", text);
    let whole = undisturbed(&room, "whole");
    room.succeed("sweep sweep.toml --out s");
    assert_eq!(tables(&room, "s"), whole);
    for command in
        ["check sweep.toml", "sweep check sweep.toml -j 4", "sweep check tiny.toml particles=6,12 rig.ring.count=1,2"]
    {
        let told = room.succeed(command).stdout;
        assert!(told.contains("8 cells (4 settings x 2 seeds) on 2 sets") && told.contains("on one core"), "{told}");
    }
    // more seeds: the plan grows and finished cells are kept
    assert_refused(
        &room,
        "sweep plan sweep.toml --seeds 3 --out s",
        2,
        &["other results are planned here", "seeds", "--extend"],
    );
    room.succeed("sweep plan sweep.toml --seeds 3 --out s --extend");
    assert!(room.succeed("sweep run s").stdout.contains("ran 4 cells, 8 had results"));
    let settings: Vec<String> = column(&rows(&room, "s"), "seed");
    assert_eq!(settings.iter().filter(|seed| *seed == "2").count(), 4);
    // without --out, another sweep of the same name gets a separate folder
    room.succeed("sweep tiny.toml particles=6,12 --seeds 1");
    room.succeed("sweep tiny.toml particles=6,12 --seeds 2");
    assert!(room.path("sweeps/tiny/runs.csv").exists() && room.path("sweeps/tiny-2/runs.csv").exists());
}

#[test]
fn a_setting_that_cannot_be_run_is_a_result_and_the_others_are_run() {
    let room = room();
    // cameras that never see the actor
    let answer = room.skiagraph("sweep tiny.toml rig.ring.look_at_m=[0,0,1],[500,500,400] --out s".split(' '));
    assert_eq!(answer.code, 1, "{}", answer.stderr);
    assert!(answer.stdout.contains("2 cells cannot be run"), "{}", answer.stdout);
    let rows = rows(&room, "s");
    assert_eq!(column(&rows, "status").iter().filter(|status| *status == "failed").count(), 2);
    assert!(
        column(&rows, "error").iter().any(|error| error.contains("look_at_m") || error.contains("sees")),
        "{rows:?}"
    );
    assert!(room.succeed("sweep status s").stdout.contains("2 cannot be run: 2-3"));
    // failed cells are not run again without --retry-failed
    let answer = room.skiagraph(["sweep", "run", "s", "--json"]);
    assert!(answer.code == 1 && answer.stdout.contains("\"run\": 0"), "{}", answer.stdout);
    let answer = room.skiagraph(["sweep", "run", "s", "--json", "--retry-failed"]);
    assert!(answer.code == 1 && answer.stdout.contains("\"run\": 2"), "{}", answer.stdout);
    assert_eq!(room.skiagraph("sweep cell s --index 3".split(' ')).code, 0, "for an engine it is a result");
}

#[test]
fn a_setting_with_an_unreadable_file_fails_and_the_others_are_run() {
    let room = room();
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    room.write("base.toml", format!("{before}[tracker.frozen]\n"));
    room.write("broken.model", "PK\x03\x04 but no archive");
    room.write("broken.bvh", [0xff, 0xfe]);
    fs::create_dir(room.path("folder.model")).unwrap();
    let model =
        |name: &str| format!("{{ name = \"{name}\", set = ['tracker={{ gpdm = {{ model_file = \"{name}\" }} }}'] }}");
    let clip = |name: &str| format!("{{ name = \"{name}\", set = ['motion.clip={name}'] }}");
    let settings =
        [model("broken.model"), model("folder.model"), model("late.model"), clip("late.txt"), clip("broken.bvh")];
    let sound = "{ name = \"sound\", set = [] }";
    let head = "schema = \"skiagraph.sweep/1\"\nname = \"a\"\nbase = \"base.toml\"\nseeds = 1\n[axes]\n";
    room.write("sweep.toml", format!("{head}what = [{}, {sound}]\n", settings.join(", ")));
    for jobs in [1, 2] {
        let answer = room.skiagraph(format!("sweep sweep.toml --out s{jobs} -j {jobs}").split(' '));
        assert_eq!(answer.code, 1, "{}", answer.stderr);
        let rows = rows(&room, &format!("s{jobs}"));
        let found: Vec<(String, String)> = column(&rows, "what").into_iter().zip(column(&rows, "status")).collect();
        assert_eq!(found.len(), 6);
        for (what, status) in &found {
            assert_eq!(status, if what == "sound" { "ok" } else { "failed" }, "{what}: {rows:?}");
        }
        for (what, error) in column(&rows, "what").iter().zip(column(&rows, "error")) {
            assert!(what == "sound" || error.contains(what.as_str()), "{what}: {error}");
        }
    }
    // the missing file is added
    let walk = fs::read(crate::sandbox::shipped("scenarios/motions/humanoid3d_walk.txt")).unwrap();
    room.write("late.txt", walk);
    assert!(room.skiagraph(["sweep", "run", "s1", "--json"]).stdout.contains("\"run\": 0"));
    let again = room.skiagraph(["sweep", "run", "s1", "--json", "--retry-failed"]);
    assert!(again.code == 1 && again.stdout.contains("\"run\": 5"), "{} {}", again.stdout, again.stderr);
    room.skiagraph(["sweep", "gather", "s1"]);
    let rows = rows(&room, "s1");
    assert_eq!(column(&rows, "status").iter().filter(|status| *status == "ok").count(), 2, "{rows:?}");
}

#[test]
fn a_tracker_that_loses_the_body_is_a_result() {
    let room = room();
    room.succeed("sweep tiny.toml tracker.oracle.root_offset_m=[0,0,0],[3,0,0] --out s --seeds 1");
    assert_eq!(column(&rows(&room, "s"), "status"), ["ok", "diverged"]);
}

#[test]
fn invalid_sweeps_are_refused_and_leave_nothing() {
    let room = room();
    room.write("bad.toml", "schema = \"skiagraph.sweep/1\"\nname = \"a\"\n[axes]\nparticles = []\n");
    room.write("budget.toml", "schema = \"skiagraph.sweep/1\"\nname = \"a\"\nbase = \"tiny.toml\"\n[budget]\nproduct = [\"particles\", \"layers\"]\nequals = 7\n[axes]\nparticles = [6, 12]\n");
    for (arguments, words) in [
        ("tiny.toml partciles=6,12", &["override partciles=6", "did you mean `particles`?"][..]),
        ("tiny.toml particles=6,0", &["particles=0", "at least 1"]),
        ("tiny.toml particles=6,6", &["expected different values, found 6 twice"]),
        ("tiny.toml layers=deep,flat", &["layers=\"deep\"", "did you mean tracker.annealed_particle_filter.layers"]),
        ("tiny.toml particles=6,12 --keep particles>99", &["keep", "the grid is empty"]),
        ("tiny.toml particles=6,12 layers=3 --keep partciles>9", &["`partciles` is not an axis"]),
        ("tiny.toml particles=6,12 --objective humaneva_m", &["objective", "did you mean `humaneva_mm`?"]),
        ("tiny.toml seed=0,1", &["`seed=0` and `seed=1` make the same scenario"]),
        ("bad.toml", &["bad.toml:4: axes.particles", "the grid is empty"]),
        ("budget.toml", &["budget.toml:4", "none of 2 settings has particles x layers = 7"]),
        ("nowhere.toml", &["nowhere.toml", "cannot read"]),
    ] {
        let before = room.entries();
        assert_refused(&room, &format!("sweep {arguments} --out s"), 2, words);
        assert_eq!(room.entries(), before, "{arguments}");
    }
    assert_refused(&room, "sweep run nowhere", 2, &["expected the directory of a sweep", "skiagraph sweep plan"]);
    assert_refused(&room, "sweep cell tiny.toml --index 0", 2, &["expected the directory of a sweep"]);
    fs::create_dir(room.path("thesis")).unwrap();
    room.write("thesis/thesis.tex", "years of work");
    assert_refused(
        &room,
        "sweep plan tiny.toml particles=6,12 --out thesis",
        2,
        &["thesis", "not an unchanged skiagraph result"],
    );
    room.succeed("sweep plan tiny.toml particles=6,12 --out s");
    assert_refused(&room, "sweep cell s --index 4", 2, &["--index: expected 0 to 3, found 4"]);
    assert_refused(&room, "sweep cell s --shard 0/3", 2, &["expected K/M"]);
}

#[test]
fn a_plan_or_a_scenario_that_changed_is_refused_with_the_difference() {
    let room = room();
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out s"));
    for (file, from, to) in [
        ("plan.json", "\"cells\": 8", "\"cells\": 9"),
        ("cells.jsonl", "\"seed\":1", "\"seed\":7"),
        ("scenario.toml", "80", "81"),
    ] {
        let path = format!("s/{file}");
        let text = String::from_utf8(room.read(&path)).unwrap();
        room.write(&path, text.replacen(from, to, 1));
        for command in ["run s", "cell s --index 0", "status s", "gather s"] {
            assert_refused(&room, &format!("sweep {command}"), 2, &[file, "changed after it was planned"]);
        }
        room.write(&path, text);
    }
    room.write("tiny.toml", TINY.replace("radius_m = 3.5", "radius_m = 4.5"));
    assert_refused(
        &room,
        "sweep run s",
        2,
        &["tiny.toml", "changed since s was planned", "was `radius_m = 3.5` and is `radius_m = 4.5`", "--extend"],
    );
    assert_refused(&room, &format!("sweep plan tiny.toml {GRID} --out s"), 2, &["content of the base scenario"]);
    room.write("tiny.toml", TINY);
    room.succeed("sweep run s -j 2");
}

#[test]
fn a_recording_that_changed_is_refused() {
    let room = room();
    let walk = fs::read(crate::sandbox::shipped("scenarios/motions/humanoid3d_walk.txt")).unwrap();
    room.write("walk.txt", &walk);
    room.succeed("sweep plan tiny.toml motion.clip=walk.txt particles=6,12 --out s");
    room.write("walk.txt", [walk.as_slice(), b"\n"].concat());
    assert_refused(&room, "sweep run s", 2, &["walk.txt", "changed since s was planned", "SHA-256"]);
}

#[test]
fn two_processes_may_run_the_same_sweep() {
    let room = room();
    let whole = undisturbed(&room, "whole");
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out s"));
    let run = || {
        Command::new(cargo_bin("skiagraph"))
            .args(["sweep", "run", "s", "-j", "1", "--quiet"])
            .current_dir(room.path("."))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let both = [run(), run()].map(|child| child.wait_with_output().unwrap());
    let codes = both.each_ref().map(|output| output.status.code().unwrap());
    assert!(codes.contains(&0) && codes.iter().all(|code| [0, 75].contains(code)), "{codes:?}");
    assert_eq!(tables(&room, "s"), whole);
    // cells and shards run in parallel, including the same ones
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out t"));
    let cell = |arguments: &str| {
        Command::new(cargo_bin("skiagraph"))
            .args(["sweep", "cell", "t"].into_iter().chain(arguments.split(' ')))
            .current_dir(room.path("."))
            .stdout(Stdio::null())
            .spawn()
            .unwrap()
    };
    let children = ["--shard 1/2", "--shard 2/2", "--index 0", "--index 0", "--shard 1/1"].map(cell);
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    room.succeed("sweep gather t");
    assert_eq!(tables(&room, "t"), whole);
}

#[cfg(target_os = "linux")]
#[test]
fn write_errors_are_reported_and_results_stay_complete() {
    let room = room();
    room.succeed(&format!("sweep plan tiny.toml {GRID} --out s"));
    // a file in place of the folder of results, below which nobody can write
    room.write("s/results", "in the way");
    assert_refused(&room, "sweep run s", 2, &["results", "cannot create the directory"]);
    assert_refused(&room, "sweep cell s --index 0", 2, &["results", "cannot create the directory"]);
    fs::remove_file(room.path("s/results")).unwrap();
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n");
    if !is_root {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(room.path("s"), fs::Permissions::from_mode(0o555)).unwrap();
        assert_refused(&room, "sweep run s", 2, &["s", "cannot"]);
        fs::set_permissions(room.path("s"), fs::Permissions::from_mode(0o755)).unwrap();
    }
    room.succeed("sweep run s");
}
