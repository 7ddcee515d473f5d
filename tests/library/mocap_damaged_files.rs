//! Whatever bytes a file holds, its reader returns a clip or an error: it never panics and never allocates much memory.

use proptest::prelude::*;
use proptest::sample::Index;
use skiagraph_truth::mocap::{Clip, MocapError, ReadOptions, parse_amc, parse_asf, parse_bvh, parse_deepmimic};

const SKELETON: &str = ":version 1.10\n:units\n mass 1.0\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n \
    position 0 0 0\n orientation 0 0 0\n:bonedata\n begin\n id 1\n name femur\n direction 0 -1 0\n length 7.1\n \
    axis 0 0 20 XYZ\n dof rx ry rz\n limits (-160.0 20.0)\n (-70.0 70.0)\n (-60.0 70.0)\n end\n begin\n id 2\n name tibia\n \
    direction 0.3 -0.9 0\n length 7.4\n axis 0 0 20 XYZ\n dof rx\n end\n:hierarchy\n begin\n root femur\n femur tibia\n end\n";
const MOTION: &str = "#!OML\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 9.3 17.8 -17.3 -2 -7.5 -3.2\nfemur 1 2 3\ntibia 26.4\n\
    2\nroot 9.3 17.8 -17.3 -2 -7.6 -3.2\nfemur 1 2 4\ntibia 26.5\n3\nroot 0 0 0 0 0 0\nfemur 0 0 0\ntibia 0\n\
    4\nroot 9.3 17.8 -17.3 -2 -7.6 -3.2\nfemur 1 2 4\ntibia 26.5\n";

/// The first rows of a shipped recording, with the header changed to match.
fn bvh() -> String {
    let text = include_str!("../../scenarios/motions/01_01.bvh");
    let head: Vec<&str> = text.lines().take(192).collect();
    head.join("\n").replace("Frames: 2752", "Frames: 5")
}

/// The first rows of a shipped clip.
fn deepmimic() -> String {
    let text = include_str!("../../scenarios/motions/humanoid3d_walk.txt");
    let rows: Vec<&str> = text.lines().take(9).collect();
    format!("{}\n]}}", rows.join("\n").trim_end_matches(','))
}

fn parse_acclaim(skeleton: &str, motion: &str) -> Result<Clip, MocapError> {
    let skeleton = parse_asf(skeleton, "f.asf")?;
    parse_amc(motion, "f.amc", &skeleton, &ReadOptions::default())
}

