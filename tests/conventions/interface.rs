//! The public interface stays small: the names that the documentation of all crates shows are counted on the syntax
//! trees, and there is a ceiling (ARCHITECTURE.md, "Public interface").
//!
//! A name is an item of a module: a module, type, trait, function, constant or macro; methods and fields are not
//! counted. What several modules hand out counts once. Items and re-exports marked `#[doc(hidden)]`, and everything
//! that is reached only through them, are not shown.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::{Attribute, Item, UseTree, Visibility};

use crate::root;

const CEILING: usize = 160;

/// Every crate of the workspace by the name in `use`, and its root file.
const CRATES: &[(&str, &str)] = &[
    ("skiagraph", "src/lib.rs"),
    ("skiagraph_core", "crates/core/src/lib.rs"),
    ("skiagraph_eval", "crates/eval/src/lib.rs"),
    ("skiagraph_physics", "crates/physics/src/lib.rs"),
    ("skiagraph_report", "crates/report/src/lib.rs"),
    ("skiagraph_robots", "robots/lib.rs"),
    ("skiagraph_set", "crates/set/src/lib.rs"),
    ("skiagraph_track", "crates/track/src/lib.rs"),
    ("skiagraph_truth", "crates/truth/src/lib.rs"),
];

#[test]
fn the_documentation_shows_few_names() {
    let shown = Interface::read().shown();
    assert!(shown.len() > 100, "found only {} names: the walk misses some", shown.len());
    if let Err(complaint) = check(&shown) {
        panic!("{complaint}");
    }
}

#[test]
fn names_above_the_ceiling_are_refused() {
    let mut interface = Interface::read();
    let shown = interface.shown();
    let planted: String = (shown.len()..=CEILING).map(|number| format!("pub fn planted_{number}() {{}}")).collect();
    interface.extend("skiagraph_eval", &planted);
    let complaint = check(&interface.shown()).unwrap_err();
    assert!(
        complaint.contains("161 names, at most 160") && complaint.contains("skiagraph_eval::planted_"),
        "{complaint}"
    );
}

#[test]
fn hidden_names_are_not_counted_and_the_others_once() {
    let mut interface = Interface::default();
    interface.extend(
        "a",
        "pub mod open { pub use super::closed::Both; pub struct Own; #[doc(hidden)] pub struct Hidden; struct Private;
                        pub(crate) fn inner() {} #[cfg(test)] pub fn tested() {} }
         mod closed { pub struct Both; pub struct Renamed; pub struct Unreached; }
         pub use open::Both; pub use closed::Renamed as Other;
         #[doc(hidden)] pub mod hidden { pub struct Inside; pub struct Handed; }
         pub use hidden::Handed; #[doc(hidden)] pub use closed::Unreached;",
    );
    interface.extend(
        "b",
        "pub use a::open; pub use a::open::Own as Again; pub mod all { pub use a::open::*; pub fn new() {} }",
    );
    let shown: Vec<String> = interface.shown().into_iter().collect();
    let expected = ["a::closed::Both", "a::closed::Renamed", "a::hidden::Handed", "a::open", "a::open::Own", "b::all"];
    assert_eq!(shown, [&expected[..], &["b::all::new"]].concat());
}

#[test]
fn every_crate_of_the_workspace_is_counted() {
    let manifest: toml::Table = std::fs::read_to_string(root().join("Cargo.toml")).unwrap().parse().unwrap();
    let members = manifest["workspace"]["members"].as_array().unwrap();
    let folders = members.iter().map(|member| member.as_str().unwrap());
    let folders: BTreeSet<&str> = folders.filter(|folder| !folder.starts_with("tests/")).collect();
    let counted = CRATES.iter().map(|(_, file)| file.trim_end_matches("lib.rs").trim_end_matches("src/"));
    assert_eq!(
        counted.map(|folder| folder.trim_end_matches('/')).filter(|f| !f.is_empty()).collect::<BTreeSet<_>>(),
        folders
    );
}

