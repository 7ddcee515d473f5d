//! A hash of everything that a set shares with other draws of its observation noise.

use std::fmt::Write;

use skiagraph_core::input::hex_sha256;
use skiagraph_set::{BenchmarkSet, TruthFacts};

/// Hash of a set's scene: the true motion, cameras and props, the actor's body, how the tracker's body differs, and how
/// observations are made. It excludes what the observation seed draws: the observations, the errors of the cameras, of
/// the tracker's body and of the start, and distractors. Sets with equal hashes are draws of the same noise.
///
/// The hash covers this version's debug text of these values; runs of different versions are never combined.
pub(crate) fn scene_hash(set: &BenchmarkSet) -> String {
    let truth = &set.truth.ground_truth;
    let rig = set.truth.rig.rig();
    let timed_rig = (!set.truth.rig.is_still()).then_some(&set.truth.rig);
    let facts = TruthFacts { observation_seed: None, ..set.truth.facts.clone() };
    let mut text = String::new();
    // writing to a string does not fail
    let _ = write!(text, "{:?} {rig:?} {timed_rig:?} {:?}", set.blind.frames_per_second, truth.props);
    let (actor, start) = (&truth.actor, &set.blind.start);
    let _ = write!(text, " {:?} {:?} {:?}", actor.links, actor.joints, actor.skin);
    let skinned = start.body.skin.is_some();
    let _ = write!(text, " {} {:?} {skinned} {}", start.body.name, start.body.degrees_of_freedom, start.calibrate);
    let _ = write!(text, " {facts:?} {:?}", set.blind.observation);
    for frame in &truth.frames {
        let _ = write!(text, " {:?} {:?}", frame.pose.world_from_root, frame.joint_positions);
    }
    hex_sha256(text.as_bytes())
}
