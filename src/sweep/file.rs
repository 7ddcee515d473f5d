//! Reads and checks a sweep file, and lists its axes with all their values.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::definition::{Expansion, Sweep};
use crate::scenario::{
    Diagnostic, LineSpan, MOST_SEEDS, ScenarioError, as_toml, did_you_mean, locate, settings_of, tree_of,
};
use skiagraph_core::input::{self, limits};

const MOST_VALUES: usize = 100_000;
const MOST_AXES: usize = 32;
/// Keys of earlier versions, and what to use instead.
const RETIRED: [(&str, &str); 2] = [
    ("keep", "expected no conditions; list the settings: method = \"list\" with [[points]]"),
    ("budget", "expected no budget; set the keys of its product together, as scenarios/sweeps/equal-time.toml does"),
];

#[derive(Clone, Debug, PartialEq)]
pub enum SweepAxis {
    Values(Vec<AxisValue>),
    Range {
        ends: [f64; 2],
        /// Whether values are drawn uniformly on a logarithmic scale.
        logarithmic: bool,
        /// Whether values are rounded to whole numbers.
        integer: bool,
    },
}

/// One value of an axis: its label and its overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisValue {
    /// The value itself, or the name of a table `{ name = "...", set = [...] }`.
    pub label: Value,
    /// Whether the label is the name of such a table.
    pub is_name: bool,
    pub set: Vec<String>,
}

/// A sweep and the folder that its relative paths refer to.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepFile {
    pub sweep: Sweep,
    /// The path as the user gave it.
    pub origin: String,
    /// The scenario's path is relative to this folder.
    pub folder: PathBuf,
    /// The command lines of programs that it may start: those of the command line, never those of a file.
    pub(crate) commands: Vec<String>,
    text: String,
}

impl SweepFile {
    /// Reads a sweep file.
    pub fn open(path: &Path) -> Result<Self, ScenarioError> {
        let text = input::read_to_string(path, limits::SETTINGS)
            .map_err(|source| ScenarioError::Unreadable { path: path.to_owned(), source })?;
        Self::parse(&text, &path.display().to_string(), path.parent().map(Path::to_owned).unwrap_or_default())
    }

    /// Like [`Self::open`], from a text.
    pub fn parse(text: &str, origin: &str, folder: PathBuf) -> Result<Self, ScenarioError> {
        let tree: Value = tree_of(text, origin)?;
        if let Some((key, instead)) = RETIRED.into_iter().find(|(key, _)| tree.get(key).is_some()) {
            let place = locate(text, key).map(|spot| LineSpan::of_file(text, &spot.value));
            let (origin, key, message) = (origin.to_owned(), key.to_owned(), instead.to_owned());
            return Err(Diagnostic { origin, place, key, message, ..Diagnostic::default() }.into());
        }
        let sweep: Sweep = settings_of(tree).map_err(|mistake| mistake.in_text(origin, text))?;
        let (origin, text, commands) = (origin.to_owned(), text.to_owned(), Vec::new());
        let file = Self { sweep, origin, folder, commands, text };
        file.check()?;
        Ok(file)
    }

    /// A sweep without a file.
    pub fn new(sweep: Sweep, origin: &str, folder: PathBuf) -> Result<Self, ScenarioError> {
        let (origin, text, commands) = (origin.to_owned(), String::new(), Vec::new());
        let file = Self { sweep, origin, folder, commands, text };
        file.check()?;
        Ok(file)
    }

    /// The same file, which may start these programs.
    pub(crate) fn starting(self, commands: &[String]) -> Self {
        Self { commands: commands.to_vec(), ..self }
    }

    /// The same file with another sweep, for example one changed on the command line.
    pub fn with(self, sweep: Sweep) -> Result<Self, ScenarioError> {
        let file = Self { sweep, ..self };
        file.check()?;
        Ok(file)
    }

    /// Whether a file has the schema of a sweep; `false` if it cannot be read.
    pub fn is_one(path: &Path) -> bool {
        let text = input::read_to_string(path, limits::SETTINGS).unwrap_or_default();
        let schema = |tree: Value| tree["schema"].as_str().is_some_and(|tag| tag.starts_with("skiagraph.sweep/"));
        tree_of(&text, "").is_ok_and(schema)
    }

