//! `skiagraph gate`: compares runs with a baseline by the rules of a `gate.toml`.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::Baseline;
use super::seed_advice::lacking_note;
use super::seed_plan::planned_note;
use crate::common::ExperimentError;
use crate::runs::read_runs;
use crate::runs::reading::hints_of_runs;
use crate::scenario::{did_you_mean, json_tree};
use skiagraph_core::input::{self, excerpt, foreign, is_own_output, limits, unquoted};
use skiagraph_eval::{
    FEWEST_SEEDS, GateOutcome, GateRefusal, GateRules, IntervalUnit, METRICS, find_metric, gate, gone_metric,
};

/// The default file of rules, in the working directory.
pub const GATE_FILE: &str = "gate.toml";

const SCHEMA: &str = "skiagraph.gate/1";

impl From<GateRefusal> for ExperimentError {
    fn from(refusal: GateRefusal) -> Self {
        Self::Gate(Box::new(refusal))
    }
}

/// Compares the runs at these paths with a baseline.
pub fn gate_run(runs: &[PathBuf], baseline: &Baseline, rules: &GateRules) -> Result<GateOutcome, ExperimentError> {
    let mut outcome = gate(&baseline.runs, &read_runs(runs)?, rules)?;
    outcome.misread = runs.iter().flat_map(|run| hints_of_runs(run)).collect();
    outcome.misread.extend(baseline.misread.iter().map(|hint| format!("baseline {}: {hint}", baseline.name)));
    let lacking: Vec<_> = outcome.checks.iter().filter_map(|check| check.more_seeds).collect();
    outcome.notes.extend(lacking_note(outcome.unit, lacking));
    if outcome.unit == IntervalUnit::Seeds {
        let planned = planned_note(baseline, rules, &outcome);
        outcome.notes.extend(planned);
    }
    if is_newer(&baseline.version) {
        let own = env!("CARGO_PKG_VERSION");
        outcome.notes.push(format!("the baseline was saved by version {}, newer than this {own}", baseline.version));
    }
    Ok(outcome)
}

fn is_newer(version: &str) -> bool {
    let parts = |version: &str| version.split('.').map(|part| part.parse().unwrap_or(0)).collect::<Vec<u64>>();
    parts(version) > parts(env!("CARGO_PKG_VERSION"))
}

/// Reads a `gate.toml`.
pub fn read_rules(path: &Path) -> Result<GateRules, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let text = input::read_to_string(path, limits::SETTINGS)
        .map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })?;
    let table: toml::Table = toml::from_str(&text).map_err(|e| malformed(toml_error(&text, &e)))?;
    let mut tree = serde_json::to_value(table).map_err(|e| malformed(unquoted(e)))?;
    let schema = tree.as_object_mut().and_then(|table| table.shift_remove("schema"));
    if schema.as_ref().and_then(Value::as_str) != Some(SCHEMA) {
        return Err(malformed(format!("expected schema = \"{SCHEMA}\"")));
    }
    let rules: GateRules = json_tree::value(tree).map_err(|e| malformed(foreign(e)))?;
    if rules.seeds < FEWEST_SEEDS {
        return Err(malformed(format!("seeds: expected {FEWEST_SEEDS} or more, found {}", rules.seeds)));
    }
    let exact = rules.exact.iter().map(|name| ("exact", name));
    let budgets = rules.budgets.iter().map(|budget| ("budget", &budget.metric));
    exact
        .chain(budgets)
        .try_for_each(|(key, name)| check_metric(name).map_err(|detail| malformed(format!("{key}: {detail}"))))?;
    Ok(rules)
}

/// The error of a text that is not TOML. The text is quoted only if it is output of this program.
fn toml_error(text: &str, error: &toml::de::Error) -> String {
    if is_own_output(text.as_bytes()) {
        return foreign(error);
    }
    let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
    format!("line {}: not TOML: {}", before.matches('\n').count() + 1, unquoted(error.message()))
}

/// Refuses the name of an unknown metric.
pub fn check_metric(name: &str) -> Result<(), String> {
    match (find_metric(name), gone_metric(name)) {
        (Some(_), _) => Ok(()),
        (None, Some(instead)) => Err(format!("`{name}`: {instead}")),
        (None, None) => Err(format!("there is no metric `{}`{}", excerpt(name), metric_named_like(name))),
    }
}

/// The most similar metric, as the end of a message; empty if none is similar.
fn metric_named_like(name: &str) -> String {
    let guess = did_you_mean(name, METRICS.iter().map(|metric| metric.name));
    guess.map(|guess| format!("; did you mean `{guess}`?")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(text: &str) -> Result<GateRules, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(GATE_FILE);
        std::fs::write(&path, text).unwrap();
        read_rules(&path).map_err(|e| e.to_string())
    }

    #[test]
    fn rules_have_budgets_per_metric_and_clip_and_defaults_for_the_rest() {
        let text = "schema = \"skiagraph.gate/1\"\nseeds = 10\n[[budget]]\nmetric = \"humaneva_mm\"\nmargin = \"2mm\"\n\
                    [[budget]]\nmetric = \"pck150\"\nmargin = 0.02\nclip = \"walk\"\n";
        assert_eq!(rules(&text.replace("seeds = 10", "unit = \"draws\"")).unwrap().unit, Some(IntervalUnit::Draws));
        let found = rules(text).unwrap();
        assert_eq!(found.unit, None);
        assert_eq!((found.seeds, found.budgets.len(), found.exact_truth, found.lost_tracks), (10, 2, true, true));
        assert_eq!(found.budgets[1].clip.as_deref(), Some("walk"));
    }

    #[test]
    fn errors_name_file_and_key() {
        let head = "schema = \"skiagraph.gate/1\"\n";
        for (text, part) in [
            ("seeds = 5", "expected schema"),
            (&format!("{head}sedes = 5"), "sedes"),
            (&format!("{head}[[budget]]\nmetric = \"humaneva_mm\"\nmargin = \"2 parsecs\""), "2 parsecs"),
            (&format!("{head}seeds = -1"), "seeds"),
            (&format!("{head}seeds = 3"), "seeds: expected 5 or more, found 3"),
            (&format!("{head}exact = [\"lag_sm\"]"), "exact: there is no metric `lag_sm`; did you mean `lag_ms`?"),
            (&format!("{head}exact = [\"zmp_outside\"]"), "exact: `zmp_outside`: metrics of balance are gone"),
            (&format!("{head}coverage = nan"), "expected a number of 0 or more with its unit"),
            (&format!("{head}seeds ="), "gate.toml"),
            (&format!("{head}unit = \"frames\""), "unit"),
        ] {
            let error = rules(text).unwrap_err();
            assert!(error.contains(part) && error.contains("gate.toml"), "{part}: {error}");
        }
    }

    #[test]
    fn versions_are_compared_by_their_numbers() {
        assert!(is_newer("99.0.0") && !is_newer("0.0.9") && !is_newer(env!("CARGO_PKG_VERSION")));
    }
}
