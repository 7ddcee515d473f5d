//! Interrupted rendering: the same command resumes, with the bytes of an uninterrupted one.

use std::fs;
use std::time::Duration;

use crate::sandbox::Sandbox;

const RENDER: &str = "render tiny.toml motion.last_frame=39 truth_images=[\"depth\"] --out";

/// The number of lines of the journal; 0 without one.
fn whole_files(room: &Sandbox) -> usize {
    fs::read_to_string(room.path("set.partial/finished.sha256")).map_or(0, |text| text.lines().count())
}

#[test]
fn killed_rendering_is_resumed() {
    let room = Sandbox::tiny();
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

/// With the same settings only.
#[cfg(unix)]
#[test]
fn interrupted_rendering_is_resumed() {
    let room = Sandbox::tiny();
    let long = "render tiny.toml motion.last_frame=39 motion.loop_to_s=40 --out set";
    let mut child = room.start(long);
    crate::sandbox::wait_until(&mut child, || whole_files(&room) >= 50);
    let said = crate::sandbox::interrupt(child);
    assert!(said.contains("interrupted; progress is saved in set.partial: run the same command to resume"), "{said}");
    assert_eq!(room.entries(), ["set.partial", "tiny.toml"]);
    room.refused("verify set.partial/set", "is not a complete benchmark set");
    room.refused(&format!("{long} rig.ring.count=3"), "rig.ring.count: was 2, now 3");
    room.notes(long, &["note: resumed: "]);
    room.succeed(&format!("{} whole -q", long.strip_suffix(" set").unwrap()));
    assert_eq!(room.read("set/files.sha256"), room.read("whole/files.sha256"));
    assert_eq!(room.entries(), ["set", "tiny.toml", "whole"]);
}