    /// An error about a key of the file, with its line.
    pub fn complaint(&self, key: &str, message: String) -> Diagnostic {
        let place = locate(&self.text, key).map(|spot| LineSpan::of_file(&self.text, &spot.value));
        Diagnostic { origin: self.origin.clone(), place, key: key.to_owned(), message, ..Diagnostic::default() }
    }

    /// The axes, by their full names, in alphabetical order.
    pub fn axes(&self) -> Result<BTreeMap<String, SweepAxis>, Diagnostic> {
        let mut axes = BTreeMap::new();
        for (name, value) in flat("", &self.sweep.axes, is_range) {
            let axis = self.axis(&name, &value)?;
            axes.insert(name, axis);
        }
        if axes.len() > MOST_AXES {
            return Err(self.complaint("axes", format!("expected at most {MOST_AXES} axes, found {}", axes.len())));
        }
        Ok(axes)
    }

    /// The settings of `[[points]]`: axis and value, in alphabetical order of the axes.
    pub fn points(&self) -> Result<Vec<BTreeMap<String, AxisValue>>, Diagnostic> {
        let point = |(index, point): (usize, &Map<String, Value>)| {
            let mut values = BTreeMap::new();
            for (key, value) in flat("", point, is_value) {
                let at = format!("points[{index}].{key}");
                values.insert(key.clone(), self.axis_value(&at, &key, &value)?);
            }
            Ok(values)
        };
        self.sweep.points.iter().enumerate().map(point).collect()
    }

    fn axis(&self, name: &str, value: &Value) -> Result<SweepAxis, Diagnostic> {
        let key = format!("axes.{name}");
        match value {
            Value::Array(values) if values.is_empty() => {
                Err(self.complaint(&key, "expected at least one value, found none: the grid is empty".to_owned()))
            }
            Value::Array(values) if values.len() > MOST_VALUES => {
                Err(self.complaint(&key, format!("expected at most {MOST_VALUES} values, found {}", values.len())))
            }
            Value::Array(values) => {
                let values = values.iter().map(|value| self.axis_value(&key, name, value));
                let values = values.collect::<Result<Vec<_>, _>>()?;
                let twice = values.iter().enumerate().find(|(i, v)| values[..*i].iter().any(|w| w.label == v.label));
                match twice {
                    Some((_, value)) => {
                        Err(self.complaint(&key, format!("expected different values, found {} twice", value.label)))
                    }
                    None => Ok(SweepAxis::Values(values)),
                }
            }
            Value::Object(range) => self.range(&key, range),
            other => {
                let message = format!("expected a list of values such as [50, 100, 200], found {other}");
                Err(self.complaint(&key, message))
            }
        }
    }

    fn range(&self, key: &str, range: &Map<String, Value>) -> Result<SweepAxis, Diagnostic> {
        let refuse = |message: String| Err(self.complaint(key, message));
        if self.sweep.method != Expansion::Random {
            return refuse("expected a list of values; ranges need method = \"random\"".to_owned());
        }
        let logarithmic = range.contains_key("log_uniform");
        let known = ["uniform", "log_uniform", "integer"];
        if let Some(key) = range.keys().find(|key| !known.contains(&key.as_str())) {
            return refuse(format!("unknown key `{key}` (known here: {})", known.join(", ")));
        }
        let ends = range.get(if logarithmic { "log_uniform" } else { "uniform" });
        let ends: Option<Vec<f64>> =
            ends.and_then(Value::as_array).map(|e| e.iter().filter_map(Value::as_f64).collect());
        let integer = range.get("integer").is_some_and(|integer| integer == &Value::Bool(true));
        match ends.as_deref() {
            Some(&[low, high]) if low < high && (low > 0.0 || !logarithmic) && range.len() <= 1 + usize::from(integer) => {
                Ok(SweepAxis::Range { ends: [low, high], logarithmic, integer })
            }
            _ => refuse(
                "expected { uniform = [low, high] } or { log_uniform = [low, high] } with low below high (and above 0 on \
                a logarithmic scale), and integer = true for whole numbers"
                    .to_owned(),
            ),
        }
    }

