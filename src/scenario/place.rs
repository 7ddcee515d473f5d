//! Presets of a place: the errors of synchronisation, calibration, silhouettes and keypoints to expect there.

use serde_json::{Map, Value};

use skiagraph_truth::observing::PlacePreset;

/// The settings of `[observation]` in a place, as TOML.
fn text_of(place: PlacePreset) -> &'static str {
    match place {
        PlacePreset::Studio => include_str!("places/studio.toml"),
        PlacePreset::Gym => include_str!("places/gym.toml"),
        PlacePreset::Outdoors => include_str!("places/outdoors.toml"),
    }
}

/// Replaces `observation.preset` in a scenario's tree by the settings of the place that it names. Keys that are given
/// win. The preset is removed, because a key of 0 is not written with a scenario and must not be set again when that is
/// read. A word that names no place is left for the error about it.
pub(super) fn resolve_preset(tree: &mut Value) {
    let Some(Value::Object(observation)) = tree.get_mut("observation") else { return };
    let named = observation.get("preset").cloned().and_then(|name| serde_json::from_value(name).ok());
    if let Some(Value::Object(preset)) = named.and_then(|place| toml::from_str(text_of(place)).ok()) {
        observation.remove("preset");
        add_missing(observation, preset);
    }
}

fn add_missing(given: &mut Map<String, Value>, more: Map<String, Value>) {
    for (key, value) in more {
        match (given.get_mut(&key), value) {
            (Some(Value::Object(own)), Value::Object(more)) => add_missing(own, more),
            (Some(_), _) => {}
            (None, value) => drop(given.insert(key, value)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::scenario::{DEFAULT_SCENARIO, ScenarioFile, ScenarioTemplate};

    fn with(overrides: &[&str]) -> ScenarioFile {
        let overrides: Vec<String> = overrides.iter().map(|one| (*one).to_owned()).collect();
        ScenarioFile::parse(DEFAULT_SCENARIO, "walk.toml", PathBuf::new(), &overrides).unwrap()
    }

    #[test]
    fn every_place_sets_all_errors_together_from_studio_to_outdoors() {
        let places = ["studio", "gym", "outdoors"].map(|name| {
            let observation = with(&[&format!("observation.preset={name}")]).scenario.observation;
            let (corruption, keypoints) = (observation.corruption, observation.keypoints.unwrap());
            assert!(keypoints.bias_mm > 0.0 && observation.is_drawn());
            [
                corruption.desynchronisation_ms,
                corruption.calibration_deg,
                corruption.boundary_px,
                keypoints.slow_percent,
                keypoints.white_percent,
                keypoints.inversion,
            ]
        });
        for pair in places.windows(2) {
            assert!(pair[0].iter().zip(pair[1]).all(|(milder, worse)| *milder < worse && *milder > 0.0), "{places:?}");
        }
    }

    #[test]
    fn given_keys_win_over_the_preset_in_any_order_and_a_written_scenario_is_read_back() {
        let plain = with(&["observation.preset=gym"]).scenario.observation;
        for overrides in [
            [
                "observation.preset=gym",
                "observation.keypoints.slow_percent=0.1",
                "observation.corruption.boundary_px=7",
            ],
            [
                "observation.keypoints={ layout = \"coco17\", slow_percent = 0.1 }",
                "observation.preset=gym",
                "boundary_px=7",
            ],
        ] {
            let found = with(&overrides).scenario.observation;
            let keypoints = found.keypoints.unwrap();
            assert_eq!((keypoints.slow_percent, found.corruption.boundary_px), (0.1, 7.0));
            assert_eq!(keypoints.white_percent, plain.keypoints.unwrap().white_percent);
            assert_eq!(found.corruption.desynchronisation_ms, plain.corruption.desynchronisation_ms);
        }
        let scenario = with(&["observation.preset=gym", "observation.keypoints.gross=0"]).scenario;
        let mut tree = serde_json::to_value(&scenario).unwrap();
        resolve_preset(&mut tree);
        assert_eq!(scenario.observation.keypoints.unwrap().gross, 0.0);
        assert_eq!(serde_json::from_value::<crate::scenario::Scenario>(tree).unwrap(), scenario);
        let template = ScenarioTemplate::new(with(&[])).unwrap();
        let of_template = template.with(&["observation.preset=gym".to_owned()]).unwrap();
        assert_eq!(of_template.scenario.observation, plain);
    }
}
