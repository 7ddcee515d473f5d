//! Rules about dependencies that the compiler cannot check: which crate depends on which is compared with the
//! manifests; which room of a crate may use which other room, and where certain external crates may be used, is checked
//! on the syntax tree of every source file (ARCHITECTURE.md has both tables).
//!
//! A room is a top-level module of a crate; the crates that [`WHOLE`] gives a name are one room each. The check sees
//! imports in every form (grouped, renamed, `self`, `super::`, `crate::` within code or inside a macro), re-exports,
//! and public aliases of another room's types.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Item, UseTree, Visibility};

use crate::root;

/// Each package, and the packages of this workspace that it or its tests depend on.
const DEPENDS_ON: &[(&str, &[&str])] = &[
    ("robots", &[]),
    ("crates/core", &["robots"]),
    ("crates/track", &["core"]),
    ("crates/eval", &["core"]),
    ("crates/physics", &["core"]),
    ("crates/truth", &["core"]),
    ("crates/set", &["core", "truth"]),
    (".", &["core", "eval", "physics", "set", "track", "truth"]),
];

/// Folders with sources, and the room's name if the whole folder is one room.
const WHOLE: &[(&str, Option<&str>)] = &[
    ("crates/core/src", None),
    ("crates/track/src", None),
    ("crates/truth/src", None),
    ("crates/eval/src", Some("evaluation")),
    ("crates/physics/src", Some("physics")),
    ("crates/set/src", Some("benchmark_set")),
    ("src", None),
];

/// Each room, and the rooms of its own crate that it may use. The manifests govern which other crates it may use.
const MAY_USE: &[(&str, &[&str])] = &[
    ("rng", &[]),
    ("parallel", &[]),
    ("simd", &[]),
    ("input", &[]),
    ("npz", &["input"]),
    ("camera", &["input"]),
    ("raster", &["simd", "camera", "rng"]),
    ("body", &["raster", "camera", "rng", "input"]),
    ("contact", &["body", "raster", "simd", "parallel", "input"]),
    ("dynamics", &["contact", "body", "parallel", "input"]),
    ("observation", &["camera", "raster", "body"]),
    ("mocap", &[]),
    ("retarget", &["mocap"]),
    ("editing", &[]),
    ("scene", &[]),
    ("observing", &["scene"]),
    ("motion_model", &[]),
    ("tracker", &["motion_model"]),
    ("evaluation", &[]),
    ("physics", &[]),
    ("benchmark_set", &[]),
    ("artefacts", &[]),
    ("scenario", &[]),
    ("report", &[]),
    ("common", &["artefacts", "scenario", "report"]),
    ("prepare", &["common", "artefacts", "scenario"]),
    ("external", &["common", "artefacts", "scenario"]),
    ("measure", &["common", "prepare", "external", "scenario", "report"]),
    ("train", &["common", "prepare", "artefacts", "scenario"]),
    ("inspect", &["common", "prepare", "measure", "train", "artefacts", "scenario", "report"]),
];

/// Rooms of the application that know every other.
const FREE: &[&str] = &["experiment", "explain", "sweep", "interface", "cli"];

/// External crates and modules that only some files may use: the beginning of the path, and those files.
const SEAMS: &[(&str, &[&str])] = &[
    ("rapier3d", &["physics"]),
    ("parry3d", &["contact"]),
    ("urdf_rs", &["body/urdf"]),
    ("exr", &["benchmark_set/exr_layers.rs"]),
    ("half", &["benchmark_set/exr_layers.rs"]),
    ("tar", &["benchmark_set/samples.rs"]),
    ("serde_saphyr", &["camera/files"]),
    ("clap", &["cli"]),
    ("image", &["experiment/pictures.rs", "observing/imaging/jpeg.rs"]),
    ("tiny_skia", &["report", "sweep/page/picture.rs"]),
    ("ab_glyph", &["report"]),
    ("faer", &["motion_model"]),
    ("pulp", &["simd"]),
    ("sha2", &["input"]),
    ("signal_hook", &["cli/interrupt.rs"]),
    ("rustix", &["benchmark_set/set_writer.rs", "artefacts/place.rs", "external/program.rs", "sweep/cell.rs"]),
    (
        "std::fs",
        &[
            "input",
            "mocap",
            "body/urdf",
            "benchmark_set",
            "artefacts",
            "report",
            "prepare",
            "external",
            "experiment",
            "explain",
            "sweep",
            "scenario/similar_file.rs",
            // in their tests
            "body/skin/skin_file.rs",
            "scenario/named_on_command_line.rs",
            "scenario/survey.rs",
            "cli",
        ],
    ),
    ("std::time", &["external", "train", "experiment", "sweep", "cli"]),
];

