//! The files that a scenario or sweep may name because of the command line.

use std::path::Path;

use serde_json::Value;

use super::value_text::{parse_value, split_at_commas};
use crate::input::AllowedFolders;

/// The user's arguments: assignments (`key=value` or `key=value,value`), a folder of recordings, and whether all files
/// may be named.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NamedOnCommandLine<'a> {
    pub(crate) assignments: &'a [String],
    pub(crate) mocap_directory: Option<&'a Path>,
    pub(crate) anywhere: bool,
}

impl NamedOnCommandLine<'_> {
    /// The allowed folders of a scenario whose paths are relative to `folder`.
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

/// Allows all texts of a value that may be names of files.
fn allow_texts(value: &Value, folder: &Path, allowed: &mut AllowedFolders) {
    match value {
        Value::String(name) => {
            let path = folder.join(name);
            // also pipes, devices and missing paths, whose reader reports the error
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
    fn typed_files_are_allowed_and_their_neighbours_are_not() {
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
        // missing files are allowed, so that the error says that they are missing
        let assignments = ["clip=../gone.bvh".to_owned()];
        let typed = NamedOnCommandLine { assignments: &assignments, ..NamedOnCommandLine::default() };
        typed.allowed(&at("mine")).check(&at("gone.bvh")).unwrap();
        typed.allowed(&at("mine")).check(&at("c.bvh")).unwrap_err();
        // a folder is not the name of a file
        let assignments = ["clip=..".to_owned()];
        let typed = NamedOnCommandLine { assignments: &assignments, ..NamedOnCommandLine::default() };
        typed.allowed(&at("mine")).check(&at("c.bvh")).unwrap_err();
        let typed = NamedOnCommandLine { mocap_directory: Some(root.path()), ..NamedOnCommandLine::default() };
        typed.allowed(&at("mine")).check(&at("c.bvh")).unwrap();
    }
}
