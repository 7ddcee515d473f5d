//! What is said of a negative number where none may be: the range of its key.

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::complaint::Diagnostic;
use super::range_checks::RangeCheck;
use super::tree::{at, settings_or_mistake};

/// A complaint about a negative whole number, with the range of its key, which is found with other numbers in its
/// place; any other complaint as it is. `tree` is what was read, `check` finds the first value out of its range.
pub(super) fn with_range<T: DeserializeOwned>(
    complaint: Diagnostic,
    tree: &Value,
    check: impl Fn(&T) -> RangeCheck,
) -> Diagnostic {
    let Some(found) = complaint.message.strip_prefix("invalid value: integer `-") else { return complaint };
    let Some((found, _)) = found.split_once('`') else { return complaint };
    let expected_of = |number: u32| {
        let mut other = tree.clone();
        *at(&mut other, &complaint.key)? = number.into();
        let settings: T = settings_or_mistake(other).ok()?;
        let problem = check(&settings).err().filter(|problem| problem.key == complaint.key)?;
        let (expected, _) = problem.message.strip_prefix("expected ")?.rsplit_once(", found ")?;
        Some(expected.to_owned())
    };
    let expected = [u32::MAX, 0].into_iter().find_map(expected_of);
    let expected = expected.unwrap_or_else(|| "a whole number from 0".to_owned());
    Diagnostic { message: format!("expected {expected}, found -{found}"), ..complaint }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::scenario::{DEFAULT_SCENARIO, ScenarioFile, TrackerSettings};

    #[test]
    fn a_negative_number_is_told_with_the_range_of_its_key() {
        for (change, key, expected) in [
            ("particles=-5", "tracker.annealed_particle_filter.particles", "1 to 1000000"),
            ("tracker.annealed_particle_filter.layers=-1", "tracker.annealed_particle_filter.layers", "1 to 1000"),
            ("seeds=-1", "seeds", "1 to 100000"),
            ("seed=-3", "seed", "a whole number from 0"),
            ("rig.ring.count=-2", "rig.ring.count", "1 to 64"),
        ] {
            let error = ScenarioFile::built_in(&[change.to_owned()]).unwrap_err().to_string();
            // a short key is told in full
            let (_, value) = change.split_once('=').unwrap();
            // and one that may be meant for several others is told these
            let others = "motion.variation.seed or actor.shape.seed or tracker_body.seed or observation.seed";
            let hint = if key == "seed" { format!(" (or did you mean {others}?)") } else { String::new() };
            assert_eq!(error, format!("override {key}={value}: {key}: expected {expected}, found {value}{hint}"));
        }
        let text = DEFAULT_SCENARIO.replace("seeds = 5", "seeds = -5");
        let error = ScenarioFile::parse(&text, "a.toml", PathBuf::new(), &[]).unwrap_err().to_string();
        let line = 1 + DEFAULT_SCENARIO.lines().position(|line| line.starts_with("seeds = 5")).unwrap();
        // the line itself follows
        let expected = format!("a.toml:{line}: seeds: expected 1 to 100000, found -5");
        assert_eq!(error.lines().next(), Some(expected.as_str()));
        let error = TrackerSettings::default().overridden(&["particles=-5".to_owned()]).unwrap_err().to_string();
        assert_eq!(error, "override particles=-5: annealed_particle_filter.particles: expected 1 to 1000000, found -5");
    }
}