#[test]
fn packages_have_the_dependencies_of_the_table() {
    for (folder, expected) in DEPENDS_ON {
        let manifest = root().join(folder).join("Cargo.toml");
        let manifest: toml::Table = std::fs::read_to_string(manifest).unwrap().parse().unwrap();
        let mut found = BTreeSet::new();
        let mut tables = vec![&manifest];
        while let Some(table) = tables.pop() {
            for (key, value) in table.iter().filter(|(key, _)| *key != "workspace") {
                match value.as_table() {
                    Some(names) if key.ends_with("dependencies") => {
                        found.extend(names.keys().map(String::as_str));
                        // the package's name, in case the dependency is renamed
                        found.extend(names.values().filter_map(|value| value.get("package")?.as_str()));
                    }
                    Some(inner) => tables.push(inner),
                    None => {}
                }
            }
        }
        let own: Vec<&str> = found.iter().filter_map(|name| name.strip_prefix("skiagraph-")).collect();
        assert_eq!(own, *expected, "{folder}/Cargo.toml");
        let has = |name: &str| found.contains(name);
        assert!(*folder == "." || has("rapier3d") == (*folder == "crates/physics"), "{folder}/Cargo.toml: rapier3d");
        assert!(*folder == "." || has("faer") == (*folder == "crates/track"), "{folder}/Cargo.toml: faer");
    }
}

#[test]
fn no_room_uses_a_room_that_the_table_forbids() {
    let complaints: Vec<String> = sources().iter().flat_map(|(file, code)| complaints_about(file, code)).collect();
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
}

#[test]
fn every_permission_and_every_seam_is_used() {
    let mut used = BTreeSet::new();
    let mut crossed = BTreeSet::new();
    for (file, code) in sources() {
        let imports = imports_of(&file, &code);
        let room = imports.module_root();
        for path in &imports.paths {
            if let [first, target, ..] = &path[..]
                && first == "crate"
            {
                used.insert((room.clone(), target.clone()));
            }
            let seams = SEAMS.iter().filter(|(foreign, _)| begins_with(path, foreign));
            let places = seams.flat_map(|(foreign, places)| places.iter().map(move |place| (*foreign, *place)));
            crossed.extend(places.filter(|(_, place)| file.starts_with(place)));
        }
    }
    let permissions = MAY_USE.iter().flat_map(|(room, allowed)| allowed.iter().map(move |target| (*room, *target)));
    let unused = permissions.filter(|(room, target)| !used.contains(&(room.to_string(), target.to_string())));
    assert_eq!(unused.collect::<Vec<_>>(), [], "permissions that nothing uses");
    let seams = SEAMS.iter().flat_map(|(foreign, places)| places.iter().map(move |place| (*foreign, *place)));
    let unused = seams.filter(|seam| !crossed.contains(seam));
    assert_eq!(unused.collect::<Vec<_>>(), [], "seams that no file uses");
}

#[test]
fn no_files_import_each_other_in_a_cycle() {
    let production = |code: &str| {
        let mut tree = syn::parse_file(code).unwrap();
        tree.items.retain(|item| !is_for_tests(item));
        tree
    };
    let found: Vec<(String, Imports)> =
        sources().into_iter().map(|(file, code)| (file.clone(), imports_in(&file, &production(&code)))).collect();
    let modules: BTreeMap<Vec<String>, &Imports> = found.iter().map(|(file, i)| (module_of(file), i)).collect();
    // a module that only re-exports what its files define is not part of a cycle
    let is_link = |file: &str| !["mod.rs", "lib.rs", "main.rs"].iter().any(|name| file.ends_with(name));
    let links: BTreeSet<Vec<String>> =
        found.iter().filter(|(file, _)| is_link(file)).map(|(f, _)| module_of(f)).collect();
    let mut graph: BTreeMap<Vec<String>, BTreeSet<Vec<String>>> = BTreeMap::new();
    for module in &links {
        let targets = modules[module].paths.iter().filter_map(|path| defining_module(path, &modules, 0));
        graph.insert(module.clone(), targets.filter(|target| target != module && links.contains(target)).collect());
    }
    let spelled = |modules: &[Vec<String>]| modules.iter().map(|m| m.join("/")).collect::<Vec<_>>().join(" -> ");
    let cycles: Vec<String> = links.iter().filter_map(|m| path_back(m, &graph)).map(|c| spelled(&c)).collect();
    assert_eq!(cycles, [] as [String; 0], "imports in a cycle");
}

