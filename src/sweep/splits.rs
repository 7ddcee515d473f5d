//! Splits of a sweep's sets, by the person or the recording: none is in two of them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::file::{SweepAxis, SweepFile};
use super::plan_file::table_text;
use crate::scenario::{Diagnostic, MotionSettings, Scenario};
use skiagraph_core::input::excerpt;

/// Divides the sets of a sweep, so that trackers are tested on people that they have not learned from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Splits {
    /// The axis that decides: all sets of one of its values are in one split. Two values with the same recording, or
    /// with recordings of the same subject of CMU (`49_01.amc` and `49_02.amc`), must be in one split.
    pub by: String,
    /// The values of each split: `{ test = ["jump"] }`. Names have letters, digits, `-` and `_`.
    pub parts: BTreeMap<String, Vec<Value>>,
    /// The split of all other values. Default: none; then every value must be in `parts`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest: Option<String>,
}

impl Splits {
    /// The split of a setting.
    pub(super) fn of(&self, axes: &Map<String, Value>) -> &str {
        let value = axes.get(&self.by);
        let named = self.parts.iter().find(|(_, values)| values.iter().any(|known| Some(known) == value));
        named.map_or(self.rest.as_deref().unwrap_or_default(), |(name, _)| name)
    }

    /// The names of all splits.
    pub(super) fn names(&self) -> BTreeSet<&str> {
        self.parts.keys().chain(&self.rest).map(String::as_str).collect()
    }

    /// Checks the names and that every value of the axis is in exactly one split, before any setting is read.
    ///
    /// # Errors
    /// [`Diagnostic`] that names the key.
    pub(super) fn check(&self, file: &SweepFile) -> Result<(), Diagnostic> {
        let complain = |key: &str, message: String| Err(file.complaint(&format!("splits.{key}"), message));
        let axes = file.axes()?;
        let values: Vec<Value> = match axes.get(&self.by) {
            Some(SweepAxis::Values(values)) => values.iter().map(|value| value.label.clone()).collect(),
            Some(SweepAxis::Range { .. }) => {
                return complain("by", "expected an axis with a list of values, found a range".to_owned());
            }
            None => {
                let known: Vec<&str> = axes.keys().map(String::as_str).collect();
                let (found, known) = (excerpt(&self.by), known.join(", "));
                return complain("by", format!("expected an axis of the sweep ({known}), found `{found}`"));
            }
        };
        for name in self.names() {
            let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
            if !is_name || name == "sets" {
                let expected = "expected a name of letters, digits, - and _, and not `sets`";
                return complain("parts", format!("{expected}, found `{}`", excerpt(name)));
            }
        }
        if self.names().len() < 2 {
            return complain("parts", "expected at least two splits, found one; add `rest`".to_owned());
        }
        let mut known: BTreeMap<String, &str> = BTreeMap::new();
        for (name, listed) in &self.parts {
            for value in listed {
                let text = table_text(value);
                if !values.contains(value) {
                    let all: Vec<String> = values.iter().map(table_text).collect();
                    let (found, all) = (excerpt(&text), all.join(", "));
                    return complain(
                        "parts",
                        format!("`{name}` has `{found}`, which is no value of {}: {all}", self.by),
                    );
                }
                if let Some(other) = known.insert(text.clone(), name) {
                    return complain("parts", format!("`{}` is in `{other}` and again in `{name}`", excerpt(&text)));
                }
            }
        }
        let others: Vec<String> = values.iter().map(table_text).filter(|value| !known.contains_key(value)).collect();
        let empty = self.parts.iter().find(|(_, values)| values.is_empty()).map(|(name, _)| name);
        match (&self.rest, empty) {
            (_, Some(empty)) => complain("parts", format!("expected at least one value of {} in `{empty}`", self.by)),
            (Some(rest), None) if others.is_empty() => {
                complain("rest", format!("no value of {} is left for `{rest}`: expected at least one", self.by))
            }
            (None, None) if !others.is_empty() => {
                complain("parts", format!("{} of {} in no split; add `rest`", others.join(", "), self.by))
            }
            _ => Ok(()),
        }
    }

