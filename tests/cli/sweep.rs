//! Sweeps: the same bytes however cells are run and processes killed.

use std::fs;
use std::time::Duration;

use serde_json::Value;

use crate::sandbox::{Sandbox, TINY, shipped};

/// Four settings on two sets, two seeds: eight cells.
const GRID: &str = "tiny.toml particles=6,12 rig.ring.count=1,2";

fn tables(room: &Sandbox, sweep: &str) -> [Vec<u8>; 2] {
    ["runs.csv", "runs.jsonl"].map(|name| room.read(&format!("{sweep}/{name}")))
}

/// A room with the sweep of the grid in `whole`, its tables, and a plan of the same in `s`.
fn planned() -> (Sandbox, [Vec<u8>; 2]) {
    let room = Sandbox::tiny();
    room.succeed(&format!("sweep {GRID} --out whole -j 2"));
    room.succeed(&format!("sweep plan {GRID} --out s"));
    let whole = tables(&room, "whole");
    (room, whole)
}

fn column(room: &Sandbox, sweep: &str, name: &str) -> Vec<String> {
    let bytes = room.read(&format!("{sweep}/runs.csv"));
    let mut reader = csv::Reader::from_reader(bytes.as_slice());
    let at = reader.headers().unwrap().iter().position(|title| title == name).unwrap_or_else(|| panic!("no {name}"));
    reader.records().map(|row| row.unwrap()[at].to_owned()).collect()
}

#[test]
fn parts_equal_one_run() {
    let (room, whole) = planned();
    assert_eq!(room.succeed("sweep status s --missing").stdout, "0-7\n");
    // in any order, one of them twice; the last one writes the tables
    for part in [3, 1, 3] {
        room.succeed(&format!("sweep run s --part {part}/3"));
    }
    assert!(!room.succeed("sweep status s --missing").stdout.trim().is_empty());
    assert!(!room.path("s/runs.csv").exists());
    room.says("sweep run s --part 2/3", &["0 of all cells have no result"]);
    assert_eq!(tables(&room, "s"), whole);
    // each set was rendered once, and there are no other files
    assert_eq!(room.entries_of("s/sets").len(), 2);
    assert!(room.files_below("s").iter().all(|path| !path.contains("writing")));
    assert_eq!(column(&room, "s", "particles"), ["6", "6", "12", "12", "6", "6", "12", "12"]);
    assert_eq!(column(&room, "s", "rig.ring.count"), ["1", "1", "1", "1", "2", "2", "2", "2"]);
    assert_eq!(column(&room, "s", "seed"), ["0", "1", "0", "1", "0", "1", "0", "1"]);
}

#[test]
fn cells_have_the_numbers_of_runs() {
    let (room, _) = planned();
    let run = room.json_of("run tiny.toml particles=12 rig.ring.count=2 --out run --json");
    let lines = room.text("whole/runs.jsonl");
    let mut cells: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    cells.retain(|cell| cell["axes"]["particles"] == 12 && cell["axes"]["rig.ring.count"] == 2);
    assert_eq!(cells.len(), 2);
    for (seed, cell) in cells.iter().enumerate() {
        let metrics = run["metrics"].as_object().unwrap();
        assert!(metrics.len() > 10);
        for (name, metric) in metrics {
            assert_eq!(cell["metrics"][name], metric["per_run"][seed], "{name}");
        }
    }
    assert_eq!(cells[0]["set_hash"], run["set_hash"]);
    // a cell may keep the report of its run
    room.succeed("sweep run s --report 5");
    let reports = room.files_below("s/reports");
    for name in ["/report.html", "/run.json"] {
        assert!(reports.iter().any(|path| path.ends_with(name)), "{reports:?}");
    }
}

