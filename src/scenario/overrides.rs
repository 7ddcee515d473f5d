//! Overrides `key=value`: short keys (`particles` for `tracker.annealed_particle_filter.particles`) and values.

use std::collections::BTreeSet;

use serde_json::Value;

use super::diagnostic::did_you_mean;
use super::{Scenario, TrackerSettings};

const DEEPEST: usize = 8;

const MOST_NAMED: usize = 8;

/// All dotted keys of a scenario with its trackers, with those of tables and without those of array elements.
pub(super) fn keys_of(scenario: &Scenario) -> Vec<String> {
    let schema = Scenario::json_schema();
    let all = keys_below(&schema, &schema, DEEPEST);
    let of_trackers = |settings: &TrackerSettings, prefix: &str| {
        let own = format!("tracker.{}.", settings.name());
        let own = all.iter().filter_map(|key| key.strip_prefix(&own));
        own.map(|key| format!("{prefix}.{}.{key}", settings.name())).collect::<Vec<_>>()
    };
    let mut keys: Vec<String> =
        all.iter().filter(|key| !key.starts_with("tracker.") && !key.starts_with("methods.")).cloned().collect();
    for (name, settings) in scenario.trackers() {
        let prefix = if scenario.methods.is_empty() { "tracker".to_owned() } else { format!("methods.{name}") };
        keys.extend(of_trackers(&settings, &prefix));
        let own = keys_of_program(&settings);
        keys.extend(own.into_iter().map(|key| format!("{prefix}.program.{key}")));
    }
    keys
}

pub(super) fn keys_in(schema: &Value) -> Vec<String> {
    keys_below(schema, schema, DEEPEST)
}

/// The keys of the settings that a program's command line and table name; none for other trackers.
fn keys_of_program(settings: &TrackerSettings) -> BTreeSet<String> {
    let TrackerSettings::Program(program) = settings else { return BTreeSet::new() };
    let names = program.placeholders().into_iter().chain(program.settings.keys().map(String::as_str));
    names.map(|name| format!("settings.{name}")).collect()
}

pub(super) fn keys_of_tracker(settings: &TrackerSettings) -> Vec<String> {
    let schema = Scenario::json_schema();
    let own = format!("tracker.{}.", settings.name());
    keys_below(&schema, &schema, DEEPEST)
        .into_iter()
        .filter_map(|key| Some(key.strip_prefix(&own)?.to_owned()))
        .chain(keys_of_program(settings))
        .collect()
}

/// The full key for a short one. Full and unknown keys are returned unchanged.
///
/// # Errors
/// A message with the candidates if a short key is ambiguous, or with a suggestion if it is misspelt.
pub(super) fn full_key(key: &str, keys: &[String]) -> Result<String, String> {
    let tables = |full: &String| full.starts_with(key) && full[key.len()..].starts_with('.');
    let first = key.split('.').next().unwrap_or_default();
    let begins_a_key = keys.iter().any(|full| full.split('.').next() == Some(first));
    if keys.iter().any(|full| full == key || tables(full)) || begins_a_key {
        return Ok(key.to_owned());
    }
    let ends = |full: &&String| full.ends_with(key) && full[..full.len() - key.len()].ends_with('.');
    let meant: Vec<&String> = keys.iter().filter(ends).collect();
    // a setting of a program that is not in its command line
    if let (Some(name), true) = (key.strip_prefix("settings."), meant.is_empty()) {
        let tables: Vec<&String> = keys.iter().filter(|full| full.ends_with(".program.settings")).collect();
        if let [table] = tables.as_slice() {
            return Ok(format!("{table}.{name}"));
        }
    }
    match meant.as_slice() {
        [] => match did_you_mean(key, keys.iter().filter_map(|full| full.rsplit('.').next())) {
            Some(guess) => Err(format!("there is no key `{key}`, did you mean `{guess}`?")),
            None => Ok(key.to_owned()),
        },
        [full] => Ok((*full).clone()),
        several => {
            let named: Vec<&str> = several.iter().take(MOST_NAMED).map(|full| full.as_str()).collect();
            let more = if several.len() > MOST_NAMED { " and others" } else { "" };
            Err(format!("`{key}` is ambiguous: {}{more}; write the full key", named.join(" or ")))
        }
    }
}

