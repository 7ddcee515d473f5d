//! The trackers of a scenario: one tracker, or several methods.

use super::{Scenario, TrackerSettings};

impl Scenario {
    /// The one tracker of a scenario without methods.
    pub fn tracker(&self) -> TrackerSettings {
        self.tracker.clone().unwrap_or_default()
    }

    /// All trackers, with the names of methods if there are any.
    pub fn trackers(&self) -> Vec<(&str, TrackerSettings)> {
        match self.methods.is_empty() {
            true => vec![("tracker", self.tracker())],
            false => self.methods.iter().map(|(name, settings)| (name.as_str(), settings.clone())).collect(),
        }
    }
}