/// It is learned once.
#[test]
fn processes_share_a_motion_model() {
    let room = Sandbox::new();
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    let training = "[[training.clips]]\nclip = \"embedded:run\"\nfirst_frame = 1\nlast_frame = 20\n";
    let tracker = "[tracker.gpdm]\nparticles = 10\nmodel.training.rounds = 1\n";
    room.write("latent.toml", format!("{before}{training}{tracker}"));
    // two rigs, so two sets, and two seeds
    room.succeed("sweep plan latent.toml rig.ring.count=1,2 --out apart");
    room.succeed("sweep run apart --part 1/4");
    let models = room.files_below("apart/models");
    let [first] = &models[..] else { panic!("one model: {models:?}") };
    let written = || fs::metadata(room.path(first)).unwrap().modified().unwrap();
    let begin = written();
    (2..5).for_each(|part| drop(room.succeed(&format!("sweep run apart --part {part}/4"))));
    assert_eq!(room.files_below("apart/models"), models, "every process uses the one that is there");
    assert_eq!(written(), begin);
    room.succeed("sweep latent.toml rig.ring.count=1,2 --out together -j 2");
    assert_eq!(tables(&room, "apart"), tables(&room, "together"));
    // the numbers equal those of a run, which shares nothing
    room.succeed("run latent.toml rig.ring.count=1 seeds=1 --out alone");
    let cell: f64 = column(&room, "apart", "humaneva_mm")[0].parse().unwrap();
    assert_eq!(room.mean("alone", "humaneva_mm"), cell);
    // a damaged model is named and not used
    room.write(first, "no model");
    fs::remove_dir_all(room.path("apart/results")).unwrap();
    assert!(room.refused("sweep run apart --part 1/4", "not a complete").contains(".model"));
}

#[test]
fn page_has_the_command_again() {
    let (room, _) = planned();
    room.succeed("report whole --out s.md");
    let text = room.text("s.md");
    for words in [&format!("skiagraph sweep {GRID} --out whole"), "| range over seeds | coverage |", "| best | "] {
        assert!(text.contains(words), "{words}: {text}");
    }
    room.succeed("report whole");
    let page = room.text("whole/report.html");
    assert!(page.contains("<svg") && page.contains("never moves") && page.contains("<th class=\"n\">coverage</th>"));
}

#[test]
fn killed_sweep_equals_whole_one() {
    let (room, whole) = planned();
    // kill times from a fixed pseudo-random sequence; killed cells are run again, and all cells if none is missing
    let mut moment = 17_u64;
    let mut killed = 0;
    for _ in 0..20 {
        moment = moment * 37 % 101;
        if room.succeed("sweep status s --missing").stdout.trim().is_empty() {
            fs::remove_dir_all(room.path("s/results")).unwrap();
        }
        killed += usize::from(room.run_and_kill("sweep run s -j 2", Duration::from_millis(5 + 2 * moment)));
        assert_eq!(room.json_of("sweep status s --json")["failed"], 0);
    }
    assert!(killed >= 3, "of 20 runs only {killed} were killed before their end");
    room.succeed("sweep run s -j 2");
    assert_eq!(tables(&room, "s"), whole);
    for file in room.files_below("s/results") {
        assert!(file.ends_with(".json") && !file.contains("/."), "{file}: what killed processes left is removed");
    }
}

/// Nor do modification times matter.
#[test]
fn damaged_results_are_made_again() {
    let (room, whole) = planned();
    let results = room.files_below("whole/results");
    assert_eq!(results.len(), 8);
    // in the past and in the future
    for (path, time) in results.iter().zip([0, 4_000_000_000_u64].iter().cycle()) {
        let file = fs::File::options().write(true).open(room.path(path)).unwrap();
        file.set_modified(std::time::UNIX_EPOCH + Duration::from_secs(*time)).unwrap();
    }
    assert!(room.succeed("sweep run whole").stdout.contains("ran 0 cells, 8 had results"));
    // a modified result, a truncated one, and one of another cell
    let text = room.text(&results[0]);
    room.write(&results[0], text.replacen("\"cameras\": ", "\"cameras\": 1", 1));
    room.write(&results[1], &text[..100]);
    room.write(&results[2], room.read(&results[3]));
    assert!(room.succeed("sweep run whole").stdout.contains("ran 3 cells, 5 had results"));
    assert_eq!(tables(&room, "whole"), whole);
}

