//! Conventions of ARCHITECTURE.md and CONTRIBUTING.md that a program can check: width of comments, citations, and the
//! list of schemas in docs/schemas.md.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use crate::root;

/// Folders with this project's text.
const FOLDERS: [&str; 10] =
    ["src", "crates", "tests", "benches", "examples", "docs", "results", "robots", "scenarios", "python"];

#[test]
fn no_comment_is_wider_than_code_may_be() {
    let settings = fs::read_to_string(root().join("rustfmt.toml")).unwrap();
    let width = settings.lines().find_map(|line| line.strip_prefix("max_width = ")).unwrap();
    let width: usize = width.parse().unwrap();
    let mut wide = Vec::new();
    for (path, text) in texts(&["rs"]) {
        for (number, line) in text.lines().enumerate().filter(|(_, line)| line.chars().count() > width) {
            let comment = line.trim_start();
            // a row of a table cannot be broken
            let is_row = comment.trim_start_matches(['/', '!']).trim_start().starts_with('|');
            if comment.starts_with("//") && !is_row {
                wide.push(format!("{}:{}", path.display(), number + 1));
            }
        }
    }
    assert_eq!(wide, [] as [String; 0], "comments wider than {width} columns");
}

#[test]
fn every_citation_resolves_and_every_reference_is_cited() {
    let references = fs::read_to_string(root().join("REFERENCES.md")).unwrap();
    let known: BTreeSet<&str> = references
        .lines()
        .filter_map(|line| line.strip_prefix("- **[")?.split_once("]**"))
        .map(|(key, _)| key)
        .collect();
    assert!(known.len() > 50, "{known:?}");
    let mut cited = BTreeSet::new();
    let mut unknown = Vec::new();
    for (path, text) in texts(&["rs", "md", "toml", "py", "html"]) {
        for key in keys(&unwrapped(&text)) {
            match known.get(key.as_str()) {
                Some(key) => _ = cited.insert(*key),
                None if looks_like_a_citation(&key) => unknown.push(format!("{}: [{key}]", path.display())),
                None => {}
            }
        }
    }
    assert_eq!(unknown, [] as [String; 0], "not in REFERENCES.md");
    assert_eq!(known.difference(&cited).collect::<Vec<_>>(), [] as [&&str; 0], "in REFERENCES.md, cited nowhere");
}

/// Every schema that a file or an answer of `--json` names is in the list of docs/schemas.md, and no other.
#[test]
fn the_list_of_schemas_is_complete() {
    let named = |text: &str| -> BTreeSet<String> {
        let names = text.split("skiagraph.").skip(1);
        let schema = |rest: &str| {
            let length = rest
                .find(|c: char| !(c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '/'))
                .unwrap_or(rest.len());
            let (name, version) = rest[..length].split_once('/')?;
            // tests name versions of the future, 9
            (!name.is_empty() && version.parse::<u8>().is_ok_and(|v| v < 9)).then(|| format!("{name}/{version}"))
        };
        names.filter_map(schema).collect()
    };
    let list = named(&fs::read_to_string(root().join("docs/schemas.md")).unwrap());
    let sources =
        texts(&["rs", "html"]).into_iter().filter(|(path, _)| path.starts_with("src") || path.starts_with("crates"));
    let used: BTreeSet<String> = sources.flat_map(|(_, text)| named(&text)).collect();
    assert_eq!(used.difference(&list).collect::<Vec<_>>(), [] as [&String; 0], "schemas that docs/schemas.md lacks");
    assert_eq!(list.difference(&used).collect::<Vec<_>>(), [] as [&String; 0], "schemas that nothing names");
}

fn keys(text: &str) -> impl Iterator<Item = String> {
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split_once(']'));
    inside.map(|(key, _)| key.to_owned()).filter(|key| key.chars().count() < 40).collect::<Vec<_>>().into_iter()
}

/// A name and a year.
fn looks_like_a_citation(key: &str) -> bool {
    let Some((name, year)) = key.rsplit_once(' ') else { return false };
    let is_year = year.len() == 4 && year.parse().is_ok_and(|year: u32| (1800..2100).contains(&year));
    is_year && name.chars().all(|c| c.is_alphabetic() || c == ' ') && name.chars().any(char::is_uppercase)
}

/// Lines of comments and paragraphs joined.
fn unwrapped(text: &str) -> String {
    let lines = text.lines().map(|line| line.trim_start().trim_start_matches(['/', '!']).trim());
    lines.collect::<Vec<_>>().join(" ")
}

/// Files with these extensions: their paths in the checkout, and their contents.
fn texts(extensions: &[&str]) -> Vec<(PathBuf, String)> {
    let mut folders: Vec<PathBuf> = FOLDERS.iter().map(|folder| root().join(folder)).collect();
    let mut files: Vec<PathBuf> = Vec::new();
    let in_root = fs::read_dir(root()).unwrap().map(|entry| entry.unwrap().path());
    files
        .extend(in_root.filter(|path| path.extension().is_some_and(|e| e == "md") && !path.ends_with("REFERENCES.md")));
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.retain(|path| {
        path.extension().and_then(|e| e.to_str()).is_some_and(|extension| extensions.contains(&extension))
    });
    files.sort();
    let read = |path: PathBuf| (path.strip_prefix(root()).unwrap().to_owned(), fs::read_to_string(&path).unwrap());
    files.into_iter().map(read).collect()
}
