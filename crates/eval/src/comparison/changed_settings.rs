//! Differences between the settings of two trackers.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

/// Greatest number of keys in a message.
const MOST: usize = 12;
/// Greatest length of a value in a message, characters.
const SHOWN: usize = 60;

/// Lists the keys of the settings that differ: `particles 12 → 2`.
pub fn changed_settings(base: Option<&Value>, other: Option<&Value>) -> String {
    let leaves = |settings: Option<&Value>| {
        let mut leaves = BTreeMap::new();
        collect_leaves("", settings, &mut leaves);
        leaves
    };
    let (old, new) = (leaves(base), leaves(other));
    let keys: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let shown = |value: Option<&String>| value.map_or_else(|| "not set".to_owned(), |value| shortened(value));
    let differ: Vec<&String> = keys.into_iter().filter(|key| old.get(*key) != new.get(*key)).collect();
    let describe = |key: &&String| format!("{key} {} → {}", shown(old.get(*key)), shown(new.get(*key)));
    let mut changes: Vec<String> = differ.iter().take(MOST).map(describe).collect();
    changes.extend((differ.len() > MOST).then(|| format!("and {} more", differ.len() - MOST)));
    changes.join(", ")
}

fn shortened(value: &str) -> String {
    match value.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &value[..end]),
        None => value.to_owned(),
    }
}

fn collect_leaves(path: &str, value: Option<&Value>, leaves: &mut BTreeMap<String, String>) {
    match value {
        Some(Value::Object(entries)) => entries.iter().for_each(|(key, value)| {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            collect_leaves(&path, Some(value), leaves);
        }),
        Some(value) => drop(leaves.insert(path.to_owned(), value.to_string())),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn only_differences_are_named_within_the_length_limits() {
        let [one, other] = [12, 2].map(|n| json!({"a": {"particles": n, "layers": 4}, "b": "x"}));
        assert_eq!(changed_settings(Some(&one), Some(&other)), "a.particles 12 → 2");
        assert_eq!(changed_settings(Some(&one), Some(&one)), "");
        let long: Value = (0..40).map(|i| (format!("k{i:02}"), json!("é".repeat(900)))).collect();
        let words = changed_settings(Some(&long), None);
        assert!(words.contains("k11") && words.ends_with("and 28 more") && words.chars().count() < 1200, "{words}");
    }
}