#[test]
fn sweep_file_equals_command_line() {
    let (room, whole) = planned();
    let text = "schema = \"skiagraph.sweep/1\"\nname = \"small\"\nbase = \"tiny.toml\"\n[axes]\nparticles = [6, 12]\n\
                rig.ring.count = [1, 2]\n";
    room.write("sweep.toml", text);
    room.succeed("sweep sweep.toml --out file");
    assert_eq!(tables(&room, "file"), whole);
    room.says("check sweep.toml", &["8 cells (4 settings x 2 seeds) on 2 sets"]);
    // more seeds: the plan grows and finished cells are kept
    room.succeed("sweep plan sweep.toml --seeds 3 --out file --extend");
    assert!(room.succeed("sweep run file").stdout.contains("ran 4 cells, 8 had results"));
    assert_eq!(column(&room, "file", "seed").iter().filter(|seed| *seed == "2").count(), 4);
    // without --out, another sweep of the same name gets a separate folder
    room.succeed("sweep tiny.toml particles=6,12 --seeds 1");
    room.succeed("sweep tiny.toml particles=6,12 --seeds 2");
    assert!(room.path("sweeps/tiny/runs.csv").exists() && room.path("sweeps/tiny-2/runs.csv").exists());
}

/// A setting that cannot be run is a result, and so is a tracker that loses the body.
#[test]
fn impossible_settings_are_results() {
    let room = Sandbox::tiny();
    // cameras that never see the actor
    let answer = room.ask("sweep tiny.toml rig.ring.look_at_m=[0,0,1],[500,500,400] --out s");
    assert!(answer.code == 1 && answer.stdout.contains("2 cells cannot be run"), "{}{}", answer.stdout, answer.stderr);
    assert_eq!(column(&room, "s", "status"), ["ok", "ok", "failed", "failed"]);
    assert!(column(&room, "s", "error")[2].contains("no camera sees"), "{:?}", column(&room, "s", "error"));
    assert!(room.succeed("sweep status s").stdout.contains("2 cannot be run: 2-3"));
    // failed cells are not run again without --retry-failed
    for (option, run) in [("", 0), ("--retry-failed", 2)] {
        let answer = room.ask(&format!("sweep run s --json {option}"));
        assert_eq!((answer.code, answer.json()["run"].as_u64()), (1, Some(run)), "{}", answer.stdout);
    }
    // for an engine it is a result
    room.succeed("sweep run s --part 2/2");
    room.succeed("sweep tiny.toml tracker.oracle.root_offset_m=[0,0,0],[3,0,0] --out lost --seeds 1");
    assert_eq!(column(&room, "lost", "status"), ["ok", "diverged"]);
}

#[test]
fn unreadable_files_fail_alone() {
    let room = Sandbox::new();
    let (before, _) = TINY.split_once("[tracker.").unwrap();
    room.write("base.toml", format!("{before}[tracker.frozen]\n"));
    room.write("broken.model", "PK\x03\x04 but no archive");
    room.write("broken.bvh", [0xff, 0xfe]);
    fs::create_dir(room.path("folder.model")).unwrap();
    let model = |name: &str| format!("{{ name = \"{name}\", set = ['tracker.gpdm.model_file=\"{name}\"'] }}");
    let clip = |name: &str| format!("{{ name = \"{name}\", set = ['motion.clip={name}'] }}");
    let settings =
        [model("broken.model"), model("folder.model"), model("late.model"), clip("late.txt"), clip("broken.bvh")];
    let sound = "{ name = \"sound\", set = [] }";
    let head = "schema = \"skiagraph.sweep/1\"\nname = \"a\"\nbase = \"base.toml\"\nseeds = 1\n[axes]\n";
    room.write("sweep.toml", format!("{head}what = [{}, {sound}]\n", settings.join(", ")));
    for jobs in [1, 2] {
        let answer = room.ask(&format!("sweep sweep.toml --out s{jobs} -j {jobs}"));
        assert_eq!(answer.code, 1, "{}", answer.stderr);
        let [what, status, error] = ["what", "status", "error"].map(|name| column(&room, &format!("s{jobs}"), name));
        assert_eq!(what.len(), 6);
        for row in 0..6 {
            let is_sound = what[row] == "sound";
            assert_eq!(status[row], if is_sound { "ok" } else { "failed" }, "{}: {}", what[row], error[row]);
            assert!(is_sound || error[row].contains(&what[row]), "{}: {}", what[row], error[row]);
        }
    }
    // the missing file is added
    room.write("late.txt", fs::read(shipped("scenarios/motions/humanoid3d_walk.txt")).unwrap());
    for (option, run) in [("", 0), ("--retry-failed", 5)] {
        let answer = room.ask(&format!("sweep run s1 --json {option}"));
        assert_eq!((answer.code, answer.json()["run"].as_u64()), (1, Some(run)), "{}", answer.stdout);
    }
    assert_eq!(column(&room, "s1", "status").iter().filter(|status| *status == "ok").count(), 2);
}

