//! Checks whether an existing set in the place of a new one was made by the same command.

use std::collections::BTreeSet;
use std::path::Path;

use crate::artefacts::backup_of;
use crate::benchmark_set::{BenchmarkSet, BlindSet, is_set, listed_files};
use crate::prepare::scene_hash::scene_hash;
use crate::rng::ObservationKey;

/// The first difference between the set at `place` and the new one in `made`; `None` if the same command made both, or
/// if there is no set. Keys are only compared if the key is `stated`, because drawn keys always differ.
pub(super) fn set_difference(place: &Path, made: &Path, stated: Option<ObservationKey>) -> Option<String> {
    if !is_set(place) {
        return None;
    }
    let Ok((there, there_hash)) = identity(place) else {
        return Some("it has no truth, or cannot be read".to_owned());
    };
    let (here, here_hash) = identity(made).ok()?;
    // nothing is lost if the bytes are the same
    if there_hash == here_hash {
        return None;
    }
    let (differ, key) = (there.facts.into_iter().zip(here.facts), there.key);
    let found = differ.into_iter().find(|((_, there), (_, here))| there != here);
    let found = found.map(|((what, there), (_, here))| format!("{what}: was {there}, now {here}"));
    let another = |same: bool, words: &str| (!same).then(|| words.to_owned());
    found
        .or_else(|| another(there.files == here.files, "its layers, shards or other files differ"))
        .or_else(|| another(there.scene == here.scene, "its motion, bodies, cameras or observations differ"))
        .or_else(|| another(stated.is_none_or(|stated| stated == key), "its key differs"))
}

/// Whether the set without truth at `place` belongs to the complete set at `whole`.
pub(super) fn is_public_side_of(place: &Path, whole: &Path) -> bool {
    let hash = |path: &Path| BlindSet::read(path).map(|set| set.set_hash).ok();
    hash(place).is_some_and(|public| hash(whole) == Some(public))
}

/// The note about a set that is moved aside.
pub(super) fn kept(place: &Path, difference: &str) -> String {
    let aside = backup_of(place).unwrap_or_else(|_| place.to_owned());
    format!("{}: another set was here ({difference}); it is kept as {}", place.display(), aside.display())
}

/// What identifies the command that made a set.
struct SetIdentity {
    facts: Vec<(&'static str, String)>,
    files: BTreeSet<String>,
    scene: String,
    key: ObservationKey,
}

fn identity(place: &Path) -> Result<(SetIdentity, String), crate::benchmark_set::SetError> {
    let set = BenchmarkSet::read(place)?;
    let facts = vec![
        ("name", format!("`{}`", set.blind.name)),
        ("frames", set.blind.frame_count.to_string()),
        ("frames per second", set.blind.frames_per_second.to_string()),
        ("cameras", set.blind.rig.cameras.len().to_string()),
        ("observation.seed", set.truth.facts.observation_seed.unwrap_or(1).to_string()),
    ];
    let identity = SetIdentity { facts, files: listed_files(place)?, scene: scene_hash(&set), key: set.truth.key };
    Ok((identity, set.blind.full_hash))
}
