//! Interrupted rendering: the same command resumes, with the bytes of an uninterrupted one.

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;

use crate::sandbox::{Sandbox, TINY};

const RENDER: &str = "render tiny.toml motion.last_frame=39 layers=[\"depth\"] --shards 5 --out";

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room
}

/// The number of lines of the journal; 0 without one.
fn whole_files(room: &Sandbox) -> usize {
    fs::read_to_string(room.path("set.partial/finished.sha256")).map_or(0, |text| text.lines().count())
}

#[test]
fn a_rendering_killed_many_times_gives_the_bytes_of_an_uninterrupted_one() {
    let room = room();
    room.succeed(&format!("{RENDER} whole -q"));
    let (mut moment, mut killed, mut amid) = (17_u64, 0, 0);
    for _ in 0..14 {
        moment = moment * 37 % 101;
        killed += usize::from(room.run_and_kill(&format!("{RENDER} set -q"), Duration::from_millis(20 + 3 * moment)));
        if room.path("set").exists() {
            // it finished before the kill
            assert_eq!(room.read("set/files.sha256"), room.read("whole/files.sha256"));
            fs::remove_dir_all(room.path("set")).unwrap();
        }
        amid += usize::from(whole_files(&room) > 13);
        // as after a power failure
        if amid % 3 == 2 {
            let file = room.path("set.partial/set/observations/cam00/silhouette/000001.png");
            if file.exists() {
                fs::write(&file, "cut").unwrap();
            }
        }
    }
    assert!(killed >= 3, "of 14 commands only {killed} were killed before their end");
    room.succeed(&format!("{RENDER} set -q"));
    assert_eq!(room.read("set/files.sha256"), room.read("whole/files.sha256"));
    room.succeed("verify set");
    assert_eq!(room.entries(), ["set", "tiny.toml", "whole"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_names_the_saved_progress_and_other_settings_are_refused_by_key() {
    let room = room();
    let long = "render tiny.toml motion.last_frame=39 motion.loop_to_s=40 --out set";
    let mut child = Command::new(cargo_bin("skiagraph"))
        .args(long.split(' '))
        .current_dir(room.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while whole_files(&room) < 50 {
        assert!(child.try_wait().unwrap().is_none(), "it was too fast");
        std::thread::sleep(Duration::from_millis(2));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted; progress is saved in set.partial: run the same command to resume"), "{said}");
    assert_eq!(room.entries(), ["set.partial", "tiny.toml"]);
    let not_yet = room.skiagraph(["verify", "set.partial/set"]);
    assert!(not_yet.code == 2 && not_yet.stderr.contains("is not a complete benchmark set"), "{}", not_yet.stderr);
    let other = room.skiagraph(format!("{long} rig.ring.count=3").split(' '));
    assert_eq!(other.code, 2, "{}", other.stderr);
    assert!(other.stderr.contains("rig.ring.count: was 2, now 3"), "{}", other.stderr);
    let sharded = room.skiagraph(format!("{long} --shards 2").split(' '));
    assert!(sharded.stderr.contains("--shards: was nothing, now 2"), "{}", sharded.stderr);
    let resumed = room.succeed(long);
    assert!(resumed.stderr.contains("note: resumed: "), "{}", resumed.stderr);
    room.succeed(&format!("{} whole -q", long.strip_suffix(" set").unwrap()));
    assert_eq!(room.read("set/files.sha256"), room.read("whole/files.sha256"));
    assert_eq!(room.entries(), ["set", "tiny.toml", "whole"]);
}

#[test]
fn a_ladder_resumes_after_its_finished_sets() {
    let room = room();
    let ladder = "render tiny.toml --ladder holes --levels 0.1,0.2 --key 00112233445566778899aabbccddeeff --out ladder";
    room.succeed(&format!("{ladder} -q"));
    let whole = [0.1, 0.2].map(|level| room.read(&format!("ladder/holes-{level}/files.sha256")));
    // the second level can be written only after a foreign file is removed
    fs::remove_dir_all(room.path("ladder")).unwrap();
    fs::create_dir_all(room.path("ladder/holes-0.2.partial")).unwrap();
    room.write("ladder/holes-0.2.partial/thesis.tex", "years of work");
    let stopped = room.skiagraph(ladder.split(' '));
    assert!(stopped.code == 2 && stopped.stderr.contains("holes-0.2.partial"), "{}", stopped.stderr);
    fs::remove_dir_all(room.path("ladder/holes-0.2.partial")).unwrap();
    let again = room.succeed(ladder);
    assert!(again.stderr.contains("holes-0.1: already made before the interruption"), "{}", again.stderr);
    assert_eq!([0.1, 0.2].map(|level| room.read(&format!("ladder/holes-{level}/files.sha256"))), whole);
    assert!(!room.path("ladder/holes.partial").exists());
    assert_eq!(room.skiagraph(ladder.split(' ')).code, 2, "a complete ladder is replaced only with --force");
}

#[test]
fn too_many_shards_are_refused_and_a_missing_one_is_named() {
    let room = room();
    let many = room.skiagraph("render tiny.toml --shards 9 --out set".split(' '));
    assert!(many.code == 2 && many.stderr.contains("--shards: expected 1 to 5 shards"), "{}", many.stderr);
    assert_eq!(room.entries(), ["tiny.toml"]);
    room.succeed("render tiny.toml --shards 2 --out set -q");
    let shard = room.path("set/truth/shards/000001.tar");
    let whole = fs::read(&shard).unwrap();
    fs::remove_file(&shard).unwrap();
    let verified = || {
        let said = room.skiagraph(["verify", "set"]);
        assert_eq!(said.code, 1);
        said.stdout + &said.stderr
    };
    let text = verified();
    assert_eq!(text.matches("000001.tar").count(), 1, "{text}");
    assert!(text.contains("is missing; the set lists 2 shards"), "{text}");
    fs::write(&shard, &whole[..whole.len() / 3]).unwrap();
    let text = verified();
    assert!(text.matches("000001.tar").count() == 1 && text.contains("was changed or truncated"), "{text}");
}

#[test]
fn a_set_in_shards_works_like_one_in_files_and_a_lost_shard_is_reported_once() {
    let room = room();
    let layers = "layers=[\"depth\",\"parts\"]";
    room.succeed(&format!("render tiny.toml {layers} --out plain -q"));
    room.succeed(&format!("render tiny.toml {layers} --shards 2 --out packed -q"));
    for set in ["plain", "packed"] {
        room.succeed(&format!(
            "track {set} --tracker annealed_particle_filter particles=20 layers=2 --out {set}-run -q"
        ));
        let verified = room.succeed(&format!("verify {set}"));
        assert!(verified.stdout.contains("is sound: 16 checks, no fault"), "{}", verified.stdout);
    }
    let poses = |set: &str| {
        let run = room.path(&format!("{set}-run"));
        fs::read(run.join("poses.npz")).unwrap()
    };
    assert_eq!(poses("plain"), poses("packed"));
    let scores = |set: &str| room.succeed(&format!("evaluate {set} {set}-run --json")).stdout;
    let metrics = |set: &str| serde_json::from_str::<serde_json::Value>(&scores(set)).unwrap()["metrics"].clone();
    assert!(metrics("plain").is_object() && metrics("plain") == metrics("packed"));
    room.succeed("inspect packed");
    room.succeed("export packed --to coco --out exported");
    let shard = room.path("packed/observations/shards/000001.tar");
    let whole = fs::read(&shard).unwrap();
    for (bytes, words) in [(None, "this shard is missing; the set lists 2"), (Some(&whole[..700]), "it is truncated")] {
        fs::remove_file(&shard).unwrap();
        if let Some(bytes) = bytes {
            fs::write(&shard, bytes).unwrap();
        }
        let refused = room.skiagraph("track packed --tracker annealed_particle_filter --out lost".split(' '));
        assert_eq!(refused.code, 2, "{}", refused.stderr);
        assert_eq!(refused.stderr.matches("observations/shards/000001.tar").count(), 1, "{}", refused.stderr);
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
        fs::write(&shard, &whole).unwrap();
    }
}
