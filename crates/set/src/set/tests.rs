use super::*;
use crate::SetDrawing;
use crate::fixture::small_set;
use std::fs;

#[test]
fn a_set_rendered_directly_to_disk_is_the_same_as_one_assembled_and_written() {
    let motion = crate::test_bodies::walk(5);
    let truth_images = [TruthImage::Depth, TruthImage::Parts];
    let assembled = tempfile::tempdir().unwrap();
    crate::fixture::set_of(&motion).unwrap().write_with_truth_images(assembled.path(), &truth_images).unwrap();
    let drawn = tempfile::tempdir().unwrap();
    crate::fixture::with_parts(&motion, |parts, observer| {
        let drawing = SetDrawing { truth_images: &truth_images, ..SetDrawing::default() };
        BenchmarkSet::draw_into(drawn.path(), parts, &drawing, |frame| observer.observe(frame))
    })
    .unwrap();
    // the listing has the digest of every file
    let listing = |folder: &Path| std::fs::read_to_string(folder.join(LISTING)).unwrap();
    assert_eq!(listing(drawn.path()), listing(assembled.path()));
    verify_hashes(drawn.path()).unwrap();
}

fn written(set: &BenchmarkSet) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    set.write(directory.path()).unwrap();
    directory
}

fn same(a: &BenchmarkSet, b: &BenchmarkSet) {
    assert_eq!(a.truth, b.truth);
    assert_eq!((&a.blind.name, &a.blind.set_hash), (&b.blind.name, &b.blind.set_hash));
    assert_eq!((&a.blind.rig, &a.blind.start), (&b.blind.rig, &b.blind.start));
    assert_eq!((a.blind.frame_count, a.blind.frames_per_second), (b.blind.frame_count, b.blind.frames_per_second));
    for (x, y) in a.blind.observations().zip(b.blind.observations()) {
        assert_eq!(x.unwrap(), y.unwrap());
    }
}

#[test]
fn a_set_on_disk_is_the_set_in_memory() {
    let set = small_set(3).unwrap();
    let directory = written(&set);
    verify_hashes(directory.path()).unwrap();
    let read = BenchmarkSet::read(directory.path()).unwrap();
    same(&set, &read);
    assert_eq!(set.blind.observations().count(), 3);
    // a copy made from disk is the same again
    let copy = written(&read);
    same(&set, &BenchmarkSet::read(copy.path()).unwrap());
}

#[test]
fn an_addition_to_the_readme_changes_neither_the_hash_nor_the_content() {
    let set = small_set(1).unwrap();
    let noted = set.clone().with_readme("\nCut out.\n").unwrap();
    same(&set, &noted);
    assert_eq!(set.blind.set_hash, noted.blind.set_hash);
    let directory = written(&noted);
    verify_hashes(directory.path()).unwrap();
    assert!(fs::read_to_string(directory.path().join("README.txt")).unwrap().ends_with("\nCut out.\n"));
}

#[test]
fn a_tracker_needs_no_truth_and_does_not_read_it() {
    let set = small_set(2).unwrap();
    let directory = written(&set);
    fs::remove_dir_all(directory.path().join("truth")).unwrap();
    let blind = BlindSet::read(directory.path()).unwrap();
    assert_eq!(blind.observation(1).unwrap(), set.blind.observation(1).unwrap());
    let error = TruthSet::read(directory.path()).unwrap_err().to_string();
    assert!(error.contains("has no truth: it was rendered with --truth, or its folder truth/ was removed"), "{error}");
}

#[test]
fn one_flipped_byte_in_any_file_is_found_and_the_file_named() {
    let directory = written(&small_set(1).unwrap());
    let listing = fs::read_to_string(directory.path().join("files.sha256")).unwrap();
    assert_eq!(listing.lines().count(), 14 + 3);
    for file in listing.lines().map(|line| &line[66..]) {
        let path = directory.path().join(file);
        let whole = fs::read(&path).unwrap();
        let mut broken = whole.clone();
        broken[whole.len() / 2] ^= 1;
        fs::write(&path, broken).unwrap();
        let error = verify_hashes(directory.path()).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{} was changed or truncated", path.display())), "{error}");
        fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        assert!(verify_hashes(directory.path()).is_err());
        fs::write(&path, whole).unwrap();
    }
    verify_hashes(directory.path()).unwrap();
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let hash = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| small_set(4).unwrap().blind.set_hash)
    };
    assert_eq!(hash(1), hash(3));
    assert_ne!(hash(1), small_set(5).unwrap().blind.set_hash);
}

#[test]
fn inconsistent_parts_make_no_set() {
    let set = small_set(2).unwrap();
    let (truth, blind) = (&set.truth, &set.blind);
    let parts = SetParts {
        name: "x",
        rig: &truth.rig,
        start: &blind.start,
        ground_truth: &truth.ground_truth,
        refitted: None,
        facts: &truth.facts,
        recordings: &[],
        observation: None,
        key: ObservationKey::default(),
    };
    let refused = |parts: &SetParts<'_>| {
        BenchmarkSet::assemble(parts, |frame| blind.observation(frame).unwrap()).unwrap_err().to_string()
    };
    let two = TimedRig::from(&CameraRig { cameras: blind.rig.cameras[..2].to_vec() });
    assert!(refused(&SetParts { rig: &two, ..parts }).contains("does not match these 2 cameras"));
    let mut start = blind.start.clone();
    start.pose.joint_angles = nalgebra::DVector::zeros(3);
    assert!(refused(&SetParts { start: &start, ..parts }).contains("start and refitted poses"));
    let short = Motion { frames_per_second: 60.0, poses: vec![blind.start.pose.clone()] };
    assert!(refused(&SetParts { refitted: Some(&short), ..parts }).contains("1 refitted poses for 2 frames"));
    let other_frame = BenchmarkSet::assemble(&parts, |_| blind.observation(0).unwrap()).unwrap_err();
    assert!(other_frame.to_string().contains("frame 1 (from 0) does not match the cameras"), "{other_frame}");
}
