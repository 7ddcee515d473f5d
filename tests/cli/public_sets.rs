//! `skiagraph render --truth`: sets with separate truth, and the commands that need it.

use skiagraph::benchmark_set::BlindSet;

use crate::sandbox::{Sandbox, TINY};

const NO_TRUTH: &str = "public has no truth: it was rendered with --truth, or its folder truth/ was removed; give the \
                        complete set with `--truth DIR`";

fn room() -> Sandbox {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out public --truth secret");
    room
}

#[test]
fn a_public_set_is_measured_verified_and_exported_with_its_complete_set() {
    let room = room();
    let hint = room.succeed("track public --tracker frozen --out run").stdout;
    assert!(hint.contains("skiagraph evaluate public run --truth DIR"), "{hint}");
    room.succeed("evaluate public run --truth secret");
    room.succeed("export public --to tum --truth secret");
    assert!(room.path("public-tum/root.txt").exists());
    let verified = room.succeed("verify public --truth secret");
    assert!(verified.stdout.contains("public is sound"), "{}", verified.stdout);
    std::fs::create_dir(room.path("public/truth")).unwrap();
    room.write("public/truth/left.npz", "the truth");
    let told = room.skiagraph(["verify", "public", "--truth", "secret"]);
    assert!(told.code == 1 && told.stdout.contains("truth/left.npz: is not one of"), "{}", told.stdout);
    std::fs::remove_dir_all(room.path("public/truth")).unwrap();
    room.write("public/observations/cam00/silhouette/000001.png", "spoilt");
    let spoilt = room.skiagraph(["verify", "public", "--truth", "secret"]);
    assert!(spoilt.code == 1 && spoilt.stdout.contains("000001.png: was changed"), "{}", spoilt.stdout);
}

#[test]
fn commands_that_need_the_truth_of_a_public_set_name_the_option() {
    let room = room();
    room.succeed("track public --tracker frozen --out run");
    for command in
        ["evaluate public run", "verify public", "export public --to coco", "track public --tracker oracle --out told"]
    {
        let refused = room.skiagraph(command.split(' '));
        assert!(refused.code == 2 && refused.stderr.contains(NO_TRUTH), "{command}: {}", refused.stderr);
        assert_eq!(refused.stderr.trim_end().lines().count(), 1, "{command}: {}", refused.stderr);
    }
    assert_eq!(room.entries(), ["public", "run", "secret", "tiny.toml"]);
}

#[test]
fn render_prints_the_full_hash_of_each_of_the_two_sets() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let said = room.succeed("render tiny.toml --out public --truth secret").stdout;
    let lines: Vec<&str> = said.lines().collect();
    let of = |name: &str| BlindSet::read(&room.path(name)).unwrap().full_hash;
    let ends = |line: usize, name: &str| {
        lines[line].starts_with(&format!("{name}: ")) && lines[line].ends_with(&format!("full hash {}", of(name)))
    };
    assert!(lines.len() == 2 && ends(0, "public") && ends(1, "secret"), "{said}");
    assert_ne!(of("public"), of("secret"));
}

#[test]
fn a_public_set_is_exported_without_its_truth_to_the_same_files() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    let keypoints = "observation.keypoints={layout=\"coco17\"}";
    let rendered = room.skiagraph(["render", "tiny.toml", keypoints, "--out", "public", "--truth", "secret"]);
    assert_eq!(rendered.code, 0, "{}", rendered.stderr);
    let formats = "bodytrack,openpose,pose2sim,anipose,caliscope,opencv,humaneva";
    for set in ["public", "secret"] {
        room.succeed(&format!("export {set} --to {formats} --out of-{set}"));
    }
    for format in formats.split(',') {
        // the listing has the hash of every file
        let [public, whole] = ["public", "secret"].map(|set| room.read(&format!("of-{set}/{format}/skiagraph.sha256")));
        assert!(public == whole && !public.is_empty(), "{format}");
    }
    let others = room.skiagraph(["export", "public", "--to", "opencv", "--truth", "public"]);
    assert!(others.code == 2 && others.stderr.contains("public has no truth"), "{}", others.stderr);
}

#[test]
fn the_truth_of_another_set_is_refused_by_its_hash() {
    let room = room();
    room.succeed("render tiny.toml motion.last_frame=2 --out other --truth others");
    for (truth, words) in [("others", "others is not the truth of public"), ("other", "other has no truth")] {
        let refused = room.skiagraph(["verify", "public", "--truth", truth]);
        assert!(refused.code == 2 && refused.stderr.contains(words), "{}", refused.stderr);
    }
}

#[test]
fn lists_and_readme_of_a_public_set_match_its_files() {
    let room = room();
    let readme = String::from_utf8(room.read("public/README.txt")).unwrap();
    assert!(!readme.contains("truth/") && readme.contains("complete.sha256"), "{readme}");
    let listing = String::from_utf8(room.read("public/files.sha256")).unwrap();
    let paths: Vec<&str> = listing.lines().filter_map(|line| line.split_once("  ")).map(|(_, path)| path).collect();
    assert!(paths.len() > 10 && paths.iter().all(|path| room.path("public").join(path).exists()), "{listing}");
    let [public, secret] = ["public", "secret"].map(|set| BlindSet::read(&room.path(set)).unwrap().set_hash);
    assert_eq!(public, secret);
    let complete = room.read("public/complete.sha256");
    let told = room.succeed("inspect public").stdout;
    assert!(told.contains("this set has no truth") && told.contains("all match files.sha256"), "{told}");
    let facts = room.succeed("inspect public --json").stdout;
    assert!(facts.contains("\"hashes_ok\": true") && !facts.contains("\"motion\""), "{facts}");
    // a modified list is found
    room.write("public/complete.sha256", [complete, b"# more\n".to_vec()].concat());
    let refused = room.skiagraph(["track", "public", "--tracker", "frozen", "--out", "run"]);
    assert!(refused.code == 2 && refused.stderr.contains("complete.sha256 was changed"), "{}", refused.stderr);
}
