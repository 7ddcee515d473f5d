//! Splits of a sweep's sets, by the values of an axis.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::file::{SweepAxis, SweepFile};
use super::plan_file::table_text;
use crate::prepare::clip_file::{Folders, paths_of};
use crate::scenario::{Diagnostic, MotionSettings, ScenarioFile};
use skiagraph_core::input::excerpt;

/// Divides the sets of a sweep, so that trackers are tested on motions or people that they have not learned from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Splits {
    /// The axis that decides: all sets of one of its values are in one split. If it chooses recordings, no file is in
    /// two splits, as the motion of the actor, of a second person or of training, and no subject of CMU's `.amc`
    /// (`49_01.amc` and `49_02.amc`). Subjects of other files are not known: put theirs in one split.
    pub by: String,
    /// The values of each split: `{ test = ["jump"] }`. Names have at most 64 letters, digits, `-` and `_`.
    pub parts: BTreeMap<String, Vec<Value>>,
    /// The split of all other values. Default: none; then every value must be in `parts`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest: Option<String>,
}

impl Splits {
    pub(super) fn of(&self, axes: &Map<String, Value>) -> &str {
        let value = axes.get(&self.by);
        let named = self.parts.iter().find(|(_, values)| values.iter().any(|known| Some(known) == value));
        named.map_or(self.rest.as_deref().unwrap_or_default(), |(name, _)| name)
    }

    pub(super) fn names(&self) -> BTreeSet<&str> {
        self.parts.keys().chain(&self.rest).map(String::as_str).collect()
    }

    /// Checks the names and that every value of the axis is in exactly one split, before any setting is read.
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
            let is_name =
                (1..=64).contains(&name.len()) && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
            if !is_name || ["sets", "collection"].contains(&name.to_lowercase().as_str()) {
                let expected = "expected a name of up to 64 letters, digits, - and _, not `sets` or `collection`";
                return complain("parts", format!("{expected}, found `{}`", excerpt(name)));
            }
        }
        let different: BTreeSet<String> = self.names().iter().map(|name| name.to_lowercase()).collect();
        if different.len() < 2 || different.len() < self.names().len() {
            let found = self.names().into_iter().collect::<Vec<_>>().join(", ");
            return complain(
                "parts",
                format!("expected at least two splits of different names, found {}", excerpt(&found)),
            );
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

    /// Checks that every split has a set and, if the axis `chooses_recordings`, that none of these is in two splits.
    /// `settings` are the axes of each setting and its recordings.
    pub(super) fn check_settings<'a>(
        &self,
        file: &SweepFile,
        chooses_recordings: bool,
        settings: impl Iterator<Item = (&'a Map<String, Value>, &'a [String])>,
    ) -> Result<(), Diagnostic> {
        let (mut known, mut filled): (BTreeMap<&str, &str>, BTreeSet<&str>) = Default::default();
        for (axes, recordings) in settings {
            let split = self.of(axes);
            filled.insert(split);
            for recording in recordings.iter().filter(|_| chooses_recordings) {
                let other = *known.entry(recording).or_insert(split);
                if other != split {
                    let message = format!(
                        "{} is in `{other}` and in `{split}`: trackers would be tested on motions that they have learned \
                         from; put all values with it in one split",
                        excerpt(recording)
                    );
                    return Err(file.complaint("splits", message));
                }
            }
        }
        match self.names().into_iter().find(|name| !filled.contains(name)) {
            Some(empty) => {
                let message = format!("no setting is in `{empty}`; draw more `samples`, or give it another value");
                Err(file.complaint("splits", message))
            }
            None => Ok(()),
        }
    }
}

/// The recordings of a scene (of the actor, of others, and of training), by file, and the subjects that names state.
pub(super) fn recordings(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Vec<String> {
    let scenario = &file.scenario;
    let others = scenario.distractor.iter().map(|other| &other.motion);
    let training = scenario.training.iter().flat_map(|training| &training.clips);
    let all = std::iter::once(&scenario.motion).chain(others).chain(training);
    let takes = all.flat_map(|motion| motion.takes("motion")).map(|(_, take)| take);
    takes.flat_map(|take| [Some(recording(file, mocap_directory, &take)), subject(&take)]).flatten().collect()
}

/// A recording by the file that it is, however its path is written.
fn recording(file: &ScenarioFile, mocap_directory: Option<&Path>, take: &MotionSettings) -> String {
    let places = Folders::of(file, mocap_directory);
    let path = paths_of(places, Path::new(&take.clip), take).into_iter().next();
    let path = path.map(|path| fs::canonicalize(&path).unwrap_or(path));
    format!("the recording {}", path.map_or(take.clip.clone(), |path| path.display().to_string()))
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
            (
                "by = \"clip\"\nparts = { test = [\"walk\"] }",
                &named("walk", "walk"),
                "at least two splits of different names",
            ),
            (
                "by = \"clip\"\nparts = { test = [\"walk\"] }\nrest = \"train\"",
                &named("walk", "walk"),
                "is left for `train`",
            ),
            ("by = \"clip\"\nparts = { test = [] }\nrest = \"train\"", &three, "at least one value of clip in `test`"),
            ("by = \"clip\"\nparts = { \"../a\" = [\"jump\"] }\nrest = \"train\"", &three, "expected a name of up to"),
            ("by = \"clip\"\nparts = { test = [\"walk\"] }\nrest = \"train\"", &again, "embedded:walk is in `t"),
            (
                "by = \"clip\"\nparts = { Test = [\"walk\"], test = [\"run\"] }\nrest = \"test\"",
                &three,
                "of different names",
            ),
        ] {
            let found = refusal(splits, clips);
            assert!(found.contains(words), "{splits}\n{found}");
        }
    }

    #[test]
    fn the_subject_of_an_acclaim_clip_is_in_its_name() {
        let of = |clip: &str| {
            let file = crate::scenario::ScenarioFile::built_in(&[format!("motion.clip={clip}")]).unwrap();
            recordings(&file, None)
        };
        assert_eq!(of("cmu/49_01.amc"), ["the recording cmu/49_01.amc", "subject 49"]);
        assert_eq!(of("cmu/49_01.bvh"), ["the recording cmu/49_01.bvh"]);
    }
}