    fn axis_value(&self, at: &str, name: &str, value: &Value) -> Result<AxisValue, Diagnostic> {
        let several = value.as_object().and_then(|table| Some((table.get("name")?, table.get("set")?, table.len())));
        let Some((label, set, parts)) = several else {
            let set = vec![format!("{name}={}", as_toml(value))];
            return Ok(AxisValue { label: value.clone(), is_name: false, set });
        };
        let set: Option<Vec<String>> =
            set.as_array().and_then(|set| set.iter().map(|one| one.as_str().map(str::to_owned)).collect());
        match (label.is_string() || label.is_number() || label.is_boolean(), set, parts) {
            (true, Some(set), 2) => Ok(AxisValue { label: label.clone(), is_name: true, set }),
            _ => Err(self.complaint(at, "expected { name = \"...\", set = [\"key=value\", ...] }".to_owned())),
        }
    }

    fn check(&self) -> Result<(), Diagnostic> {
        let sweep = &self.sweep;
        let refuse = |key: &str, message: String| Err(self.complaint(key, message));
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        if sweep.name.is_empty() || sweep.name.len() > 64 || !sweep.name.chars().all(plain) {
            return refuse(
                "name",
                format!("expected 1 to 64 letters, digits, `-` or `_`, found {:?}", input::excerpt(&sweep.name)),
            );
        }
        if let Some(seeds) = sweep.seeds.filter(|seeds| !(1..=MOST_SEEDS).contains(seeds)) {
            return refuse("seeds", format!("expected 1 to {MOST_SEEDS}, found {seeds}"));
        }
        let (axes, listed) = (self.axes()?, self.points()?);
        match sweep.method {
            Expansion::List if !axes.is_empty() => {
                return refuse("axes", "not valid with method = \"list\"; use [[points]]".to_owned());
            }
            Expansion::List if listed.is_empty() => {
                return refuse("points", "expected [[points]] with method = \"list\", found none".to_owned());
            }
            Expansion::List => {}
            _ if !listed.is_empty() => {
                return refuse("points", "only valid with method = \"list\"".to_owned());
            }
            Expansion::Random if sweep.samples.is_none_or(|samples| samples == 0) => {
                return refuse(
                    "samples",
                    "expected the number of settings to draw with method = \"random\"".to_owned(),
                );
            }
            _ => {}
        }
        if sweep.samples.is_some() && sweep.method != Expansion::Random {
            return refuse("samples", "only valid with method = \"random\"".to_owned());
        }
        self.check_averages(&axes, &listed)
    }

    /// Refuses to average over anything but an axis. The methods of a scenario are an axis without an entry in the
    /// file.
    fn check_averages(
        &self,
        axes: &BTreeMap<String, SweepAxis>,
        listed: &[BTreeMap<String, AxisValue>],
    ) -> Result<(), Diagnostic> {
        let known: BTreeSet<&String> = axes.keys().chain(listed.iter().flat_map(BTreeMap::keys)).collect();
        let Some(other) = self.sweep.average_over.iter().find(|name| !known.contains(name) && *name != "method") else {
            return Ok(());
        };
        let names = known.iter().map(|name| name.as_str());
        let guess = did_you_mean(other, names.clone()).map(|guess| format!(" (did you mean `{guess}`?)"));
        let names = names.collect::<Vec<_>>().join(", ");
        let (other, guess) = (input::excerpt(other), guess.unwrap_or_default());
        Err(self.complaint("average_over", format!("expected axes ({names}), found `{other}`{guess}")))
    }
}

fn is_range(table: &Map<String, Value>) -> bool {
    ["uniform", "log_uniform", "integer"].iter().any(|key| table.contains_key(*key))
}

/// Whether a table is a value: `{ name, set }`, or a tracker's settings.
fn is_value(table: &Map<String, Value>) -> bool {
    table.contains_key("set") || table.is_empty()
}

