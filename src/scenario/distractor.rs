//! `[[distractor]]`: other people in the scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{MotionSettings, SolidsSource};

/// Somebody besides the actor: cameras see them, silhouettes and images show them too, and they hide the actor. Nothing
/// of them is estimated, and contacts with them are not considered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistractorSettings {
    /// Name, for people. Default: `distractor00` and so on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// `actor`, `tracker25`, `tracker40`, or the path of a URDF file relative to the scenario. Default: `actor`.
    #[serde(default = "actor")]
    pub robot: String,
    /// What is drawn of it, as `actor.solids`. Default: `"urdf"`.
    #[serde(default, skip_serializing_if = "SolidsSource::is_urdf")]
    pub solids: SolidsSource,
    /// Their surface, as of the actor. Default: the robot's solids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin: Option<String>,
    /// What they do, with the keys of `[motion]`, at the rate of `[motion]`. After it they stand still.
    pub motion: MotionSettings,
}

fn actor() -> String {
    "actor".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_enough_and_unknown_keys_are_refused() {
        let text = "motion = { clip = \"embedded:run\", start_m = [1.0, 2.0] }";
        let settings: DistractorSettings = toml::from_str(text).unwrap();
        assert_eq!((settings.robot.as_str(), settings.motion.start_m), ("actor", Some([1.0, 2.0])));
        assert!(toml::from_str::<DistractorSettings>(&format!("{text}\nplace = 3")).is_err());
    }
}
