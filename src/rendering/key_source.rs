//! The source of a set's secret key.

use std::path::Path;

use crate::common::ExperimentError;
use crate::scenario::{Mismatch, MismatchBy, Scenario, ScenarioFile};
use skiagraph_core::rng::ObservationKey;
use skiagraph_set::KEY_FILE;
use skiagraph_truth::observing::ObservationSettings;

/// The source of the key of the random numbers of a set's observations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeySource {
    /// The scenario's `observation.key`, else the public key: the same scenario always gives the same bytes.
    #[default]
    Scenario,
    /// The scenario's key, else a fresh one if anything is drawn that trackers must not know, or the truth is kept
    /// apart.
    Fresh,
    Given(ObservationKey),
}

impl KeySource {
    /// The key; `None` if it must be drawn.
    pub(crate) fn stated(self, observation: &ObservationSettings) -> Option<ObservationKey> {
        let own = observation.key;
        match self {
            Self::Scenario => Some(own.unwrap_or_default()),
            Self::Fresh => own,
            Self::Given(key) => Some(key),
        }
    }
}

/// Whether anything is drawn for this scenario that a tracker must not know.
pub(crate) fn has_secrets(scenario: &Scenario) -> bool {
    let body = &scenario.tracker_body;
    let of_subject = body.mismatch_by == MismatchBy::Subject && body.mismatch != Mismatch::None;
    of_subject || scenario.observation.is_drawn()
}

pub(super) fn with_key(mut file: ScenarioFile, key: ObservationKey) -> ScenarioFile {
    file.scenario.observation.key = (!key.is_public()).then_some(key);
    file
}

/// The scenario without its key, for comparing settings.
pub(super) fn without_key(scenario: &Scenario) -> Scenario {
    let observation = ObservationSettings { key: None, ..scenario.observation.clone() };
    Scenario { observation, ..scenario.clone() }
}

pub(crate) fn fresh_key() -> Result<ObservationKey, ExperimentError> {
    let refused = |e| ExperimentError::Argument {
        argument: "--key",
        detail: format!("the operating system provides no random numbers ({e}); give 32 hexadecimal digits"),
    };
    ObservationKey::fresh().map_err(refused)
}

/// The note about a key that was drawn for the complete set in `place`.
pub(super) fn note(place: &Path) -> String {
    let file = place.join(KEY_FILE);
    format!(
        "a fresh key was drawn, so that the errors of this set cannot be undone and its truth cannot be confirmed by a \
         hash; it is only stored in {file}: `--key $(cat {file})` renders the same set again",
        file = file.display()
    )
}