/// Refuses more names than the ceiling.
fn check(shown: &BTreeSet<String>) -> Result<(), String> {
    if shown.len() <= CEILING {
        return Ok(());
    }
    let names: Vec<&str> = shown.iter().map(String::as_str).collect();
    Err(format!(
        "the documentation shows {} names, at most {CEILING} are allowed. Hide what users do not need: `pub(crate)` if \
         only its own crate uses it, `#[doc(hidden)]` on the re-export if other crates, tests or studies do \
         (ARCHITECTURE.md, \"Public interface\"). All names:\n{}",
        names.len(),
        names.join("\n")
    ))
}

/// The modules of all crates, by path: `["skiagraph_core", "body"]`.
#[derive(Default)]
struct Interface {
    modules: BTreeMap<Vec<String>, Vec<Item>>,
}

#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Target {
    Module(Vec<String>),
    /// An item that is no module, by the path of its definition.
    Other(Vec<String>),
}

impl Interface {
    fn read() -> Self {
        let mut interface = Self::default();
        for (name, file) in CRATES {
            interface.read_module(vec![(*name).to_owned()], &root().join(file));
        }
        interface
    }

    fn read_module(&mut self, path: Vec<String>, file: &Path) {
        let code = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let tree = syn::parse_file(&code).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        self.add(path, tree.items, Some(file));
    }

    /// Adds items to a crate's root.
    fn extend(&mut self, name: &str, code: &str) {
        self.add(vec![name.to_owned()], syn::parse_file(code).unwrap().items, None);
    }

    fn add(&mut self, path: Vec<String>, items: Vec<Item>, file: Option<&Path>) {
        for item in items {
            if is_for_tests(attributes(&item)) {
                continue;
            }
            if let Item::Mod(module) = &item {
                let inner = [path.clone(), vec![module.ident.to_string()]].concat();
                match (&module.content, file) {
                    (Some((_, items)), _) => self.add(inner, items.clone(), None),
                    (None, Some(file)) => self.read_module(inner, &file_of(file, &module.ident.to_string())),
                    (None, None) => panic!("{}: a module of its own file in one without", inner.join("::")),
                }
            }
            self.modules.entry(path.clone()).or_default().push(item);
        }
        self.modules.entry(path).or_default();
    }

    /// The names that the documentation of all crates shows, each by the path of its definition.
    fn shown(&self) -> BTreeSet<String> {
        let mut names = BTreeSet::new();
        let mut seen = BTreeSet::new();
        for path in self.modules.keys().filter(|path| path.len() == 1) {
            self.collect(path, &mut names, &mut seen);
        }
        names
    }

    fn collect(&self, module: &[String], names: &mut BTreeSet<String>, seen: &mut BTreeSet<Vec<String>>) {
        if !seen.insert(module.to_vec()) {
            return;
        }
        for item in &self.modules[module] {
            if is_hidden(attributes(item)) || !is_public(item) {
                continue;
            }
            if let Item::Use(import) = item {
                for (path, is_glob) in paths(&import.tree) {
                    match self.resolve(module, &path) {
                        Some(Target::Module(target)) if is_glob => self.collect(&target, names, seen),
                        // another crate of the workspace, whose names are counted there
                        Some(Target::Module(target)) if target.len() == 1 => {}
                        Some(Target::Module(target)) => {
                            names.insert(target.join("::"));
                            self.collect(&target, names, seen);
                        }
                        Some(Target::Other(target)) => _ = names.insert(target.join("::")),
                        None => _ = names.insert(path.join("::")),
                    }
                }
                continue;
            }
            let Some(name) = name(item) else { continue };
            let path = [module, &[name]].concat();
            names.insert(path.join("::"));
            if matches!(item, Item::Mod(_)) {
                self.collect(&path, names, seen);
            }
        }
    }

    /// What a path in a module leads to, re-exports followed; `None` outside the workspace.
    fn resolve(&self, module: &[String], path: &[String]) -> Option<Target> {
        let (first, rest) = path.split_first()?;
        match first.as_str() {
            "crate" => self.follow(&module[..1], rest),
            "self" => self.follow(module, rest),
            "super" => self.resolve_above(&module[..module.len() - 1], rest),
            _ => self
                .follow(module, path)
                .or_else(|| self.modules.contains_key(&path[..1]).then(|| self.follow(&path[..1], rest)).flatten()),
        }
    }

    fn resolve_above(&self, module: &[String], rest: &[String]) -> Option<Target> {
        if rest.first().is_some_and(|next| next == "super") {
            self.resolve(module, rest)
        } else {
            self.follow(module, rest)
        }
    }

