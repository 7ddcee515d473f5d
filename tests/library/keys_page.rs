//! `scenarios/keys.md`, the reference of all keys, is made from the JSON schemas, whose descriptions are doc comments.
//!
//! This writes the page anew, to be read before it is committed:
//!
//!     SNAPSHOTS=overwrite cargo test --test library keys_page

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use skiagraph::scenario::{Recording, Scenario, ScenarioError, ScenarioFile};
use skiagraph::sweep::Sweep;
use snapbox::Data;
use snapbox::assert::Assert;

const HEAD: &str = "\
# Keys of scenarios, sweeps and recordings

Every key of a [scenario](#scenario), of a [sweep](#sweep) and of a [recording](#recording), table by table.
[README.md](README.md) explains what they are for, [recordings.md](../docs/recordings.md) recordings. `skiagraph schema`
prints the same for editors.

Lengths are in metres, times in seconds and angles in degrees, unless the name of a key states another unit. Frame numbers
are those of the recording's file, from 1. Sets, runs and reports count the set's frames from 0. Unknown keys are errors.

This page is made from the program's own descriptions of its keys; a test compares them.
";

struct Format<'a> {
    schema: &'a Value,
    tables: Vec<Table<'a>>,
}

struct Table<'a> {
    /// Its JSON pointer in `every_table.toml`: `/rig/ring`, or `/rig/file/0` in a list; empty for the file itself.
    place: String,
    definition: &'a Value,
}