#[test]
fn processes_may_share_a_sweep() {
    let (room, whole) = planned();
    let both = ["sweep run s -j 1 --quiet"; 2].map(|run| room.start(run));
    let codes = both.map(|child| child.wait_with_output().unwrap().status.code().unwrap());
    assert!(codes.contains(&0) && codes.iter().all(|code| [0, 75].contains(code)), "{codes:?}");
    assert_eq!(tables(&room, "s"), whole);
    // parts run at the same time, including the same ones
    room.succeed(&format!("sweep plan {GRID} --out t"));
    let parts = ["1/2", "2/2", "1/3", "1/3", "1/1"].map(|part| room.start(&format!("sweep run t --part {part}")));
    for child in parts {
        assert!(child.wait_with_output().unwrap().status.success());
    }
    assert_eq!(tables(&room, "t"), whole);
}

/// A sweep of six scenes, two of which only differ in the tracker's settings.
const SCENES: &str = "schema = \"skiagraph.sweep/1\"\nname = \"scenes\"\ndescription = \"Descr\"\nbase = \"tiny.toml\"\n\
    set = [\"observation.silhouette=corrupted\", \"boundary_px=1\", \"truth_images=['depth']\"]\n\
    [axes]\nclip = [{ name = \"walk\", set = [\"motion.clip=embedded:walk\"] }, \
    { name = \"run\", set = [\"motion.clip=embedded:run\"] }]\n\"rig.ring.count\" = [1, 2]\nparticles = [6, 12]\n\
    [splits]\nby = \"clip\"\nparts = { test = [\"run\"] }\nrest = \"train\"\n";

#[test]
fn sets_of_a_sweep_are_made_in_parts_and_tracked() {
    let room = Sandbox::tiny();
    room.write("scenes.toml", SCENES);
    room.succeed("render scenes.toml --out s --part 2/2");
    assert!(!room.path("s/sets.csv").exists());
    let rest = room.json_of("render scenes.toml --out s --json");
    assert_eq!((&rest["sets"], &rest["left"], &rest["splits"]["test"]), (&4.into(), &0.into(), &2.into()));
    assert!(rest["made"].as_u64() < Some(4), "{rest}");
    let notes = rest["notes"].to_string();
    assert!(notes.contains("axis particles changes no set") && notes.contains("SET/truth/key.txt"), "{notes}");
    let listed = |name: &str| room.text(&format!("s/{name}.txt")).lines().map(str::to_owned).collect::<Vec<_>>();
    let (test, train) = (listed("test"), listed("train"));
    assert!(test.iter().all(|set| !train.contains(set) && listed("sets").contains(set)));
    // every set has a key of its own, and the truth images that no tracker needs
    let keys: std::collections::BTreeSet<String> =
        listed("sets").iter().map(|set| room.text(&format!("s/{set}/truth/key.txt"))).collect();
    assert_eq!(keys.len(), 4);
    assert!(room.path(format!("s/{}/truth/layers", test[0])).is_dir());
    let table = room.text("s/sets.csv");
    assert!(table.starts_with("set,split,frames,frames_per_second,cameras,set_hash,clip,rig.ring.count\n"), "{table}");
    // a sweep tracks the sets that are there
    let before = room.entries_of("s/sets");
    room.succeed("sweep run s -j 2");
    assert_eq!((room.entries_of("s/sets"), column(&room, "s", "particles").len()), (before, 16));
}

