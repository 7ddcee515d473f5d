//! Whether a set that stands in the place of a new one was made by the same command, and what sets share.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use crate::artefacts::backup_of;
use crate::benchmark_set::{BenchmarkSet, BlindSet, TruthFacts, is_set, listed_files};
use crate::input::hex_sha256;
use crate::rng::ObservationKey;

/// The first setting in which the set that stands at `place` differs from the one in `made`; `None` where the same
/// command made both, or where no set stands. The key counts where it is `stated`: one that is drawn is another every
/// time.
pub(super) fn set_difference(place: &Path, made: &Path, stated: Option<ObservationKey>) -> Option<String> {
    if !is_set(place) {
        return None;
    }
    let Ok((there, there_hash)) = told(place) else { return Some("it has no truth, or cannot be read".to_owned()) };
    let (here, here_hash) = told(made).ok()?;
    // the same bytes: nothing is lost, whatever made them
    if there_hash == here_hash {
        return None;
    }
    let (differ, key) = (there.facts.into_iter().zip(here.facts), there.key);
    let found = differ.into_iter().find(|((_, there), (_, here))| there != here);
    let found = found.map(|((what, there), (_, here))| format!("{what}: there {there}, here {here}"));
    let another = |same: bool, words: &str| (!same).then(|| words.to_owned());
    found
        .or_else(|| another(there.files == here.files, "its layers, shards or other files are not the same"))
        .or_else(|| another(there.scene == here.scene, "its motion, bodies, cameras or observations are not the same"))
        .or_else(|| another(stated.is_none_or(|stated| stated == key), "its key is another"))
}

/// Whether the set without truth at `place` was taken from the complete one at `whole`.
pub(super) fn is_public_side_of(place: &Path, whole: &Path) -> bool {
    let hash = |path: &Path| BlindSet::read(path).map(|set| set.set_hash).ok();
    hash(place).is_some_and(|public| hash(whole) == Some(public))
}

/// What to tell of a set that is kept.
pub(super) fn kept(place: &Path, difference: &str) -> String {
    let aside = backup_of(place).unwrap_or_else(|_| place.to_owned());
    format!("{}: another set stood here ({difference}); it is kept as {}", place.display(), aside.display())
}

/// What a set tells of what made it.
struct SetIdentity {
    facts: Vec<(&'static str, String)>,
    files: BTreeSet<String>,
    scene: String,
    key: ObservationKey,
}

fn told(place: &Path) -> Result<(SetIdentity, String), crate::benchmark_set::SetError> {
    let set = BenchmarkSet::read(place)?;
    let facts = vec![
        ("name", format!("`{}`", set.blind.name)),
        ("frames", set.blind.frame_count.to_string()),
        ("frames a second", set.blind.frames_per_second.to_string()),
        ("cameras", set.blind.rig.cameras.len().to_string()),
        ("observation.seed", set.truth.facts.observation_seed.unwrap_or(1).to_string()),
    ];
    let identity = SetIdentity { facts, files: listed_files(place)?, scene: scene_hash(&set), key: set.truth.key };
    Ok((identity, set.blind.full_hash))
}

/// Hash of a set's scene: the true motion, cameras and props, the actor's body, how the tracker's differs, and how
/// observations are made. Left out is what the seed of the observation draws: the observations, the errors of the
/// cameras, of the tracker's body and of the start, and people besides the actor. Two sets with one such hash are draws
/// of the same noise.
///
/// The hash is of text that this version writes for each of these; runs of other versions are never put together.
pub(super) fn scene_hash(set: &BenchmarkSet) -> String {
    let truth = &set.truth.ground_truth;
    let rig = set.truth.cameras.as_ref().unwrap_or(&set.blind.rig);
    let facts = TruthFacts { observation_seed: None, ..set.truth.facts.clone() };
    let mut text = String::new();
    // writing into a string does not fail
    let _ = write!(text, "{:?} {rig:?} {:?} {:?}", set.blind.frames_per_second, set.truth.filming, truth.props);
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