/// An accepted clip is valid.
fn check(result: Result<Clip, MocapError>) {
    match result {
        Ok(clip) => {
            assert!(clip.frames.len() >= 2 && clip.frames_per_second > 0.0);
            for transform in clip.frames.iter().flatten() {
                assert!(transform.translation.vector.iter().all(|number| number.is_finite()));
                assert!((transform.rotation.norm() - 1.0).abs() < 1e-9);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// A way to damage a text.
#[derive(Clone, Debug)]
enum Damage {
    Truncated(Index),
    ReplacedWord(Index, String),
    DuplicatedLine(Index),
    RemovedLine(Index),
    SwappedLines(Index, Index),
}

fn damages() -> impl Strategy<Value = Damage> {
    let words = prop_oneof![
        Just("nan"),
        Just("-inf"),
        Just("1e300"),
        Just("1e-300"),
        Just("0"),
        Just("4000000000"),
        Just("-1"),
        Just("{"),
        Just("}"),
        Just("MOTION"),
        Just("JOINT"),
        Just("end"),
        Just("begin"),
        Just(":root"),
        Just("root"),
        Just("femur"),
        Just("[[]]"),
        Just("null"),
        Just(","),
        Just("\""),
        Just("\u{0}"),
        Just("é"),
    ];
    prop_oneof![
        any::<Index>().prop_map(Damage::Truncated),
        (any::<Index>(), words).prop_map(|(at, word)| Damage::ReplacedWord(at, word.to_owned())),
        (any::<Index>(), "\\PC{0,12}").prop_map(|(at, word)| Damage::ReplacedWord(at, word)),
        any::<Index>().prop_map(Damage::DuplicatedLine),
        any::<Index>().prop_map(Damage::RemovedLine),
        (any::<Index>(), any::<Index>()).prop_map(|(a, b)| Damage::SwappedLines(a, b)),
    ]
}

fn damaged(mut text: String, damages: &[Damage]) -> String {
    for damage in damages {
        let lines: Vec<&str> = text.lines().collect();
        if lines.is_empty() {
            break;
        }
        let edited = |edit: &dyn Fn(&mut Vec<&str>)| {
            let mut lines = lines.clone();
            edit(&mut lines);
            lines.join("\n")
        };
        text = match damage {
            Damage::Truncated(at) => text.chars().take(at.index(text.chars().count() + 1)).collect(),
            Damage::ReplacedWord(at, word) => {
                let mut words: Vec<&str> = text.split(' ').collect();
                let index = at.index(words.len());
                words[index] = word;
                words.join(" ")
            }
            Damage::DuplicatedLine(at) => {
                edited(&|lines| lines.insert(at.index(lines.len()), lines[at.index(lines.len())]))
            }
            Damage::RemovedLine(at) => edited(&|lines| {
                lines.remove(at.index(lines.len()));
            }),
            Damage::SwappedLines(a, b) => edited(&|lines| {
                let (a, b) = (a.index(lines.len()), b.index(lines.len()));
                lines.swap(a, b);
            }),
        };
    }
    text
}

#[test]
fn the_undamaged_texts_are_accepted() {
    assert_eq!(parse_bvh(&bvh(), "f.bvh", &ReadOptions::default()).unwrap().frames.len(), 5);
    assert_eq!(parse_acclaim(SKELETON, MOTION).unwrap().frames.len(), 4);
    assert_eq!(parse_deepmimic(&deepmimic(), "f.txt", &ReadOptions::default()).unwrap().frames.len(), 5);
}

#[test]
fn a_file_of_too_deep_or_too_many_joints_is_rejected() {
    for joint in ["{\nOFFSET 0 0 0\nCHANNELS 0\nJOINT b\n", "JOINT b\n{\nOFFSET 0 0 0\n}\n"] {
        let open = if joint.starts_with('{') { "" } else { "{\nOFFSET 0 0 0\n" };
        let text = format!("HIERARCHY\nROOT a\n{open}{}", joint.repeat(50_000));
        let error = parse_bvh(&text, "f.bvh", &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("expected at most 1000 joints"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_damaged_bvh_is_read_or_rejected(damages in prop::collection::vec(damages(), 1..4)) {
        check(parse_bvh(&damaged(bvh(), &damages), "f.bvh", &ReadOptions::default()));
    }

    #[test]
    fn a_damaged_acclaim_pair_is_read_or_rejected(
        skeleton in prop::collection::vec(damages(), 0..3),
        motion in prop::collection::vec(damages(), 0..3),
    ) {
        check(parse_acclaim(&damaged(SKELETON.to_owned(), &skeleton), &damaged(MOTION.to_owned(), &motion)));
    }

    #[test]
    fn a_damaged_deepmimic_clip_is_read_or_rejected(damages in prop::collection::vec(damages(), 1..3)) {
        check(parse_deepmimic(&damaged(deepmimic(), &damages), "f.txt", &ReadOptions::default()));
    }

    #[test]
    fn arbitrary_bytes_are_read_or_rejected(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let text = String::from_utf8_lossy(&bytes);
        check(parse_bvh(&text, "f", &ReadOptions::default()));
        check(parse_deepmimic(&text, "f", &ReadOptions::default()));
        check(parse_acclaim(&text, MOTION));
        check(parse_acclaim(SKELETON, &text));
    }
}
