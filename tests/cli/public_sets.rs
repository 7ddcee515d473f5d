//! `skiagraph render --truth`: sets with separate truth, and the commands that need it.

use skiagraph_set::BlindSet;

use crate::sandbox::Sandbox;

#[test]
fn public_exports_are_the_same() {
    let room = Sandbox::tiny();
    let keypoints = "observation.keypoints={layout=\"coco17\"}";
    room.succeed(&format!("render tiny.toml {keypoints} --out public --truth secret"));
    let formats = "openpose,pose2sim,anipose,caliscope,opencv,humaneva";
    for set in ["public", "secret"] {
        room.succeed(&format!("export {set} --to {formats} --out of-{set}"));
    }
    for format in formats.split(',') {
        // the listing has the hash of every file
        let [public, whole] = ["public", "secret"].map(|set| room.read(&format!("of-{set}/{format}/skiagraph.sha256")));
        assert!(public == whole && !public.is_empty(), "{format}");
    }
}

#[test]
fn public_lists_match_the_files() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml --out public --truth secret");
    let readme = room.text("public/README.txt");
    assert!(!readme.contains("truth/") && readme.contains("complete.sha256"), "{readme}");
    let listing = room.text("public/files.sha256");
    let paths: Vec<&str> = listing.lines().filter_map(|line| line.split_once("  ")).map(|(_, path)| path).collect();
    assert!(paths.len() > 10 && paths.iter().all(|path| room.path("public").join(path).exists()), "{listing}");
    let [public, secret] = ["public", "secret"].map(|set| BlindSet::read(&room.path(set)).unwrap().set_hash);
    assert_eq!(public, secret);
    // the complete set is measured with runs on the public one, and exports what the public one lacks
    room.succeed("track public --tracker frozen --out run");
    room.succeed("evaluate public run --truth secret");
    room.succeed("evaluate secret run");
    room.succeed("export public --to tum --truth secret");
    assert!(room.path("public-tum/root.txt").exists());
}
