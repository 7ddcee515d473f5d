//! What the command line says about the files that a scenario or sweep may name.

use std::path::Path;

use serde_json::Value;

use super::overrides::{parse_value, split_at_commas};
use crate::input::AllowedFolders;

/// What a user typed: folders, assignments (`key=value` or `key=value,value`), and whether all files may be named.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NamedOnCommandLine<'a> {
    pub(crate) assignments: &'a [String],
    pub(crate) mocap_directory: Option<&'a Path>,
    pub(crate) anywhere: bool,
}

impl NamedOnCommandLine<'_> {
    /// What it allows a scenario whose paths are relative to `folder`.
    pub(crate) fn allowed(&self, folder: &Path) -> AllowedFolders {
        let mut allowed = AllowedFolders::default();
        if self.anywhere {
            allowed.allow_anywhere();
        }
        self.mocap_directory.into_iter().for_each(|directory| allowed.allow(directory));
        for (_, values) in self.assignments.iter().filter_map(|assignment| assignment.split_once('=')) {
            for value in split_at_commas(values).into_iter().filter_map(|value| parse_value(value.trim()).ok()) {
                allow_texts(&value, folder, &mut allowed);
            }
        }
        allowed
    }
}

/// Every text of a value may be the name of a file.
fn allow_texts(value: &Value, folder: &Path, allowed: &mut AllowedFolders) {
    match value {
        Value::String(name) => {
            let path = folder.join(name);
            // pipes, devices and missing paths too: their reader reports what is wrong
            if !path.is_dir() && (path.exists() || Path::new(name).components().count() > 1) {
                allowed.allow(&path);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| allow_texts(value, folder, allowed)),
        Value::Object(table) => table.values().for_each(|value| allow_texts(value, folder, allowed)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_typed_are_allowed_and_their_neighbours_are_not() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        std::fs::create_dir(at("mine")).unwrap();
        ["a.bvh", "b.bvh", "c.bvh"].iter().for_each(|name| std::fs::write(at(name), "x").unwrap());
        let assignments = ["clip=../a.bvh,embedded:walk".to_owned(), "then=[{clip = \"../b.bvh\"}]".to_owned()];
        let typed = NamedOnCommandLine { assignments: &assignments, ..NamedOnCommandLine::default() };
        let allowed = typed.allowed(&at("mine"));
        allowed.check(&at("a.bvh")).unwrap();
        allowed.check(&at("mine/../b.bvh")).unwrap();
        allowed.check(&at("c.bvh")).unwrap_err();
        // who types the name of a file that is not there is told that, not that it leads out of a folder
        let assignments = ["clip=../gone.bvh".to_owned()];
        let typed = NamedOnCommandLine { assignments: &assignments, ..NamedOnCommandLine::default() };
        typed.allowed(&at("mine")).check(&at("gone.bvh")).unwrap();
        typed.allowed(&at("mine")).check(&at("c.bvh")).unwrap_err();
        // a folder alone is no name of a file
        let assignments = ["clip=..".to_owned()];
        let typed = NamedOnCommandLine { assignments: &assignments, ..NamedOnCommandLine::default() };
        typed.allowed(&at("mine")).check(&at("c.bvh")).unwrap_err();
        let typed = NamedOnCommandLine { mocap_directory: Some(root.path()), ..NamedOnCommandLine::default() };
        typed.allowed(&at("mine")).check(&at("c.bvh")).unwrap();
    }
}
