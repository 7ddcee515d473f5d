//! The trackers of a scenario: one tracker, or several methods.

use std::collections::BTreeMap;

use super::{Scenario, TrackerSettings};

impl Scenario {
    /// What its set is drawn by: all but words, trackers and their seeds.
    pub(crate) fn of_set(&self) -> Self {
        Self { description: String::new(), seed: 0, seeds: 1, tracker: None, methods: BTreeMap::new(), ..self.clone() }
    }

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

#[cfg(test)]
mod tests {
    use crate::scenario::ScenarioFile;

    #[test]
    fn a_set_is_drawn_by_its_scene_and_its_layers_whatever_tracks_it() {
        let of = |change: &str| ScenarioFile::built_in(&[change.to_owned()]).unwrap().scenario.of_set();
        let base = ScenarioFile::built_in(&[]).unwrap().scenario.of_set();
        for same in ["seed=3", "seeds=2", "particles=7", "tracker.frozen={}"] {
            assert_eq!(of(same), base, "{same}");
        }
        for other in ["rig.ring.count=3", "layers=[\"depth\"]", "tracker_body.seed=2", "name=other"] {
            assert_ne!(of(other), base, "{other}");
        }
    }
}