/// Whether an item is compiled only for tests.
fn is_for_tests(item: &Item) -> bool {
    let attributes = match item {
        Item::Mod(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        _ => return false,
    };
    attributes.iter().any(|a| a.path().is_ident("cfg") && a.parse_args::<syn::Ident>().is_ok_and(|i| i == "test"))
}

/// The module that defines the item of a path `crate::...`, through re-exports.
fn defining_module(path: &[String], modules: &BTreeMap<Vec<String>, &Imports>, followed: usize) -> Option<Vec<String>> {
    let path = path.strip_prefix(&["crate".to_owned()])?;
    let length = (1..=path.len()).rev().find(|&length| modules.contains_key(&path[..length]))?;
    let (module, rest) = path.split_at(length);
    let re_exported = rest.first().filter(|_| followed < 5).and_then(|name| {
        // in a mod.rs, a path into its own files may begin without `self::`
        let inside = |found: &Vec<String>| match modules.contains_key(&[module, &found[..1]].concat()) {
            true => [&["crate".to_owned()], module, &found[..]].concat(),
            false => found.clone(),
        };
        let mut uses = modules[module].paths.iter().filter(|found| found.len() > 1 && found.last() == Some(name));
        uses.find_map(|found| defining_module(&inside(found), modules, followed + 1)).filter(|m| m != module)
    });
    Some(re_exported.unwrap_or_else(|| module.to_vec()))
}

/// The shortest path from a module to itself.
fn path_back(from: &[String], graph: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Option<Vec<Vec<String>>> {
    let mut paths = std::collections::VecDeque::from([vec![from.to_vec()]]);
    let mut seen = BTreeSet::new();
    while let Some(path) = paths.pop_front() {
        for next in path.last().and_then(|last| graph.get(last)).into_iter().flatten() {
            let longer = [path.clone(), vec![next.clone()]].concat();
            if next == from {
                return Some(longer);
            }
            if seen.insert(next.clone()) {
                paths.push_back(longer);
            }
        }
    }
    None
}

/// `crates/track` can use only its dependencies and their dependencies.
#[test]
fn trackers_cannot_use_the_truth() {
    let of = |package: &str| {
        let found = DEPENDS_ON.iter().find(|(folder, _)| folder.ends_with(package)).unwrap();
        found.1.iter().copied()
    };
    let mut reached: BTreeSet<&str> = of("track").collect();
    let further: Vec<&str> = reached.iter().flat_map(|package| of(package)).collect();
    reached.extend(further);
    assert_eq!(reached, BTreeSet::from(["core", "robots"]));
    let rooms: BTreeSet<String> = rooms_below("crates/core/src").into_iter().collect();
    for truth in ["scene", "mocap", "observing", "benchmark_set", "prepare", "evaluation", "retarget"] {
        assert!(!rooms.contains(truth), "crates/core, which trackers can use, contains {truth}");
    }
}

#[test]
fn every_room_is_in_the_table_and_nothing_else() {
    let mut found: BTreeSet<String> = BTreeSet::new();
    for (folder, whole) in WHOLE {
        match whole {
            Some(room) => _ = found.insert((*room).to_owned()),
            None => found.extend(rooms_below(folder)),
        }
    }
    let named = MAY_USE.iter().map(|(room, _)| *room).chain(FREE.iter().copied());
    assert_eq!(found, named.map(str::to_owned).collect());
}

/// The modules at the root of a crate.
fn rooms_below(folder: &str) -> Vec<String> {
    let src = root().join(folder);
    let name = |entry: std::fs::DirEntry| entry.path().file_stem().unwrap().to_str().unwrap().to_owned();
    let found = std::fs::read_dir(src).unwrap().map(|entry| name(entry.unwrap()));
    found.filter(|name| name != "lib" && name != "main").collect()
}

#[test]
fn every_form_of_a_forbidden_import_is_seen() {
    for code in [
        "use crate::tracker::Estimate;",
        "use crate::{body::Pose, tracker};",
        "use crate::{body::Pose, tracker as stage};",
        "use crate::{tracker::{Estimate, Frozen}};",
        "use super::tracker::Estimate;",
        "use super::{body::Pose, tracker::Estimate as G};",
        "pub use crate::tracker::Estimate;",
        "pub(crate) use super::tracker::*;",
        "fn f(_: &crate::tracker::Estimate) {}",
        "fn f() { let _ = super::tracker::Estimate::default(); }",
        "fn f() { println!(\"{:?}\", crate::tracker::Estimate::default()); }",
        "mod inner { fn f() -> super::super::tracker::Estimate { todo!() } }",
        "mod inner { use super::super::{tracker::Estimate}; }",
        "use crate as root;",
        "use crate::*;",
        "use super::*;",
        "use skiagraph::tracker::Estimate;",
        "use skiagraph_track::tracker::Estimate;",
        "use crate::Estimate;",
        "impl From<crate::tracker::Estimate> for u8 { fn from(_: crate::tracker::Estimate) -> u8 { 0 } }",
        "#[path = \"../scene/mod.rs\"] mod stage;",
        "pub type Posture = crate::body::Pose;",
        "pub use crate::body::Pose;",
    ] {
        assert!(!complaints_about("motion_model/mod.rs", code).is_empty(), "not seen: {code}");
    }
    assert!(!complaints_about("motion_model/gpdm/train.rs", "use super::super::super::tracker::Estimate;").is_empty());
}

#[test]
fn allowed_imports_are_accepted() {
    for (file, code) in [
        ("tracker/mod.rs", "use crate::body::{Humanoid, Pose}; use crate::motion_model::MotionModel;"),
        (
            "benchmark_set/set.rs",
            "use crate::SetError; use crate::files::SetFiles; use super::export; use crate::scene;",
        ),
        ("tracker/estimate.rs", "use super::Tracker; fn f() -> super::super::body::Pose { crate::body::zero() }"),
        ("tracker/mod.rs", "mod estimate; pub use estimate::Estimate; #[cfg(test)] mod tests { use super::*; }"),
        ("experiment/run.rs", "use crate::{scene, tracker, mocap};"),
        ("body/urdf.rs", "use std::fs; use urdf_rs::Robot;"),
    ] {
        assert_eq!(complaints_about(file, code), Vec::<String>::new(), "{file}: {code}");
    }
}

#[test]
fn external_crates_are_used_only_at_their_seams() {
    assert!(!complaints_about("scene/mod.rs", "use rapier3d::prelude::*;").is_empty());
    assert!(!complaints_about("tracker/mod.rs", "fn f() { let _ = std::time::Instant::now(); }").is_empty());
    assert!(!complaints_about("evaluation/mod.rs", "use std::{fs::File, io};").is_empty());
    assert!(!complaints_about("body/pose.rs", "use urdf_rs as u;").is_empty());
    assert!(!complaints_about("contact/mod.rs", "use rapier3d::prelude::*;").is_empty());
    assert!(complaints_about("physics/mod.rs", "use rapier3d::prelude::*;").is_empty());
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Every source file: its path, beginning with its room (mostly the path below `src/` of its crate), and its text.
fn sources() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for (folder, whole) in WHOLE {
        let src = root().join(folder);
        for file in rust_files(&src) {
            let below = file.strip_prefix(&src).unwrap().to_str().unwrap().replace('\\', "/");
            let relative = match whole {
                Some(room) if below == "lib.rs" => format!("{room}/mod.rs"),
                Some(room) => format!("{room}/{below}"),
                // lib.rs holds only the crate's documentation and its list of modules
                None if below == "lib.rs" => continue,
                None => below,
            };
            found.push((relative, std::fs::read_to_string(&file).unwrap()));
        }
    }
    assert!(found.len() > 10, "found only {} source files", found.len());
    found
}

/// The crate of a room, by its place in [`WHOLE`].
fn crate_of(room: &str) -> Option<usize> {
    static CRATES: LazyLock<BTreeMap<String, usize>> = LazyLock::new(|| {
        let rooms = |(folder, whole): &(&str, Option<&str>)| match whole {
            Some(own) => vec![(*own).to_owned()],
            None => rooms_below(folder),
        };
        WHOLE.iter().enumerate().flat_map(|(at, own)| rooms(own).into_iter().map(move |room| (room, at))).collect()
    });
    CRATES.get(room).copied()
}

fn imports_of(relative: &str, code: &str) -> Imports {
    imports_in(relative, &syn::parse_file(code).unwrap_or_else(|e| panic!("{relative}: {e}")))
}

fn imports_in(relative: &str, tree: &syn::File) -> Imports {
    let mut imports = Imports { module: module_of(relative), paths: Vec::new(), complaints: Vec::new() };
    imports.visit_file(tree);
    // a crate that is one room has its files at the crate's root, next to the rooms that it imports from other crates
    if let Some(room) = imports.module.first().filter(|room| is_whole(room)).cloned() {
        let is_known = |name: &str| name == room || crate_of(name).is_some() || name.starts_with("test_");
        for path in imports.paths.iter_mut().filter(|path| path[0] == "crate") {
            match path.get(1).map(String::as_str) {
                Some(first) if is_known(first) => {}
                _ => path.insert(1, room.clone()),
            }
            // imported at the root and used in a file below it
            if path.len() > 2 && path[1] == room && crate_of(&path[2]).is_some() {
                path.remove(1);
            }
        }
    }
    imports
}

fn is_whole(room: &str) -> bool {
    WHOLE.iter().any(|(_, whole)| *whole == Some(room))
}

/// The violations of the layering rules by `code`, as if it were the file `relative` below `src/`.
fn complaints_about(relative: &str, code: &str) -> Vec<String> {
    let visitor = imports_of(relative, code);
    let room = visitor.module_root();
    let mut complaints: BTreeSet<String> = visitor.complaints.iter().map(|c| format!("{relative}: {c}")).collect();
    for path in &visitor.paths {
        if let Some(complaint) = violation(relative, &room, path) {
            complaints.insert(format!("{relative}: {complaint}"));
        }
    }
    complaints.into_iter().collect()
}

/// Module path of a file below `src/`: `tracker/estimate.rs` is `["tracker", "estimate"]`.
fn module_of(relative: &str) -> Vec<String> {
    let mut parts: Vec<String> = relative.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if matches!(parts.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        parts.pop();
    }
    parts
}

fn violation(relative: &str, room: &str, path: &[String]) -> Option<String> {
    let spelled = path.join("::");
    if path[0] == "crate" {
        let Some(target) = path.get(1) else { return Some(format!("`{spelled}` refers to the whole crate")) };
        if room.is_empty() || target == room || FREE.contains(&room) || target.starts_with("test_") {
            return None;
        }
        let Some(of) = crate_of(target) else {
            return Some(format!("`{spelled}` is not a room: import from rooms, not from the crate's root"));
        };
        if Some(of) != crate_of(room) {
            return None;
        }
        let allowed = MAY_USE.iter().find(|(r, _)| *r == room)?.1;
        return (!allowed.contains(&target.as_str()))
            .then(|| format!("room {room} may not use {target} (`{spelled}`)"));
    }
    SEAMS
        .iter()
        .find(|(foreign, places)| begins_with(path, foreign) && !places.iter().any(|p| relative.starts_with(p)))
        .map(|(foreign, places)| format!("{foreign} may only be used in {places:?} (`{spelled}`)"))
}

/// Whether a path is this external crate or module, or something in it.
fn begins_with(path: &[String], foreign: &str) -> bool {
    let begins: Vec<&str> = foreign.split("::").collect();
    path.len() >= begins.len() && path.iter().zip(&begins).all(|(a, b)| a == b)
}

/// Collects every path of a file; relative ones are resolved to `crate::...`.
struct Imports {
    module: Vec<String>,
    paths: Vec<Vec<String>>,
    complaints: Vec<String>,
}

impl Imports {
    fn module_root(&self) -> String {
        self.module.first().cloned().unwrap_or_default()
    }

    /// Notes a path, with `super` and `self` at its beginning resolved.
    fn note(&mut self, segments: &[String]) {
        let Some(first) = segments.first() else { return };
        let resolved = match first.as_str() {
            "crate" | "skiagraph" | "skiagraph_core" | "skiagraph_track" | "skiagraph_truth" => {
                [vec!["crate".to_owned()], segments[1..].to_vec()].concat()
            }
            "super" | "self" => {
                let mut base = self.module.clone();
                let mut rest = segments;
                while let Some((head, tail)) = rest.split_first() {
                    match head.as_str() {
                        "super" => drop(base.pop()),
                        "self" => {}
                        _ => break,
                    }
                    rest = tail;
                }
                [vec!["crate".to_owned()], base, rest.to_vec()].concat()
            }
            _ => segments.to_vec(),
        };
        self.paths.push(resolved);
    }

    fn note_use(&mut self, prefix: &[String], tree: &UseTree, public: bool) {
        match tree {
            UseTree::Path(path) => {
                self.note_use(&[prefix, &[path.ident.to_string()]].concat(), &path.tree, public);
            }
            UseTree::Name(name) if name.ident == "self" => self.note_import(prefix.to_vec(), public),
            UseTree::Name(name) => self.note_import([prefix, &[name.ident.to_string()]].concat(), public),
            UseTree::Rename(rename) if rename.ident == "self" => self.note_import(prefix.to_vec(), public),
            UseTree::Rename(rename) => self.note_import([prefix, &[rename.ident.to_string()]].concat(), public),
            UseTree::Glob(_) => self.note_import(prefix.to_vec(), public),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.note_use(prefix, tree, public)),
        }
    }

    fn note_import(&mut self, segments: Vec<String>, public: bool) {
        self.note(&segments);
        self.reject_re_export(public, "re-exports");
    }

    /// A room must not re-export or alias another room's items.
    fn reject_re_export(&mut self, public: bool, verb: &str) {
        let room = self.module_root();
        let Some(path) = self.paths.last() else { return };
        if public && !room.is_empty() && path[0] == "crate" && path.get(1).is_some_and(|target| *target != room) {
            self.complaints.push(format!("{verb} `{}` of another room", path.join("::")));
        }
    }

    fn note_tokens(&mut self, tokens: TokenStream) {
        let flat: Vec<TokenTree> = tokens.into_iter().collect();
        let mut i = 0;
        while i < flat.len() {
            match &flat[i] {
                TokenTree::Group(group) => self.note_tokens(group.stream()),
                TokenTree::Ident(ident) => {
                    let mut segments = vec![ident.to_string()];
                    while let (Some(TokenTree::Punct(a)), Some(TokenTree::Punct(b)), Some(TokenTree::Ident(next))) =
                        (flat.get(i + 1), flat.get(i + 2), flat.get(i + 3))
                    {
                        if a.as_char() != ':' || b.as_char() != ':' {
                            break;
                        }
                        segments.push(next.to_string());
                        i += 3;
                    }
                    if segments.len() > 1 {
                        self.note(&segments);
                    }
                }
                _ => {}
            }
            i += 1;
        }
    }
}

impl<'ast> Visit<'ast> for Imports {
    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            Item::Use(import) => {
                let public = !matches!(import.vis, Visibility::Inherited);
                self.note_use(&[], &import.tree, public);
                return;
            }
            Item::Mod(module) => {
                let is_for_tests = module.ident.to_string().starts_with("test_");
                if !is_for_tests && module.attrs.iter().any(|a| a.path().is_ident("path")) {
                    self.complaints.push(format!("module `{}` is loaded from elsewhere by #[path]", module.ident));
                }
                self.module.push(module.ident.to_string());
                visit::visit_item_mod(self, module);
                self.module.pop();
                return;
            }
            Item::ExternCrate(krate) => self.complaints.push(format!("`extern crate {}`", krate.ident)),
            _ => {}
        }
        visit::visit_item(self, item);
        if let Item::Type(alias) = item
            && !matches!(alias.vis, Visibility::Inherited)
            && let syn::Type::Path(path) = &*alias.ty
        {
            let segments: Vec<String> = path.path.segments.iter().map(|s| s.ident.to_string()).collect();
            self.note(&segments);
            self.reject_re_export(true, "aliases");
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if segments.len() > 1 {
            self.note(&segments);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, mac: &'ast syn::Macro) {
        self.note_tokens(mac.tokens.clone());
        visit::visit_macro(self, mac);
    }
}