#[test]
fn public_sets_of_a_sweep_do_not_say_what_was_varied() {
    let room = Sandbox::tiny();
    room.write("scenes.toml", SCENES);
    room.succeed("render scenes.toml --out public --truth whole");
    // killed between the two copies of a set
    let one = room.text("public/test.txt").lines().next().unwrap().to_owned();
    fs::remove_dir_all(room.path(format!("public/{one}"))).unwrap();
    let again = room.json_of("render scenes.toml --out public --truth whole --json");
    assert_eq!((&again["made"], &again["left"]), (&1.into(), &0.into()));
    assert!(room.text("public/sets.csv").starts_with("set,split,frames,frames_per_second,cameras,set_hash\n"));
    let public = room.files_below("public");
    assert!(
        public.iter().all(|path| !path.contains("truth") && !path.ends_with(".toml") || path.ends_with("set.toml"))
    );
    assert!(room.text("whole/sets.csv").contains(",public,clip,"));
    // the hash of a scene, by which anybody could confirm a guess, is nowhere
    let secret = room.entries_of("whole/sets");
    assert!(public.iter().all(|path| !secret.iter().any(|id| path.contains(id))));
    let names = room.text("public/sets.txt");
    assert!(names.lines().is_sorted() && !room.text("public/croissant.json").contains("Descr"), "{names}");
    // its truth is gone
    fs::rename(room.path(format!("whole/sets/{}", secret[0])), room.path("aside")).unwrap();
    room.refused("render scenes.toml --out public --truth whole", "its truth is not in whole/sets/");
    fs::rename(room.path("aside"), room.path(format!("whole/sets/{}", secret[0]))).unwrap();
    // another truth, a folder of the user's, the public key
    room.refused("render scenes.toml --out public --truth another", "expected a new or empty folder");
    room.write("mine/train.txt", "mine");
    room.refused("render scenes.toml --out mine --truth another", "expected a new or empty folder");
    room.refused("render scenes.toml --out p --truth another --key default", "expected a secret key");
    assert_eq!(room.text("mine/train.txt"), "mine");
}

#[test]
fn sets_of_a_sweep_with_another_key_are_named() {
    let room = Sandbox::tiny();
    room.write("scenes.toml", SCENES);
    room.succeed("sweep plan scenes.toml --out s");
    room.succeed("sweep run s --part 1/4");
    room.refused(
        "render scenes.toml --out s",
        "made with the public key, as skiagraph sweep run does; remove its folder",
    );
    room.succeed("render scenes.toml --out s --key default");
}

#[test]
fn sets_of_a_sweep_are_refused_where_another_plan_is() {
    let room = Sandbox::tiny();
    room.write("scenes.toml", SCENES);
    room.write("other.toml", SCENES.replace("[1, 2]", "[1, 3]"));
    room.succeed("render scenes.toml --out s");
    room.refused("render other.toml --out s", "sweep plan --extend");
    room.refused("render scenes.toml --out s --force", "expected no --force");
    room.refused("render tiny.toml --out t --part 1/2", "expected a sweep file");
    room.write(
        "tight.toml",
        SCENES.replace("\"rig.ring.count\" = [1, 2]", "\"rig.ring.look_at_m\" = [[0.0, 0.0, 1.0], [90.0, 0.0, 1.0]]"),
    );
    let failed = room.ask("render tight.toml --out unseen");
    assert!(failed.code == 1 && failed.stdout.contains("2 cannot be rendered"), "{} {}", failed.stdout, failed.stderr);
    assert_eq!(room.text("unseen/sets.txt").lines().count(), 2);
}
