//! The scenario as it stands beside what was made from it.

use super::ExperimentError;
use crate::scenario::Scenario;

pub(super) const SCENARIO_FILE: &str = "scenario.toml";

/// The scenario with its overrides, to be run again.
pub(super) fn scenario_text(scenario: &Scenario) -> Result<String, ExperimentError> {
    let malformed = |detail| ExperimentError::Malformed { path: SCENARIO_FILE.into(), detail };
    let tree = serde_json::to_value(scenario).map_err(|e| malformed(e.to_string()))?;
    toml::to_string(&tree).map_err(|e| malformed(e.to_string()))
}