/// Flattens nested tables to dotted keys (`[axes] rig.ring.count = [...]` is one); tables that are values are kept.
fn flat(prefix: &str, table: &Map<String, Value>, stays: fn(&Map<String, Value>) -> bool) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            Value::Object(inner) if !stays(inner) => found.extend(flat(&name, inner, stays)),
            value => found.push((name, value.clone())),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<SweepFile, String> {
        let text = format!("schema = \"skiagraph.sweep/1\"\nname = \"a\"\n{text}");
        SweepFile::parse(&text, "a.toml", PathBuf::new()).map_err(|e| e.to_string())
    }

    #[test]
    fn axes_are_read_by_dotted_keys_quoted_or_not() {
        for text in [
            "[axes]\n\"rig.ring.count\" = [2, 4]\n",
            "[axes]\nrig.ring.count = [2, 4]\n",
            "[axes.rig]\nring.count = [2, 4]\n",
        ] {
            let axes = parse(text).unwrap().axes().unwrap();
            let SweepAxis::Values(values) = &axes["rig.ring.count"] else { panic!("{axes:?}") };
            assert_eq!(
                values[1],
                AxisValue { label: 4.into(), is_name: false, set: vec!["rig.ring.count=4".to_owned()] }
            );
        }
    }

    #[test]
    fn a_value_may_set_several_keys_under_a_name() {
        let text =
            "[axes]\nclip = [{ name = \"run\", set = [\"motion.clip=embedded:run\", \"motion.loop_to_s=2\"] }]\n";
        let SweepAxis::Values(values) = &parse(text).unwrap().axes().unwrap()["clip"] else { panic!() };
        assert_eq!((values[0].label.as_str(), values[0].set.len()), (Some("run"), 2));
        assert!(
            parse("[axes]\nclip = [{ name = \"run\", set = 3 }]\n")
                .unwrap_err()
                .contains("a.toml:4: axes.clip: expected { name")
        );
    }

    #[test]
    fn the_command_line_sets_axes_and_values_for_all_cells() {
        let mut sweep = Sweep::named("a");
        for assignment in ["particles=50,100", "size_px=[160,120],[320,240]", "clip=a/b.bvh,embedded:run", "layers=3"] {
            sweep.assign(assignment, &[]).unwrap();
        }
        let axes: Value = toml::from_str(
            "particles = [50, 100]\nsize_px = [[160, 120], [320, 240]]\nclip = [\"a/b.bvh\", \"embedded:run\"]",
        )
        .unwrap();
        assert_eq!(Value::Object(sweep.axes.clone()), axes);
        assert_eq!(sweep.set, ["layers=3"]);
        let keys = ["methods.a.program.settings.alpha", "methods.b.program.settings.alpha"].map(str::to_owned);
        sweep.assign("alpha=0.1,\"x\"", &keys).unwrap();
        assert_eq!(sweep.axes["alpha"][0]["name"], 0.1);
        assert_eq!(sweep.axes["alpha"][1]["set"][1], format!("{}=\"x\"", keys[1]));
        sweep.assign("alpha=3", &keys).unwrap();
        assert_eq!(sweep.set[1..], keys.map(|key| format!("{key}=3")));
        assert!(sweep.assign("particles", &[]).unwrap_err().to_string().contains("expected key=value,value,..."));
        assert!(sweep.assign("particles=5,[", &[]).unwrap_err().to_string().contains("not TOML"));
    }

    #[test]
    fn invalid_sweeps_are_refused_with_the_line() {
        for (text, words) in [
            ("[axes]\nparticles = 50\n", "axes.particles: expected a list of values such as [50, 100, 200], found 50"),
            ("[axes]\nparticles = [50, 50]\n", "expected different values, found 50 twice"),
            ("[axes]\nparticles = { uniform = [1, 2] }\n", "ranges need method = \"random\""),
            (
                "method = \"random\"\nsamples = 3\n[axes]\na = { log_uniform = [0, 2] }\n",
                "above 0 on a logarithmic scale",
            ),
            ("method = \"random\"\n[axes]\na = { uniform = [1, 2] }\n", "samples: expected the number of settings"),
            ("samples = 3\n", "samples: only valid with method = \"random\""),
            ("method = \"list\"\n", "points: expected [[points]]"),
            ("method = \"gird\"\n", "did you mean `grid`?"),
            ("seeds = 0\n", "a.toml:3: seeds: expected 1 to 100000, found 0"),
            ("seeds = 1000000000\n", "a.toml:3: seeds: expected 1 to 100000, found 1000000000"),
            ("axis = 3\n", "unknown key `axis`, did you mean `axes`?"),
            (
                "[budget]\nproduct = [\"particles\"]\nequals = 100\n",
                "a.toml:3: budget: expected no budget; set the keys",
            ),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        let other = SweepFile::parse("schema = \"skiagraph.sweep/9\"\nname = \"a\"", "a.toml", PathBuf::new());
        assert!(other.unwrap_err().to_string().contains("schema"));
    }
}