#[test]
fn keys_page_has_every_key() {
    let mut page = HEAD.to_owned();
    for schema in [Scenario::json_schema(), Sweep::json_schema(), Recording::json_schema()] {
        let schema: Value = serde_json::from_str(&schema.to_string().replace("\\n", " ")).unwrap();
        let mut format = Format { schema: &schema, tables: Vec::new() };
        format.add(Table { place: String::new(), definition: &schema });
        for table in &format.tables {
            page += &format.section(table);
        }
    }
    let committed = Data::read_from(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/keys.md"), None);
    Assert::new().action_env("SNAPSHOTS").normalize_paths(false).eq(page, committed);
}

impl<'a> Table<'a> {
    fn inner(&self, name: &str, property: &Value, definition: &'a Value) -> Self {
        let entry = if property["items"].is_object() { "/0" } else { "" };
        Self { place: format!("{}/{name}{entry}", self.place), definition }
    }

    fn key_of(&self, name: &str) -> String {
        format!("{}/{name}", self.place).replace("/0", "").trim_start_matches('/').replace('/', ".")
    }

    /// As in a file: `[rig.ring]`, or `[[rig.file]]` for a list; the title of the file itself.
    fn header(&self) -> String {
        let key = self.key_of("").trim_end_matches('.').to_owned();
        match (key.is_empty(), self.place.ends_with("/0")) {
            (true, _) => text(&self.definition["title"]).to_owned(),
            (_, true) => format!("[[{key}]]"),
            (_, false) => format!("[{key}]"),
        }
    }
}

impl<'a> Format<'a> {
    /// The table that is described with this definition.
    fn described_as(&self, definition: &Value) -> Option<&Table<'a>> {
        self.tables.iter().find(|table| std::ptr::eq(table.definition, definition))
    }

    fn add(&mut self, table: Table<'a>) {
        let mut inner = Vec::new();
        for (name, property) in keys_of(table.definition) {
            let own = table.inner(name, property, behind(self.schema, property));
            for (choice, property) in choices(own.definition).flat_map(keys_of).filter(|(_, inner)| is_named(inner)) {
                inner.push(own.inner(choice, property, behind(self.schema, property)));
            }
            inner.push(own);
        }
        self.tables.push(table);
        for table in inner {
            if is_table(table.definition) && self.described_as(table.definition).is_none() {
                self.add(table);
            }
        }
    }

    fn section(&self, table: &Table<'_>) -> String {
        let mut repeated: Vec<(String, Vec<String>)> = Vec::new();
        let mut rows = Vec::new();
        for (name, property) in keys_of(table.definition) {
            let Some(words) = self.repetition(table, name, property) else {
                rows.push(self.row(table, name, property));
                continue;
            };
            match repeated.iter_mut().find(|(known, _)| *known == words) {
                Some((_, names)) => names.push(format!("`{name}`")),
                None => repeated.push((words, vec![format!("`{name}`")])),
            }
        }
        let mut parts = vec![text(&table.definition["description"]).to_owned()];
        parts.extend(repeated.into_iter().map(|(words, names)| format!("{words}: {}.", names.join(", "))));
        if !rows.is_empty() {
            parts.push(format!("| key | meaning | range | default |\n|---|---|---|---|\n{}", rows.join("\n")));
        }
        let mark = if table.place.is_empty() { "" } else { "`" };
        format!("\n## {mark}{}{mark}\n\n{}\n", table.header(), self.with_links(&parts.join("\n\n")))
    }

    /// Whose key it repeats: that of a table of the same kind, or what its description says.
    fn repetition(&self, table: &Table<'_>, name: &str, property: &Value) -> Option<String> {
        let kind = &table.definition["description"];
        let first = self.tables.iter().find(|other| other.definition["description"] == *kind)?;
        if first.place != table.place && first.definition["properties"][name] == *property {
            return Some(format!("As in `{}`", first.header()));
        }
        let words = text(&property["description"]).split(". Default: ").next()?.trim_end_matches('.');
        words.starts_with("As in `[").then(|| words.to_owned())
    }

    fn row(&self, table: &Table<'_>, name: &str, property: &Value) -> String {
        let (key, definition) = (table.key_of(name), behind(self.schema, property));
        let description = text(&property["description"]);
        let (meaning, default) = description.split_once("Default: ").unwrap_or((description, ""));
        let (mut shown, mut meaning) = (name.to_owned(), meaning.trim().to_owned());
        assert!(!meaning.is_empty(), "{key} has no doc comment");
        if let Some(first) = self.described_as(definition) {
            shown = table.inner(name, property, definition).header();
            if shown != first.header() {
                meaning += &format!(" Keys as in `{}`.", first.header());
            }
        }
        for choice in choices(definition) {
            meaning += &format!("<br>{}", described(choice, &key));
        }
        let is_required = table.definition["required"].as_array().is_some_and(|names| names.contains(&json!(name)));
        let default = if is_required { "required" } else { default.trim_end_matches('.') };
        assert!(!default.is_empty() || is_table(definition), "the doc comment of {key} has no default");
        let is_scenario = self.schema["title"] == "Scenario";
        let range = if is_scenario { range(table, name, property, definition) } else { String::new() };
        format!("| `{shown}` | {meaning} | {range} | {default} |")
    }

    /// The text with a link at every table of this page and every page of the repository that it names as code.
    fn with_links(&self, text: &str) -> String {
        let mut linked = String::new();
        for (index, part) in text.split('`').enumerate() {
            let page = part.split('#').next().filter(|page| page.ends_with(".md"));
            linked += &match page {
                _ if index % 2 == 0 => part.to_owned(),
                Some(page) => format!("[{page}]({})", format!("../{part}").replace("../scenarios/", "")),
                None if self.tables.iter().any(|table| table.header() == part) => {
                    format!("[`{part}`](#{})", part.replace(['[', ']', '.'], ""))
                }
                None => format!("`{part}`"),
            };
        }
        linked
    }
}

/// A choice of a key: a word, a table with its own section, or a small table.
fn described(choice: &Value, key: &str) -> String {
    let mut words = text(&choice["description"]).to_owned();
    if let Some(word) = choice["const"].as_str() {
        return format!("`\"{word}\"`: {words}");
    }
    let (name, inner) = keys_of(choice).next().unwrap();
    if is_named(inner) {
        return format!("`[{key}.{name}]`: {words}");
    }
    for (name, property) in keys_of(inner) {
        words += &format!(" `{name}`: {}", text(&property["description"]));
    }
    let names: Vec<&str> = keys_of(inner).map(|(name, _)| name.as_str()).collect();
    format!("`{{ {name} = {{ {} }} }}`: {words}", names.join(", "))
}