/// The other keys with the same ending as a full one, as suggestions.
pub(super) fn keys_with_same_ending<'k>(key: &str, keys: &'k [String]) -> Vec<&'k str> {
    let ends = |full: &&str| full.strip_suffix(key).is_some_and(|rest| rest.ends_with('.'));
    keys.iter().map(String::as_str).filter(ends).collect()
}

/// Dotted keys of the objects described by a part of a schema.
fn keys_below(schema: &Value, part: &Value, depth: usize) -> Vec<String> {
    if depth == 0 {
        return Vec::new();
    }
    if let Some(name) = part["$ref"].as_str().and_then(|path| path.strip_prefix("#/$defs/")) {
        return keys_below(schema, &schema["$defs"][name], depth);
    }
    let mut keys = Vec::new();
    for (key, inner) in part["properties"].as_object().into_iter().flatten() {
        keys.push(key.clone());
        keys.extend(keys_below(schema, inner, depth - 1).into_iter().map(|rest| format!("{key}.{rest}")));
    }
    for choice in ["anyOf", "oneOf", "allOf"].into_iter().flat_map(|kind| part[kind].as_array().into_iter().flatten()) {
        keys.extend(keys_below(schema, choice, depth - 1));
    }
    keys
}

/// A value as TOML on one line.
pub fn as_toml(value: &Value) -> String {
    match value {
        Value::Object(table) => {
            let entries: Vec<String> =
                table.iter().map(|(key, value)| format!("{} = {}", quoted_key(key), as_toml(value))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        Value::Array(values) => format!("[{}]", values.iter().map(as_toml).collect::<Vec<_>>().join(", ")),
        // strings and numbers have the same syntax in JSON and TOML
        other => other.to_string(),
    }
}

fn quoted_key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'));
    if bare { key.to_owned() } else { Value::String(key.to_owned()).to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::ScenarioFile;

    fn meant(key: &str) -> Result<String, String> {
        full_key(key, &keys_of(&ScenarioFile::built_in(&[]).unwrap().scenario))
    }

    #[test]
    fn a_short_key_means_the_only_full_key_with_its_ending() {
        for (short, full) in [
            ("particles", "tracker.annealed_particle_filter.particles"),
            ("annealed_particle_filter.particles", "tracker.annealed_particle_filter.particles"),
            ("radius_m", "rig.ring.radius_m"),
            ("ring.count", "rig.ring.count"),
            ("loop_to_s", "motion.loop_to_s"),
            ("mismatch", "tracker_body.mismatch"),
            ("impulse_ns", "actor.push.impulse_ns"),
            ("reject_beyond_m", "tracker.annealed_particle_filter.plausibility.reject_beyond_m"),
        ] {
            assert_eq!(meant(short).as_deref(), Ok(full));
        }
    }

    #[test]
    fn full_keys_have_priority_and_unknown_keys_are_not_changed() {
        for key in [
            "seed",
            "truth_images",
            "tracker.frozen",
            "rig.ring.count",
            "tracker.annealed_particle_filter.partciles",
            "q.unknown",
        ] {
            assert_eq!(meant(key).as_deref(), Ok(key));
        }
    }

    #[test]
    fn methods_have_their_own_keys() {
        let text = "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"embedded:walk\"\n\
                    [methods.a.annealed_particle_filter]\n[methods.b.frozen]\n";
        let file = ScenarioFile::parse(text, "a.toml", std::path::PathBuf::new(), &[]).unwrap();
        let meant = full_key("particles", &keys_of(&file.scenario));
        assert_eq!(meant.as_deref(), Ok("methods.a.annealed_particle_filter.particles"));
    }

    #[test]
    fn values_are_written_as_valid_toml() {
        let tree: Value = toml::from_str("a = [1, 2.5, \"x\\\"y\", true, { b = 1, \"c d\" = [] }]").unwrap();
        let again: Value = toml::from_str(&format!("a = {}", as_toml(&tree["a"]))).unwrap();
        assert_eq!(again, tree);
    }
}
