//! Motions from built-in clips, played at another speed, repeated and joined.

use std::path::Path;

use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;
use skiagraph_core::body::Motion;
use skiagraph_core::contact::{ContactRule, GroundContacts, Pace};

fn staged(motion: &str, contact: &str) -> Result<PreparedScene, String> {
    let text = format!(
        "schema = \"skiagraph.scenario/1\"\nname = \"edited\"\n[motion]\n{motion}\n[actor]\ncontact = \"{contact}\"\n"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions");
    let file = ScenarioFile::parse(&text, "edited.toml", folder, &[]).map_err(|error| error.to_string())?;
    PreparedScene::new(&file, None).map_err(|error| error.to_string())
}

/// Share of frames in which the feet are on the ground, by speed of the motion.
fn standing(staged: &PreparedScene, motion: &Motion) -> f64 {
    let body = &staged.ground_truth.actor;
    let (rule, pace) = (ContactRule::default(), Pace(&staged.pace));
    let contacts = GroundContacts::from_motion_at_pace(body, motion, &rule, pace).unwrap();
    let frames: Vec<_> = contacts.feet.iter().flat_map(|foot| &foot.frames).collect();
    frames.iter().filter(|frame| frame.in_contact).count() as f64 / frames.len() as f64
}

fn fixed(motion: &str) -> (f64, [f64; 2]) {
    let staged = staged(motion, "fix").unwrap();
    let moved = staged.facts.contact.as_ref().unwrap().joints_moved_mm.unwrap();
    (standing(&staged, &staged.ground_truth.motion()), moved)
}

/// Fixed speed thresholds would take the swinging feet of a slow motion for standing ones.
#[test]
fn a_walk_in_slow_motion_keeps_its_stances() {
    let (share, moved) = fixed("clip = \"embedded:walk\"\nframes_per_second = 60.0");
    for speed in [0.25, 0.1] {
        let slow = format!("clip = \"embedded:walk\"\nframes_per_second = 30.0\nspeed = {speed}");
        let (slow_share, slow_moved) = fixed(&slow);
        assert!((slow_share - share).abs() < 0.06, "speed {speed}: {slow_share} of the time, recorded {share}");
        assert!(slow_moved[0] < moved[0] + 5.0, "speed {speed}: {slow_moved:?}, recorded {moved:?}");
    }
}

#[test]
fn a_take_with_another_speed_keeps_its_stances() {
    let takes = "clip = \"embedded:walk\"\nframes_per_second = 30.0\nloop_to_s = 2.0\n[[motion.then]]\n\
                 clip = \"embedded:walk\"\nspeed = 0.25\nloop_to_s = 6.0\n[motion.join]\nwithin_mm = 500.0";
    let staged = staged(takes, "fix").unwrap();
    let moved = staged.facts.contact.as_ref().unwrap().joints_moved_mm.unwrap();
    assert!(moved[0] < 20.0, "{moved:?}");
    assert_eq!((staged.pace[0], *staged.pace.last().unwrap()), (1.0, 0.25));
    assert_eq!(staged.pace.len(), staged.frames());
}

#[test]
fn an_invalid_take_is_named_by_its_key() {
    let walks = "clip = \"embedded:walk\"\nframes_per_second = 60.0\n[[motion.then]]\nclip = \"embedded:walk\"\n";
    let jump = format!("{walks}[[motion.then]]\nclip = \"embedded:jump\"\n[motion.join]\nwithin_mm = 1.0");
    let message = staged(&jump, "off").unwrap_err();
    assert!(message.contains("motion.then[0].clip") && message.contains("cannot follow"), "{message}");
    let short = format!("{walks}[[motion.then]]\nclip = \"embedded:walk\"\nfirst_frame = 1\nlast_frame = 8");
    let message = staged(&short, "off").unwrap_err();
    assert!(message.contains("motion.then[1].clip") && message.contains("too short to be joined"), "{message}");
    assert!(message.contains(" s (38 frames at 60 Hz)") && message.contains("frames); use a longer part"), "{message}");
}

/// Includes repetitions of later takes and a varied tempo.
#[test]
fn seams_of_all_takes_are_listed_in_order() {
    let takes = "clip = \"01_01.bvh\"\nframes_per_second = 30.0\nfirst_frame = 2\nlast_frame = 300\nloop_to_s = 5.0\n\
                 [[motion.then]]\nclip = \"01_01.bvh\"\nfirst_frame = 2\nlast_frame = 300\nloop_to_s = 7.0\n\
                 [motion.join]\nwithin_mm = 2000.0";
    let count = |staged: &PreparedScene| staged.seams.len();
    let plain = staged(takes, "off").unwrap();
    assert!(count(&plain) >= 3, "{:?}", plain.seams);
    for staged in
        [&plain, &staged(&format!("{takes}\n[motion.variation]\nseed = 4\ntempo_percent = 20.0"), "off").unwrap()]
    {
        assert_eq!(count(staged), count(&plain));
        assert!(staged.seams.windows(2).all(|pair| pair[0].first <= pair[1].first), "{:?}", staged.seams);
        assert!(staged.seams.iter().all(|seam| seam.first < seam.end && seam.end <= staged.frames()));
    }
    // the seam between the takes is at the first frame of the second take
    let last = plain.seams.last().unwrap();
    assert!(last.first > plain.frames() / 2, "{:?} of {}", plain.seams, plain.frames());
}
