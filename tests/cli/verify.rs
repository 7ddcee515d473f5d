//! `skiagraph verify`: exit code 0 for a sound set, 1 for a faulty one, 2 if the folder is not a set.

use std::fs;

use crate::sandbox::{Sandbox, TINY};

#[test]
fn a_rendered_set_with_layers_and_props_is_sound_and_a_damaged_one_is_not() {
    let room = Sandbox::new();
    let prop = "[[prop]]\nname = \"post\"\nshape = { cylinder = { radius_m = 0.1, length_m = 1.6 } }\nplace_m = [0.9, 0.9, 0.8]\n";
    room.write("tiny.toml", TINY.replace("seeds = 2\n", "seeds = 2\nlayers = [\"depth\", \"parts\"]\n") + prop);
    room.succeed("render tiny.toml --out set");
    let answer = room.succeed("verify set");
    assert!(answer.stdout.contains("set is sound: 16 checks, no fault"), "{}", answer.stdout);
    assert!(answer.stdout.contains("10 silhouettes redrawn"), "{}", answer.stdout);
    let every = room.succeed("verify set --every 4");
    assert!(every.stdout.contains("4 silhouettes redrawn"), "{}", every.stdout);
    assert!(every.stdout.trim_end().ends_with("were redrawn in one frame of 4 only"), "{}", every.stdout);

    room.write("set/observations/cam01/silhouette/000002.png", "nothing");
    let answer = room.skiagraph(["verify", "set"]);
    assert_eq!((answer.code, answer.stderr.as_str()), (1, ""), "{}", answer.stdout);
    assert!(answer.stdout.contains("FAULT hashes"), "{}", answer.stdout);
    assert!(answer.stdout.contains("observations/cam01/silhouette/000002.png: was changed"), "{}", answer.stdout);
    // skipped checks are not reported as passed
    let checks = |stdout: &str, check: &str| {
        let line = stdout.lines().find(|line| line.split_whitespace().nth(1) == Some(check));
        line.unwrap_or_else(|| panic!("{check}: {stdout}")).trim().to_owned()
    };
    let said = checks(&answer.stdout, "silhouettes");
    let skipped = "-     silhouettes  not checked: 1 of the silhouettes is missing or was changed; ";
    assert!(said.starts_with(skipped), "{said}");
    assert!(checks(&answer.stdout, "formats").starts_with("ok    formats "), "{}", answer.stdout);
    let answer = room.skiagraph(["verify", "set", "--json"]);
    let said: serde_json::Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(
        (answer.code, said["schema"].as_str(), said["sound"].as_bool()),
        (1, Some("skiagraph.verify/1"), Some(false))
    );
    assert_eq!(said["checks"][0]["faults"][0]["file"], "observations/cam01/silhouette/000002.png");
    room.write("set/truth/truth.npz", "nothing");
    let answer = room.skiagraph(["verify", "set"]);
    let said = checks(&answer.stdout, "formats");
    assert_eq!(said, "-     formats      not checked: cannot read truth/truth.npz");
}

#[test]
fn a_folder_that_is_not_a_set_is_refused_with_one_message() {
    let room = Sandbox::new();
    fs::create_dir(room.path("empty")).unwrap();
    for (place, words) in
        [("empty", "is not a complete benchmark set: it has no files.sha256"), ("nowhere", "no such folder: nowhere")]
    {
        let answer = room.skiagraph(["verify", place]);
        assert_eq!((answer.code, answer.stdout.as_str()), (2, ""), "{}", answer.stderr);
        assert!(answer.stderr.contains(words) && answer.stderr.lines().count() == 1, "{}", answer.stderr);
    }
}