/// The numbers that the program accepts, in its own words: it is given one that is too great, then one too small.
fn range(table: &Table<'_>, name: &str, property: &Value, definition: &Value) -> String {
    let is_of = |kind: &str| definition["type"] == kind || definition["type"][0] == kind;
    let extremes = match definition["format"].as_str() {
        // a file cannot name a program
        _ if table.place == "/tracker/program" => vec![],
        Some("uint8") => vec![json!(u8::MAX)],
        Some("uint32") => vec![json!(u32::MAX)],
        _ if is_of("integer") => vec![json!(1_u64 << 60)],
        _ if is_of("number") => vec![json!(1e300), json!(-1e300)],
        _ => vec![],
    };
    // trackers side by side are methods, which have names: here those of the trackers
    let place = match table.place.strip_prefix("/tracker/") {
        Some(tracker) => format!("/methods/{}/{tracker}", tracker.split('/').next().unwrap_or_default()),
        None => table.place.clone(),
    };
    let key = format!("{place}/{name}").trim_start_matches('/').replace("/0", "[0]").replace('/', ".");
    for extreme in extremes {
        let mut scenario: Value = toml::from_str(include_str!("every_table.toml")).unwrap();
        let written = scenario.pointer_mut(&place);
        let written = written.unwrap_or_else(|| panic!("tests/library/every_table.toml has no {}", table.header()));
        written[name] = filled(property, &extreme);
        let text = toml::to_string(&scenario).unwrap();
        let problem = match ScenarioFile::parse(&text, "every_table.toml", PathBuf::new(), &[]) {
            Ok(_) => continue,
            Err(ScenarioError::Unsound(problem)) => problem,
            Err(other) => panic!("{key} = {extreme}: {other}"),
        };
        assert!(problem.key.starts_with(&key) || key.starts_with(&problem.key), "{key} = {extreme}: {problem}");
        let allowed = problem.message.strip_prefix("expected ").unwrap_or_default();
        let allowed = allowed.split(", found ").next().unwrap_or_default().trim_start_matches("a whole number ");
        return allowed.trim_start_matches("a number ").trim_start_matches("from ").to_owned();
    }
    String::new()
}

/// A value of the form of a property, with this number everywhere.
fn filled(property: &Value, number: &Value) -> Value {
    match property.get("items") {
        Some(items) => vec![filled(items, number); property["minItems"].as_u64().unwrap_or(1) as usize].into(),
        None => number.clone(),
    }
}

fn keys_of(definition: &Value) -> impl Iterator<Item = (&String, &Value)> {
    definition["properties"].as_object().into_iter().flatten()
}

fn choices(definition: &Value) -> impl Iterator<Item = &Value> {
    definition["oneOf"].as_array().into_iter().flatten()
}

/// What a property holds: the definition behind references, options and lists.
fn behind<'a>(schema: &'a Value, property: &'a Value) -> &'a Value {
    let name = property["$ref"].as_str().and_then(|path| path.rsplit('/').next());
    let definition = name.map(|name| &schema["$defs"][name]);
    let next = definition.or(property["anyOf"].get(0)).or(property.get("items"));
    next.map_or(property, |next| behind(schema, next))
}

/// Whether a property is described elsewhere in the schema; small tables of choices are described in place.
fn is_named(property: &Value) -> bool {
    property["$ref"].is_string()
}

fn is_table(definition: &Value) -> bool {
    definition["additionalProperties"] == false && keys_of(definition).next().is_some()
}

fn text(description: &Value) -> &str {
    description.as_str().unwrap_or_default()
}
