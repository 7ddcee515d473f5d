//! Who tracks: one tracker, or several methods side by side.

use super::{Scenario, TrackerSettings};

impl Scenario {
    /// The one tracker of a scenario without methods.
    pub fn tracker(&self) -> TrackerSettings {
        self.tracker.clone().unwrap_or_default()
    }

    /// Everybody who tracks, by name where there are methods.
    pub fn trackers(&self) -> Vec<(&str, TrackerSettings)> {
        match self.methods.is_empty() {
            true => vec![("tracker", self.tracker())],
            false => self.methods.iter().map(|(name, settings)| (name.as_str(), settings.clone())).collect(),
        }
    }
}
