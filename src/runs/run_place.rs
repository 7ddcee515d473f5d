//! Where the results of a run go.

use std::path::{Path, PathBuf};

use crate::artefacts::{ArtefactKind, MadeBy, is_signed, sibling};
use crate::common::ExperimentError;
use crate::prepare::scenario_copy::made_by_run;
use crate::scenario::Scenario;

/// Where results go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunPlace {
    pub path: PathBuf,
    /// A note if results of another scenario, or of other settings, are avoided.
    pub note: Option<String>,
}

impl RunPlace {
    /// The `given` place; else `runs/NAME`, or, if that has another run, the first of `runs/NAME-2` and so on that is
    /// free or has results of the same scenario with the same settings. Another run at a given place is refused later,
    /// when the output is begun.
    pub fn new(scenario: &Scenario, given: Option<&Path>) -> Result<Self, ExperimentError> {
        if let Some(path) = given {
            return Ok(Self { path: path.to_owned(), note: None });
        }
        let first = Path::new("runs").join(&scenario.name);
        Ok(Self::first_free(&first, &made_by_run(scenario)?))
    }

    fn first_free(first: &Path, made_by: &MadeBy) -> Self {
        let is_other = |path: &Path| is_signed(path) && made_by.difference_at(path).is_some();
        let path = free_place(first, is_other);
        let note = format!(
            "{} has results of another scenario or of other settings; results were written to {}",
            first.display(),
            path.display()
        );
        Self { note: (path != first).then_some(note), path }
    }
}

/// `NAME`, or, if it has another result of this program, the first of `NAME-2` and so on that is free or has the same
/// result. Files of others at `NAME` are refused later, or moved aside with --force.
pub(super) fn free_place(first: &Path, is_other: impl Fn(&Path) -> bool) -> PathBuf {
    if !is_other(first) {
        return first.to_owned();
    }
    let is_free = |path: &PathBuf| path.symlink_metadata().is_err() || ArtefactKind::Run.is_own(path);
    let mut further = (2..).map(|number: u32| sibling(first, "", &format!("-{number}")));
    further.find(|path| is_free(path) && !is_other(path)).unwrap_or_else(|| first.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefacts::{MADE_BY, sign};
    use serde_json::json;
    use std::fs;

    #[test]
    fn results_go_to_a_free_place_or_that_of_the_same_scenario() {
        let root = tempfile::tempdir().unwrap();
        let made_by = |name: &str| MadeBy::new("skiagraph run", json!({"name": name}));
        let run = |place: &str, name: &str| {
            fs::create_dir(root.path().join(place)).unwrap();
            fs::write(root.path().join(place).join(MADE_BY), made_by(name).text().unwrap()).unwrap();
            sign(&root.path().join(place)).unwrap();
        };
        let place = |name: &str| {
            let place = RunPlace::first_free(&root.path().join("walk"), &made_by(name));
            (place.path.file_name().unwrap().to_str().unwrap().to_owned(), place.note)
        };
        assert_eq!(place("one"), ("walk".to_owned(), None));
        run("walk", "one");
        assert_eq!(place("one"), ("walk".to_owned(), None));
        let (name, note) = place("two");
        assert!(
            name == "walk-2" && note.as_ref().unwrap().contains("walk has results of another scenario"),
            "{note:?}"
        );
        fs::create_dir(root.path().join("walk-2")).unwrap();
        assert_eq!(place("two").0, "walk-2", "an empty directory is free");
        fs::write(root.path().join("walk-2/thesis.tex"), "years of work").unwrap();
        run("walk-3", "two");
        assert_eq!(place("two").0, "walk-3");
        assert_eq!(place("three").0, "walk-4");
    }
}
