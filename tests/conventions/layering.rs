//! Rules about dependencies that the compiler does not check: which package depends on which others of this workspace,
//! which room of the application (a module at the root of `src`) may use which other, and where certain external crates
//! may be used. ARCHITECTURE.md has the tables. Files are read as streams of tokens, so every form of a path is seen.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};

use crate::root;

/// Each package, and the packages of this workspace that it or its tests depend on.
const DEPENDS_ON: &[(&str, &[&str])] = &[
    ("robots", &[]),
    ("crates/core", &["robots"]),
    // the blindfold: what tracks cannot name the truth
    ("crates/track", &["core"]),
    ("crates/eval", &["core"]),
    ("crates/physics", &["core"]),
    ("crates/truth", &["core"]),
    ("crates/set", &["core", "truth"]),
    ("crates/report", &["core", "eval", "track", "truth"]),
    (".", &["core", "eval", "physics", "report", "set", "track", "truth"]),
];

/// Each room of the application, and the rooms that it may use.
const MAY_USE: &[(&str, &[&str])] = &[
    ("artefacts", &[]),
    ("scenario", &[]),
    ("common", &["artefacts", "scenario"]),
    ("prepare", &["common", "artefacts", "scenario"]),
    ("external", &["common", "artefacts", "scenario"]),
    ("measure", &["common", "prepare", "external", "scenario"]),
    ("train", &["common", "prepare", "artefacts", "scenario"]),
    ("inspect", &["common", "prepare", "measure", "train", "artefacts", "scenario"]),
    ("rendering", &["common", "prepare", "artefacts", "scenario"]),
    ("tracking", &["common", "measure", "train", "external", "artefacts", "scenario"]),
    ("runs", &["rendering", "tracking", "common", "prepare", "measure", "train", "external", "artefacts", "scenario"]),
    ("gating", &["runs", "tracking", "common", "measure", "artefacts", "scenario"]),
    ("checking", &["rendering", "tracking", "common", "prepare", "measure", "train", "scenario"]),
    ("bound", &["runs", "common", "prepare", "measure", "artefacts", "scenario"]),
    ("faults", &["rendering", "tracking", "common", "measure", "train", "external", "scenario"]),
    ("conformance", &["rendering", "tracking", "common", "prepare", "measure", "train", "scenario"]),
    ("segmentation", &["common", "artefacts"]),
    ("import", &["segmentation", "common", "prepare", "artefacts", "scenario"]),
    ("export", &["common", "artefacts"]),
    ("twin", &["measure", "common", "prepare", "external", "artefacts", "scenario"]),
];

/// Rooms of the application that may use every other.
const FREE: &[&str] = &["explain", "sweep", "interface", "cli"];

/// External crates and modules that only some files may use: the beginning of the path, and those files and folders.
const SEAMS: &[(&str, &[&str])] = &[
    ("rapier3d", &["crates/physics"]),
    ("parry3d", &["crates/core/src/contact"]),
    ("urdf_rs", &["crates/core/src/body/urdf"]),
    ("exr", &["crates/set/src/format/exr_layers.rs"]),
    ("half", &["crates/set/src/format/exr_layers.rs"]),
    ("tar", &["crates/set/src/export/webdataset.rs"]),
    ("serde_saphyr", &["crates/core/src/camera/files"]),
    ("clap", &["src/cli"]),
    ("image", &["crates/truth/src/observing/image.rs", "crates/truth/src/observing/imaging/jpeg.rs"]),
    ("tiny_skia", &["crates/report"]),
    ("ab_glyph", &["crates/report"]),
    ("faer", &["crates/track/src/motion_model"]),
    ("pulp", &["crates/core/src/simd"]),
    ("sha2", &["crates/core/src/input"]),
    ("signal_hook", &["src/cli/interrupt.rs"]),
    (
        "rustix",
        &[
            "crates/set/src/set_writer.rs",
            "src/artefacts/place.rs",
            "src/cli/interrupt.rs",
            "src/external/program.rs",
            "src/sweep/cell.rs",
        ],
    ),
    (
        "std::fs",
        &[
            "crates/core/src/input",
            "crates/core/src/body/urdf",
            "crates/core/src/body/skin/skin_file.rs",
            "crates/truth/src/mocap",
            "crates/set",
            "src/artefacts",
            "src/prepare",
            "src/external",
            "src/rendering",
            "src/tracking",
            "src/runs",
            "src/gating",
            "src/segmentation",
            "src/import",
            "src/export",
            "src/explain",
            "src/sweep",
            "src/cli",
            "src/scenario/similar_file.rs",
            "src/scenario/survey.rs",
        ],
    ),
    (
        "std::time",
        &[
            "src/artefacts/place.rs",
            "src/external",
            "src/train",
            "src/tracking",
            "src/checking",
            "src/segmentation",
            "src/sweep",
            "src/cli",
        ],
    ),
];

#[test]
fn packages_depend_as_the_table_says() {
    for (folder, expected) in DEPENDS_ON {
        let manifest = std::fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap();
        let manifest: toml::Table = manifest.parse().unwrap();
        // a dependency may be one of a target only, and have another name than its package
        let targets = manifest.get("target").and_then(toml::Value::as_table).into_iter().flatten();
        let places = targets.filter_map(|(_, target)| target.as_table()).chain([&manifest]);
        let tables = places.flat_map(|place| {
            let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
            kinds.into_iter().filter_map(|kind| place.get(kind)?.as_table())
        });
        let names =
            tables.flatten().map(|(name, given)| given.get("package").and_then(toml::Value::as_str).unwrap_or(name));
        let own: BTreeSet<&str> = names.filter_map(|name| name.strip_prefix("skiagraph-")).collect();
        assert_eq!(own, expected.iter().copied().collect(), "{folder}/Cargo.toml");
    }
}

