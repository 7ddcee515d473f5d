//! Where the secret of a set comes from.

use std::path::Path;

use crate::benchmark_set::KEY_FILE;
use crate::common::ExperimentError;
use crate::rng::ObservationKey;
use crate::scenario::{Mismatch, MismatchBy, Scenario, ScenarioFile};

/// Where the key comes from that everything drawn for a set's observations depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeySource {
    /// The scenario's `observation.key`, else the public one: the same scenario gives everybody the same bytes.
    #[default]
    Scenario,
    /// The scenario's, else a fresh one that nobody knows, where anything is drawn that trackers must not know or the
    /// truth is kept apart.
    Fresh,
    /// This one.
    Given(ObservationKey),
}

impl KeySource {
    /// The key, unless it is to be drawn.
    pub(super) fn stated(self, file: &ScenarioFile) -> Option<ObservationKey> {
        let own = file.scenario.observation.key;
        match self {
            Self::Scenario => Some(own.unwrap_or_default()),
            Self::Fresh => own,
            Self::Given(key) => Some(key),
        }
    }
}

/// Whether a set of this scenario holds something drawn that a tracker must not know.
pub(super) fn has_secrets(file: &ScenarioFile) -> bool {
    let body = &file.scenario.tracker_body;
    let of_subject = body.mismatch_by == MismatchBy::Subject && body.mismatch != Mismatch::None;
    of_subject || file.scenario.observation.is_drawn()
}

/// The same scenario with this key.
pub(super) fn with_key(file: &ScenarioFile, key: ObservationKey) -> ScenarioFile {
    let mut keyed = file.clone();
    keyed.scenario.observation.key = (!key.is_public()).then_some(key);
    keyed
}

/// The scenario without its key, by which drawings are compared.
pub(super) fn without_key(file: &ScenarioFile) -> Scenario {
    with_key(file, ObservationKey::PUBLIC).scenario
}

/// A key that nobody knows.
pub(super) fn fresh_key() -> Result<ObservationKey, ExperimentError> {
    let refused = |e| ExperimentError::Argument {
        argument: "--key",
        detail: format!("the operating system gives no random numbers ({e}); give 32 hexadecimal digits"),
    };
    ObservationKey::fresh().map_err(refused)
}

/// What to tell of a key that was drawn for the complete set in `place`.
pub(super) fn note(place: &Path) -> String {
    let file = place.join(KEY_FILE);
    format!(
        "a fresh key was drawn, so that nobody can undo the errors of this set or confirm its truth by a hash; it is kept \
         in {file} alone: `--key $(cat {file})` renders the same again",
        file = file.display()
    )
}