    /// What a path below a module leads to.
    fn follow(&self, module: &[String], path: &[String]) -> Option<Target> {
        let Some((first, rest)) = path.split_first() else { return Some(Target::Module(module.to_vec())) };
        let below = [module, std::slice::from_ref(first)].concat();
        let items = self.modules.get(module)?;
        let is_item = |item: &&Item| name(item).as_deref() == Some(first);
        if rest.is_empty() && items.iter().filter(|item| !matches!(item, Item::Mod(_))).any(|item| is_item(&item)) {
            return Some(Target::Other(below));
        }
        // a function of a module's own name is meant where nothing follows and it is imported
        let imported = || items.iter().find_map(|item| self.imported(module, item, first));
        if rest.is_empty()
            && let Some(found @ Target::Other(_)) = imported()
        {
            return Some(found);
        }
        if self.modules.contains_key(&below) {
            return self.follow(&below, rest);
        }
        match imported()? {
            Target::Module(target) => self.follow(&target, rest),
            other => rest.is_empty().then_some(other),
        }
    }

    /// What an import brings into a module under a name.
    fn imported(&self, module: &[String], item: &Item, wanted: &str) -> Option<Target> {
        let Item::Use(import) = item else { return None };
        let named = leaves(&import.tree).into_iter().filter(|(_, name, _)| name == wanted);
        // an import of the name from itself leads nowhere
        named.map(|(path, _, _)| path).filter(|path| path.len() > 1).find_map(|path| self.resolve(module, &path))
    }
}

fn file_of(parent: &Path, name: &str) -> PathBuf {
    let stem = parent.file_stem().unwrap().to_str().unwrap();
    let folder = parent.parent().unwrap();
    let folder = if matches!(stem, "lib" | "mod") { folder.to_owned() } else { folder.join(stem) };
    let alone = folder.join(format!("{name}.rs"));
    if alone.is_file() { alone } else { folder.join(name).join("mod.rs") }
}

/// The paths of an import, and whether all of a module is imported.
fn paths(tree: &UseTree) -> Vec<(Vec<String>, bool)> {
    leaves(tree).into_iter().map(|(path, _, is_glob)| (path, is_glob)).collect()
}

/// The path of every import in a tree, the name that it brings, and whether it brings all of a module.
fn leaves(tree: &UseTree) -> Vec<(Vec<String>, String, bool)> {
    match tree {
        UseTree::Path(path) => {
            let inner = leaves(&path.tree).into_iter();
            let below = |(rest, name, is_glob): (Vec<String>, String, bool)| {
                let name = if name == "self" { path.ident.to_string() } else { name };
                ([vec![path.ident.to_string()], rest].concat(), name, is_glob)
            };
            inner.map(below).collect()
        }
        UseTree::Name(name) if name.ident == "self" => vec![(Vec::new(), "self".to_owned(), false)],
        UseTree::Name(name) => vec![(vec![name.ident.to_string()], name.ident.to_string(), false)],
        UseTree::Rename(rename) => vec![(vec![rename.ident.to_string()], rename.rename.to_string(), false)],
        UseTree::Glob(_) => vec![(Vec::new(), "*".to_owned(), true)],
        UseTree::Group(group) => group.items.iter().flat_map(leaves).collect(),
    }
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn name(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Mod(item) => &item.ident,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(ident.to_string())
}

fn is_public(item: &Item) -> bool {
    let visibility = match item {
        Item::Const(item) => &item.vis,
        Item::Enum(item) => &item.vis,
        Item::Fn(item) => &item.vis,
        Item::Macro(item) => return item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export")),
        Item::Mod(item) => &item.vis,
        Item::Static(item) => &item.vis,
        Item::Struct(item) => &item.vis,
        Item::Trait(item) => &item.vis,
        Item::Type(item) => &item.vis,
        Item::Union(item) => &item.vis,
        Item::Use(item) => &item.vis,
        _ => return false,
    };
    matches!(visibility, Visibility::Public(_))
}

fn is_hidden(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("doc") && a.parse_args::<syn::Ident>().is_ok_and(|i| i == "hidden"))
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("cfg") && a.parse_args::<syn::Ident>().is_ok_and(|i| i == "test"))
}