#[test]
fn rooms_use_only_what_the_table_permits() {
    let mut used = BTreeSet::new();
    let mut complaints = Vec::new();
    for (file, code) in sources("src") {
        let parts: Vec<&str> = file.trim_end_matches(".rs").split('/').skip(1).filter(|part| *part != "mod").collect();
        let room = parts[0];
        if FREE.contains(&room) || ["lib", "main"].contains(&room) {
            continue;
        }
        let allowed = MAY_USE.iter().find(|(name, _)| *name == room).unwrap_or_else(|| panic!("no row for {room}")).1;
        for target in rooms_named(&code, parts.len()) {
            if target == room || target.starts_with("test_") {
                continue;
            }
            if !allowed.contains(&target.as_str()) {
                complaints.push(format!("{file}: room {room} may not use {target}"));
            }
            used.insert((room.to_owned(), target));
        }
    }
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
    let permitted = MAY_USE.iter().flat_map(|(room, targets)| targets.iter().map(|target| (*room, *target)));
    let unused = permitted.filter(|(room, target)| !used.contains(&((*room).to_owned(), (*target).to_owned())));
    assert_eq!(unused.collect::<Vec<_>>(), [], "permissions that nothing uses");
}

#[test]
fn external_crates_are_used_at_their_seams() {
    let mut crossed = BTreeSet::new();
    let mut complaints = Vec::new();
    for (file, code) in ["src", "crates"].iter().flat_map(|folder| sources(folder)) {
        let paths = paths_in(&code);
        for (foreign, places) in SEAMS.iter().filter(|(foreign, _)| paths.iter().any(|path| begins(path, foreign))) {
            let here: Vec<&&str> = places.iter().filter(|place| file.starts_with(**place)).collect();
            if here.is_empty() && !file.starts_with("crates/test_support") {
                complaints.push(format!("{file}: {foreign} may only be used in {places:?}"));
            }
            crossed.extend(here.into_iter().map(|place| (*foreign, *place)));
        }
    }
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
    let seams = SEAMS.iter().flat_map(|(foreign, places)| places.iter().map(move |place| (*foreign, *place)));
    assert_eq!(seams.filter(|seam| !crossed.contains(seam)).collect::<Vec<_>>(), [], "seams that no file uses");
}

/// The modules at the root of the crate that are named in a file `depth` modules below it.
fn rooms_named(code: &str, depth: usize) -> BTreeSet<String> {
    let mut rooms = BTreeSet::new();
    for path in paths_in(code) {
        // `super` is counted from the file: in an inline module its first ones lead out of that
        let inner = path.iter().take_while(|part| *part == "mod").count();
        let path = &path[inner..];
        let above = path.iter().take_while(|part| *part == "super").count();
        let from_root = path.first().is_some_and(|first| first == "crate") || (above > 0 && above == depth + inner);
        rooms.extend(path.get(above.max(1)).filter(|_| from_root).cloned());
    }
    rooms
}

/// Every path of a file, groups multiplied out; before it, one `mod` for every inline module around it.
fn paths_in(code: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    collect(code.parse().unwrap(), &[], 0, &mut paths);
    paths
}

fn collect(tokens: TokenStream, prefix: &[String], inner: usize, paths: &mut Vec<Vec<String>>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut path = prefix.to_vec();
    let mut follows_colons = true;
    for (at, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Punct(colon) if colon.as_char() == ':' => {
                // the second of two: one alone stands before a type
                follows_colons = matches!(&tokens[..at], [.., TokenTree::Punct(first)]
                    if first.as_char() == ':' && first.spacing() == Spacing::Joint);
            }
            TokenTree::Ident(name) => {
                if !follows_colons {
                    path = prefix.to_vec();
                }
                path.push(name.to_string());
                paths.push([vec!["mod".to_owned(); inner], path.clone()].concat());
                follows_colons = false;
            }
            TokenTree::Group(group) => {
                let is_of_path = follows_colons && group.delimiter() == Delimiter::Brace;
                let is_module =
                    matches!(&tokens[..at], [.., TokenTree::Ident(word), TokenTree::Ident(_)] if word == "mod");
                let within = if is_of_path { path.clone() } else { Vec::new() };
                collect(group.stream(), &within, inner + usize::from(is_module), paths);
                path = prefix.to_vec();
                follows_colons = false;
            }
            _ => {
                path = prefix.to_vec();
                follows_colons = false;
            }
        }
    }
}

/// Whether a path is this external crate or module, or something in it.
fn begins(path: &[String], foreign: &str) -> bool {
    let path: Vec<&String> = path.iter().skip_while(|part| *part == "mod").collect();
    let foreign: Vec<&str> = foreign.split("::").collect();
    // a crate's name alone may be a variable's
    path.len() > 1 && path.len() >= foreign.len() && path.iter().zip(&foreign).all(|(a, b)| a == b)
}

/// The sources below a folder: path from the root of the checkout, and text.
fn sources(folder: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders: Vec<PathBuf> = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let below: &Path = path.strip_prefix(root()).unwrap();
                found.push((below.to_str().unwrap().replace('\\', "/"), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    assert!(found.len() > 10, "found only {} source files in {folder}", found.len());
    found
}