    /// Checks that no person is in two splits; `settings` are the axes of each setting and whom it shows.
    ///
    /// # Errors
    /// [`Diagnostic`] that names the recording and both splits.
    pub(super) fn check_people<'a>(
        &self,
        file: &SweepFile,
        settings: impl Iterator<Item = (&'a Map<String, Value>, &'a [String])>,
    ) -> Result<(), Diagnostic> {
        let mut known: BTreeMap<&str, &str> = BTreeMap::new();
        for (axes, people) in settings {
            let split = self.of(axes);
            for person in people {
                let other = *known.entry(person).or_insert(split);
                if other != split {
                    let message = format!(
                        "{} is in `{other}` and in `{split}`: trackers would be tested on motions that they have learned \
                         from; put all values with it in one split",
                        excerpt(person)
                    );
                    return Err(file.complaint("splits", message));
                }
            }
        }
        Ok(())
    }
}

/// The recordings that the actor of a scene performs, and the subjects that their names state.
pub(super) fn people(scenario: &Scenario) -> Vec<String> {
    let takes = scenario.motion.takes("motion").into_iter();
    takes.flat_map(|(_, take)| [Some(format!("the recording {}", take.clip)), subject(&take)]).flatten().collect()
}

/// The subject of an Acclaim clip, whose skeleton or name states it.
fn subject(take: &MotionSettings) -> Option<String> {
    let clip = Path::new(&take.clip);
    clip.extension().filter(|extension| extension.eq_ignore_ascii_case("amc"))?;
    let named = || Some(clip.file_stem()?.to_str()?.split_once('_')?.0);
    let of_skeleton = take.skeleton.as_deref().and_then(|name| Path::new(name).file_stem()?.to_str());
    Some(format!("subject {}", of_skeleton.or_else(named)?))
}

#[cfg(test)]
mod tests {
    use super::super::plan::Draft;
    use super::*;

    fn refusal(splits: &str, clips: &str) -> String {
        let text = format!(
            "schema = \"skiagraph.sweep/1\"\nname = \"people\"\nset = [\"motion.frames=4\"]\n[axes]\nclip = [{clips}]\n\
             [splits]\n{splits}\n"
        );
        let file = SweepFile::parse(&text, "people.toml", "".into()).unwrap();
        Draft::new(&file, None).map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
    }

    #[test]
    fn nobody_is_in_two_splits_and_every_value_in_one() {
        let named =
            |name: &str, clip: &str| format!("{{ name = \"{name}\", set = [\"motion.clip=embedded:{clip}\"] }}");
        let three = [named("walk", "walk"), named("run", "run"), named("jump", "jump")].join(", ");
        let again = [named("walk", "walk"), named("walk again", "walk")].join(", ");
        for (splits, clips, words) in [
            ("by = \"clip\"\nparts = { test = [\"jump\"] }\nrest = \"train\"", &three, "accepted"),
            ("by = \"clip\"\nparts = { test = [\"jump\"], train = [\"walk\", \"run\"] }", &three, "accepted"),
            ("by = \"clip\"\nparts = { test = [\"jump\"], train = [\"walk\"] }", &three, "run of clip in no split"),
            ("by = \"klip\"\nparts = { test = [\"jump\"] }\nrest = \"train\"", &three, "expected an axis of the sweep"),
            (
                "by = \"clip\"\nparts = { test = [\"jmp\"] }\nrest = \"train\"",
                &three,
                "`jmp`, which is no value of clip",
            ),
            ("by = \"clip\"\nparts = { a = [\"jump\"], b = [\"jump\"] }\nrest = \"c\"", &three, "`jump` is in `a`"),
            ("by = \"clip\"\nparts = { test = [\"walk\"] }", &named("walk", "walk"), "at least two splits"),
            (
                "by = \"clip\"\nparts = { test = [\"walk\"] }\nrest = \"train\"",
                &named("walk", "walk"),
                "is left for `train`",
            ),
            ("by = \"clip\"\nparts = { test = [] }\nrest = \"train\"", &three, "at least one value of clip in `test`"),
            (
                "by = \"clip\"\nparts = { \"../a\" = [\"jump\"] }\nrest = \"train\"",
                &three,
                "expected a name of letters",
            ),
            ("by = \"clip\"\nparts = { test = [\"walk\"] }\nrest = \"train\"", &again, "embedded:walk is in `t"),
        ] {
            let found = refusal(splits, clips);
            assert!(found.contains(words), "{splits}\n{found}");
        }
    }

    #[test]
    fn the_subject_of_an_acclaim_clip_is_in_its_name() {
        let of = |clip: &str| {
            let file = crate::scenario::ScenarioFile::built_in(&[format!("motion.clip={clip}")]).unwrap();
            people(&file.scenario)
        };
        assert_eq!(of("cmu/49_01.amc"), ["the recording cmu/49_01.amc", "subject 49"]);
        assert_eq!(of("cmu/49_01.bvh"), ["the recording cmu/49_01.bvh"]);
    }
}
