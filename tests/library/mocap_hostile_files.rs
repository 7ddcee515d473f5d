//! Whatever bytes a file holds, its reader answers with a clip or an error: it never panics and never asks for much
//! memory.

use proptest::prelude::*;
use proptest::sample::Index;
use skiagraph::mocap::{Clip, MocapError, ReadOptions, parse_amc, parse_asf, parse_bvh, parse_deepmimic};

const SKELETON: &str = ":version 1.10\n:units\n mass 1.0\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n \
    position 0 0 0\n orientation 0 0 0\n:bonedata\n begin\n id 1\n name femur\n direction 0 -1 0\n length 7.1\n \
    axis 0 0 20 XYZ\n dof rx ry rz\n limits (-160.0 20.0)\n (-70.0 70.0)\n (-60.0 70.0)\n end\n begin\n id 2\n name tibia\n \
    direction 0.3 -0.9 0\n length 7.4\n axis 0 0 20 XYZ\n dof rx\n end\n:hierarchy\n begin\n root femur\n femur tibia\n end\n";
const MOTION: &str = "#!OML\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 9.3 17.8 -17.3 -2 -7.5 -3.2\nfemur 1 2 3\ntibia 26.4\n\
    2\nroot 9.3 17.8 -17.3 -2 -7.6 -3.2\nfemur 1 2 4\ntibia 26.5\n3\nroot 0 0 0 0 0 0\nfemur 0 0 0\ntibia 0\n\
    4\nroot 9.3 17.8 -17.3 -2 -7.6 -3.2\nfemur 1 2 4\ntibia 26.5\n";

/// The first rows of a recording that ships, its header told so.
fn bvh() -> String {
    let text = include_str!("../../scenarios/motions/01_01.bvh");
    let head: Vec<&str> = text.lines().take(192).collect();
    head.join("\n").replace("Frames: 2752", "Frames: 5")
}

/// The first rows of a clip that ships.
fn deepmimic() -> String {
    let text = include_str!("../../scenarios/motions/humanoid3d_walk.txt");
    let rows: Vec<&str> = text.lines().take(9).collect();
    format!("{}\n]}}", rows.join("\n").trim_end_matches(','))
}

fn parse_acclaim(skeleton: &str, motion: &str) -> Result<Clip, MocapError> {
    let skeleton = parse_asf(skeleton, "f.asf")?;
    parse_amc(motion, "f.amc", &skeleton, &ReadOptions::default())
}

/// A clip that was accepted holds what its documentation promises.
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

/// What may befall a text.
#[derive(Clone, Debug)]
enum Accident {
    CutAt(Index),
    Word(Index, String),
    LineTwice(Index),
    LineLost(Index),
    LinesSwapped(Index, Index),
}

fn accidents() -> impl Strategy<Value = Accident> {
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
        any::<Index>().prop_map(Accident::CutAt),
        (any::<Index>(), words).prop_map(|(at, word)| Accident::Word(at, word.to_owned())),
        (any::<Index>(), "\\PC{0,12}").prop_map(|(at, word)| Accident::Word(at, word)),
        any::<Index>().prop_map(Accident::LineTwice),
        any::<Index>().prop_map(Accident::LineLost),
        (any::<Index>(), any::<Index>()).prop_map(|(a, b)| Accident::LinesSwapped(a, b)),
    ]
}

fn befall(mut text: String, accidents: &[Accident]) -> String {
    for accident in accidents {
        let lines: Vec<&str> = text.lines().collect();
        if lines.is_empty() {
            break;
        }
        let edited = |edit: &dyn Fn(&mut Vec<&str>)| {
            let mut lines = lines.clone();
            edit(&mut lines);
            lines.join("\n")
        };
        text = match accident {
            Accident::CutAt(at) => text.chars().take(at.index(text.chars().count() + 1)).collect(),
            Accident::Word(at, word) => {
                let mut words: Vec<&str> = text.split(' ').collect();
                let index = at.index(words.len());
                words[index] = word;
                words.join(" ")
            }
            Accident::LineTwice(at) => {
                edited(&|lines| lines.insert(at.index(lines.len()), lines[at.index(lines.len())]))
            }
            Accident::LineLost(at) => edited(&|lines| {
                lines.remove(at.index(lines.len()));
            }),
            Accident::LinesSwapped(a, b) => edited(&|lines| {
                let (a, b) = (a.index(lines.len()), b.index(lines.len()));
                lines.swap(a, b);
            }),
        };
    }
    text
}

#[test]
fn the_untouched_texts_are_accepted() {
    assert_eq!(parse_bvh(&bvh(), "f.bvh", &ReadOptions::default()).unwrap().frames.len(), 5);
    assert_eq!(parse_acclaim(SKELETON, MOTION).unwrap().frames.len(), 4);
    assert_eq!(parse_deepmimic(&deepmimic(), "f.txt", &ReadOptions::default()).unwrap().frames.len(), 5);
}

#[test]
fn a_file_of_ever_deeper_or_ever_more_joints_is_refused() {
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
    fn a_bvh_that_met_with_accidents_does_no_harm(accidents in prop::collection::vec(accidents(), 1..4)) {
        check(parse_bvh(&befall(bvh(), &accidents), "f.bvh", &ReadOptions::default()));
    }

    #[test]
    fn an_acclaim_pair_that_met_with_accidents_does_no_harm(
        skeleton in prop::collection::vec(accidents(), 0..3),
        motion in prop::collection::vec(accidents(), 0..3),
    ) {
        check(parse_acclaim(&befall(SKELETON.to_owned(), &skeleton), &befall(MOTION.to_owned(), &motion)));
    }

    #[test]
    fn a_deepmimic_clip_that_met_with_accidents_does_no_harm(accidents in prop::collection::vec(accidents(), 1..3)) {
        check(parse_deepmimic(&befall(deepmimic(), &accidents), "f.txt", &ReadOptions::default()));
    }

    #[test]
    fn any_bytes_at_all_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let text = String::from_utf8_lossy(&bytes);
        check(parse_bvh(&text, "f", &ReadOptions::default()));
        check(parse_deepmimic(&text, "f", &ReadOptions::default()));
        check(parse_acclaim(&text, MOTION));
        check(parse_acclaim(SKELETON, &text));
    }
}
