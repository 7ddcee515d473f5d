//! Checks whether an existing set in the place of a new one was made by the same command.

use std::path::Path;

use crate::artefacts::{MadeBy, backup_of};
use skiagraph_core::input::{self, limits};
use skiagraph_core::rng::ObservationKey;
use skiagraph_set::{BlindSet, KEY_FILE, is_set};

/// How the set at `place` differs from that of a command; `None` if the same command made it, or if there is no set.
/// Keys are only compared if the key is `stated`, because drawn keys always differ.
pub(super) fn set_difference(place: &Path, made_by: &MadeBy, stated: Option<ObservationKey>) -> Option<String> {
    let truth = place.join("truth");
    if !is_set(place) {
        return None;
    }
    let Some(there) = MadeBy::at(&truth) else {
        let unknown = || "it has no truth".to_owned();
        return made_by.difference_at(&truth).or_else(|| Some(unknown()));
    };
    let key = || input::read_to_string(&place.join(KEY_FILE), limits::SETTINGS).ok()?.trim().parse().ok();
    let is_other = |stated: ObservationKey| stated != key().unwrap_or_default();
    let of_key = || stated.is_some_and(is_other).then(|| "its key differs".to_owned());
    there.difference_of_other_version(made_by).or_else(of_key)
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
